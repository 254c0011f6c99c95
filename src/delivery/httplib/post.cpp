#include "src/delivery/httplib/post.hpp"

#include <httplib.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>
#include <utility>

#include <lrt/version.hpp>

#include "src/base/ascii.hpp"

namespace lrt::delivery {
namespace {

// What a receiver may send before it is taken for hostile. cpp-httplib itself has no bound for a line, for their number, or for what a
// chunk's size line says, and matches the status line with std::regex, which recurses for each byte of it.
constexpr std::size_t head_bytes = 16 * 1024;
constexpr std::size_t status_line_bytes = 512;

/// What cpp-httplib writes to and reads from.
class Bounded final : public httplib::Stream {
 public:
  Bounded(Wire& wire, std::size_t body_bytes, Patience patience)
      : wire_(wire), patience_(patience), most_(head_bytes + 4 * 1024 + 8 * body_bytes) {}  // a chunk of one byte takes six

  bool is_readable() const override { return true; }
  bool is_writable() const override { return true; }
  bool wait_readable() const { return true; }  // pure in later versions
  bool wait_writable() const { return true; }
  time_t duration() const { return 0; }

  ssize_t write(const char* bytes, std::size_t size) override {
    out_.append(bytes, size);  // head and body leave together, as one segment where they fit
    return static_cast<ssize_t>(size);
  }
  ssize_t read(char* to, std::size_t size) override {
    if (at_ == filled_ && !refill()) return error_ ? -1 : 0;
    size = std::min(size, filled_ - at_);
    if (!head_over_ && !look_at_head(buffer_.data() + at_, size)) return -1;
    std::copy_n(buffer_.data() + at_, size, to);
    at_ += size;
    return static_cast<ssize_t>(size);
  }
  void get_remote_ip_and_port(std::string& /*ip*/, int& /*port*/) const override {}
  void get_local_ip_and_port(std::string& /*ip*/, int& /*port*/) const override {}
  socket_t socket() const override { return INVALID_SOCKET; }

  void head_is_over() noexcept { head_over_ = true; }
  bool received_anything() const noexcept { return received_ > 0; }
  /// Everything that came was part of the answer, and the connection is open.
  bool is_clean() const noexcept { return !error_ && !ended_ && at_ == filled_; }
  bool ended() const noexcept { return ended_; }
  const std::optional<Error>& error() const noexcept { return error_; }

 private:
  bool refill() {
    if (!out_.empty()) {
      Result<void> sent = wire_.write(out_, patience_);
      out_.clear();
      // A receiver that answers without reading all of it, and hangs up: the answer may be there.
      if (!sent && sent.error().code != Errc::closed) return fail(std::move(sent).error());
    }
    if (received_ >= most_) return fail({Errc::limit_exceeded, "its answer is too long"});
    Result<std::size_t> got = wire_.read(buffer_.data(), buffer_.size(), patience_);
    if (!got) return fail(std::move(got).error());
    at_ = 0;
    filled_ = *got;
    received_ += *got;
    ended_ = *got == 0;
    return !ended_;
  }
  bool look_at_head(const char* bytes, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) {
      const char c = bytes[i];
      if (++head_ > head_bytes) return fail({Errc::limit_exceeded, "the head of its answer is longer than 16384 bytes"});
      if (line_ < start.size()) is_status_line_ = (line_ == 0 || is_status_line_) && c == start[line_];
      line_ = c == '\n' ? 0 : line_ + 1;
      if (is_status_line_ && line_ > status_line_bytes) return fail({Errc::limit_exceeded, "the status line of its answer is too long"});
    }
    return true;
  }
  bool fail(Error error) {
    if (!error_) error_ = std::move(error);
    return false;
  }

  static constexpr std::string_view start = "HTTP/";
  Wire& wire_;
  Patience patience_;
  std::size_t most_;
  std::string out_;
  std::array<char, 4096> buffer_;
  std::size_t at_ = 0, filled_ = 0, received_ = 0;
  std::size_t head_ = 0, line_ = 0;
  bool is_status_line_ = false;
  bool head_over_ = false;
  bool ended_ = false;
  std::optional<Error> error_;
};

/// The part of cpp-httplib's client that turns a request into bytes and bytes into a response; its sockets are not used.
class Messages final : public httplib::ClientImpl {
 public:
  explicit Messages(const subscription::CallbackUrl& url) : ClientImpl(url.host, url.port) {
    set_keep_alive(true);
    set_follow_location(false);
    set_url_encode(false);  // the target is the URL's, byte by byte
    set_decompress(false);
  }
  using ClientImpl::process_request;
};

bool says_close(const httplib::Response& response) {
  const auto range = response.headers.equal_range("Connection");
  for (auto it = range.first; it != range.second; ++it) {
    std::string_view list = it->second;
    while (!list.empty()) {
      const std::size_t comma = std::min(list.find(','), list.size());
      if (lrt::detail::iequals_ascii(lrt::detail::trim(list.substr(0, comma)), "close")) return true;
      list.remove_prefix(std::min(comma + 1, list.size()));
    }
  }
  return false;
}

/// RFC 9112 6.3: where two readers could see different ends of the answer, what follows it is nobody's answer.
bool is_framed_twice(const httplib::Response& response) {
  const auto lengths = response.headers.count("Content-Length"), codings = response.headers.count("Transfer-Encoding");
  return lengths + codings > 1;
}
bool has_stray_body(const httplib::Response& response) {
  const bool bodyless = response.status == 204 || response.status == 304;
  const std::string length = response.get_header_value("Content-Length");
  return bodyless && (response.headers.count("Transfer-Encoding") != 0 || (!length.empty() && length != "0"));
}

}  // namespace

Answer post(Wire& wire, const subscription::CallbackUrl& url, const subscription::Notification& notification, std::size_t max_response_bytes,
            Patience patience) {
  httplib::Request request;
  request.method = "POST";
  request.path = url.target;
  for (const http::Field& field : notification.fields.list()) request.headers.emplace(std::string(field.name), std::string(field.value));
  for (const char* ours : {"Host", "Connection", "Content-Length", "Transfer-Encoding", "Accept-Encoding"}) request.headers.erase(ours);
  request.headers.emplace("Host", url.authority);
  if (request.headers.count("User-Agent") == 0) request.headers.emplace("User-Agent", "lrt/" LRT_VERSION);
  if (notification.body) request.body = *notification.body;
  if (!notification.secret.empty()) request.headers.emplace("X-Hub-Signature", sign(notification.secret, request.body));

  Bounded stream(wire, max_response_bytes, patience);
  std::uint64_t body = 0;
  request.response_handler = [&](const httplib::Response& /*head*/) {
    stream.head_is_over();
    return true;
  };
  request.content_receiver = [&](const char* /*bytes*/, std::size_t size, std::uint64_t, std::uint64_t) {
    body += size;
    return body <= max_response_bytes;
  };

  httplib::Response response;
  httplib::Error error = httplib::Error::Success;
  const bool complete = Messages(url).process_request(stream, request, response, false, error);
  Answer answer;
  if (complete && !stream.error() && is_framed_twice(response)) {
    answer.error = "its answer has more than one length";
    return answer;
  }
  if (complete && !stream.error() && response.status >= 200) {
    answer.status = response.status;
    answer.keep = stream.is_clean() && !has_stray_body(response) && response.version == "HTTP/1.1" && !says_close(response);
    return answer;
  }
  if (complete && !stream.error()) {  // 102, 103: cpp-httplib takes any but 100 for the answer
    answer.error = "it answered " + std::to_string(response.status) + ", which is no answer";
    return answer;
  }
  const bool closed = stream.ended() || (stream.error() && stream.error()->code == Errc::closed);
  if (stream.error() && stream.error()->code == Errc::timed_out) {
    answer.error = stream.received_anything() ? "its answer was not complete in time" : "it did not answer in time";
  } else if (body > max_response_bytes) {
    answer.error = "its answer is longer than " + std::to_string(max_response_bytes) + " bytes";
  } else if (closed) {
    answer.silent = !stream.received_anything();
    answer.error = answer.silent ? "it hung up without an answer" : "it hung up in the middle of its answer";
  } else if (stream.error()) {
    answer.error = stream.error()->message;
  } else {
    answer.error = "its answer is not HTTP/1.1";
  }
  return answer;
}

}  // namespace lrt::delivery

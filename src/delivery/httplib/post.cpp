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

// Limits of a receiver's response. cpp-httplib does not limit the length of a line, the number of lines or the size of a chunk, and it
// matches the status line with std::regex, which recurses for each byte.
constexpr std::size_t max_header_bytes = 16 * 1024;
constexpr std::size_t max_status_line_bytes = 512;

/// A limited stream on a Wire, for cpp-httplib.
class Bounded final : public httplib::Stream {
 public:
  Bounded(Wire& wire, std::size_t body_bytes, WaitLimit limit)
      : wire_(wire),
        limit_(limit),
        max_bytes_(max_header_bytes + 4 * 1024 + 8 * body_bytes) {}  // a chunk of one byte takes 6 bytes

  bool is_readable() const override { return true; }
  bool is_writable() const override { return true; }
  bool wait_readable() const { return true; }  // pure virtual in later versions
  bool wait_writable() const { return true; }
  time_t duration() const { return 0; }

  ssize_t write(const char* bytes, std::size_t size) override {
    out_.append(bytes, size);  // the header section and the body are sent together
    return static_cast<ssize_t>(size);
  }
  ssize_t read(char* to, std::size_t size) override {
    if (at_ == filled_ && !refill()) return error_ ? -1 : 0;
    size = std::min(size, filled_ - at_);
    if (!header_section_ended_ && !check_header_section(buffer_.data() + at_, size)) return -1;
    std::copy_n(buffer_.data() + at_, size, to);
    at_ += size;
    return static_cast<ssize_t>(size);
  }
  void get_remote_ip_and_port(std::string& /*ip*/, int& /*port*/) const override {}
  void get_local_ip_and_port(std::string& /*ip*/, int& /*port*/) const override {}
  socket_t socket() const override { return INVALID_SOCKET; }

  void end_header_section() noexcept { header_section_ended_ = true; }
  bool received_bytes() const noexcept { return received_ > 0; }
  /// All received bytes belong to the response, and the connection is open.
  bool is_clean() const noexcept { return !error_ && !ended_ && at_ == filled_; }
  bool ended() const noexcept { return ended_; }
  const std::optional<Error>& error() const noexcept { return error_; }

 private:
  bool refill() {
    if (!out_.empty()) {
      Result<void> sent = wire_.write(out_, limit_);
      out_.clear();
      // A receiver may respond and close without reading the whole request. Its response may be readable.
      if (!sent && sent.error().code != Errc::closed) return fail(std::move(sent).error());
    }
    if (received_ >= max_bytes_) return fail({Errc::limit_exceeded, "its response is too long"});
    Result<std::size_t> got = wire_.read(buffer_.data(), buffer_.size(), limit_);
    if (!got) return fail(std::move(got).error());
    at_ = 0;
    filled_ = *got;
    received_ += *got;
    ended_ = *got == 0;
    return !ended_;
  }
  bool check_header_section(const char* bytes, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) {
      const char c = bytes[i];
      if (++header_bytes_ > max_header_bytes)
        return fail({Errc::limit_exceeded, "the header section of its response is longer than 16384 bytes"});
      if (line_ < start.size()) is_status_line_ = (line_ == 0 || is_status_line_) && c == start[line_];
      line_ = c == '\n' ? 0 : line_ + 1;
      if (is_status_line_ && line_ > max_status_line_bytes)
        return fail({Errc::limit_exceeded, "the status line of its response is too long"});
    }
    return true;
  }
  bool fail(Error error) {
    if (!error_) error_ = std::move(error);
    return false;
  }

  static constexpr std::string_view start = "HTTP/";
  Wire& wire_;
  WaitLimit limit_;
  std::size_t max_bytes_;
  std::string out_;
  std::array<char, 4096> buffer_;
  std::size_t at_ = 0, filled_ = 0, received_ = 0;
  std::size_t header_bytes_ = 0, line_ = 0;
  bool is_status_line_ = false;
  bool header_section_ended_ = false;
  bool ended_ = false;
  std::optional<Error> error_;
};

/// The message codec of cpp-httplib's client: writes a request, reads a response. Its sockets are not used.
class Messages final : public httplib::ClientImpl {
 public:
  explicit Messages(const subscription::CallbackUrl& url) : ClientImpl(url.host, url.port) {
    set_keep_alive(true);
    set_follow_location(false);
    set_url_encode(false);  // the target is sent as it stands in the URL
    set_decompress(false);
  }
  using ClientImpl::process_request;
};

bool has_connection_close(const httplib::Response& response) {
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

/// RFC 9112 6.3: two readers could find different ends of this response.
bool has_ambiguous_framing(const httplib::Response& response) {
  const auto lengths = response.headers.count("Content-Length"), codings = response.headers.count("Transfer-Encoding");
  return lengths + codings > 1;
}
bool has_stray_body(const httplib::Response& response) {
  const bool bodyless = response.status == 204 || response.status == 304;
  const std::string length = response.get_header_value("Content-Length");
  return bodyless && (response.headers.count("Transfer-Encoding") != 0 || (!length.empty() && length != "0"));
}

}  // namespace

PostResult post(Wire& wire, const subscription::CallbackUrl& url, const subscription::Notification& notification,
                std::size_t max_response_bytes, WaitLimit limit) {
  httplib::Request request;
  const bool confirms = !notification.challenge.empty();
  request.method = confirms ? "GET" : "POST";
  request.path = url.target;
  if (confirms) request.path += (url.target.find('?') == std::string::npos ? "?" : "&") + notification.query;
  for (const http::Field& field : notification.fields.list())
    request.headers.emplace(std::string(field.name), std::string(field.value));
  for (const char* ours : {"Host", "Connection", "Content-Length", "Transfer-Encoding", "Accept-Encoding"})
    request.headers.erase(ours);
  request.headers.emplace("Host", url.authority);
  if (request.headers.count("User-Agent") == 0) request.headers.emplace("User-Agent", "lrt/" LRT_VERSION);
  if (notification.body) request.body = *notification.body;
  if (!notification.secret.empty() && !confirms)
    request.headers.emplace("X-Hub-Signature", sign(notification.secret, request.body));

  Bounded stream(wire, max_response_bytes, limit);
  std::uint64_t body = 0;
  std::string begin;  // of the body
  const std::size_t max_begin = notification.challenge.size() + 8;
  request.response_handler = [&](const httplib::Response& /*head*/) {
    stream.end_header_section();
    return true;
  };
  request.content_receiver = [&](const char* bytes, std::size_t size, std::uint64_t, std::uint64_t) {
    body += size;
    if (confirms) begin.append(bytes, std::min(size, max_begin - begin.size()));
    return body <= max_response_bytes;
  };

  httplib::Response response;
  httplib::Error error = httplib::Error::Success;
  const bool complete = Messages(url).process_request(stream, request, response, false, error);
  PostResult result;
  if (complete && !stream.error() && has_ambiguous_framing(response)) {
    result.error = "its response has more than one length";
    return result;
  }
  if (complete && !stream.error() && response.status >= 200) {
    result.status = response.status;
    begin.resize(begin.find_last_not_of(" \t\r\n") + 1);
    result.confirmed = confirms && response.status < 300 && body <= max_begin && begin == notification.challenge;
    result.keep =
        stream.is_clean() && !has_stray_body(response) && response.version == "HTTP/1.1" && !has_connection_close(response);
    return result;
  }
  if (complete && !stream.error()) {  // 102, 103: cpp-httplib takes every status but 100 as final
    result.error = "expected a final response, found status " + std::to_string(response.status);
    return result;
  }
  const bool closed = stream.ended() || (stream.error() && stream.error()->code == Errc::closed);
  if (stream.error() && stream.error()->code == Errc::timed_out) {
    result.error = stream.received_bytes() ? "its response timed out before it was complete" : "it did not respond in time";
  } else if (body > max_response_bytes) {
    result.error = "its response is longer than " + std::to_string(max_response_bytes) + " bytes";
  } else if (closed) {
    result.silent = !stream.received_bytes();
    result.error = result.silent ? "it closed the connection without a response"
                                 : "it closed the connection before its response was complete";
  } else if (stream.error()) {
    result.error = stream.error()->message;
  } else {
    result.error = "its response is not HTTP/1.1";
  }
  return result;
}

}  // namespace lrt::delivery

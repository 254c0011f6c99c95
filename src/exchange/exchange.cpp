// SPDX-License-Identifier: Apache-2.0
#include "src/exchange/exchange.hpp"

#include <httplib.h>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <lrt/version.hpp>

#include "src/base/ascii.hpp"

namespace lrt::exchange {
namespace {

// cpp-httplib does not limit the length of a line, the number of lines or the size of a chunk, and it matches the status line with
// std::regex, which recurses for each byte.
constexpr std::size_t max_status_line_bytes = 512;

bool is_token(std::string_view name) noexcept {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](char c) { return lrt::detail::is(c, lrt::detail::tchar); });
}

/// A limited stream on a Wire, for cpp-httplib.
class Bounded final : public httplib::Stream {
 public:
  Bounded(Wire& wire, const Limits& limits, WaitLimit limit)
      : wire_(wire),
        limit_(limit),
        max_header_bytes_(limits.max_header_bytes),
        max_bytes_(limits.max_body_bytes  // a chunk of one byte takes 6 bytes
                       ? limits.max_header_bytes + 4 * 1024 + 8 * *limits.max_body_bytes
                       : std::numeric_limits<std::size_t>::max()) {}

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
    if (message_ended_) return 0;
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

  /// @param has_body  false: the message ends here (RFC 9112 6.3)
  void end_header_section(bool has_body) noexcept {
    header_section_ended_ = true;
    message_ended_ = !has_body;
  }
  /// The fields of the header section as they were sent: cpp-httplib decodes percent escapes in their values, so "/a%2Fb" would become "/a/b". It leaves
  /// out lines that do not end with CRLF, and fields without a value.
  http::Fields fields() const {
    http::Fields result;
    bool is_first = true;
    for (std::string_view rest = header_text_; !rest.empty();) {
      const std::string_view line = rest.substr(0, rest.find('\n'));
      rest.remove_prefix(std::min(line.size() + 1, rest.size()));
      if (is_first) result = {};  // a status line: what came before had status 100
      if (std::exchange(is_first, line == "\r")) continue;
      const std::size_t colon = line.find(':');
      if (line.empty() || line.back() != '\r' || colon == std::string_view::npos) continue;
      const std::string_view name = line.substr(0, colon), value = lrt::detail::trim(line.substr(colon + 1, line.size() - colon - 2));
      if (is_token(name) && !value.empty()) result.add(name, value);
    }
    return result;
  }
  bool received_bytes() const noexcept { return received_ > 0; }
  /// True if all received bytes belong to the response and the connection is open.
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
    if (header_section_ended_ && limit_.idle.count() > 0) limit_.until = std::chrono::steady_clock::now() + limit_.idle;
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
      if (++header_bytes_ > max_header_bytes_)
        return fail({Errc::limit_exceeded, "the header section of its response is longer than " + std::to_string(max_header_bytes_) + " bytes"});
      if (line_ < start.size()) is_status_line_ = (line_ == 0 || is_status_line_) && c == start[line_];
      line_ = c == '\n' ? 0 : line_ + 1;
      header_text_ += c;
      if (is_status_line_ && line_ > max_status_line_bytes) return fail({Errc::limit_exceeded, "the status line of its response is too long"});
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
  std::size_t max_header_bytes_, max_bytes_;
  std::string out_;
  std::array<char, 4096> buffer_;
  std::size_t at_ = 0, filled_ = 0, received_ = 0;
  std::size_t header_bytes_ = 0, line_ = 0;
  bool is_status_line_ = false;
  std::string header_text_;  ///< of all header sections
  bool header_section_ended_ = false, message_ended_ = false;
  bool ended_ = false;
  std::optional<Error> error_;
};

/// The message codec of cpp-httplib's client: writes a request, reads a response. Its sockets are not used.
class Messages final : public httplib::ClientImpl {
 public:
  Messages() : ClientImpl("localhost", 80) {  // not used: nothing is resolved or connected here
    set_keep_alive(true);
    set_follow_location(false);
    set_url_encode(false);  // the target is sent as it is
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
  const bool bodyless = response.status == 204;
  const std::string length = response.get_header_value("Content-Length");
  return bodyless && (response.headers.count("Transfer-Encoding") != 0 || (!length.empty() && length != "0"));
}

}  // namespace

Outcome exchange(Wire& wire, const Request& request, const Limits& limits, WaitLimit limit, const Receiver& receiver) {
  httplib::Request sent;
  sent.method = request.method;
  sent.path = request.target;
  for (const http::Field& field : request.fields) sent.headers.emplace(std::string(field.name), std::string(field.value));
  for (const char* ours : {"Host", "Connection", "Content-Length", "Transfer-Encoding", "Accept-Encoding"}) sent.headers.erase(ours);
  sent.headers.emplace("Host", std::string(request.authority));
  if (sent.headers.count("User-Agent") == 0) sent.headers.emplace("User-Agent", "lrt/" LRT_VERSION);
  sent.body = request.body;

  Bounded stream(wire, limits, limit);
  Outcome outcome;
  Header header;
  std::size_t body = 0;
  bool refused = false;  // the receiver refused the exchange
  bool has_header = false;
  const auto take_header = [&](const httplib::Response& response) {
    has_header = true;
    header.status = response.status;
    header.fields = stream.fields();
    const bool has_body = http::may_have_body(response.status) && request.method != "HEAD";
    stream.end_header_section(has_body);
    refused = response.status >= 200 && !has_ambiguous_framing(response) && receiver.header && !receiver.header(header);
    return !refused;
  };
  sent.response_handler = take_header;
  sent.content_receiver = [&](const char* bytes, std::size_t size, std::uint64_t, std::uint64_t) {
    body += size;
    if (limits.max_body_bytes && body > *limits.max_body_bytes) return false;
    refused = receiver.body && !receiver.body({bytes, size});
    return !refused;
  };

  httplib::Response response;
  httplib::Error error = httplib::Error::Success;
  bool complete = Messages().process_request(stream, sent, response, false, error);
  if (complete && !has_header) complete = take_header(response);  // cpp-httplib passes no header of a 204 or to HEAD
  // A 304 may state the length of the representation that it does not have. cpp-httplib waits for it.
  if (!complete && has_header && !refused && !stream.error() && !http::may_have_body(header.status)) complete = true;
  const auto fail = [&](Errc code, std::string reason) {
    outcome.code = code;
    outcome.error = std::move(reason);
    return outcome;
  };
  if (refused) return fail(Errc::cancelled, "the response is not wanted");
  if (complete && !stream.error()) {
    if (has_ambiguous_framing(response)) return fail(Errc::expected_http, "its response has more than one length");
    // 102, 103: cpp-httplib takes every status but 100 as final
    if (response.status < 200) return fail(Errc::expected_http, "expected a final response, found status " + std::to_string(response.status));
    outcome.header = std::move(header);
    outcome.keep = stream.is_clean() && !has_stray_body(response) && response.version == "HTTP/1.1" && !has_connection_close(response);
    return outcome;
  }
  const bool closed = stream.ended() || (stream.error() && stream.error()->code == Errc::closed);
  if (stream.error() && stream.error()->code == Errc::timed_out)
    return fail(Errc::timed_out, stream.received_bytes() ? "its response timed out before it was complete" : "it did not respond in time");
  if (limits.max_body_bytes && body > *limits.max_body_bytes)
    return fail(Errc::limit_exceeded, "its response is longer than " + std::to_string(*limits.max_body_bytes) + " bytes");
  if (closed) {
    outcome.silent = !stream.received_bytes();
    return fail(Errc::closed,
                outcome.silent ? "it closed the connection without a response" : "it closed the connection before its response was complete");
  }
  if (stream.error()) return fail(stream.error()->code, stream.error()->message);
  return fail(Errc::expected_http, "its response is not HTTP/1.1");
}

}  // namespace lrt::exchange

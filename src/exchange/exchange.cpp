// SPDX-License-Identifier: Apache-2.0
#include "src/exchange/exchange.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include <lrt/version.hpp>

#include "src/base/ascii.hpp"
#include "src/exchange/content_decoder.hpp"
#include "src/http/response_parser.hpp"

namespace lrt::exchange {
namespace {

using http::ResponseParser;
using Step = ResponseParser::Step;

bool is_ours(std::string_view name) {
  static constexpr std::string_view ours[] = {"Host", "Connection", "Content-Length", "Transfer-Encoding"};
  return std::any_of(std::begin(ours), std::end(ours), [name](std::string_view n) { return lrt::detail::iequals_ascii(n, name); });
}

void add_line(std::string& to, std::string_view name, std::string_view value) {
  to += name;
  to += ": ";
  const std::size_t at = to.size();
  to += value;
  for (std::size_t i = at; i < to.size(); ++i)
    if (!lrt::detail::is(to[i], lrt::detail::text)) to[i] = ' ';  // a value cannot begin another field
  to += "\r\n";
}

/// The header section of a request (RFC 9112 3, 5, 6).
std::string header_section(const Request& request) {
  std::string bytes;
  std::size_t size = 256 + request.target.size();
  for (const http::Field& field : request.fields) size += field.name.size() + field.value.size() + 4;
  bytes.reserve(size + (request.body.size() <= 4 * 1024 ? request.body.size() : 0));
  ((bytes += request.method) += ' ') += request.target;
  bytes += " HTTP/1.1\r\n";
  add_line(bytes, "Host", request.authority);
  bool has_agent = false, has_type = false;
  for (const http::Field& field : request.fields) {
    const bool is_token = !field.name.empty() && lrt::detail::token_end(field.name, 0) == field.name.size();
    if (!is_token || is_ours(field.name)) continue;
    has_agent = has_agent || lrt::detail::iequals_ascii(field.name, "User-Agent");
    has_type = has_type || lrt::detail::iequals_ascii(field.name, "Content-Type");
    add_line(bytes, field.name, field.value);
  }
  if (!has_agent) bytes += "User-Agent: lrt/" LRT_VERSION "\r\n";
  if (!request.body.empty() && !has_type) bytes += "Content-Type: text/plain\r\n";
  if (!request.body.empty() || request.method == "POST" || request.method == "PUT" || request.method == "PATCH")
    add_line(bytes, "Content-Length", std::to_string(request.body.size()));
  bytes += "\r\n";
  return bytes;
}

/// One exchange on a connection.
class Running {
 public:
  Running(Wire& wire, const Request& request, const Limits& limits, WaitLimit limit, const Receiver& receiver)
      : wire_(wire), request_(request), limits_(limits), limit_(limit), receiver_(receiver), parser_(request.method, parser_limits(limits)) {}

  Outcome run() {
    if (send() && receive()) {
      outcome_.header = std::move(header_);
      outcome_.keep = parser_.keeps_connection() && !has_more_bytes_ && !has_ended_;
    }
    return std::move(outcome_);
  }

 private:
  static http::ResponseLimits parser_limits(const Limits& limits) {
    http::ResponseLimits result;
    result.max_header_bytes = limits.max_header_bytes;
    result.max_body_bytes = limits.max_body_bytes;
    return result;
  }

  bool send() {
    std::string bytes = header_section(request_);
    constexpr std::size_t few = 4 * 1024;
    const bool together = request_.body.size() <= few;
    if (together) bytes += request_.body;
    Result<void> sent = wire_.write(bytes, limit_);
    if (sent && !together) sent = wire_.write(request_.body, limit_);
    // A server may respond and close without reading the whole request. Its response may be readable.
    return sent || sent.error().code == Errc::closed || fail(std::move(sent).error());
  }

  bool receive() {
    std::array<char, 8 * 1024> buffer;
    while (true) {
      if (has_header_ && limit_.idle.count() > 0) limit_.until = std::chrono::steady_clock::now() + limit_.idle;
      const Result<std::size_t> got = wire_.read(buffer.data(), buffer.size(), limit_);
      if (!got && got.error().code != Errc::closed) return fail(got.error());
      has_ended_ = !got || *got == 0;
      if (has_ended_) {
        // A reset, or TLS without its close: a body that lasts until the end may lack bytes.
        if (!got && has_header_) return fail({Errc::closed, "it closed the connection before its response was complete"});
        return step(parser_.end());
      }
      has_bytes_ = true;
      std::string_view bytes(buffer.data(), *got);
      while (true) {
        const Step next = parser_.parse(bytes);
        if (next == Step::more) break;
        if (!step(next)) return false;
        if (next != Step::complete) continue;
        has_more_bytes_ = !bytes.empty();
        return true;
      }
    }
  }

  /// False: the exchange has failed.
  bool step(Step step) {
    switch (step) {
      case Step::header: return take_header();
      case Step::body: return take_body(parser_.body());
      case Step::failed: return fail(parser_.error());
      case Step::complete:
        if (decoder_)
          if (Result<void> finished = decoder_->finish(); !finished) return fail(std::move(finished).error());
        return true;
      default: return true;
    }
  }

  bool take_header() {
    has_header_ = true;
    header_.status = parser_.status();
    header_.fields = parser_.take_fields();
    if (receiver_.body && parser_.has_body()) {
      DecodingLimits limits;
      limits.max_bytes = limits_.max_body_bytes;
      Result<std::unique_ptr<ContentDecoder>> decoder = ContentDecoder::make(header_.fields, limits);
      if (!decoder) return fail(std::move(decoder).error());
      decoder_ = *std::move(decoder);
    }
    if (decoder_) {
      header_.fields.remove("Content-Encoding");
      header_.fields.remove("Content-Length");
    }
    return !receiver_.header || receiver_.header(header_) || refuse();
  }

  bool take_body(std::string_view bytes) {
    if (!receiver_.body) return true;
    if (!decoder_) return receiver_.body(bytes) || refuse();
    const Result<bool> goes_on = decoder_->decode(bytes, receiver_.body);
    return goes_on ? *goes_on || refuse() : fail(goes_on.error());
  }

  bool refuse() { return fail({Errc::cancelled, "the response is not wanted"}); }
  bool fail(Error error) {
    if (error.code == Errc::timed_out) error.message = has_bytes_ ? "its response timed out before it was complete" : "it did not respond in time";
    outcome_.silent = error.code == Errc::closed && !has_bytes_;
    outcome_.code = error.code;
    outcome_.error = std::move(error.message);
    return false;
  }

  Wire& wire_;
  const Request& request_;
  const Limits& limits_;
  WaitLimit limit_;
  const Receiver& receiver_;
  ResponseParser parser_;
  std::unique_ptr<ContentDecoder> decoder_;
  Header header_;
  Outcome outcome_;
  bool has_bytes_ = false, has_header_ = false, has_ended_ = false, has_more_bytes_ = false;
};

}  // namespace

Outcome exchange(Wire& wire, const Request& request, const Limits& limits, WaitLimit limit, const Receiver& receiver) {
  return Running(wire, request, limits, limit, receiver).run();
}

}  // namespace lrt::exchange

// SPDX-License-Identifier: Apache-2.0
#include "src/check/probe.hpp"

#include <algorithm>

#include "src/base/ascii.hpp"
#include "src/base/utf8.hpp"

namespace lrt::check {
namespace {

using exchange::Instant;
using lrt::detail::iequals_ascii;
using lrt::detail::trim;
using std::chrono::milliseconds;

constexpr std::size_t max_kept = 3;  // exchanges of one kind that serve as evidence

Instant now() { return std::chrono::steady_clock::now(); }

/// Header fields that are shown as evidence.
bool matters(std::string_view name) {
  static constexpr std::string_view names[] = {"allow",
                                               "accept",
                                               "accept-post",
                                               "callback",
                                               "connection",
                                               "content-length",
                                               "content-type",
                                               "date",
                                               "etag",
                                               "expect",
                                               "host",
                                               "if-match",
                                               "if-none-match",
                                               "link",
                                               "location",
                                               "sec-websocket-accept",
                                               "sec-websocket-key",
                                               "sec-websocket-version",
                                               "transfer-encoding",
                                               "upgrade",
                                               "vary",
                                               "www-authenticate"};
  return std::any_of(std::begin(names), std::end(names), [name](std::string_view n) { return iequals_ascii(n, name); });
}

}  // namespace

std::string excerpt(std::string_view text, std::size_t max) {
  std::string result(utf8::prefix(text, max));
  if (text.size() > max) result += "...";
  for (char& c : result)
    if ((static_cast<unsigned char>(c) < 0x20 && c != '\n') || c == 0x7F) c = ' ';
  while (const auto invalid = utf8::find_invalid(result)) result[*invalid] = '?';
  return result;
}

std::string without_fragment(const std::string& url) { return url.substr(0, url.find('#')); }

Result<http::Url> url_of(const std::string& url) { return http::parse_url(without_fragment(url)); }

std::string Reply::media_type() const {
  const std::string value = field("Content-Type");
  return lrt::detail::lower(trim(std::string_view(value).substr(0, value.find(';'))));
}

Evidence Exchange::evidence() const {
  Evidence e{url, {}, {}};
  std::string_view rest = sent;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    std::string_view line = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    e.sent += excerpt(line, 200) + "\n";
    if (e.sent.size() > 1500) break;
  }
  while (!e.sent.empty() && e.sent.back() == '\n') e.sent.pop_back();
  if (reply.error) {
    e.received = "no response: " + reply.error->message;
    return e;
  }
  e.received = reply.version + " " + std::to_string(reply.status) + " " + std::string(http::reason_phrase(reply.status)) + "\n";
  for (const http::Field& f : reply.fields.list())
    if (matters(f.name)) e.received += std::string(f.name) + ": " + excerpt(f.value, 200) + "\n";
  std::string_view body = reply.body.empty() ? reply.forbidden_body : reply.body;
  while (body.substr(0, 8) == "@prefix ") body.remove_prefix(std::min(body.find('\n'), body.size() - 1) + 1);  // skips Turtle prefixes
  if (!body.empty()) e.received += "\n" + excerpt(body, 300);
  while (!e.received.empty() && e.received.back() == '\n') e.received.pop_back();
  return e;
}

// ------------------------------------------------------------------------------------------------------------------------ Connection

Connection::Connection(std::unique_ptr<exchange::Wire> wire, int stop_descriptor, const CheckOptions& options)
    : wire_(std::move(wire)), stop_descriptor_(stop_descriptor), options_(options) {}

Result<void> Connection::write(std::string_view bytes, Instant until) { return wire_->write(bytes, {until, stop_descriptor_}); }

bool Connection::receive(Instant until) {
  if (ended_) return false;
  char buffer[16 * 1024];
  const Result<std::size_t> got = wire_->read(buffer, sizeof buffer, {until, stop_descriptor_});
  if (got && *got > 0) {
    received_.append(buffer, *got);
    return true;
  }
  if (!got) error_ = got.error();
  ended_ = got || got.error().code == Errc::closed;
  return false;
}

bool Connection::ends(Instant until) {
  while (!ended_ && received_.size() <= options_.max_body_bytes && receive(until)) {}
  return ended_;
}

/// What the parser has found of the final response.
void Connection::take_header(Reply& reply, const http::ResponseParser& parser) {
  reply.version = parser.version() == 10 ? "HTTP/1.0" : "HTTP/1.1";
  reply.status = parser.status();
  reply.fields = parser.fields();
  const bool states_length = reply.fields.find("Content-Length") || reply.fields.find("Transfer-Encoding");
  reply.forbidden_length = reply.status == 204 && states_length;
}

/// The bytes of one response. False: there is no more to read of it.
bool Connection::read_response(Reply& reply, std::string_view method, Instant until) {
  http::ResponseLimits limits;
  limits.max_header_bytes = options_.max_header_bytes;
  limits.max_interim = 20;
  http::ResponseParser parser(method, limits, true);
  parser.read_chunks_despite_length();
  using Step = http::ResponseParser::Step;
  bool has_header = false, is_begun = false;
  while (true) {
    std::string_view bytes = received_;
    is_begun = is_begun || !bytes.empty();
    Step step = parser.parse(bytes);
    if (step == Step::body) reply.body += parser.body();
    received_.erase(0, received_.size() - bytes.size());
    const bool waits = step == Step::more && !receive(until);
    if (waits && ended_) step = parser.end();
    switch (step) {
      case Step::interim:
        reply.interim.push_back(parser.status());
        is_begun = false;
        break;
      case Step::header:
        has_header = true;
        take_header(reply, parser);
        if (reply.status == 101) {
          reply.framing_fault = parser.tolerated();
          return false;
        }
        break;
      case Step::body:
        if (reply.body.size() <= options_.max_body_bytes) break;
        reply.body.resize(options_.max_body_bytes);
        reply.truncated = true;
        return false;
      case Step::more:
        if (!waits) break;
        if (!has_header) reply.error = error_.value_or(Error{Errc::timed_out, "timed out"});
        else if (!reply.fields.find("Content-Length") && !reply.fields.find("Transfer-Encoding"))
          reply.framing_fault = "neither Content-Length nor Transfer-Encoding is there, and the connection stays open";
        else reply.framing_fault = "the body is not complete in time: it has " + std::to_string(reply.body.size()) + " bytes";
        return true;
      case Step::complete: reply.framing_fault = parser.tolerated(); return true;
      case Step::failed: {
        const Error& why = parser.error();
        if (has_header && why.code == Errc::limit_exceeded) {
          reply.truncated = true;
        } else if (has_header || (why.code == Errc::expected_http && parser.status() >= 200)) {  // its status is known
          if (!has_header) take_header(reply, parser);
          reply.framing_fault = why.message;
        } else {
          reply.error = why;
          if (why.code == Errc::closed && is_begun) reply.error->code = Errc::expected_http;  // it is not only closed
        }
        return true;
      }
    }
  }
}

Reply Connection::read(std::string_view method, Instant until, bool close, milliseconds close_time) {
  Reply reply;
  if (!read_response(reply, method, until) || reply.error) {
    reply.closed = ended_;
    return reply;
  }
  if (!close || reply.truncated) return reply;
  reply.closed = ends(std::min(until, now() + close_time));
  if (received_.empty()) return reply;
  if (method == "HEAD" || reply.status == 204 || reply.status == 304) {
    reply.forbidden_body = std::move(received_);
  } else {
    if (reply.framing_fault.empty())
      reply.framing_fault = std::to_string(received_.size()) + " bytes follow the response, whose length ends before them";
    reply.body += received_;
  }
  received_.clear();
  return reply;
}

// ----------------------------------------------------------------------------------------------------------------------------- Probe

Probe::Probe(client::HttpClient& http, const CheckOptions& options) : http_(http), options_(options), end_(now() + options.total_time) {}

Instant Probe::until() const { return within(options_.client.limits.response_time); }
Instant Probe::within(milliseconds time) const { return std::min(end_, now() + time); }
bool Probe::exhausted() const { return requests_ >= options_.max_requests || now() >= end_; }

std::string Probe::limit_reached() const {
  if (requests_ >= options_.max_requests)
    return "max_requests (" + std::to_string(options_.max_requests) + ") was reached, and what is left was not tested";
  if (now() >= end_) return "total_time (" + std::to_string(options_.total_time.count()) + " ms) was reached, and what is left was not tested";
  return {};
}

Result<Connection> Probe::connect(const std::string& url) {
  const Result<http::Url> parts = url_of(url);
  if (!parts) return unexpected(parts.error());
  if (exhausted()) return unexpected(Errc::limit_exceeded, limit_reached());
  ++requests_;
  Result<std::unique_ptr<exchange::Wire>> wire =
      http_.connect(*parts, {within(options_.client.limits.resolve_time + options_.client.limits.connect_time), http_.stop_descriptor()}, false);
  if (!wire) return unexpected(std::move(wire).error());
  return Connection(*std::move(wire), http_.stop_descriptor(), options_);
}

std::string Probe::own_fields(const std::string& url) {
  const Result<http::Url> parts = url_of(url);
  if (!parts) return {};
  std::string lines = "Host: " + parts->authority + "\r\n";
  http::Fields fields;  // which accepts no line ends in a value
  for (const auto& [name, value] : http_.identity_fields(*parts)) fields.add(name, value);
  return lines + fields.block();
}

std::string Probe::shown(const std::string& url, std::string bytes) {
  const Result<http::Url> parts = url_of(url);
  if (!parts) return bytes;
  for (const auto& [name, value] : http_.identity_fields(*parts)) {
    const std::string line = name + ": " + value + "\r\n", without = name + ": (left out)\r\n";
    for (std::size_t at = 0; (at = bytes.find(line, at)) != std::string::npos; at += without.size()) bytes.replace(at, line.size(), without);
  }
  return bytes;
}

Exchange Probe::ask(const std::string& method, const std::string& url, const FieldList& fields, const std::string& body) {
  Exchange exchange{url, {}, {}};
  const Result<http::Url> parts = url_of(url);
  if (!parts) {
    exchange.reply.error = parts.error();
    return exchange;
  }
  bool connection = false;
  http::Fields own;
  for (const auto& [name, value] : fields) {
    own.add(name, value);
    connection = connection || iequals_ascii(name, "Connection");
  }
  if (!connection) own.add("Connection", "close");
  if (!body.empty() || method == "POST" || method == "PUT") own.add("Content-Length", std::to_string(body.size()));
  const std::string bytes = method + " " + parts->target + " HTTP/1.1\r\n" + own_fields(url) + own.block() + "\r\n" + body;
  exchange = raw(url, bytes, method);
  record(exchange, method);
  return exchange;
}

Exchange Probe::raw(const std::string& url, const std::string& bytes, std::string_view method) {
  Exchange exchange{url, shown(url, bytes), {}};
  Result<Connection> connection = connect(url);
  if (!connection) {
    exchange.reply.error = connection.error();
    return exchange;
  }
  // An error of write() is not final: a server may refuse a request before it has read all of it.
  (void)connection->write(bytes, until());
  const bool close = bytes.find("Connection: close") != std::string::npos;
  exchange.reply = connection->read(method, until(), close, closes_ ? options_.close_time : std::min(options_.close_time, milliseconds(20)));
  if (!exchange.reply.error) statuses.push_back(exchange.reply.status);
  return exchange;
}

void Probe::record(const Exchange& exchange, const std::string& method) {
  const Reply& reply = exchange.reply;
  if (reply.error) return;
  const auto keep = [&](std::vector<Exchange>& list) {
    if (list.size() < max_kept) list.push_back(exchange);
  };
  if (reply.version != "HTTP/1.1") keep(of_another_version);
  if (reply.status >= 200 && reply.status < 500 && !reply.fields.find("Date")) keep(without_date);
  if (!reply.framing_fault.empty()) keep(framing_faults);
  if (reply.status == 204 || reply.status == 304) {
    ++bodiless;
    if (!first_bodiless) first_bodiless = exchange;
  }
  if (!reply.forbidden_body.empty() || reply.forbidden_length)
    keep(method == "HEAD" && !reply.forbidden_length ? bodies_of_head : bodies_where_none_may_be);
  const bool asked = exchange.sent.find("\r\nConnection: close") != std::string::npos;
  if (asked && reply.status != 101 && !reply.closed && !reply.truncated && reply.framing_fault.empty()) {
    keep(not_closed);
    closes_ = false;
  }
}

}  // namespace lrt::check

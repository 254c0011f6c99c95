// SPDX-License-Identifier: Apache-2.0
#include "src/check/probe.hpp"

#include <algorithm>
#include <charconv>
#include <set>

#include "src/base/ascii.hpp"
#include "src/base/utf8.hpp"

namespace lrt::check {
namespace {

using exchange::Instant;
using lrt::detail::iequals_ascii;
using lrt::detail::is_digit;
using lrt::detail::trim;
using std::chrono::milliseconds;

constexpr std::size_t max_kept = 3;  // exchanges of one kind that serve as evidence

Instant now() { return std::chrono::steady_clock::now(); }

/// "HTTP/1.1 200 OK" (RFC 9112 4).
bool parse_status_line(std::string_view line, Reply& reply) {
  if (line.size() < 12 || line.compare(0, 5, "HTTP/") != 0 || !is_digit(line[5]) || line[6] != '.' || !is_digit(line[7]) || line[8] != ' ')
    return false;
  for (std::size_t at = 9; at < 12; ++at)
    if (!is_digit(line[at])) return false;
  reply.version = std::string(line.substr(0, 8));
  reply.status = (line[9] - '0') * 100 + (line[10] - '0') * 10 + (line[11] - '0');
  if (line.size() == 12) reply.framing_fault = "the status line has no space after the code (RFC 9112 4)";
  else if (line[12] != ' ') return false;
  return reply.status >= 100;
}

void parse_fields(std::string_view lines, Reply& reply) {
  while (!lines.empty()) {
    const std::size_t end = std::min(lines.find("\r\n"), lines.size());
    const std::string_view line = lines.substr(0, end);
    lines.remove_prefix(std::min(end + 2, lines.size()));
    const std::size_t colon = line.find(':');
    const bool named =
        colon != std::string_view::npos && colon > 0 &&
        std::all_of(line.begin(), line.begin() + static_cast<std::ptrdiff_t>(colon), [](char c) { return lrt::detail::is(c, lrt::detail::tchar); });
    if (!named) {
      reply.framing_fault = "the header section has a line that is no field: \"" + excerpt(line, 80) + "\" (RFC 9112 5)";
      continue;
    }
    reply.fields.add(line.substr(0, colon), trim(line.substr(colon + 1)));
  }
}

std::optional<std::uint64_t> parse_number(std::string_view text, int base) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
  if (error != std::errc() || end != text.data() + text.size() || text.empty() || text.front() == '-' || text.front() == '+') return std::nullopt;
  return number;
}

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

bool Connection::read_length(Reply& reply, std::uint64_t length, Instant until) {
  while (received_.size() < length && received_.size() <= options_.max_body_bytes && receive(until)) {}
  if (received_.size() < length && received_.size() > options_.max_body_bytes) {
    reply.truncated = true;
  } else if (received_.size() < length) {
    reply.framing_fault = "Content-Length is " + std::to_string(length) + ", and the body has " + std::to_string(received_.size()) + " bytes";
  }
  const std::size_t size = static_cast<std::size_t>(std::min<std::uint64_t>(length, received_.size()));
  reply.body = received_.substr(0, size);
  received_.erase(0, size);
  return reply.framing_fault.empty() && !reply.truncated;
}

bool Connection::read_chunks(Reply& reply, Instant until) {
  const auto line = [&]() -> std::optional<std::string> {
    while (received_.find("\r\n") == std::string::npos) {
      if (received_.size() > options_.max_header_bytes || !receive(until)) return std::nullopt;
    }
    const std::size_t end = received_.find("\r\n");
    std::string text = received_.substr(0, end);
    received_.erase(0, end + 2);
    return text;
  };
  while (true) {
    const std::optional<std::string> head = line();
    if (!head) break;
    const std::optional<std::uint64_t> size = parse_number(trim(std::string_view(*head).substr(0, head->find(';'))), 16);
    if (!size) {
      reply.framing_fault = "\"" + excerpt(*head, 40) + "\" is no chunk size (RFC 9112 7.1)";
      return false;
    }
    if (*size == 0) {  // the trailer section
      for (std::size_t i = 0; i < 100; ++i) {
        const std::optional<std::string> trailer = line();
        if (!trailer) break;
        if (trailer->empty()) return true;
      }
      break;
    }
    if (*size > options_.max_body_bytes || reply.body.size() + *size > options_.max_body_bytes) {
      reply.truncated = true;
      return false;
    }
    const std::size_t need = static_cast<std::size_t>(*size) + 2;
    while (received_.size() < need && receive(until)) {}
    if (received_.size() < need) break;
    reply.body.append(received_, 0, need - 2);
    if (received_.compare(need - 2, 2, "\r\n") != 0) {
      reply.framing_fault = "a chunk is longer than its size (RFC 9112 7.1)";
      return false;
    }
    received_.erase(0, need);
  }
  reply.framing_fault = "the chunked body has no end (RFC 9112 7.1)";
  return false;
}

void Connection::read_body(Reply& reply, std::string_view method, Instant until) {
  std::set<std::string> lengths;
  bool chunked = false;
  for (const http::Field& f : reply.fields.list()) {
    if (iequals_ascii(f.name, "Content-Length")) lengths.insert(std::string(f.value));
    if (iequals_ascii(f.name, "Transfer-Encoding")) chunked = true;
  }
  if (lengths.size() > 1) reply.framing_fault = "there are two different Content-Length fields (RFC 9112 6.3)";
  if (chunked && !lengths.empty()) reply.framing_fault = "Content-Length and Transfer-Encoding are both there (RFC 9112 6.2)";
  if (method == "HEAD" || reply.status == 204 || reply.status == 304 || reply.status < 200) {
    reply.forbidden_length = reply.status == 204 && (chunked || !lengths.empty());
    return;
  }
  if (chunked) {
    read_chunks(reply, until);
  } else if (lengths.size() == 1) {
    if (const auto length = parse_number(*lengths.begin(), 10)) read_length(reply, *length, until);
    else reply.framing_fault = "Content-Length is \"" + excerpt(*lengths.begin(), 40) + "\"";
  } else if (lengths.empty()) {  // until the end of the connection (RFC 9112 6.3)
    const bool whole = ends(until);
    reply.truncated = received_.size() > options_.max_body_bytes;
    if (!whole && !reply.truncated) reply.framing_fault = "neither Content-Length nor Transfer-Encoding is there, and the connection stays open";
    reply.body = std::move(received_);
    received_.clear();
  }
}

Reply Connection::read(std::string_view method, Instant until, bool close, milliseconds close_time) {
  Reply reply;
  while (true) {
    std::size_t end = 0;
    while ((end = received_.find("\r\n\r\n")) == std::string::npos) {
      if (received_.size() > options_.max_header_bytes) {
        reply.error = Error{Errc::limit_exceeded, "the header section has more than " + std::to_string(options_.max_header_bytes) + " bytes"};
        return reply;
      }
      if (!receive(until)) {
        if (!received_.empty()) reply.error = Error{Errc::expected_http, "the bytes are no HTTP response: \"" + excerpt(received_, 80) + "\""};
        else if (ended_) reply.error = Error{Errc::closed, "the server closed the connection without a response"};
        else reply.error = error_.value_or(Error{Errc::timed_out, "timed out"});
        reply.closed = ended_;
        return reply;
      }
    }
    const std::size_t line = received_.find("\r\n");
    if (!parse_status_line(std::string_view(received_).substr(0, line), reply)) {
      reply.status = 0;
      reply.error = Error{Errc::expected_http, "the bytes are no HTTP response: \"" + excerpt(received_, 80) + "\""};
      return reply;
    }
    reply.fields = http::Fields();
    if (end > line) parse_fields(std::string_view(received_).substr(line + 2, end - line - 2), reply);
    received_.erase(0, end + 4);
    if (reply.status >= 200 || reply.status == 101) break;
    reply.interim.push_back(reply.status);
    if (reply.interim.size() > 20) {
      reply.error = Error{Errc::expected_http, "more than 20 interim responses"};
      return reply;
    }
  }
  if (reply.status == 101) return reply;
  read_body(reply, method, until);
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

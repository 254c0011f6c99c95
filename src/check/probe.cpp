// SPDX-License-Identifier: Apache-2.0
#include "src/check/probe.hpp"

#include <algorithm>
#include <charconv>
#include <functional>

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
                                               "accept-patch",
                                               "accept-post",
                                               "accept-ranges",
                                               "callback",
                                               "connection",
                                               "content-length",
                                               "content-location",
                                               "content-range",
                                               "content-type",
                                               "date",
                                               "etag",
                                               "expect",
                                               "host",
                                               "if-match",
                                               "if-none-match",
                                               "last-modified",
                                               "link",
                                               "location",
                                               "preference-applied",
                                               "robot-time",
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

std::vector<std::string> list_of(const std::string& value) {
  std::vector<std::string> all;
  std::string_view rest = value;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find(','), rest.size());
    if (const std::string_view one = trim(rest.substr(0, end)); !one.empty()) all.emplace_back(one);
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return all;
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
        else if (reply.fields.find("Transfer-Encoding")) reply.truncated = true;  // a stream, or a slow server
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
  const bool complete = read_response(reply, method, until);
  reply.took = std::chrono::duration_cast<milliseconds>(now() - begun_);
  if (!complete || reply.error) {
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

Probe::Probe(client::HttpClient& http, const CheckOptions& options)
    : http_(http), options_(options), end_(now() + options.total_time), begin_(now()) {}

milliseconds Probe::usual_time() const {
  if (times_.empty()) return milliseconds(0);
  std::vector<milliseconds> sorted = times_;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  return *middle;
}
bool Probe::is_fast() const { return 4 * usual_time() < options_.client.limits.response_time; }

Instant Probe::until() const { return within(std::max(options_.client.limits.response_time, 4 * usual_time())); }
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
  if (exhausted()) return unexpected(Errc::cancelled, limit_reached());
  ++requests_;
  const Instant begun = now();
  if (options_.progress) options_.progress({url, requests_, std::chrono::duration_cast<milliseconds>(begun - begin_), usual_time()});
  Result<std::unique_ptr<exchange::Wire>> wire =
      http_.connect(*parts, {within(options_.client.limits.resolve_time + options_.client.limits.connect_time), http_.stop_descriptor()}, false);
  if (!wire) return unexpected(std::move(wire).error());
  Connection connection(*std::move(wire), http_.stop_descriptor(), options_);
  connection.begun(begun);
  return connection;
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
  record(exchange, method, fields);
  return exchange;
}

Exchange Probe::ask_without_body(const std::string& method, const std::string& url, const FieldList& fields) {
  Exchange exchange{url, {}, {}};
  const Result<http::Url> parts = url_of(url);
  if (!parts) {
    exchange.reply.error = parts.error();
    return exchange;
  }
  http::Fields own;
  for (const auto& [name, value] : fields) own.add(name, value);
  const std::string bytes =
      method + " " + parts->target + " HTTP/1.1\r\n" + own_fields(url) + own.block() + "Content-Length: 1\r\nExpect: 100-continue\r\n\r\n";
  exchange.sent = shown(url, bytes);
  if (ignores_expect_) {
    exchange.reply.error = Error{Errc::timed_out, "the server does not respond before the body comes, as a request before this has shown"};
    return exchange;
  }
  Result<Connection> connection = connect(url);
  if (!connection) {
    exchange.reply.error = connection.error();
    return exchange;
  }
  (void)connection->write(bytes, until());
  // An interim response is enough: after it nothing is sent.
  while (connection->received().find("\r\n\r\n") == std::string::npos && connection->receive(until())) {}
  const std::string& received = connection->received();
  if (received.compare(0, 7, "HTTP/1.") == 0 && received.compare(8, 4, " 100") == 0) {
    exchange.reply.status = 100, exchange.reply.version = received.substr(0, 8);
    return exchange;
  }
  exchange.reply = connection->read(method, until(), false, options_.close_time);
  ignores_expect_ = exchange.reply.timed_out();
  if (!exchange.reply.error) statuses.push_back(exchange.reply.status);
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
  exchange.reply =
      connection->read(method, until(), close, closes_ ? options_.close_time + 2 * usual_time() : std::min(options_.close_time, milliseconds(20)));
  if (!exchange.reply.error) statuses.push_back(exchange.reply.status);
  return exchange;
}

void Probe::record_time(const Exchange& exchange) {
  if (exchange.reply.timed_out()) {
    ++timed_out;
    if (!first_timed_out) first_timed_out = exchange;
  }
  if (exchange.reply.error) return;
  times_.push_back(exchange.reply.took);
  if (!slowest || slowest->reply.took < exchange.reply.took) slowest = exchange;
}

void Probe::record_dates(const Exchange& exchange) {
  const std::string date = exchange.reply.field("Date");
  if (date.empty()) return;
  const std::optional<long long> seconds = http_seconds(date);
  if (!seconds) {
    if (invalid_dates.size() < max_kept) invalid_dates.push_back(exchange);
    return;
  }
  const auto here = std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch()).count();
  const long long offset = *seconds - here;
  if (!first_dated) first_dated = exchange, date_offset_first = offset, date_begin_ = now();
  // A second that begins between two responses of a farm of servers is no step back.
  if (last_dated && *seconds + 1 < *http_seconds(last_dated->reply.field("Date")) && !date_back) date_back = Pair{*last_dated, exchange};
  last_dated = exchange;
  date_offset_last = offset;
  dated_for = std::chrono::duration_cast<std::chrono::seconds>(now() - date_begin_);
  const std::string last_modified = exchange.reply.field("Last-Modified");
  if (last_modified.empty()) return;
  if (!has_last_modified) has_last_modified = exchange;
  const std::optional<long long> modified = http_seconds(last_modified);
  if (!modified) {
    if (invalid_dates.size() < max_kept) invalid_dates.push_back(exchange);
  } else if (*modified > *seconds && modified_later.size() < max_kept) {
    modified_later.push_back(exchange);
  }
}

void Probe::record_robot_time(const Exchange& exchange) {
  const std::string value = exchange.reply.field("Robot-Time");
  if (value.empty()) return;
  const std::optional<RobotTime> time = RobotTime::parse(value);
  ++robot_times;
  if (!with_robot_time) with_robot_time = exchange;
  std::string fault;
  if (!time) fault = "Robot-Time is \"" + excerpt(value, 60) + "\", expected 16 hexadecimal digits, \"/\" and milliseconds";
  else if (robot_time && time->instance != robot_time->instance)
    fault = "Robot-Time changes from " + robot_time->text() + " to " + time->text() + ": another run";
  else if (robot_time && time->ms < robot_time->ms) fault = "Robot-Time goes back from " + robot_time->text() + " to " + time->text();
  if (!fault.empty() && robot_time_fault.empty()) robot_time_fault = fault, robot_time_evidence = exchange;
  if (time) robot_time = time;
}

void Probe::record(const Exchange& exchange, const std::string& method, const FieldList& fields) {
  const Reply& reply = exchange.reply;
  record_time(exchange);
  if (reply.error) return;
  record_dates(exchange);
  record_robot_time(exchange);
  record_representation(exchange, method, fields);
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

/// Compares a representation with the one before of the same URL and negotiation.
void Probe::record_representation(const Exchange& exchange, const std::string& method, const FieldList& fields) {
  const Reply& reply = exchange.reply;
  if (method != "GET" && method != "HEAD" && method != "OPTIONS" && reply.ok()) ++writes_;
  if (method != "GET" || reply.status != 200 || reply.truncated || !reply.framing_fault.empty()) return;
  std::string key = exchange.url;
  for (const auto& [name, value] : fields) {
    if (iequals_ascii(name, "Accept")) key += "\n" + value;
    else if (!iequals_ascii(name, "If-None-Match") && !iequals_ascii(name, "If-Modified-Since")) return;  // another representation
  }
  Seen now;
  now.exchange = exchange;
  now.exchange.reply.body.resize(std::min<std::size_t>(reply.body.size(), 1'000));
  now.tag = reply.field("ETag");
  now.media_type = reply.media_type();
  now.hash = std::hash<std::string>()(reply.body);
  now.writes = writes_;
  now.date = http_seconds(reply.field("Date"));
  now.last_modified = http_seconds(reply.field("Last-Modified"));
  const auto [found, is_new] = seen_.try_emplace(key);
  if (!is_new) {
    const Seen& before = found->second;
    const bool same = before.hash == now.hash && before.media_type == now.media_type, weak = now.tag.compare(0, 2, "W/") == 0;
    if (!same && before.tag == now.tag && !now.tag.empty() && !weak && tag_stays.size() < max_kept)
      tag_stays.push_back({before.exchange, now.exchange});
    // A tag may be that of a moment at which somebody has written the same.
    if (same && before.writes == writes_ && before.tag != now.tag && !before.tag.empty() && !now.tag.empty() &&
        weak == (before.tag.compare(0, 2, "W/") == 0) && tag_moves.size() < max_kept)
      tag_moves.push_back({before.exchange, now.exchange});
    if (!same && before.tag != now.tag) changed_tag = now.exchange;
    // What has changed after the first response has been modified after it; a second is the resolution.
    if (!same && now.last_modified && before.date) {
      if (*now.last_modified + 1 >= *before.date) last_modified_moves = now.exchange;
      else if (!last_modified_back) last_modified_back = Pair{before.exchange, now.exchange};
    }
  }
  found->second = std::move(now);
}

FieldList Probe::command_fields() const {
  if (!robot_time) return {};
  constexpr unsigned long long life = 60'000;  // ms
  return {{"Valid-Until", robot_time->instance + "/" + std::to_string(robot_time->ms + life)}};
}

std::optional<RobotTime> RobotTime::parse(std::string_view text) {
  constexpr std::size_t digits = 16;
  if (text.size() < digits + 2 || text[digits] != '/') return std::nullopt;
  for (const char c : text.substr(0, digits))
    if (!((c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F'))) return std::nullopt;
  RobotTime time{std::string(text.substr(0, digits)), 0};
  const std::string_view ms = text.substr(digits + 1);
  const auto result = std::from_chars(ms.data(), ms.data() + ms.size(), time.ms);
  if (result.ec != std::errc() || result.ptr != ms.data() + ms.size()) return std::nullopt;
  return time;
}

std::optional<long long> http_seconds(std::string_view text) {
  constexpr std::string_view months = "JanFebMarAprMayJunJulAugSepOctNovDec", days = "MonTueWedThuFriSatSun";
  constexpr std::string_view form = "aaa, 00 aaa 0000 00:00:00 GMT";
  if (text.size() != form.size()) return std::nullopt;
  for (std::size_t i = 0; i < form.size(); ++i) {
    const bool digit = text[i] >= '0' && text[i] <= '9';
    if (form[i] == '0' ? !digit : form[i] != 'a' && form[i] != text[i]) return std::nullopt;
  }
  const auto number = [text](std::size_t at, std::size_t size) {
    long long n = 0;
    for (const char c : text.substr(at, size)) n = 10 * n + (c - '0');
    return n;
  };
  const std::size_t month = months.find(text.substr(8, 3)), day_name = days.find(text.substr(0, 3));
  if (month == months.npos || month % 3 != 0 || day_name == days.npos || day_name % 3 != 0) return std::nullopt;
  const long long day = number(5, 2), year = number(12, 4), hour = number(17, 2), minute = number(20, 2), second = number(23, 2);
  if (day < 1 || day > 31 || hour > 23 || minute > 59 || second > 60) return std::nullopt;
  // Days from the civil date; years begin in March.
  const long long m = static_cast<long long>(month / 3) + 1, y = year - (m <= 2 ? 1 : 0), era = y / 400, of_era = y - era * 400;
  const long long of_year = (153 * (m + (m > 2 ? -3 : 9)) + 2) / 5 + day - 1;
  const long long date = era * 146'097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719'468;
  return ((date * 24 + hour) * 60 + minute) * 60 + second;
}

}  // namespace lrt::check

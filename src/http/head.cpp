#include <lrt/http/head.hpp>

#include <cstdint>
#include <cstring>

#include "src/base/ascii.hpp"

namespace lrt::http {
namespace {

using namespace detail;
constexpr std::size_t npos = std::string_view::npos;

// ---- Words for refusals. Nothing a client sent is echoed raw: bytes outside visible ASCII appear as numbers.

std::string shown(std::string_view found) {
  static constexpr char digits[] = "0123456789ABCDEF";
  constexpr std::size_t limit = 60;
  std::string result = "\"";
  for (const char c : found.substr(0, limit)) {
    if (c >= ' ' && c < 0x7F && c != '"' && c != '\\') {
      result += c;
    } else {
      const auto byte = static_cast<unsigned char>(c);
      result += {'\\', 'x', digits[byte >> 4], digits[byte & 0x0FU]};
    }
  }
  result += found.size() > limit ? "\"..." : "\"";
  return result;
}

std::string byte_name(char c) {
  switch (c) {
    case '\0': return "NUL";
    case '\t': return "a tab";
    case '\n': return "LF without CR";
    case '\r': return "CR without LF";
    case ' ': return "a space";
    default: break;
  }
  if (c > ' ' && c < 0x7F) return {'\'', c, '\''};
  std::string result = "byte ";
  append_percent(result, c);
  result.replace(5, 1, "0x");
  return result;
}

Refusal refuse_at(std::string_view where, std::string_view head, std::size_t at, int status = 400) {
  std::string reason(where);
  reason += ": found ";
  reason += at < head.size() ? byte_name(head[at]) : "the end";
  reason += " at byte " + std::to_string(at);
  return {status, std::move(reason)};
}

Refusal refuse_value(std::string_view field, std::string_view found, std::string_view expected, int status = 400) {
  std::string reason(field);
  reason += ": expected ";
  reason += expected;
  reason += ", found " + shown(found);
  return {status, std::move(reason)};
}

// ---- Pieces

constexpr bool is_method_char(char c) noexcept { return is(c, tchar) && !(c >= 'a' && c <= 'z'); }
/// Of what RFC 3986 allows in a URI, all but the fragment's '#' (RFC 9112 3.2).
constexpr bool is_target_char(char c) noexcept { return is(c, uri) && c != '#'; }

std::size_t method_end(std::string_view text) noexcept {
  std::size_t at = 0;
  while (at < text.size() && is_method_char(text[at])) ++at;
  return at;
}

std::size_t target_end(std::string_view text, std::size_t at) noexcept {
  while (at < text.size() && is_target_char(text[at])) ++at;
  return at;
}

/// The place of the first byte from `at` on that no field value may have, usually the CR that ends it.
std::size_t value_end(std::string_view text, std::size_t at) noexcept {
  constexpr std::uint64_t ones = 0x0101010101010101U;
  constexpr std::uint64_t tops = 0x8080808080808080U;
  while (text.size() - at >= 8) {  // eight bytes at a time: none below 0x20, none 0x7F
    std::uint64_t word;
    std::memcpy(&word, text.data() + at, sizeof word);
    const std::uint64_t below = (word - ones * 0x20) & ~word & tops;
    const std::uint64_t del = word ^ (ones * 0x7F);
    if ((below | ((del - ones) & ~del & tops)) != 0) break;
    at += 8;
  }
  while (at < text.size() && is(text[at], detail::text)) ++at;
  return at;
}

/// Calls `visit(element)` for each element of a comma-separated list without quoted strings, until it returns false.
template <class Visit>
bool for_each_element(std::string_view list, Visit visit) {
  while (!list.empty()) {
    const std::size_t comma = list.find(',');
    const std::string_view element = trim(list.substr(0, comma));
    if (!element.empty() && !visit(element)) return false;
    list.remove_prefix(comma == npos ? list.size() : comma + 1);
  }
  return true;
}

bool is_token(std::string_view text) noexcept { return !text.empty() && token_end(text, 0) == text.size(); }

/// 1*19DIGIT, which always fits 64 bits; nullopt for anything else.
std::optional<std::uint64_t> parse_length(std::string_view text) noexcept {
  if (text.empty() || text.size() > 19) return std::nullopt;
  std::uint64_t result = 0;
  for (const char c : text) {
    if (!is_digit(c)) return std::nullopt;
    result = result * 10 + static_cast<unsigned>(c - '0');
  }
  return result;
}

/// IPv4address (RFC 3986 3.2.2)
bool is_ipv4(std::string_view text) noexcept {
  for (int part = 0; part < 4; ++part) {
    std::size_t digits = 0;
    unsigned value = 0;
    while (digits < text.size() && digits < 3 && is_digit(text[digits])) {
      value = value * 10 + static_cast<unsigned>(text[digits++] - '0');
    }
    if (digits == 0 || value > 255 || (digits > 1 && text[0] == '0')) return false;
    text.remove_prefix(digits);
    if (part < 3) {
      if (text.empty() || text.front() != '.') return false;
      text.remove_prefix(1);
    }
  }
  return text.empty();
}

/// IPv6address (RFC 3986 3.2.2): eight groups of one to four hex digits, "::" once for at least one group of zeros, an IPv4
/// address for the last two.
bool is_ipv6(std::string_view text) noexcept {
  int groups = 0;
  bool elided = false;
  if (text.substr(0, 2) == "::") {
    elided = true;
    text.remove_prefix(2);
  }
  while (!text.empty()) {
    std::size_t digits = 0;
    while (digits < text.size() && digits < 5 && is(text[digits], hex)) ++digits;
    if (digits < text.size() && text[digits] == '.') {
      if (!is_ipv4(text)) return false;
      groups += 2;
      break;
    }
    if (digits == 0 || digits > 4) return false;
    ++groups;
    text.remove_prefix(digits);
    if (text.empty()) break;
    if (text.front() != ':' || text.size() == 1) return false;
    text.remove_prefix(1);
    if (text.front() == ':') {
      if (elided) return false;
      elided = true;
      text.remove_prefix(1);
    }
  }
  return elided ? groups <= 7 : groups == 8;
}

/// What of a head tells of its connection and body, in one pass over the fields.
struct Findings {
  const Field* host = nullptr;
  const Field* length = nullptr;
  const Field* coding = nullptr;
  unsigned hosts = 0, lengths = 0, codings = 0;
};

/// Sets `target` unless it refuses.
std::optional<Refusal> check_target(const Request& request, std::optional<Target>& target_parts) {
  const std::string_view target = request.target;
  if (const std::size_t end = target_end(target, 0); end != target.size()) return refuse_at("request target", target, end);
  if (target == "*" && request.method != "OPTIONS") {
    return Refusal{400, "request target: \"*\" is for OPTIONS only, found method " + shown(request.method)};
  }
  target_parts = split_target(target);
  if (!target_parts) {
    return refuse_value("request target", target,
                        "a path that begins with '/', an http or https URI with a host and no userinfo, or \"*\"");
  }
  return std::nullopt;
}

std::optional<Refusal> check_host(const Findings& found, int version) {
  if (found.hosts > 1) return Refusal{400, "Host: expected one, found " + std::to_string(found.hosts)};
  if (found.hosts == 0) {
    if (version == 10) return std::nullopt;
    return Refusal{400, "Host: expected one, found none"};
  }
  if (!parse_host(found.host->value)) return refuse_value("Host", found.host->value, "a host and optional port");
  return std::nullopt;
}

/// One of the two fields that frame the body, repeated.
Refusal refuse_repeated(const Request& request, std::string_view name, unsigned count) {
  constexpr unsigned limit = 3;
  std::string reason(name);
  reason += ": expected at most one, found " + std::to_string(count) + ": ";
  unsigned listed = 0;
  for (const Field& field : request.fields) {
    if (!iequals(field.name, name)) continue;
    if (listed == limit) {
      reason += ", ...";
      break;
    }
    if (listed++ > 0) reason += ", ";
    reason += shown(field.value);
  }
  return {400, std::move(reason)};
}

/// 501 for a list of codings, the final chunked once, with another before it; 501 for a single other coding (RFC 9112 6.1); else 400.
int status_of_coding(std::string_view list) noexcept {
  if (is_token(list)) return 501;
  for (bool others = false;; others = true) {
    const std::size_t comma = list.find(',');
    const std::string_view element = trim(list.substr(0, comma));
    const std::size_t end = token_end(element, 0);
    const bool is_chunked = iequals(element.substr(0, end), "chunked");
    if (comma == npos) return others && is_chunked && end == element.size() ? 501 : 400;
    if (end == 0 || is_chunked) return 400;
    // transfer-coding = token *( OWS ";" OWS transfer-parameter ); what the parameters are like does not matter.
    if (const std::string_view rest = trim(element.substr(end)); !rest.empty() && rest.front() != ';') return 400;
    list.remove_prefix(comma + 1);
  }
}

std::optional<Refusal> check_framing(const Request& request, const Findings& found) {
  const int version = request.version;
  if (found.lengths > 1) return refuse_repeated(request, "Content-Length", found.lengths);
  if (found.codings > 1) return refuse_repeated(request, "Transfer-Encoding", found.codings);
  if (found.length != nullptr && found.coding != nullptr) {
    return Refusal{400, "Content-Length: found " + shown(found.length->value) + " beside Transfer-Encoding " +
                            shown(found.coding->value)};
  }
  if (found.length != nullptr && !parse_length(found.length->value)) {
    return refuse_value("Content-Length", found.length->value, "1 to 19 digits");
  }
  if (found.coding != nullptr) {
    const std::string_view coding = found.coding->value;
    if (version == 10) return Refusal{400, "Transfer-Encoding: found in an HTTP/1.0 request"};
    if (!iequals(coding, "chunked")) {
      return refuse_value("Transfer-Encoding", coding, "exactly \"chunked\"", status_of_coding(coding));
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<Refusal> check_raw_head(std::string_view head) {
  // request-line = method SP request-target SP HTTP-version CRLF (RFC 9112 3)
  if (head.empty() || head[0] == '\r' || head[0] == '\n') return Refusal{400, "request line: found an empty line at byte 0"};
  std::size_t at = method_end(head);
  if (at == head.size() || head[at] != ' ' || at == 0) return refuse_at("method", head, at);
  const std::size_t target_at = ++at;
  at = target_end(head, at);
  if (at == target_at || at == head.size() || head[at] != ' ') {
    if (at != target_at && head.substr(at, 2) == "\r\n") {
      return Refusal{400, "request line: expected an HTTP version, found the end of the line at byte " + std::to_string(at)};
    }
    return refuse_at("request target", head, at);
  }
  const std::size_t version_at = ++at;
  const std::string_view version = head.substr(at, 8);
  if (version != "HTTP/1.1" && version != "HTTP/1.0") {
    const bool well_formed = version.size() == 8 && version.substr(0, 5) == "HTTP/" && is_digit(version[5]) &&
                             version[6] == '.' && is_digit(version[7]) && head.substr(at + 8, 2) == "\r\n";
    if (!well_formed)
      return refuse_value("request line", head.substr(at, head.find_first_of("\r\n", at) - at),
                          "HTTP/1.1 or HTTP/1.0 at byte " + std::to_string(version_at));
    return refuse_value("request line", version, "HTTP/1.1 or HTTP/1.0", 505);
  }
  at += 8;
  if (head.substr(at, 2) != "\r\n") return refuse_at("request line after the version", head, at);
  at += 2;

  // *( field-name ":" OWS field-value OWS CRLF ) CRLF (RFC 9112 5)
  for (bool first = true;; first = false) {
    if (at >= head.size()) return Refusal{400, "head: expected an empty line, found the end at byte " + std::to_string(at)};
    const std::size_t name_at = at;
    at = token_end(head, at);
    if (at == name_at) {
      const char c = head[at];
      if (c == '\r' && head.substr(at, 2) == "\r\n") break;
      if (is_ows(c)) return refuse_at(first ? "first field line" : "field line (obs-fold, RFC 9112 5.2)", head, at);
      return refuse_at("field name", head, at);
    }
    if (at == head.size() || head[at] != ':') {
      return refuse_at("field name " + shown(head.substr(name_at, at - name_at)), head, at);
    }
    const std::size_t colon = at;
    at = value_end(head, at + 1);
    if (head.size() - at < 2 || head[at] != '\r' || head[at + 1] != '\n') {
      return refuse_at("value of field " + shown(head.substr(name_at, colon - name_at)), head, at);
    }
    at += 2;
  }
  at += 2;
  if (at != head.size()) return Refusal{400, "head: found bytes after the empty line, at byte " + std::to_string(at)};
  return std::nullopt;
}

void split_head(std::string_view head, Request& request) {
  const auto take = [&head](std::string_view until) {
    const auto part = head.substr(0, head.find(until));
    head.remove_prefix(part.size() + until.size());
    return part;
  };
  request.method = take(" ");
  request.target = take(" ");
  request.version = take("\r\n") == "HTTP/1.0" ? 10 : 11;
  request.fields.clear();
  while (head != "\r\n") {
    const auto name = take(":");
    request.fields.push_back({name, trim(take("\r\n"))});
  }
}

std::optional<Refusal> check_head(const Request& request) {
  if (request.version != 10 && request.version != 11) return Refusal{505, "request line: expected HTTP/1.1 or HTTP/1.0"};
  if (request.method.empty() || method_end(request.method) != request.method.size()) {
    return refuse_value("method", request.method, "an upper-case token");
  }
  if (request.method == "CONNECT" || request.method == "TRACE") {
    return refuse_value("method", request.method, "neither CONNECT nor TRACE", 501);
  }
  std::optional<Target> target;
  if (auto refusal = check_target(request, target)) return refusal;

  Findings found;
  for (const Field& field : request.fields) {
    switch (field.name.size()) {  // most fields are told apart by their length
      case 4:
        if (iequals(field.name, "Host")) {
          ++found.hosts;
          found.host = &field;
        }
        break;
      case 6:
        if (iequals(field.name, "Expect") && !iequals(field.value, "100-continue")) {
          return refuse_value("Expect", field.value, "100-continue", 417);
        }
        break;
      case 10:
        if (iequals(field.name, "Connection") && !for_each_element(field.value, is_token)) {
          return refuse_value("Connection", field.value, "a list of tokens");
        }
        break;
      case 14:
        if (iequals(field.name, "Content-Length")) {
          ++found.lengths;
          found.length = &field;
        }
        break;
      case 17:
        if (iequals(field.name, "Transfer-Encoding")) {
          ++found.codings;
          found.coding = &field;
        }
        break;
      default: break;
    }
  }
  if (auto refusal = check_host(found, request.version)) return refusal;
  if (auto refusal = check_framing(request, found)) return refusal;
  if (target->absolute && target->secure != request.secure) {
    return refuse_value("request target", request.target,
                        request.secure ? "https over this connection, which is secured (RFC 9110 7.4)"
                                       : "http over this connection, which is not secured (RFC 9110 7.4)",
                        421);
  }
  return std::nullopt;
}

Framing framing(const Request& request) noexcept {
  Framing result;
  bool close = false;
  bool keep_alive = false;
  bool expects = false;
  for (const Field& field : request.fields) {
    switch (field.name.size()) {
      case 6: expects = expects || (iequals(field.name, "Expect") && iequals(field.value, "100-continue")); break;
      case 10:
        if (iequals(field.name, "Connection")) {
          for_each_element(field.value, [&](std::string_view option) {
            close = close || iequals(option, "close");
            keep_alive = keep_alive || iequals(option, "keep-alive");
            return true;
          });
        }
        break;
      case 14:
        if (iequals(field.name, "Content-Length")) result.length = parse_length(field.value).value_or(0);
        break;
      case 17: result.chunked = result.chunked || iequals(field.name, "Transfer-Encoding"); break;
      default: break;
    }
  }
  if (result.chunked) result.length = 0;
  // RFC 9110 10.1.1: not for HTTP/1.0, and a request without content waits for nothing.
  result.expects_continue = expects && request.version == 11 && (result.chunked || result.length > 0);
  result.keep_alive = !close && (request.version == 11 || keep_alive);
  return result;
}

std::optional<Target> split_target(std::string_view target) noexcept {
  Target result;
  if (target.empty()) return std::nullopt;
  if (target == "*") {
    result.path = target;
    return result;
  }
  if (target.front() != '/') {
    std::size_t scheme = 0;
    if (iequals(target.substr(0, 7), "http://")) {
      scheme = 7;
    } else if (iequals(target.substr(0, 8), "https://")) {
      scheme = 8;
      result.secure = true;
    } else {
      return std::nullopt;
    }
    result.absolute = true;
    target.remove_prefix(scheme);
    const std::size_t end = target.find_first_of("/?");
    result.authority = target.substr(0, end);
    target.remove_prefix(end == npos ? target.size() : end);
    if (!parse_host(result.authority)) return std::nullopt;
  }
  const std::size_t mark = target.find('?');
  result.path = target.substr(0, mark);
  if (mark != npos) result.query = target.substr(mark + 1);
  if (result.path.empty()) result.path = "/";  // RFC 9110 4.2.3
  return result;
}

std::optional<HostPort> parse_host(std::string_view authority) noexcept {
  HostPort result;
  std::size_t end = 0;
  if (!authority.empty() && authority.front() == '[') {
    end = authority.find(']');
    if (end == npos || !is_ipv6(authority.substr(1, end - 1))) return std::nullopt;
    ++end;
  } else {
    // reg-name (RFC 3986 3.2.2) but for the comma, which would let a list of hosts pass for one.
    for (; end < authority.size() && authority[end] != ':'; ++end) {
      const char c = authority[end];
      if (c == '%') {
        if (authority.size() - end < 3 || !is(authority[end + 1], hex) || !is(authority[end + 2], hex)) return std::nullopt;
      } else if (!is(c, unreserved | sub_delim) || c == ',') {
        return std::nullopt;
      }
    }
  }
  if (end == 0) return std::nullopt;
  result.host = authority.substr(0, end);
  if (end == authority.size()) return result;
  if (authority[end] != ':') return std::nullopt;
  const std::string_view digits = authority.substr(end + 1);
  if (digits.empty()) return result;  // RFC 3986 3.2.3 allows "host:"
  std::uint32_t port = 0;
  if (digits.size() > 5) return std::nullopt;
  for (const char c : digits) {
    if (!is_digit(c)) return std::nullopt;
    port = port * 10 + static_cast<unsigned>(c - '0');
  }
  if (port > 65535) return std::nullopt;
  result.port = static_cast<std::uint16_t>(port);
  return result;
}

}  // namespace lrt::http

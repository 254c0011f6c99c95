// SPDX-License-Identifier: Apache-2.0
#include <lrt/http/request_parser.hpp>

#include <cstdint>
#include <cstring>

#include "src/base/ascii.hpp"
#include "src/base/quote.hpp"
#include "src/http/framing.hpp"
#include "src/http/target.hpp"

namespace lrt::http {
inline namespace v0 {
namespace {

using namespace detail;
using framing::for_each_element;
using framing::is_token;
using framing::parse_length;

// ---- Words for refusals. Nothing a client sent is echoed raw: bytes outside visible ASCII appear as numbers.

std::string shown(std::string_view found) { return quoted_ascii(found, 60); }

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

Refusal refuse_at(std::string_view where, std::string_view text, std::size_t at, int status = 400) {
  std::string reason(where);
  reason += ": found ";
  reason += at < text.size() ? byte_name(text[at]) : "the end";
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
/// The characters of a URI (RFC 3986) except '#': a request target has no fragment (RFC 9112 3.2).
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

/// The position of the first byte from `at` on that a field value must not contain, usually the CR that ends it.
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

/// The fields for routing and for the framing of the body.
struct FramingFields {
  const Field* host = nullptr;
  const Field* length = nullptr;
  const Field* coding = nullptr;
  unsigned hosts = 0, lengths = 0, codings = 0;
};

/// Sets `target`, or returns an error.
std::optional<Refusal> check_target(const Request& request, std::optional<Target>& target_parts) {
  const std::string_view target = request.target;
  if (const std::size_t end = target_end(target, 0); end != target.size()) return refuse_at("request target", target, end);
  if (target == "*" && request.method != "OPTIONS") {
    return Refusal{400, "request target: \"*\" is for OPTIONS only, found method " + shown(request.method)};
  }
  target_parts = split_target(target);
  if (!target_parts) {
    return refuse_value("request target", target, "a path that begins with '/', an http or https URI with a host and no userinfo, or \"*\"");
  }
  return std::nullopt;
}

std::optional<Refusal> check_host(const FramingFields& found, int version) {
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
    if (comma == std::string_view::npos) return others && is_chunked && end == element.size() ? 501 : 400;
    if (end == 0 || is_chunked) return 400;
    // transfer-coding = token *( OWS ";" OWS transfer-parameter ); the content of the parameters is ignored.
    if (const std::string_view rest = trim(element.substr(end)); !rest.empty() && rest.front() != ';') return 400;
    list.remove_prefix(comma + 1);
  }
}

/// Sets the framing of the body by its header fields.
std::optional<Refusal> check_framing(const Request& request, const FramingFields& found, Framing& framing) {
  const int version = request.version;
  if (found.lengths > 1) return refuse_repeated(request, "Content-Length", found.lengths);
  if (found.codings > 1) return refuse_repeated(request, "Transfer-Encoding", found.codings);
  if (found.length != nullptr && found.coding != nullptr) {
    return Refusal{400, "Content-Length: found " + shown(found.length->value) + " beside Transfer-Encoding " + shown(found.coding->value)};
  }
  if (found.length != nullptr) {
    const auto length = parse_length(found.length->value);
    if (!length) return refuse_value("Content-Length", found.length->value, "1 to 19 digits");
    framing.length = *length;
  }
  if (found.coding != nullptr) {
    const std::string_view coding = found.coding->value;
    if (version == 10) return Refusal{400, "Transfer-Encoding: found in an HTTP/1.0 request"};
    if (!iequals(coding, "chunked")) { return refuse_value("Transfer-Encoding", coding, "exactly \"chunked\"", status_of_coding(coding)); }
    framing.chunked = true;
  }
  return std::nullopt;
}

/// Parses `header` up to its empty line, without checking the meaning of its parts.
/// @param size  of the header section
std::optional<Refusal> parse_lines(std::string_view header, Request& request, std::size_t& size) {
  // request-line = method SP request-target SP HTTP-version CRLF (RFC 9112 3)
  if (header.empty() || header[0] == '\r' || header[0] == '\n') return Refusal{400, "request line: found an empty line at byte 0"};
  std::size_t at = method_end(header);
  if (at == header.size() || header[at] != ' ' || at == 0) return refuse_at("method", header, at);
  request.method = header.substr(0, at);
  const std::size_t target_at = ++at;
  at = target_end(header, at);
  if (at == target_at || at == header.size() || header[at] != ' ') {
    if (at != target_at && header.substr(at, 2) == "\r\n") {
      return Refusal{400, "request line: expected an HTTP version, found the end of the line at byte " + std::to_string(at)};
    }
    return refuse_at("request target", header, at);
  }
  request.target = header.substr(target_at, at - target_at);
  const std::size_t version_at = ++at;
  const std::string_view version = header.substr(at, 8);
  const std::optional<int> spoken = spoken_version(version);
  if (!spoken) {
    const bool well_formed = version.size() == 8 && version.substr(0, 5) == "HTTP/" && is_digit(version[5]) && version[6] == '.' &&
                             is_digit(version[7]) && header.substr(at + 8, 2) == "\r\n";
    if (!well_formed)
      return refuse_value("request line", header.substr(at, header.find_first_of("\r\n", at) - at),
                          "HTTP/1.1 or HTTP/1.0 at byte " + std::to_string(version_at));
    return refuse_value("request line", version, "HTTP/1.1 or HTTP/1.0", 505);
  }
  request.version = *spoken;
  at += 8;
  if (header.substr(at, 2) != "\r\n") return refuse_at("request line after the version", header, at);
  at += 2;

  // *( field-name ":" OWS field-value OWS CRLF ) CRLF (RFC 9112 5)
  request.fields.clear();
  for (bool first = true;; first = false) {
    if (at >= header.size()) return Refusal{400, "header section: expected an empty line, found the end at byte " + std::to_string(at)};
    const std::size_t name_at = at;
    at = token_end(header, at);
    if (at == name_at) {
      const char c = header[at];
      if (c == '\r' && header.substr(at, 2) == "\r\n") break;
      if (is_ows(c)) return refuse_at(first ? "first field line" : "field line (obs-fold, RFC 9112 5.2)", header, at);
      return refuse_at("field name", header, at);
    }
    const std::string_view name = header.substr(name_at, at - name_at);
    if (at == header.size() || header[at] != ':') return refuse_at("field name " + shown(name), header, at);
    const std::size_t value_at = at + 1;
    at = value_end(header, value_at);
    if (header.size() - at < 2 || header[at] != '\r' || header[at + 1] != '\n') { return refuse_at("value of field " + shown(name), header, at); }
    request.fields.push_back({name, trim(header.substr(value_at, at - value_at))});
    at += 2;
  }
  size = at + 2;
  return std::nullopt;
}

}  // namespace

std::optional<int> spoken_version(std::string_view http_version) noexcept {
  if (http_version.size() != 8 || http_version.substr(0, 7) != "HTTP/1." || !is_digit(http_version[7])) return std::nullopt;
  return http_version[7] == '0' ? 10 : 11;
}

std::optional<Refusal> parse_request_header(std::string_view header, Request& request, Framing& framing) {
  std::size_t size = 0;
  if (auto refusal = parse_lines(header, request, size)) return refusal;
  if (size != header.size()) return Refusal{400, "header section: found bytes after the empty line, at byte " + std::to_string(size)};
  return check_request(request, framing);
}

std::optional<std::size_t> parse_leading_header(std::string_view bytes, Request& request, Framing& framing) {
  std::size_t size = 0;
  if (parse_lines(bytes, request, size) || check_request(request, framing)) return std::nullopt;
  return size;
}

std::optional<Refusal> check_request(const Request& request, Framing& framing) {
  framing = {};
  if (request.version != 10 && request.version != 11) return Refusal{505, "request line: expected HTTP/1.1 or HTTP/1.0"};
  if (request.method.empty() || method_end(request.method) != request.method.size()) {
    return refuse_value("method", request.method, "an upper-case token");
  }
  if (request.method == "CONNECT" || request.method == "TRACE") { return refuse_value("method", request.method, "neither CONNECT nor TRACE", 501); }
  std::optional<Target> target;
  if (auto refusal = check_target(request, target)) return refusal;

  FramingFields found;
  bool close = false, keep_alive = false, expects = false;
  const auto take_option = [&](std::string_view option) {
    if (!is_token(option)) return false;
    close = close || iequals(option, "close");
    keep_alive = keep_alive || iequals(option, "keep-alive");
    return true;
  };
  for (const Field& field : request.fields) {
    switch (field.name.size()) {  // the size rules out most fields
      case 4:
        if (iequals(field.name, "Host")) {
          ++found.hosts;
          found.host = &field;
        }
        break;
      case 6:
        if (!iequals(field.name, "Expect")) break;
        if (!iequals(field.value, "100-continue")) return refuse_value("Expect", field.value, "100-continue", 417);
        expects = true;
        break;
      case 10:
        if (iequals(field.name, "Connection") && !for_each_element(field.value, take_option)) {
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
  if (auto refusal = check_framing(request, found, framing)) return refusal;
  if (target->absolute && target->secure != request.secure) {
    return refuse_value("request target", request.target,
                        request.secure ? "https over this connection, which is secured (RFC 9110 7.4)"
                                       : "http over this connection, which is not secured (RFC 9110 7.4)",
                        421);
  }
  // RFC 9110 10.1.1: not for HTTP/1.0, and a request without content waits for nothing.
  framing.expects_continue = expects && request.version == 11 && (framing.chunked || framing.length > 0);
  framing.keep_alive = !close && (request.version == 11 || keep_alive);
  return std::nullopt;
}

}  // namespace v0
}  // namespace lrt::http

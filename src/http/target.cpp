// SPDX-License-Identifier: Apache-2.0
#include "src/http/target.hpp"

#include <lrt/http/message.hpp>

#include "src/base/ascii.hpp"

namespace lrt::http {
namespace {

using namespace detail;

/// IPv4address (RFC 3986 3.2.2)
bool is_ipv4(std::string_view text) noexcept {
  for (int part = 0; part < 4; ++part) {
    std::size_t digits = 0;
    unsigned value = 0;
    while (digits < text.size() && digits < 3 && is_digit(text[digits])) { value = value * 10 + static_cast<unsigned>(text[digits++] - '0'); }
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

}  // namespace

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
    target.remove_prefix(end == std::string_view::npos ? target.size() : end);
    if (!parse_host(result.authority)) return std::nullopt;
  }
  const std::size_t mark = target.find('?');
  result.path = target.substr(0, mark);
  if (mark != std::string_view::npos) result.query = target.substr(mark + 1);
  if (result.path.empty()) result.path = "/";  // RFC 9110 4.2.3
  return result;
}

std::optional<HostPort> parse_host(std::string_view authority) noexcept {
  HostPort result;
  std::size_t end = 0;
  if (!authority.empty() && authority.front() == '[') {
    end = authority.find(']');
    if (end == std::string_view::npos || !is_ipv6(authority.substr(1, end - 1))) return std::nullopt;
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

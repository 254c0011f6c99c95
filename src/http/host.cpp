// SPDX-License-Identifier: Apache-2.0
#include "src/http/host.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <cstring>
#include <string>

#include "src/base/ascii.hpp"

namespace lrt::http {
namespace {

using lrt::detail::is_alpha;
using lrt::detail::is_digit;

/// Parses exactly four decimal numbers without leading zeros: inet_pton() is strict, inet_aton() would accept "127.1" and "0x7f.1".
std::optional<AddressBytes> parse_ipv4(std::string_view text) {
  in_addr found{};
  if (::inet_pton(AF_INET, std::string(text).c_str(), &found) != 1) return std::nullopt;
  AddressBytes result{};
  std::copy(ipv4_mapped.begin(), ipv4_mapped.end(), result.begin());
  std::memcpy(result.data() + ipv4_mapped.size(), &found, 4);
  return result;
}

std::optional<AddressBytes> parse_ipv6(std::string_view text) {
  AddressBytes result{};
  if (::inet_pton(AF_INET6, std::string(text).c_str(), result.data()) != 1) return std::nullopt;
  return result;
}

}  // namespace

std::optional<AddressBytes> parse_address(std::string_view text) {
  if (text.find('\0') != std::string_view::npos) return std::nullopt;  // inet_pton() would stop at it
  return text.find(':') == std::string_view::npos ? parse_ipv4(text) : parse_ipv6(text);
}

std::optional<AddressBytes> literal_address(std::string_view host) {
  if (host.size() >= 2 && host.front() == '[' && host.back() == ']') return parse_address(host.substr(1, host.size() - 2));
  return host.find(':') == std::string_view::npos ? parse_address(host) : std::nullopt;
}

bool is_this_machine(std::string_view host) {
  if (host == "localhost" || host == "[::1]") return true;
  const std::optional<AddressBytes> address = literal_address(host);
  return address && std::equal(ipv4_mapped.begin(), ipv4_mapped.end(), address->begin()) && (*address)[12] == 127;
}

bool is_host_name(std::string_view text) noexcept {
  if (!text.empty() && text.back() == '.') text.remove_suffix(1);
  if (text.empty() || text.size() > 253) return false;
  while (true) {
    const std::size_t dot = text.find('.');
    const std::string_view label = text.substr(0, dot);
    if (label.empty() || label.size() > 63 || label.front() == '-' || label.back() == '-') return false;
    for (const char c : label) {
      if (!is_alpha(c) && !is_digit(c) && c != '-' && c != '_') return false;
    }
    if (dot == std::string_view::npos) return true;
    text.remove_prefix(dot + 1);
  }
}

std::optional<std::uint16_t> parse_port(std::string_view text) noexcept {
  if (text.empty() || text.size() > 5 || text.front() == '0') return std::nullopt;
  unsigned value = 0;
  for (const char c : text) {
    if (!is_digit(c)) return std::nullopt;
    value = value * 10 + static_cast<unsigned>(c - '0');
  }
  if (value > 65535) return std::nullopt;
  return static_cast<std::uint16_t>(value);
}

}  // namespace lrt::http

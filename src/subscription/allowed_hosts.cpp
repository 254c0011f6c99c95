// SPDX-License-Identifier: Apache-2.0
#include <lrt/subscription/allowed_hosts.hpp>

#include <algorithm>

#include "src/base/ascii.hpp"
#include "src/http/host.hpp"

namespace lrt::subscription {
namespace {

using http::is_host_name;
using http::literal_address;
using http::parse_address;
using http::parse_port;
using lrt::detail::hex;
using lrt::detail::is;
using lrt::detail::is_digit;
using Bytes = http::AddressBytes;

constexpr std::array<std::uint8_t, 12> nat64{0x00, 0x64, 0xFF, 0x9B};  // RFC 6052 2.1
constexpr Bytes loopback4{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF, 127, 0, 0, 1};
constexpr Bytes loopback6{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};

template <std::size_t n>
bool starts_with(const Bytes& address, const std::array<std::uint8_t, n>& prefix) noexcept {
  return std::equal(prefix.begin(), prefix.end(), address.begin());
}
bool is_ipv4(const Bytes& address) noexcept { return starts_with(address, http::ipv4_mapped); }

bool is_special_ipv4(const std::uint8_t* a) noexcept {
  return a[0] == 0 || a[0] == 127 || (a[0] == 169 && a[1] == 254) || a[0] >= 224;  // from 240: reserved and broadcast
}

/// Whether an address is loopback, unspecified, link-local, multicast, broadcast or reserved. If a gateway would extract an IPv4 address
/// from an IPv6 address, the IPv4 address is checked.
bool is_special(const Bytes& a) noexcept {
  if (is_ipv4(a)) return is_special_ipv4(a.data() + 12);
  if (a[0] == 0xFF || (a[0] == 0xFE && (a[1] & 0xC0U) == 0x80)) return true;  // multicast, link-local
  if (std::all_of(a.begin(), a.begin() + 12, [](std::uint8_t byte) { return byte == 0; })) {
    return is_special_ipv4(a.data() + 12);  // ::, ::1, IPv4-compatible (RFC 4291 2.5.5.1)
  }
  if (starts_with(a, nat64)) return is_special_ipv4(a.data() + 12);
  if (a[0] == 0x00 && a[1] == 0x64 && a[2] == 0xFF && a[3] == 0x9B) return true;  // local-use NAT64 (RFC 8215)
  if (a[0] == 0x20 && a[1] == 0x02) return is_special_ipv4(a.data() + 2);         // 6to4 (RFC 3056)
  if (a[0] == 0x20 && a[1] == 0x01 && a[2] == 0 && a[3] == 0) {                   // Teredo (RFC 4380 4): the client's address, inverted
    const std::array<std::uint8_t, 4> client{static_cast<std::uint8_t>(~a[12]), static_cast<std::uint8_t>(~a[13]), static_cast<std::uint8_t>(~a[14]),
                                             static_cast<std::uint8_t>(~a[15])};
    return is_special_ipv4(client.data());
  }
  return false;
}

bool is_within(const Bytes& address, const Bytes& network, unsigned bits) noexcept {
  // ::/0 must not contain IPv4 addresses, which are stored as IPv4-mapped.
  if (is_ipv4(address) && (bits < 96 || !is_ipv4(network))) return false;
  const std::size_t whole = bits / 8;
  if (!std::equal(network.begin(), network.begin() + whole, address.begin())) return false;
  const unsigned rest = bits % 8;
  return rest == 0 || ((address[whole] ^ network[whole]) >> (8 - rest)) == 0;
}

/// The normal form for comparing names: lower case, without a dot at the end.
std::string folded(std::string_view host) {
  std::string result = lrt::detail::lower(host);
  if (result.size() > 1 && result.back() == '.') result.pop_back();
  return result;
}

/// "127.1", "0x7f000001": resolvers read these as IPv4 addresses. No host name ends with a number.
bool ends_in_number(std::string_view folded_name) noexcept {
  const std::string_view last = folded_name.substr(folded_name.rfind('.') + 1);
  if (last.substr(0, 2) == "0x") return std::all_of(last.begin() + 2, last.end(), [](char c) { return is(c, hex); });
  return std::all_of(last.begin(), last.end(), [](char c) { return is_digit(c); });
}

Unexpected bad_entry(const std::string& entry, const char* expected) {
  return unexpected(Errc::invalid_option, "allowed host \"" + entry + "\": expected " + expected);
}

}  // namespace

Result<AllowedHosts> AllowedHosts::parse(const std::vector<std::string>& entries) {
  AllowedHosts result;
  for (const std::string& text : entries) {
    Entry entry;
    std::string_view host = text;
    // A port follows a bracket or the only colon.
    const std::size_t colon = text.rfind(':');
    const bool bracketed = !text.empty() && text.front() == '[';
    if (colon != std::string::npos && (bracketed ? text[colon - 1] == ']' : text.find(':') == colon)) {
      entry.port = parse_port(host.substr(colon + 1));
      if (!entry.port) return bad_entry(text, "a port from 1 to 65535 after the colon");
      host = host.substr(0, colon);
    }
    if (bracketed) {
      if (host.size() < 2 || host.back() != ']') return bad_entry(text, "an IPv6 address or network in brackets, optionally with a port");
      host = host.substr(1, host.size() - 2);
      if (host.find(':') == std::string_view::npos) return bad_entry(text, "an IPv6 address or network in brackets");
    }

    const std::size_t slash = host.find('/');
    if (const std::optional<Bytes> address = parse_address(host.substr(0, slash))) {
      entry.network = *address;
      const bool four = host.find(':') == std::string_view::npos;
      entry.bits = 128;
      if (slash != std::string_view::npos) {
        const std::string_view digits = host.substr(slash + 1);
        const std::optional<std::uint16_t> bits = digits == "0" ? std::optional<std::uint16_t>(0) : parse_port(digits);
        if (!bits || *bits > (four ? 32 : 128)) return bad_entry(text, four ? "0 to 32 after '/'" : "0 to 128 after '/'");
        entry.bits = *bits + (four ? 96U : 0U);
        for (unsigned bit = entry.bits; bit < 128; ++bit) {
          if ((entry.network[bit / 8] & (0x80U >> (bit % 8))) != 0) return bad_entry(text, "a network with zeros after its prefix");
        }
      }
      result.entries_.push_back(std::move(entry));
      continue;
    }
    const std::string name = folded(host);
    if (name == "localhost") {
      for (const Bytes& loopback : {loopback4, loopback6}) {
        entry.network = loopback;
        entry.bits = 128;
        result.entries_.push_back(entry);
      }
      continue;
    }
    const std::string_view labels = !name.empty() && name.front() == '.' ? std::string_view(name).substr(1) : name;
    if (!is_host_name(labels) || ends_in_number(labels)) {
      return bad_entry(text, "a network, an address, a name, or '.' and the end of a name, optionally with a port");
    }
    entry.name = name;
    result.entries_.push_back(std::move(entry));
  }
  return result;
}

bool AllowedHosts::has_network(std::uint16_t port, const std::array<std::uint8_t, 16>& address) const noexcept {
  return std::any_of(entries_.begin(), entries_.end(),
                     [&](const Entry& e) { return e.name.empty() && e.port.value_or(port) == port && is_within(address, e.network, e.bits); });
}

bool AllowedHosts::names(std::string_view host, std::uint16_t port) const {
  if (const std::optional<Bytes> address = literal_address(host)) return has_network(port, *address);
  const std::string name = folded(host);
  if (name == "localhost") return has_network(port, loopback4) || has_network(port, loopback6);
  if (!is_host_name(name)) return false;
  return std::any_of(entries_.begin(), entries_.end(), [&](const Entry& e) {
    if (e.name.empty() || e.port.value_or(port) != port) return false;
    if (e.name.front() != '.') return e.name == name;
    return name.size() > e.name.size() && name.compare(name.size() - e.name.size(), e.name.size(), e.name) == 0;
  });
}

bool AllowedHosts::allows(std::string_view host, std::uint16_t port, std::string_view address) const {
  const std::optional<Bytes> to = parse_address(address);
  if (!to || !names(host, port)) return false;
  if (const std::optional<Bytes> named = literal_address(host)) return *named == *to;
  if (folded(host) == "localhost") return (*to == loopback4 || *to == loopback6) && has_network(port, *to);
  return !is_special(*to) || has_network(port, *to);
}

}  // namespace lrt::subscription

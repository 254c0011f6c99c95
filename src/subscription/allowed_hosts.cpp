#include <lrt/subscription/allowed_hosts.hpp>

#include <arpa/inet.h>

#include <algorithm>
#include <cstring>

#include <lrt/http/head.hpp>

#include "src/base/ascii.hpp"

namespace lrt::subscription {
namespace {

using lrt::detail::hex;
using lrt::detail::is;
using lrt::detail::is_alpha;
using lrt::detail::is_digit;

/// An IPv6 address, or an IPv4 address as IPv4-mapped.
using Bytes = std::array<std::uint8_t, 16>;

constexpr std::array<std::uint8_t, 12> mapped{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF};
constexpr std::array<std::uint8_t, 12> nat64{0x00, 0x64, 0xFF, 0x9B};  // RFC 6052 2.1
constexpr Bytes loopback4{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF, 127, 0, 0, 1};
constexpr Bytes loopback6{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};

template <std::size_t n>
bool starts_with(const Bytes& address, const std::array<std::uint8_t, n>& prefix) noexcept {
  return std::equal(prefix.begin(), prefix.end(), address.begin());
}
bool is_ipv4(const Bytes& address) noexcept { return starts_with(address, mapped); }

/// Parses exactly four decimal numbers without leading zeros: inet_pton() is strict, inet_aton() would accept "127.1" and "0x7f.1".
std::optional<Bytes> parse_ipv4(std::string_view text) {
  in_addr found{};
  if (::inet_pton(AF_INET, std::string(text).c_str(), &found) != 1) return std::nullopt;
  Bytes result{};
  std::copy(mapped.begin(), mapped.end(), result.begin());
  std::memcpy(result.data() + mapped.size(), &found, 4);
  return result;
}

std::optional<Bytes> parse_ipv6(std::string_view text) {
  Bytes result{};
  if (::inet_pton(AF_INET6, std::string(text).c_str(), result.data()) != 1) return std::nullopt;
  return result;
}

std::optional<Bytes> parse_address(std::string_view text) {
  if (text.find('\0') != std::string_view::npos) return std::nullopt;  // inet_pton() would stop at it
  return text.find(':') == std::string_view::npos ? parse_ipv4(text) : parse_ipv6(text);
}

/// The address that the host of a URL denotes; nullopt: it is a name.
std::optional<Bytes> literal(std::string_view host) {
  if (host.size() >= 2 && host.front() == '[' && host.back() == ']') return parse_address(host.substr(1, host.size() - 2));
  return host.find(':') == std::string_view::npos ? parse_address(host) : std::nullopt;
}

bool is_special_ipv4(const std::uint8_t* a) noexcept {
  return a[0] == 0 || a[0] == 127 || (a[0] == 169 && a[1] == 254) || a[0] >= 224;  // from 240: reserved and broadcast
}

/// Whether an address is loopback, unspecified, link-local, multicast, broadcast or reserved. If a gateway would extract an IPv4 address
/// from an IPv6 address, the IPv4 address is checked.
bool is_special(const Bytes& a) noexcept {
  if (is_ipv4(a)) return is_special_ipv4(a.data() + 12);
  if (a[0] == 0xFF || (a[0] == 0xFE && (a[1] & 0xC0U) == 0x80)) return true;                // multicast, link-local
  if (std::all_of(a.begin(), a.begin() + 12, [](std::uint8_t byte) { return byte == 0; })) {
    return is_special_ipv4(a.data() + 12);                                                  // ::, ::1, IPv4-compatible (RFC 4291 2.5.5.1)
  }
  if (starts_with(a, nat64)) return is_special_ipv4(a.data() + 12);
  if (a[0] == 0x00 && a[1] == 0x64 && a[2] == 0xFF && a[3] == 0x9B) return true;            // local-use NAT64 (RFC 8215)
  if (a[0] == 0x20 && a[1] == 0x02) return is_special_ipv4(a.data() + 2);                   // 6to4 (RFC 3056)
  if (a[0] == 0x20 && a[1] == 0x01 && a[2] == 0 && a[3] == 0) {                             // Teredo (RFC 4380 4): the client's address, inverted
    const std::array<std::uint8_t, 4> client{static_cast<std::uint8_t>(~a[12]), static_cast<std::uint8_t>(~a[13]),
                                             static_cast<std::uint8_t>(~a[14]), static_cast<std::uint8_t>(~a[15])};
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

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = lrt::detail::lower(c);
  return result;
}

/// The normal form for comparing names: lower case, without a dot at the end.
std::string folded(std::string_view host) {
  std::string result = lower(host);
  if (result.size() > 1 && result.back() == '.') result.pop_back();
  return result;
}

/// Whether it is a host name (RFC 1123 2.1). Underscores are allowed, because some networks use them. Internationalised names must be in
/// ASCII form.
bool is_name(std::string_view text) noexcept {
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

/// "127.1", "0x7f000001": resolvers read these as IPv4 addresses. No host name ends with a number.
bool ends_in_number(std::string_view folded_name) noexcept {
  const std::string_view last = folded_name.substr(folded_name.rfind('.') + 1);
  if (last.substr(0, 2) == "0x") return std::all_of(last.begin() + 2, last.end(), [](char c) { return is(c, hex); });
  return std::all_of(last.begin(), last.end(), [](char c) { return is_digit(c); });
}

/// 1 to 65535 without leading zeros.
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
    if (!is_name(labels) || ends_in_number(labels)) {
      return bad_entry(text, "a network, an address, a name, or '.' and the end of a name, optionally with a port");
    }
    entry.name = name;
    result.entries_.push_back(std::move(entry));
  }
  return result;
}

bool AllowedHosts::has_network(std::uint16_t port, const std::array<std::uint8_t, 16>& address) const noexcept {
  return std::any_of(entries_.begin(), entries_.end(), [&](const Entry& e) {
    return e.name.empty() && e.port.value_or(port) == port && is_within(address, e.network, e.bits);
  });
}

bool AllowedHosts::names(std::string_view host, std::uint16_t port) const {
  if (const std::optional<Bytes> address = literal(host)) return has_network(port, *address);
  const std::string name = folded(host);
  if (name == "localhost") return has_network(port, loopback4) || has_network(port, loopback6);
  if (!is_name(name)) return false;
  return std::any_of(entries_.begin(), entries_.end(), [&](const Entry& e) {
    if (e.name.empty() || e.port.value_or(port) != port) return false;
    if (e.name.front() != '.') return e.name == name;
    return name.size() > e.name.size() && name.compare(name.size() - e.name.size(), e.name.size(), e.name) == 0;
  });
}

bool AllowedHosts::allows(std::string_view host, std::uint16_t port, std::string_view address) const {
  const std::optional<Bytes> to = parse_address(address);
  if (!to || !names(host, port)) return false;
  if (const std::optional<Bytes> named = literal(host)) return *named == *to;
  if (folded(host) == "localhost") return (*to == loopback4 || *to == loopback6) && has_network(port, *to);
  return !is_special(*to) || has_network(port, *to);
}

Result<CallbackUrl> parse_callback_url(std::string_view url) {
  constexpr std::size_t longest = 2'048;
  const auto refuse = [](std::string what, std::optional<std::size_t> offset = std::nullopt) {
    return unexpected(Error{Errc::expected_iri, "callback URL: " + std::move(what), offset});
  };
  if (url.size() > longest) return refuse("expected at most 2048 bytes, found " + std::to_string(url.size()));
  for (std::size_t at = 0; at < url.size(); ++at) {
    if (url[at] == '#') return refuse("expected no fragment", at);
    const bool escape = url[at] == '%';
    if (!is(url[at], lrt::detail::uri) || (escape && (url.size() - at < 3 || !is(url[at + 1], hex) || !is(url[at + 2], hex)))) {
      return refuse("found a byte that is not allowed in a URL, at byte " + std::to_string(at), at);
    }
  }
  const std::optional<http::Target> parts = http::split_target(url);
  if (!parts || !parts->absolute) return refuse("expected an absolute http or https URL with a host and without userinfo");
  const std::optional<http::HostPort> authority = http::parse_host(parts->authority);
  if (!authority) return refuse("expected a host, optionally with a port");  // split_target() has checked it

  CallbackUrl result;
  result.secure = parts->secure;
  result.host = lower(authority->host);
  if (!literal(result.host) && !is_name(result.host)) {
    return refuse("expected a host name or an address, found \"" + result.host + "\"");
  }
  const std::uint16_t usual = result.secure ? 443 : 80;
  result.port = usual;
  if (const std::string_view rest = parts->authority.substr(authority->host.size()); !rest.empty()) {
    const std::optional<std::uint16_t> port = parse_port(rest.substr(1));
    if (!port) return refuse("expected a port from 1 to 65535, without leading zeros, after the colon");
    result.port = *port;
  }
  result.authority = result.host;
  if (result.port != usual) result.authority += ":" + std::to_string(result.port);
  result.target = parts->path;
  // A URL with an empty query differs from one without a query. split_target() does not distinguish them.
  if (const std::size_t mark = url.find('?'); mark != std::string_view::npos) result.target += url.substr(mark);
  return result;
}

}  // namespace lrt::subscription

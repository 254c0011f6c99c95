#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>

namespace lrt::subscription {

/// Which receivers may be called: what the integrator named, and nothing else. Without entries: none.
///
/// An entry is one of
///
///     127.0.0.0/8   fd00::/8          a network
///     192.168.1.7   ::1               an address
///     receiver.example                a name
///     .robots.example                 every name that ends so
///
/// each with an optional port, `receiver.example:8080`, `[::1]:8080`, `10.0.0.0/8:8080`; without one: any port.
///
/// A network or address lets URLs name hosts by address; a host's name needs an entry by name. A name lets its host be called at whatever
/// address it resolves to, but for addresses that lead back into this machine or to nobody in particular (loopback, unspecified,
/// link-local, multicast, broadcast, reserved, and IPv6 forms of them: IPv4-compatible, NAT64, 6to4, Teredo): for these an entry must
/// name the network or address too. "localhost" is the name of 127.0.0.1 and ::1: it needs no entry but theirs, and as an entry stands for
/// both. Numeric hosts count only in the usual form: "127.1" and "0x7f000001" are names, and no entry can name them. IPv4-mapped IPv6
/// addresses are taken as the IPv4 address, and ::/0 is every IPv6 address and no IPv4 one. The dot at the end of a name does not matter.
///
/// @par Threads     const: any
/// @par Implements  R0.13, R0.16
class AllowedHosts {
 public:
  AllowedHosts() = default;
  /// @par Errors  invalid_option, naming the entry
  static Result<AllowedHosts> parse(const std::vector<std::string>& entries);

  bool empty() const noexcept { return entries_.empty(); }
  /// Whether a URL with this host may be tried at all; no resolution.
  /// @param host  as in the URL: a name, an IPv4 address, or an IPv6 address in brackets; compared without case
  bool names(std::string_view host, std::uint16_t port) const;
  /// Whether a connection for a URL with this host may go to this address.
  /// @param address  numeric, what `host` resolved to
  bool allows(std::string_view host, std::uint16_t port, std::string_view address) const;

 private:
  struct Entry {
    std::string name;                        ///< lower-case; empty for a network
    std::array<std::uint8_t, 16> network{};  ///< IPv4 as IPv4-mapped
    unsigned bits = 0;                       ///< of `network` that count, of 128
    std::optional<std::uint16_t> port;
  };
  bool has_network(std::uint16_t port, const std::array<std::uint8_t, 16>& address) const noexcept;

  std::vector<Entry> entries_;
};

/// A callback URL taken apart.
struct CallbackUrl {
  bool secure = false;
  std::string host;         ///< lower-case; IPv6 in brackets
  std::uint16_t port = 80;  ///< as said or the scheme's
  std::string authority;    ///< for the Host field: host, and port unless it is the scheme's
  std::string target;       ///< path and query, at least "/"
};
/// @par Errors  expected_iri: not absolute, not http(s), userinfo, a fragment, bytes that RFC 3986 does not allow, a host that is no
///              address and no host name (percent escapes, empty labels), a bad port (0, empty, leading zeros), more than 2,048 bytes
Result<CallbackUrl> parse_callback_url(std::string_view url);

}  // namespace lrt::subscription

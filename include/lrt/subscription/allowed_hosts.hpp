// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>

namespace lrt::subscription {
inline namespace v0 {

/// The receivers to which web callbacks may be posted. Without entries: none.
///
/// An entry is one of
///
///     127.0.0.0/8   fd00::/8          a network
///     192.168.1.7   ::1               an address
///     receiver.example                a name
///     .robots.example                 every name with this ending
///
/// each with an optional port, `receiver.example:8080`, `[::1]:8080`, `10.0.0.0/8:8080`. Without a port every port is
/// allowed.
///
/// - A URL with a numeric host needs an entry with its address or network. A URL with a name needs an entry with the
///   name.
/// - An entry with a name allows every address that the name resolves to, except special addresses: loopback,
///   unspecified, link-local, multicast, broadcast, reserved, and their IPv6 forms (IPv4-compatible, NAT64, 6to4,
///   Teredo). A special address also needs an entry with the address or network.
/// - "localhost" is the name of 127.0.0.1 and ::1. It is allowed by an entry for one of these. As an entry it stands
///   for both.
/// - Numeric hosts are recognised in the usual form only. "127.1" and "0x7f000001" count as names, and no entry can
///   allow them.
/// - An IPv4-mapped IPv6 address counts as its IPv4 address. ::/0 contains every IPv6 address and no IPv4 address.
/// - A dot at the end of a name is ignored.
///
/// @par Threads     Constant functions: any, concurrently.
/// @par Implements  R0.13, R0.16
class LRT_API AllowedHosts {
 public:
  AllowedHosts() = default;
  /// Parses entries.
  /// @par Errors  invalid_option, with the entry
  static Result<AllowedHosts> parse(const std::vector<std::string>& entries);

  bool empty() const noexcept { return entries_.empty(); }  ///< whether no receiver is allowed
  /// Whether a URL with this host is allowed. Does not resolve the name.
  /// @param host  as in the URL: a name, an IPv4 address, or an IPv6 address in brackets; case-insensitive
  bool names(std::string_view host, std::uint16_t port) const;
  /// Whether a URL with this host may be connected at this address.
  /// @param address  numeric, one that `host` resolved to
  bool allows(std::string_view host, std::uint16_t port, std::string_view address) const;

 private:
  struct Entry {
    std::string name;                        ///< lower-case; empty for a network
    std::array<std::uint8_t, 16> network{};  ///< IPv4 as IPv4-mapped
    unsigned bits = 0;                       ///< length of the network's prefix, 0 to 128
    std::optional<std::uint16_t> port;
  };
  bool has_network(std::uint16_t port, const std::array<std::uint8_t, 16>& address) const noexcept;

  std::vector<Entry> entries_;
};

}  // namespace v0
}  // namespace lrt::subscription

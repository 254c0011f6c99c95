// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include <lrt/base/abi.hpp>

/// Hosts and ports of URLs.
namespace lrt::http {

/// An IPv6 address, or an IPv4 address as IPv4-mapped.
using AddressBytes = std::array<std::uint8_t, 16>;
inline constexpr std::array<std::uint8_t, 12> ipv4_mapped{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF};

/// The address that a text denotes in its usual form, IPv6 without brackets. "127.1" and "0x7f.1" are not accepted.
std::optional<AddressBytes> parse_address(std::string_view text);
/// The address that the host of a URL denotes; nullopt: it is a name.
std::optional<AddressBytes> literal_address(std::string_view host);
/// Whether the host of a URL is a loopback address or "localhost": what is sent there does not leave this machine.
LRT_INTERNAL_API bool is_this_machine(std::string_view host);
/// Whether it is a host name (RFC 1123 2.1). Underscores are allowed, because some networks use them. Internationalised names must be in
/// ASCII form.
bool is_host_name(std::string_view text) noexcept;
/// 1 to 65535 without leading zeros.
std::optional<std::uint16_t> parse_port(std::string_view text) noexcept;

}  // namespace lrt::http

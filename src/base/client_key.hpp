// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace lrt {

/// The key of a client for limits per client: an IPv4 address, or the /64 network of an IPv6 address, "2001:db8:1:2::/64".
/// An IPv6 host can use all addresses of its /64. An IPv4-mapped address counts as IPv4. Other text is returned unchanged.
///
/// @param address  numeric, also with a zone: "fe80::1%eth0"
std::string client_key(std::string_view address);

/// The address is one of this machine's loopback addresses.
bool is_this_machine(std::string_view address) noexcept;

}  // namespace lrt

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <lrt/base/result.hpp>

namespace lrt {

/// The numeric addresses that Listen::address stands for: itself, or those of a host name, IPv4 before IPv6. They are tried in this order.
/// Blocks while the system's resolver runs.
/// @par Errors  invalid_option: neither an address nor a name that resolves
Result<std::vector<std::string>> listen_addresses(const std::string& address);

}  // namespace lrt

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>

#include "src/exchange/wire.hpp"

namespace lrt::exchange {

/// The addresses of a name, in the order in which they should be tried. Blocks while the system's resolver runs; cannot be interrupted.
/// @par Errors  io_error, with the resolver's message
LRT_INTERNAL_API Result<std::vector<Address>> resolve(const std::string& name);

using Resolve = std::function<Result<std::vector<Address>>(const std::string& name)>;

/// The address that the host of a URL denotes; nullopt: it is a name, which must be resolved.
LRT_INTERNAL_API std::optional<Address> literal_address(std::string_view host);

/// An address in the form of resolve(). @pre `text` is numeric, IPv6 without brackets
Address address_of(const std::string& text);

}  // namespace lrt::exchange

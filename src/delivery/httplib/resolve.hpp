#pragma once

#include <functional>
#include <string>
#include <vector>

#include <lrt/base/result.hpp>

#include "src/delivery/httplib/wire.hpp"

namespace lrt::delivery {

/// The addresses of a host, in the order in which they should be tried. Blocks as long as the system's resolver; cannot be interrupted.
/// @param host  as in a URL
/// @par Errors  io_error, with the resolver's message
Result<std::vector<Address>> resolve(const std::string& host, std::uint16_t port);

using Resolve = std::function<Result<std::vector<Address>>(const std::string& host, std::uint16_t port)>;

/// An address in the form of resolve(). @pre `text` is numeric, IPv6 without brackets
Address address_of(const std::string& text, std::uint16_t port);

}  // namespace lrt::delivery

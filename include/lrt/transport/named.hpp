// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/transport/transport.hpp>

namespace lrt::transport {
inline namespace v0 {

/// The network transports of this build, the default first: "http", "libwebsockets" (LRT_LIBWEBSOCKETS).
/// @par Threads  Any.
LRT_API std::vector<std::string_view> names();

/// Makes the transport of that name; an empty name means the default. nullptr: this build does not have it.
/// @par Threads  Any: it only makes the object, which is used as Transport says.
LRT_API std::unique_ptr<Transport> make_named(std::string_view name, TransportOptions options);

}  // namespace v0
}  // namespace lrt::transport

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include <lrt/transport/transport.hpp>

namespace lrt::transport {

/// The network transports of this build, the default first: "http", "libwebsockets" (LRT_LIBWEBSOCKETS).
std::vector<std::string_view> names();

/// Makes the transport of that name; an empty name means the default. nullptr: this build has none of that name.
std::unique_ptr<Transport> make_named(std::string_view name, TransportOptions options);

}  // namespace lrt::transport

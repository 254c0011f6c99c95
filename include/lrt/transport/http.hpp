// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <lrt/base/abi.hpp>
#include <lrt/transport/transport.hpp>

namespace lrt::transport {
inline namespace v0 {

/// The HTTP server of lrt: HTTP/1.1, WebSocket and TLS on one port, with one event loop on an epoll set. It starts no
/// threads.
/// @par Threads  Any: it only makes the object, which is used as Transport says.
/// @par Time     Opens no port before Transport::start().
LRT_API std::unique_ptr<Transport> make_http(TransportOptions options);

}  // namespace v0
}  // namespace lrt::transport

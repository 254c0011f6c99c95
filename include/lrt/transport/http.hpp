// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <lrt/transport/transport.hpp>

namespace lrt::transport {

/// The HTTP server of lrt: HTTP/1.1, WebSocket and TLS on one port. One event loop on an epoll set, no threads of its own.
std::unique_ptr<Transport> make_http(TransportOptions options);

}  // namespace lrt::transport

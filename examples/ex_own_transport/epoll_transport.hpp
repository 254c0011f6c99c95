// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <lrt/transport/transport.hpp>

/// A custom transport: HTTP/1.1 on an epoll loop. It uses lrt's public headers only. No WebSocket, no TLS.
std::unique_ptr<lrt::transport::Transport> make_epoll_transport(lrt::transport::TransportOptions options);

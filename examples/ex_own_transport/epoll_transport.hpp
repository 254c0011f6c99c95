#pragma once

#include <memory>

#include <lrt/transport/transport.hpp>

/// A transport of one's own: HTTP/1.1 on a bare epoll loop, by lrt's public headers and nothing else. No WebSocket, no TLS.
std::unique_ptr<lrt::transport::Transport> make_epoll_transport(lrt::transport::TransportOptions options);

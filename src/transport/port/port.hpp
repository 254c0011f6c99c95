#pragma once

#include <memory>

#include <lrt/transport/transport.hpp>

#include "src/transport/port/protocols.hpp"

namespace lrt::transport {

/// A transport on one listening socket and one epoll set, whose HTTP heads and WebSocket frames are a third party's business.
std::unique_ptr<Transport> make_port(Options options, std::unique_ptr<Protocols> protocols);

}  // namespace lrt::transport

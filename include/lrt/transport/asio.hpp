#pragma once

#include <memory>

#include <lrt/transport/transport.hpp>

namespace lrt::transport {

/// HTTP/1.1 on one port by Boost.Beast and Boost.Asio, one event loop, no threads of its own.
std::unique_ptr<Transport> make_asio(Options options);

}  // namespace lrt::transport

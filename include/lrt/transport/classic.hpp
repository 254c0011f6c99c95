#pragma once

#include <memory>

#include <lrt/transport/transport.hpp>

namespace lrt::transport {

/// HTTP/1.1 by cpp-httplib and WebSocket by libwebsockets on one port, for those who do without Boost. The same limits, times and answers as
/// make_asio(), no threads of its own. Three descriptors for each WebSocket instead of one. libwebsockets' log, which is the whole
/// process's, is switched off.
std::unique_ptr<Transport> make_classic(Options options);

}  // namespace lrt::transport

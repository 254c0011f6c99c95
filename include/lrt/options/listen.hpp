// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include <lrt/transport/options.hpp>

namespace lrt::transport {
inline namespace v0 {
class Transport;
}  // namespace v0
}  // namespace lrt::transport

namespace lrt {
inline namespace v0 {

/// Where the server listens, and the name by which clients know it.
/// @par Threads  Set-up only, as Options.
struct Listen {
  /// An address, or a host name ("localhost", "robot.local"), which is resolved when the server is created. Its IPv4
  /// addresses come first, and the first address that this machine has is used. Requests may name that host, and
  /// Server::url() contains it.
  std::string address = "127.0.0.1";
  std::uint16_t port = 8080;  ///< 0: any free one, see Server::port()
  /// Absolute IRI that representations use as base, "https://robot.example/cell7". Empty: the base is from each
  /// request's Host (SPEC 3.7). A reverse proxy may keep its path in the target of a request or remove it. It must
  /// remove it if a Thing's path begins with it ("cell7/arm").
  std::string public_base;
  /// Makes the transport. Empty: the first of transport::names() is used.
  std::function<std::unique_ptr<transport::Transport>(transport::TransportOptions)> transport;
};

}  // namespace v0
}  // namespace lrt

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <lrt/base/abi.hpp>
#include <lrt/base/clock.hpp>
#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/waker.hpp>
#include <lrt/engine/handler.hpp>
#include <lrt/transport/options.hpp>

namespace lrt::transport {
inline namespace v0 {

/// What a transport supports.
struct Capabilities {
  bool network = true;           ///< has a port
  bool websocket = false;        ///< can accept upgrades
  bool tls = false;              ///< can serve TransportOptions::tls
  bool on_host_loop = false;     ///< calls TransportOptions::turn: neither the host nor another thread may poll
  bool callback_upgrade = true;  ///< passes a GET with `Upgrade: callback` to the handler
};

/// Carries requests to a Handler and its responses back. A host with its own HTTP server can implement this class;
/// examples/ex_own_transport shows how. The handler calls none of these functions.
///
/// @par Threads  One thread at a time; waker() and the object that it returns: any.
class LRT_API Transport {
 public:
  virtual ~Transport() = default;

  /// Begins to listen. The handler must outlive the transport or its stop(); after that the transport may be started
  /// again.
  /// @par Errors  address_in_use, invalid_option (also for TransportOptions::tls without support for TLS), io_error
  virtual Result<void> start(engine::Handler& handler) = 0;
  /// Waits up to `wait` for work, then works for about `budget`: a step that has begun is completed, and each of input,
  /// replies and expired times gets a step. The next call continues without waiting. Throws nothing but std::bad_alloc.
  /// @return  how long no work will be due if nothing arrives: 0 if work is left, milliseconds::max() for ever
  virtual std::chrono::milliseconds poll(std::chrono::microseconds budget, std::chrono::milliseconds wait) = 0;
  /// A descriptor that is readable whenever poll() has work, including expired times and work that a budget left over,
  /// for the host's own poll(), epoll or select. The transport owns it, from start() to stop(). Do not read from it.
  /// -1: there is none, and poll() returns how long to sleep.
  virtual int descriptor() noexcept { return -1; }
  /// Wakes poll(), from any thread.
  virtual std::shared_ptr<Waker> waker() const noexcept = 0;
  /// Stops accepting, sends the responses that the handler still gives within limits.stop_timeout, abandons the other
  /// tickets, and closes all connections.
  virtual void stop() = 0;
  /// What this transport supports.
  virtual Capabilities capabilities() const noexcept = 0;
  /// Reads the files of TransportOptions::tls again. Open connections keep the old ones; on error nothing changes.
  /// @par Errors   invalid_option: no TLS; io_error: a file, with the reason
  /// @par Threads  Any.
  virtual Result<void> reload_tls() { return unexpected(Errc::invalid_option, "this transport has no TLS"); }
  /// Number of open connections, including WebSockets; nullopt: it does not count them.
  /// @par Threads  Any.
  virtual std::optional<std::size_t> connections() const noexcept { return std::nullopt; }
  /// The port on which it listens; 0 before start() and for a transport without one.
  virtual std::uint16_t port() const noexcept = 0;
};

}  // namespace v0
}  // namespace lrt::transport

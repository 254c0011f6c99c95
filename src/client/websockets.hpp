// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/client/options.hpp>

#include "src/base/resolve.hpp"
#include "src/http/url.hpp"

namespace lrt::client {
inline namespace v0 {

/// Why a WebSocket has ended.
struct WebSocketEnd {
  int status = 0;                                     ///< of a response that is not 101; 0: there was none
  std::optional<std::chrono::seconds> retry_after{};  ///< of that response
  std::uint16_t code = 0;  ///< of the server's close frame (RFC 6455 7.4); 1005: it has none; 0: no close frame was received
  std::string reason{};    ///< of the close frame
  Error error{Errc::closed, {}};
};

/// Events of a WebSocket. Called on the thread of WebSockets, without a lock, in this order: opened() at most once, received(), and ended()
/// once. None of them may block.
class WebSocketEvents {
 public:
  virtual ~WebSocketEvents() = default;
  /// @param location  value of Location in the opening response; empty: it has none
  /// @param protocol  the subprotocol of that response; empty: none
  virtual void opened(std::string location, std::string protocol) = 0;
  /// A complete message; text is UTF-8.
  virtual void received(std::string message) = 0;
  virtual void ended(const WebSocketEnd& end) = 0;
};

struct WebSocketRequest {
  http::Url url;                                              ///< secure: TLS
  std::vector<Address> addresses;                             ///< of the host, tried in this order
  std::vector<std::pair<std::string, std::string>> fields{};  ///< Accept, Authorization, ...
  std::chrono::milliseconds idle_time{60'000};                ///< a ping is sent after half of it without a byte; all of it: the connection has ended
  bool shows_certificate = true;                              ///< TLS: the client's certificate, if it has one
  std::string protocol{};                                     ///< an offered subprotocol (RFC 6455 1.9); empty: none
};

/// WebSocket connections of a client (RFC 6455): one thread, which starts with the first connection, with one epoll set.
///
/// Not supported: redirects (a 3xx is reported by its status), extensions, proxies.
/// @par Threads  Any.
class WebSockets {
 public:
  /// @par Time  The constructor starts no thread.
  explicit WebSockets(const Options& options);
  /// Calls stop(). Must not run on the own thread.
  ~WebSockets();
  WebSockets(const WebSockets&) = delete;
  WebSockets& operator=(const WebSockets&) = delete;

  /// Begins to connect. The events report everything, errors of the request included.
  /// @return  0: the thread cannot be started, and there will be no event
  std::uint64_t open(WebSocketRequest request, std::shared_ptr<WebSocketEvents> events);
  /// Begins to close with 1000, for at most 2 s. ended() follows.
  void close(std::uint64_t connection);
  /// Closes all connections with 1001, waits for the thread, at most 0.5 s, and drops what is still open. On the own thread it does not wait.
  void stop() noexcept;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace v0
}  // namespace lrt::client

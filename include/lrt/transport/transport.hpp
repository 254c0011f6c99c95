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

namespace lrt::transport {
inline namespace v0 {

/// Bounds of what a client can use: memory, connections and time. The same on every transport that has them.
struct Limits {
  std::size_t max_header_bytes = 16 * 1024;  ///< of a header section: request line and fields; more: 431
  std::size_t max_line_bytes = 8000;         ///< of a line of it, as RFC 9112 3 recommends at least; more: 431, of the request line: 414
  std::size_t max_body_bytes = 1024 * 1024;  ///< without the chunked coding; more: 413. Most resources take less:
                                             ///< engine::Limits::max_scalar_body_bytes
  /// Of the bodies of all requests together while they are received; more: 503 with Retry-After. A body that arrives with its header section
  /// does not count, nor do the first 4 KiB of any other, so that small commands are served while large bodies use up the limit.
  std::size_t max_total_body_bytes = 64 * 1024 * 1024;
  /// The share of it that one IPv4 address, or one /64 network of IPv6 addresses, can use; more: 503 with Retry-After for that client, and other clients are
  /// served. nullopt: half of max_total_body_bytes. Clients on this machine are not limited: a proxy has one address for all its clients.
  std::optional<std::size_t> max_total_body_bytes_per_address;
  /// A new connection beyond this number closes the one that has been idle for longest (between requests, or before the first byte of the
  /// first, without pending input). If none is idle, the new one is one of reserved_connections: it gets 503 with Retry-After and is closed: 64 of these at a time linger for
  /// linger_timeout, the others are closed at once, so that a client whose request arrives later may see a reset. Event streams and
  /// WebSockets count and are never idle: subscription::SubscriptionOptions::max_subscriptions leaves some connections to requests.
  std::size_t max_connections = 2048;
  /// Of one IPv4 address, or of one /64 network of IPv6 addresses (one host can have all of them); more get 503. Clients on this machine are not counted: a proxy has one address for all its clients.
  std::size_t max_connections_per_address = 256;
  /// Connections beyond max_connections and max_connections_per_address that may only carry a request to a stop (Action::stop()): one, then the
  /// connection is closed. Other requests get 503 there. When all are taken, a new one replaces the one that has waited longest for its request.
  /// 0: none.
  std::size_t reserved_connections = 16;
  std::size_t max_requests_per_connection = 1'000'000;  ///< the response to the last has Connection: close
  /// From the first byte of a header section to its end; more: 408. For the first of a connection: from accept(2) on; a connection without
  /// a byte is closed without a response.
  std::chrono::milliseconds header_timeout{10'000};
  std::chrono::milliseconds body_timeout{30'000};      ///< from the end of the header section to the end of the body; more: 408
  std::chrono::milliseconds idle_timeout{60'000};      ///< between requests; before the first: header_timeout
  std::chrono::milliseconds write_timeout{30'000};     ///< in which the client must read some bytes of a response or message
  std::chrono::milliseconds linger_timeout{2'000};     ///< RFC 9112 9.6: for the client to close, after an early refusal
  std::size_t max_linger_bytes = 256 * 1024;           ///< discarded during that time
  std::chrono::milliseconds stop_timeout{1'000};       ///< for open responses when the server stops
  std::size_t max_websocket_message_bytes = 4 * 1024;  ///< of one message of a client; more: close 1009
  std::size_t max_websocket_messages = 64;             ///< messages and pings of a client within ping_interval; more: close 1008
  /// A WebSocket is pinged after this time without a byte of the client, an event stream gets a comment after this time without an event.
  std::chrono::milliseconds ping_interval{20'000};
  std::chrono::milliseconds pong_timeout{10'000};  ///< from a ping to the next byte of the client; more: the connection is closed
  std::chrono::milliseconds close_timeout{2'000};  ///< for the client's half of the closing handshake of a WebSocket
};

/// TLS on the port, 1.2 or later (R0.2). Files are PEM.
struct TlsOptions {
  std::string certificate_file;             ///< the server's certificate, followed by those between it and its authority
  std::string key_file;                     ///< its private key, without a passphrase
  std::string client_ca_file;               ///< authorities of clients' certificates; empty: lrt requests none
  bool require_client_certificate = false;  ///< with client_ca_file: the handshake of a client without one fails
};

struct TransportOptions {
  std::string address = "127.0.0.1";  ///< numeric address to listen on
  std::uint16_t port = 8080;          ///< 0: any free one
  Limits limits;
  std::optional<TlsOptions> tls;  ///< nullopt: plain HTTP
  const Clock* clock = nullptr;   ///< nullptr: system_clock()
  LogCallback log;                ///< may be empty
  /// Called on the host's event loop when a transport with Capabilities::on_host_loop has pending work. It polls the transport, and does what
  /// else is due. Set by Server.
  std::function<void()> turn;
};

struct Capabilities {
  bool network = true;           ///< has a port
  bool websocket = false;        ///< can accept upgrades
  bool tls = false;              ///< can serve TransportOptions::tls
  bool on_host_loop = false;     ///< calls TransportOptions::turn: the host does not poll, and no other thread may
  bool callback_upgrade = true;  ///< hands a GET with `Upgrade: callback` over, as any request
};

/// Carries requests to a Handler and its responses back. A host with an HTTP server of its own implements this; examples/ex_own_transport
/// shows how. The handler calls none of these functions.
///
/// @par Threads  One thread at a time; waker() and what it returns: any.
class LRT_API Transport {
 public:
  virtual ~Transport() = default;

  /// Begins to listen. The handler must outlive the transport or its stop(); after that the transport may be started again.
  /// @par Errors  address_in_use, invalid_option (also for TransportOptions::tls without support for TLS), io_error
  virtual Result<void> start(engine::Handler& handler) = 0;
  /// Waits up to `wait` for something to do, then works for about `budget`: a step that has begun is completed, and each of input, replies
  /// and expired times gets a step. The next call continues without waiting. Returns how long nothing will be due if nothing arrives: 0 if
  /// work is left over, milliseconds::max() for ever. Throws nothing but std::bad_alloc.
  virtual std::chrono::milliseconds poll(std::chrono::microseconds budget, std::chrono::milliseconds wait) = 0;
  /// Readable whenever poll() has something to do, expired times and work that a budget left over included: a host that sleeps in its own
  /// poll(), epoll or select adds it there. Owned by the transport, from start() to stop(); not to be read. -1: there is none, and poll() returns
  /// how long to sleep.
  virtual int descriptor() noexcept { return -1; }
  /// Wakes poll(), from any thread.
  virtual std::shared_ptr<Waker> waker() const noexcept = 0;
  /// Stops accepting, sends the responses that the handler still gives within limits.stop_timeout, abandons the other tickets, and closes
  /// all connections.
  virtual void stop() = 0;
  virtual Capabilities capabilities() const noexcept = 0;
  /// Reads the files of TransportOptions::tls again. Open connections keep the old ones; on error nothing changes.
  /// @par Errors   invalid_option: no TLS; io_error: a file, with the reason
  /// @par Threads  Any.
  virtual Result<void> reload_tls() { return unexpected(Errc::invalid_option, "this transport has no TLS"); }
  /// Open connections, WebSockets included; nullopt: it does not count them.
  /// @par Threads  Any.
  virtual std::optional<std::size_t> connections() const noexcept { return std::nullopt; }
  /// The port that is listened on; 0 before start() and for a transport without one.
  virtual std::uint16_t port() const noexcept = 0;
};

}  // namespace v0
}  // namespace lrt::transport

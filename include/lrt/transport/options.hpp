// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include <lrt/base/clock.hpp>
#include <lrt/base/log.hpp>

namespace lrt::transport {
inline namespace v0 {

/// Limits of what a client can use: memory, connections and time. They mean the same on every transport that enforces
/// them.
struct Limits {
  std::size_t max_header_bytes = 16 * 1024;  ///< of a header section: request line and fields; more: 431
  std::size_t max_line_bytes = 8000;         ///< of one line of it, at least what RFC 9112 3 recommends; more: 431, of the request line: 414
  std::size_t max_body_bytes = 1024 * 1024;  ///< without the chunked coding; more: 413. Most resources take less:
                                             ///< engine::Limits::max_scalar_body_bytes
  /// Size of the bodies of all requests together while they are received; more: 503 with Retry-After. A body that
  /// arrives with its header section is not counted, nor are the first 4 KiB of any other, so small commands are served
  /// while large bodies use up the limit.
  std::size_t max_total_body_bytes = 64 * 1024 * 1024;
  /// The share of it that one IPv4 address, or one /64 network of IPv6 addresses, can use; more: that client gets 503
  /// with Retry-After, and other clients are served. nullopt: half of max_total_body_bytes. Clients on this machine are
  /// not limited: a proxy has one address for all its clients.
  std::optional<std::size_t> max_total_body_bytes_per_address;
  /// A new connection beyond this number closes the one that has been idle for longest (between requests, or before the
  /// first byte of the first, without pending input). If none is idle, the new one becomes one of reserved_connections:
  /// a request other than a stop gets 503 with Retry-After there, and the connection is closed. 64 of these at a time
  /// linger for linger_timeout; the others are closed at once, so a client whose request arrives later may see a reset.
  /// Event streams and WebSockets count and are never idle: subscription::SubscriptionOptions::max_subscriptions leaves
  /// some connections to requests.
  std::size_t max_connections = 2048;
  /// Connections of one IPv4 address, or of one /64 network of IPv6 addresses (one host can use all of them); a further
  /// one gets 503. Clients on this machine are not counted: a proxy has one address for all its clients.
  std::size_t max_connections_per_address = 256;
  /// Connections beyond max_connections and max_connections_per_address that may only carry a request to a stop
  /// (Action::stop()): one request, then the connection is closed. Other requests get 503 there. If all are in use, a
  /// new one replaces the one that has waited longest for its request. 0: none.
  std::size_t reserved_connections = 16;
  std::size_t max_requests_per_connection = 1'000'000;  ///< the last response has Connection: close
  /// From the first byte of a header section to its end; longer: 408. For the first request of a connection: from
  /// accept(2) on; a connection without a byte is closed without a response.
  std::chrono::milliseconds header_timeout{10'000};
  std::chrono::milliseconds body_timeout{30'000};      ///< from the end of the header section to the end of the body; longer: 408
  std::chrono::milliseconds idle_timeout{60'000};      ///< between requests; before the first: header_timeout
  std::chrono::milliseconds write_timeout{30'000};     ///< within this time the client must read some bytes of a response or message
  std::chrono::milliseconds linger_timeout{2'000};     ///< RFC 9112 9.6: for the client to close, after an early refusal
  std::size_t max_linger_bytes = 256 * 1024;           ///< discarded during that time
  std::chrono::milliseconds stop_timeout{1'000};       ///< for open responses when the server stops
  std::size_t max_websocket_message_bytes = 4 * 1024;  ///< of one message of a client; more: close 1009
  std::size_t max_websocket_messages = 64;             ///< messages and pings of a client within ping_interval; more: close 1008
  /// After this time without a byte from the client a WebSocket is pinged; after this time without an event an event
  /// stream gets a comment.
  std::chrono::milliseconds ping_interval{20'000};
  std::chrono::milliseconds pong_timeout{10'000};  ///< from a ping to the next byte of the client; more: the connection is closed
  std::chrono::milliseconds close_timeout{2'000};  ///< for the client's half of the closing handshake of a WebSocket
};

/// TLS on the port, version 1.2 or later (R0.2). Files are in PEM.
struct TlsOptions {
  std::string certificate_file;             ///< the server's certificate, followed by the intermediate certificates
  std::string key_file;                     ///< its private key, without a passphrase
  std::string client_ca_file;               ///< authorities of clients' certificates; empty: lrt requests none
  bool require_client_certificate = false;  ///< with client_ca_file: the handshake of a client without one fails
};

/// Options of a transport. Server makes them from lrt::Options.
/// @par Threads  Set-up only.
struct TransportOptions {
  std::string address = "127.0.0.1";  ///< numeric address to listen on
  std::uint16_t port = 8080;          ///< 0: any free one
  Limits limits;                      ///< limits of clients
  std::optional<TlsOptions> tls;      ///< nullopt: plain HTTP
  const Clock* clock = nullptr;       ///< nullptr: system_clock()
  LogCallback log;                    ///< may be empty
  /// Called on the host's event loop when a transport with Capabilities::on_host_loop has pending work. It polls the
  /// transport and runs all other due work. Set by Server.
  std::function<void()> turn;
};

}  // namespace v0
}  // namespace lrt::transport

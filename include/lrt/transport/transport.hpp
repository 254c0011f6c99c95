#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <lrt/base/clock.hpp>
#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/waker.hpp>
#include <lrt/engine/handler.hpp>

namespace lrt::transport {

/// What a network client can make grow, and how long it may take. The same on every transport.
struct Limits {
  std::size_t head_bytes = 16 * 1024;                  ///< request line and fields; more: 431
  std::size_t line_bytes = 8000;                       ///< of the head, as RFC 9112 3 recommends at least; at most that on `classic`; more: 431, of the request line: 414
  std::size_t body_bytes = 1024 * 1024;                ///< after de-chunking; more: 413
  /// With more, the one that has been idle longest (between requests or before the first byte of its first, with no input pending)
  /// is closed to make room. When none is idle the new one is answered with 503 and Retry-After and closed: 64 of these at a time
  /// with linger_time, the others at once, so that a client whose request comes later than that may see a reset instead.
  /// WebSockets count, and are never closed to make room: subscription::SubscriptionOptions::max_subscriptions leaves some to requests.
  std::size_t connections = 2048;
  /// From one address; more are answered with 503 and closed. Clients on this machine are not counted: a proxy has one address for all.
  std::size_t connections_per_address = 256;
  std::size_t requests_per_connection = 1'000'000;     ///< the last is answered with Connection: close
  /// From the first byte of a head to its end; more: 408. For the first head of a connection from accept on; closed without an answer
  /// when no byte of it has come.
  std::chrono::milliseconds head_time{10'000};
  std::chrono::milliseconds body_time{30'000};         ///< from the end of the head to the end of the body; more: 408
  std::chrono::milliseconds idle_time{60'000};         ///< between requests; before the first: head_time
  std::chrono::milliseconds write_time{30'000};        ///< during which the client must take some bytes of an answer
  std::chrono::milliseconds linger_time{2'000};        ///< RFC 9112 9.6, after an early refusal
  std::size_t linger_bytes = 256 * 1024;               ///< discarded while lingering
  std::chrono::milliseconds stop_time{1'000};          ///< for answers still on their way when the server stops
  // WebSocket. A client need not say anything; what it says is read within these limits.
  std::size_t websocket_message_bytes = 4 * 1024;      ///< of one message of a client; more: close 1009
  std::size_t websocket_messages = 64;                 ///< and pings of a client within ping_time; more: close 1008
  std::chrono::milliseconds ping_time{20'000};         ///< silence of a client after which it is pinged
  std::chrono::milliseconds pong_time{10'000};         ///< more silence after that: it is taken for dead and dropped
  std::chrono::milliseconds close_time{2'000};         ///< for the client's half of the closing handshake
};

/// TLS on the port, 1.2 or later (R0.2). Files are PEM.
struct Tls {
  std::string certificate_file;              ///< the server's certificate, followed by those between it and its authority
  std::string key_file;                      ///< its private key, without a passphrase
  std::string client_ca_file;                ///< authorities of clients' certificates; empty: clients are not asked for one
  bool require_client_certificate = false;   ///< with client_ca_file: who has none does not get in
};

struct Options {
  std::string address = "127.0.0.1";  ///< numeric address to listen on
  std::uint16_t port = 8080;          ///< 0: any free one
  Limits limits;
  std::optional<Tls> tls;             ///< nullopt: plain HTTP
  const Clock* clock = nullptr;       ///< nullptr: system_clock()
  LogCallback log;                    ///< may be empty
  /// What a transport that lives on a loop of the host's (Capabilities::on_host_loop) calls there when it has something to do. It polls the
  /// transport, and does what else is due; set by Server.
  std::function<void()> turn;
};

struct Capabilities {
  bool network = true;      ///< has a port
  bool websocket = false;   ///< can accept upgrades
  bool tls = false;         ///< can serve Options::tls
  bool on_host_loop = false;  ///< calls Options::turn by itself: the host need not poll, and nobody else may
};

/// Carries requests to a Handler and answers back. A host with an HTTP server of its own implements this: examples/ex_own_transport is one
/// to start from. None of these functions is called from within the handler.
///
/// @par Threads  One thread at a time; waker() and what it returns: any.
class Transport {
 public:
  virtual ~Transport() = default;

  /// Begins to listen. The handler must outlive the transport or its stop(); after that it may be started again.
  /// @par Errors  address_in_use, invalid_option (also for Options::tls, if it has none), io_error
  virtual Result<void> start(engine::Handler& handler) = 0;
  /// Waits up to `wait` for something to do, then works for about `budget`: what is under way when that is over is completed, and each of
  /// input, answers and expired times gets a step. What is left over is for the next call, which then does not wait. Returns how long
  /// nothing will be due if nothing arrives: 0 when something is left over, milliseconds::max() for ever. Throws std::bad_alloc at most.
  virtual std::chrono::milliseconds poll(std::chrono::microseconds budget, std::chrono::milliseconds wait) = 0;
  /// Readable whenever poll() has something to do, expired times and what a budget left over included: a host that sleeps in its own poll(),
  /// epoll or select adds it there. The transport's, from start() to stop(); not to be read. -1: there is none, and poll() says how long.
  virtual int descriptor() noexcept { return -1; }
  /// Wakes poll(), from any thread.
  virtual std::shared_ptr<Waker> waker() const noexcept = 0;
  /// Stops accepting; answers what the handler still gives for open tickets, for at most limits.stop_time; abandons the others and closes
  /// everything.
  virtual void stop() = 0;
  virtual Capabilities capabilities() const noexcept = 0;
  /// Reads the files of Options::tls again. Connections that are open go on as they are; when something is wrong with the files nothing
  /// changes.
  /// @par Errors   invalid_option: no TLS; io_error: a file, with the reason
  /// @par Threads  Any.
  virtual Result<void> reload_tls() { return unexpected(Errc::invalid_option, "this transport has no TLS"); }
  /// The port that is listened on; 0 before start() and for a transport without one.
  virtual std::uint16_t port() const noexcept = 0;
};

}  // namespace lrt::transport

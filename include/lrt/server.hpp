#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/delivery/deliverer.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/thing.hpp>
#include <lrt/transport/transport.hpp>

namespace lrt {

/// Where bytes are read and written (SPEC 3.10).
enum class Io : std::uint8_t {
  own_thread,  ///< one thread of lrt: pushed and static resources are answered without the host
  in_poll,     ///< no thread of lrt: everything happens in Server::poll
};

/// How a Server is set up. Every field has a default that suits a robot on a developer's desk.
struct Options {
  std::string address = "127.0.0.1";         ///< numeric address to listen on
  std::uint16_t port = 8080;                 ///< 0: any free one, see Server::port
  Io io = Io::own_thread;
  engine::Options engine;                    ///< base, hosts, time-outs and limits of requests, subscriptions, authorizer, Dispatch, clock, ids, log
  transport::Limits limits;                  ///< of connections and messages
  /// Runs the lambdas of things with Dispatch::executor. Must run each once, some time.
  std::function<void(std::function<void()>)> executor;
  /// Makes the transport; empty: the first of transport::names().
  std::function<std::unique_ptr<transport::Transport>(transport::TransportOptions)> transport;
  /// Listening on an address that is not of this machine, without TLS and without an authorizer, is refused unless this says so:
  /// whoever reaches the port moves the robot (R0.2).
  bool allow_unprotected_network = false;
  /// Certificate and key: the port speaks HTTPS, and nothing else (R0.2).
  std::optional<transport::TlsOptions> tls;
  /// Where web callbacks are kept, so that they survive a restart; empty: they do not. Written soon after they change, atomically. A file that
  /// cannot be understood is set aside, and the log says so. It has the callbacks' secrets: only its owner may read it.
  std::string subscriptions_file;
  /// Makes what posts to web callbacks; empty: delivery::make_deliverer. Not called if engine.subscriptions.callbacks allows no receiver.
  std::function<Result<std::unique_ptr<delivery::Deliverer>>(delivery::Source&, const subscription::CallbackOptions&, LogCallback)> deliverer;
};

/// Serves Things. Owns them, the transport and, with Io::own_thread, one thread.
///
/// @par Threads  add, remove, stop, wake: any thread. poll, run: one thread at a time, the host's.
class Server {
 public:
  /// Begins to listen.
  /// @par Errors  address_in_use, insecure_address, invalid_option, io_error
  static Result<Server> create(Options options = {});
  Server(Server&&) noexcept;
  Server& operator=(Server&&) noexcept;
  /// Stops.
  ~Server();

  /// Registers a thing; from now on it is served.
  /// @par Errors      the thing's first error, duplicate_path, expected_rdf, closed; then nothing is registered
  /// @par Implements  R0.3
  Result<void> add(Thing thing);
  /// The same of several: all of them at once, or none.
  Result<void> add(std::vector<Thing> things);
  /// Removes a thing and all below it. Handles to its properties go inert.
  /// @par Errors  unknown_path
  Result<void> remove(std::string_view path);

  /// Runs lambdas that have come due, and with Io::in_poll serves the network. Never waits. At most one lambda is begun after `budget`
  /// is used up, and with Io::in_poll what is under way by then is completed: 1 ms at most for anything but a large body (README, Threads),
  /// which limits.max_body_bytes bounds. When idle: no allocation, and no system call with Io::own_thread, one with Io::in_poll.
  /// @return  how long the caller may sleep; zero when there is more to do
  std::chrono::milliseconds poll(std::chrono::microseconds budget = std::chrono::microseconds(200)) noexcept;
  /// Readable whenever poll() has something to do, what is due by now and what a budget left over included: a host that sleeps in its own
  /// poll(), epoll or select adds it there. The server's; not to be read from. From the first call on, until stop(). -1: the transport
  /// has none, and only what poll() returns says how long to sleep.
  int descriptor() noexcept;
  /// Polls and waits until stop().
  void run() noexcept;
  /// run() on a thread of its own.
  void start();
  /// Makes run() look around. noexcept, no lock, no allocation, at most one system call.
  void wake() noexcept;
  /// Answers what waits with 503, closes connections, ends the threads; run() returns. A lambda that runs is let finish.
  /// @par Threads  Any, also from a lambda.
  void stop() noexcept;

  /// Reads the certificate and key of Options::tls again; connections that are open go on.
  /// @par Errors   invalid_option: there is no TLS; io_error: then the old ones stay in use
  /// @par Threads  Any.
  Result<void> reload_tls();

  std::uint16_t port() const noexcept;
  /// "http://127.0.0.1:8080/", or with https
  std::string url() const;

 private:
  class Impl;
  explicit Server(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace lrt

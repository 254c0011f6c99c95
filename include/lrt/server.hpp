// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/engine/handler.hpp>
#include <lrt/http/message.hpp>
#include <lrt/options.hpp>
#include <lrt/thing.hpp>

namespace lrt {
inline namespace v0 {

class EventSource;
class Feed;
class FeedHost;
struct Served;
struct ServerCounters;

/// Serves Things. Owns them, the transport and, with Io::own_thread, a thread.
///
/// It may have static storage, and exit() may be called at any time: what lrt's threads use is never destroyed. What the lambdas use must live as long as
/// they may be called: until stop(), or until the process has ended.
///
/// A server belongs to the process that has created it. In a child of fork() its functions return at once and have no effect: add, remove and reload_tls
/// return closed, serve and judge_header respond with 503. The destructor does nothing there; the descriptors are closed by exec and at the end.
///
/// @par Threads  add, remove, stop, wake: any thread. poll, run: one thread at a time, the host's.
class LRT_API Server {
 public:
  /// Starts to listen.
  /// @par Errors  address_in_use, insecure_address, invalid_option (also of Threads::own), io_error
  static Result<Server> create(Options options = {});
  Server(Server&&) noexcept;
  Server& operator=(Server&&) noexcept;
  /// Calls stop(). Below a lambda of this server, as exit() in a lambda does with a static server, nothing is freed.
  ~Server();

  /// Registers a thing. From now on it is served.
  /// @par Errors      the thing's first error, duplicate_path, expected_rdf, closed; nothing is registered after an error
  /// @par Implements  R0.3
  Result<void> add(Thing thing);
  /// Registers several things: all of them at once, or none.
  Result<void> add(std::vector<Thing> things);
  /// Removes a thing and all things below it. Handles to its properties have no effect afterwards.
  /// @par Errors  unknown_path
  Result<void> remove(std::string_view path);

  /// Runs lambdas that are due. With Io::in_poll it also serves the network. Never waits.
  ///
  /// When `budget` is used up, at most one more lambda is started. With Io::in_poll the current step is completed: at most 1 ms, except for a
  /// large body (README, Threads), which limits.max_body_bytes bounds. When idle it does not allocate, and makes no system call with
  /// Io::own_thread and one with Io::in_poll.
  /// @return  how long the caller may sleep; zero: work is left
  std::chrono::milliseconds poll(std::chrono::microseconds budget = std::chrono::microseconds(200)) noexcept;
  /// A descriptor for the host's own poll(), epoll or select. It is readable whenever poll() has work, including expired times and work left
  /// by a budget. The server owns it, until stop(); do not read from it.
  /// @return  -1: the transport has no descriptor; sleep as long as poll() returns
  int descriptor() noexcept;
  /// Calls poll() and waits, until stop().
  void run() noexcept;
  /// Calls run() on a thread of its own. Throws if the system has no further thread.
  void start();
  /// Interrupts a blocking run().
  /// @par Threads  Any.
  /// @par Time     No lock, no allocation, at most one system call.
  void wake() noexcept;
  /// Responds to waiting requests with 503, closes connections and ends the threads; run() returns. Waits for a running lambda.
  /// @par Threads  Any, also from a lambda.
  void stop() noexcept;

  /// Serves a request that came over an HTTP server of the host's, and waits for its response. The parsed header section must have passed
  /// http::check_request(). What only its bytes can show is up to the host's server, and so are Date, Content-Length, Connection, and the
  /// missing body of HEAD. lrt::mount() in httplib.hpp uses this.
  /// @param request  `mount` and `local_port` say where the host's server serves; `can_stream` if it can send event streams
  /// @par Threads     Any, many at once; not from a lambda of this server.
  /// @par Time        At most host_timeout, or what `Prefer: wait` says.
  Served serve(const http::Request& request);

  /// Judges a request for serve() before its body is received: who may send it, whether its resource takes such a body, and of which size.
  /// After a verdict without a response, set `request.judged` to its `judged` for serve(), which does not call the authorizer again then.
  /// @param body_bytes  Content-Length, more than 0; nullopt: the body is chunked
  /// @par Threads     As serve().
  engine::HeaderVerdict judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes);

  /// Reads the certificate and key of Security::tls again. Open connections are kept.
  /// @par Errors   invalid_option: the server has no TLS; io_error: the old certificate and key stay in use
  /// @par Threads  Any.
  Result<void> reload_tls();

  /// What the server has done, and what it has now (server_thing.hpp).
  /// @par Threads  Any.
  ServerCounters counters() const;

  std::uint16_t port() const noexcept;
  /// Listen::address as it was given, and the port: "http://127.0.0.1:8080/", "http://robot.local:8080/"; with TLS "https://..."
  std::string url() const;

 private:
  friend class EventSource;
  friend class Feed;
  friend Thing server_thing(const Server& server, std::string_view path);
  std::function<ServerCounters()> counter_source() const;
  FeedHost& feed_host() noexcept;
  class Impl;
  struct End {
    void operator()(Impl* impl) const noexcept;
  };
  explicit Server(std::unique_ptr<Impl, End> impl);
  std::unique_ptr<Impl, End> impl_;
};

/// The events of one event stream that Server::serve() has opened. Destroying it ends the subscription. It must not outlive the server.
///
/// @par Threads  One at a time.
class LRT_API EventSource {
 public:
  struct Event {
    std::shared_ptr<const std::string> bytes;  ///< to be sent as they are; nullptr: there was none in that time
    bool end = false;                          ///< the stream is over: nothing follows
  };
  EventSource(EventSource&& other) noexcept;
  EventSource& operator=(EventSource&& other) noexcept;
  ~EventSource();
  /// Waits for the next event, at most a day.
  Event next(std::chrono::milliseconds max_wait);

 private:
  friend class Server;
  EventSource(Server::Impl& server, engine::Channel channel);
  Server::Impl* server_;
  engine::Channel channel_;
};

/// What Server::serve() gives.
struct Served {
  http::Response response;
  std::optional<EventSource> events;  ///< the response is an event stream: its header section is to be sent, and then these
};

}  // namespace v0
}  // namespace lrt

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
#include <lrt/base/misuse.hpp>
#include <lrt/base/result.hpp>
#include <lrt/options.hpp>
#include <lrt/thing.hpp>

namespace lrt::engine {
inline namespace v0 {
struct HeaderVerdict;
}  // namespace v0
}  // namespace lrt::engine

namespace lrt::http {
inline namespace v0 {
struct Request;
}  // namespace v0
}  // namespace lrt::http

namespace lrt {

class SharedEngine;

inline namespace v0 {

class Feed;
class Feeds;
class Registration;
struct Metric;
struct Served;
struct ServerCounters;

/// Serves Things. It owns them, the transport and, with Io::own_thread, a thread.
///
///     lrt::Server server = lrt::Server::create().value();   // http://127.0.0.1:8080/, for this machine only
///     server.add(std::move(joint)).value();
///     while (robot_ok()) {
///       control_step();
///       server.poll();   // handles what has arrived, never waits
///     }
///
/// A server may have static storage, and exit() may be called at any time: what lrt's threads use is never destroyed.
/// What the lambdas use must exist as long as they may be called: until stop(), or until the process has ended.
///
/// A server belongs to the process that created it. In a child of fork() its functions return at once and have no
/// effect: add, remove and reload_tls return Errc::closed, serve and judge_header respond with 503. The destructor has
/// no effect there; exec or the end of the child closes the descriptors.
///
/// After a Server was moved from, add and remove return Errc::closed, start() throws it, serve and judge_header respond with
/// 503, and the other functions have no effect.
///
/// @par Threads  add, remove, stop, wake: any. poll, run: one thread at a time, the host's. The others say it
///               themselves. User lambdas run without a lock of lrt, where their Dispatch says.
/// @par Implements  R0.1 to R0.17, R1.1 to R1.12
class LRT_API Server {
 public:
  /// Makes a server and starts to listen.
  /// @par Errors  address_in_use, insecure_address, invalid_option (also of Threads::own), io_error
  static Result<Server> create(Options options = {});
  Server(Server&&) noexcept;
  Server& operator=(Server&&) noexcept;
  /// Calls stop(). If it is called from a lambda of this server, as by exit() with a static server, nothing is freed.
  ~Server();

  /// Registers a thing. When it returns, the thing is served.
  /// @par Errors      the thing's first error, duplicate_path, expected_rdf, closed; after an error nothing is
  ///                  registered
  /// @par Implements  R0.3
  Result<void> add(Thing thing);
  /// Registers several things: all of them at once, or none.
  /// @par Errors  as above
  Result<void> add(std::vector<Thing> things);
  /// Registers a thing as add() does, until what it returns goes out of scope. registration.hpp defines the result.
  /// @par Errors  as above
  Result<Registration> add_scoped(Thing thing);
  /// Removes a thing and all things below it. Handles to its properties have no effect afterwards.
  /// @par Errors  unknown_path
  Result<void> remove(std::string_view path);

  /// Runs lambdas that are due. With Io::in_poll it also serves the network. Never waits.
  ///
  /// When `budget` is used up, at most one more lambda is started. With Io::in_poll the current step is completed:
  /// usually less than 1 ms. A large body takes longer if Threads::body_threads is 0; limits.max_body_bytes bounds it.
  /// When idle, poll() does not allocate; it makes no system call with Io::own_thread and one with Io::in_poll.
  ///
  /// A lambda may call poll(), which then runs further lambdas. If another thread is polling, poll() has no effect: it
  /// logs an error, fails a check of the headers (base/misuse.hpp), and returns 1 ms.
  /// @param budget  time after which no further work is started, except as above
  /// @return        how long the caller may sleep; zero: work is left
  std::chrono::milliseconds poll(std::chrono::microseconds budget = std::chrono::microseconds(200)) noexcept { return poll(budget, detail::checks); }
  /// A descriptor for the host's own poll(), epoll or select. It is readable whenever poll() has work, including
  /// expired times and work that a budget left over. The server owns it, until stop(). Do not read from it.
  /// @return  -1: the transport has no descriptor; sleep as long as poll() returns
  int descriptor() noexcept;
  /// Calls poll() and waits, until stop().
  void run() noexcept { run(detail::checks); }
  /// Calls run() on a thread of lrt. A second call has no effect.
  /// @throws BadResult  the system refuses a further thread, or its options (Threads::own); closed: the server has stopped
  void start();
  /// Interrupts a blocking run().
  /// @par Threads  Any.
  /// @par Time     No lock, no allocation, at most one system call.
  void wake() noexcept;
  /// Responds to waiting requests with 503, closes connections and ends the threads; run() returns. Waits for lambdas
  /// that run on threads of lrt. It does not wait for a lambda that poll() of another thread or Threads::executor runs:
  /// what such a lambda uses must live until it returns. Called from a lambda on a thread of lrt, it returns at once.
  /// @par Threads  Any, also from a lambda.
  void stop() noexcept;

  /// Serves a request that the host's own HTTP server received, and waits for the response. http::check_request() must
  /// have accepted the request. The host's server checks what only the raw bytes show, and adds Date, Content-Length
  /// and Connection. It does not send the body of a response to HEAD. lrt::mount() in httplib.hpp uses this function. served.hpp defines
  /// the result.
  /// @param request  `mount` and `local_port` state where the host's server serves; `can_stream`: it can send event
  ///                 streams
  /// @par Threads  Any, many at once; not from a lambda of this server.
  /// @par Time     At most Limits::host_timeout, or the time of `Prefer: wait`.
  Served serve(const http::Request& request);

  /// Checks a request for serve() before its body is received: whether the client may send it, and whether its resource
  /// takes a body of this size. If the verdict has no response, store its `judged` in `request.judged` for serve(),
  /// which then does not call the authorizer again.
  /// @param request     its header section; `body` is empty
  /// @param body_bytes  Content-Length, more than 0; nullopt: the body is chunked
  /// @par Threads  As serve().
  engine::HeaderVerdict judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes);

  /// Reads certificate and key of Security::tls again. Open connections keep the old ones.
  /// @par Errors   invalid_option: the server has no TLS; io_error: the old certificate and key stay in use
  /// @par Threads  Any.
  Result<void> reload_tls();

  /// Ends what a principal has open: its WebSockets, event streams, web callbacks, feeds and standing queries, with a
  /// last message or a close code (1008), and the sessions and tickets for its tokens. It does not refuse the principal:
  /// Security::authenticate must do that before, or the token file. Requests and invocations that have begun go on, so
  /// that no movement ends halfway, but make no subscription: 401. Control ends with its time (Thing::control()),
  /// because commands need the principal.
  /// @param principal  its name; unknown names have no effect
  /// @par Threads  Any, also from a lambda and from Security::authenticate.
  void sign_out(std::string_view principal);

  /// Options::identity. Without one its `iri` is Listen::public_base; empty: the server has neither.
  /// @par Threads  Any.
  Identity identity() const;

  /// Counters since the server was created, and present numbers (server_thing.hpp).
  /// @par Threads  Any.
  ServerCounters counters() const;
  /// Shows the numbers of another part of the program, as of a lrt::mirror::Mirror, in the text for Prometheus
  /// (server_thing.hpp). A lrt::mqtt::Bridge does it by itself. What a text cannot contain is left out and counted.
  ///
  ///     const auto shown = server.add_metrics([&mirror] { return mirror.metrics(); });
  ///
  /// @param source  called for each request of the text, on the thread that serves the network; one call at a time. It must
  ///                not wait. base/metric.hpp defines what it returns
  /// @return        the source is called as long as this exists. It may outlive the server. nullptr: the server was moved from
  /// @par Threads  Any, also from a lambda. Do not end what it returns from the source.
  /// @par Time     The end of what it returns waits for a call of the source.
  [[nodiscard]] std::shared_ptr<void> add_metrics(std::function<std::vector<Metric>()> source);

  std::uint16_t port() const noexcept;  ///< the port that it listens on
  /// URL with Listen::address as it was given, and the port: "http://127.0.0.1:8080/", "http://robot.local:8080/"; with
  /// TLS "https://..."
  std::string url() const;

 private:
  friend class Feed;
  friend Thing server_thing(const Server& server, std::string_view path);
  std::function<ServerCounters()> counter_source() const;
  std::function<std::vector<Metric>()> metric_source() const;
  Feeds* feeds() noexcept;
  SharedEngine& shared_engine() noexcept;
  std::chrono::milliseconds poll(std::chrono::microseconds budget, bool checks) noexcept;
  void run(bool checks) noexcept;
  class Impl;
  struct End {
    void operator()(Impl* impl) const noexcept;
  };
  explicit Server(std::unique_ptr<Impl, End> impl);
  std::unique_ptr<Impl, End> impl_;
};

}  // namespace v0
}  // namespace lrt

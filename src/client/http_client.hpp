// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/client/http.hpp>
#include <lrt/client/options.hpp>
#include <lrt/http/message.hpp>

#include "src/base/resolve.hpp"
#include "src/exchange/exchange.hpp"
#include "src/http/url.hpp"

namespace lrt::client {
inline namespace v0 {

class RobotTimes;

/// While it exists, all requests of this thread are parts of one command, and end within its life: what has to be read before it is sent, too.
class LRT_INTERNAL_API CommandTime {
 public:
  /// @param life  0: without a limit
  explicit CommandTime(std::chrono::milliseconds life) noexcept;
  ~CommandTime();
  CommandTime(const CommandTime&) = delete;
  CommandTime& operator=(const CommandTime&) = delete;
  /// The end of the command of this thread; the latest of all times: there is none.
  static std::chrono::steady_clock::time_point end() noexcept;

 private:
  const std::chrono::steady_clock::time_point before_;
};

/// Sends requests, within the limits of the options: connections, TLS, names, identity, redirects.
/// @par Threads  Any. send() blocks the calling thread, which must not be a control loop.
class LRT_INTERNAL_API HttpClient {
 public:
  /// @par Errors  invalid_option: a file of the options cannot be read
  static Result<std::shared_ptr<HttpClient>> create(const Options& options);
  virtual ~HttpClient() = default;

  /// Sends a request and follows redirects (exchange::redirect_of()). A safe request is sent once more on a new connection if an idle one turns out to be
  /// closed; a command never is. It gets Valid-Until (Options::command_life), for which the time of its server is asked first if it is not known. A coding of the response's body is undone, also one that no Accept-Encoding of the request has asked for.
  /// @par Errors  expected_iri: the URL, or that of a redirect; refused: a redirect of a command to another origin; unconfirmed: a command was
  ///              sent, and no response has come; io_error, closed, timed_out,
  ///              limit_exceeded, expected_http, cancelled (stop())
  virtual Result<Response> send(const Request& request) = 0;
  /// A new connection for bytes of the caller's own: what an event stream or a check of a server sends.
  /// @param is_elsewhere  after a redirect to another origin. Else the client's certificate is shown to trusted origins
  virtual Result<std::unique_ptr<exchange::Wire>> connect(const http::Url& url, exchange::WaitLimit limit, bool is_elsewhere) = 0;

  /// The fields that the identity adds to a request to this origin; empty if it is not trusted.
  virtual std::vector<std::pair<std::string, std::string>> identity_fields(const http::Url& url) = 0;
  virtual bool is_trusted(const http::Url& url) const = 0;
  /// Adds an origin that gets the identity.
  virtual void trust(const http::Url& url) = 0;
  /// What is known of the time of servers, from all responses and from heartbeats.
  virtual RobotTimes& robot_times() noexcept = 0;
  /// Commands to this origin have this id of control from now on, until it is removed as often. Of several, the first is sent. Nothing for an empty id.
  virtual void add_control(const std::string& origin, const std::string& id) { (void)origin, (void)id; }
  virtual void remove_control(const std::string& origin, const std::string& id) noexcept { (void)origin, (void)id; }
  /// Ends all exchanges with Errc::cancelled; later ones, too.
  virtual void stop() noexcept = 0;
  /// Readable once stop() has been called, for WaitLimit.
  virtual int stop_descriptor() const noexcept = 0;

  /// From now on redirects to another origin are refused, also those of safe requests. Before the first send().
  void stay_on_origins() noexcept { stays_on_origins_ = true; }

  const Options& options() const noexcept { return options_; }

 protected:
  explicit HttpClient(const Options& options) : options_(options) {}
  const Options options_;
  bool stays_on_origins_ = false;
};

/// The seconds of Retry-After (RFC 9110 10.2.3). nullopt: there are none; a date counts as none.
LRT_INTERNAL_API std::optional<std::chrono::seconds> retry_after(const http::Fields& fields);

}  // namespace v0
}  // namespace lrt::client

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include <lrt/base/abi.hpp>
#include <lrt/transport/transport.hpp>

namespace lrt::transport {
inline namespace v0 {

/// Requests and responses in the same process, without a network: for tests, and for hosts that have an HTTP server of their own and hand its
/// requests over. A request goes through http::check_request(); what only the bytes of its header section show is up to the host's server,
/// and so are Date, Content-Length, Connection, and the missing body of HEAD.
///
/// @par Threads  One thread at a time; what waker() returns: any.
class LRT_API Loopback final : public Transport {
 public:
  /// What the client of a request gets that may become an event stream. Called from submit(), resume(), poll(), stop() and the destructor;
  /// may call submit(), resume() and cancel().
  struct StreamClient {
    /// Once, the response. If `streams`, it is the header section of an event stream, which follows.
    std::function<void(http::Response response, bool streams)> response;
    /// Each message of the stream, shared by all clients that get the same. Returns whether it takes the next one now; after false the next one comes
    /// when resume() is called. Comments that keep the connection alive are up to the host.
    std::function<bool(std::shared_ptr<const std::string> message)> message;
    /// Once after `streams`, when the stream has ended, unless it was cancelled.
    std::function<void()> end;
  };
  /// Names a submitted StreamClient. Never 0, never used twice.
  enum class StreamId : std::uint64_t {};

  explicit Loopback(TransportOptions options = {});
  ~Loopback() override;

  Result<void> start(engine::Handler& handler) override;
  std::chrono::milliseconds poll(std::chrono::microseconds budget, std::chrono::milliseconds wait) override;
  std::shared_ptr<Waker> waker() const noexcept override;
  void stop() override;
  Capabilities capabilities() const noexcept override { return {false, false, false}; }
  std::uint16_t port() const noexcept override { return 0; }

  /// Hands one request over. `done` is called once, now or from a later poll(), stop() or destruction, on the thread that calls
  /// those; it may submit again. Not started or stopped meanwhile: 503.
  void submit(const http::Request& request, std::function<void(http::Response)> done);
  /// The same for a request whose response may be an event stream.
  StreamId submit(const http::Request& request, StreamClient client);
  /// The client takes messages again. Without effect on a stream that has ended.
  void resume(StreamId stream);
  /// The client has gone: nothing of it is called any more.
  void cancel(StreamId stream);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// For Listen::transport of a server without a port of its own, whose requests come from Server::serve().
inline std::unique_ptr<Transport> no_network(TransportOptions options) { return std::make_unique<Loopback>(std::move(options)); }

}  // namespace v0
}  // namespace lrt::transport

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

/// Requests and responses in the same process, without a network: for tests, and for hosts that pass on the requests of
/// their own HTTP server. A request is checked by http::check_request(). The host's server checks what only the raw
/// bytes show, and adds Date, Content-Length and Connection. It does not send the body of a response to HEAD.
///
/// @par Threads  One thread at a time; the object that waker() returns: any.
class LRT_API Loopback final : public Transport {
 public:
  /// The callbacks of a client whose response may be an event stream. Called from submit(), resume(), poll(), stop()
  /// and the destructor; they may call submit(), resume() and cancel().
  struct StreamClient {
    /// Gets the response, once. If `streams`, it is the header section of an event stream.
    std::function<void(http::Response response, bool streams)> response;
    /// Gets each message of the stream; clients with the same message share it. Returns whether it takes the next one
    /// now; after false the next one comes after resume(). The host sends the comments that keep the connection open.
    std::function<bool(std::shared_ptr<const std::string> message)> message;
    /// Called once after `streams`, when the stream has ended, unless it was cancelled.
    std::function<void()> end;
  };
  /// Identifies a submitted StreamClient. Never 0, never used twice.
  enum class StreamId : std::uint64_t {};

  /// @param options  options of the transport; it listens on no port
  explicit Loopback(TransportOptions options = {});
  ~Loopback() override;

  Result<void> start(engine::Handler& handler) override;
  std::chrono::milliseconds poll(std::chrono::microseconds budget, std::chrono::milliseconds wait) override;
  std::shared_ptr<Waker> waker() const noexcept override;
  void stop() override;
  /// No port, no WebSockets, no TLS.
  Capabilities capabilities() const noexcept override { return {false, false, false}; }
  std::uint16_t port() const noexcept override { return 0; }

  /// Submits one request. `done` is called once, now or from a later poll(), stop() or destruction, on the thread that
  /// calls those; it may submit again. Before start() and after stop() the response is 503.
  void submit(const http::Request& request, std::function<void(http::Response)> done);
  /// Submits a request whose response may be an event stream.
  StreamId submit(const http::Request& request, StreamClient client);
  /// Reports that the client takes messages again. Has no effect on a stream that has ended.
  void resume(StreamId stream);
  /// Reports that the client has disconnected: none of its callbacks is called any more.
  void cancel(StreamId stream);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// For Listen::transport of a server without a port of its own, whose requests come from Server::serve().
inline std::unique_ptr<Transport> no_network(TransportOptions options) { return std::make_unique<Loopback>(std::move(options)); }

}  // namespace v0
}  // namespace lrt::transport

#pragma once

#include <functional>
#include <memory>

#include <lrt/transport/transport.hpp>

namespace lrt::transport {

/// Requests and answers in the same process, without a network: for tests, and for hosts that have an HTTP server of their own
/// and hand its requests over. The parsed head goes through the same checks as on a socket; what only the bytes of a head can show
/// (http::check_raw_head) is up to the host's server, and so are Date, Content-Length, Connection, and the missing body of HEAD.
///
/// @par Threads  One thread at a time; what waker() returns: any.
class Loopback final : public Transport {
 public:
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

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lrt::transport

// SPDX-License-Identifier: Apache-2.0
#include <lrt/transport/asio_loop.hpp>

#include <fcntl.h>
#include <unistd.h>

#include <utility>  // before Boost.Asio 1.74, which does not include it in C++20

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/basic_stream_descriptor.hpp>
#include <condition_variable>
#include <mutex>
#include <thread>

#include <lrt/transport/http.hpp>

namespace lrt::transport {
namespace {

/// Watches a descriptor on a host's io_context from start() to stop(): waits until it is readable, takes a turn, waits again. Shared with the
/// completions that Asio has queued, which may run after stop().
///
/// @par Threads  Any.
class DescriptorWatch final : public std::enable_shared_from_this<DescriptorWatch> {
 public:
  DescriptorWatch(boost::asio::io_context& io, std::function<void()> turn, LogCallback log)
      : descriptor_(io), turn_(std::move(turn)), log_(std::move(log)) {}

  Result<void> begin(int descriptor) {
    const std::lock_guard lock(mutex_);
    const int own = ::fcntl(descriptor, F_DUPFD_CLOEXEC, 0);  // Asio closes the one that it has
    boost::system::error_code error;
    if (own < 0 || descriptor_.assign(own, error)) {
      if (own >= 0) ::close(own);
      return unexpected(Errc::io_error, "the io_context did not accept the descriptor");
    }
    wait();
    return {};
  }

  /// No turn begins after this; one may be running. The io_context has no more work of lrt.
  void end() {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    boost::system::error_code ignored;
    descriptor_.close(ignored);
  }

  /// After end(): waits until a turn on another thread has ended.
  void join() {
    std::unique_lock lock(mutex_);
    if (taker_ == std::this_thread::get_id()) return;
    turn_ended_.wait(lock, [this] { return taker_ == std::thread::id(); });
  }

 private:
  void wait() {
    descriptor_.async_wait(decltype(descriptor_)::wait_read, [self = shared_from_this()](const boost::system::error_code& error) {
      if (!error) self->take();
    });
  }

  void take() {
    {
      const std::lock_guard lock(mutex_);
      if (ended_) return;
      taker_ = std::this_thread::get_id();
    }
    try {
      turn_();
    } catch (...) { log_exception(); }
    const std::lock_guard lock(mutex_);
    taker_ = std::thread::id();
    turn_ended_.notify_all();
    if (!ended_) wait();  // level-triggered: pending work of the turn makes the descriptor readable
  }

  void log_exception() noexcept {
    try {
      if (log_) log_(LogLevel::error, "a turn on the host's io_context threw");
    } catch (...) {}
  }

  std::mutex mutex_;  // not held in a turn
  std::condition_variable turn_ended_;
  std::thread::id taker_;  ///< the thread that is in a turn
  bool ended_ = false;
  boost::asio::posix::basic_stream_descriptor<boost::asio::io_context::executor_type> descriptor_;
  std::function<void()> turn_;
  LogCallback log_;
};

/// An HTTP transport that is polled by a host's io_context.
class HostLoopTransport final : public Transport {
 public:
  HostLoopTransport(TransportOptions options, boost::asio::io_context& io)
      : io_(io), turn_(options.turn), log_(options.log), http_(make_http(std::move(options))) {}
  ~HostLoopTransport() override { end_watch(); }

  Result<void> start(engine::Handler& handler) override;
  std::chrono::milliseconds poll(std::chrono::microseconds budget, std::chrono::milliseconds wait) override { return http_->poll(budget, wait); }
  int descriptor() noexcept override { return http_->descriptor(); }
  std::shared_ptr<Waker> waker() const noexcept override { return http_->waker(); }
  /// A turn on another thread may still be running afterwards; it has no effect.
  void stop() override {
    if (watch_) watch_->end();
    http_->stop();
  }
  Capabilities capabilities() const noexcept override {
    auto capabilities = http_->capabilities();
    capabilities.on_host_loop = true;
    return capabilities;
  }
  Result<void> reload_tls() override { return http_->reload_tls(); }
  std::uint16_t port() const noexcept override { return http_->port(); }
  std::optional<std::size_t> connections() const noexcept override { return http_->connections(); }

 private:
  void end_watch() {
    if (!watch_) return;
    watch_->end();
    watch_->join();
    watch_.reset();
  }

  boost::asio::io_context& io_;
  std::function<void()> turn_;
  LogCallback log_;
  std::unique_ptr<Transport> http_;
  std::shared_ptr<DescriptorWatch> watch_;
};

Result<void> HostLoopTransport::start(engine::Handler& handler) {
  if (!turn_) return unexpected(Errc::invalid_option, "the transport runs on the host's event loop: set TransportOptions::turn");
  if (auto started = http_->start(handler); !started) return started;
  end_watch();
  watch_ = std::make_shared<DescriptorWatch>(io_, turn_, log_);
  auto begun = watch_->begin(http_->descriptor());
  if (!begun) stop();
  return begun;
}

}  // namespace

template <int boost_version>
std::unique_ptr<Transport> detail::make_http_on_loop(TransportOptions options, boost::asio::io_context& io) {
  return std::make_unique<HostLoopTransport>(std::move(options), io);
}
template std::unique_ptr<Transport> detail::make_http_on_loop<BOOST_VERSION>(TransportOptions options, boost::asio::io_context& io);

}  // namespace lrt::transport

#include <lrt/transport/asio.hpp>

#include <unistd.h>

#include <utility>  // before Boost.Asio 1.74, which forgets it in C++20

#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/basic_stream_descriptor.hpp>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "src/transport/asio/beast_protocols.hpp"
#include "src/transport/port/port.hpp"

namespace lrt::transport {
namespace {

/// The turns that a host's io_context takes, from start() to stop(): waits for a descriptor, has a turn done, waits again. What was queued
/// before the end finds it here when it runs, however late.
///
/// @par Threads  Any. The descriptor is asio's and has no lock of its own.
class Turns final : public std::enable_shared_from_this<Turns> {
 public:
  Turns(boost::asio::io_context& io, std::function<void()> turn, LogCallback log)
      : descriptor_(io), turn_(std::move(turn)), log_(std::move(log)) {}

  Result<void> begin(int descriptor) {
    const std::lock_guard lock(mutex_);
    const int own = ::dup(descriptor);  // asio closes its own
    boost::system::error_code error;
    if (own < 0 || descriptor_.assign(own, error)) {
      if (own >= 0) ::close(own);
      return unexpected(Errc::io_error, "the io_context takes no descriptor to wait for");
    }
    wait();
    return {};
  }

  /// No turn begins after this; one may be under way. Nothing of ours keeps the io_context running.
  void end() {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    boost::system::error_code ignored;
    descriptor_.close(ignored);
  }

  /// After end(): waits for a turn that another thread is in.
  void join() {
    std::unique_lock lock(mutex_);
    if (taker_ == std::this_thread::get_id()) return;
    left_.wait(lock, [this] { return taker_ == std::thread::id(); });
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
    } catch (...) {
      complain();
    }
    const std::lock_guard lock(mutex_);
    taker_ = std::thread::id();
    left_.notify_all();
    if (!ended_) wait();  // asio looks again: what the turn has left is found
  }

  void complain() noexcept {
    try {
      if (log_) log_(LogLevel::error, "a turn on the host's io_context threw");
    } catch (...) {
    }
  }

  std::mutex mutex_;  // not held in a turn
  std::condition_variable left_;
  std::thread::id taker_;  ///< who is in a turn
  bool ended_ = false;
  boost::asio::posix::basic_stream_descriptor<boost::asio::io_context::executor_type> descriptor_;
  std::function<void()> turn_;
  LogCallback log_;
};

/// A port whose turns are taken by a host's io_context.
class HostLoopTransport final : public Transport {
 public:
  HostLoopTransport(Options options, boost::asio::io_context& io)
      : io_(io), turn_(options.turn), log_(options.log), port_(make_port(std::move(options), std::make_unique<BeastProtocols>())) {}
  ~HostLoopTransport() override { end_turns(); }

  Result<void> start(engine::Handler& handler) override;
  std::chrono::milliseconds poll(std::chrono::microseconds budget, std::chrono::milliseconds wait) override { return port_->poll(budget, wait); }
  int descriptor() noexcept override { return port_->descriptor(); }
  std::shared_ptr<Waker> waker() const noexcept override { return port_->waker(); }
  /// A turn of another thread may still be under way afterwards: it finds nothing to do.
  void stop() override {
    if (turns_) turns_->end();
    port_->stop();
  }
  Capabilities capabilities() const noexcept override {
    auto capabilities = port_->capabilities();
    capabilities.on_host_loop = true;
    return capabilities;
  }
  Result<void> reload_tls() override { return port_->reload_tls(); }
  std::uint16_t port() const noexcept override { return port_->port(); }

 private:
  void end_turns() {
    if (!turns_) return;
    turns_->end();
    turns_->join();
    turns_.reset();
  }

  boost::asio::io_context& io_;
  std::function<void()> turn_;
  LogCallback log_;
  std::unique_ptr<Transport> port_;
  std::shared_ptr<Turns> turns_;
};

Result<void> HostLoopTransport::start(engine::Handler& handler) {
  if (!turn_) return unexpected(Errc::invalid_option, "the transport lives on a loop of the host's: Options::turn says what to do there");
  if (auto started = port_->start(handler); !started) return started;
  end_turns();
  turns_ = std::make_shared<Turns>(io_, turn_, log_);
  auto begun = turns_->begin(port_->descriptor());
  if (!begun) stop();
  return begun;
}

}  // namespace

std::unique_ptr<Transport> make_asio(Options options) { return make_port(std::move(options), std::make_unique<BeastProtocols>()); }

template <int boost_version>
std::unique_ptr<Transport> detail::make_asio_with(Options options, boost::asio::io_context& io) {
  return std::make_unique<HostLoopTransport>(std::move(options), io);
}
template std::unique_ptr<Transport> detail::make_asio_with<BOOST_VERSION>(Options options, boost::asio::io_context& io);

}  // namespace lrt::transport

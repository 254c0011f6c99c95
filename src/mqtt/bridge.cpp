// SPDX-License-Identifier: Apache-2.0
#include "src/mqtt/bridge.hpp"

#include <poll.h>
#include <pthread.h>
#include <sys/epoll.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <system_error>
#include <utility>

#include <lrt/server.hpp>

#include "src/base/descriptor.hpp"
#include "src/base/process.hpp"
#include "src/base/thread.hpp"
#include "src/mqtt/metrics.hpp"

namespace lrt::mqtt {
inline namespace v0 {

namespace {

constexpr std::chrono::milliseconds longest_wait{1'000};

}  // namespace

class LRT_LOCAL Bridge::Impl {
 public:
  explicit Impl(std::unique_ptr<BridgeCore> core)
      : core_(std::move(core)), set_(::epoll_create1(EPOLL_CLOEXEC)), timer_(::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK)) {}
  ~Impl() { stop(); }

  Result<void> prepare() {
    if (set_.get() < 0 || timer_.get() < 0 || !watch(core_->feed().descriptor(), EPOLLIN) || !watch(timer_.get(), EPOLLIN))
      return unexpected(Errc::io_error, "cannot create an event descriptor for a bridge: " + std::system_category().message(errno));
    return {};
  }

  /// The server shows the counters in its metrics as long as this exists.
  void show(Server& server) {
    shown_ = server.add_metrics([core = core_.get()] { return metrics_of(core->counters(), core->broker_url(), core->options().prefix); });
  }

  Result<void> start() {
    const std::lock_guard lock(mutex_);
    if (stopping_) return unexpected(Errc::closed, "the bridge has stopped");
    if (thread_.joinable()) return {};
    Result<Thread> started = start_thread("lrt-mqtt", core_->options().thread, [this] { run(); });
    if (!started) return Unexpected{std::move(started).error()};
    thread_ = *std::move(started);
    return {};
  }

  std::chrono::milliseconds poll(std::chrono::microseconds budget) noexcept {
    if (!process_.is_current() || stopping_) return longest_wait;
    try {
      const std::chrono::milliseconds rest = core_->advance(std::chrono::steady_clock::now(), budget);
      arrange(rest);
      return rest;
    } catch (...) {  // no memory, or a log callback that throws
      return longest_wait;
    }
  }
  int descriptor() noexcept { return set_.get(); }

  void stop() noexcept {
    if (!process_.is_current()) return;
    stopping_ = true;
    core_->feed().waker()->wake();
    Thread thread;
    {
      std::unique_lock lock(mutex_);
      if (runner_ && ::pthread_equal(*runner_, ::pthread_self()) != 0) return;  // from a log callback
      if (std::exchange(is_stopping_, true)) return has_stopped_.wait(lock, [this] { return is_stopped_; });
      thread = std::move(thread_);
    }
    thread.join();
    core_->stop();
    const std::lock_guard lock(mutex_);
    is_stopped_ = true;
    has_stopped_.notify_all();
  }

  Result<void> reload() {
    if (!process_.is_current() || stopping_) return unexpected(Errc::closed, "the bridge has stopped");
    if (Result<void> checked = core_->link().check(); !checked) return checked;
    core_->reconnect();
    return {};
  }

  Counters counters() const noexcept { return core_->counters(); }
  const BridgeCore& core() const noexcept { return *core_; }

 private:
  void run() noexcept {
    {
      const std::lock_guard lock(mutex_);
      runner_ = ::pthread_self();
    }
    while (!stopping_) {
      const std::chrono::milliseconds rest = std::min(poll(std::chrono::milliseconds(5)), longest_wait);
      if (rest.count() == 0 || stopping_) continue;
      epoll_event events[4];
      (void)::epoll_wait(set_.get(), events, 4, static_cast<int>(rest.count()));
    }
    const std::lock_guard lock(mutex_);
    runner_.reset();
  }

  bool watch(int descriptor, std::uint32_t what) noexcept {
    epoll_event event{};
    event.events = what;
    event.data.fd = descriptor;
    return ::epoll_ctl(set_.get(), EPOLL_CTL_ADD, descriptor, &event) == 0 ||
           (errno == EEXIST && ::epoll_ctl(set_.get(), EPOLL_CTL_MOD, descriptor, &event) == 0);
  }

  /// Makes the descriptor readable when there is work. A closed socket leaves the set by itself.
  void arrange(std::chrono::milliseconds rest) noexcept {
    if (const int socket = core_->link().descriptor(); socket >= 0) {
      epoll_event event{};
      event.events = EPOLLIN | (core_->link().wants_write() ? EPOLLOUT : 0U);
      event.data.fd = socket;
      if (::epoll_ctl(set_.get(), EPOLL_CTL_MOD, socket, &event) != 0) (void)::epoll_ctl(set_.get(), EPOLL_CTL_ADD, socket, &event);
    }
    const auto time = std::max<std::chrono::nanoseconds>(rest, std::chrono::nanoseconds(1));
    itimerspec at{};
    at.it_value.tv_sec = static_cast<time_t>(time.count() / 1'000'000'000);
    at.it_value.tv_nsec = static_cast<long>(time.count() % 1'000'000'000);
    (void)::timerfd_settime(timer_.get(), 0, &at, nullptr);
  }

  const OwnProcess process_;
  const std::unique_ptr<BridgeCore> core_;
  const Descriptor set_, timer_;
  std::atomic<bool> stopping_{false};
  std::mutex mutex_;  // guards all below
  std::condition_variable has_stopped_;
  Thread thread_;
  std::optional<pthread_t> runner_;  // the thread, also while stop() waits for it
  bool is_stopping_ = false, is_stopped_ = false;
  std::shared_ptr<void> shown_;  // declared last: it ends first
};

Bridge::Bridge(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Bridge::Bridge(Bridge&&) noexcept = default;
Bridge& Bridge::operator=(Bridge&&) noexcept = default;
Bridge::~Bridge() = default;

Result<Bridge> Bridge::create(Server& server, Options options) {
  Result<std::unique_ptr<BridgeCore>> core = BridgeCore::create(server, std::move(options));
  if (!core) return Unexpected{std::move(core).error()};
  auto impl = std::make_unique<Impl>(*std::move(core));
  if (Result<void> prepared = impl->prepare(); !prepared) return Unexpected{std::move(prepared).error()};
  impl->show(server);
  return Bridge(std::move(impl));
}

Result<void> Bridge::start() { return impl_->start(); }
std::chrono::milliseconds Bridge::poll(std::chrono::microseconds budget) noexcept { return impl_->poll(budget); }
int Bridge::descriptor() noexcept { return impl_->descriptor(); }
Result<void> Bridge::reload() { return impl_->reload(); }
void Bridge::stop() noexcept { impl_->stop(); }
Counters Bridge::counters() const noexcept { return impl_->counters(); }
std::string Bridge::topic(std::string_view path) const { return impl_->core().topics().of(path); }

}  // namespace v0
}  // namespace lrt::mqtt

#include <unistd.h>

#include <utility>  // before Boost.Asio 1.74, which forgets it in C++20

#include <boost/asio/posix/basic_stream_descriptor.hpp>
#include <algorithm>
#include <limits>
#include <optional>

#include <lrt/transport/asio.hpp>

#include "src/transport/asio/connection.hpp"
#include "src/transport/asio/listener.hpp"
#include "src/transport/asio/loop.hpp"
#include "src/transport/event_waker.hpp"

namespace lrt::transport {
namespace {

using std::chrono::milliseconds;
using SteadyClock = std::chrono::steady_clock;

constexpr milliseconds longest_wait = std::chrono::hours(1);
/// How long stop() lets clients notice that their answered connection is over.
constexpr milliseconds stop_linger_time{100};

/// Rounded up, so that a wait does not end just before what it waits for.
milliseconds until(Deadlines::Instant due, Deadlines::Instant now) {
  return due <= now ? milliseconds(0) : std::chrono::ceil<milliseconds>(due - now);
}

class AsioTransport final : public Transport {
 public:
  explicit AsioTransport(Options options)
      : loop_(std::move(options)), waker_(std::make_shared<EventWaker>()), wake_event_(loop_.io), listener_(loop_) {}

  ~AsioTransport() override {
    close_all();
    boost::system::error_code ignored;
    wake_event_.close(ignored);
    loop_.readiness.close();
    loop_.io.restart();
    loop_.io.poll();  // the cancelled waits own the connections
  }

  Result<void> start(engine::Handler& handler) override;
  milliseconds poll(std::chrono::microseconds budget, milliseconds wait) override;
  std::shared_ptr<Waker> waker() const noexcept override { return waker_; }
  void stop() override;
  Capabilities capabilities() const noexcept override { return {true, false, false}; }
  std::uint16_t port() const noexcept override { return listener_.port(); }

 private:
  bool started() const noexcept { return loop_.context.handler != nullptr; }
  void wait_for_wake();
  void deliver_replies(TimePoint now);
  void expire(TimePoint now);
  milliseconds next_due(TimePoint now) const;
  void close_all();

  Loop loop_;
  std::shared_ptr<EventWaker> waker_;
  boost::asio::posix::basic_stream_descriptor<boost::asio::io_context::executor_type> wake_event_;
  Listener listener_;
  bool woken_ = false;
  bool replies_left_ = false;  ///< the budget ended before the handler's replies
};

Result<void> AsioTransport::start(engine::Handler& handler) {
  if (started()) return unexpected(Errc::invalid_option, "the transport was started already");
  if (!wake_event_.is_open()) {
    const int descriptor = ::dup(waker_->descriptor());  // asio closes its own, the waker lives on
    boost::system::error_code error;
    if (descriptor < 0 || wake_event_.assign(descriptor, error)) {
      if (descriptor >= 0) ::close(descriptor);
      return unexpected(Errc::io_error, "no event descriptor to wake the transport with");
    }
    wait_for_wake();
  }
  if (!loop_.readiness.open()) return unexpected(Errc::io_error, "no epoll descriptor");
  if (auto opened = listener_.open(); !opened) return opened;
  loop_.context.handler = &handler;
  loop_.context.stopping = false;
  replies_left_ = false;
  return {};
}

void AsioTransport::wait_for_wake() {
  wake_event_.async_wait(decltype(wake_event_)::wait_read, [this](const boost::system::error_code& error) {
    if (error) return;
    waker_->clear();
    woken_ = true;
    wait_for_wake();
  });
}

milliseconds AsioTransport::poll(std::chrono::microseconds budget, milliseconds wait) {
  if (!started()) return milliseconds::max();
  auto& io = loop_.io;
  if (io.stopped()) io.restart();
  loop_.readiness.forget_buried();

  if (replies_left_) wait = milliseconds(0);
  if (wait > milliseconds(0)) wait = std::min({wait, next_due(loop_.clock.now()), longest_wait});
  // With no time to wait this is one epoll_wait that returns at once.
  loop_.readiness.set_budget(budget);
  bool more = (wait > milliseconds(0) ? io.run_one_for(wait) : io.poll_one()) != 0;
  while (more && !loop_.readiness.is_over()) more = io.poll_one() != 0;
  const auto now = loop_.clock.now();
  deliver_replies(now);
  expire(now);
  return more || replies_left_ ? milliseconds(0) : next_due(now);
}

void AsioTransport::deliver_replies(TimePoint now) {
  auto& handler = *loop_.context.handler;
  if (!woken_ && !replies_left_ && loop_.tickets.empty()) {
    const auto due = handler.next_deadline();
    if (!due || *due > now.steady) return;
  }
  woken_ = replies_left_ = false;
  while (auto reply = handler.next_reply(now)) {
    const auto found = loop_.tickets.find(static_cast<std::uint64_t>(reply->ticket));
    if (found != loop_.tickets.end()) {
      Connection& connection = *found->second;
      loop_.tickets.erase(found);
      connection.reply(std::move(reply->response), now);
    }
    if (loop_.readiness.is_over()) {
      replies_left_ = true;
      return;
    }
  }
}

/// After reading, so that a client is not late only because the host did not poll.
void AsioTransport::expire(TimePoint now) {
  while (auto* const entry = loop_.deadlines.expired(now.steady)) {
    static_cast<Connection*>(entry)->expire(now);
    if (loop_.readiness.is_over()) break;  // those that are left are due at once
  }
  listener_.resume(now);
}

milliseconds AsioTransport::next_due(TimePoint now) const {
  auto due = milliseconds::max();
  const auto consider = [&](const std::optional<Deadlines::Instant>& instant) {
    if (instant) due = std::min(due, until(*instant, now.steady));
  };
  consider(loop_.deadlines.next());
  consider(listener_.resumes_at());
  consider(loop_.context.handler->next_deadline());
  return due;
}

void AsioTransport::stop() {
  if (!started()) return;
  listener_.close();
  loop_.context.stopping = true;
  for (std::size_t i = loop_.connections.size(); i-- > 0;) {
    auto& connection = *loop_.connections[i];
    if (!connection.has_answer_open() && !connection.is_lingering()) connection.close();
  }
  // Bounded by the machine's time, whatever the clock of the options says.
  const auto begin = SteadyClock::now();
  auto end = begin + loop_.options.limits.stop_time;
  while (!loop_.connections.empty()) {
    const bool open = std::any_of(loop_.connections.begin(), loop_.connections.end(),
                                  [](const auto& connection) { return connection->has_answer_open(); });
    const auto now = SteadyClock::now();
    if (!open) end = std::min<SteadyClock::time_point>(end, now + stop_linger_time);
    if (now >= end) break;
    poll(std::chrono::milliseconds(10), until(end, now));
  }
  for (std::size_t i = loop_.connections.size(); i-- > 0;) loop_.connections[i]->give_up(loop_.clock.now());
  close_all();
  loop_.context.handler = nullptr;
}

void AsioTransport::close_all() {
  listener_.close();
  while (!loop_.connections.empty()) loop_.connections.back()->close();
}

}  // namespace

std::unique_ptr<Transport> make_asio(Options options) { return std::make_unique<AsioTransport>(std::move(options)); }

}  // namespace lrt::transport

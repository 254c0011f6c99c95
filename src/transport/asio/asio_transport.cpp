#include <unistd.h>

#include <utility>  // before Boost.Asio 1.74, which forgets it in C++20

#include <boost/asio/posix/basic_stream_descriptor.hpp>
#include <algorithm>
#include <limits>
#include <optional>

#include <lrt/transport/asio.hpp>

#include "src/transport/asio/alarm.hpp"
#include "src/transport/asio/connection.hpp"
#include "src/transport/asio/listener.hpp"
#include "src/transport/asio/loop.hpp"
#include "src/transport/asio/websocket.hpp"
#include "src/transport/event_waker.hpp"

namespace lrt::transport {
namespace {

using std::chrono::milliseconds;
using SteadyClock = std::chrono::steady_clock;

constexpr milliseconds longest_wait = std::chrono::hours(1);
/// Waits for the handler end to the microsecond up to here; beyond, the millisecond that rounding may cost does not matter.
constexpr milliseconds precise_wait{100};
/// How long stop() lets clients notice that their answered connection is over.
constexpr milliseconds stop_linger_time{100};

/// Rounded up, so that a wait does not end just before what it waits for.
milliseconds until(Deadlines::Instant due, Deadlines::Instant now) {
  return due <= now ? milliseconds(0) : std::chrono::ceil<milliseconds>(due - now);
}

class AsioTransport final : public Transport {
 public:
  explicit AsioTransport(Options options)
      : loop_(std::move(options)), waker_(std::make_shared<EventWaker>()), wake_event_(loop_.io), alarm_(loop_.io), listener_(loop_) {}

  ~AsioTransport() override {
    close_all();
    boost::system::error_code ignored;
    wake_event_.close(ignored);
    alarm_.close();
    loop_.readiness.close();
    loop_.io.restart();
    loop_.io.poll();  // the cancelled waits own the clients
  }

  Result<void> start(engine::Handler& handler) override;
  milliseconds poll(std::chrono::microseconds budget, milliseconds wait) override;
  std::shared_ptr<Waker> waker() const noexcept override { return waker_; }
  void stop() override;
  Capabilities capabilities() const noexcept override { return {true, true, true}; }
  Result<void> reload_tls() override;
  std::uint16_t port() const noexcept override { return listener_.port(); }

 private:
  bool started() const noexcept { return loop_.context.handler != nullptr; }
  void wait_for_wake();
  milliseconds prepare_wait(milliseconds wait);
  void deliver(TimePoint now);
  void deliver_replies(TimePoint now);
  void deliver_pushes(TimePoint now);
  void expire(TimePoint now);
  milliseconds next_due(TimePoint now) const;
  void close_all();

  Loop loop_;
  std::shared_ptr<EventWaker> waker_;
  boost::asio::posix::basic_stream_descriptor<boost::asio::io_context::executor_type> wake_event_;
  Alarm alarm_;
  Listener listener_;
  bool woken_ = false;
  bool left_ = false;  ///< the budget ended before what the handler has
};

Result<void> AsioTransport::start(engine::Handler& handler) {
  if (started()) return unexpected(Errc::invalid_option, "the transport was started already");
  if (loop_.options.tls) {
    if (auto loaded = reload_tls(); !loaded) return loaded;
  }
  if (!wake_event_.is_open()) {
    const int descriptor = ::dup(waker_->descriptor());  // asio closes its own, the waker lives on
    boost::system::error_code error;
    if (descriptor < 0 || wake_event_.assign(descriptor, error)) {
      if (descriptor >= 0) ::close(descriptor);
      return unexpected(Errc::io_error, "no event descriptor to wake the transport with");
    }
    wait_for_wake();
  }
  if (!alarm_.open()) return unexpected(Errc::io_error, "no timer descriptor");
  if (!loop_.readiness.open()) return unexpected(Errc::io_error, "no epoll descriptor");
  if (auto opened = listener_.open(); !opened) return opened;
  loop_.context.handler = &handler;
  loop_.context.stopping = false;
  left_ = false;
  return {};
}

Result<void> AsioTransport::reload_tls() {
  if (!loop_.options.tls) return unexpected(Errc::invalid_option, "the port speaks plain HTTP: there is no TLS to reload");
  return loop_.tls.load(*loop_.options.tls);
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

  if (left_) wait = milliseconds(0);
  if (wait > milliseconds(0)) wait = prepare_wait(wait);
  // With no time to wait this is one epoll_wait that returns at once.
  loop_.readiness.set_budget(budget);
  bool more = (wait > milliseconds(0) ? io.run_one_for(wait) : io.poll_one()) != 0;
  while (more && !loop_.readiness.is_over()) more = io.poll_one() != 0;
  if (!more) loop_.has_later = false;
  const auto now = loop_.clock.now();
  deliver(now);
  expire(now);
  return more || left_ || loop_.has_later ? milliseconds(0) : next_due(now);
}

/// How long asio may wait; what is due between two milliseconds ends the wait by the alarm.
milliseconds AsioTransport::prepare_wait(milliseconds wait) {
  const auto now = loop_.clock.now().steady;
  wait = std::min({wait, next_due({now, {}}), longest_wait});
  if (wait <= milliseconds(0) || wait > precise_wait) return wait;
  const auto due = loop_.context.handler->next_deadline();
  if (due && *due > now && *due < now + wait) alarm_.set(*due, now);
  return wait;
}

/// What the handler has. While a client waits for an answer or listens to a channel it is asked each time, for what the requests and
/// messages of others may have brought about; else when it wished so.
void AsioTransport::deliver(TimePoint now) {
  if (!woken_ && !left_ && loop_.tickets.empty() && loop_.channels.empty()) {
    const auto due = loop_.context.handler->next_deadline();
    if (!due || *due > now.steady) return;
  }
  woken_ = left_ = false;
  deliver_replies(now);
  deliver_pushes(now);
}

void AsioTransport::deliver_replies(TimePoint now) {
  auto& handler = *loop_.context.handler;
  while (auto reply = handler.next_reply(now)) {
    const auto found = loop_.tickets.find(static_cast<std::uint64_t>(reply->ticket));
    if (found != loop_.tickets.end()) {
      Connection& connection = *found->second;
      loop_.tickets.erase(found);
      connection.reply(*std::move(reply), now);
    } else if (reply->channel) {
      handler.closed(*reply->channel);
    }
    if (loop_.readiness.is_over()) {
      left_ = true;
      return;
    }
  }
}

/// One channel that is ready and one whose turn has come at least, whatever the replies have left of the budget.
void AsioTransport::deliver_pushes(TimePoint now) {
  auto& handler = *loop_.context.handler;
  while (const auto channel = handler.next_ready(now)) {
    const auto found = loop_.channels.find(static_cast<std::uint64_t>(*channel));
    if (found != loop_.channels.end()) found->second->push(now);
    if (loop_.readiness.is_over()) {
      left_ = true;
      break;
    }
  }
  while (!loop_.turns.empty()) {
    static_cast<WebSocket&>(loop_.turns.front()).push(now);
    if (loop_.readiness.is_over()) break;
  }
  left_ = left_ || !loop_.turns.empty();
}

/// After reading, so that a client is not late only because the host did not poll.
void AsioTransport::expire(TimePoint now) {
  while (auto* const entry = loop_.deadlines.expired(now.steady)) {
    entry->expire(now);
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
  const auto now_stopping = loop_.clock.now();
  for (std::size_t i = loop_.clients.size(); i-- > 0;) loop_.clients[i]->begin_stop(now_stopping);
  // Bounded by the machine's time, whatever the clock of the options says.
  const auto begin = SteadyClock::now();
  auto end = begin + loop_.options.limits.stop_time;
  while (!loop_.clients.empty()) {
    const bool busy = std::any_of(loop_.clients.begin(), loop_.clients.end(), [](const auto& client) { return client->is_busy(); });
    const auto now = SteadyClock::now();
    if (!busy) end = std::min<SteadyClock::time_point>(end, now + stop_linger_time);
    if (now >= end) break;
    poll(std::chrono::milliseconds(10), until(end, now));
  }
  for (std::size_t i = loop_.clients.size(); i-- > 0;) loop_.clients[i]->give_up(loop_.clock.now());
  close_all();
  loop_.readiness.forget_buried();
  loop_.context.handler = nullptr;
}

void AsioTransport::close_all() {
  listener_.close();
  while (!loop_.clients.empty()) loop_.clients.back()->close();
}

}  // namespace

std::unique_ptr<Transport> make_asio(Options options) { return std::make_unique<AsioTransport>(std::move(options)); }

}  // namespace lrt::transport

// SPDX-License-Identifier: Apache-2.0
#include <lrt/transport/http.hpp>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <exception>
#include <optional>
#include <string>
#include <utility>

#include "src/base/event_waker.hpp"
#include "src/transport/http/alarm.hpp"
#include "src/transport/http/connection.hpp"
#include "src/transport/http/listener.hpp"
#include "src/transport/http/loop.hpp"
#include "src/transport/http/websocket.hpp"
#include "src/transport/waits.hpp"

namespace lrt::transport {
inline namespace v0 {
namespace {

using std::chrono::milliseconds;
using SteadyClock = std::chrono::steady_clock;

constexpr milliseconds longest_wait = std::chrono::hours(1);
/// Waits up to this end with the precision of the alarm; for longer ones a millisecond of rounding does not matter.
constexpr milliseconds precise_wait{100};
/// How long stop() waits for clients to close their connections.
constexpr milliseconds stop_linger_time{100};

/// Clients that get messages under one lock of the handler. Fewer where the budget does not allow so many, at push_time each.
constexpr std::size_t max_round = 32;
constexpr std::chrono::microseconds push_time{10};

Unexpected no_descriptor(const char* kind, int error) {
  return unexpected(Errc::io_error, std::string("no ") + kind + " descriptor for the transport: " + std::strerror(error));
}

/// Records that the waker was called.
class WakeSignal final : public Watched {
 public:
  explicit WakeSignal(EventWaker& waker) : waker_(waker) {}
  void on_ready(std::uint32_t) override {
    waker_.clear();
    woken = true;
  }
  bool woken = false;

 private:
  EventWaker& waker_;
};

class HttpTransport final : public Transport {
 public:
  explicit HttpTransport(TransportOptions options)
      : loop_(std::move(options)), waker_(std::make_shared<EventWaker>()), wake_signal_(*waker_), listener_(loop_) {}

  ~HttpTransport() override {
    close_all();
    loop_.readiness.close();
  }

  Result<void> start(engine::Handler& handler) override;
  milliseconds poll(std::chrono::microseconds budget, milliseconds wait) override;
  int descriptor() noexcept override;
  std::shared_ptr<Waker> waker() const noexcept override { return waker_; }
  void stop() override;
  Capabilities capabilities() const noexcept override { return {true, true, true}; }
  Result<void> reload_tls() override;
  std::uint16_t port() const noexcept override { return listener_.port(); }
  std::optional<std::size_t> connections() const noexcept override { return connections_.load(std::memory_order_relaxed); }

 private:
  bool started() const noexcept { return loop_.context.handler != nullptr; }
  milliseconds prepare_wait(milliseconds wait);
  void set_alarm(bool left, std::optional<Deadlines::Instant> due);
  void alarm_now() noexcept;
  void deliver(TimePoint now);
  void deliver_replies(TimePoint now);
  void deliver_pushes(TimePoint now);
  void enqueue_ready(TimePoint now);
  void add_candidate(Client& client) noexcept;
  void expire(TimePoint now);
  std::optional<Deadlines::Instant> next_due() const;
  void close_all();

  Loop loop_;
  std::shared_ptr<EventWaker> waker_;
  WakeSignal wake_signal_;
  Alarm alarm_;
  Listener listener_;
  bool left_ = false;                        ///< the budget ended before all output of the handler was delivered
  bool descriptor_used_ = false;             ///< the host may sleep on descriptor()
  std::atomic<std::size_t> connections_{0};  ///< at the end of the last turn
};

Result<void> HttpTransport::start(engine::Handler& handler) {
  if (started()) return unexpected(Errc::invalid_option, "the transport is already started");
  if (loop_.options.tls) {
    if (auto loaded = reload_tls(); !loaded) return loaded;
  }
  auto& readiness = loop_.readiness;
  if (!readiness.is_open()) {
    if (waker_->descriptor() < 0) return no_descriptor("event", waker_->error());
    if (!readiness.open()) return no_descriptor("epoll", errno);
    if (!readiness.add(waker_->descriptor(), wake_signal_, EPOLLIN)) {
      const int error = errno;
      readiness.close();
      return no_descriptor("event", error);
    }
  }
  if (!alarm_.open(readiness)) return no_descriptor("timer", errno);
  if (auto opened = listener_.open(); !opened) return opened;
  loop_.context.handler = &handler;
  loop_.context.stopping = false;
  left_ = false;
  if (descriptor_used_) alarm_now();
  return {};
}

/// Readable at once: work may be due already.
int HttpTransport::descriptor() noexcept {
  if (!started()) return -1;
  if (!std::exchange(descriptor_used_, true)) alarm_now();
  return loop_.readiness.descriptor();
}

void HttpTransport::alarm_now() noexcept {
  const auto now = loop_.clock.now().steady;
  alarm_.set(now, now);
}

Result<void> HttpTransport::reload_tls() {
  if (!loop_.options.tls) return unexpected(Errc::invalid_option, "the port serves plain HTTP: there are no TLS files to reload");
  return loop_.tls.load(*loop_.options.tls);
}

milliseconds HttpTransport::poll(std::chrono::microseconds budget, milliseconds wait) {
  if (!started()) return milliseconds::max();
  auto& readiness = loop_.readiness;
  readiness.delete_deferred();
  wait = left_ || readiness.has_left() ? milliseconds(0) : prepare_wait(wait);
  // At least half of the budget is for deferred responses and channels, however many requests there are.
  const bool has_replies = !loop_.tickets.empty() || !loop_.channels.empty();
  readiness.set_budget(has_replies ? budget / 2 : budget);
  const bool all = readiness.serve(static_cast<int>(wait.count()));
  if (has_replies) readiness.set_budget(budget / 2 + readiness.budget_left());
  const auto now = loop_.clock.now();
  deliver(now);
  expire(now);

  connections_.store(loop_.clients.size(), std::memory_order_relaxed);
  const bool left = left_ || readiness.has_left();
  const auto due = next_due();
  if (descriptor_used_) set_alarm(left, due);
  if (left || !all) return milliseconds(0);
  return due ? until(*due, now.steady) : milliseconds::max();
}

/// The time to wait. The alarm ends the wait for a deadline between two milliseconds.
milliseconds HttpTransport::prepare_wait(milliseconds wait) {
  if (wait <= milliseconds(0)) return milliseconds(0);
  const auto now = loop_.clock.now().steady;
  wait = std::min(wait, longest_wait);
  if (const auto due = next_due()) wait = std::min(wait, until(*due, now));
  if (wait <= milliseconds(0)) return milliseconds(0);
  const auto due = wait > precise_wait ? std::nullopt : loop_.context.handler->next_deadline();
  if (due && *due > now && *due < now + wait) alarm_.set(*due, now);
  else alarm_.clear();
  return wait;
}

/// Sets the timer for a host that waits for the descriptor.
void HttpTransport::set_alarm(bool left, std::optional<Deadlines::Instant> due) {
  const auto now = loop_.clock.now().steady;
  if (left) due = now;
  if (due) alarm_.set(*due, now);
  else alarm_.clear();
}

/// Delivers the handler's output. It is called in each poll while a ticket or channel is open, because requests and messages of others may have
/// changed it; otherwise at its deadline and after a wake-up.
void HttpTransport::deliver(TimePoint now) {
  if (!wake_signal_.woken && !left_ && loop_.tickets.empty() && loop_.channels.empty()) {
    const auto due = loop_.context.handler->next_deadline();
    if (!due || *due > now.steady) return;
  }
  wake_signal_.woken = left_ = false;
  try {
    deliver_replies(now);
    deliver_pushes(now);
  } catch (...) {
    left_ = true;  // no memory: the next poll goes on
    throw;
  }
}

void HttpTransport::deliver_replies(TimePoint now) {
  auto& handler = *loop_.context.handler;
  while (auto reply = handler.next_reply(now)) {
    const auto found = loop_.tickets.find(static_cast<std::uint64_t>(reply->ticket));
    if (found != loop_.tickets.end()) {
      Connection& connection = *found->second;
      loop_.tickets.erase(found);
      connection.call([&] { connection.reply(*std::move(reply), now); });
    } else if (reply->channel) {
      handler.closed(*reply->channel);
    }
    if (loop_.readiness.is_over()) {
      left_ = true;
      return;
    }
  }
}

/// Clients are served round-robin over all calls: if the budget ends a call, the next call continues there. At least one client is served,
/// even if the replies have used up the budget.
void HttpTransport::deliver_pushes(TimePoint now) {
  auto& handler = *loop_.context.handler;
  enqueue_ready(now);
  // Moved out: after the end of a stream a WebSocket may start and request its first message.
  PushRound round = std::exchange(loop_.pushes, {});
  while (!loop_.turns.empty()) {
    round.clear();
    const std::size_t clients = loop_.readiness.steps_left(push_time, max_round);
    while (!loop_.turns.empty() && round.clients.size() < clients) {
      Client& client = loop_.turns.front();
      try {
        if (client.max_messages() > 0) round.add(client);  // otherwise it requests a message again later
      } catch (...) {
        if (round.clients.empty()) throw;
        break;
      }
      static_cast<Linked<TurnTag>&>(client).unlink();
    }
    std::exception_ptr failed;  // what was taken before is sent, and the clients have another turn
    try {
      handler.take_pushes(round.requests, round.pushes, now);
    } catch (...) { failed = std::current_exception(); }
    engine::Push* next = round.pushes.data();
    bool is_over = false;
    for (std::size_t i = 0; i < round.clients.size(); ++i) {
      const engine::PushRequest& request = round.requests[i];
      Client& client = *round.clients[i];
      if (request.given > 0) {
        client.push(next, request.given, now, is_over);
        is_over = is_over || loop_.readiness.is_over();
      }
      next += request.given;
      if ((request.more || failed) && client.max_messages() > 0) loop_.turns.push_back(client);
    }
    if (failed) std::rethrow_exception(failed);
    if (loop_.readiness.is_over()) break;
  }
  round.clear();
  loop_.pushes = std::move(round);
  left_ = left_ || !loop_.turns.empty();
}

/// Urgent ones first. Then the client that was served longest ago: the handler reports them in its own order, in
/// which the last would miss most values when not all are served before the next value.
void HttpTransport::enqueue_ready(TimePoint now) {
  loop_.ready.clear();
  std::exception_ptr failed;  // those that were reported before are not reported again
  try {
    loop_.context.handler->take_ready(loop_.ready, now);
  } catch (...) { failed = std::current_exception(); }
  loop_.candidates.clear();
  for (std::size_t i = loop_.ready.size(); i-- > 0;) {  // so that the first urgent one is at the front
    const auto found = loop_.channels.find(static_cast<std::uint64_t>(loop_.ready[i].channel));
    if (found == loop_.channels.end()) continue;
    Client& client = *found->second;
    if (loop_.ready[i].urgent) loop_.turns.push_front(client);
    else if (!static_cast<Linked<TurnTag>&>(client).is_linked()) add_candidate(client);
  }
  std::sort(loop_.candidates.begin(), loop_.candidates.end(), [](const Client* a, const Client* b) { return a->last_turn() < b->last_turn(); });
  for (Client* const client : loop_.candidates) loop_.turns.push_back(*client);
  if (failed) std::rethrow_exception(failed);
}

/// Without memory for the order it is served first.
void HttpTransport::add_candidate(Client& client) noexcept {
  try {
    loop_.candidates.push_back(&client);
  } catch (...) { loop_.turns.push_back(client); }
}

/// After reading, so that a client is not late because the host did not poll.
void HttpTransport::expire(TimePoint now) {
  while (auto* const entry = loop_.deadlines.expired(now.steady)) {
    entry->expire(now);
    if (loop_.readiness.is_over()) break;  // those that are left are due at once
  }
  listener_.resume(now);
}

std::optional<Deadlines::Instant> HttpTransport::next_due() const {
  auto due = loop_.deadlines.next();
  for (const auto other : {listener_.resumes_at(), loop_.context.handler->next_deadline()}) {
    if (other && (!due || *other < *due)) due = other;
  }
  return due;
}

void HttpTransport::stop() {
  if (!started()) return;
  listener_.close();
  loop_.context.stopping = true;
  const auto now_stopping = loop_.clock.now();
  for (std::size_t i = loop_.clients.size(); i-- > 0;) {
    Client& client = *loop_.clients[i];
    client.call([&] { client.begin_stop(now_stopping); });
  }
  // Bounded by the machine's time, whatever the clock of the options says.
  const auto begin = SteadyClock::now();
  auto end = begin + loop_.options.limits.stop_timeout;
  while (!loop_.clients.empty()) {
    const bool busy = std::any_of(loop_.clients.begin(), loop_.clients.end(), [](const auto& client) { return client->is_busy(); });
    const auto now = SteadyClock::now();
    if (!busy) end = std::min<SteadyClock::time_point>(end, now + stop_linger_time);
    if (now >= end) break;
    poll(std::chrono::milliseconds(10), until(end, now));
  }
  for (std::size_t i = loop_.clients.size(); i-- > 0;) {
    Client& client = *loop_.clients[i];
    client.call([&] { client.give_up(loop_.clock.now()); });
  }
  close_all();
  loop_.readiness.drop();
  loop_.context.handler = nullptr;
}

void HttpTransport::close_all() {
  listener_.close();
  while (!loop_.clients.empty()) loop_.clients.back()->close();
}

}  // namespace

std::unique_ptr<Transport> make_http(TransportOptions options) { return std::make_unique<HttpTransport>(std::move(options)); }

}  // namespace v0
}  // namespace lrt::transport

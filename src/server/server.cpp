// SPDX-License-Identifier: Apache-2.0
#include <lrt/server.hpp>

#include <algorithm>
#include <atomic>
#include <deque>
#include <iterator>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <type_traits>

#include <lrt/transport/http.hpp>

#include "src/base/event_waker.hpp"
#include "src/base/client_key.hpp"
#include "src/base/mailbox.hpp"
#include "src/base/process.hpp"
#include "src/base/thread.hpp"
#include "src/model/spec.hpp"
#include "src/model/world_hooks.hpp"
#include "src/page/page.hpp"
#include "src/rdf/codecs.hpp"
#include "src/server/audit.hpp"
#include "src/server/body_pool.hpp"
#include "src/server/callers.hpp"
#include "src/server/client_limiter.hpp"
#include "src/server/counters.hpp"
#include "src/server/feeds.hpp"
#include "src/server/guest_requests.hpp"
#include "src/server/kept_graphs.hpp"
#include "src/server/listen_addresses.hpp"
#include "src/server/log_queue.hpp"
#include "src/server/saved_file.hpp"

namespace lrt {
inline namespace v0 {

namespace {

constexpr auto forever = std::chrono::milliseconds::max();
/// A thread of a host's HTTP server checks its deadline at least this often.
constexpr std::chrono::milliseconds longest_guest_wait{50};
/// The time of one turn on lrt's own thread. Deferred responses are sent after it.
constexpr std::chrono::milliseconds own_thread_budget{1};
/// The time of one turn on a loop of the host.
constexpr std::chrono::microseconds host_loop_budget{200};

}  // namespace

class Server::Impl final : public engine::Handler, public delivery::Source, public FeedHost {
 public:
  explicit Impl(Options options)
      : options_(std::move(options)),
        clock_(options_.clock ? *options_.clock : system_clock()),
        log_(options_.log),
        sessions_(make_sessions(options_)),
        engine_(engine_options()),
        bodies_("lrt-body", std::max(1U, options_.threads.body_threads), options_.threads.own),
        queries_("lrt-query", std::max(1U, options_.query ? options_.query->limits().threads : 0U), options_.threads.own) {}

  ~Impl() override {
    stop();
    transport_.reset();  // first: a turn on the host's loop may be running
    saved_.reset();      // writes the pending text
    graphs_.clear();     // the same
    log_.flush();
  }

  Result<void> listen() {
    const Turn not_yet(*this);  // on a loop of the host's, turns come as soon as the transport starts
    if (options_.threads.dispatch == Dispatch::executor && !options_.threads.executor)
      return unexpected(Errc::invalid_option, "Dispatch::executor needs Threads::executor");
    if (rest_.descriptor() < 0)
      return unexpected(Errc::io_error, "cannot create an event descriptor for the server: " + std::system_category().message(rest_.error()));
    if (Result<void> checked = engine_.check(); !checked) return checked;
    if (Result<void> checked = ClientLimiter::check(options_.security.clients); !checked) return checked;
    limiter_.emplace(options_.security.clients);
    if (Result<void> checked = Audit::check(options_.security.audit); !checked) return checked;
    if (options_.security.audit.sink) {
      audit_.emplace(options_.security.audit, waking_log());
      Result<Thread> started = start_thread("lrt-audit", options_.threads.own, [this] { audit_->writer().run(); });
      if (!started) return Unexpected{std::move(started).error()};
      audit_thread_ = *std::move(started);
    }
    auto callers = Callers::create(options_.security, sessions_, waking_log(), clock_);
    if (!callers) return Unexpected{std::move(callers).error()};
    callers_ = *std::move(callers);
    Result<std::optional<SavedFile::Content>> saved = load();
    if (!saved) return Unexpected{saved.error()};
    if (Result<void> started = start_transport(); !started) return started;
    transport_waker_ = transport_->waker();
    engine_.set_waker(transport_waker_);
    if (!options_.callbacks.file.empty())
      if (Result<void> restored = restore(*saved); !restored) return restored;
    options_.callbacks.threads = options_.threads.own;
    if (const auto& callbacks = options_.callbacks; !callbacks.allow.empty()) {
      auto made =
          callbacks.deliverer ? callbacks.deliverer(*this, callbacks, waking_log()) : delivery::make_deliverer(*this, callbacks, waking_log());
      if (!made) return Unexpected{std::move(made).error()};
      deliverer_ = *std::move(made);
    }
    if (options_.threads.io == Io::in_poll) rdf::prepare_rdf_xml();  // no turn in poll() must wait for that
    if (options_.threads.io == Io::own_thread) {
      Result<Thread> io = start_thread("lrt-io", options_.threads.own, [this] { serve(); });
      if (!io) return Unexpected{std::move(io).error()};
      io_ = *std::move(io);
    }
    return {};
  }

  /// False if it must not be destroyed: in a child process, which has none of its threads, and when its destructor runs within one of its functions,
  /// as in exit() called by a lambda.
  bool can_be_destroyed() noexcept {
    if (!process_.is_current() || serving_ == std::this_thread::get_id()) return false;
    const std::lock_guard lock(threads_mutex_);
    return !io_.is_current() && !runner_.is_current() && !audit_thread_.is_current();
  }

  /// @param what  a Thing, or several
  template <class Things>
  Result<void> add(Things what) {
    if (Result<void> open = check_open(); !open) return open;
    Result<KeptGraphs::Opened> opened = open_graphs(what);
    if (!opened) return Unexpected{std::move(opened).error()};
    Result<void> added = with_engine([&] { return engine_.add(std::move(what)); });
    if (added) graphs_.add(*std::move(opened));
    return added;
  }
  Result<void> remove(std::string_view path) {
    if (!process_.is_current()) return check_open();
    Result<void> result = with_engine([&] { return engine_.remove(path); });
    if (const Result<std::string> encoded = model::encode_path_from_root(path); result && encoded) graphs_.remove(*encoded);
    if (transport_waker_) transport_waker_->wake();
    return result;
  }

  std::chrono::milliseconds poll(std::chrono::microseconds budget) noexcept {
    if (!process_.is_current()) return forever;
    if (serving_ == std::this_thread::get_id()) return std::chrono::milliseconds(0);  // called by a lambda that the transport's turn runs
    try {
      const auto begin = std::chrono::steady_clock::now();
      const Counters::Poll measured(counters_, begin);
      const auto end = begin + budget;
      const bool serves = options_.threads.io == Io::in_poll;
      std::chrono::milliseconds rest = forever;
      if (!serves && rest_.is_awake()) rest_.clear();
      if (serves) rest = serve_once(budget, std::chrono::milliseconds(0));
      bool ran = false;
      do {
        if (due_.empty()) arrived_.take_all([&](UniqueFunction<void()> job) { due_.push_back(std::move(job)); });
        if (due_.empty() || stopping_) break;
        UniqueFunction<void()> job = std::move(due_.front());
        due_.pop_front();
        job();
        ran = true;
      } while (std::chrono::steady_clock::now() < end);
      // The results of the lambdas are sent in the same step.
      if (serves && ran) rest = serve_once(std::chrono::microseconds(0), std::chrono::milliseconds(0));
      if (due_.empty() && arrived_.empty()) return rest;
      if (descriptor_is_used_) wake();  // so that it shows that there is more to do
      return std::chrono::milliseconds(0);
    } catch (...) { return std::chrono::milliseconds(0); }
  }

  void run() noexcept {
    while (!stopping_ && process_.is_current()) {
      const std::chrono::milliseconds rest = std::min(poll(std::chrono::milliseconds(10)), std::chrono::milliseconds(1000));
      if (rest.count() == 0) continue;
      try {
        if (options_.threads.io == Io::in_poll) serve_once(std::chrono::milliseconds(10), rest);
        else rest_.wait(rest);
      } catch (...) {}
    }
  }

  int descriptor() noexcept {
    descriptor_is_used_ = true;
    if (options_.threads.io == Io::own_thread) return rest_.descriptor();
    return transport_ ? transport_->descriptor() : -1;
  }

  void start() {
    if (!process_.is_current()) return;
    const std::lock_guard lock(threads_mutex_);
    if (!runner_.joinable()) runner_ = start_thread("lrt-run", options_.threads.own, [this] { run(); }).value();
  }

  void wake() noexcept {
    if (!process_.is_current()) return;
    if (options_.threads.io == Io::in_poll && transport_waker_) transport_waker_->wake();
    else rest_.wake();
  }

  void stop() noexcept {
    if (!process_.is_current()) return;
    stopping_ = true;
    rest_.wake();
    if (transport_waker_) transport_waker_->wake();
    {
      const std::lock_guard lock(mutex_);
      guests_.notify();
      feeds_.wake_all();
    }
    const auto me = std::this_thread::get_id();
    if (serving_ == me) return;  // from a lambda: the serving thread finishes when it returns
    // Each thread is joined by the first caller, without a lock: a lambda on one of them may be stopping too.
    Thread io, runner, auditor;
    {
      const std::lock_guard lock(threads_mutex_);
      if (!audit_thread_.is_current()) auditor = std::move(audit_thread_);
      if (!io_.is_current()) io = std::move(io_);
      if (!runner_.is_current()) runner = std::move(runner_);
    }
    io.join();
    runner.join();
    if (options_.threads.io == Io::in_poll && transport_) {
      if (const Turn turn(*this); turn) finish();
      else wait_until_finished();  // a turn on another thread executes the stop
    }
    if (audit_) audit_->writer().stop();
    auditor.join();
    log_.flush();
  }

  Result<void> reload_tls() {
    if (!process_.is_current()) return check_open();
    return transport_ ? transport_->reload_tls() : unexpected(Errc::closed, "the server does not listen");
  }
  ServerCounters counters() const {
    ServerCounters all;
    counters_.read(all);
    if (transport_) all.connections = transport_->connections();
    if (audit_) {
      all.audit_dropped = audit_->writer().dropped();
      all.audit_waiting = audit_->writer().waiting();
    }
    if (!process_.is_current()) return all;
    const std::lock_guard lock(mutex_);
    const engine::EngineCounts counts = engine_.counts();
    all.websockets = counts.websockets;
    all.event_streams = counts.event_streams;
    all.callbacks = counts.callbacks;
    all.feeds = counts.feeds;
    all.messages_sent = counts.messages_sent;
    all.messages_dropped = counts.messages_dropped;
    all.queued_bytes = counts.queued_bytes;
    all.waiting_requests = counts.waiting_requests;
    all.waiting_calls = counts.waiting_calls;
    return all;
  }
  std::uint16_t port() const noexcept { return transport_ ? transport_->port() : 0; }
  std::string url() const {
    const bool six = options_.listen.address.find(':') != std::string::npos;
    return (options_.security.tls ? "https://" : "http://") + (six ? "[" + options_.listen.address + "]" : options_.listen.address) + ":" +
           std::to_string(port()) + "/";
  }

  // engine::Handler, on the transport's thread
  engine::HeaderVerdict judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes, TimePoint now) override {
    const Result<engine::Caller> caller = admit(request, true, now);
    engine::HeaderVerdict verdict = with_engine([&] {
      engine::HeaderVerdict made = engine_.judge_header(request, body_bytes, caller, now);
      if (made.response) {
        counters_.request();
        counters_.response(made.response->status, made.response->denial);
      }
      if (made.response) audit([&](Audit& audit) { audit.refused(request, caller, *made.response, now); });
      return made;
    });
    if (!verdict.response && caller)
      limiter_->count_body(*caller, std::min<std::uint64_t>(body_bytes.value_or(verdict.max_body_bytes), options_.limits.max_body_bytes), now);
    return verdict;
  }
  engine::HeaderVerdict judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes) {
    if (!process_.is_current()) return {refused(), 0};
    return judge_header(request, body_bytes, clock_.now());
  }
  bool is_stop(const http::Request& request) noexcept override {
    const std::lock_guard lock(mutex_);
    return engine_.is_stop(request);
  }
  engine::Outcome handle(const http::Request& request, TimePoint now) override {
    const Result<engine::Caller> caller = admit(request, !request.body.empty(), now);
    return with_engine([&] { return handle(request, caller, now); });
  }
  std::optional<engine::Reply> next_reply(TimePoint now) override {
    run_io_jobs();
    renew_rights(now);
    return with_engine([&]() -> std::optional<engine::Reply> {
      if (!replies_.empty()) {
        engine::Reply first = std::move(replies_.front());
        replies_.pop_front();
        return first;
      }
      std::optional<engine::Reply> reply;
      do reply = take_reply(now);
      while (reply && (guests_.take(*reply) || feeds_.take(*reply)));
      return reply;
    });
  }
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const override {
    if (!io_jobs_.empty() || !stop_jobs_.empty()) return std::chrono::steady_clock::time_point{};
    const auto look = callers_ ? callers_->next_look() : std::nullopt;
    const std::lock_guard lock(mutex_);
    if (!replies_.empty()) return std::chrono::steady_clock::time_point{};
    const auto deadline = engine_.next_deadline();
    return look && (!deadline || *look < *deadline) ? look : deadline;
  }
  void abandon(engine::Ticket ticket) noexcept override {
    const std::lock_guard lock(mutex_);
    engine_.abandon(ticket);
    audit([&](Audit& audit) { audit.abandoned(ticket); });
  }
  void input_ended(engine::Ticket ticket) noexcept override {
    const std::lock_guard lock(mutex_);
    engine_.input_ended(ticket);
  }
  std::optional<engine::Channel> next_ready(TimePoint now) override {
    return with_engine([&] {
      std::optional<engine::Channel> channel;
      do channel = engine_.next_ready(now);
      while (channel && (guests_.take(*channel) || feeds_.take(*channel, engine_)));
      return channel;
    });
  }
  std::optional<engine::Push> next_push(engine::Channel channel, TimePoint now) override {
    return with_engine([&] { return engine_.next_push(channel, now); });
  }
  void take_ready(std::vector<engine::ReadyChannel>& channels, TimePoint now) override {
    with_engine([&] {
      const std::size_t before = channels.size();
      engine_.take_ready(channels, now);
      channels.erase(
          std::remove_if(channels.begin() + static_cast<std::ptrdiff_t>(before), channels.end(),
                         [&](const engine::ReadyChannel& ready) { return guests_.take(ready.channel) || feeds_.take(ready.channel, engine_); }),
          channels.end());
    });
  }
  void take_pushes(std::vector<engine::PushRequest>& requests, std::vector<engine::Push>& pushes, TimePoint now) override {
    with_engine([&] { engine_.take_pushes(requests, pushes, now); });
  }
  void closed(engine::Channel channel) noexcept override {
    const std::lock_guard lock(mutex_);
    engine_.closed(channel);
    if (audit_) audit_subscriptions(clock_.now());
  }

  // delivery::Source, on the deliverer's threads
  std::optional<subscription::Notification> next_notification(engine::Channel channel) override {
    auto notification = with_engine([&] { return engine_.next_notification(channel, clock_.now()); });
    if (!notification && transport_waker_) transport_waker_->wake();  // a timer may have been set
    return notification;
  }
  void delivered(engine::Channel channel, subscription::DeliveryResult result) noexcept override {
    try {
      with_engine([&] { engine_.delivered(channel, result, clock_.now()); });
      if (transport_waker_ && result.status / 100 != 2) transport_waker_->wake();  // there is a new timer
    } catch (const std::exception& e) { log(LogLevel::error, std::string("a delivery result could not be processed: ") + e.what()); }
  }

  // Requests that came over an HTTP server of the host's, on its threads.
  http::Response serve(const http::Request& request, std::optional<engine::Channel>& channel) {
    if (!process_.is_current()) return refused();
    const TimePoint now = clock_.now();
    const Result<engine::Caller> caller = admit(request, !request.body.empty(), now);
    engine::Outcome outcome = with_engine([&] {
      engine::Outcome made = handle(request, caller, now);
      // Before the lock is released: a reply may be available at once.
      if (const auto* deferred = std::get_if<engine::Deferred>(&made)) guests_.add(deferred->ticket);
      if (const auto* streamed = std::get_if<engine::Streamed>(&made)) guests_.add(streamed->channel);
      return made;
    });
    if (transport_waker_) transport_waker_->wake();  // there may be a new deadline, or news for other clients
    if (auto* response = std::get_if<http::Response>(&outcome)) return std::move(*response);
    if (auto* streamed = std::get_if<engine::Streamed>(&outcome)) {
      channel = streamed->channel;
      return std::move(streamed->response);
    }
    engine::Reply reply = wait_for_reply(std::get<engine::Deferred>(outcome).ticket);
    channel = reply.channel;
    return std::move(reply.response);
  }
  std::optional<engine::Push> next_event(engine::Channel channel, std::chrono::milliseconds max_wait) {
    const auto end = std::chrono::steady_clock::now() + std::min<std::chrono::milliseconds>(max_wait, std::chrono::hours(24));
    while (true) {
      if (stopping_ || !process_.is_current()) return closing_push();
      if (auto push = with_engine([&] { return engine_.next_push(channel, clock_.now()); })) return push;
      std::unique_lock lock(mutex_);
      while (!guests_.is_ready(channel) && !stopping_) {
        if (std::chrono::steady_clock::now() >= end) return std::nullopt;
        guests_.wait(lock, end);
      }
    }
  }
  void close_events(engine::Channel channel) noexcept {
    if (!process_.is_current()) return;
    {
      const std::lock_guard lock(mutex_);
      guests_.remove(channel);
      engine_.closed(channel);
      if (audit_) audit_subscriptions(clock_.now());
    }
    log_.flush();
  }

  // FeedHost, on the threads of feeds
  Result<void> open_feed(const std::shared_ptr<Feed::State>& feed) override {
    if (Result<void> open = check_open(); !open) return open;
    const std::lock_guard lock(mutex_);
    if (feeds_.empty()) engine_.follow_resources(true);
    feeds_.add(feed);
    feed->waker->wake();  // all resources are new for it
    return {};
  }
  void close_feed(Feed::State& feed) noexcept override {
    if (!process_.is_current()) return;
    {
      const std::lock_guard lock(mutex_);
      for (const auto& [channel, queued] : feed.channels) engine_.closed(engine::Channel{channel});
      feeds_.remove(feed);
      if (feeds_.empty()) engine_.follow_resources(false);
      if (audit_) audit_subscriptions(clock_.now());
    }
    log_.flush();
  }
  Result<engine::Channel> subscribe(Feed::State& feed, engine::FeedSubscription wanted) override {
    if (Result<void> open = check_open(); !open) return Unexpected{std::move(open).error()};
    Result<engine::Channel> made = with_engine([&]() -> Result<engine::Channel> {
      const TimePoint now = clock_.now();
      wanted.owner = feed.owner;
      Result<engine::Subscribed> subscribed = engine_.subscribe(std::move(wanted), now);
      if (!subscribed) return Unexpected{std::move(subscribed).error()};
      feeds_.add(feed, subscribed->channel, subscribed->queues);
      audit_subscriptions(now);
      return subscribed->channel;
    });
    wake_io();  // it observes changes from now on
    return made;
  }
  void unsubscribe(Feed::State& feed, engine::Channel channel) noexcept override {
    if (!process_.is_current()) return;
    {
      const std::lock_guard lock(mutex_);
      if (feed.channels.count(static_cast<std::uint64_t>(channel)) == 0) return;
      feeds_.remove(feed, channel);
      engine_.closed(channel);
      if (audit_) audit_subscriptions(clock_.now());
    }
    log_.flush();
  }
  void repeat_all(Feed::State& feed) override {
    if (!process_.is_current() || stopping_) return;
    with_engine([&] {
      for (const auto& [channel, queued] : feed.channels)
        if (engine_.repeat(engine::Channel{channel})) feed.newest.push_back(engine::Channel{channel});
    });
    feed.waker->wake();
    wake_io();  // of queues
  }
  std::uint64_t send(Feed::State& feed, const http::Request& request, Feed::As as) override {
    const bool open = process_.is_current() && !stopping_;
    const TimePoint now = clock_.now();
    const Result<engine::Caller> caller = !open                   ? engine::Caller()
                                          : as == Feed::As::owner ? owner_of(feed)
                                                                  : admit(request, !request.body.empty(), now);
    const std::uint64_t number = feed.next_number++;  // of the feed's thread
    if (!open) {
      const std::lock_guard lock(mutex_);
      feed.responses.push_back({number, refused()});
      return number;
    }
    with_engine([&] {
      engine::Outcome outcome = handle(request, caller, now);
      if (const auto* deferred = std::get_if<engine::Deferred>(&outcome)) feeds_.add(feed, deferred->ticket, number);
      else if (auto* response = std::get_if<http::Response>(&outcome)) feed.responses.push_back({number, std::move(*response)});
      else feed.responses.push_back({number, refused()});  // never: the request can neither stream nor upgrade
    });
    feed.waker->wake();
    wake_io();  // there may be a new deadline, or news for other clients
    return number;
  }
  void take(Feed::State& feed, const Feed::Bounds& bounds, Feed::Batch& batch) override {
    batch.closed = stopping_ || !process_.is_current();
    feed.waker->clear();
    if (!process_.is_current()) return;
    bool has_timer = false;
    with_engine([&] {
      batch.responses = std::exchange(feed.responses, {});
      batch.structure = engine_.structure();
      if (stopping_) return;
      if (std::exchange(feed.lists_all, false)) {
        feed.resources.clear();
        batch.resources = engine_.observable_resources();
      } else {
        batch.resources = std::exchange(feed.resources, {});
      }
      const TimePoint now = clock_.now();
      const auto deadline = engine_.next_deadline();
      std::size_t bytes = 0;
      const auto take_from = [&](std::deque<engine::Channel>& list, std::size_t max) {
        while (!list.empty() && batch.messages.size() < max && bytes < bounds.max_bytes) {
          const engine::Channel channel = list.front();
          list.pop_front();
          if (feed.channels.count(static_cast<std::uint64_t>(channel)) == 0) continue;  // it was removed
          std::optional<engine::FeedMessage> message = engine_.next_feed_message(channel, now);
          if (!message) continue;
          bytes += message->body ? message->body->size() : 0;
          if (message->end) feeds_.remove(feed, channel);
          else list.push_back(channel);
          batch.messages.push_back(*std::move(message));
        }
      };
      if (bounds.queued) take_from(feed.queued, (bounds.max_messages + 1) / 2);  // commands first, and some of both
      take_from(feed.newest, bounds.max_messages);
      if (bounds.queued) take_from(feed.queued, bounds.max_messages);
      for (const engine::Channel channel : std::exchange(feed.ended, {})) {
        engine::FeedMessage last;
        last.channel = channel;
        last.end = true;
        batch.messages.push_back(std::move(last));
      }
      const auto next = engine_.next_deadline();
      has_timer = next && (!deadline || *next < *deadline);
      batch.more = bounds.max_messages != 0 && (!feed.newest.empty() || (bounds.queued && !feed.queued.empty()));
    });
    if (batch.more) feed.waker->wake();
    if (has_timer) wake_io();
  }
  std::string feed_base() const override {
    const std::lock_guard lock(mutex_);
    return engine_.base();
  }
  bool is_protected() const override { return callers_ != nullptr; }

 private:
  Result<void> check_open() const {
    if (!process_.is_current()) return unexpected(Errc::closed, "the server was created by the parent process and cannot be used after fork()");
    return stopping_ ? unexpected(Errc::closed, "the server has stopped") : Result<void>();
  }

  Result<engine::Caller> owner_of(const Feed::State& feed) {
    if (!callers_ || !feed.owner) return engine::Caller();
    std::optional<engine::Caller> caller = callers_->renew(feed.owner.get());
    return caller ? *std::move(caller) : engine::Caller(engine::Access::forbidden);
  }

  /// Determines the caller, and whether that client exceeds its limits. Each request is counted once, when its header section is checked.
  Result<engine::Caller> admit(const http::Request& request, bool has_body, TimePoint now) {
    Result<engine::Caller> caller = engine_.authorize(request);  // user code: without the lock
    if (!caller || request.judged) return caller;
    if (const auto pause = limiter_->count(*caller, request.peer, has_body, now); pause && !is_stop(request)) {
      caller->access = engine::Access::too_many_requests;
      caller->retry_after = *pause;
    } else if (!request.body.empty()) {
      limiter_->count_body(*caller, request.body.size(), now);
    }
    return caller;
  }

  // @pre the lock is held
  engine::Outcome handle(const http::Request& request, const Result<engine::Caller>& caller, TimePoint now) {
    engine::Outcome outcome = engine_.handle(request, caller, now);
    counters_.request();
    if (const auto* response = std::get_if<http::Response>(&outcome)) counters_.response(response->status, response->denial);
    else if (const auto* streamed = std::get_if<engine::Streamed>(&outcome)) counters_.response(streamed->response.status, http::Denial::none);
    else if (std::holds_alternative<engine::Upgraded>(outcome)) counters_.response(101, http::Denial::none);
    audit_subscriptions(now);
    audit([&](Audit& audit) { audit.handled(request, caller, outcome, now); });
    return outcome;
  }
  std::optional<engine::Reply> take_reply(TimePoint now) {
    std::optional<engine::Reply> reply = engine_.next_reply(now);
    if (reply) counters_.response(reply->response.status, reply->response.denial);
    audit_subscriptions(now);
    if (reply) audit([&](Audit& audit) { audit.replied(*reply); });
    return reply;
  }
  void audit_subscriptions(TimePoint now) noexcept {
    audit([&](Audit& audit) { audit.changed(engine_.take_subscription_events(), now); });
  }
  template <class F>
  void audit(F f) noexcept {
    if (!audit_) return;
    try {
      f(*audit_);
    } catch (...) {  // no memory for the line
      audit_->writer().drop();
    }
  }

  /// Starts a transport on Listen::address; of a host name, on its first address that the machine has.
  Result<void> start_transport() {
    const std::string& given = options_.listen.address;
    const Result<std::vector<std::string>> resolved = listen_addresses(given);
    Result<void> started;
    for (const std::string& address : resolved ? *resolved : std::vector<std::string>{given}) {
      make_transport(address);
      if (transport_ && transport_->capabilities().network && !resolved) return Unexpected{resolved.error()};
      if (Result<void> checked = check_transport(address); !checked) return checked;
      started = transport_->start(*this);
      if (!started && started.error().code != Errc::address_in_use) continue;
      if (started) {
        const transport::Capabilities can = transport_->capabilities();
        engine_.listens_on(address, transport_->port(), options_.security.tls.has_value(), address == given ? std::string_view() : given,
                           {can.websocket, can.callback_upgrade});
      }
      break;
    }
    return started;
  }

  void make_transport(const std::string& address) {
    transport::TransportOptions t;
    t.address = address;
    t.port = options_.listen.port;
    t.limits = options_.limits;
    t.tls = options_.security.tls;
    t.clock = &clock_;
    t.log = log_.sink();
    t.turn = [this] { poll(host_loop_budget); };
    transport_ = options_.listen.transport ? options_.listen.transport(std::move(t)) : transport::make_http(std::move(t));
  }

  Result<void> check_transport(const std::string& address) {
    if (!transport_) return unexpected(Errc::invalid_option, "Listen::transport: expected a transport, found nullptr");
    const transport::Capabilities can = transport_->capabilities();
    if (can.on_host_loop && options_.threads.io != Io::in_poll)
      return unexpected(Errc::invalid_option, "the transport runs on the host's event loop: set Io::in_poll");
    descriptor_is_used_ = can.on_host_loop;
    const Security& security = options_.security;
    if (security.tls && !can.tls) return unexpected(Errc::invalid_option, "the transport does not support TLS");
    if (!can.network || is_this_machine(address) || security.tls || callers_ || security.allow_unprotected_network) return {};
    const std::string& given = options_.listen.address;
    return unexpected(Errc::insecure_address,
                      "listening on " + given + (address == given ? "" : " (" + address + ")") +
                          " lets every client on the network move the robot: set security.token_file, security.certificates, security.rules or "
                          "security.authorize to "
                          "say who may command. security.tls alone and security.allow_unprotected_network admit every client");
  }

  /// The right to enter the transport. Acquired with try_lock semantics only.
  class Turn {
   public:
    explicit Turn(Impl& impl) : impl_(impl) {
      std::thread::id none;
      mine_ = impl_.serving_.compare_exchange_strong(none, std::this_thread::get_id());
    }
    ~Turn() {
      if (mine_) impl_.serving_ = std::thread::id();
    }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    explicit operator bool() const noexcept { return mine_; }

   private:
    Impl& impl_;
    bool mine_ = false;
  };

  /// nullptr: there are no tokens, so that no sessions are possible.
  static std::shared_ptr<security::Sessions> make_sessions(const Options& options) {
    const Security& security = options.security;
    const bool has_tokens = !security.token_file.empty() || security.authenticate;
    if (!has_tokens || security.sessions.life.count() <= 0) return nullptr;
    return std::make_shared<security::Sessions>(security.sessions, options.listen.public_base);
  }

  engine::EngineOptions engine_options() {
    engine::EngineOptions options;
    static_cast<engine::Limits&>(options) = options_.limits;
    options.public_base = options_.listen.public_base;
    options.allowed_hosts = options_.security.allowed_hosts;
    options.allowed_origins = options_.security.allowed_origins;
    options.notification_senders = options_.security.notification_senders;
    options.read_origins = options_.security.read_origins;
    options.authorize = [this](const http::Request& request) { return callers_ ? callers_->of(request) : engine::Caller(); };
    options.everybody_reads = !options_.security.authorize;
    options.renew = [this](const security::Principal* owner) { return callers_ ? callers_->renew(owner) : engine::Caller(); };
    options.challenge = options_.security.challenge;
    options.sessions = sessions_;
    options.clients = options_.security.clients;
    options.reports_subscriptions = static_cast<bool>(options_.security.audit.sink);
    options.dispatch = options_.threads.dispatch;
    options.body_jobs = options_.threads.body_threads > 0;
    options.subscriptions = options_.subscriptions;
    options.callbacks = options_.callbacks;
    if (!options_.callbacks.file.empty() && options_.callbacks.respond_when_saved) options.save_timeout = options_.callbacks.save_timeout;
    options.prefixes = options_.prefixes;
    options.vocabulary = options_.vocabulary;
    options.clock = options_.clock;
    options.ids = options_.ids;
    options.log = log_.sink();
    options.query = options_.query;
    options.page = options_.page ? options_.page : page::console();
    return options;
  }

  /// Calls the engine with its lock, and then processes its output without the lock.
  template <class F>
  std::invoke_result_t<F&> with_engine(F f) {
    std::unique_lock lock(mutex_);
    if constexpr (std::is_void_v<std::invoke_result_t<F&>>) {
      f();
      pass_on(lock);
    } else {
      auto result = f();
      pass_on(lock);
      return result;
    }
  }

  /// One step of the transport, by one thread at a time. A stop that was requested in the meantime is executed here.
  std::chrono::milliseconds serve_once(std::chrono::microseconds budget, std::chrono::milliseconds wait) {
    std::chrono::milliseconds rest{0};
    {
      const Turn turn(*this);
      if (!turn) return rest;  // a lambda on this thread polls, or another thread does
      if (finished_) return forever;
      try {
        rest = stopping_ ? forever : transport_->poll(budget, wait);
      } catch (const std::exception& e) { log(LogLevel::error, std::string("transport: ") + e.what()); }
      if (stopping_) finish();
    }
    log_.flush();
    return rest;
  }

  void serve() noexcept {
    while (!finished_) serve_once(own_thread_budget, std::chrono::milliseconds(1000));
  }

  void log(LogLevel level, const std::string& message) noexcept {
    try {
      if (const LogCallback sink = log_.sink()) sink(level, message);
    } catch (...) {}
  }
  /// The log callback for threads that do not flush the log themselves.
  LogCallback waking_log() {
    if (!options_.log) return {};
    return [this, sink = log_.sink()](LogLevel level, std::string_view message) {
      sink(level, message);
      wake_io();
    };
  }

  void wake_io() noexcept {
    if (transport_waker_) transport_waker_->wake();
  }

  /// Releases the engine's lock and dispatches its output.
  void pass_on(std::unique_lock<std::mutex>& lock) {
    const auto discarded = engine_.take_discarded();  // is destroyed without the lock
    std::vector<engine::Job> jobs = engine_.take_jobs();
    std::vector<engine::BodyJob> bodies = engine_.take_body_jobs(), queries = engine_.take_query_jobs();
    const std::vector<subscription::ReadyCallback> callbacks = engine_.take_callbacks();
    if (!feeds_.empty()) {
      feeds_.take(engine_.take_new_resources());
      feeds_.see(engine_.structure());
    }
    if (audit_) audit_subscriptions(clock_.now());
    if (saved_)
      if (std::optional<engine::SavedText> saved = engine_.take_saved()) saved_->save(std::move(saved->text), saved->revision);
    lock.unlock();
    if (!jobs.empty()) dispatch(std::move(jobs));
    if (!bodies.empty()) bodies_.put(std::move(bodies));
    if (!queries.empty()) queries_.put(std::move(queries));
    if (deliverer_)
      for (const subscription::ReadyCallback& due : callbacks) deliverer_->notify(due.channel, due.receiver);
    log_.flush();
  }

  /// Waits for the response to a request of a guest. The calling thread handles its deadline, because the host may not poll.
  engine::Reply wait_for_reply(engine::Ticket ticket) {
    std::unique_lock lock(mutex_);
    while (true) {
      if (auto reply = guests_.reply(ticket)) return *std::move(reply);
      const auto now = clock_.now();
      const auto due = engine_.next_deadline();
      if (due && *due <= now.steady) {
        while (auto reply = take_reply(now))
          if (!guests_.take(*reply) && !feeds_.take(*reply)) replies_.push_back(*std::move(reply));
        if (auto reply = guests_.reply(ticket)) return *std::move(reply);
        pass_on(lock);
        wake_io();
        lock.lock();
      }
      guests_.wait(lock, std::chrono::steady_clock::now() + longest_guest_wait);
    }
  }
  static http::Response refused() {
    http::Response response;
    response.status = 503;
    return response;
  }
  static engine::Push closing_push() {
    engine::Push push;
    push.close = 1001;
    return push;
  }

  /// The graphs of a World; those that have a file are restored.
  Result<KeptGraphs::Opened> open_graphs(const Thing& thing) {
    const model::WorldSpec* const world = thing.world();
    return world ? world->hooks.open_files(*world, waking_log(), options_.threads.own) : Result<KeptGraphs::Opened>(KeptGraphs::Opened());
  }
  Result<KeptGraphs::Opened> open_graphs(const std::vector<Thing>& things) {
    KeptGraphs::Opened all;
    for (const Thing& thing : things) {
      Result<KeptGraphs::Opened> opened = open_graphs(thing);
      if (!opened) return opened;
      std::move(opened->begin(), opened->end(), std::back_inserter(all));
    }
    return all;
  }

  /// The file of subscriptions. Another file in its place is an error and is not changed.
  Result<std::optional<SavedFile::Content>> load() {
    const std::size_t max_bytes = std::max<std::size_t>(16 * 1024 * 1024, options_.callbacks.max_callbacks * 32 * 1024);
    const std::string& path = options_.callbacks.file;
    if (path.empty()) return std::optional<SavedFile::Content>();
    Result<SavedFile::Claim> prepared = SavedFile::prepare(path);
    if (!prepared) return not_usable(prepared.error());
    claim_ = *std::move(prepared);
    Result<std::optional<SavedFile::Content>> loaded = SavedFile::load(path, max_bytes);
    if (!loaded) return not_usable(loaded.error());
    return loaded;
  }
  static Unexpected not_usable(const Error& error) { return unexpected(error.code, "callbacks.file: " + error.message); }

  /// A damaged file is restored as far as it can be read. A copy is kept.
  Result<void> restore(const std::optional<SavedFile::Content>& saved) {
    const std::string& path = options_.callbacks.file;
    const bool damaged = saved && saved->state == SavedFile::State::damaged;
    const Result<std::size_t> found = saved && !damaged ? engine_.restore(saved->text) : Result<std::size_t>(0);
    if (saved && saved->state == SavedFile::State::unmarked) {
      // Files of earlier versions have no first line.
      if (!saved->text.empty() && found.value_or(0) == 0)
        return unexpected(
            Errc::invalid_option,
            "callbacks.file: \"" + path + "\": expected a file that lrt wrote, or none; found a file of another program. Choose another path");
      if (saved->text.empty()) log(LogLevel::warning, "the file \"" + path + "\" is empty: no subscription is restored");
    } else if (damaged || !found) {
      const auto [restored, unreadable] = engine_.recover(saved->text);
      const Result<std::string> copy = SavedFile::keep_copy(path);
      log(LogLevel::error, "the file of subscriptions \"" + path + "\" was changed or truncated after lrt wrote it: " + std::to_string(restored) +
                               " subscriptions are restored, " + std::to_string(unreadable) +
                               " parts cannot be read, others may be missing; the file " +
                               (copy ? "is kept as \"" + *copy + "\"" : "could not be kept: " + copy.error().message));
    }
    saved_.emplace(
        path, [this](std::uint64_t revision, bool written) { engine_.saved(revision, written); }, waking_log(), options_.threads.own);
    return {};
  }

  /// Stops: waiting requests get their response, then all connections are closed. Inside the transport.
  void finish() noexcept {
    if (finished_) return;
    try {
      with_engine([&] { engine_.stop(); });
      transport_->stop();
    } catch (...) {}
    if (deliverer_) deliverer_->stop();
    graphs_.stop();
    bodies_.stop();
    queries_.stop();
    const std::lock_guard lock(mutex_);
    while (auto reply = take_reply(clock_.now())) (void)(guests_.take(*reply) || feeds_.take(*reply));
    guests_.notify();
    feeds_.wake_all();
    finished_ = true;
  }
  void wait_until_finished() {
    std::unique_lock lock(mutex_);
    while (!finished_) guests_.wait(lock, std::chrono::steady_clock::now() + longest_guest_wait);
  }

  /// Passes each job to its thread or queue. Without a lock, because user code may call the server.
  void dispatch(std::vector<engine::Job> jobs) {
    bool for_host = false, for_io = false;
    for (engine::Job& job : jobs) try {
        switch (job.where) {
          case Dispatch::io_thread:
            (job.is_stop ? stop_jobs_ : io_jobs_).put(std::move(job.run));
            for_io = true;
            break;
          case Dispatch::executor:
            if (options_.threads.executor) {
              auto shared = std::make_shared<UniqueFunction<void()>>(std::move(job.run));
              options_.threads.executor([shared] { (*shared)(); });
              break;
            }
            [[fallthrough]];
          default: arrived_.put(std::move(job.run)); for_host = true;
        }
      } catch (const std::exception& e) { log(LogLevel::error, std::string("the executor threw: ") + e.what()); }
    if (for_host && options_.threads.io == Io::own_thread) rest_.wake();
    if (!for_io) return;
    if (serving_ == std::this_thread::get_id()) run_io_jobs();
    else wake_io();
  }
  /// On the I/O thread. Jobs run one after the other, never nested, because they may use the same mutex of the user.
  void run_io_jobs() {
    if (runs_io_jobs_) return;
    runs_io_jobs_ = true;
    do {
      run_stop_jobs();
      io_jobs_.take_all([this](UniqueFunction<void()> job) {
        job();
        run_stop_jobs();
      });
    } while (!io_jobs_.empty() || !stop_jobs_.empty());
    runs_io_jobs_ = false;
  }
  /// Ends subscriptions whose right has ended, also without a request.
  void renew_rights(TimePoint now) {
    const auto look = callers_ ? callers_->next_look() : std::nullopt;
    if (look && *look <= now.steady && callers_->have_changed(now)) with_engine([&] { engine_.renew_rights(); });
  }
  void run_stop_jobs() {
    while (!stop_jobs_.empty()) stop_jobs_.take_all([](UniqueFunction<void()> job) { job(); });
  }

  const OwnProcess process_;
  Options options_;
  const Clock& clock_;
  LogQueue log_;
  mutable std::mutex mutex_;                            // guards engine_, guests_, feeds_ and replies_; never held while user code runs
  const std::shared_ptr<security::Sessions> sessions_;  // nullptr: login is disabled
  std::shared_ptr<Callers> callers_;                    ///< nullptr: all callers have all rights
  Counters counters_;
  std::optional<ClientLimiter> limiter_;  ///< set before the transport starts
  std::optional<Audit> audit_;            ///< the same; nullopt: there is no sink. Guarded by mutex_, but for its writer
  engine::Engine engine_;
  BodyPool bodies_, queries_;
  GuestRequests guests_;
  Feeds feeds_;
  std::deque<engine::Reply> replies_;               // of the transport, found by threads of guests
  KeptGraphs graphs_;                               // of Worlds
  SavedFile::Claim claim_;                          // on the path of saved_
  std::optional<SavedFile> saved_;                  // set before the transport starts to be served
  std::unique_ptr<delivery::Deliverer> deliverer_;  // the same
  std::unique_ptr<transport::Transport> transport_;
  std::shared_ptr<Waker> transport_waker_;
  Mailbox<UniqueFunction<void()>> arrived_;    // jobs for the host
  Mailbox<UniqueFunction<void()>> io_jobs_;    // jobs for the thread that does I/O
  Mailbox<UniqueFunction<void()>> stop_jobs_;  // the same, of Action::stop(): before the others
  bool runs_io_jobs_ = false;                  // that thread's
  std::deque<UniqueFunction<void()>> due_;     // taken, not yet run: the host's thread only
  EventWaker rest_;                            // where run() waits when there is nothing to do
  std::atomic<bool> stopping_{false}, finished_{false}, descriptor_is_used_{false};
  std::atomic<std::thread::id> serving_{};  // the thread inside the transport
  std::mutex threads_mutex_;                // guards the threads, not the joining
  Thread io_, runner_, audit_thread_;
};

void Server::End::operator()(Impl* impl) const noexcept {
  impl->stop();
  if (impl->can_be_destroyed()) delete impl;
}

Server::Server(std::unique_ptr<Impl, End> impl) : impl_(std::move(impl)) {}
Server::Server(Server&&) noexcept = default;
Server& Server::operator=(Server&&) noexcept = default;
Server::~Server() = default;

Result<Server> Server::create(Options options) {
  std::unique_ptr<Impl, End> impl(new Impl(std::move(options)));
  if (Result<void> listening = impl->listen(); !listening) return Unexpected{std::move(listening).error()};
  return Server(std::move(impl));
}

Result<void> Server::add(Thing thing) { return impl_->add(std::move(thing)); }
Result<void> Server::add(std::vector<Thing> things) { return impl_->add(std::move(things)); }
Result<void> Server::remove(std::string_view path) { return impl_->remove(path); }
std::chrono::milliseconds Server::poll(std::chrono::microseconds budget) noexcept { return impl_->poll(budget); }
int Server::descriptor() noexcept { return impl_->descriptor(); }
void Server::run() noexcept { impl_->run(); }
void Server::start() { impl_->start(); }
void Server::wake() noexcept { impl_->wake(); }
void Server::stop() noexcept { impl_->stop(); }
Served Server::serve(const http::Request& request) {
  Served served;
  std::optional<engine::Channel> channel;
  served.response = impl_->serve(request, channel);
  if (channel) served.events = EventSource(*impl_, *channel);
  return served;
}
engine::HeaderVerdict Server::judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes) {
  return impl_->judge_header(request, body_bytes);
}
Result<void> Server::reload_tls() { return impl_->reload_tls(); }
EventSource::EventSource(Server::Impl& server, engine::Channel channel) : server_(&server), channel_(channel) {}
EventSource::EventSource(EventSource&& other) noexcept : server_(std::exchange(other.server_, nullptr)), channel_(other.channel_) {}
EventSource& EventSource::operator=(EventSource&& other) noexcept {
  std::swap(server_, other.server_);
  std::swap(channel_, other.channel_);
  return *this;
}
EventSource::~EventSource() {
  if (server_) server_->close_events(channel_);
}
EventSource::Event EventSource::next(std::chrono::milliseconds max_wait) {
  const std::optional<engine::Push> push = server_->next_event(channel_, max_wait);
  if (!push) return {};
  return {push->message, push->close != 0};
}

ServerCounters Server::counters() const { return impl_->counters(); }
std::function<ServerCounters()> Server::counter_source() const {
  return [impl = impl_.get()] { return impl->counters(); };
}

FeedHost& Server::feed_host() noexcept { return *impl_; }

std::uint16_t Server::port() const noexcept { return impl_->port(); }
std::string Server::url() const { return impl_->url(); }

}  // namespace v0
}  // namespace lrt

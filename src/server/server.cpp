// SPDX-License-Identifier: Apache-2.0
#include <lrt/server.hpp>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include <lrt/base/misuse.hpp>
#include <lrt/served.hpp>
#include <lrt/transport/http.hpp>

#include "src/base/client_key.hpp"
#include "src/base/event_waker.hpp"
#include "src/base/thread.hpp"
#include "src/rdf/codecs.hpp"
#include "src/server/counters.hpp"
#include "src/server/feeds.hpp"
#include "src/server/guest_requests.hpp"
#include "src/server/listen_addresses.hpp"
#include "src/server/metric_sources.hpp"
#include "src/server/shared_engine.hpp"
#include "src/server/user_jobs.hpp"

namespace lrt {
inline namespace v0 {

namespace {

constexpr auto forever = std::chrono::milliseconds::max();
/// The time of one turn on lrt's own thread. Deferred responses are sent after it.
constexpr std::chrono::milliseconds own_thread_budget{1};
/// The time of one turn on a loop of the host.
constexpr std::chrono::microseconds host_loop_budget{200};
/// How long poll() says that the host may sleep when another thread had the engine, which wakes the host sooner. Not zero: a loop of a higher priority
/// must not keep that thread from its processor.
constexpr std::chrono::milliseconds refused_rest{1};

}  // namespace

/// The transport of a server, and the loop that drives it. SharedEngine has the rest.
class LRT_LOCAL Server::Impl final : public SharedEngine::Loop {
 public:
  explicit Impl(Options options)
      : options_(std::move(options)), engine_(options_, *this), jobs_(engine_.service<UserJobs>()), counters_(engine_.service<Counters>()) {}

  ~Impl() {
    stop();
    transport_.reset();  // first: a turn on the host's loop may be running
    engine_.clear();
  }

  Result<void> listen() {
    const Turn not_yet(*this);  // on a loop of the host's, turns come as soon as the transport starts
    if (options_.threads.dispatch == Dispatch::executor && !options_.threads.executor)
      return unexpected(Errc::invalid_option, "Dispatch::executor needs Threads::executor");
    if (rest_.descriptor() < 0)
      return unexpected(Errc::io_error, "cannot create an event descriptor for the server: " + std::system_category().message(rest_.error()));
    if (Result<void> prepared = engine_.prepare(); !prepared) return prepared;
    if (Result<void> started = start_transport(); !started) return started;
    transport_waker_ = transport_->waker();
    engine_.engine().set_waker(transport_waker_);
    if (Result<void> started = engine_.start(); !started) return started;
    if (options_.threads.io == Io::in_poll) rdf::prepare_rdf_xml();  // no turn in poll() must wait for that
    if (options_.threads.io == Io::own_thread) {
      Result<Thread> io = start_thread("lrt-io", options_.threads.own, [this] { serve(); });
      if (!io) return Unexpected{std::move(io).error()};
      io_ = *std::move(io);
    }
    return {};
  }

  SharedEngine& engine() noexcept { return engine_; }

  /// False if it must not be destroyed: in a child process, which has none of its threads, and when its destructor runs within one of its functions,
  /// as in exit() called by a lambda.
  bool can_be_destroyed() noexcept {
    if (!engine_.is_own_process() || is_serving() || engine_.is_service_thread() || polling_ == std::this_thread::get_id()) return false;
    const std::lock_guard lock(threads_mutex_);
    return !io_.is_current() && !runner_.is_current();
  }

  std::chrono::milliseconds poll(std::chrono::microseconds budget, bool checks = false) noexcept {
    if (!engine_.is_own_process()) return forever;
    if (is_serving()) return std::chrono::milliseconds(0);  // called by a lambda that the transport's turn runs
    const Polling polling(*this);
    if (!polling.may()) return report_second_poll(checks), std::chrono::milliseconds(1);
    try {
      const auto begin = std::chrono::steady_clock::now();
      const Counters::Poll measured(counters_, begin);
      const auto end = begin + budget;
      const bool serves = options_.threads.io == Io::in_poll;
      std::chrono::milliseconds rest = forever;
      if (!serves && rest_.is_awake()) rest_.clear();
      if (serves) rest = serve_once(budget, std::chrono::milliseconds(0));
      bool ran = false;
      for (bool stopping; stopping = engine_.is_stopping(), jobs_.run_next(stopping);) {
        ran = true;
        if (!stopping && std::chrono::steady_clock::now() >= end) break;
      }
      // The results of the lambdas are sent in the same step.
      if (serves && ran) rest = serve_once(std::chrono::microseconds(0), std::chrono::milliseconds(0));
      if (serves && engine_.was_refused()) rest = refused_rest;
      rest = std::min(rest, jobs_.until_lapse());
      if (jobs_.empty() && rest.count() > 0) return rest;
      if (descriptor_is_used_) wake();  // so that it shows that there is more to do
      return std::chrono::milliseconds(0);
    } catch (...) { return std::chrono::milliseconds(0); }
  }

  void run(bool checks = false) noexcept {
    while (engine_.is_open()) {
      const std::chrono::milliseconds rest = std::min(poll(std::chrono::milliseconds(10), checks), std::chrono::milliseconds(1000));
      if (rest.count() == 0) continue;
      try {
        if (options_.threads.io == Io::in_poll) serve_once(std::chrono::milliseconds(10), rest);
        else rest_.wait(rest);
      } catch (...) {}
    }
    if (engine_.is_own_process()) jobs_.end_lapses_of_host();
  }

  int descriptor() noexcept {
    descriptor_is_used_ = true;
    if (options_.threads.io == Io::own_thread) return rest_.descriptor();
    return transport_ ? transport_->descriptor() : -1;
  }

  void start() {
    if (!engine_.is_own_process()) return;
    if (const Result<void> open = engine_.check_open(); !open)
      throw BadResult({open.error().code, "start(): " + open.error().message + "; a server serves once, so create a new one"});
    const std::lock_guard lock(threads_mutex_);
    if (!runner_.joinable()) runner_ = start_thread("lrt-run", options_.threads.own, [this] { run(); }).value();
  }

  void wake() noexcept {
    if (!engine_.is_own_process()) return;
    if (options_.threads.io == Io::in_poll && transport_waker_) transport_waker_->wake();
    else rest_.wake();
  }

  void stop() noexcept {
    if (!engine_.is_own_process()) return;
    engine_.begin_stop();
    rest_.wake();
    jobs_.end_lapses_of_host();
    if (is_serving()) return;  // from a lambda: the serving thread finishes when it returns
    // Each thread is joined by the first caller, without a lock: a lambda on one of them may be stopping too.
    Thread io, runner;
    {
      const std::lock_guard lock(threads_mutex_);
      if (!io_.is_current()) io = std::move(io_);
      if (!runner_.is_current()) runner = std::move(runner_);
    }
    io.join();
    runner.join();
    if (options_.threads.io == Io::in_poll && transport_) {
      if (const Turn turn(*this); turn) finish();
      else wait_until_finished();  // a turn on another thread executes the stop
    }
    engine_.join();
  }

  Result<void> reload_tls() {
    if (!engine_.is_own_process()) return engine_.check_open();
    return transport_ ? transport_->reload_tls() : unexpected(Errc::closed, "the server does not listen");
  }
  ServerCounters counters() const {
    ServerCounters all;
    if (transport_) all.connections = transport_->connections();
    engine_.count(all);
    return all;
  }
  void sign_out(std::string_view principal) { engine_.sign_out(principal); }
  std::uint16_t port() const noexcept { return transport_ ? transport_->port() : 0; }
  std::string url() const {
    const bool six = options_.listen.address.find(':') != std::string::npos;
    return (options_.security.tls ? "https://" : "http://") + (six ? "[" + options_.listen.address + "]" : options_.listen.address) + ":" +
           std::to_string(port()) + "/";
  }

  // SharedEngine::Loop
  void wake_io() noexcept override {
    if (transport_waker_) transport_waker_->wake();
  }
  void wake_host() noexcept override {
    if (options_.threads.io == Io::own_thread) rest_.wake();
  }
  bool is_serving() const noexcept override { return serving_ == std::this_thread::get_id(); }

 private:
  /// Starts a transport on Listen::address; of a host name, on its first address that the machine has.
  Result<void> start_transport() {
    const std::string& given = options_.listen.address;
    const Result<std::vector<std::string>> resolved = listen_addresses(given);
    Result<void> started;
    for (const std::string& address : resolved ? *resolved : std::vector<std::string>{given}) {
      make_transport(address);
      if (transport_ && transport_->capabilities().network && !resolved) return Unexpected{resolved.error()};
      if (Result<void> checked = check_transport(address); !checked) return checked;
      started = transport_->start(engine_);
      if (!started && started.error().code != Errc::address_in_use) continue;
      if (started) {
        const transport::Capabilities can = transport_->capabilities();
        engine_.engine().listens_on(address, transport_->port(), options_.security.tls.has_value(), address == given ? std::string_view() : given,
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
    t.clock = &engine_.clock();
    t.log = engine_.log_sink();
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
    if (!can.network || is_this_machine(address) || security.tls || engine_.callers() || security.allow_unprotected_network) return {};
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

  /// The host polls: one thread at a time. Its lambdas may poll within that.
  class Polling {
   public:
    explicit Polling(Impl& impl) noexcept : impl_(impl) {
      std::thread::id found;
      begins_ = impl_.polling_.compare_exchange_strong(found, std::this_thread::get_id(), std::memory_order_acquire);
      may_ = begins_ || found == std::this_thread::get_id();
    }
    ~Polling() {
      if (begins_) impl_.polling_.store(std::thread::id(), std::memory_order_release);
    }
    Polling(const Polling&) = delete;
    Polling& operator=(const Polling&) = delete;
    bool may() const noexcept { return may_; }

   private:
    Impl& impl_;
    bool begins_ = false, may_ = false;
  };

  void report_second_poll(bool checks) noexcept {
    constexpr const char* what = "Server::poll() or run() was called while another thread polls, as that of start(): one thread polls a server";
    if (checks) detail::misuse(what);
    if (second_poll_.exchange(true, std::memory_order_relaxed)) return;
    try {
      engine_.log(LogLevel::error, what);
    } catch (...) {}  // out of memory
    engine_.flush_log();
  }

  /// One step of the transport, by one thread at a time. A stop that was requested in the meantime is executed here.
  std::chrono::milliseconds serve_once(std::chrono::microseconds budget, std::chrono::milliseconds wait) {
    std::chrono::milliseconds rest{0};
    {
      const Turn turn(*this);
      if (!turn) return rest;  // a lambda on this thread polls, or another thread does
      if (finished_) return forever;
      try {
        rest = engine_.is_stopping() ? forever : transport_->poll(budget, wait);
      } catch (const std::exception& e) { engine_.log(LogLevel::error, "transport", e); } catch (...) {
      }
      if (engine_.is_stopping()) finish();
    }
    engine_.flush_log();
    return rest;
  }

  void serve() noexcept {
    while (!finished_) serve_once(own_thread_budget, std::chrono::milliseconds(1000));
  }

  /// Stops: waiting requests get their response, then all connections are closed. Inside the transport.
  void finish() noexcept {
    if (finished_) return;
    try {
      engine_.use([this] { engine_.engine().stop(); });
    } catch (...) {}  // without memory for their responses, requests end with their connections
    try {
      transport_->stop();
    } catch (...) {}
    jobs_.end_lapses_of_io();
    try {
      engine_.finish();
    } catch (...) {}
    const std::lock_guard lock(threads_mutex_);
    finished_ = true;
    finished_changed_.notify_all();
  }
  void wait_until_finished() {
    std::unique_lock lock(threads_mutex_);
    finished_changed_.wait(lock, [this] { return finished_.load(); });
  }

  Options options_;
  SharedEngine engine_;
  UserJobs& jobs_;
  Counters& counters_;
  std::unique_ptr<transport::Transport> transport_;
  std::shared_ptr<Waker> transport_waker_;
  EventWaker rest_;  // where run() waits when there is nothing to do
  std::atomic<bool> finished_{false}, descriptor_is_used_{false};
  std::atomic<std::thread::id> serving_{};    // the thread inside the transport
  std::atomic<std::thread::id> polling_{};    // the thread inside poll()
  std::atomic<bool> second_poll_{false};      // was logged
  std::mutex threads_mutex_;                  // guards the threads, not the joining
  std::condition_variable finished_changed_;  // with threads_mutex_
  Thread io_, runner_;
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

namespace {
Unexpected moved_from() { return unexpected(Errc::closed, "the Server was moved from: use the one to which it was moved"); }
void report_moved(bool checks) noexcept {
  if (checks) detail::misuse("poll() or run() of a Server that was moved from: use the one to which it was moved");
}
}  // namespace

Result<void> Server::add(Thing thing) {
  std::vector<Thing> things;
  things.push_back(std::move(thing));
  return add(std::move(things));
}
Result<void> Server::add(std::vector<Thing> things) { return impl_ ? impl_->engine().add(std::move(things)) : moved_from(); }
Result<void> Server::remove(std::string_view path) { return impl_ ? impl_->engine().remove(path) : moved_from(); }
std::chrono::milliseconds Server::poll(std::chrono::microseconds budget, bool checks) noexcept {
  return impl_ ? impl_->poll(budget, checks) : (report_moved(checks), forever);
}
int Server::descriptor() noexcept { return impl_ ? impl_->descriptor() : -1; }
void Server::run(bool checks) noexcept { impl_ ? impl_->run(checks) : report_moved(checks); }
void Server::start() {
  if (!impl_) throw BadResult(moved_from().error);
  impl_->start();
}
void Server::wake() noexcept {
  if (impl_) impl_->wake();
}
void Server::stop() noexcept {
  if (impl_) impl_->stop();
}
SharedEngine& Server::shared_engine() noexcept { return impl_->engine(); }
Served Server::serve(const http::Request& request) {
  Served served;
  if (!impl_) {
    served.response = closed_response();
    return served;
  }
  std::optional<engine::Channel> channel;
  auto& guests = impl_->engine().service<GuestRequests>();
  served.response = guests.serve(request, channel);
  if (channel) served.events = EventSource(guests, *channel);
  return served;
}
engine::HeaderVerdict Server::judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes) {
  if (impl_) return impl_->engine().service<GuestRequests>().judge_header(request, body_bytes);
  engine::HeaderVerdict verdict;
  verdict.response = closed_response();
  return verdict;
}
Result<void> Server::reload_tls() { return impl_ ? impl_->reload_tls() : moved_from(); }
EventSource::EventSource(GuestRequests& guests, engine::Channel channel) : guests_(&guests), channel_(channel) {}
EventSource::EventSource(EventSource&& other) noexcept : guests_(std::exchange(other.guests_, nullptr)), channel_(other.channel_) {}
EventSource& EventSource::operator=(EventSource&& other) noexcept {
  std::swap(guests_, other.guests_);
  std::swap(channel_, other.channel_);
  return *this;
}
EventSource::~EventSource() {
  if (guests_) guests_->close(channel_);
}
EventSource::Event EventSource::next(std::chrono::milliseconds max_wait) {
  const std::optional<engine::Push> push = guests_->next_event(channel_, max_wait);
  if (!push) return {};
  return {push->message, push->close != 0};
}

void Server::sign_out(std::string_view principal) {
  if (impl_) impl_->sign_out(principal);
}
Identity Server::identity() const { return impl_ ? impl_->engine().identity() : Identity(); }
ServerCounters Server::counters() const { return impl_ ? impl_->counters() : ServerCounters(); }
std::function<ServerCounters()> Server::counter_source() const {
  return [impl = impl_.get()] { return impl ? impl->counters() : ServerCounters(); };
}
std::shared_ptr<void> Server::add_metrics(std::function<std::vector<Metric>()> source) {
  return impl_ ? impl_->engine().service<MetricSources>().add(std::move(source)) : nullptr;
}
std::function<std::vector<Metric>()> Server::metric_source() const {
  return [impl = impl_.get()] { return impl ? impl->engine().service<MetricSources>().collect() : std::vector<Metric>(); };
}

Feeds* Server::feeds() noexcept { return impl_ ? &impl_->engine().service<Feeds>() : nullptr; }

std::uint16_t Server::port() const noexcept { return impl_ ? impl_->port() : 0; }
std::string Server::url() const { return impl_ ? impl_->url() : std::string(); }

}  // namespace v0
}  // namespace lrt

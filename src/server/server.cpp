#include <lrt/server.hpp>

#include <atomic>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>

#include <lrt/transport/named.hpp>

#include "src/engine/mailbox.hpp"
#include "src/server/saved_file.hpp"
#include "src/transport/event_waker.hpp"

namespace lrt {

namespace {

constexpr auto forever = std::chrono::milliseconds::max();
/// Of one turn on a loop that the host has other work for, too.
constexpr std::chrono::microseconds host_loop_budget{200};

bool is_loopback(const std::string& address) { return address == "::1" || address.compare(0, 4, "127.") == 0; }

}  // namespace

class Server::Impl final : public engine::Handler, public delivery::Source {
 public:
  explicit Impl(Options options)
      : options_(std::move(options)),
        clock_(options_.engine.clock ? *options_.engine.clock : system_clock()),
        engine_(options_.engine) {}

  ~Impl() override {
    stop();
    transport_.reset();  // first: a turn on the host's loop may be under way
  }

  Result<void> listen() {
    const std::lock_guard not_yet(serve_mutex_);  // on a loop of the host's, turns come as soon as the transport starts
    if (options_.engine.dispatch == Dispatch::executor && !options_.executor)
      return unexpected(Errc::invalid_option, "Dispatch::executor needs Options::executor");
    if (Result<void> checked = engine_.check(); !checked) return checked;
    transport::TransportOptions t;
    t.address = options_.address;
    t.port = options_.port;
    t.limits = options_.limits;
    t.tls = options_.tls;
    t.clock = &clock_;
    t.log = options_.engine.log;
    t.turn = [this] { poll(host_loop_budget); };
    transport_ = options_.transport ? options_.transport(std::move(t)) : transport::make_named({}, std::move(t));
    if (!transport_) return unexpected(Errc::invalid_option, "there is no transport");
    if (transport_->capabilities().on_host_loop && options_.io != Io::in_poll)
      return unexpected(Errc::invalid_option, "the transport lives on a loop of the host's: that needs Io::in_poll");
    descriptor_is_used_ = transport_->capabilities().on_host_loop;
    if (options_.tls && !transport_->capabilities().tls) return unexpected(Errc::invalid_option, "the transport has no TLS");
    if (transport_->capabilities().network && !is_loopback(options_.address) && !options_.tls && !options_.engine.authorize &&
        !options_.allow_unprotected_network)
      return unexpected(Errc::insecure_address, "listening on " + options_.address +
                                                    " lets the network move the robot: set tls, an authorizer, or allow_unprotected_network");
    if (Result<void> started = transport_->start(*this); !started) return started;
    engine_.listens_on(options_.address, transport_->port(), options_.tls.has_value());
    transport_waker_ = transport_->waker();
    engine_.set_waker(transport_waker_);
    if (!options_.subscriptions_file.empty()) restore();
    if (const auto& callbacks = options_.engine.subscriptions.callbacks; !callbacks.allow.empty()) {
      auto made = options_.deliverer ? options_.deliverer(*this, callbacks, options_.engine.log)
                                     : delivery::make_deliverer(*this, callbacks, options_.engine.log);
      if (!made) return Unexpected{std::move(made).error()};
      deliverer_ = *std::move(made);
    }
    if (options_.io == Io::own_thread) io_ = std::thread([this] { serve(); });
    return {};
  }

  /// @param what  a Thing, or several
  template <class Things>
  Result<void> add(Things what) {
    std::unique_lock lock(mutex_);
    if (stopping_) return unexpected(Errc::closed, "the server has stopped");
    Result<void> result = engine_.add(std::move(what));
    pass_on(lock);
    if (transport_waker_) transport_waker_->wake();  // observers of the structure
    return result;
  }
  Result<void> remove(std::string_view path) {
    std::unique_lock lock(mutex_);
    Result<void> result = engine_.remove(path);
    pass_on(lock);
    if (transport_waker_) transport_waker_->wake();
    return result;
  }

  std::chrono::milliseconds poll(std::chrono::microseconds budget) noexcept {
    try {
      const auto end = std::chrono::steady_clock::now() + budget;
      const bool serves = options_.io == Io::in_poll;
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
      // What the lambdas gave goes out in the same step.
      if (serves && ran) rest = serve_once(std::chrono::microseconds(0), std::chrono::milliseconds(0));
      if (due_.empty() && arrived_.empty()) return rest;
      if (descriptor_is_used_) wake();  // so that it shows that there is more to do
      return std::chrono::milliseconds(0);
    } catch (...) {
      return std::chrono::milliseconds(0);
    }
  }

  void run() noexcept {
    while (!stopping_) {
      const std::chrono::milliseconds rest = std::min(poll(std::chrono::milliseconds(10)), std::chrono::milliseconds(1000));
      if (rest.count() == 0) continue;
      try {
        if (options_.io == Io::in_poll) serve_once(std::chrono::milliseconds(10), rest);
        else rest_.wait(rest);
      } catch (...) {
      }
    }
  }

  int descriptor() noexcept {
    descriptor_is_used_ = true;
    if (options_.io == Io::own_thread) return rest_.descriptor();
    return transport_ ? transport_->descriptor() : -1;
  }

  void start() {
    const std::lock_guard lock(threads_mutex_);
    if (!runner_.joinable()) runner_ = std::thread([this] { run(); });
  }

  void wake() noexcept {
    if (options_.io == Io::in_poll && transport_waker_) transport_waker_->wake();
    else rest_.wake();
  }

  void stop() noexcept {
    stopping_ = true;
    rest_.wake();
    if (transport_waker_) transport_waker_->wake();
    const auto me = std::this_thread::get_id();
    if (serving_ == me) return;  // from a lambda: whoever serves finishes when it returns
    // Each thread is joined by the first who comes, without a lock: a lambda on one of them may be stopping too.
    std::thread io, runner;
    {
      const std::lock_guard lock(threads_mutex_);
      if (io_.get_id() != me) io = std::move(io_);
      if (runner_.get_id() != me) runner = std::move(runner_);
    }
    if (io.joinable()) io.join();
    if (runner.joinable()) runner.join();
    if (options_.io == Io::in_poll && transport_) {
      const std::lock_guard lock(serve_mutex_);
      finish();
    }
  }

  Result<void> reload_tls() {
    return transport_ ? transport_->reload_tls() : unexpected(Errc::closed, "the server does not listen");
  }
  std::uint16_t port() const noexcept { return transport_ ? transport_->port() : 0; }
  std::string url() const {
    const bool six = options_.address.find(':') != std::string::npos;
    return (options_.tls ? "https://" : "http://") + (six ? "[" + options_.address + "]" : options_.address) + ":" + std::to_string(port()) + "/";
  }

  // engine::Handler, on the transport's thread
  engine::Outcome handle(const http::Request& request, TimePoint now) override {
    std::unique_lock lock(mutex_);
    engine::Outcome outcome = engine_.handle(request, now);
    pass_on(lock);
    return outcome;
  }
  std::optional<engine::Reply> next_reply(TimePoint now) override {
    std::unique_lock lock(mutex_);
    std::optional<engine::Reply> reply = engine_.next_reply(now);
    pass_on(lock);
    return reply;
  }
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const override {
    const std::lock_guard lock(mutex_);
    return engine_.next_deadline();
  }
  void abandon(engine::Ticket ticket) noexcept override {
    const std::lock_guard lock(mutex_);
    engine_.abandon(ticket);
  }
  std::optional<engine::Channel> next_ready(TimePoint now) override {
    std::unique_lock lock(mutex_);
    const std::optional<engine::Channel> channel = engine_.next_ready(now);
    pass_on(lock);
    return channel;
  }
  std::optional<engine::Push> next_push(engine::Channel channel, TimePoint now) override {
    const std::lock_guard lock(mutex_);
    return engine_.next_push(channel, now);
  }
  void closed(engine::Channel channel) noexcept override {
    const std::lock_guard lock(mutex_);
    engine_.closed(channel);
  }

  // delivery::Source, on the deliverer's threads
  std::optional<subscription::Notice> next_notice(engine::Channel channel) override {
    const std::lock_guard lock(mutex_);
    auto notice = engine_.next_notice(channel, clock_.now());
    if (!notice && transport_waker_) transport_waker_->wake();  // a timer may have been set
    return notice;
  }
  void delivered(engine::Channel channel, subscription::Receipt receipt) noexcept override {
    try {
      std::unique_lock lock(mutex_);
      engine_.delivered(channel, receipt, clock_.now());
      pass_on(lock);
      if (transport_waker_ && receipt.status / 100 != 2) transport_waker_->wake();  // there is a new timer
    } catch (const std::exception& e) {
      log(LogLevel::error, std::string("a receipt could not be taken: ") + e.what());
    }
  }

 private:
  /// One step of the transport, by one thread at a time; a stop that came meanwhile is carried out here.
  std::chrono::milliseconds serve_once(std::chrono::microseconds budget, std::chrono::milliseconds wait) {
    const std::lock_guard lock(serve_mutex_);
    if (finished_) return forever;
    serving_ = std::this_thread::get_id();
    std::chrono::milliseconds rest{0};
    try {
      rest = stopping_ ? forever : transport_->poll(budget, wait);
    } catch (const std::exception& e) {
      log(LogLevel::error, std::string("transport: ") + e.what());
    }
    serving_ = std::thread::id();
    if (stopping_) finish();
    return rest;
  }

  void serve() noexcept {
    while (!finished_) serve_once(std::chrono::milliseconds(100), std::chrono::milliseconds(1000));
  }

  void log(LogLevel level, const std::string& message) const noexcept {
    try {
      if (options_.engine.log) options_.engine.log(level, message);
    } catch (...) {
    }
  }

  /// Sends what the engine has left to where it is to go, and lets go of its lock.
  void pass_on(std::unique_lock<std::mutex>& lock) {
    std::vector<engine::Job> jobs = engine_.take_jobs();
    const std::vector<subscription::Due> callbacks = engine_.take_callbacks();
    if (saved_)
      if (std::optional<std::string> text = engine_.take_saved()) saved_->save(*std::move(text));
    lock.unlock();
    if (!jobs.empty()) dispatch(std::move(jobs));
    if (deliverer_)
      for (const subscription::Due& due : callbacks) deliverer_->notify(due.channel, due.receiver);
  }

  /// Nothing about the file stops the start.
  void restore() {
    constexpr std::size_t most_bytes = 16 * 1024 * 1024;
    const std::string& path = options_.subscriptions_file;
    Result<std::optional<std::string>> text = SavedFile::load(path, most_bytes);
    Result<void> restored;
    if (!text) restored = Unexpected{text.error()};
    else if (*text) restored = engine_.restore(**text);
    if (!restored) {
      const Result<std::string> aside = SavedFile::set_aside(path);
      log(LogLevel::error, "the subscriptions in \"" + path + "\" are lost: " + restored.error().message + "; the file " +
                               (aside ? "is kept as \"" + *aside + "\"" : "could not be set aside: " + aside.error().message));
    }
    saved_.emplace(path, options_.engine.log);
  }

  /// The end: what waits is answered, then everything closes. With serve_mutex_ held.
  void finish() noexcept {
    if (finished_.exchange(true)) return;
    try {
      {
        const std::lock_guard lock(mutex_);
        engine_.stop();
      }
      transport_->stop();
    } catch (...) {
    }
    if (deliverer_) deliverer_->stop();
  }

  /// Sends each job to where it is to run. On the transport's thread, without the engine's lock: user code may call the server.
  void dispatch(std::vector<engine::Job> jobs) {
    bool for_host = false;
    for (engine::Job& job : jobs) try {
      switch (job.where) {
        case Dispatch::io_thread:
          job.run();
          break;
        case Dispatch::executor:
          if (options_.executor) {
            auto shared = std::make_shared<UniqueFunction<void()>>(std::move(job.run));
            options_.executor([shared] { (*shared)(); });
            break;
          }
          [[fallthrough]];
        default:
          arrived_.put(std::move(job.run));
          for_host = true;
      }
    } catch (const std::exception& e) {
      log(LogLevel::error, std::string("the executor threw: ") + e.what());
    }
    if (for_host && options_.io == Io::own_thread) rest_.wake();
  }

  Options options_;
  const Clock& clock_;
  mutable std::mutex mutex_;                              // guards engine_; never held while user code runs
  engine::Engine engine_;
  std::optional<SavedFile> saved_;                        // set before the transport starts to be served
  std::unique_ptr<delivery::Deliverer> deliverer_;        // the same
  std::unique_ptr<transport::Transport> transport_;
  std::shared_ptr<Waker> transport_waker_;
  engine::Mailbox<UniqueFunction<void()>> arrived_;       // jobs for the host
  std::deque<UniqueFunction<void()>> due_;                // taken, not yet run: the host's thread only
  transport::EventWaker rest_;                            // where run() waits when there is nothing to do
  std::atomic<bool> stopping_{false}, finished_{false}, descriptor_is_used_{false};
  std::atomic<std::thread::id> serving_{};                // who is inside the transport
  std::mutex serve_mutex_;                                // one at a time inside the transport
  std::mutex threads_mutex_;                              // guards io_ and runner_, not the joining
  std::thread io_, runner_;
};

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Server::Server(Server&&) noexcept = default;
Server& Server::operator=(Server&&) noexcept = default;
Server::~Server() = default;

Result<Server> Server::create(Options options) {
  auto impl = std::make_unique<Impl>(std::move(options));
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
Result<void> Server::reload_tls() { return impl_->reload_tls(); }
std::uint16_t Server::port() const noexcept { return impl_->port(); }
std::string Server::url() const { return impl_->url(); }

}  // namespace lrt

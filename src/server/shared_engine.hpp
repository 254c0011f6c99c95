// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/options.hpp>
#include <lrt/server_thing.hpp>

#include "src/base/process.hpp"
#include "src/server/callers.hpp"
#include "src/server/client_limiter.hpp"
#include "src/server/engine_lock.hpp"
#include "src/server/log_queue.hpp"
#include "src/server/postponed.hpp"
#include "src/server/service.hpp"

namespace lrt {

/// The engine of a server behind its lock, with the services that get what it hands out. User code never runs under the lock.
///
/// Inside Server::poll() nothing waits for the lock (EngineLock): the functions of engine::Handler do nothing, postpone what they were given, or say that
/// there is nothing yet, and the thread that has the lock wakes the transport when it releases it.
///
/// @par Threads  any, unless a function says more
class SharedEngine final : public engine::Handler {
 public:
  /// The threads that drive a server, as services see them.
  class Loop {
   public:
    /// Wakes the thread that serves the network.
    virtual void wake_io() noexcept = 0;
    /// Wakes the host's thread if it waits in Server::run().
    virtual void wake_host() noexcept = 0;
    /// The calling thread serves the network.
    virtual bool is_serving() const noexcept = 0;

   protected:
    ~Loop() = default;
  };

  /// @param options  must outlive it, as `loop` must
  SharedEngine(const Options& options, Loop& loop);
  ~SharedEngine() override;
  SharedEngine(const SharedEngine&) = delete;
  SharedEngine& operator=(const SharedEngine&) = delete;

  /// What the registrations of a server share.
  struct Scoped {
    std::recursive_mutex mutex;  ///< recursive: a removed Thing may own a registration
    SharedEngine* engine;        ///< guarded; nullptr: it is gone
  };
  const std::shared_ptr<Scoped>& scoped() const noexcept { return scoped_; }

  // Set-up and end.
  /// Checks all options but those of the transport.
  Result<void> prepare();
  /// Starts the services. The engine knows where the server listens.
  Result<void> start();
  /// Destroys the services.
  void clear();
  /// From now on nothing new begins.
  void begin_stop() noexcept;
  /// The connections are closed: the services stop, and the last replies reach them.
  void finish();
  void join() noexcept;
  /// The calling thread belongs to a service and runs user code.
  bool is_service_thread() noexcept;

  // For services.
  const Options& options() const noexcept { return options_; }
  const Clock& clock() const noexcept { return clock_; }
  Loop& loop() const noexcept { return loop_; }
  /// nullptr: all callers have all rights.
  Callers* callers() const noexcept { return callers_.get(); }
  bool is_stopping() const noexcept { return stopping_; }
  bool is_own_process() const noexcept { return process_.is_current(); }
  bool is_open() const noexcept { return is_own_process() && !stopping_; }
  /// @par Errors  closed
  Result<void> check_open() const;
  /// The service of a class, for the public class that is its face.
  /// @pre it is always made
  template <class S>
  S& service() const {
    std::size_t at = 0;
    while (services_[at]->identity() != &S::key) ++at;
    return static_cast<S&>(*services_[at]);
  }

  /// Waits; not for calls inside poll().
  std::unique_lock<EngineLock> lock() const { return std::unique_lock(lock_); }
  /// @pre the lock is held
  engine::Engine& engine() noexcept { return engine_; }
  /// Calls a function with the lock. Then the services get what the engine has handed out. Waits; inside poll() see use_now().
  template <class F>
  std::invoke_result_t<F&> use(F f) {
    std::unique_lock lock(lock_);
    if constexpr (std::is_void_v<std::invoke_result_t<F&>>) {
      f();
      pass_on(lock);
    } else {
      auto result = f();
      pass_on(lock);
      return result;
    }
  }
  /// The same for the thread that serves the network. Inside poll() it does not wait.
  /// @return  false: another thread has the engine; nothing was done, and the transport is woken when it is free
  template <class F>
  bool use_now(F f, TimePoint now) {
    std::unique_lock lock = enter(now);
    if (!lock) return false;
    f();
    pass_on(lock);
    return true;
  }
  /// A call inside poll() found the engine taken, and none has found it free since: the host should not sleep for long.
  bool was_refused() const noexcept { return lock_.was_refused(); }
  /// Releases the lock after the services got what the engine has handed out, and passes on the rest.
  void pass_on(std::unique_lock<EngineLock>& lock);
  /// Ends a channel whose client has gone. What the engine hands out for it is passed on later.
  /// @pre the lock is held
  void close(engine::Channel channel) noexcept;

  /// Finds the caller of a request, and whether that client sends too much. Each request is counted once: when its header section is checked. Calls
  /// user code.
  Result<engine::Caller> admit(const http::Request& request, bool has_body, TimePoint now);
  Result<engine::Caller> admit(const http::Request& request, TimePoint now) { return admit(request, !request.body.empty(), now); }
  /// @pre the lock is held
  engine::Outcome handle(const http::Request& request, const Result<engine::Caller>& caller, TimePoint now);
  /// Engine::robot_time() of now.
  std::string robot_time() const { return engine_.robot_time(clock_.now()); }
  /// Distributes the replies that are ready; those of the transport are kept for next_reply().
  /// @pre the lock is held
  void collect_replies(TimePoint now);

  /// Ends the wait of responses that observers keep and that are due. For a thread of a host that does not poll.
  /// @pre the lock is held
  void end_waits(TimePoint now) noexcept;
  /// A response that an observer had kept. Wake the thread that serves the network afterwards.
  /// @pre the lock is held
  void reply(engine::Reply reply);

  /// The log function for parts that run in a turn or with the lock.
  LogCallback log_sink() { return log_.sink(); }
  /// The log function for threads that do not flush the log themselves.
  LogCallback waking_log();
  void log(LogLevel level, const std::string& message) noexcept;
  /// "what: why". For handlers of exceptions, which must not throw when memory is exhausted: the message is made here, or lost.
  void log(LogLevel level, const char* what, const std::exception& why) noexcept;
  void flush_log() noexcept { log_.flush(); }

  // Things and numbers.
  Result<void> add(std::vector<Thing> things);
  /// @param handles  of the thing; nullptr: of any
  Result<void> remove(std::string_view path, const model::HandleContext* handles = nullptr);
  /// Server::identity()
  Identity identity() const;
  /// Server::sign_out()
  void sign_out(std::string_view principal);
  /// Inside poll(), while another thread has the engine, its counts are those of the last call there.
  void count(ServerCounters& all) const;

  // engine::Handler, on the transport's thread.
  engine::HeaderVerdict judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes, TimePoint now) override;
  bool is_stop(const http::Request& request) noexcept override;
  engine::Outcome handle(const http::Request& request, TimePoint now) override;
  const http::Fields* common_fields(TimePoint now) override;
  std::optional<engine::Reply> next_reply(TimePoint now) override;
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const override;
  void abandon(engine::Ticket ticket) noexcept override;
  void input_ended(engine::Ticket ticket) noexcept override;
  std::optional<engine::Channel> next_ready(TimePoint now) override;
  std::optional<engine::Push> next_push(engine::Channel channel, TimePoint now) override;
  void take_ready(std::vector<engine::ReadyChannel>& channels, TimePoint now) override;
  void take_pushes(std::vector<engine::PushRequest>& requests, std::vector<engine::Push>& pushes, TimePoint now) override;
  void closed(engine::Channel channel) noexcept override;

 private:
  engine::EngineOptions engine_options();
  void take() noexcept;
  std::optional<engine::Reply> take_reply(TimePoint now);
  /// The calling thread is inside poll(), where nothing waits for a lock that others have.
  bool never_waits() const noexcept { return options_.threads.io == Io::in_poll && !stopping_ && loop_.is_serving(); }
  std::unique_lock<EngineLock> try_lock() const;
  std::unique_lock<EngineLock> enter(TimePoint now);
  void hand_over_postponed(TimePoint now);
  bool hand_over(Postponed::Request& waiting, TimePoint now) noexcept;
  engine::Caller find_caller(const http::Request& header);
  engine::Outcome postpone(const http::Request& request, const Result<engine::Caller>& caller);
  template <class F>
  void end(Postponed::End what, F f) noexcept;
  void report_ends(const std::vector<Postponed::End>& ends) noexcept;
  void take_pushes_for(std::chrono::microseconds time, std::vector<engine::PushRequest>& requests, std::vector<engine::Push>& pushes, TimePoint now);
  void abandon_in_engine(engine::Ticket ticket) noexcept;
  template <class F>
  void observe(F f) noexcept {
    for (RequestObserver* observer : observers_) try {
        f(*observer);
      } catch (...) { observer->dropped(); }
  }
  template <class Claimed>
  bool is_claimed(Claimed& claimed) {
    for (Receiver* receiver : receivers_)
      if (receiver->claim(claimed)) return true;
    return false;
  }

  const OwnProcess process_;
  const Options& options_;
  const Clock& clock_;
  Loop& loop_;
  LogQueue log_;
  mutable EngineLock lock_;  ///< guards the engine and what services do in functions that are called with the lock; never held while user code runs
  const std::shared_ptr<security::Sessions> sessions_;  ///< nullptr: nobody can log in
  std::shared_ptr<Callers> callers_;                    ///< set by prepare()
  std::optional<ClientLimiter> limiter_;                ///< the same
  engine::Engine engine_;
  engine::Outputs outputs_;                   ///< taken from the engine and not passed on yet
  bool has_outputs_ = false;                  ///< there may be something in outputs_
  std::deque<engine::Reply> replies_;         ///< of the transport, found by other threads
  Postponed postponed_;                       ///< inside poll(), while another thread has the engine
  std::vector<engine::Channel> not_asked_;    ///< have a push that was asked for while another thread had the engine; of the thread in poll()
  mutable engine::EngineCounts last_counts_;  ///< of count() inside poll(); of the thread in poll()
  std::atomic<bool> stopping_{false};
  std::vector<std::unique_ptr<Service>> services_;
  std::vector<TurnWork*> turn_works_;
  std::vector<Receiver*> receivers_;
  std::vector<RequestObserver*> observers_;
  std::vector<ThingKeeper*> keepers_;
  const std::shared_ptr<Scoped> scoped_;
};

/// The response of a server that does not handle requests any more.
http::Response closed_response();

}  // namespace lrt

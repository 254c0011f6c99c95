// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/base/waker.hpp>
#include <lrt/engine/engine.hpp>

#include "src/base/mailbox.hpp"

namespace lrt::engine {

/// The Error of an exception. If memory is exhausted, the message is short enough to need no allocation.
inline Error thrown(const char* what) noexcept {
  try {
    return {Errc::failed, std::string("it threw: ") + what};
  } catch (...) { return {Errc::failed, "out of memory"}; }
}

/// Calls user code. An exception becomes an Error.
template <class T, class F>
Result<T> guarded(F f) noexcept {
  try {
    return f();
  } catch (const BadResult& e) { return Unexpected{e.error()}; } catch (const std::exception& e) {
    return Unexpected{thrown(e.what())};
  } catch (...) { return Unexpected{thrown("an exception that is not a std::exception")}; }
}

/// Decides between running a call and cancelling it: one of the two happens, never both.
class CancelToken {
 public:
  /// The call runs now. False: it was cancelled.
  bool take() noexcept { return state_.exchange(taken, std::memory_order_acq_rel) == open; }
  /// The call runs or has run.
  bool is_taken() const noexcept { return state_.load(std::memory_order_acquire) == taken; }
  /// True: the call will not run. False: it runs or has run.
  bool cancel() noexcept {
    std::uint8_t expected = open;
    return state_.compare_exchange_strong(expected, cancelled, std::memory_order_acq_rel);
  }

 private:
  static constexpr std::uint8_t open = 0, taken = 1, cancelled = 2;
  std::atomic<std::uint8_t> state_{open};
};

/// A message of another thread, which the engine runs later.
using Message = UniqueFunction<void(TimePoint)>;

/// Where other threads leave messages for the engine. Shared: it may outlive the engine, and then messages are never read.
class Inbox {
 public:
  /// Any thread.
  void put(Message message) { put(reserve(std::move(message))); }
  /// Adds a message whose memory is already allocated. This also works when memory is exhausted.
  using Reserved = Mailbox<Message>::Reserved;
  static Reserved reserve(Message message) { return Mailbox<Message>::reserve(std::move(message)); }
  void put(Reserved message) noexcept {
    messages_.put(std::move(message));
    if (const auto w = std::atomic_load(&waker_)) w->wake();
  }
  void set_waker(std::shared_ptr<Waker> w) { std::atomic_store(&waker_, std::move(w)); }
  bool empty() const noexcept { return messages_.empty(); }
  /// Runs the messages in order. An exception in one does not prevent the others.
  /// @return the last error; empty: none
  std::string run_all(TimePoint now) {
    std::string failed;
    messages_.take_all([now, &failed](Message message) noexcept {
      try {
        message(now);
      } catch (const std::exception& e) { keep(failed, e.what()); }
    });
    return failed;
  }

 private:
  static void keep(std::string& text, const char* what) noexcept {
    try {
      text = what;
    } catch (...) { text = "no memory"; }  // short enough for a string without memory
  }

  Mailbox<Message> messages_;
  std::shared_ptr<Waker> waker_;
};

/// A message that a job leaves when it has run, or when it is destroyed without: memory may end between the engine and the thread of the job, and what
/// waits for the message must not wait for ever.
class Owed {
 public:
  Owed(std::shared_ptr<Inbox> inbox, Inbox::Reserved message) noexcept : inbox_(std::move(inbox)), message_(std::move(message)) {}
  Owed(Owed&&) noexcept = default;
  Owed(const Owed&) = delete;
  Owed& operator=(const Owed&) = delete;
  ~Owed() { leave(); }
  void leave() noexcept {
    if (message_) inbox_->put(std::move(message_));
  }

 private:
  std::shared_ptr<Inbox> inbox_;
  Inbox::Reserved message_;
};

/// All calls of user code. A call becomes a Job, which runs as its Dispatch says, without any lock of lrt; its result
/// comes back as a message that the engine runs.
///
/// @par Threads  The engine's. Jobs run on any thread.
class HostCalls {
 public:
  /// @param max_open  calls that wait for the host; more: overloaded()
  HostCalls(Dispatch dispatch, std::size_t max_open) : dispatch_(dispatch), max_open_(max_open) {}

  /// Calls `work`, a callable of Result<T>(), and then `done` of (Result<T>, TimePoint) on the engine's thread. If the call is
  /// cancelled before it begins, `done` gets Errc::cancelled; if its job is destroyed without having run, Errc::unavailable.
  template <class T, class Work, class Done>
  std::shared_ptr<CancelToken> call(Dispatch where, Work work, Done done) {
    // The memory for the result is allocated before the call.
    struct Call {
      CancelToken token;
      Result<T> result = unexpected(Errc::cancelled, "the call was cancelled");
      Done done;
      bool is_handed_out = false;  ///< else call() has thrown, and its caller knows
      bool has_run = false;
      explicit Call(Done d) : done(std::move(d)) {}
    };
    auto call = std::make_shared<Call>(std::move(done));
    Inbox::Reserved reply = Inbox::reserve([call](TimePoint now) {
      if (!call->is_handed_out) return;
      if (!call->has_run) call->result = unexpected(Errc::unavailable, "it was not run");  // short enough to need no memory
      call->done(std::move(call->result), now);
    });
    run(where, [call, reply = Owed(inbox_, std::move(reply)), work = std::move(work)]() mutable {
      call->has_run = true;
      if (call->token.take()) call->result = guarded<T>([&]() -> Result<T> { return work(); });
      reply.leave();
    });
    call->is_handed_out = true;
    return {call, &call->token};
  }
  /// Runs a job that never throws and posts its own messages.
  void run(Dispatch where, UniqueFunction<void()> job, bool is_stop = false) {
    std::shared_ptr<void> counted;
    if (waits_for_host(where)) {
      ++*open_;
      counted = std::shared_ptr<void>(nullptr, [open = open_](void*) { --*open; });  // calls that also if it throws
    }
    jobs_.push_back(
        {where == Dispatch::as_server ? dispatch_ : where, [job = std::move(job), counted = std::move(counted)]() mutable { job(); }, is_stop});
  }

  /// Where a call runs: not Dispatch::as_server.
  Dispatch resolved(Dispatch where) const noexcept { return where == Dispatch::as_server ? dispatch_ : where; }
  /// False: the I/O thread runs the call, however busy the host is.
  bool waits_for_host(Dispatch where) const noexcept { return (where == Dispatch::as_server ? dispatch_ : where) != Dispatch::io_thread; }
  /// True if too many calls are waiting for the host to poll.
  std::size_t open() const noexcept { return *open_; }
  bool overloaded(Dispatch where = Dispatch::in_poll) const noexcept { return waits_for_host(where) && *open_ >= max_open_; }
  const std::shared_ptr<Inbox>& inbox() const noexcept { return inbox_; }
  std::vector<Job> take_jobs() { return std::exchange(jobs_, {}); }

 private:
  const Dispatch dispatch_;
  const std::size_t max_open_;
  const std::shared_ptr<Inbox> inbox_ = std::make_shared<Inbox>();
  const std::shared_ptr<std::atomic<std::size_t>> open_ = std::make_shared<std::atomic<std::size_t>>(0);  ///< not run and not destroyed
  std::vector<Job> jobs_;
};

}  // namespace lrt::engine

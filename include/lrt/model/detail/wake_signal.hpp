// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/waker.hpp>

namespace lrt::model {
inline namespace v0 {

/// Wakes the engine if it sleeps; costs one atomic load while it is awake. Urgent signals always wake it. Many threads
/// signal, one thread sleeps.
///
/// The engine scans for changes periodically. Before it stops, it calls sleep() and scans once more. A change made
/// after that scan finds asleep() true. Each side stores its own flag and then loads the flag of the other side; all
/// four operations are sequentially consistent, so at least one side sees the other.
class WakeSignal {
 public:
  /// @par Threads  Any.
  /// @par Time     Wait-free, no allocation. One system call if the engine sleeps; only the first of several concurrent
  ///               calls makes it.
  void signal() noexcept {
    if (!asleep_.load(std::memory_order_seq_cst) || !asleep_.exchange(false, std::memory_order_seq_cst)) return;
    if (Waker* waker = waker_.load(std::memory_order_acquire)) waker->wake();
  }

  /// Requests a scan at once.
  /// @par Threads  Any.
  /// @par Time     Wait-free, no allocation. One system call, unless one before it has not been noticed yet.
  void signal_urgently() noexcept {
    urgent_.store(true, std::memory_order_release);
    asleep_.store(false, std::memory_order_seq_cst);
    if (Waker* waker = waker_.load(std::memory_order_acquire)) waker->wake();
  }

  // For the engine.
  bool is_urgent() const noexcept { return urgent_.load(std::memory_order_acquire); }
  /// Resets is_urgent(). Call it before the scan.
  void take_urgent() noexcept { urgent_.exchange(false, std::memory_order_acq_rel); }
  void sleep() noexcept { asleep_.store(true, std::memory_order_seq_cst); }
  void stay_awake() noexcept { asleep_.store(false, std::memory_order_seq_cst); }
  bool asleep() const noexcept { return asleep_.load(std::memory_order_seq_cst); }
  /// Sets the waker that signal() calls. Every waker is kept until the WakeSignal is destroyed: a concurrent signal()
  /// may still use it.
  void set_waker(std::shared_ptr<Waker> waker) {
    const std::lock_guard lock(mutex_);
    wakers_.push_back(std::move(waker));
    waker_.store(wakers_.back().get(), std::memory_order_release);
  }

 private:
  std::atomic<bool> asleep_{false}, urgent_{false};
  std::atomic<Waker*> waker_{nullptr};
  std::mutex mutex_;  // guards wakers_
  std::vector<std::shared_ptr<Waker>> wakers_;
};

/// A value of the robot that can change. It signals the engine while it is observed.
class LRT_API ChangeSource {
 public:
  virtual ~ChangeSource() = default;

  // For the engine.
  void attach(std::shared_ptr<WakeSignal> wake_signal) { attached_ = std::move(wake_signal); }
  /// Each change wakes the engine. Call before the first.
  void set_urgent() noexcept { urgent_ = true; }
  bool is_urgent() const noexcept { return urgent_; }
  /// @pre attach() was called, if `observed`
  void set_observed(bool observed) noexcept { wake_signal_.store(observed ? attached_.get() : nullptr, std::memory_order_seq_cst); }

 protected:
  void signal() noexcept {
    if (WakeSignal* wake_signal = wake_signal_.load(std::memory_order_seq_cst)) urgent_ ? wake_signal->signal_urgently() : wake_signal->signal();
  }

 private:
  std::shared_ptr<WakeSignal> attached_;
  std::atomic<WakeSignal*> wake_signal_{nullptr};
  bool urgent_ = false;
};

/// A flag that the host sets: PulledProperty::changed() requests that a property is read again, Action::available()
/// that the availability of the actions is read.
class LRT_API ChangeSignal final : public ChangeSource {
 public:
  /// Any thread; wait-free.
  void changed() noexcept {
    changed_.store(true, std::memory_order_seq_cst);
    signal();
  }
  bool has_change() const noexcept { return changed_.load(std::memory_order_seq_cst); }
  bool take() noexcept { return changed_.exchange(false, std::memory_order_seq_cst); }

 private:
  std::atomic<bool> changed_{false};
};

}  // namespace v0
}  // namespace lrt::model

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>
#include <utility>

#include <lrt/base/unique_function.hpp>

namespace lrt {

/// A mutex with one user that never waits for it: the thread inside Server::poll(). It tries; if another thread has the lock, that thread calls
/// `when_free` after it has released it, so the wake cannot be lost, whichever of them was preempted meanwhile.
///
/// The user that never waits must not starve either. Whoever takes the lock after it was refused leaves it the first turn, for at most `courtesy`: a host
/// that does not poll delays others once for each refusal.
///
/// @par Threads  Any. try_lock(): one at a time.
class EngineLock {
 public:
  /// How long others leave the first turn to a user that was refused.
  static constexpr std::chrono::milliseconds courtesy{10};

  /// @param when_free  called without the lock; must not throw
  explicit EngineLock(UniqueFunction<void()> when_free) : when_free_(std::move(when_free)) {}
  EngineLock(const EngineLock&) = delete;
  EngineLock& operator=(const EngineLock&) = delete;

  /// Waits.
  void lock() {
    if (was_refused()) give_way();
    mutex_.lock();
  }
  /// Does not wait. False: another thread has the lock, and `when_free` will be called.
  bool try_lock() noexcept {
    if (mutex_.try_lock()) return entered();
    refused_.store(std::this_thread::get_id(), std::memory_order_relaxed);
    // Either the exchange in unlock() comes later and finds true; or it came before, and what it has released is seen here.
    tell_.exchange(true, std::memory_order_acq_rel);
    return mutex_.try_lock() && entered();
  }
  void unlock() {
    mutex_.unlock();
    if (tell_.exchange(false, std::memory_order_acq_rel)) when_free_();
  }
  /// try_lock() has failed and has not succeeded since.
  bool was_refused() const noexcept { return refused_.load(std::memory_order_relaxed) != std::thread::id(); }

 private:
  bool entered() noexcept {
    if (was_refused()) refused_.store(std::thread::id(), std::memory_order_relaxed);
    return true;
  }
  void give_way() noexcept {
    constexpr std::chrono::microseconds step{100};
    std::thread::id refused = refused_.load(std::memory_order_relaxed);
    if (refused == std::this_thread::get_id()) return;  // it may wait now, because it is not in poll()
    for (auto waited = step; waited <= courtesy && refused != std::thread::id(); waited += step) {
      std::this_thread::sleep_for(step);
      refused = refused_.load(std::memory_order_relaxed);
    }
    if (refused != std::thread::id()) refused_.compare_exchange_strong(refused, std::thread::id(), std::memory_order_relaxed);
  }

  std::mutex mutex_;
  std::atomic<bool> tell_{false};           ///< the next unlock() calls when_free_
  std::atomic<std::thread::id> refused_{};  ///< who was refused last and has not come in since
  UniqueFunction<void()> when_free_;
};

}  // namespace lrt

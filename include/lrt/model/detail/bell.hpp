#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include <lrt/base/waker.hpp>

namespace lrt::model {

/// Wakes the engine when it sleeps, and costs a load when it does not. Many ring, one listens.
///
/// The listener looks for news by itself while there is some; before it sleeps it says so, and looks once more. Whoever leaves news
/// after that look finds it asleep. (Both sides store, then load the other's word, all sequentially consistent: one of them sees.)
class Bell {
 public:
  /// Wait-free, no allocation; a system call only if the listener sleeps, and then only for the first who rings.
  void ring() noexcept {
    if (!asleep_.load(std::memory_order_seq_cst) || !asleep_.exchange(false, std::memory_order_seq_cst)) return;
    if (Waker* waker = waker_.load(std::memory_order_acquire)) waker->wake();
  }

  // The listener's.
  void sleep() noexcept { asleep_.store(true, std::memory_order_seq_cst); }
  void stay_awake() noexcept { asleep_.store(false, std::memory_order_seq_cst); }
  bool asleep() const noexcept { return asleep_.load(std::memory_order_seq_cst); }
  /// Each waker lives as long as the bell: somebody may be ringing.
  void set_waker(std::shared_ptr<Waker> waker) {
    const std::lock_guard lock(mutex_);
    wakers_.push_back(std::move(waker));
    waker_.store(wakers_.back().get(), std::memory_order_release);
  }

 private:
  std::atomic<bool> asleep_{false};
  std::atomic<Waker*> waker_{nullptr};
  std::mutex mutex_;  // guards wakers_
  std::vector<std::shared_ptr<Waker>> wakers_;
};

/// What may have news for the engine, and rings while somebody observes it.
class NewsSource {
 public:
  virtual ~NewsSource() = default;

  // The engine's.
  void attach(std::shared_ptr<Bell> bell) { keeper_ = std::move(bell); }
  /// @pre attached, for `observed`
  void set_observed(bool observed) noexcept { bell_.store(observed ? keeper_.get() : nullptr, std::memory_order_seq_cst); }

 protected:
  void ring() noexcept {
    if (Bell* bell = bell_.load(std::memory_order_seq_cst)) bell->ring();
  }

 private:
  std::shared_ptr<Bell> keeper_;
  std::atomic<Bell*> bell_{nullptr};
};

/// By which the host says that a pulled property should be read again.
class ChangeSignal final : public NewsSource {
 public:
  /// Any thread; wait-free.
  void changed() noexcept {
    changed_.store(true, std::memory_order_seq_cst);
    ring();
  }
  bool has_news() const noexcept { return changed_.load(std::memory_order_seq_cst); }
  bool take() noexcept { return changed_.exchange(false, std::memory_order_seq_cst); }

 private:
  std::atomic<bool> changed_{false};
};

}  // namespace lrt::model

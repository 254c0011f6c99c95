#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <utility>

#include <lrt/base/clock.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::model {

/// The latest value of a pushed property on its way from the control loop to the engine. One writer, one reader.
class SlotBase {
 public:
  using Utc = std::chrono::system_clock::time_point;
  virtual ~SlotBase() = default;

  /// True if take() would give something new. Any thread.
  bool has_news() const noexcept { return news_.load(std::memory_order_acquire); }
  /// The newest value not yet taken, and since when it is what it is. The reader's thread.
  virtual bool take(rdf::Value& value, Utc& since) = 0;
  /// Makes the next publish count as a change even if it repeats the last value. Any thread.
  void forget() noexcept { forgotten_.store(true, std::memory_order_release); }
  void set_clock(const Clock& clock) noexcept { clock_.store(&clock, std::memory_order_release); }
  void set_every_sample() noexcept { every_sample_.store(true, std::memory_order_relaxed); }
  bool every_sample() const noexcept { return every_sample_.load(std::memory_order_relaxed); }

 protected:
  bool repeats_count() noexcept {
    return every_sample_.load(std::memory_order_relaxed) ||
           (forgotten_.load(std::memory_order_relaxed) && forgotten_.exchange(false, std::memory_order_acquire));
  }
  Utc now() const noexcept { return clock_.load(std::memory_order_acquire)->utc(); }

  std::atomic<bool> news_{false};

 private:
  std::atomic<bool> forgotten_{false}, every_sample_{false};
  std::atomic<const Clock*> clock_{&system_clock()};
};

/// Trivially copyable values: three cells, of which the writer and the reader own one each and exchange the third. Wait-free on
/// both sides; publish neither allocates nor locks nor makes a system call.
template <class T, bool = std::is_trivially_copyable_v<T>>
class Slot final : public SlotBase {
 public:
  Slot() { rdf::traits<T>::type(); }  // made here, so that the first publish does not make it

  void publish(const T& value) noexcept {
    if (published_ && rdf::traits<T>::same(last_, value) && !repeats_count()) return;
    last_ = value;
    published_ = true;
    Cell& cell = cells_[back_];
    cell.value = value;
    cell.since = now();
    back_ = middle_.exchange(back_ | fresh, std::memory_order_acq_rel) & index;
    news_.store(true, std::memory_order_release);
  }

  bool take(rdf::Value& value, Utc& since) override {
    if (!news_.exchange(false, std::memory_order_acq_rel)) return false;
    if (!(middle_.load(std::memory_order_relaxed) & fresh)) return false;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & index;
    value = rdf::traits<T>::encode(cells_[front_].value);
    since = cells_[front_].since;
    return true;
  }

 private:
  static constexpr std::uint8_t index = 3, fresh = 4;
  struct Cell {
    T value{};
    Utc since{};
  };
  T last_{};                 // the writer's
  bool published_ = false;   // the writer's
  std::uint8_t back_ = 0;    // the writer's
  std::uint8_t front_ = 1;   // the reader's
  std::atomic<std::uint8_t> middle_{2};
  Cell cells_[3];
};

/// Values that own memory travel in a node of their own: publish allocates but never waits.
template <class T>
class Slot<T, false> final : public SlotBase {
 public:
  ~Slot() override { delete newest_.load(std::memory_order_relaxed); }

  void publish(const T& value) noexcept {
    try {
      if (last_ && rdf::traits<T>::same(*last_, value) && !repeats_count()) return;
      auto cell = std::make_unique<Cell>(Cell{value, now()});
      last_ = std::make_unique<T>(value);
      delete newest_.exchange(cell.release(), std::memory_order_acq_rel);
      news_.store(true, std::memory_order_release);
    } catch (...) {  // out of memory: the last value stays
    }
  }

  bool take(rdf::Value& value, Utc& since) override {
    news_.store(false, std::memory_order_relaxed);
    const std::unique_ptr<Cell> cell(newest_.exchange(nullptr, std::memory_order_acq_rel));
    if (!cell) return false;
    value = rdf::traits<T>::encode(cell->value);
    since = cell->since;
    return true;
  }

 private:
  struct Cell {
    T value;
    Utc since;
  };
  std::unique_ptr<T> last_;  // the writer's
  std::atomic<Cell*> newest_{nullptr};
};

}  // namespace lrt::model

#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/model/detail/wake_signal.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::model {

/// Passes the latest value of a pushed property from the control loop to the engine. One writer, one reader.
class SlotBase : public ChangeSource {
 public:
  using Utc = std::chrono::system_clock::time_point;

  /// True if take() would return a value. Any thread.
  bool has_change() const noexcept { return (middle_.load(std::memory_order_seq_cst) & fresh) != 0; }
  /// Takes the next value and the time of its publish(): the oldest of those that keep() keeps, else the newest. For the reader.
  /// @return  false: every value has been taken
  virtual bool take(rdf::Value& value, Utc& since) = 0;
  /// How many values were dropped because the ring of keep() was full. For the reader.
  virtual std::uint64_t lost() const noexcept = 0;
  /// Keeps up to `samples` values, so that the reader can take each. Call before the first publish().
  virtual void keep(std::size_t samples) = 0;
  virtual bool keeps() const noexcept = 0;
  /// Enables whole(). Call before the first publish().
  virtual void hold() = 0;
  /// The T that was taken last; null without hold(). For the reader.
  virtual std::shared_ptr<const void> whole() const noexcept = 0;

  /// Makes the next publish() count as a change even if it repeats the last value. Any thread.
  void forget() noexcept { forgotten_.store(true, std::memory_order_release); }
  void set_clock(const Clock& clock) noexcept { clock_.store(&clock, std::memory_order_release); }
  void set_every_sample() noexcept { every_sample_.store(true, std::memory_order_relaxed); }
  bool every_sample() const noexcept { return every_sample_.load(std::memory_order_relaxed); }

 protected:
  static constexpr std::uint8_t index = 3, fresh = 4;

  bool repeats_count() noexcept {
    return every_sample_.load(std::memory_order_relaxed) ||
           (forgotten_.load(std::memory_order_relaxed) && forgotten_.exchange(false, std::memory_order_acquire));
  }
  Utc now() const noexcept { return clock_.load(std::memory_order_acquire)->utc(); }

  /// Bit `fresh`: a value can be taken. The other bits, with three cells: the index of the cell that neither side owns.
  std::atomic<std::uint8_t> middle_{2};

 private:
  std::atomic<bool> forgotten_{false}, every_sample_{false};
  std::atomic<const Clock*> clock_{&system_clock()};
};

/// A published value with its sequence number.
template <class T>
struct Sample {
  T value{};
  std::chrono::system_clock::time_point since{};
  std::uint64_t number = 0;
};

/// A ring of values in the order of publication. A value that does not fit is dropped. Wait-free: one writer, one reader.
template <class T>
class SampleRing {
 public:
  explicit SampleRing(std::size_t size) : cells_(size + 1) {}

  void put(const Sample<T>& sample) {
    const std::size_t at = end_.load(std::memory_order_relaxed), next = at + 1 == cells_.size() ? 0 : at + 1;
    if (next == begin_.load(std::memory_order_acquire)) {
      lost_.store(lost_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
      return;
    }
    cells_[at] = sample;
    end_.store(next, std::memory_order_release);
  }
  bool take(Sample<T>& sample) {
    const std::size_t at = begin_.load(std::memory_order_relaxed);
    if (at == end_.load(std::memory_order_acquire)) return false;
    sample = std::move(cells_[at]);
    begin_.store(at + 1 == cells_.size() ? 0 : at + 1, std::memory_order_release);
    return true;
  }
  std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

 private:
  std::vector<Sample<T>> cells_;
  std::atomic<std::size_t> begin_{0}, end_{0};
  std::atomic<std::uint64_t> lost_{0};
};

/// The common part of both slots: sequence numbers and the ring of keep().
template <class T>
class KeepingSlot : public SlotBase {
 public:
  std::uint64_t lost() const noexcept final { return ring_ ? ring_->lost() : 0; }
  void keep(std::size_t samples) final { ring_ = std::make_unique<SampleRing<T>>(samples); }
  bool keeps() const noexcept final { return ring_ != nullptr; }
  void hold() final { holds_ = true; }
  std::shared_ptr<const void> whole() const noexcept final { return whole_; }

 protected:
  bool take_kept(rdf::Value& value, Utc& since) {
    if (!ring_) return false;
    Sample<T> sample;
    while (ring_->take(sample)) {
      if (sample.number <= taken_) continue;  // has been taken as the newest
      give(sample, value, since);
      return true;
    }
    return false;
  }
  /// Takes the newest value, unless it was taken from the ring.
  bool take_newest(const Sample<T>& sample, rdf::Value& value, Utc& since) {
    if (sample.number <= taken_) return false;
    give(sample, value, since);
    return true;
  }

  std::unique_ptr<SampleRing<T>> ring_;
  std::uint64_t number_ = 0;  // used by the writer

 private:
  void give(const Sample<T>& sample, rdf::Value& value, Utc& since) {
    value = rdf::traits<T>::encode(sample.value);
    if (holds_) whole_ = std::make_shared<const T>(sample.value);
    since = sample.since;
    taken_ = sample.number;
  }
  std::uint64_t taken_ = 0;  // used by the reader
  std::shared_ptr<const T> whole_;
  bool holds_ = false;
};

/// For types that own no memory: numbers, structs and arrays of such types, fixed sizes of Eigen. The criterion is a trivial destructor,
/// because Eigen's fixed sizes are not trivially copyable, although copying them does no more.
///
/// There are three cells. The writer and the reader own one each and exchange the third. Both sides are wait-free. publish() does not
/// allocate or lock. It makes a system call only if the property is observed and the engine sleeps.
template <class T, bool = std::is_trivially_destructible_v<T>>
class Slot final : public KeepingSlot<T> {
 public:
  using typename SlotBase::Utc;
  Slot() { rdf::traits<T>::type(); }  // made here, so that the first publish() does not allocate it

  void publish(const T& value) noexcept {
    if (number_ != 0 && rdf::traits<T>::same(last_, value) && !this->repeats_count()) return;
    last_ = value;
    Sample<T>& cell = cells_[back_];
    cell.value = value;
    cell.since = this->now();
    cell.number = ++number_;
    if (this->ring_) this->ring_->put(cell);
    back_ = middle_.exchange(back_ | fresh, std::memory_order_seq_cst) & index;
    this->signal();
  }

  bool take(rdf::Value& value, Utc& since) override {
    if (this->take_kept(value, since)) return true;
    if (!this->has_change()) return false;
    front_ = middle_.exchange(front_, std::memory_order_seq_cst) & index;
    return this->take_newest(cells_[front_], value, since);
  }

 private:
  using SlotBase::fresh;
  using SlotBase::index;
  using SlotBase::middle_;
  using KeepingSlot<T>::number_;
  T last_{};                // used by the writer
  std::uint8_t back_ = 0;   // used by the writer
  std::uint8_t front_ = 1;  // used by the reader
  Sample<T> cells_[3];
};

/// For types that own memory: each value is passed in a node of its own. publish() allocates but never waits.
template <class T>
class Slot<T, false> final : public KeepingSlot<T> {
 public:
  using typename SlotBase::Utc;
  ~Slot() override { delete newest_.load(std::memory_order_relaxed); }

  void publish(const T& value) noexcept {
    try {
      if (last_ && rdf::traits<T>::same(*last_, value) && !this->repeats_count()) return;
      auto cell = std::make_unique<Sample<T>>(Sample<T>{value, this->now(), this->number_ + 1});
      last_ = std::make_unique<T>(value);
      ++this->number_;
      if (this->ring_) this->ring_->put(*cell);
      delete newest_.exchange(cell.release(), std::memory_order_acq_rel);
      this->middle_.store(SlotBase::fresh, std::memory_order_seq_cst);
      this->signal();
    } catch (...) {  // out of memory: the last value is kept
    }
  }

  bool take(rdf::Value& value, Utc& since) override {
    if (this->take_kept(value, since)) return true;
    this->middle_.store(0, std::memory_order_seq_cst);
    const std::unique_ptr<Sample<T>> cell(newest_.exchange(nullptr, std::memory_order_acq_rel));
    return cell && this->take_newest(*cell, value, since);
  }

 private:
  std::unique_ptr<T> last_;  // used by the writer
  std::atomic<Sample<T>*> newest_{nullptr};
};

}  // namespace lrt::model

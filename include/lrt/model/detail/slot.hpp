// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/clock.hpp>
#include <lrt/model/detail/wake_signal.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::model {
inline namespace v0 {

/// Passes the latest value of a pushed property from the control loop to the engine. One writer, one reader.
class LRT_API SlotBase : public ChangeSource {
 public:
  using Utc = std::chrono::system_clock::time_point;

  /// True if take() would return a value. Any thread.
  bool has_change() const noexcept { return (middle_.load(std::memory_order_seq_cst) & fresh) != 0; }
  /// Takes the next value and the time of its publish(): the oldest kept value, or else the newest one. For the reader.
  /// @return  false: every value has been taken
  virtual bool take(rdf::Value& value, Utc& since) = 0;
  /// Drops all values that could be taken now except the newest; they count as lost. For the reader.
  virtual void skip_to_newest() noexcept = 0;
  /// Counts values that were taken but not used. For the reader.
  void count_lost(std::uint64_t values) noexcept { lost_.fetch_add(values, std::memory_order_relaxed); }
  /// The maximum number of values that take() can return in a row. For the reader.
  virtual std::size_t available() const noexcept = 0;
  /// Sets the number of values that are kept, instead of the one that start_keeping() finds. Call before the first
  /// publish().
  virtual void keep(std::size_t samples) = 0;

  // Keeping: between start and stop the writer puts each value into a ring, so that the reader can take each. publish() stays wait-free.
  /// Begins to keep values. Values that were published before are not kept. The first call allocates the ring, which
  /// remains.
  /// @param samples  number of values to keep
  /// @param bytes    limit of the ring, see set_value_bytes()
  /// @par Threads  The engine's; the reader may be in take().
  virtual void start_keeping(std::size_t samples, std::size_t bytes) = 0;
  virtual void stop_keeping() noexcept = 0;
  bool keeps() const noexcept { return keeps_.load(std::memory_order_acquire); }
  /// The memory that one value owns besides sizeof(T), if owns_memory(). Until it is known, one value is kept.
  virtual void set_value_bytes(std::size_t bytes) noexcept = 0;
  /// How many values were never taken: overwritten by newer ones, or the ring was full. Only values between
  /// start_keeping() and stop_keeping() are counted. A value is counted when a later one is taken.
  std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }
  /// Enables whole(). Call before the first publish().
  virtual void hold() = 0;
  /// The T that was taken last; null without hold(). For the reader.
  virtual std::shared_ptr<const void> whole() const noexcept = 0;
  virtual bool owns_memory() const noexcept = 0;
  /// Whether take() calls traits of the user.
  virtual bool runs_user_code() const noexcept = 0;

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

  std::atomic<bool> keeps_{false};
  std::atomic<std::uint64_t> lost_{0};
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

/// A ring of values in the order of publication. A value that does not fit is left out. Wait-free: one writer, one
/// reader.
template <class T>
class SampleRing {
 public:
  explicit SampleRing(std::size_t size) : cells_(size + 1), limit_(size) {}

  void put(const Sample<T>& sample) {
    const std::size_t begin = begin_.load(std::memory_order_acquire), at = end_.load(std::memory_order_relaxed);
    if ((at >= begin ? at - begin : at + cells_.size() - begin) >= limit_.load(std::memory_order_relaxed)) return;
    cells_[at] = sample;
    end_.store(after(at), std::memory_order_release);
  }
  bool take(Sample<T>& sample) {
    std::size_t at = begin_.load(std::memory_order_relaxed), end = end_.load(std::memory_order_acquire);
    if (const std::size_t skipped_to = skip_to_.load(std::memory_order_relaxed); skipped_to != nowhere) {
      at = skipped_to;
      skip_to_.store(nowhere, std::memory_order_relaxed);
      begin_.store(at, std::memory_order_release);
      end = end_.load(std::memory_order_acquire);
    }
    if (at == end) return false;
    sample = std::move(cells_[at]);
    begin_.store(after(at), std::memory_order_release);
    return true;
  }
  /// The reader is to skip what is in the ring now. While the writer does not use the ring; a value that it is just
  /// putting may remain.
  void skip() noexcept { skip_to_.store(end_.load(std::memory_order_acquire), std::memory_order_relaxed); }

  std::size_t size() const noexcept { return cells_.size() - 1; }
  void set_limit(std::size_t values) noexcept { limit_.store(std::min(values, size()), std::memory_order_relaxed); }

 private:
  static constexpr std::size_t nowhere = static_cast<std::size_t>(-1);
  std::size_t after(std::size_t at) const noexcept { return at + 1 == cells_.size() ? 0 : at + 1; }

  std::vector<Sample<T>> cells_;
  std::atomic<std::size_t> begin_{0}, end_{0}, limit_, skip_to_{nowhere};
};

/// The common part of both slots: sequence numbers and the ring of kept values.
template <class T>
class KeepingSlot : public SlotBase {
  static constexpr bool owning = !std::is_trivially_destructible_v<T>;

 public:
  ~KeepingSlot() override { delete ring_.load(std::memory_order_relaxed); }
  bool owns_memory() const noexcept final { return owning; }
  std::size_t available() const noexcept final { return this->keeps() ? ring_.load(std::memory_order_acquire)->size() + 1 : 1; }
  void skip_to_newest() noexcept final {
    if (this->keeps()) ring_.load(std::memory_order_relaxed)->skip();
  }
  void keep(std::size_t samples) final { wanted_ = samples; }
  void start_keeping(std::size_t samples, std::size_t bytes) final {
    Ring* ring = ring_.load(std::memory_order_relaxed);
    if (!ring) {
      ring = new Ring(wanted_ != any ? wanted_ : std::min(samples, bytes / sizeof(Sample<T>)), bytes);
      if (owning && wanted_ == any) ring->set_limit(1);
    }
    ring->skip();
    first_ = this->has_change();
    ring_.store(ring, std::memory_order_release);
    this->keeps_.store(true, std::memory_order_release);
  }
  void stop_keeping() noexcept final { this->keeps_.store(false, std::memory_order_release); }
  void set_value_bytes(std::size_t bytes) noexcept final {
    Ring* const ring = ring_.load(std::memory_order_relaxed);
    if (owning && ring && wanted_ == any) ring->set_limit(ring->max_bytes / (sizeof(Sample<T>) + bytes));
  }
  void hold() final { held_ = std::make_unique<std::shared_ptr<const T>>(); }
  std::shared_ptr<const void> whole() const noexcept final { return held_ ? *held_ : nullptr; }
  bool runs_user_code() const noexcept final { return rdf::detail::runs_user_code<T>(); }

 protected:
  /// For the writer.
  void put(const Sample<T>& sample) {
    if (this->keeps_.load(std::memory_order_acquire)) ring_.load(std::memory_order_relaxed)->put(sample);
  }
  bool take_kept(rdf::Value& value, Utc& since) {
    if (!this->keeps()) return false;
    Ring& ring = *ring_.load(std::memory_order_relaxed);
    Sample<T> sample;
    while (ring.take(sample)) {
      if (sample.number <= taken_) continue;  // has been taken as the newest
      give(sample, value, since);
      return true;
    }
    return false;
  }
  bool is_untaken(const Sample<T>& sample) const noexcept { return sample.number > taken_; }
  void give(const Sample<T>& sample, rdf::Value& value, Utc& since) {
    value = rdf::traits<T>::encode(sample.value);
    if (held_) *held_ = std::make_shared<const T>(sample.value);
    since = sample.since;
    // What was published before start_keeping() is not lost. If something was, the first value after it is in the ring.
    if (const bool first = first_.exchange(false, std::memory_order_relaxed); this->keeps() && !first)
      this->lost_.fetch_add(sample.number - taken_ - 1, std::memory_order_relaxed);
    taken_ = sample.number;
  }

  std::uint64_t number_ = 0;  // used by the writer

 private:
  struct Ring : SampleRing<T> {
    Ring(std::size_t size, std::size_t bytes) : SampleRing<T>(size), max_bytes(bytes) {}
    const std::size_t max_bytes;
  };
  static constexpr std::size_t any = static_cast<std::size_t>(-1);

  std::uint64_t taken_ = 0;                         // used by the reader
  std::unique_ptr<std::shared_ptr<const T>> held_;  // used by the reader; null without hold()
  std::size_t wanted_ = any;                        // by keep()
  std::atomic<Ring*> ring_{nullptr};                // made by the engine, owned; used by writer and reader
  std::atomic<bool> first_{false};                  // the next value is the first since start_keeping()
};

/// For types that own no memory: numbers, structs and arrays of such types, fixed sizes of Eigen. The criterion is a
/// trivial destructor, because Eigen's fixed sizes are not trivially copyable, although copying them does no more.
///
/// There are three cells. The writer and the reader own one each and exchange the third. Both sides are wait-free.
/// publish() does not allocate or lock. It makes a system call only if the property is observed and the engine sleeps.
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
    this->put(cell);
    back_ = middle_.exchange(back_ | fresh, std::memory_order_seq_cst) & index;
    this->signal();
  }

  bool take(rdf::Value& value, Utc& since) override {
    if (this->take_kept(value, since)) return true;
    if (!this->is_untaken(cells_[front_])) {
      if (!this->has_change()) return false;
      front_ = middle_.exchange(front_, std::memory_order_seq_cst) & index;
      if (!this->is_untaken(cells_[front_])) return false;
      // Kept values that were published before this one are in the ring by now. This one then follows them.
      if (this->take_kept(value, since)) {
        middle_.fetch_or(fresh, std::memory_order_seq_cst);
        return true;
      }
      if (!this->is_untaken(cells_[front_])) return false;
    }
    this->give(cells_[front_], value, since);
    return true;
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
      this->put(*cell);
      delete newest_.exchange(cell.release(), std::memory_order_acq_rel);
      this->middle_.store(SlotBase::fresh, std::memory_order_seq_cst);
      this->signal();
    } catch (...) {  // out of memory: the last value is kept
    }
  }

  bool take(rdf::Value& value, Utc& since) override {
    if (this->take_kept(value, since)) return true;
    if (!front_ || !this->is_untaken(*front_)) {
      this->middle_.store(0, std::memory_order_seq_cst);
      front_.reset(newest_.exchange(nullptr, std::memory_order_acq_rel));
      if (!front_ || !this->is_untaken(*front_)) return false;
      if (this->take_kept(value, since)) {  // as in the other slot
        this->middle_.store(SlotBase::fresh, std::memory_order_seq_cst);
        return true;
      }
      if (!this->is_untaken(*front_)) return false;
    }
    this->give(*front_, value, since);
    front_.reset();
    return true;
  }

 private:
  std::unique_ptr<T> last_;           // used by the writer
  std::unique_ptr<Sample<T>> front_;  // used by the reader
  std::atomic<Sample<T>*> newest_{nullptr};
};

}  // namespace v0
}  // namespace lrt::model

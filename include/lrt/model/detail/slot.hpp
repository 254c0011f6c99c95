// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>

#include <lrt/base/abi.hpp>
#include <lrt/base/clock.hpp>
#include <lrt/model/detail/callables.hpp>
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
  /// The number of the value that take() returned last: in the order of publication, from 1. For the reader.
  virtual std::uint64_t taken() const noexcept = 0;
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
  /// The user gives the time of a value, which is not the time of its publish().
  bool has_source_times() const noexcept { return source_times_.load(std::memory_order_relaxed); }

  // Of the checks in the headers (LRT_CHECKS): nobody else calls these two.
  /// False: another thread is writing.
  bool begin_write() noexcept { return !writing_.exchange(true, std::memory_order_acquire); }
  void end_write() noexcept { writing_.store(false, std::memory_order_release); }

 protected:
  static constexpr std::uint8_t index = 3, fresh = 4;

  bool repeats_count() noexcept {
    return every_sample_.load(std::memory_order_relaxed) ||
           (forgotten_.load(std::memory_order_relaxed) && forgotten_.exchange(false, std::memory_order_acquire));
  }
  Utc now() const noexcept { return clock_.load(std::memory_order_acquire)->utc(); }
  Utc given(Utc at) noexcept {
    source_times_.store(true, std::memory_order_relaxed);
    return at;
  }

  std::atomic<bool> keeps_{false};
  std::atomic<std::uint64_t> lost_{0};
  /// Bit `fresh`: a value can be taken. The other bits, with three cells: the index of the cell that neither side owns.
  std::atomic<std::uint8_t> middle_{2};

 private:
  std::atomic<bool> forgotten_{false}, every_sample_{false}, source_times_{false}, writing_{false};
  std::atomic<const Clock*> clock_{&system_clock()};
};

/// A published value without its type.
struct SampleHead {
  std::chrono::system_clock::time_point since{};
  std::uint64_t number = 0;  ///< in the order of publication, from 1
};
template <class T>
struct Sample : SampleHead {
  T value{};
};

/// What the slots do with samples of one type, whose addresses are all that they know.
struct SampleOperations {
  std::size_t bytes;  ///< of a Sample<T>
  bool owns_memory;
  SampleHead* (*make)(std::size_t n);  ///< an array
  void (*destroy)(SampleHead* array) noexcept;
  void (*assign)(SampleHead& to, const SampleHead& from);
  void (*move)(SampleHead& to, SampleHead& from);
  void (*assign_value)(SampleHead& to, const void* value);
  rdf::Value (*encode)(const SampleHead& sample);
  std::shared_ptr<const void> (*share)(const SampleHead& sample);  ///< its value
  bool (*same)(const SampleHead& sample, const void* value) noexcept;
  bool (*runs_user_code)() noexcept;
};
template <class T>
struct SampleOperationsOf {
  static SampleHead* make(std::size_t n) { return new Sample<T>[n]; }
  static void destroy(SampleHead* array) noexcept { delete[] static_cast<Sample<T>*>(array); }
  static void assign(SampleHead& to, const SampleHead& from) { static_cast<Sample<T>&>(to) = static_cast<const Sample<T>&>(from); }
  static void move(SampleHead& to, SampleHead& from) { static_cast<Sample<T>&>(to) = static_cast<Sample<T>&&>(from); }
  static void assign_value(SampleHead& to, const void* value) { static_cast<Sample<T>&>(to).value = *static_cast<const T*>(value); }
  static rdf::Value encode(const SampleHead& sample) { return rdf::traits<T>::encode(static_cast<const Sample<T>&>(sample).value); }
  static std::shared_ptr<const void> share(const SampleHead& sample) { return shared_value(static_cast<const Sample<T>&>(sample).value); }
  static bool same(const SampleHead& sample, const void* value) noexcept {
    return rdf::traits<T>::same(static_cast<const Sample<T>&>(sample).value, *static_cast<const T*>(value));
  }
};
template <class T>
inline constexpr SampleOperations sample_operations{sizeof(Sample<T>),
                                                    !std::is_trivially_destructible_v<T>,
                                                    SampleOperationsOf<T>::make,
                                                    SampleOperationsOf<T>::destroy,
                                                    SampleOperationsOf<T>::assign,
                                                    SampleOperationsOf<T>::move,
                                                    SampleOperationsOf<T>::assign_value,
                                                    SampleOperationsOf<T>::encode,
                                                    SampleOperationsOf<T>::share,
                                                    SampleOperationsOf<T>::same,
                                                    rdf::detail::runs_user_code<T>};

class SampleRing;

/// The common part of both slots: sequence numbers and the ring of kept values.
class LRT_API KeepingSlot : public SlotBase {
 public:
  ~KeepingSlot() override;
  bool owns_memory() const noexcept final { return operations_.owns_memory; }
  std::size_t available() const noexcept final;
  void skip_to_newest() noexcept final;
  void keep(std::size_t samples) final { wanted_ = samples; }
  void start_keeping(std::size_t samples, std::size_t bytes) final;
  void stop_keeping() noexcept final { this->keeps_.store(false, std::memory_order_release); }
  void set_value_bytes(std::size_t bytes) noexcept final;
  void hold() final;
  std::shared_ptr<const void> whole() const noexcept final { return held_ ? *held_ : nullptr; }
  bool runs_user_code() const noexcept final { return operations_.runs_user_code(); }
  std::uint64_t taken() const noexcept final { return taken_; }

 protected:
  explicit KeepingSlot(const SampleOperations& operations) noexcept : operations_(operations) {}

  /// For the writer.
  void put(const SampleHead& sample) {
    if (keeps_.load(std::memory_order_acquire)) put_into_ring(sample);
  }
  bool take_kept(rdf::Value& value, Utc& since);
  bool is_untaken(const SampleHead& sample) const noexcept { return sample.number > taken_; }
  void give(const SampleHead& sample, rdf::Value& value, Utc& since);

  const SampleOperations& operations_;
  std::uint64_t number_ = 0;  // used by the writer

 private:
  static constexpr std::size_t any = static_cast<std::size_t>(-1);

  void put_into_ring(const SampleHead& sample);

  std::uint64_t taken_ = 0;                            // used by the reader
  std::unique_ptr<std::shared_ptr<const void>> held_;  // used by the reader; null without hold()
  std::size_t wanted_ = any;                           // by keep()
  std::atomic<SampleRing*> ring_{nullptr};             // made by the engine, owned; used by writer and reader
  std::atomic<bool> first_{false};                     // the next value is the first since start_keeping()
};

/// The reader's side of a slot of three cells. The writer and the reader own one each and exchange the third. Both sides are
/// wait-free.
class LRT_API CellSlot : public KeepingSlot {
 public:
  bool take(rdf::Value& value, Utc& since) final;

 protected:
  using KeepingSlot::KeepingSlot;
  SampleHead* cells_at_ = nullptr;  // an array of three samples
  std::uint8_t back_ = 0;           // used by the writer

 private:
  SampleHead& front() const noexcept;

  std::uint8_t front_ = 1;  // used by the reader
};

/// A slot for values that own memory: each value is passed in a node of its own. publish() allocates but never waits.
class LRT_API NodeSlot : public KeepingSlot {
 public:
  explicit NodeSlot(const SampleOperations& operations) noexcept;
  ~NodeSlot() override;
  bool take(rdf::Value& value, Utc& since) final;
  void publish_value(const void* value) noexcept;
  void publish_value(const void* value, Utc at) noexcept;

 private:
  template <class Time>
  void pass(const void* value, Time time) noexcept;
  using Node = std::unique_ptr<SampleHead, void (*)(SampleHead*) noexcept>;
  Node node_of(const void* value) const;

  Node last_;   // used by the writer
  Node front_;  // used by the reader
  std::atomic<SampleHead*> newest_{nullptr};
};

/// For types that own no memory: numbers, structs and arrays of such types, fixed sizes of Eigen. The criterion is a
/// trivial destructor, because Eigen's fixed sizes are not trivially copyable, although copying them does no more.
/// publish() does not allocate or lock. It makes a system call only if the property is observed and the engine sleeps.
template <class T, bool = std::is_trivially_destructible_v<T>>
class Slot final : public CellSlot {
 public:
  Slot() : CellSlot(sample_operations<T>) {
    cells_at_ = cells_;
    rdf::traits<T>::type();  // made here, so that the first publish() does not allocate it
  }

  void publish(const T& value) noexcept {
    pass(value, [this]() noexcept { return this->now(); });
  }
  void publish(const T& value, SlotBase::Utc at) noexcept {
    pass(value, [this, at]() noexcept { return this->given(at); });
  }

 private:
  template <class Time>
  void pass(const T& value, Time time) noexcept {
    if (number_ != 0 && rdf::traits<T>::same(last_, value) && !repeats_count()) return;
    last_ = value;
    Sample<T>& cell = cells_[back_];
    cell.value = value;
    cell.since = time();
    cell.number = ++number_;
    put(cell);
    back_ = middle_.exchange(back_ | fresh, std::memory_order_seq_cst) & index;
    signal();
  }

  T last_{};  // used by the writer
  Sample<T> cells_[3];
};

template <class T>
class Slot<T, false> final : public NodeSlot {
 public:
  Slot() noexcept : NodeSlot(sample_operations<T>) {}
  void publish(const T& value) noexcept { publish_value(std::addressof(value)); }
  void publish(const T& value, SlotBase::Utc at) noexcept { publish_value(std::addressof(value), at); }
};

/// The slot of a property.
template <class T>
std::unique_ptr<SlotBase> new_slot() {
  if constexpr (std::is_trivially_destructible_v<T>) return std::make_unique<Slot<T>>();
  else return std::make_unique<NodeSlot>(sample_operations<T>);
}
/// @param slot  by new_slot<T>()
template <class T>
void publish_to(SlotBase& slot, const T& value) noexcept {
  if constexpr (std::is_trivially_destructible_v<T>) static_cast<Slot<T>&>(slot).publish(value);
  else static_cast<NodeSlot&>(slot).publish_value(std::addressof(value));
}
/// @param at  time of the value
template <class T>
void publish_to(SlotBase& slot, const T& value, SlotBase::Utc at) noexcept {
  if constexpr (std::is_trivially_destructible_v<T>) static_cast<Slot<T>&>(slot).publish(value, at);
  else static_cast<NodeSlot&>(slot).publish_value(std::addressof(value), at);
}

}  // namespace v0
}  // namespace lrt::model

// SPDX-License-Identifier: Apache-2.0
#include <lrt/model/detail/slot.hpp>

#include <algorithm>

namespace lrt::model {
inline namespace v0 {
namespace {
SampleHead& at(SampleHead* array, const SampleOperations& operations, std::size_t index) noexcept {
  return *reinterpret_cast<SampleHead*>(reinterpret_cast<char*>(array) + index * operations.bytes);
}
}  // namespace

/// A ring of values in the order of publication. A value that does not fit is left out. Wait-free: one writer, one
/// reader.
class SampleRing {
 public:
  SampleRing(const SampleOperations& operations, std::size_t size, std::size_t bytes)
      : max_bytes(bytes),
        operations_(operations),
        count_(size + 1),
        cells_(operations.make(count_), operations.destroy),
        taken_(operations.make(1), operations.destroy),
        limit_(size) {}

  void put(const SampleHead& sample) {
    const std::size_t begin = begin_.load(std::memory_order_acquire), end = end_.load(std::memory_order_relaxed);
    if ((end >= begin ? end - begin : end + count_ - begin) >= limit_.load(std::memory_order_relaxed)) return;
    operations_.assign(cell(end), sample);
    end_.store(after(end), std::memory_order_release);
  }
  /// The oldest value, valid until the next call; null: there is none.
  const SampleHead* take() {
    std::size_t begin = begin_.load(std::memory_order_relaxed), end = end_.load(std::memory_order_acquire);
    if (const std::size_t skipped_to = skip_to_.load(std::memory_order_relaxed); skipped_to != nowhere) {
      begin = skipped_to;
      skip_to_.store(nowhere, std::memory_order_relaxed);
      begin_.store(begin, std::memory_order_release);
      end = end_.load(std::memory_order_acquire);
    }
    if (begin == end) return nullptr;
    operations_.move(*taken_, cell(begin));
    begin_.store(after(begin), std::memory_order_release);
    return taken_.get();
  }
  /// The reader is to skip what is in the ring now. While the writer does not use the ring; a value that it is just
  /// putting may remain.
  void skip() noexcept { skip_to_.store(end_.load(std::memory_order_acquire), std::memory_order_relaxed); }

  std::size_t size() const noexcept { return count_ - 1; }
  void set_limit(std::size_t values) noexcept { limit_.store(std::min(values, size()), std::memory_order_relaxed); }

  const std::size_t max_bytes;

 private:
  static constexpr std::size_t nowhere = static_cast<std::size_t>(-1);
  std::size_t after(std::size_t index) const noexcept { return index + 1 == count_ ? 0 : index + 1; }
  SampleHead& cell(std::size_t index) noexcept { return at(cells_.get(), operations_, index); }

  const SampleOperations& operations_;
  const std::size_t count_;
  const std::unique_ptr<SampleHead, void (*)(SampleHead*) noexcept> cells_, taken_;
  std::atomic<std::size_t> begin_{0}, end_{0}, limit_, skip_to_{nowhere};
};

KeepingSlot::~KeepingSlot() { delete ring_.load(std::memory_order_relaxed); }

std::size_t KeepingSlot::available() const noexcept { return keeps() ? ring_.load(std::memory_order_acquire)->size() + 1 : 1; }

void KeepingSlot::skip_to_newest() noexcept {
  if (keeps()) ring_.load(std::memory_order_relaxed)->skip();
}

void KeepingSlot::start_keeping(std::size_t samples, std::size_t bytes) {
  SampleRing* ring = ring_.load(std::memory_order_relaxed);
  if (!ring) {
    ring = new SampleRing(operations_, wanted_ != any ? wanted_ : std::min(samples, bytes / operations_.bytes), bytes);
    if (operations_.owns_memory && wanted_ == any) ring->set_limit(1);
  }
  ring->skip();
  first_ = has_change();
  ring_.store(ring, std::memory_order_release);
  keeps_.store(true, std::memory_order_release);
}

void KeepingSlot::set_value_bytes(std::size_t bytes) noexcept {
  SampleRing* const ring = ring_.load(std::memory_order_relaxed);
  if (operations_.owns_memory && ring && wanted_ == any) ring->set_limit(ring->max_bytes / (operations_.bytes + bytes));
}

void KeepingSlot::hold() { held_ = std::make_unique<std::shared_ptr<const void>>(); }

void KeepingSlot::put_into_ring(const SampleHead& sample) { ring_.load(std::memory_order_relaxed)->put(sample); }

bool KeepingSlot::take_kept(rdf::Value& value, Utc& since) {
  if (!keeps()) return false;
  SampleRing& ring = *ring_.load(std::memory_order_relaxed);
  while (const SampleHead* sample = ring.take()) {
    if (!is_untaken(*sample)) continue;  // has been taken as the newest
    give(*sample, value, since);
    return true;
  }
  return false;
}

void KeepingSlot::give(const SampleHead& sample, rdf::Value& value, Utc& since) {
  // What was published before start_keeping() is not lost. If something was, the first value after it is in the ring.
  if (const bool first = first_.exchange(false, std::memory_order_relaxed); keeps() && !first)
    lost_.fetch_add(sample.number - taken_ - 1, std::memory_order_relaxed);
  taken_ = sample.number;  // also if encode(), which is the user's, throws: the next call gives a later one
  value = operations_.encode(sample);
  if (held_) *held_ = operations_.share(sample);
  since = sample.since;
}

SampleHead& CellSlot::front() const noexcept { return at(cells_at_, operations_, front_); }

bool CellSlot::take(rdf::Value& value, Utc& since) {
  if (take_kept(value, since)) return true;
  if (!is_untaken(front())) {
    if (!has_change()) return false;
    front_ = middle_.exchange(front_, std::memory_order_seq_cst) & index;
    if (!is_untaken(front())) return false;
    // Kept values that were published before this one are in the ring by now. This one then follows them.
    if (take_kept(value, since)) {
      middle_.fetch_or(fresh, std::memory_order_seq_cst);
      return true;
    }
    if (!is_untaken(front())) return false;
  }
  give(front(), value, since);
  return true;
}

NodeSlot::NodeSlot(const SampleOperations& operations) noexcept
    : KeepingSlot(operations), last_(nullptr, operations.destroy), front_(nullptr, operations.destroy) {}

NodeSlot::~NodeSlot() {
  if (SampleHead* newest = newest_.load(std::memory_order_relaxed)) operations_.destroy(newest);
}

NodeSlot::Node NodeSlot::node_of(const void* value) const {
  Node node(operations_.make(1), operations_.destroy);
  operations_.assign_value(*node, value);
  return node;
}

void NodeSlot::publish_value(const void* value) noexcept {
  pass(value, [this] { return now(); });
}
void NodeSlot::publish_value(const void* value, Utc at) noexcept {
  pass(value, [this, at] { return given(at); });
}

template <class Time>
void NodeSlot::pass(const void* value, Time time) noexcept {
  try {
    if (last_ && operations_.same(*last_, value) && !repeats_count()) return;
    Node node = node_of(value);
    node->since = time();
    node->number = number_ + 1;
    last_ = node_of(value);
    ++number_;
    put(*node);
    if (SampleHead* replaced = newest_.exchange(node.release(), std::memory_order_acq_rel)) operations_.destroy(replaced);
    middle_.store(fresh, std::memory_order_seq_cst);
    signal();
  } catch (...) {  // out of memory: the last value is kept
  }
}

bool NodeSlot::take(rdf::Value& value, Utc& since) {
  if (take_kept(value, since)) return true;
  if (!front_ || !is_untaken(*front_)) {
    middle_.store(0, std::memory_order_seq_cst);
    front_.reset(newest_.exchange(nullptr, std::memory_order_acq_rel));
    if (!front_ || !is_untaken(*front_)) return false;
    if (take_kept(value, since)) {  // as in the other slot
      middle_.store(fresh, std::memory_order_seq_cst);
      return true;
    }
    if (!is_untaken(*front_)) return false;
  }
  give(*front_, value, since);
  front_.reset();
  return true;
}

}  // namespace v0
}  // namespace lrt::model

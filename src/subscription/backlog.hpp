// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "src/base/ring_queue.hpp"

namespace lrt::subscription {

/// Time and number of what a resource shows.
struct Stamp {
  std::optional<std::chrono::system_clock::time_point> at{};  ///< when the value became what it is; nullopt: it has no such time
  std::uint64_t number = 0;                                   ///< changes of the resource so far
};

/// One representation to be sent, shared by all subscribers that get it.
struct Message {
  std::shared_ptr<const std::string> body;
  std::string tag;  ///< its entity tag
  Stamp stamp{};
};
using Item = std::shared_ptr<const Message>;

/// Counts for one subscriber the changes between two messages, which it was not sent: dropped from its queue, superseded by newer ones, or
/// overwritten before the server saw them.
class LeftOut {
 public:
  /// The subscription begins with the change of this number, which is to be sent first. 0: the resource has no value yet.
  void begin(std::uint64_t number) noexcept { told_ = seen_ = number == 0 ? 0 : number - 1; }
  /// The subscriber has the representation after this change already.
  void knows(std::uint64_t number) noexcept { told_ = seen_ = number; }
  /// There is a message for this change.
  void seen(std::uint64_t number) noexcept { seen_ = std::max(seen_, number); }
  /// The representation after this change is the one before: it is not sent, and not left out.
  void unchanged(std::uint64_t number) noexcept {
    if (number <= seen_) return;  // it has the same value
    ++unchanged_;
    seen_ = number;
  }
  /// A message is sent: the number of changes that were left out before it. A repeated message has none.
  std::uint64_t sent(std::uint64_t number) noexcept {
    seen(number);
    if (number <= told_) return 0;
    const std::uint64_t between = number - std::exchange(told_, number) - 1;
    const std::uint64_t same = std::min(unchanged_, between);
    unchanged_ -= same;
    return between - same;
  }

 private:
  std::uint64_t told_ = 0;       ///< the change of the last message
  std::uint64_t seen_ = 0;       ///< the last change that was looked at
  std::uint64_t unchanged_ = 0;  ///< those after the last message without a representation of their own
};

/// How one subscriber gets its notifications.
struct Policy {
  std::size_t queue_length = 0;                   ///< 0: no queue, only the newest representation is sent
  std::chrono::milliseconds minimum_interval{0};  ///< between two notifications

  bool queues() const noexcept { return queue_length > 0; }
};

/// The changes that one subscriber has not been sent yet.
///
/// With a queue these are items, limited in number and in bytes. Without a queue it is one flag, and the representation is made when
/// the subscriber can take it.
class Backlog {
 public:
  using Instant = std::chrono::steady_clock::time_point;
  /// @param max_bytes        limit of the items in this backlog
  /// @param max_total_bytes  limit of the items in all backlogs
  /// @param total_bytes      counts the items in all backlogs; must outlive this backlog
  Backlog(Policy policy, std::size_t max_bytes, std::size_t max_total_bytes, std::size_t& total_bytes)
      : policy_(policy), max_bytes_(max_bytes), max_total_bytes_(max_total_bytes), total_bytes_(total_bytes) {}
  ~Backlog() { total_bytes_ -= bytes_; }
  Backlog(const Backlog&) = delete;
  Backlog& operator=(const Backlog&) = delete;

  const Policy& policy() const noexcept { return policy_; }
  bool empty() const noexcept { return pending_ == Pending::no && items_.empty(); }
  std::uint64_t dropped() const noexcept { return dropped_; }
  void count_dropped(std::uint64_t n) noexcept { dropped_ += n; }

  /// The flag: whether a representation is to be made.
  enum class Pending : std::uint8_t {
    no,
    maybe,    ///< it may be the one before: nobody said that it has changed
    changed,  ///< for a change, which the next one supersedes
  };
  /// Sets the flag: the representation has changed. If a change was pending already, it counts as dropped.
  void mark_changed() noexcept {
    if (pending_ == Pending::changed) ++dropped_;
    pending_ = Pending::changed;
  }
  /// Sets the flag, and counts nothing as dropped now or later.
  void mark_pending() noexcept { put_back(Pending::maybe); }
  /// Clears the flag and returns its old value.
  Pending take_pending() noexcept { return std::exchange(pending_, Pending::no); }
  /// Sets the flag as it was when it was taken.
  void put_back(Pending pending) noexcept { pending_ = std::max(pending_, pending); }

  /// Appends an item. Then drops the oldest items until all limits hold; the newest item is always kept.
  void push(Item item) {
    if (policy_.queues() && items_.size() == policy_.queue_length) {  // first: the queue need not grow for one more
      drop_first();
      ++dropped_;
    }
    count(*item);
    items_.push_back(std::move(item));
    while (items_.size() > policy_.queue_length || (is_full() && items_.size() > 1)) {
      drop_first();
      ++dropped_;
    }
  }
  /// Appends the last item before the subscription ends. No limit applies to it.
  void push_last(Item item) {
    count(*item);
    items_.push_back(std::move(item));
  }
  /// Returns an item that was taken and could not be delivered. It is the oldest one, so it is dropped if the limits do not allow it.
  void put_back(Item item) {
    if (items_.size() >= policy_.queue_length || (!items_.empty() && bytes_ + item->body->size() > max_bytes_)) {
      ++dropped_;
      return;
    }
    count(*item);
    items_.push_front(std::move(item));
  }
  /// Takes the oldest item; nullptr: the queue is empty.
  Item take_item() noexcept { return items_.empty() ? nullptr : drop_first(); }
  /// The newest item; nullptr: the queue is empty.
  const Message* newest() const noexcept { return items_.empty() ? nullptr : items_.back().get(); }
  void drop_items() noexcept {
    dropped_ += items_.size();
    while (!items_.empty()) drop_first();
  }

  /// The earliest time of the next notification.
  Instant due() const noexcept { return due_; }
  /// A notification was sent at `now`: the next one waits for the minimum interval.
  void sent(Instant now) noexcept { due_ = now + policy_.minimum_interval; }
  void set_due(Instant time) noexcept { due_ = time; }

 private:
  bool is_full() const noexcept { return bytes_ > max_bytes_ || total_bytes_ > max_total_bytes_; }
  void count(const Message& message) noexcept {
    bytes_ += message.body->size();
    total_bytes_ += message.body->size();
  }
  Item drop_first() noexcept {
    Item first = items_.pop_front();
    bytes_ -= first->body->size();
    total_bytes_ -= first->body->size();
    return first;
  }

  const Policy policy_;
  const std::size_t max_bytes_, max_total_bytes_;
  std::size_t& total_bytes_;
  Pending pending_ = Pending::no;
  RingQueue<Item> items_;
  std::size_t bytes_ = 0;
  std::uint64_t dropped_ = 0;
  Instant due_{};
};

}  // namespace lrt::subscription

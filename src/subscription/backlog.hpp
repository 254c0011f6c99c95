#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace lrt::subscription {

/// One representation on its way to a subscriber.
struct Item {
  std::shared_ptr<const std::string> body;
  std::string tag;
};

/// What becomes of changes that a subscriber cannot take at once.
struct Policy {
  std::size_t queue_length = 0;                    ///< 0: only that there is a newer one is remembered
  std::chrono::milliseconds minimum_interval{0};   ///< between two notifications

  bool queues() const noexcept { return queue_length > 0; }
};

/// What one subscriber has not been given yet. With a queue that is items, at most so many and so many bytes; without one it is a word,
/// and the representation is made when the subscriber can take it.
class Backlog {
 public:
  using Instant = std::chrono::steady_clock::time_point;
  /// @param most_bytes  of the items here; `most_of_all`: of those of all backlogs, which `bytes_of_all` counts
  Backlog(Policy policy, std::size_t most_bytes, std::size_t most_of_all, std::size_t& bytes_of_all)
      : policy_(policy), most_bytes_(most_bytes), most_of_all_(most_of_all), bytes_of_all_(bytes_of_all) {}
  ~Backlog() { bytes_of_all_ -= bytes_; }
  Backlog(const Backlog&) = delete;
  Backlog& operator=(const Backlog&) = delete;

  const Policy& policy() const noexcept { return policy_; }
  bool empty() const noexcept { return !noted_ && items_.empty(); }
  std::uint64_t dropped() const noexcept { return dropped_; }
  void count_dropped(std::uint64_t n) noexcept { dropped_ += n; }

  /// There is a newer representation than the one that was given last.
  void note() noexcept {
    if (noted_) ++dropped_;
    noted_ = true;
  }
  /// The same, when nothing is known to have been missed.
  void note_again() noexcept { noted_ = true; }
  bool take_note() noexcept { return std::exchange(noted_, false); }

  void push(Item item) {
    count(item);
    items_.push_back(std::move(item));
    while (items_.size() > policy_.queue_length || (is_full() && items_.size() > 1)) {
      drop_first();
      ++dropped_;
    }
  }
  /// The last one before the end: there is room for it whatever the policy.
  void push_last(Item item) {
    count(item);
    items_.push_back(std::move(item));
  }
  /// What was taken and not delivered. It is the oldest, and goes first if there is no room.
  void put_back(Item item) {
    if (items_.size() >= policy_.queue_length || (!items_.empty() && bytes_ + item.body->size() > most_bytes_)) {
      ++dropped_;
      return;
    }
    count(item);
    items_.push_front(std::move(item));
  }
  std::optional<Item> take_item() {
    if (items_.empty()) return std::nullopt;
    Item first = items_.front();
    drop_first();
    return first;
  }
  /// The last of those that wait; nullptr: none does.
  const Item* newest() const noexcept { return items_.empty() ? nullptr : &items_.back(); }
  void drop_items() noexcept {
    dropped_ += items_.size();
    while (!items_.empty()) drop_first();
  }

  /// When the next notification may go.
  Instant due() const noexcept { return due_; }
  void given(Instant now) noexcept { due_ = now + policy_.minimum_interval; }
  void not_before(Instant time) noexcept { due_ = time; }

 private:
  bool is_full() const noexcept { return bytes_ > most_bytes_ || bytes_of_all_ > most_of_all_; }
  void count(const Item& item) noexcept {
    bytes_ += item.body->size();
    bytes_of_all_ += item.body->size();
  }
  void drop_first() noexcept {
    bytes_ -= items_.front().body->size();
    bytes_of_all_ -= items_.front().body->size();
    items_.pop_front();
  }

  const Policy policy_;
  const std::size_t most_bytes_, most_of_all_;
  std::size_t& bytes_of_all_;
  bool noted_ = false;
  std::deque<Item> items_;
  std::size_t bytes_ = 0;
  std::uint64_t dropped_ = 0;
  Instant due_{};
};

}  // namespace lrt::subscription

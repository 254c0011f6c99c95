#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <optional>

#include <lrt/base/clock.hpp>

namespace lrt::transport {

/// Who runs out of time next, for any number of connections without a timer each. Every kind of deadline has one length, so the
/// entries of a kind are in order by being appended: setting, clearing and asking for the next are O(1) and never allocate.
class Deadlines {
 public:
  using Instant = std::chrono::steady_clock::time_point;
  static constexpr std::size_t phases = 5;  ///< the kinds below: the phases of a Session that have a time, see there
  static constexpr std::size_t blocked = 3;     ///< as Session::Phase::writing: limits.write_time
  static constexpr std::size_t silent = 5;      ///< limits.ping_time
  static constexpr std::size_t unanswered = 6;  ///< limits.pong_time
  static constexpr std::size_t closing = 7;     ///< limits.close_time
  static constexpr std::size_t kinds = 8;

  /// Base of what has a deadline. At most one at a time; must be cleared before it is destroyed.
  class Entry {
   public:
    /// Its time has come.
    virtual void expire(TimePoint now) = 0;

   protected:
    Entry() = default;
    ~Entry() = default;
    Entry(const Entry&) = delete;
    Entry& operator=(const Entry&) = delete;

   private:
    friend class Deadlines;
    Entry* previous_ = nullptr;  ///< nullptr: in no list
    Entry* next_ = nullptr;
    Instant due_{};
  };

  Deadlines() noexcept {
    for (auto& head : heads_) head.previous_ = head.next_ = &head;
  }

  /// Replaces the deadline of `entry`.
  void set(Entry& entry, std::size_t kind, Instant due) noexcept {
    clear(entry);
    auto& head = heads_[kind];
    entry.due_ = due;
    entry.previous_ = head.previous_;
    entry.next_ = &head;
    head.previous_->next_ = &entry;
    head.previous_ = &entry;
  }

  void clear(Entry& entry) noexcept {
    if (!entry.previous_) return;
    entry.previous_->next_ = entry.next_;
    entry.next_->previous_ = entry.previous_;
    entry.previous_ = entry.next_ = nullptr;
  }

  /// Takes one out whose time has come; nullptr when there is none.
  Entry* expired(Instant now) noexcept {
    for (auto& head : heads_) {
      if (head.next_ == &head || head.next_->due_ > now) continue;
      Entry* const entry = head.next_;
      clear(*entry);
      return entry;
    }
    return nullptr;
  }

  std::optional<Instant> next() const noexcept {
    std::optional<Instant> due;
    for (const auto& head : heads_) {
      if (head.next_ != &head && (!due || head.next_->due_ < *due)) due = head.next_->due_;
    }
    return due;
  }

 private:
  struct Head final : Entry {
    void expire(TimePoint) override {}
  };
  std::array<Head, kinds> heads_;
};

}  // namespace lrt::transport

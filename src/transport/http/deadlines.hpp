// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <optional>

#include <lrt/base/clock.hpp>

#include "src/transport/http/list.hpp"

namespace lrt::transport {

/// Deadlines of any number of connections, without a timer for each. Every kind of deadline has one length, so the entries of a kind are
/// ordered by being appended: setting, clearing and finding the next are O(1) and never allocate.
class Deadlines {
  struct Tag;

 public:
  using Instant = std::chrono::steady_clock::time_point;
  static constexpr std::size_t phases = 6;      ///< the kinds below this are the phases of a Session that have a time
  static constexpr std::size_t blocked = 3;     ///< as Session::Phase::writing: limits.write_timeout
  static constexpr std::size_t silent = 5;      ///< as Session::Phase::streaming: limits.ping_interval
  static constexpr std::size_t unanswered = 6;  ///< limits.pong_timeout
  static constexpr std::size_t closing = 7;     ///< limits.close_timeout
  static constexpr std::size_t kinds = 8;

  /// Base of an object that has at most one deadline at a time.
  class Entry : public Linked<Tag> {
   public:
    /// Called at the deadline.
    virtual void expire(TimePoint now) = 0;

   protected:
    Entry() = default;
    ~Entry() = default;

   private:
    friend class Deadlines;
    Instant due_{};
  };

  /// Replaces the deadline of `entry`.
  void set(Entry& entry, std::size_t kind, Instant due) noexcept {
    entry.due_ = due;
    kinds_[kind].push_back(entry);
  }

  void clear(Entry& entry) noexcept { entry.unlink(); }

  /// Removes and returns an entry that is due; nullptr: there is none.
  Entry* expired(Instant now) noexcept {
    for (auto& kind : kinds_) {
      if (kind.empty() || kind.front().due_ > now) continue;
      Entry& entry = kind.front();
      clear(entry);
      return &entry;
    }
    return nullptr;
  }

  std::optional<Instant> next() const noexcept {
    std::optional<Instant> due;
    for (const auto& kind : kinds_) {
      if (!kind.empty() && (!due || kind.front().due_ < *due)) due = kind.front().due_;
    }
    return due;
  }

 private:
  std::array<List<Entry, Tag>, kinds> kinds_;
};

}  // namespace lrt::transport

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <utility>

#include <lrt/engine/handler.hpp>

#include "src/engine/deadline_queue.hpp"

namespace lrt::engine {

/// When the subscribers that asked for heartbeats get theirs. Those with the same interval get them at the same times, in one turn of the transport.
class Heartbeats {
 public:
  using Instant = std::chrono::steady_clock::time_point;
  /// The longest interval, and the shortest one.
  static constexpr std::chrono::milliseconds longest{1000}, shortest{100};

  /// The first heartbeat is due at once.
  void begin(Channel channel, std::chrono::milliseconds every, Instant now) {
    Beat& beat = beats_[number(channel)];
    beat.every = every;
    next_.set(beat.next, now, channel);
  }
  void forget(Channel channel) {
    const auto found = beats_.find(number(channel));
    if (found == beats_.end()) return;
    next_.clear(found->second.next);
    beats_.erase(found);
  }
  /// Calls `announce` with channels whose heartbeat has become due, with `most` at once.
  template <class F>
  void take_due(Instant now, std::size_t most, F announce) {
    for (; most > 0; --most) {
      const auto channel = next_.take_due(now);
      if (!channel) return;
      Beat& beat = beats_.at(number(*channel));
      beat.next.reset();
      beat.due = true;
      const Instant::duration every = beat.every;
      next_.set(beat.next, Instant((now.time_since_epoch() / every + 1) * every), *channel);
      announce(*channel);
    }
  }
  /// True once after the heartbeat of a channel has become due: it is sent now.
  bool take(Channel channel) {
    if (beats_.empty()) return false;
    const auto found = beats_.find(number(channel));
    return found != beats_.end() && std::exchange(found->second.due, false);
  }
  std::optional<Instant> next_deadline() const { return next_.next(); }

 private:
  struct Beat {
    std::chrono::milliseconds every{0};
    bool due = false;
    DeadlineQueue<Channel>::Place next;
  };
  static std::uint64_t number(Channel channel) noexcept { return static_cast<std::uint64_t>(channel); }

  std::unordered_map<std::uint64_t, Beat> beats_;
  DeadlineQueue<Channel> next_;
};

}  // namespace lrt::engine

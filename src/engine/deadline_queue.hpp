// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <utility>

namespace lrt::engine {

/// Elements ordered by deadline.
template <class T>
class DeadlineQueue {
 public:
  using Instant = std::chrono::steady_clock::time_point;
  using Place = std::optional<typename std::multimap<Instant, T>::iterator>;

  /// Stores the place, and replaces the previous one.
  void set(Place& place, Instant due, T what) {
    clear(place);
    place = by_time_.emplace(due, std::move(what));
  }
  void clear(Place& place) {
    if (place) by_time_.erase(*place);
    place.reset();
  }
  /// The first that is due. It leaves the queue, and its owner's place is no longer valid.
  std::optional<T> take_due(Instant now) {
    if (by_time_.empty() || by_time_.begin()->first > now) return std::nullopt;
    T first = std::move(by_time_.begin()->second);
    by_time_.erase(by_time_.begin());
    return first;
  }
  std::optional<Instant> next() const { return by_time_.empty() ? std::nullopt : std::optional(by_time_.begin()->first); }

 private:
  std::multimap<Instant, T> by_time_;
};

}  // namespace lrt::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>

namespace lrt::engine {

/// Predicts from the times of publish() when the next one is due, so that one scan per publish() finds it soon. For one property.
///
/// A publish() is due one period after the last. A control loop has jitter, and a thread needs time to wake, so the scan comes an offset later:
/// the offset grows by a sixtieth of the period when the scan comes too early, and shrinks by a thousandth when it does not. So about one scan
/// in seventeen is too early, and is repeated soon.
class PublishRhythm {
 public:
  using Instant = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::nanoseconds;

  /// @return  the last values came at regular intervals
  bool is_regular() const noexcept { return regular_ >= min_regular; }
  /// Between two values; meaningful if is_regular().
  Duration period() const noexcept { return period_; }
  /// When to scan for the next value; nullopt: not known.
  std::optional<Instant> due() const noexcept { return due_; }

  /// A scan at `now` found a value that was published at `published`.
  void found(Instant published, Instant now) noexcept {
    if (due_ && now >= *due_ && missed_ == 0) offset_ = std::max(offset_ - period_ / 1000, -period_ / 4);
    missed_ = 0;
    learn(published);
    due_.reset();
    if (!is_regular()) return;
    Instant next = published + period_ + offset_;
    if (next <= now) next += ((now - next) / period_ + 1) * period_;
    due_ = next;
  }

  /// A scan at `now` found nothing.
  void missed(Instant now) noexcept {
    if (!due_ || now < *due_) return;  // it was made for something else
    if (missed_ == 0) offset_ = std::min(offset_ + period_ / 60, period_ / 2);
    if (missed_ == max_missed) {
      *this = {};
      return;
    }
    due_ = now + std::min(period_ / 2, period_ * (1 << missed_) / 16);
    ++missed_;
  }

 private:
  static constexpr int min_regular = 4, max_regular = 8, max_missed = 8;

  void learn(Instant published) noexcept {
    const Duration interval = published - last_;
    const bool first = last_ == Instant{};
    last_ = published;
    if (first || interval <= Duration(0)) return;
    // Values in between were replaced before a scan.
    const std::int64_t steps = period_.count() > 0 ? (interval + period_ / 2) / period_ : 0;
    const Duration error = interval - steps * period_;
    if (steps >= 1 && steps <= 4 && (error < Duration(0) ? -error : error) <= period_ / 4) {
      period_ += error / (8 * steps);
      if (steps == 1) regular_ = std::min(regular_ + 1, max_regular);
    } else if (regular_ > min_regular) {
      regular_ -= 2;
    } else {
      period_ = interval;
      regular_ = 0;
    }
  }

  Instant last_{};
  Duration period_{0};
  Duration offset_{0};
  std::optional<Instant> due_;
  int regular_ = 0;  ///< how many intervals were as expected
  int missed_ = 0;   ///< scans for the value that is due
};

}  // namespace lrt::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>

#include <lrt/subscription/options.hpp>

#include "src/base/back_off.hpp"

namespace lrt::subscription {

/// Counts the failed deliveries of one web callback and gives the pause before the next attempt, by CallbackOptions.
class RetryPolicy {
 public:
  explicit RetryPolicy(const CallbackOptions& options) : options_(options) {}

  bool suspended() const noexcept { return suspended_; }
  /// The last attempt failed.
  bool tried() const noexcept { return failures_ > 0; }

  void succeeded() noexcept {
    failures_ = 0;
    suspended_ = false;
  }
  /// Counts a failed attempt.
  /// @param chance  random, in [0, 1): the pause is multiplied by 0.5 + chance, so that the retries of many callbacks spread
  /// @return        the pause before the next attempt; nullopt: no attempt is left, the subscription ends
  std::optional<std::chrono::milliseconds> failed(double chance) noexcept {
    ++failures_;
    if (!suspended_ && failures_ >= options_.attempts) {
      suspended_ = true;
      failures_ = 1;
    } else if (suspended_ && failures_ > options_.suspended_attempts) {
      return std::nullopt;
    }
    const auto first = suspended_ ? options_.suspended_pause : options_.first_pause;
    const auto longest = suspended_ ? options_.suspended_pause : options_.max_pause;
    return std::chrono::duration_cast<std::chrono::milliseconds>(back_off(failures_, first, longest, chance));
  }

 private:
  const CallbackOptions& options_;
  unsigned failures_ = 0;
  bool suspended_ = false;
};

}  // namespace lrt::subscription

#pragma once

#include <algorithm>
#include <chrono>
#include <optional>

#include <lrt/subscription/options.hpp>

namespace lrt::subscription {

/// How long a receiver that fails is borne with (CallbackOptions).
class Patience {
 public:
  explicit Patience(const CallbackOptions& options) : options_(options) {}

  bool suspended() const noexcept { return suspended_; }
  /// The last attempt failed.
  bool tried() const noexcept { return failures_ > 0; }

  void succeeded() noexcept {
    failures_ = 0;
    suspended_ = false;
  }
  /// How long to wait before the next attempt; nullopt: there is to be none, the subscription is over.
  /// @param chance  in [0, 1): spreads the attempts of many
  std::optional<std::chrono::milliseconds> failed(double chance) noexcept {
    ++failures_;
    if (!suspended_ && failures_ >= options_.attempts) {
      suspended_ = true;
      failures_ = 1;
    } else if (suspended_ && failures_ > options_.suspended_attempts) {
      return std::nullopt;
    }
    auto pause = options_.suspended_pause;
    if (!suspended_) {
      pause = options_.first_pause;
      for (unsigned i = 1; i < failures_ && pause < options_.longest_pause; ++i) pause *= 2;
      pause = std::min(pause, options_.longest_pause);
    }
    return std::chrono::milliseconds(static_cast<std::chrono::milliseconds::rep>(static_cast<double>(pause.count()) * (0.5 + chance)));
  }

 private:
  const CallbackOptions& options_;
  unsigned failures_ = 0;
  bool suspended_ = false;
};

}  // namespace lrt::subscription

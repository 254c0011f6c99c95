// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include <lrt/base/clock.hpp>
#include <lrt/http/message.hpp>

#include "src/http/robot_time.hpp"

namespace lrt::engine {
inline namespace v0 {

/// Until when a command is worth carrying out; nullopt: its sender has not said it.
struct Expiry {
  using Instant = std::chrono::steady_clock::time_point;

  std::optional<Instant> valid_until{};   ///< it must be accepted before
  std::optional<Instant> start_before{};  ///< an invocation, also one that was accepted, must begin before

  bool is_late(Instant now) const noexcept { return valid_until && now >= *valid_until; }
  bool begins_late(Instant now) const noexcept { return start_before && now >= *start_before; }
};

/// Judges the expiry of a command that waits for the host. Until it is accepted, both times count; then only start_before.
/// @par Threads  Any. Nothing here locks or allocates.
class ExpiryCheck {
 public:
  ExpiryCheck(const Clock& clock, const Expiry& expiry) : clock_(clock), expiry_(expiry) {}

  /// The sender is told that the command was accepted. False: passes() has found before that it is late.
  bool accept() noexcept { return become(State::accepted); }
  /// The command begins now, unless it is late.
  bool passes() noexcept {
    const Expiry::Instant now = clock_.now().steady;
    return !expiry_.begins_late(now) && !(expiry_.is_late(now) && become(State::late));
  }
  bool is_accepted() const noexcept { return state_.load(std::memory_order_acquire) == State::accepted; }
  /// When it will be late; nullopt: never.
  std::optional<Expiry::Instant> deadline() const noexcept {
    const auto& valid = expiry_.valid_until;
    const auto& start = expiry_.start_before;
    return !valid || is_accepted() ? start : !start ? valid : std::min(*valid, *start);
  }

 private:
  enum class State : std::uint8_t { open, accepted, late };
  bool become(State wanted) noexcept {
    State known = State::open;
    return state_.compare_exchange_strong(known, wanted, std::memory_order_acq_rel) || known == wanted;
  }

  const Clock& clock_;
  const Expiry expiry_;
  std::atomic<State> state_{State::open};
};

/// The time of this run of the server, and what requests say in it.
/// @par Threads  Any.
class RunTime {
 public:
  using Instant = Expiry::Instant;

  explicit RunTime(const Clock& clock);

  /// The stamp of an instant of the clock.
  http::RobotTime at(Instant now) const noexcept;
  /// The opposite. Of another run, or too far in the past: an instant before this run.
  Instant instant(const http::RobotTime& stamp) const noexcept;
  /// What a request says, or what is wrong with that, for a 400.
  std::variant<Expiry, std::string> expiry_of(const http::Request& request) const;
  const Clock& clock() const noexcept { return clock_; }

 private:
  const Clock& clock_;
  const Instant begin_;
  const std::uint64_t instance_;
};

/// The header field with the stamp of a response. It is made at most each 50 ms: an older stamp makes clients stricter.
/// @par Threads  One thread at a time.
class StampedFields {
 public:
  explicit StampedFields(const RunTime& time) : time_(time) {}

  const http::Fields& at(TimePoint now);

 private:
  const RunTime& time_;
  Expiry::Instant made_{};
  http::Fields fields_;
};

}  // namespace v0
}  // namespace lrt::engine

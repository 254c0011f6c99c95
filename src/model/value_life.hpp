// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>

#include <lrt/model/detail/callables.hpp>

namespace lrt::model {
inline namespace v0 {

struct PropertySpec;

/// The life of a written value (PropertyHandle::expires()): until when it holds unless it is written again, and what happens then.
///
/// @par Threads  Any, unless a function says more.
class ValueLife {
 public:
  using Instant = std::chrono::steady_clock::time_point;

  ValueLife(std::chrono::milliseconds life, LapseFunction lapse) : life_(life), lapse_(std::move(lapse)) {}
  ~ValueLife() = default;
  ValueLife(const ValueLife&) = delete;
  ValueLife& operator=(const ValueLife&) = delete;

  std::chrono::milliseconds life() const noexcept { return life_; }
  /// Before the property is registered.
  LapseFunction& function() noexcept { return lapse_; }
  /// The value was written at this time, and holds until the life after it. The value may be renewed by an older time only if it has no life.
  void renew(Instant written) noexcept {
    Ticks known = until_.load(std::memory_order_acquire);
    const Ticks until = (written + life_).time_since_epoch().count();
    while (known != ended && (known == none || known < until) && !until_.compare_exchange_weak(known, until, std::memory_order_acq_rel)) {}
  }
  /// The value may have been written: it has a life if it had none.
  void begin(Instant written) noexcept {
    Ticks known = none;
    until_.compare_exchange_strong(known, (written + life_).time_since_epoch().count(), std::memory_order_acq_rel);
  }
  /// A present life is over at this time; Instant::max(): there is none.
  Instant until() const noexcept {
    const Ticks until = until_.load(std::memory_order_acquire);
    return until == ended ? Instant::max() : Instant(Instant::duration(until));
  }
  /// Whether the life is over, and nobody knew it before: the caller calls lapse().
  bool take(Instant now) noexcept {
    Ticks until = until_.load(std::memory_order_acquire);
    const Ticks at = now.time_since_epoch().count();
    while (until != ended && until != none && until <= at)
      if (until_.compare_exchange_weak(until, none, std::memory_order_acq_rel)) return true;
    return false;
  }
  /// Calls the function of the user, whose exceptions pass through.
  void lapse() { lapse_(); }
  /// The property is removed: no lapse begins from now on.
  void end() noexcept { until_.store(ended, std::memory_order_release); }

  bool on_executor = false;  ///< its lambda runs on an executor; set before it is in a queue
  // For the queue that it is in (engine::LapseQueue).
  std::shared_ptr<PropertySpec> queued;  ///< its property, which the queue keeps alive; null: it is in no queue
  PropertySpec* next = nullptr;          ///< the property after it there

 private:
  using Ticks = Instant::rep;
  static constexpr Ticks none = std::numeric_limits<Ticks>::max(), ended = std::numeric_limits<Ticks>::min();

  const std::chrono::milliseconds life_;
  LapseFunction lapse_;
  std::atomic<Ticks> until_{none};
};

}  // namespace v0
}  // namespace lrt::model

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/model/detail/wake_signal.hpp>
#include <lrt/subscription/options.hpp>

#include "src/engine/deadline_queue.hpp"
#include "src/engine/host_calls.hpp"
#include "src/engine/property_values.hpp"
#include "src/engine/publish_rhythm.hpp"
#include "src/engine/registry.hpp"

namespace lrt::engine {
inline namespace v0 {

class InvocationResource;

/// Finds what the robot has changed in observed resources, and which actions are available.
///
/// It scans on its own schedule: for a property with short regular intervals when the next value is due, else every scan period while
/// there are changes. Otherwise it sleeps until publish() wakes it. So a loop at 1 kHz makes no system call and costs one scan for each step,
/// and a quiet robot costs none. More frequent calls of is_due() cause more scans, up to five in a scan period.
class ChangeScanner {
 public:
  using Instant = std::chrono::steady_clock::time_point;

  ChangeScanner(PropertyValues& values, Registry& registry, const HostCalls& calls, const subscription::SubscriptionOptions& options,
                const Clock& clock)
      : values_(values), registry_(registry), calls_(calls), options_(options), clock_(clock) {
    availability_signal_->attach(wake_signal_);
  }

  void watch(PropertyResource& property);
  void unwatch(PropertyResource& property);
  void watch(InvocationResource& invocation);
  void unwatch(InvocationResource& invocation);
  /// Watches the availability of actions, for a resource whose representations state it.
  void watch_availability();
  void unwatch_availability();

  /// Scans at once, and later on its own schedule.
  void start() noexcept;
  bool is_scanning() const noexcept { return scanning_; }
  bool is_due(TimePoint now) const noexcept;
  /// Collects the changes. The next scan goes on where this one ends.
  /// @param had_changes  other code has already found changes
  /// @param until        the end of its time; nullopt: other code has used it up
  void scan(TimePoint now, bool had_changes, std::optional<Instant> until);
  /// Takes over which actions the robot has made available or unavailable.
  /// @return  something has changed
  bool take_availability();
  /// Reads pulled properties whose sample period is over, and removes expired values.
  void read_samples(TimePoint now);
  std::optional<Instant> next_deadline() const;

  const std::shared_ptr<model::WakeSignal>& wake_signal() const noexcept { return wake_signal_; }
  /// Reports that the availability of an action has changed.
  const std::shared_ptr<model::ChangeSignal>& availability_signal() const noexcept { return availability_signal_; }

 private:
  struct Watched {
    PropertyResource* property;
    PublishRhythm rhythm;
  };
  bool has_changes() const;
  bool scan_properties(TimePoint now, Instant until);
  /// When to scan for values that are published at regular intervals; nullopt: there are none.
  std::optional<Instant> due_by_rhythm() const;
  bool is_slow(const PublishRhythm& rhythm) const noexcept { return rhythm.period() > 4 * options_.scan_period; }
  bool watches_nothing() const noexcept { return properties_.empty() && invocations_.empty() && availability_watchers_ == 0; }
  void sample_later(PropertyResource& property, TimePoint now);

  PropertyValues& values_;
  Registry& registry_;
  const HostCalls& calls_;
  const subscription::SubscriptionOptions& options_;
  const Clock& clock_;
  const std::shared_ptr<model::WakeSignal> wake_signal_ = std::make_shared<model::WakeSignal>();
  const std::shared_ptr<model::ChangeSignal> availability_signal_ = std::make_shared<model::ChangeSignal>();

  std::vector<Watched> properties_;
  std::size_t next_property_ = 0;  ///< where the next scan begins
  bool left_ = false;              ///< the last scan had no time for all
  std::vector<InvocationResource*> invocations_;
  std::size_t availability_watchers_ = 0;
  DeadlineQueue<ResourceId> samples_;
  bool scanning_ = false;  ///< next_scan_ is set
  Instant next_scan_{};
  Instant earliest_scan_{};  ///< on request
  unsigned idle_scans_ = 0;  ///< without a change that came at an irregular time
};

}  // namespace v0
}  // namespace lrt::engine

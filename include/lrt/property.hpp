// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <utility>

#include <lrt/model/detail/slot.hpp>
#include <lrt/model/property_handle.hpp>

namespace lrt {
inline namespace v0 {

/// Handle to a pushed Property: the robot's code publishes its values, and the server answers GET without the host.
/// publish() works before and after Server::add(), and has no effect once the thing is removed.
/// Thing::property<T>(path) makes it.
///
/// @par Threads  Set-up: one thread at a time, before Server::add(). publish(): any one thread at a time per property.
/// @par Implements  R0.3, R1.9, paper 5.2
template <class T>
class PushedProperty : public model::PropertyHandle<PushedProperty<T>, T> {
  using Base = model::PropertyHandle<PushedProperty<T>, T>;

 public:
  /// An empty handle, to be assigned later.
  PushedProperty() noexcept = default;

  /// Passes the present value to the engine. A bit-identical value is not a change (SPEC 3.8), unless every_sample() is
  /// set.
  /// @par Errors  None is reported. If T owns memory and there is none left, the last value is kept. A second thread that
  ///              publishes at the same time fails a check of the headers (base/misuse.hpp); without checks its behaviour
  ///              is undefined.
  /// @par Time  No lock. No allocation if T is trivially destructible (numbers, structs of numbers). A number takes about
  ///            30 ns in a loop at 1 kHz, more if caches are cold (docs/performance.md), with any number of
  ///            subscribers. One system call if the property is observed and the engine
  ///            sleeps, see subscription::SubscriptionOptions::scan_period and always_scan; or if it is urgent().
  /// @par Implements  R0.11, R0.12
  void publish(const T& value) noexcept {
    if (!this->begin_write("publish")) return;
    model::publish_to(*this->slot_, value);
    this->end_write();
  }
  /// The same for a value that is older than this call: that of a sensor with a clock of its own, or of another robot.
  /// Representations and subscribers get `at` as the time of the value (SPEC 3.8). If the value is not a change, the
  /// time stays as it was.
  /// @param at  when the value became what it is, UTC
  /// @par Time  As publish(value), without a look at the clock.
  /// @par Implements  SPEC 3.6, 3.8
  void publish(const T& value, std::chrono::system_clock::time_point at) noexcept {
    if (!this->begin_write("publish")) return;
    model::publish_to(*this->slot_, value, at);
    this->end_write();
  }

  /// Sets how many published values are kept between two scans of the engine while a subscriber has a queue. Such a
  /// subscriber gets each kept value. Values that a queue does not get count as dropped (lrt:dropped). The default
  /// suffices for the longest queue that a subscriber may request, within
  /// subscription::SubscriptionOptions::max_kept_bytes. That limit does not apply to `samples`. 0: only the newest
  /// value is kept.
  /// @param samples  at most 1,000,000; more: invalid_option from Server::add()
  PushedProperty& keep(std::size_t samples) {
    if (this->is_editable("keep") && this->begin_write("keep")) this->set_keep(samples), this->end_write();
    return *this;
  }
  /// While the property is observed, each publish() wakes the engine by a system call, so that the value is sent at
  /// once. Use it for events that come at irregular times and must not wait. Without it the engine predicts when a
  /// regular publish() is due, and finds an irregular one after at most subscription::SubscriptionOptions::scan_period.
  PushedProperty& urgent() {
    if (this->is_editable("urgent") && this->begin_write("urgent")) this->slot_->set_urgent(), this->end_write();
    return *this;
  }
  /// Counts a repeated value as a change: a new time, and a notification.
  PushedProperty& every_sample() {
    if (this->is_editable("every_sample")) this->slot_->set_every_sample();
    return *this;
  }

 private:
  friend class Thing;
  explicit PushedProperty(model::PushedSetup&& setup) noexcept : Base(std::move(setup)) {}
};

/// Handle to a pulled Property: a lambda reads its value when a client requests it or observes it. changed() works
/// before and after Server::add(), and has no effect once the thing is removed. Thing::property(path, read) makes it.
///
/// @par Threads  Set-up: one thread at a time, before Server::add(). changed(): any.
/// @par Implements  R0.3, R1.9, paper 5.2
template <class T>
class PulledProperty : public model::PropertyHandle<PulledProperty<T>, T> {
  using Base = model::PropertyHandle<PulledProperty<T>, T>;

 public:
  /// An empty handle, to be assigned later.
  PulledProperty() noexcept = default;

  /// Notifies the engine that the value has changed. If the property is observed, `read` is called soon.
  /// @par Threads  Any.
  /// @par Time     No lock, no allocation; a system call as in publish().
  void changed() noexcept {
    if (this->changes_) this->changes_->changed();
    else if constexpr (detail::checks) this->report_empty("changed");
  }

  /// Sets the period at which `read` is called while the property is observed. Zero: only after changed(). Default:
  /// subscription::SubscriptionOptions::sample_period.
  PulledProperty& sample(std::chrono::milliseconds period) {
    if (this->is_editable("sample")) this->set_sample_period(period);
    return *this;
  }

 private:
  friend class Thing;
  explicit PulledProperty(model::PulledSetup&& setup) noexcept : Base(std::move(setup)) {}
};

}  // namespace v0
}  // namespace lrt

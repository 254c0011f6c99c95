#include "src/engine/change_scanner.hpp"

#include <algorithm>

#include <lrt/engine/engine.hpp>

#include "src/engine/resources/action.hpp"
#include "src/engine/resources/property.hpp"

namespace lrt::engine {

namespace {

bool has_change(const PropertyResource& property) {
  return property.spec->slot ? property.spec->slot->has_change() : property.spec->changes->has_change();
}

}  // namespace

void ChangeScanner::watch(PropertyResource& property) {
  properties_.push_back(&property);
  if (model::SlotBase* slot = property.spec->slot.get()) {
    property.seen_lost = slot->lost();
    slot->set_observed(true);
  } else {
    property.spec->changes->set_observed(true);
    sample_later(property, clock_.now());
  }
  start();
}

void ChangeScanner::unwatch(PropertyResource& property) {
  if (property.spec->slot) property.spec->slot->set_observed(false);
  else property.spec->changes->set_observed(false);
  samples_.clear(property.next_sample);
  properties_.erase(std::find(properties_.begin(), properties_.end(), &property));
}

void ChangeScanner::watch(InvocationResource& invocation) {
  invocations_.push_back(&invocation);
  invocation.control->set_observed(true);
  start();
}

void ChangeScanner::unwatch(InvocationResource& invocation) {
  invocation.control->set_observed(false);
  invocations_.erase(std::find(invocations_.begin(), invocations_.end(), &invocation));
}

void ChangeScanner::start() noexcept {
  wake_signal_->stay_awake();
  scanning_ = true;
  idle_scans_ = 0;
  next_scan_ = {};
}

bool ChangeScanner::is_due(TimePoint now) const noexcept {
  if (scanning_) return next_scan_ <= now.steady;
  return !wake_signal_->asleep() && !(properties_.empty() && invocations_.empty());
}

bool ChangeScanner::has_changes() const {
  return std::any_of(properties_.begin(), properties_.end(), [](const PropertyResource* p) { return has_change(*p); }) ||
         std::any_of(invocations_.begin(), invocations_.end(),
                     [](const InvocationResource* i) { return !i->finished() && i->control->fraction() != i->progress; });
}

void ChangeScanner::scan(TimePoint now, bool had_changes) {
  scanning_ = true;
  next_scan_ = now.steady + options_.scan_period;
  const Instant until = values_.catch_up_end();  // of all properties together
  bool changes = had_changes;
  for (PropertyResource* property : properties_) {
    if (property->spec->slot ? !property->spec->slot->has_change() : !property->spec->changes->take()) continue;
    changes = true;
    values_.refresh_observed(*property, until);
  }
  for (InvocationResource* invocation : invocations_) {
    const double before = invocation->progress;
    invocation->refresh();
    changes |= invocation->progress != before;
  }
  // A fifth of the time at most, however much clients have subscribed to.
  const Instant after = clock_.now().steady;
  next_scan_ = std::max(next_scan_, after + 4 * (after - now.steady));
  idle_scans_ = changes ? 0 : idle_scans_ + 1;
  if (properties_.empty() && invocations_.empty()) {
    scanning_ = false;
  } else if (!options_.always_scan && idle_scans_ > options_.idle_scans_before_sleep) {
    wake_signal_->sleep();
    if (has_changes()) wake_signal_->stay_awake();  // published between the scan and the sleep
    else scanning_ = false;
  }
}

void ChangeScanner::sample_later(PropertyResource& property, TimePoint now) {
  const auto period = property.spec->sample_period.value_or(options_.sample_period);
  if (period.count() > 0) samples_.set(property.next_sample, now.steady + period, property.id);
}

void ChangeScanner::read_samples(TimePoint now) {
  while (const auto id = samples_.take_due(now.steady)) {
    auto& property = static_cast<PropertyResource&>(*registry_.find(*id));
    property.next_sample.reset();
    if (!property.refresh_state.running && !calls_.overloaded()) values_.refresh_observed(property, values_.catch_up_end());
    sample_later(property, now);
  }
}

std::optional<ChangeScanner::Instant> ChangeScanner::next_deadline() const {
  std::optional<Instant> first = samples_.next();
  if (scanning_ && (!first || next_scan_ < *first)) first = next_scan_;
  return first;
}

}  // namespace lrt::engine

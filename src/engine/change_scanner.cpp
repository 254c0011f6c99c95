// SPDX-License-Identifier: Apache-2.0
#include "src/engine/change_scanner.hpp"

#include <algorithm>

#include <lrt/engine/engine.hpp>

#include "src/engine/resources/action.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"

namespace lrt::engine {

namespace {

bool has_change(const PropertyResource& property) {
  return property.spec->slot ? property.spec->slot->has_change() : property.spec->changes->has_change();
}

}  // namespace

void ChangeScanner::watch(PropertyResource& property) {
  properties_.push_back({&property, {}});
  if (model::SlotBase* slot = property.spec->slot.get()) {
    property.seen_lost = slot->lost();
    slot->set_observed(true);
    sample_later(property, clock_.now());
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
  properties_.erase(std::find_if(properties_.begin(), properties_.end(), [&](const Watched& w) { return w.property == &property; }));
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

void ChangeScanner::watch_availability() {
  if (++availability_watchers_ == 1) availability_signal_->set_observed(true);
  start();
}

void ChangeScanner::unwatch_availability() {
  if (--availability_watchers_ == 0) availability_signal_->set_observed(false);
}

void ChangeScanner::start() noexcept {
  wake_signal_->stay_awake();
  scanning_ = true;
  idle_scans_ = 0;
  next_scan_ = earliest_scan_ = {};
}

bool ChangeScanner::is_due(TimePoint now) const noexcept {
  if (wake_signal_->is_urgent() || scanning_) return earliest_scan_ <= now.steady;
  return !wake_signal_->asleep() && !watches_nothing();
}

bool ChangeScanner::has_changes() const {
  return availability_signal_->has_change() ||
         std::any_of(properties_.begin(), properties_.end(), [](const Watched& w) { return has_change(*w.property); }) ||
         std::any_of(invocations_.begin(), invocations_.end(),
                     [](const InvocationResource* i) { return !i->finished() && i->control->fraction() != i->progress; });
}

void ChangeScanner::scan(TimePoint now, bool had_changes, std::optional<Instant> until) {
  wake_signal_->take_urgent();
  bool irregular = had_changes;
  irregular |= take_availability();
  left_ = !until;
  if (until) irregular |= scan_properties(now, *until);
  for (InvocationResource* invocation : invocations_) {
    const double before = invocation->progress;
    invocation->refresh();
    irregular |= invocation->progress != before;
  }
  idle_scans_ = irregular ? 0 : idle_scans_ + 1;
  // At most a fifth of the time, regardless of the number of subscriptions.
  const Instant after = clock_.now().steady;
  earliest_scan_ = std::max(now.steady + options_.scan_period / 5, after + 4 * (after - now.steady));
  std::optional<Instant> next = due_by_rhythm();
  if (options_.always_scan || idle_scans_ <= options_.idle_scans_before_sleep) {
    const Instant periodical = now.steady + options_.scan_period;
    next = next ? std::min(*next, periodical) : periodical;
  }
  if (left_) next = earliest_scan_;
  scanning_ = next && !watches_nothing();
  if (scanning_) {
    wake_signal_->stay_awake();
    next_scan_ = std::max(*next, earliest_scan_);
  } else if (!watches_nothing()) {
    wake_signal_->sleep();
    if (!has_changes()) return;
    wake_signal_->stay_awake();  // published between the scan and the sleep
    scanning_ = true;
    next_scan_ = earliest_scan_;
  }
}

/// Returns whether a value was found that was published at an irregular time.
/// @param until  of all properties together
bool ChangeScanner::scan_properties(TimePoint now, Instant until) {
  bool irregular = false;
  const std::size_t count = properties_.size();
  for (std::size_t i = 0; i < count && !left_; ++i) {
    Watched& watched = properties_[(next_property_ + i) % count];
    PropertyResource& property = *watched.property;
    const bool pushed = property.spec->slot != nullptr;
    if (pushed ? !property.spec->slot->has_change() : !property.spec->changes->take()) {
      watched.rhythm.missed(now.steady);
      continue;
    }
    left_ = values_.refresh_observed(property, until);
    if (left_ || (i + 1 < count && clock_.now().steady >= until)) {  // the others come first next time
      next_property_ = (next_property_ + i + 1) % count;
      left_ = true;
    }
    irregular |= !pushed;
    if (!pushed || property.spec->slot->is_urgent()) continue;
    // The wall clock may have been set since, a value that the user's code encodes comes later, and a user may give another time.
    const auto age = now.utc - property.modified;
    const bool known = !property.spec->slot->has_source_times() && age >= std::chrono::seconds(0) && age < std::chrono::seconds(1);
    watched.rhythm.found(known ? now.steady - std::chrono::duration_cast<PublishRhythm::Duration>(age) : now.steady, now.steady);
    irregular |= !watched.rhythm.is_regular();
  }
  return irregular;
}

std::optional<ChangeScanner::Instant> ChangeScanner::due_by_rhythm() const {
  std::optional<Instant> first;
  for (const Watched& w : properties_)
    if (const auto due = w.rhythm.due(); due && !is_slow(w.rhythm) && (!first || *due < *first)) first = due;
  if (!first) return std::nullopt;
  // Finds all values together that were published in one step of the loop.
  Instant last = *first;
  for (const Watched& w : properties_)
    if (const auto due = w.rhythm.due(); due && *due < *first + options_.scan_period / 5) last = std::max(last, *due);
  return last;
}

bool ChangeScanner::take_availability() {
  if (!availability_signal_->take()) return false;
  std::vector<ActionResource*> changed;
  for (const auto& [path, thing] : registry_.things())
    for (const auto& action : thing->actions)
      if (action->take_availability()) changed.push_back(action.get());
  if (changed.empty()) return false;
  registry_.structure_changed();  // the links of their Things have changed
  for (ActionResource* action : changed) action->mark_changed();
  return true;
}

void ChangeScanner::sample_later(PropertyResource& property, TimePoint now) {
  if (property.spec->slot) {
    const auto period = property.in_graph ? property.in_graph->expires_after : std::chrono::milliseconds(0);
    const auto rest = property.value.is_null() ? period : std::chrono::duration_cast<std::chrono::milliseconds>(property.modified + period - now.utc);
    if (period.count() > 0) samples_.set(property.next_sample, now.steady + std::clamp(rest, std::chrono::milliseconds(1), period), property.id);
    return;
  }
  std::chrono::milliseconds period = options_.sample_period;
  if (property.spec->sample_period) period = *property.spec->sample_period;
  if (period.count() > 0) samples_.set(property.next_sample, now.steady + period, property.id);
}

void ChangeScanner::read_samples(TimePoint now) {
  while (const auto id = samples_.take_due(now.steady)) {
    auto& property = static_cast<PropertyResource&>(*registry_.find(*id));
    property.next_sample.reset();
    if (property.spec->slot) {
      values_.take_published(property);
      property.expire(now.utc);
    } else if (!property.is_refreshing() && !calls_.overloaded()) {
      values_.refresh_observed(property, values_.catch_up_end());
    }
    sample_later(property, now);
  }
}

std::optional<ChangeScanner::Instant> ChangeScanner::next_deadline() const {
  std::optional<Instant> first = samples_.next();
  const auto take = [&first](Instant due) { first = first ? std::min(*first, due) : due; };
  if (wake_signal_->is_urgent()) take(earliest_scan_);
  else if (scanning_) take(next_scan_);
  return first;
}

}  // namespace lrt::engine

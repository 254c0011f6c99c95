// SPDX-License-Identifier: Apache-2.0
#include "src/engine/message_schedule.hpp"

#include <algorithm>
#include <exception>
#include <iterator>
#include <string>
#include <utility>

#include "src/engine/receivers/receiver.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/stamps.hpp"

namespace lrt::engine {

namespace {

using Pending = subscription::Backlog::Pending;

/// Resources whose representations take longer get at most a fifth of the time together.
constexpr std::chrono::milliseconds short_work{2};
constexpr int rest_per_work = 4;

/// It is a property that was never read: its representation would be null. One that cannot be read says why in the state.
bool lacks_value(const Resource& resource, const Audience& audience) {
  bool lacks = false;
  if (const ValueResource* const values = resource.values(); values && values->reads() >= ValueResource::Reads::values)
    values->for_each_property([&](const PropertyResource& p) {
      if (!audience.sees(p)) return;
      const bool says_why = p.is_failing() && values->reads() == ValueResource::Reads::readable_values;
      lacks = lacks || (p.value.is_null() && !says_why);
    });
  return lacks;
}

bool has_representation(const Resource& resource) {
  const OwnRepresentation* const own = resource.own_representation();
  return !own || own->has_representation();
}

}  // namespace

/// Queues are filled in scans, whose share of time is bounded: a request that causes a change must not wait until all queues
/// have it in four syntaxes. They are filled at once for commands, and before a new value replaces one that is not queued yet.
void MessageSchedule::changed(SubscriptionResource& s) {
  if (!s.queues() || s.suspended) {
    s.backlog.mark_changed();
    return announce(s);
  }
  if (fills_now(s)) return enqueue(s);
  if (s.marked == Pending::changed) s.backlog.count_dropped(1);
  mark(s, Pending::changed);
}

bool MessageSchedule::fills_now(const SubscriptionResource& s) {
  return (fills_queues_ && !is_over_ && may_fill()) || s.observed.observable()->is_urgent();
}

void MessageSchedule::mark(SubscriptionResource& s, Pending as) {
  s.marked = std::max(s.marked, as);
  if (!std::exchange(s.listed, true)) marked_.push_back(s.channel);
  if (!scanner_.is_scanning()) scanner_.start();
}

void MessageSchedule::fill(SubscriptionResource& s) {
  if (std::exchange(s.marked, Pending::no) != Pending::no) enqueue(s);
}

void MessageSchedule::begin(SubscriptionResource& s) {
  s.changes.begin(change_number(s.observed, s.audience));
  if (!has_representation(s.observed)) return;
  if (s.queues()) enqueue(s, false);
  else changed(s);
}

bool MessageSchedule::repeat(SubscriptionResource& s) {
  if (s.awaits_value || !has_representation(s.observed)) return false;
  if (s.queues()) {
    if (!s.receiver->repeats() || !s.backlog.empty()) return false;  // what is in the queue follows
    s.last_tag.clear();
    enqueue(s, false);
    return false;  // it was announced
  }
  s.last_tag.clear();
  s.backlog.mark_pending();
  return !s.next_message && !std::exchange(s.ready_announced, true);
}

void MessageSchedule::add_last(SubscriptionResource& s) {
  if (s.backlog.take_pending() == Pending::no) return;
  if (Representation* last = represent(s); last && last->tag != s.last_tag) s.backlog.push_last(s.receiver->message_of(*last, representations_));
}

/// @param is_change  counted as dropped if it has no representation
void MessageSchedule::enqueue(SubscriptionResource& s, bool is_change) {
  if (s.awaits_value && lacks_value(s.observed, s.audience)) return;  // the change is in its description only
  if (!representations_.ready(s.observed, s.its_variant, true, s.audience)) {
    const auto done = [this, channel = s.channel, is_change](const Result<void>& result, TimePoint) {
      SubscriptionResource* waiting = subscribers_.find(channel);
      if (waiting && result) enqueue(*waiting, is_change);
      else if (waiting && is_change) waiting->backlog.count_dropped(1);
    };
    values_.refresh(s.observed, Encodings::of(s.its_variant), done, s.audience);
    return;
  }
  Representation* representation = represent(s);
  if (!representation) {
    if (is_change) s.backlog.count_dropped(1);
    return;
  }
  const std::string& last = s.backlog.newest() ? s.backlog.newest()->tag : s.last_tag;
  if (representation->tag == last) {
    if (is_change) s.changes.unchanged(change_number(s.observed, s.audience));
    else if (!s.backlog.newest()) s.changes.knows(change_number(s.observed, s.audience));
    return;
  }
  const subscription::Item& item = s.receiver->message_of(*representation, representations_);
  s.changes.seen(item->stamp.number);
  s.backlog.push(item);
  announce(s);
  if (fills_queues_ && std::exchange(filled_, item.get()) != item.get()) has_time();  // it may have been made just now
}

/// nullptr: it cannot be encoded now.
Representation* MessageSchedule::represent(SubscriptionResource& s) {
  Result<Representation*> made = representations_.make(s.observed, s.base, s.its_variant, s.audience);
  const bool is_expected = !made && made.error().code == Errc::unsupported_syntax && !s.receiver->chose_media_type();
  if (!made && !s.failing && !is_expected) responses_.log(LogLevel::error, s.observed.path + ": " + made.error().message);
  s.failing = !made;
  return made ? *made : nullptr;
}

/// A representation was made for a subscriber without a queue. Those for queues are made in scans, which rest as well.
void MessageSchedule::took(const Resource& observed, Instant before) {
  const Instant after = clock_.now().steady;
  const auto number = static_cast<std::uint64_t>(observed.id);
  if (after - before <= short_work) {
    slow_.erase(number);
    return;
  }
  rest_end_ = after + rest_per_work * (after - before);
  if (!slow_.insert(number).second) return;
  for (auto at = slow_.begin(); at != slow_.end();) at = registry_.find(ResourceId{*at}) ? std::next(at) : slow_.erase(at);
}

/// Until when no representation is made for a subscriber; nullopt: it may be made, or there is one already.
std::optional<MessageSchedule::Instant> MessageSchedule::rest_of(const SubscriptionResource& s, TimePoint now) const {
  if (rest_end_ <= now.steady || slow_.count(static_cast<std::uint64_t>(s.observed.id)) == 0 || s.observed.observable()->is_urgent())
    return std::nullopt;
  return representations_.is_made(s.observed, s.base, s.its_variant, s.audience) ? std::nullopt : std::optional(rest_end_);
}

void MessageSchedule::announce(SubscriptionResource& s) {
  if (s.held || s.ready_announced || s.next_message || s.backlog.empty()) return;
  s.ready_announced = true;
  s.receiver->announce(ready_);
}

void MessageSchedule::announce_heartbeat(SubscriptionResource& s) {
  if (std::exchange(s.ready_announced, true)) return;
  s.receiver->announce(ready_);
}

subscription::Item MessageSchedule::next_item(SubscriptionResource& s, TimePoint now) {
  s.ready_announced = false;
  if (s.awaits_value) return nullptr;
  if (!s.backlog.empty() && now.steady < s.backlog.due()) {
    wait_until_due(s);
    return nullptr;
  }
  subscription::Item item = s.backlog.take_item();
  if (const Pending pending = item ? Pending::no : s.backlog.take_pending(); pending != Pending::no) {
    if (!representations_.ready(s.observed, s.its_variant, true, s.audience)) {
      // The user's encoders have to run first.
      s.backlog.put_back(pending);
      s.ready_announced = true;
      const auto done = [this, channel = s.channel](const Result<void>&, TimePoint) {
        SubscriptionResource* waiting = subscribers_.find(channel);
        if (!waiting) return;
        waiting->ready_announced = false;
        announce(*waiting);
      };
      values_.refresh(s.observed, Encodings::of(s.its_variant), done, s.audience);
      return nullptr;
    }
    if (const auto rest = rest_of(s, now)) {
      s.backlog.put_back(pending);
      next_messages_.set(s.next_message, *rest, s.channel);
      return nullptr;
    }
    const bool was_made = representations_.is_made(s.observed, s.base, s.its_variant, s.audience);
    const Instant before = clock_.now().steady;
    Representation* representation = represent(s);
    if (!was_made) took(s.observed, before);
    if (representation && representation->tag != s.last_tag) item = s.receiver->message_of(*representation, representations_);
    else if (representation) s.changes.unchanged(change_number(s.observed, s.audience));
  }
  if (!item) return nullptr;
  s.ready_announced = true;
  s.left_out = s.changes.sent(item->stamp.number);
  ++s.messages;
  s.last_tag = item->tag;
  s.backlog.sent(now.steady);
  return item;
}

void MessageSchedule::wait_until_due(SubscriptionResource& s) { next_messages_.set(s.next_message, s.backlog.due(), s.channel); }

void MessageSchedule::begin_filling() {
  fills_queues_ = true;
  is_over_ = false;
  fills_ = 0;
  filled_ = nullptr;
  fill_end_ = values_.catch_up_end();
}

bool MessageSchedule::has_time() noexcept {
  is_over_ = is_over_ || clock_.now().steady >= fill_end_;
  return !is_over_;
}

/// At least one, and as many as there is time for.
void MessageSchedule::fill_marked() {
  std::size_t filled = 0;
  while (filled < marked_.size() && !is_over_) {
    SubscriptionResource* const s = subscribers_.find(marked_[filled++]);
    if (!s) continue;
    s->listed = false;
    fill(*s);
    (void)may_fill();
  }
  marked_.erase(marked_.begin(), marked_.begin() + static_cast<std::ptrdiff_t>(filled));
}

void MessageSchedule::notify_of_structure() {
  if (notified_structure_ == registry_.structure()) return;
  notified_structure_ = registry_.structure();
  begin_filling();
  subscribers_.for_each([this](SubscriptionResource& s) {
    if (s.observed.state(notified_structure_) == s.observed.state(0)) return;  // it does not depend on the structure
    // No change is known to be lost.
    if (!s.queues() || s.suspended) {
      s.backlog.mark_pending();
      announce(s);
    } else if (fills_now(s)) {
      enqueue(s);
    } else {
      mark(s, Pending::maybe);
    }
  });
  fills_queues_ = false;
}

void MessageSchedule::scan(TimePoint now) {
  try {
    for (std::size_t most = max_at_once; most > 0; --most) {
      const auto channel = next_messages_.take_due(now.steady);
      if (!channel) break;
      SubscriptionResource& s = *subscribers_.find(*channel);
      s.next_message.reset();
      s.ready_announced = false;
      announce(s);
    }
    scanner_.read_samples(now);
    if (scanner_.is_due(now)) {
      begin_filling();
      const bool had_marked = !marked_.empty();
      fill_marked();
      // The queues get this change before the next one is taken.
      scanner_.scan(now, had_marked, marked_.empty() ? std::optional(fill_end_) : std::nullopt);
      fills_queues_ = false;
      if (!marked_.empty() && !scanner_.is_scanning()) scanner_.start();
    }
    notify_of_structure();
  } catch (const std::exception& e) {
    fills_queues_ = false;
    responses_.log(LogLevel::error, "observers could not be notified of a change", e);
  }
}

std::optional<MessageSchedule::Instant> MessageSchedule::next_deadline() const {
  if (ready_.has_pushes()) return Instant{};
  return next_messages_.next();
}

}  // namespace lrt::engine

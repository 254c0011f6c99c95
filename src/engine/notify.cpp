#include <algorithm>

#include "src/engine/impl.hpp"

namespace lrt::engine {

// How a change reaches subscribers: publish() leaves a value in a slot; look() finds it and marks the observers; next_ready() names their
// channels; whoever delivers asks for the representation when it can send it, and gets the one that is newest then.

void Engine::Impl::changed(Resource& resource) {
  ++resource.revision;
  tell(resource);
  if (resource.kind != Kind::property) return;
  auto& property = static_cast<PropertyResource&>(resource);
  tell(property.thing->state);
  if (!property.spec->slot) return;
  if (const std::uint64_t lost = property.spec->slot->lost(); lost != property.lost) {
    for (SubscriptionResource* s : property.observers)
      if (s->backlog.policy().queues()) s->backlog.count_dropped(lost - property.lost);
    property.lost = lost;
  }
}

void Engine::Impl::tell(Resource& resource) {
  for (SubscriptionResource* s : resource.observers) note(*s);
}

/// There is something new for a subscriber. What a queue gets is rendered at looks only, whose share of time is bounded, and for commands:
/// a request that finds news must not pay for all who want to have it in four syntaxes.
void Engine::Impl::note(SubscriptionResource& s) {
  if (!s.backlog.policy().queues() || s.retry_policy.suspended()) {
    s.backlog.mark_changed();
    return schedule(s);
  }
  if (telling_ || s.observed.kind == Kind::action || s.observed.kind == Kind::invocation) return queue(s);
  if (!std::exchange(s.marked, true)) marked_.push_back(s.channel);
  if (!looking_) start_looking();
}

void Engine::Impl::queue(SubscriptionResource& s) {
  const Rendering* rendering = render_for(s);
  if (!rendering) return;
  const std::string& last = s.backlog.newest() ? s.backlog.newest()->tag : s.last_tag;
  if (rendering->tag == last) return;
  s.backlog.push({rendering->body, rendering->tag});
  schedule(s);
}

const Rendering* Engine::Impl::render_for(SubscriptionResource& s) {
  const Result<const Rendering*> rendering = render(s.observed, s.base, s.form, 1);
  if (!rendering && !s.failing) log(LogLevel::error, s.observed.path + ": " + rendering.error().message);
  s.failing = !rendering;
  return rendering ? *rendering : nullptr;
}

void Engine::Impl::schedule(SubscriptionResource& s) {
  if (s.named || s.timer || s.under_way || s.backlog.empty()) return;
  s.named = true;
  if (s.protocol == Protocol::callback) return callbacks_ready_.push_back({s.channel, s.receiver});
  const bool urgent = s.observed.kind == Kind::action || s.observed.kind == Kind::invocation;
  (urgent ? urgent_ : ready_).push_back(s.channel);
}

void Engine::Impl::set_timer(SubscriptionResource& s) {
  clear_timer(s);
  s.timer = channel_timers_.emplace(s.backlog.due(), s.channel);
}

void Engine::Impl::clear_timer(SubscriptionResource& s) {
  if (s.timer) channel_timers_.erase(*s.timer);
  s.timer.reset();
}

/// What to give a subscriber now. After nothing it is named again when there is something.
std::optional<subscription::Item> Engine::Impl::next_item(SubscriptionResource& s, TimePoint now) {
  std::optional<subscription::Item> item;
  s.named = false;
  if (!s.backlog.empty() && now.steady < s.backlog.due()) {
    set_timer(s);
  } else if (!(item = s.backlog.take_item()) && s.backlog.take_pending()) {
    const Rendering* rendering = render_for(s);
    if (rendering && rendering->tag != s.last_tag) item = subscription::Item{rendering->body, rendering->tag};
  }
  if (!item) return std::nullopt;
  s.named = true;
  s.last_tag = item->tag;
  s.backlog.sent(now.steady);
  return item;
}

// ---------------------------------------------------------------------------------------------------------- WebSocket

std::optional<Channel> Engine::Impl::next_ready(TimePoint now) {
  if (stopped_) return std::nullopt;
  try {
    expire_subscriptions(now);
    if (looking_ ? next_look_ <= now.steady : !wake_signal_->asleep() && !(watched_.empty() && watched_invocations_.empty())) look(now);
    if (structure_changed_) {
      structure_changed_ = false;
      telling_ = true;
      for (const auto& [number, s] : by_channel_)
        if (s->observed.kind == Kind::thing || s->observed.kind == Kind::state) {
          if (s->backlog.policy().queues()) note(*s);
          else s->backlog.mark_pending(), schedule(*s);
        }
      telling_ = false;
    }
  } catch (const std::exception& e) {
    telling_ = false;
    log(LogLevel::error, std::string("telling of changes failed inside: ") + e.what());
  }
  for (std::deque<Channel>* list : {&urgent_, &ready_}) {
    while (!list->empty()) {
      const Channel first = list->front();
      list->pop_front();
      if (find_channel(first) || leaving_.count(static_cast<std::uint64_t>(first)) != 0) return first;
    }
  }
  return std::nullopt;
}

std::optional<Push> Engine::Impl::next_push(Channel channel, TimePoint now) {
  try {
    Push push;
    if (SubscriptionResource* s = find_channel(channel)) {
      auto item = next_item(*s, now);
      if (!item) return std::nullopt;
      ++s->delivered;
      push.message = std::move(item->body);
      push.text = s->form.is_text();
      return push;
    }
    const auto leaving = leaving_.find(static_cast<std::uint64_t>(channel));
    if (leaving == leaving_.end()) {
      push.close = 1001;
      return push;
    }
    if (!leaving->second.items.empty()) {
      push.message = std::move(leaving->second.items.front().body);
      push.text = leaving->second.text;
      leaving->second.items.pop_front();
      return push;
    }
    push.close = leaving->second.code;
    push.reason = std::move(leaving->second.reason);
    leaving_.erase(leaving);
    return push;
  } catch (const std::exception& e) {
    log(LogLevel::error, std::string("a notification failed inside: ") + e.what());
    return std::nullopt;
  }
}

void Engine::Impl::closed(Channel channel) noexcept {
  leaving_.erase(static_cast<std::uint64_t>(channel));
  SubscriptionResource* s = find_channel(channel);
  if (s && s->protocol == Protocol::websocket) unsubscribe(*s, 0, {});
}

// ------------------------------------------------------------------------------------------------------- web callbacks

std::optional<subscription::Notification> Engine::Impl::next_notification(Channel channel, TimePoint now) {
  SubscriptionResource* s = find_channel(channel);
  if (!s || stopped_ || s->protocol != Protocol::callback || s->under_way) return std::nullopt;
  try {
    auto item = next_item(*s, now);
    if (!item) return std::nullopt;
    subscription::Notification notice;
    notice.url = s->url;
    notice.body = item->body;
    notice.secret = s->secret.empty() ? options_.subscriptions.callbacks.secret : s->secret;
    notice.failed_before = s->retry_policy.tried();
    notice.fields.add("Content-Type", content_type(s->form, offers_of(s->observed).type_of(s->form)));
    notice.fields.add(notification_field, instance_);
    notice.fields.add("ETag", item->tag);
    http::LinkWriter links;
    links.add(bases_[s->base] + s->observed.path, "about");
    links.add(bases_[s->base] + s->path, "via");
    links.finish(notice.fields, {});
    s->under_way = std::move(item);
    return notice;
  } catch (const std::exception& e) {
    log(LogLevel::error, std::string("a notification failed inside: ") + e.what());
    return std::nullopt;
  }
}

void Engine::Impl::delivered(Channel channel, const subscription::DeliveryResult& receipt, TimePoint now) {
  SubscriptionResource* s = find_channel(channel);
  if (!s || !s->under_way) return;  // cancelled meanwhile
  subscription::Item item = *std::exchange(s->under_way, std::nullopt);
  s->named = false;
  if (receipt.status >= 200 && receipt.status < 300) {
    ++s->delivered;
    s->retry_policy.succeeded();
    s->last_error.clear();
    return schedule(*s);
  }
  s->last_error = receipt.error.empty() ? "the receiver answered " + std::to_string(receipt.status) : receipt.error;
  ++s->revision;
  if (receipt.status == 410 || receipt.refused) {
    log(LogLevel::info, s->path + " ends: " + s->last_error);
    return unsubscribe(*s, 0, {});
  }
  // Spread by what is different for each: nothing here may depend on a source of chance.
  const std::size_t spread = std::hash<std::string>()(s->id) ^ (s->backlog.dropped() * 7919 + s->revision * 104729);
  const auto pause = s->retry_policy.failed(static_cast<double>(spread % 1024) / 1024);
  if (!pause) {
    log(LogLevel::warning, s->path + " ends after too many failures: " + s->last_error);
    return unsubscribe(*s, 0, {});
  }
  if (s->backlog.policy().queues() && !s->retry_policy.suspended()) {
    s->backlog.put_back(std::move(item));
  } else {
    s->backlog.drop_items();
    s->backlog.mark_pending();
  }
  s->last_tag.clear();
  s->backlog.set_due(now.steady + *pause);
  if (!s->backlog.empty()) set_timer(*s);
}

// ------------------------------------------------------------------------------------------------- looking for changes

void Engine::Impl::watch(Resource& resource) {
  if (resource.kind == Kind::property) watch_property(static_cast<PropertyResource&>(resource));
  if (resource.kind == Kind::state)
    for (const auto& p : resource.thing->properties) watch_property(*p);
  if (resource.kind != Kind::invocation || resource.observers.size() != 1) return;
  auto& invocation = static_cast<InvocationResource&>(resource);
  watched_invocations_.push_back(&invocation);
  invocation.core->set_observed(true);
  start_looking();
}

void Engine::Impl::unwatch(Resource& resource) {
  if (resource.kind == Kind::property) unwatch_property(static_cast<PropertyResource&>(resource));
  if (resource.kind == Kind::state)
    for (const auto& p : resource.thing->properties) unwatch_property(*p);
  if (resource.kind != Kind::invocation || !resource.observers.empty()) return;
  auto& invocation = static_cast<InvocationResource&>(resource);
  invocation.core->set_observed(false);
  watched_invocations_.erase(std::find(watched_invocations_.begin(), watched_invocations_.end(), &invocation));
}

void Engine::Impl::watch_property(PropertyResource& property) {
  if (++property.watchers != 1) return;
  model::SlotBase* slot = property.spec->slot.get();
  watched_.push_back({slot, &property});
  if (slot) {
    property.lost = slot->lost();
    slot->set_observed(true);
  } else {
    property.spec->changes->set_observed(true);
    sample_later(property, clock_.now());
  }
  start_looking();
}

void Engine::Impl::unwatch_property(PropertyResource& property) {
  if (--property.watchers != 0) return;
  if (property.spec->slot) property.spec->slot->set_observed(false);
  else property.spec->changes->set_observed(false);
  if (property.sampling) sample_timers_.erase(*property.sampling);
  property.sampling.reset();
  watched_.erase(std::find_if(watched_.begin(), watched_.end(), [&](const Watched& w) { return w.property == &property; }));
}

void Engine::Impl::sample_later(PropertyResource& property, TimePoint now) {
  const auto period = property.spec->sample_period.value_or(options_.subscriptions.sample_period);
  if (period.count() > 0) property.sampling = sample_timers_.emplace(now.steady + period, property.path);
}

void Engine::Impl::expire_subscriptions(TimePoint now) {
  while (!channel_timers_.empty() && channel_timers_.begin()->first <= now.steady) {
    SubscriptionResource& s = *find_channel(channel_timers_.begin()->second);
    clear_timer(s);
    s.named = false;
    schedule(s);
  }
  while (!sample_timers_.empty() && sample_timers_.begin()->first <= now.steady) {
    auto& property = static_cast<PropertyResource&>(*find(sample_timers_.begin()->second));
    sample_timers_.erase(sample_timers_.begin());
    property.sampling.reset();
    if (!property.reading && !too_many_jobs()) read(property, [](const Result<void>&) {});
    sample_later(property, now);
  }
}

void Engine::Impl::start_looking() {
  wake_signal_->stay_awake();
  looking_ = true;
  quiet_looks_ = 0;
  next_look_ = {};
}

bool Engine::Impl::has_change() const {
  return !marked_.empty() || std::any_of(watched_.begin(), watched_.end(),
                     [](const Watched& w) { return w.slot ? w.slot->has_change() : w.property->spec->changes->has_change(); }) ||
         std::any_of(watched_invocations_.begin(), watched_invocations_.end(), [](const InvocationResource* i) {
           return !i->finished() && i->core->fraction() != i->progress;
         });
}

/// Takes what the robot has left for observed resources. Goes on by itself while there is news, then sleeps until the bell rings.
void Engine::Impl::look(TimePoint now) {
  const subscription::SubscriptionOptions& options = options_.subscriptions;
  looking_ = true;
  next_look_ = now.steady + options.scan_period;
  telling_ = true;
  bool news = !marked_.empty();
  for (const Channel channel : std::exchange(marked_, {})) {
    SubscriptionResource* s = find_channel(channel);
    if (!s) continue;
    s->marked = false;
    queue(*s);
  }
  for (const Watched& w : watched_) {
    if (w.slot ? !w.slot->has_change() : !w.property->spec->changes->take()) continue;
    news = true;
    if (w.slot) (void)sync(*w.property);
    else if (w.property->next_readers.empty()) read(*w.property, [](const Result<void>&) {});
  }
  for (InvocationResource* invocation : watched_invocations_) {
    const double before = invocation->progress;
    (void)sync(*invocation);
    news |= invocation->progress != before;
  }
  telling_ = false;
  // Whoever asks for much must not take all the time there is.
  const auto after = clock_.now().steady;
  next_look_ = std::max(next_look_, after + 4 * (after - now.steady));
  quiet_looks_ = news ? 0 : quiet_looks_ + 1;
  if (watched_.empty() && watched_invocations_.empty()) {
    looking_ = false;
  } else if (!options.always_scan && quiet_looks_ > options.idle_scans_before_sleep) {
    wake_signal_->sleep();
    if (has_change()) wake_signal_->stay_awake();
    else looking_ = false;
  }
}

}  // namespace lrt::engine

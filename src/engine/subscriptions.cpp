// SPDX-License-Identifier: Apache-2.0
#include "src/engine/subscriptions.hpp"

#include <algorithm>
#include <deque>
#include <exception>
#include <memory>
#include <new>
#include <utility>
#include <variant>

#include <lrt/base/ids.hpp>

#include "src/engine/description.hpp"
#include "src/engine/receivers/callback.hpp"
#include "src/engine/receivers/feed.hpp"
#include "src/engine/receivers/protocols.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/engine/stamps.hpp"

namespace lrt::engine {

Result<void> Subscriptions::check_options() const {
  if (Result<void> checked = parts_.rules.check_options(); !checked) return checked;
  const subscription::SubscriptionOptions& s = parts_.options.subscriptions;
  if (s.scan_period.count() <= 0)
    return unexpected(Errc::invalid_option, "subscriptions.scan_period: expected more than 0 us, found " + std::to_string(s.scan_period.count()));
  return {};
}

EngineCounts Subscriptions::counts() const {
  const Subscribers& all = parts_.subscribers;
  EngineCounts counts;
  counts.messages_sent = all.sent;
  counts.messages_dropped = all.dropped;
  all.for_each([&](const SubscriptionResource& s) { counts.messages_dropped += s.backlog.dropped(); });
  counts.queued_bytes = all.queued_bytes;
  counts.websockets = all.count(Protocol::websocket);
  counts.event_streams = all.count(Protocol::event_stream);
  counts.callbacks = all.count(Protocol::callback);
  counts.feeds = all.count(Protocol::feed);
  return counts;
}

void Subscriptions::report(SubscriptionEvent::Kind kind, const SubscriptionResource& s, bool requested) {
  if (parts_.options.reports_subscriptions) events_.push_back({kind, s.path, s.observed.path, entry_of(s.protocol).name, requested});
}

// ----------------------------------------------------------------------------------------------------------------- begin

Outcome Subscriptions::subscribe(Context& context, Protocol protocol) {
  SubscriptionRequests::Read read = requests_.read(context, protocol);
  if (auto* refused = std::get_if<http::Response>(&read)) return std::move(*refused);
  SubscriptionRequest& wanted = std::get<SubscriptionRequest>(read);
  return representations_.attempt(context, [this, wanted = std::move(wanted)](Context& c, bool current) -> Representations::Attempt {
    SubscriptionRequests::Selected selected = requests_.select(c, wanted, current);
    if (const auto* missing = std::get_if<Representations::Missing>(&selected)) return *missing;
    if (auto* refused = std::get_if<http::Response>(&selected)) return Outcome(std::move(*refused));
    return opening_of(wanted.protocol).open(c, std::get<SubscriptionRequest>(std::move(selected)), parts_, *this);
  });
}

Outcome Subscriptions::create(Context& context) {
  SubscriptionRequests::Described described = requests_.read_description(context);
  if (auto* outcome = std::get_if<Outcome>(&described)) return std::move(*outcome);
  SubscriptionRequest& wanted = std::get<SubscriptionRequest>(described);
  const Opening& opening = opening_of(wanted.protocol);
  return opening.open(context, std::move(wanted), parts_, *this);
}

Result<Subscribed> Subscriptions::make_feed(FeedSubscription wanted, TimePoint now) {
  Result<SubscriptionRequest> request = requests_.read_feed(std::move(wanted));
  if (!request) return Unexpected{std::move(request).error()};
  const SubscriptionResource& made = make(*std::move(request), 0, parts_.options.ids->next(), now.utc);
  return Subscribed{made.channel, made.queues(), meaning_of(made)};
}

Meaning Subscriptions::meaning_of(const SubscriptionResource& s) const {
  Meaning meaning;
  if (s.observed.kind().name != "property") return meaning;
  const model::PropertySpec& spec = *static_cast<const PropertyResource&>(s.observed).spec;
  const Quantity quantity = quantity_of(*spec.type, spec.facets);
  meaning.unit = quantity.unit.qudt.empty() ? quantity.unit.vom.text : quantity.unit.qudt.text;
  meaning.datatype = quantity.datatype.text;
  if (!spec.frame) return meaning;
  const std::string& base = parts_.bases[s.base];
  rdf::Graph graph;
  std::string frame(graph.term(object_term(graph, *spec.frame, base)).text);
  if (s.audience.sees_iri(frame, base, registry_)) meaning.frame = std::move(frame);
  return meaning;
}

SubscriptionResource& Subscriptions::make(const Context& context, SubscriptionRequest request) {
  const auto heartbeat = request.heartbeat;
  SubscriptionResource& made = make(std::move(request), context.base, parts_.options.ids->next(), context.now.utc);
  if (heartbeat.count() > 0) heartbeats_.begin(made.channel, heartbeat, context.now.steady);
  return made;
}

SubscriptionResource& Subscriptions::make(SubscriptionRequest request, std::size_t base, std::string id, Utc created) {
  SubscriptionsResource& container = *request.observed->subscriptions();
  std::string path = container.path + "/" + id;
  std::string known_tag = std::move(request.known_tag);
  const std::string client = std::move(request.client);
  const bool begins_with_refresh = request.begins_with_refresh, requested = !request.restored;
  auto made = std::make_unique<SubscriptionResource>(std::move(path), std::move(id), parts_.subscribers.new_channel(), std::move(request), base,
                                                     created, *this, parts_);
  SubscriptionResource& s = *made;
  s.last_tag = std::move(known_tag);
  s.changes.begin(change_number(s.observed, s.audience));
  s.share = parts_.subscribers.clients.take(client);
  report(SubscriptionEvent::Kind::made, s, requested);
  parts_.subscribers.add(s);
  container.subscriptions.push_back(std::move(made));
  registry_.add(s);
  container.mark_changed();
  keep_values(s, true);
  s.receiver->made();
  s.observed.add_observer(s, scanner_);
  if (begins_with_refresh) read_first_value(s);
  else parts_.schedule.begin(s);  // SPEC 3.6: the first notification at once
  return s;
}

void Subscriptions::read_first_value(SubscriptionResource& s) {
  s.awaits_value = true;
  const auto done = [this, channel = s.channel](const Result<void>& result, TimePoint) {
    SubscriptionResource* begun = find(channel);
    if (!begun) return;
    begun->awaits_value = false;
    if (result) parts_.schedule.begin(*begun);
    else if (!begun->receiver->waits_for_value()) return end(*begun, 1011, "the value could not be read");
    if (begun->queues()) parts_.schedule.announce(*begun);  // what came into the queue meanwhile
  };
  values_.refresh(s.observed, Encodings::of(s.its_variant), done, s.audience);
}

/// With a queue, each published value counts.
void Subscriptions::keep_values(const SubscriptionResource& s, bool keep) {
  if (s.queues()) values_.keep(s.observed, keep);
}

// ------------------------------------------------------------------------------------------------------------------- end

void Subscriptions::end(SubscriptionResource& s, std::uint16_t code, std::string reason) {
  if (code != 0 && s.receiver->gets_close()) s.receiver->close(closing_, code, std::move(reason));
  // An end is whole also when memory is exhausted: then nobody hears of it.
  try {
    report(SubscriptionEvent::Kind::ended, s, true);
  } catch (const std::bad_alloc&) {}
  parts_.schedule.forget(s);
  heartbeats_.forget(s.channel);
  parts_.subscribers.remove(s);
  keep_values(s, false);
  s.observed.remove_observer(s, scanner_);
  s.receiver->ended();
  SubscriptionsResource& container = *s.observed.subscriptions();
  try {
    container.mark_changed();
  } catch (const std::bad_alloc&) {}
  registry_.remove(s);
  auto& members = container.subscriptions;
  members.erase(std::find_if(members.begin(), members.end(), [&](const auto& m) { return m.get() == &s; }));
}

void Subscriptions::end_all_of(const Resource& observed, std::uint16_t code, const std::string& reason) {
  for (const Channel channel : parts_.subscribers.channels_if([&](const SubscriptionResource& s) { return &s.observed == &observed; }))
    end(*find(channel), code, reason);
}

void Subscriptions::resource_removed(SubscriptionResource& s) {
  if (s.observed.observable()->has_final_state && s.receiver->gets_close()) parts_.schedule.add_last(s);
  end(s, 1001, "the resource was removed");
}

/// The rest follows in the next turns, which are at once.
void Subscriptions::renew_rights() {
  parts_.rights.add();
  renewing_ = parts_.subscribers.channels_if([](const SubscriptionResource&) { return true; });
  renew_some();
}

void Subscriptions::renew_some() {
  for (std::size_t most = MessageSchedule::max_at_once; most > 0 && !renewing_.empty(); --most) {
    SubscriptionResource* s = find(renewing_.back());
    renewing_.pop_back();
    if (!s || (s->receiver->feed() && !s->audience.principal)) continue;  // of the host itself
    std::optional<Audience> audience = renewed(parts_.options, s->audience, s->observed);
    if (!audience) {
      end(*s, withdrawn_code, "the right to observe this resource was withdrawn");
    } else if (audience->view != s->audience.view) {
      if (audience->hides_something() && !audience->has_rights_of(s->audience)) {  // it may read less than what is queued shows
        s->backlog.drop_items();
        if (CallbackReceiver* const callback = s->receiver->callback()) callback->withdraw_item();
      }
      s->audience = *std::move(audience);
      s->changes.knows(change_number(s->observed, s->audience));
      s->observed.subscriptions()->mark_changed();
      parts_.schedule.changed(*s);
    }
  }
}

void Subscriptions::sign_out(std::string_view principal) {
  parts_.rights.sign_out(principal);
  const auto is_theirs = [&](const SubscriptionResource& s) { return s.audience.principal && s.audience.principal->name == principal; };
  for (const Channel channel : parts_.subscribers.channels_if(is_theirs))
    if (SubscriptionResource* const s = find(channel)) end(*s, withdrawn_code, "the principal was signed out");
}

// ------------------------------------------------------------------------------------------------------------ transports

void Subscriptions::scan(TimePoint now) {
  if (!renewing_.empty()) renew_some();
  heartbeats_.take_due(now.steady, MessageSchedule::max_at_once, [this](Channel channel) {
    if (SubscriptionResource* const s = find(channel)) parts_.schedule.announce_heartbeat(*s);
  });
  parts_.schedule.scan(now);
}

std::optional<std::chrono::steady_clock::time_point> Subscriptions::next_deadline() const {
  if (!renewing_.empty()) return std::chrono::steady_clock::time_point{};
  const auto message = parts_.schedule.next_deadline(), heartbeat = heartbeats_.next_deadline();
  return message && heartbeat ? std::min(*message, *heartbeat) : message ? message : heartbeat;
}

Push Subscriptions::heartbeat(const SubscriptionResource& s, TimePoint now) const {
  Push push;
  push.message = std::make_shared<const std::string>(s.receiver->heartbeat(parts_.time.at(now.steady).text()));
  return push;
}

std::optional<Channel> Subscriptions::next_ready(TimePoint now) {
  scan(now);
  ReadyChannels& ready = parts_.schedule.ready();
  for (std::deque<Channel>* list : {&ready.urgent, &ready.others}) {  // commands and closes first
    while (!list->empty()) {
      const Channel first = list->front();
      list->pop_front();
      if (find(first) || closing_.contains(first)) return first;
    }
  }
  return std::nullopt;
}

void Subscriptions::take_ready(std::vector<ReadyChannel>& channels, TimePoint now) {
  scan(now);
  ReadyChannels& ready = parts_.schedule.ready();
  std::size_t most = MessageSchedule::max_at_once;
  for (std::deque<Channel>* list : {&ready.urgent, &ready.others})
    for (; most > 0 && !list->empty(); --most) {
      channels.push_back({list->front(), list == &ready.urgent});
      list->pop_front();
    }
}

/// The next item, which is sent now.
subscription::Item Subscriptions::take_item(SubscriptionResource& s, TimePoint now) {
  subscription::Item item = parts_.schedule.next_item(s, now);
  if (!item) return nullptr;
  ++s.delivered;
  ++parts_.subscribers.sent;
  return item;
}

std::optional<Push> Subscriptions::next_push(Channel channel, TimePoint now) {
  try {
    SubscriptionResource* const s = find(channel);
    if (!s) return closing_.next(channel);
    if (std::optional<Push> rest = s->receiver->rest()) return rest;
    if (heartbeats_.take(channel)) return heartbeat(*s, now);
    const subscription::Item item = take_item(*s, now);
    if (!item) return std::nullopt;
    return s->receiver->push_of(item);
  } catch (const std::exception& e) {
    parts_.responses.log(LogLevel::error, "a notification could not be encoded", e);
    return std::nullopt;
  }
}

void Subscriptions::closed(Channel channel) {
  closing_.forget(channel);
  SubscriptionResource* const s = find(channel);
  if (s && s->receiver->gets_close()) end(*s, 0, {});
}

// ----------------------------------------------------------------------------------------------------------------- feeds

std::optional<FeedMessage> Subscriptions::next_feed_message(Channel channel, TimePoint now) {
  try {
    SubscriptionResource* const s = find(channel);
    if (!s) {
      FeedMessage message;
      subscription::Stamp stamp;
      const Push last = closing_.next(channel, &stamp);
      message.channel = channel;
      message.body = last.message;
      message.end = last.close != 0;
      message.queued = !message.end;
      message.at = stamp.at;
      message.number = stamp.number;
      return message;
    }
    FeedReceiver* const feed = s->receiver->feed();
    const subscription::Item item = feed ? take_item(*s, now) : nullptr;
    return item ? std::optional(feed->message(item)) : std::nullopt;
  } catch (const std::exception& e) {
    parts_.responses.log(LogLevel::error, "a message could not be encoded", e);
    return std::nullopt;
  }
}

bool Subscriptions::repeat(Channel channel) {
  SubscriptionResource* const s = find(channel);
  return s && parts_.schedule.repeat(*s);
}

// ------------------------------------------------------------------------------------------------------------ deliverers

std::optional<subscription::Notification> Subscriptions::next_notification(Channel channel, TimePoint now) {
  try {
    SubscriptionResource* const s = find(channel);
    CallbackReceiver* const callback = s ? s->receiver->callback() : nullptr;
    return callback ? callback->next(now) : std::nullopt;
  } catch (const std::exception& e) {
    parts_.responses.log(LogLevel::error, "a notification could not be encoded", e);
    return std::nullopt;
  }
}

void Subscriptions::delivered(Channel channel, const subscription::DeliveryResult& result, TimePoint now) {
  SubscriptionResource* const s = find(channel);
  CallbackReceiver* const callback = s ? s->receiver->callback() : nullptr;
  if (callback && !callback->delivered(result, now)) end(*s, 0, {});
}

}  // namespace lrt::engine

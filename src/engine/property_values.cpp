// SPDX-License-Identifier: Apache-2.0
#include "src/engine/property_values.hpp"

#include <algorithm>
#include <exception>
#include <string>
#include <utility>

#include "src/base/utf8.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/rdf/value_faults.hpp"

namespace lrt::engine {

namespace {

/// Longer reasons are cut: they are in each state of the Thing.
constexpr std::size_t max_failure_bytes = 200;

/// A text of the robot's program in well-formed UTF-8 without control characters, which each format can carry.
std::string short_text(std::string_view text) {
  std::string clean;
  while (!text.empty() && clean.size() < max_failure_bytes) {
    const std::size_t valid = utf8::find_invalid(text).value_or(text.size());
    const std::string_view begin = utf8::prefix(text.substr(0, valid), max_failure_bytes - clean.size());
    for (const char c : begin) clean += static_cast<unsigned char>(c) < 0x20 || c == 0x7F ? ' ' : c;
    if (begin.size() < valid) break;
    if (valid < text.size()) clean += '?';
    text.remove_prefix(std::min(text.size(), valid + 1));
  }
  return clean;
}

std::string failure_of(std::string_view why) { return "it could not be read: " + short_text(why); }

constexpr std::string_view not_returned = "the robot's program has not returned it in time";

/// An estimate of the memory that a value owns.
std::size_t bytes_of(const rdf::Value& value) {
  if (const std::string* text = value.text()) return text->size() + sizeof(std::string);
  std::size_t sum = sizeof(double);
  if (const rdf::Value::Sequence* members = value.sequence())
    for (const rdf::Value& member : *members) sum += bytes_of(member);
  return sum;
}

/// Representations by user-defined encoders may be much larger than the RDF of the value: an image, for example.
constexpr std::size_t min_bytes_with_representations = 64 * 1024;

Encoding encoded(model::RepresentationSpec& spec, const void* whole) {
  Encoding made{true, guarded<Bytes>([&]() -> Result<Bytes> {
                  if (!whole) return unexpected(Errc::unsupported_syntax, "its " + spec.media_type + " is not available now");
                  Result<Bytes> bytes = spec.encode(whole);
                  if (bytes && !*bytes) return unexpected(Errc::unsupported_syntax, "this value has no " + spec.media_type);
                  return bytes;
                })};
  if (!made.bytes && made.bytes.error().code != Errc::unsupported_syntax)
    made.bytes = unexpected(made.bytes.error().code, "its " + spec.media_type + " could not be encoded: " + made.bytes.error().message);
  return made;
}

/// Runs encoders on a value. User code.
void run_encoders(model::PropertySpec& spec, const std::vector<std::size_t>& encoders, const void* whole, ThinVector<Encoding>& encodings) {
  if (encodings.empty()) encodings.resize(spec.representations.size());
  for (const std::size_t i : encoders)
    if (!encodings[i].made) encodings[i] = encoded(spec.representations[i], whole);
}

/// Kept values that are older are dropped when a scan has no time left for them, so that what observers get is not old.
constexpr std::chrono::milliseconds max_age_of_kept{50};

/// Takes the published values in their order. After the time limit, the older ones are dropped and the newest is taken.
/// @param may_leave  at least one is taken; when the time is over, the others are left, unless the last one was old
template <class Use>
void take_each(model::SlotBase& slot, const Clock& clock, PropertyValues::Instant until, Use use, bool may_leave = false) {
  bool took = false;
  Utc last{};
  for (std::size_t left = slot.available(); left > 0; --left, took = true) {
    if (may_leave ? took : left > 1)
      if (const TimePoint now = clock.now(); now.steady >= until) {
        if (!may_leave || slot.has_source_times() || now.utc - last > max_age_of_kept) slot.skip_to_newest();
        if (may_leave) return;
        left = 1;
      }
    Sample sample;
    if (!slot.take(sample.value, sample.since)) return;
    last = sample.since;
    sample.whole = slot.whole();
    sample.number = slot.taken();
    use(std::move(sample));
  }
}

/// Calls a function with each property that an audience sees.
template <class F>
void for_each_seen(const ValueResource& values, const Audience& audience, F visit) {
  const bool hides = audience.hides_something();
  values.for_each_property([&](PropertyResource& property) {
    if (!hides || &property == &values || audience.sees(property)) visit(property);  // the rights at the resource itself are known
  });
}

/// @param current  it was read for this representation
bool must_wait_for(const HostContent& content, const ValueResource& shown, bool current, const Audience& audience) {
  const bool is_own = &content.resource() == &shown;
  if (!is_own && audience.hides_something() && !audience.sees(content.resource())) return false;
  return !current && (content.is_read_each_time() || (is_own && content.has_fault()));
}

}  // namespace

Encodings Encodings::of(Variant variant) noexcept {
  Encodings needed;
  if (variant.is_rdf()) needed.all = true;
  if (variant.kind() == Variant::Kind::encoded) needed.one = variant.encoder();
  return needed;
}

PropertyRefresh& PropertyValues::refresh_of(PropertyResource& property) {
  if (!property.refresh_state) property.refresh_state = std::make_unique<PropertyRefresh>();
  return *property.refresh_state;
}

bool PropertyValues::has_encodings(const PropertyResource& property, Encodings wanted) {
  for (std::size_t i = 0; i < property.spec->representations.size(); ++i)
    if (wanted.contains(i) && (property.encodings.size() <= i || !property.encodings[i].made)) return false;
  return true;
}

/// The encoders that refreshes and observers need.
std::vector<std::size_t> PropertyValues::wanted_encoders(const PropertyResource& property) {
  std::vector<std::size_t> wanted;
  const auto observed_in = [](const Resource& r, std::size_t i) {
    return std::any_of(r.observers.begin(), r.observers.end(), [i](const Observer* o) { return Encodings::of(o->variant()).contains(i); });
  };
  const auto is_waited_for = [refresh = property.refresh_state.get()](std::size_t i) {
    const auto contains = [i](const PropertyRefresh::Waiter& w) { return w.encodings.contains(i); };
    return refresh && std::any_of(refresh->waiters.begin(), refresh->waiters.end(), contains);
  };
  for (std::size_t i = 0; i < property.spec->representations.size(); ++i) {
    if (is_waited_for(i) || observed_in(property, i) || observed_in(property.whole_resource(), i)) wanted.push_back(i);
  }
  return wanted;
}

bool PropertyValues::needs_user_code(const PropertyResource& property) const {
  return property.spec->slot->runs_user_code() || !wanted_encoders(property).empty();
}

bool PropertyValues::ready(Resource& resource, Variant variant, bool current, const Audience& audience) {
  ValueResource* const with_values = resource.values();
  if (!with_values) return true;
  with_values->refresh();
  const ValueResource::Reads reads = with_values->reads();
  if (reads == ValueResource::Reads::nothing) return true;
  const bool values = reads >= ValueResource::Reads::values;
  const Encodings wanted = values ? Encodings::of(variant) : Encodings();
  bool all = true;
  for_each_seen(*with_values, audience, [&](PropertyResource& p) {
    if (!current) {
      if (p.spec->slot) {
        take_published(p);
        if ((p.spec->slot->has_change() || p.is_refreshing()) && (values || p.value.is_null())) all = false;
        if (p.is_failing() && reads == ValueResource::Reads::values) all = false;
      } else if (values) {
        all = false;
      }
    }
    if (!has_encodings(p, wanted) && !(reads == ValueResource::Reads::readable_values && p.is_failing())) all = false;
  });
  with_values->for_each_host_content([&](HostContent& content) {
    if (must_wait_for(content, *with_values, current, audience)) all = false;
  });
  return all;
}

void PropertyValues::refresh(Resource& resource, Encodings encodings, Done done, const Audience& audience) {
  struct Join {
    std::size_t open = 1;
    Result<void> result;
    Done done;
  };
  auto join = std::make_shared<Join>();
  join->done = std::move(done);
  const ValueResource* const with_values = resource.values();
  const ValueResource::Reads reads = with_values ? with_values->reads() : ValueResource::Reads::nothing;
  const bool is_of_thing = resource.thing && &resource == &resource.thing->state;  // which is removed with its properties
  // Shapes are of what is known: a value that cannot be read is no reason to keep them back.
  const bool tolerates = reads == ValueResource::Reads::readable_values || reads == ValueResource::Reads::known_values;
  const auto one_done = [join, is_of_thing, tolerates](const Result<void>& result, TimePoint now) {
    const auto is = [&](Errc code) { return result.error().code == code; };
    const bool fails = !result && (!tolerates || is(Errc::timed_out) || (is_of_thing && is(Errc::closed)));
    if (fails && join->result) join->result = result;
    if (--join->open == 0) join->done(join->result, now);
  };
  std::vector<PropertyResource*> properties;
  std::size_t late = 0;
  const auto is_late = [](const PropertyResource& p) { return p.refresh_state && p.refresh_state->late; };
  const auto add = [&](PropertyResource& p) {
    if (reads < ValueResource::Reads::values && !p.spec->slot) return;
    properties.push_back(&p);
    if (is_late(p)) ++late;
  };
  if (with_values) for_each_seen(*with_values, audience, add);
  if (reads == ValueResource::Reads::readable_values && late > 0 && late < properties.size())
    properties.erase(std::remove_if(properties.begin(), properties.end(), [&](const PropertyResource* p) { return is_late(*p); }), properties.end());
  join->open += properties.size();
  for (PropertyResource* p : properties) refresh(*p, encodings, one_done);
  if (with_values)
    with_values->for_each_host_content([&](HostContent& content) {
      if (!must_wait_for(content, *with_values, false, audience)) return;
      ++join->open;
      content.read([one_done, is_own = &content.resource() == with_values](const Result<void>& result, TimePoint now) {
        one_done(is_own ? result : Result<void>(), now);
      });
    });
  one_done({}, clock_.now());
}

bool PropertyValues::give_up(Resource& resource, const Audience& audience) {
  const ValueResource* const values = resource.values();
  if (!values) return false;
  std::vector<PropertyResource*> late;
  bool any_value = false, blocks = false;
  // A lambda that began much later has not had the time that a request has.
  const Instant latest = clock_.now().steady - options_.host_timeout / 2;
  for_each_seen(*values, audience, [&](PropertyResource& p) {
    if (p.is_refreshing() && p.refresh_state->begin <= latest)
      late.push_back(&p), blocks |= p.refresh_state->token && p.refresh_state->token->is_taken();
    else if (!p.value.is_null() && !p.is_failing()) any_value = true;
  });
  if (!any_value || !blocks) return false;
  for (PropertyResource* p : late) {
    if (!std::exchange(p->refresh_state->late, true) && options_.log)
      options_.log(LogLevel::warning, "property \"" + p->path + "\" could not be read: " + std::string(not_returned));
    fail(*p, not_returned);
  }
  return true;
}

void PropertyValues::refresh(PropertyResource& property, Encodings encodings, Done done) {
  PropertyRefresh& state = refresh_of(property);
  // If the host does not poll, most of these requests have already been answered with 503. They are removed.
  if (state.waiters.size() + state.next_waiters.size() >= 2 * options_.max_waiting_requests) {
    std::vector<PropertyRefresh::Waiter> waiters = std::exchange(state.waiters, {});
    for (auto& w : std::exchange(state.next_waiters, {})) waiters.push_back(std::move(w));
    const TimePoint now = clock_.now();
    for (auto& w : waiters) w.done(unexpected(Errc::timed_out, "the robot's program did not process the request in time"), now);
  }
  if (state.running) {
    state.next_waiters.push_back({encodings, std::move(done)});
    return;
  }
  state.waiters.push_back({encodings, std::move(done)});
  take_published(property);
  start(property);
}

bool PropertyValues::refresh_observed(PropertyResource& property, Instant until) {
  if (property.spec->slot) take_published(property, until, true);
  const bool more = !property.spec->slot || property.spec->slot->has_change();
  if (more && property.spec->slot && !property.is_refreshing() && !needs_user_code(property)) return true;
  if (more && !property.is_refreshing()) start(property);
  else if (more && !property.spec->slot && property.refresh_state->next_waiters.empty()) refresh(property, {}, [](const Result<void>&, TimePoint) {});
  return false;
}

void PropertyValues::take_published(PropertyResource& property) { take_published(property, catch_up_end()); }

void PropertyValues::take_published(PropertyResource& property, Instant until, bool may_leave) {
  model::SlotBase* slot = property.spec->slot.get();
  if (!slot || property.is_refreshing() || !slot->has_change() || needs_user_code(property)) return;
  // Each kept value is a change.
  const auto use = [&](Sample sample) { set_published(property, std::move(sample)); };
  take_each(*slot, clock_, until, use, may_leave);
  property.report_lost();
}

PropertyValues::Instant PropertyValues::catch_up_end() const { return clock_.now().steady + options_.subscriptions.max_catch_up_time; }

void PropertyValues::keep(Resource& resource, bool queued) {
  if (const ValueResource* const values = resource.values()) values->for_each_property([&](PropertyResource& p) { keep(p, queued); });
}

void PropertyValues::keep(PropertyResource& property, bool queued) {
  model::SlotBase* slot = property.spec->slot.get();
  if (!slot) return;
  if (queued && ++property.queues == 1) {
    take_published(property);
    slot->start_keeping(options_.subscriptions.max_queue_length, options_.subscriptions.max_kept_bytes);
    set_value_bytes(property);
  } else if (!queued && --property.queues == 0) {
    slot->stop_keeping();
  }
}

void PropertyValues::set_value_bytes(PropertyResource& property) {
  model::SlotBase* slot = property.spec->slot.get();
  if (!slot || !slot->keeps() || !slot->owns_memory() || property.value.is_null()) return;
  std::size_t encoded_bytes = property.spec->representations.empty() ? 0 : min_bytes_with_representations;
  for (const Encoding& e : property.encodings)
    if (e.made && e.bytes) encoded_bytes = std::max(encoded_bytes, (*e.bytes)->size());
  slot->set_value_bytes(bytes_of(property.value) + encoded_bytes);
}

void PropertyValues::start(PropertyResource& property) {
  PropertyRefresh& state = refresh_of(property);
  state.running = true;
  state.begin = clock_.now().steady;
  ends_if_thrown(property, [&] {
    if (property.spec->read) return read(property);
    std::vector<std::size_t> encoders = wanted_encoders(property);
    if (property.spec->slot->has_change()) return take(property, std::move(encoders));
    if (property.is_failing())
      return end(property, unexpected(state.failure_code, "property \"" + property.path + "\": " + property.failure()), clock_.now());
    encode(property, std::nullopt, std::move(encoders));
  });
}

/// A refresh ends after an internal error, so that the property can be read again.
template <class Step>
void PropertyValues::ends_if_thrown(PropertyResource& property, Step step) {
  try {
    step();
  } catch (const std::exception& e) {
    if (!property.is_refreshing()) throw;  // the refresh has ended, and a waiter has thrown
    try {
      fail(property, "internal server error");
    } catch (...) {}  // no memory for the reason, too
    end(property, Unexpected{thrown(e.what())}, clock_.now());
  }
}

/// A pulled property: calls its lambda on the thread that its Dispatch names.
void PropertyValues::read(PropertyResource& property) {
  property.refresh_state->token = calls_.call<model::Reading>(
      property.thing->where(*property.spec),
      [spec = property.spec]() -> Result<model::Reading> { return spec->read(!spec->representations.empty()); },
      [this, ref = Ref(property)](Result<model::Reading> reading, TimePoint now) {
        PropertyResource* p = registry_.find(ref);
        if (p) ends_if_thrown(*p, [&] { was_read(*p, std::move(reading), now); });
      });
}

void PropertyValues::was_read(PropertyResource& property, Result<model::Reading> reading, TimePoint now) {
  PropertyRefresh& state = *property.refresh_state;
  if (reading)
    if (std::string fault = rdf::fault_of_value(*property.spec->type, reading->value); !fault.empty())
      reading = unexpected(Errc::failed, std::move(fault));
  if (reading) {
    const std::vector<std::size_t> encoders = wanted_encoders(property);
    if (rdf::same(property.value, reading->value)) {
      recover(property);
      return encode(property, std::nullopt, encoders);
    }
    return encode(property, Sample{std::move(reading->value), std::move(reading->whole), now.utc, {}}, encoders);
  }
  const Errc code = reading.error().code == Errc::closed ? Errc::failed : reading.error().code;
  const Result<void> failed = unexpected(code, "property \"" + property.path + "\" could not be read: " + reading.error().message);
  if ((state.failure.empty() || !state.waiters.empty()) && options_.log) options_.log(LogLevel::warning, failed.error().message);
  fail(property, reading.error().message, code);
  end(property, failed, now);
}

/// A pushed property: what was published, through the user's traits and encoders.
void PropertyValues::take(PropertyResource& property, std::vector<std::size_t> encoders) {
  using Samples = std::vector<Sample>;
  property.refresh_state->token = calls_.call<Samples>(
      Dispatch::io_thread,
      [spec = property.spec, encoders = std::move(encoders), &clock = clock_, limit = options_.subscriptions.max_catch_up_time]() -> Result<Samples> {
        Samples samples;
        take_each(*spec->slot, clock, clock.now().steady + limit, [&](Sample sample) {
          run_encoders(*spec, encoders, sample.whole.get(), sample.encodings);
          samples.push_back(std::move(sample));
        });
        return samples;
      },
      [this, ref = Ref(property)](Result<Samples> samples, TimePoint now) {
        PropertyResource* p = registry_.find(ref);
        if (p) ends_if_thrown(*p, [&] { were_taken(*p, std::move(samples), now); });
      });
}

void PropertyValues::were_taken(PropertyResource& property, Result<std::vector<Sample>> samples, TimePoint now) {
  if (!samples) {
    const Result<void> failed = unexpected(samples.error().code, "property \"" + property.path + "\"" +
                                                                     (samples.error().code == Errc::unavailable ? ": " : " could not be encoded: ") +
                                                                     samples.error().message);
    if (!property.is_failing() && options_.log) options_.log(LogLevel::warning, failed.error().message);
    fail(property, samples.error().message, samples.error().code);
    return end(property, failed, now);
  }
  model::SlotBase& slot = *property.spec->slot;
  const Instant until = catch_up_end();
  for (std::size_t i = 0; i < samples->size(); ++i) {
    if (const std::size_t last = samples->size() - 1; i < last && clock_.now().steady >= until) {
      slot.count_lost(last - i);
      i = last;
    }
    set_published(property, std::move((*samples)[i]));
  }
  property.report_lost();
  encode(property, std::nullopt, wanted_encoders(property));
}

/// Runs the encoders whose result the value does not have yet.
/// @param sample  nullopt: the value that the property has
void PropertyValues::encode(PropertyResource& property, std::optional<Sample> sample, std::vector<std::size_t> encoders) {
  if (!sample)
    encoders.erase(
        std::remove_if(encoders.begin(), encoders.end(), [&](std::size_t i) { return property.encodings.size() > i && property.encodings[i].made; }),
        encoders.end());
  if (encoders.empty()) {
    if (sample) set(property, *std::move(sample));
    return end(property, {}, clock_.now());
  }
  const std::shared_ptr<const void> whole = sample ? sample->whole : property.whole;
  property.refresh_state->token = calls_.call<ThinVector<Encoding>>(
      Dispatch::io_thread,
      [spec = property.spec, whole, encoders]() -> Result<ThinVector<Encoding>> {
        ThinVector<Encoding> encodings;
        run_encoders(*spec, encoders, whole.get(), encodings);
        return encodings;
      },
      [this, ref = Ref(property), sample = std::move(sample)](Result<ThinVector<Encoding>> encodings, TimePoint now) mutable {
        PropertyResource* p = registry_.find(ref);
        if (p) ends_if_thrown(*p, [&] { were_encoded(*p, std::move(sample), std::move(encodings), now); });
      });
}

void PropertyValues::were_encoded(PropertyResource& property, std::optional<Sample> sample, Result<ThinVector<Encoding>> encodings, TimePoint now) {
  if (!encodings) {
    fail(property, encodings.error().message);
    return end(property, Unexpected{encodings.error()}, now);
  }
  if (sample) {
    sample->encodings = *std::move(encodings);
    set(property, *std::move(sample));
  } else {
    property.encodings.resize(property.spec->representations.size());
    for (std::size_t i = 0; i < encodings->size(); ++i)
      if ((*encodings)[i].made) property.encodings[i] = std::move((*encodings)[i]);
  }
  end(property, {}, now);
}

void PropertyValues::end(PropertyResource& property, const Result<void>& result, TimePoint now) {
  PropertyRefresh& state = *property.refresh_state;
  state.running = state.late = false;
  state.token = nullptr;
  std::vector<PropertyRefresh::Waiter> waiters = std::exchange(state.waiters, {});
  // Done first, so that new requests of the waiters wait for a later refresh. The value is kept until all waiters were called.
  UniqueFunction<void(TimePoint)> turn = std::exchange(state.next_turn, {});
  if (turn) state.running = true, state.begin = now.steady;
  else state.waiters = std::exchange(state.next_waiters, {});
  if (!state.waiters.empty()) start(property);
  for (auto& w : waiters) try {
      w.done(result, now);
    } catch (const std::exception& e) {
      // Its request gets 503 at its time limit. The others continue.
      try {
        if (options_.log) options_.log(LogLevel::error, std::string("internal error while making a response: ") + e.what());
      } catch (...) {}  // no memory for that, too
    }
  if (turn) turn(now);
}

void PropertyValues::take_turn(PropertyResource& property, UniqueFunction<void(TimePoint)> begin, TimePoint now) {
  PropertyRefresh& state = refresh_of(property);
  if (state.running) {
    state.next_turn = std::move(begin);
    return;
  }
  state.running = true;
  state.begin = now.steady;
  begin(now);
}

/// The state of its Thing says why the property has no value, until it has one again: the first reason, so that one that differs each time (a
/// counter, a time) does not change the state with each read. What a late lambda has done is a new reason.
void PropertyValues::fail(PropertyResource& property, std::string_view why, Errc code) {
  PropertyRefresh& state = refresh_of(property);
  state.failure_code = code;
  if (!state.failure.empty() && !state.late && property.spec->read) return;  // what is published says something new
  std::string failure = failure_of(why);
  if (state.failure == failure) return;
  property.mark_changing();
  state.failure = std::move(failure);
  ++state.failure_changes;
  property.mark_readability_changed();
}

void PropertyValues::recover(PropertyResource& property) {
  if (!property.is_failing()) return;
  property.mark_changing();
  property.refresh_state->failure.clear();
  ++property.refresh_state->failure_changes;
  property.mark_readability_changed();
}

void PropertyValues::set(PropertyResource& property, Sample sample) {
  property.mark_changing();
  property.count(sample.number);
  if (const std::string fault = sample.value.is_null() ? std::string() : rdf::fault_of_value(*property.spec->type, sample.value); !fault.empty()) {
    if (!std::exchange(property.is_fault_logged, true) && options_.log)  // it was published
      options_.log(LogLevel::error, "property \"" + property.path + "\" has no value: " + fault);
    sample.value = {};
    sample.whole = nullptr;
    sample.encodings.clear();
    refresh_of(property).failure = failure_of(fault);
    property.refresh_state->failure_code = Errc::failed;
  } else {
    property.is_fault_logged = false;
    if (property.is_failing()) property.refresh_state->failure.clear();
  }
  // The value and whether there is one are one change, which is counted as that of the value.
  property.value = std::move(sample.value);
  property.whole = std::move(sample.whole);
  property.modified = sample.since;
  property.encodings = std::move(sample.encodings);
  set_value_bytes(property);
  const model::PropertySpec& spec = *property.spec;
  std::size_t left = options_.max_value_members;
  property.only_octets = spec.octets && !fits(property.value, left) && rdf::octets_of(*spec.type, property.value);
  property.mark_value_changed();
}

void PropertyValues::set_published(PropertyResource& property, Sample sample) {
  if (property.spec->slot->every_sample() || !rdf::same(sample.value, property.value)) set(property, std::move(sample));
  else {
    property.count_unchanged(sample.number);
    recover(property);
  }
}

void PropertyValues::cancel(PropertyResource& property, TimePoint now) {
  if (!property.refresh_state) return;
  PropertyRefresh& state = *property.refresh_state;
  if (state.token) state.token->cancel();
  state.next_turn = {};
  for (auto* list : {&state.waiters, &state.next_waiters})
    for (auto& w : std::exchange(*list, {})) w.done(unexpected(Errc::closed, "the thing was removed while the request waited"), now);
}

}  // namespace lrt::engine

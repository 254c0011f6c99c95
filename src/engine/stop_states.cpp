// SPDX-License-Identifier: Apache-2.0
#include "src/engine/stop_states.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>

#include <lrt/model/resource_handle.hpp>

#include "src/engine/deadline_queue.hpp"
#include "src/engine/parts.hpp"
#include "src/engine/resources/action.hpp"
#include "src/engine/resources/collection.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/engine/stop_state.hpp"

namespace lrt::engine {
inline namespace v0 {

namespace {

using Instant = std::chrono::steady_clock::time_point;
using Word = StopHold::Word;

/// Who stopped a Thing, if no client did.
constexpr std::string_view by_itself = "the robot itself", by_somebody = "somebody";
/// How long the host may still say that the robot is stopped after the lambda of a release has succeeded, and how often it is asked meanwhile.
constexpr std::chrono::milliseconds release_time{1000}, release_period{20};
/// No answer has this number.
constexpr std::uint64_t no_answer = std::numeric_limits<std::uint64_t>::max();
constexpr std::size_t max_reported = 20;

/// In milliseconds: people read it.
Utc rounded(Utc time) noexcept { return std::chrono::time_point_cast<std::chrono::milliseconds>(time); }

Word word_of(const rdf::Value& value) noexcept {
  const bool* const is = value.boolean();
  return !is ? Word::unknown : *is ? Word::stopped : Word::moves;
}

class States;

/// A stop state, and what finds out about it.
struct Watched final : StopState, Observer {
  Watched(States& its_owner, ThingNode& node, PropertyResource& its_shown, std::shared_ptr<model::StopStateSpec> its_spec)
      : StopState{node, its_shown}, owner(its_owner), spec(std::move(its_spec)) {}

  Variant variant() const noexcept override { return Variant(rdf::Plain::json); }
  void resource_changed(SeenBy) override { say_changed(); }
  void resource_changes(SeenBy) override {}
  void values_missed(std::uint64_t, SeenBy) override {}
  void resource_removed() override {}
  bool queues() const noexcept override { return false; }
  void readability_changed() override { say_changed(); }
  void say_changed();

  States& owner;
  const std::shared_ptr<model::StopStateSpec> spec;
  PropertyResource* source = nullptr;  ///< that says it; nullptr: the lambda of `spec`
  // Questions to the host are numbered, so that an answer can be told from one that the host may have given before.
  std::uint64_t asked = 0;
  bool is_asking = false, asks_again = false;     ///< the lambda
  bool fails = false;                             ///< the last answer was none
  std::size_t open_stops = 0;                     ///< invocations of stops that have not ended
  std::uint64_t confirms = no_answer;             ///< the first answer that can confirm the newest stop
  bool overtook_release = false;                  ///< the lambda of a release may have run after it: no answer can confirm it
  bool is_unconfirmed = false;                    ///< such an answer did not; this was logged
  std::vector<Ref<InvocationResource>> releases;  ///< whose lambdas have succeeded
  std::uint64_t releases_from = no_answer;        ///< the first answer that can end the stop
  Instant release_until{};
  DeadlineQueue<Ref<PropertyResource>>::Place next_question;
};

class States final : public StopStates {
 public:
  explicit States(Parts& parts) : parts_(parts) {}

  void add(ThingNode& thing) override;
  void remove(ThingNode& thing) override;
  void report(const std::vector<std::string>& added) override;
  void sent(ActionResource& stop, const Context& context) override;
  void ended(ActionResource& stop, TimePoint now) override;
  void released(InvocationResource& release, TimePoint now) override;
  void advance(TimePoint now) override;
  std::optional<Instant> next_deadline() const override { return questions_.next(); }

  /// The Property that says it has another value.
  void source_changed(Watched& state);

 private:
  Watched* find(Ref<PropertyResource> shown) const;
  void ask(Watched& state, TimePoint now);
  void ask_lambda(Watched& state);
  /// @param number  of the question
  void answered(Watched& state, Word word, std::uint64_t number, TimePoint now);
  void ask_later(Watched& state, TimePoint now);
  void update(Watched& state, TimePoint now);
  void show(Watched& state, TimePoint now);
  void end_motion(ThingNode& thing, TimePoint now);
  void refresh(ThingNode& thing);
  static void list_commands(const ThingNode& thing, bool below, std::vector<std::string>& all);

  Parts& parts_;
  std::vector<std::unique_ptr<Watched>> states_;
  DeadlineQueue<Ref<PropertyResource>> questions_;
};

void Watched::say_changed() { owner.source_changed(*this); }

Watched* States::find(Ref<PropertyResource> shown) const {
  const PropertyResource* const property = parts_.registry.find(shown);
  return property ? const_cast<Watched*>(static_cast<const Watched*>(property->thing->stop_state)) : nullptr;
}

void States::add(ThingNode& thing) {
  std::shared_ptr<model::StopStateSpec> spec;
  for (const auto& a : thing.actions)
    if (a->spec->stop_state) spec = a->spec->stop_state;
  PropertyResource* shown = nullptr;
  for (const auto& p : thing.properties)
    if (p->spec->is_generated) shown = p.get();
  auto made = std::make_unique<Watched>(*this, thing, *shown, std::move(spec));
  Watched& state = *made;
  const TimePoint now = parts_.clock.now();
  for (const auto& a : thing.actions)
    if (a->spec == state.spec->release) state.release = a.get();
  state.value = {true, rounded(now.utc), std::string(by_itself)};
  states_.push_back(std::move(made));
  thing.stop_state = &state;
  if (state.spec->property) {
    for (const auto& p : thing.properties)
      if (p->spec == state.spec->property) state.source = p.get();
    if (state.source->spec->slot) state.source->spec->slot->set_urgent();
    else  // each read counts at once, before the engine gets the value
      state.source->spec->read = [read = std::move(state.source->spec->read), hold = state.hold](bool whole) mutable {
        try {
          model::Reading reading = read(whole);
          hold->reported = word_of(reading.value);
          return reading;
        } catch (...) {
          hold->reported = Word::unknown;
          throw;
        }
      };
    state.source->add_observer(state, parts_.scanner);
  }
  state.first_read = !state.source || !state.source->spec->slot;
  show(state, now);
  ask(state, now);
}

void States::remove(ThingNode& thing) {
  Watched& state = *find(Ref(thing.stop_state->shown));
  questions_.clear(state.next_question);
  if (state.source) state.source->remove_observer(state, parts_.scanner);
  thing.stop_state = nullptr;
  refresh(thing);
  states_.erase(std::find_if(states_.begin(), states_.end(), [&](const auto& s) { return s.get() == &state; }));
}

void States::list_commands(const ThingNode& thing, bool below, std::vector<std::string>& all) {
  const auto take = [&](const auto& resources, auto changes) {
    for (const auto& r : resources)
      if (may_move(*r->spec) && changes(*r->spec)) all.push_back(r->path);
  };
  take(thing.actions, [](const auto&) { return true; });
  take(thing.properties, [](const auto& spec) { return static_cast<bool>(spec.write); });
  take(thing.collections, [](const auto& spec) { return spec.create || spec.remove; });
  if (!below) return;
  for (const ThingNode* child : thing.children) list_commands(*child, true, all);
}

void States::report(const std::vector<std::string>& added) {
  std::vector<std::string> all;
  for (const std::string& path : added)
    if (const ThingNode* const thing = parts_.registry.find_thing(path); thing && !stop_states_of(*thing).empty())
      list_commands(*thing, thing->stop_state != nullptr, all);
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  if (all.empty()) return;
  std::string text = "unavailable while the robot is stopped: ";
  for (std::size_t i = 0; i < std::min(all.size(), max_reported); ++i) text += (i == 0 ? "" : ", ") + all[i];
  if (all.size() > max_reported) text += " and " + std::to_string(all.size() - max_reported) + " more";
  parts_.responses.log(LogLevel::info, text + ". Call harmless() for what moves nothing");
}

/// Its lambda is about to be handed out, so the rest is done later.
void States::sent(ActionResource& stop, const Context& context) {
  if (!stop.thing->stop_state) return;
  Watched& state = *find(Ref(stop.thing->stop_state->shown));
  const bool was_known = state.value.stopped && (state.hold->latched || state.hold->reported == Word::stopped);
  state.hold->latched = true;
  ++state.open_stops;
  state.confirms = no_answer;
  state.is_unconfirmed = false;
  if (!was_known) {  // a further stop costs nothing
    state.value = {true, rounded(context.now.utc), context.audience.principal ? context.audience.principal->name : std::string(by_somebody)};
    parts_.calls.inbox()->put([this, ref = Ref(state.shown)](TimePoint now) {
      if (Watched* const s = find(ref)) show(*s, now);
    });
  }
  if (!state.release) return;
  // A release that was sent before does not end this stop. If its lambda may run now, the host may say afterwards that nothing is stopped.
  const auto& open = state.release->invocations;
  const auto may_run = [](const auto& i) { return !i->finished() && !i->is_concluding && i->token && !i->token->cancel(); };
  if (std::any_of(open.begin(), open.end(), may_run)) state.overtook_release = true;
  state.releases.clear();
  state.releases_from = no_answer;
  parts_.invocations.end_by_stop(*state.release, context.now);
}

void States::ended(ActionResource& stop, TimePoint now) {
  if (!stop.thing->stop_state) return;
  Watched& state = *find(Ref(stop.thing->stop_state->shown));
  if (state.open_stops > 0) --state.open_stops;
  if (state.open_stops > 0) return;
  if (!state.overtook_release) state.confirms = state.asked + 1;
  ask(state, now);
}

void States::released(InvocationResource& release, TimePoint now) {
  const StopState* const of = release.action.thing->stop_state;
  if (!of || of->release != &release.action) return parts_.invocations.conclude_release(release, true, now);
  Watched& state = *find(Ref(of->shown));
  state.releases.push_back(Ref(release));
  state.releases_from = state.asked + 1;
  state.release_until = now.steady + release_time;
  ask(state, now);
}

void States::source_changed(Watched& state) {
  const bool is_pushed = state.source->spec->slot != nullptr;
  const Word word = state.source->is_failing() ? Word::unknown : word_of(state.source->value);
  if (is_pushed) state.hold->reported = word;
  // This is called while a value is stored: what follows from it comes later.
  parts_.calls.inbox()->put([this, ref = Ref(state.shown), word, is_pushed](TimePoint now) {
    Watched* const s = find(ref);
    if (!s) return;
    const bool waits = s->hold->latched || !s->releases.empty();
    if (is_pushed || !waits) return answered(*s, word, is_pushed ? s->asked : 0, now);
    ask(*s, now);
  });
}

void States::ask(Watched& state, TimePoint) {
  if (!state.source) return ask_lambda(state);
  const std::uint64_t number = ++state.asked;
  parts_.values.refresh(*state.source, {}, [this, ref = Ref(state.shown), number](const Result<void>& result, TimePoint now) {
    if (Watched* const s = find(ref)) answered(*s, result ? word_of(s->source->value) : Word::unknown, number, now);
  });
}

void States::ask_lambda(Watched& state) {
  if (state.is_asking) {
    state.asks_again = true;
    return;
  }
  state.is_asking = true;
  const std::uint64_t number = ++state.asked;
  parts_.calls.call<bool>(
      state.thing.spec->dispatch,
      [spec = state.spec, hold = state.hold]() -> Result<bool> {
        try {
          const bool is = spec->read();
          hold->reported = is ? Word::stopped : Word::moves;
          return is;
        } catch (...) {
          hold->reported = Word::unknown;
          throw;
        }
      },
      [this, ref = Ref(state.shown), number](const Result<bool>& is, TimePoint now) {
        Watched* const s = find(ref);
        if (!s) return;
        s->is_asking = false;
        if (!is && !s->fails)
          parts_.responses.log(LogLevel::warning,
                               "\"" + s->thing.self.path + "\" counts as stopped: its state could not be read: " + is.error().message);
        answered(*s, !is ? Word::unknown : *is ? Word::stopped : Word::moves, number, now);
        if (std::exchange(s->asks_again, false)) ask_lambda(*s);
      });
}

void States::answered(Watched& state, Word word, std::uint64_t number, TimePoint now) {
  StopHold& hold = *state.hold;
  state.first_read = false;
  state.fails = word == Word::unknown;
  hold.reported = word;
  if (hold.latched && state.open_stops == 0 && number >= state.confirms) {
    if (word == Word::stopped) {
      hold.latched = false;
    } else if (word == Word::moves && state.releases.empty() && !std::exchange(state.is_unconfirmed, true)) {
      parts_.responses.log(LogLevel::error,
                           "\"" + state.thing.self.path +
                               "\" was stopped, but its state does not say so: it counts as stopped until that says so or a release succeeds");
    }
  }
  std::vector<Ref<InvocationResource>> settled;
  bool ends = false;
  if (!state.releases.empty() && number >= state.releases_from) {
    ends = word == Word::moves && state.open_stops == 0;
    if (ends) {
      hold.latched = false;
      state.overtook_release = false;
    }
    if (ends || now.steady >= state.release_until) settled.swap(state.releases);
  }
  update(state, now);
  ask_later(state, now);
  for (const Ref<InvocationResource> ref : settled)
    if (InvocationResource* const release = parts_.registry.find(ref)) parts_.invocations.conclude_release(*release, ends, now);
}

/// A Property is read by the scanner, unless a release waits for it.
void States::ask_later(Watched& state, TimePoint now) {
  auto period = parts_.options.subscriptions.sample_period;
  if (period.count() <= 0) period = subscription::SubscriptionOptions().sample_period;
  if (!state.releases.empty()) period = release_period;
  else if (state.source) return questions_.clear(state.next_question);
  questions_.set(state.next_question, now.steady + period, Ref(state.shown));
}

void States::advance(TimePoint now) {
  while (const auto due = questions_.take_due(now.steady)) {
    Watched* const state = find(*due);
    if (!state) continue;
    state->next_question.reset();
    if (!state->is_asking) ask(*state, now);
  }
}

void States::update(Watched& state, TimePoint now) {
  const bool is = state.hold->holds();
  if (is == state.value.stopped) return;
  if (is) state.value = {true, rounded(now.utc), std::string(by_itself)};
  else state.value = {false, {}, {}};
  show(state, now);
}

void States::show(Watched& state, TimePoint now) {
  model::publish_to(*state.shown.spec->slot, state.value);
  parts_.values.take_published(state.shown);
  refresh(state.thing);
  parts_.registry.structure_changed();
  if (state.value.stopped && !state.first_read) end_motion(state.thing, now);
}

void States::refresh(ThingNode& thing) {
  for (const auto& a : thing.actions)
    if (a->take_availability()) a->mark_changed();
  // They state the reason in their own documents. Their values are the same, so their observers get no message.
  for (const auto& p : thing.properties)
    if (p->methods().put) ++p->revision;
  for (const auto& c : thing.collections) ++c->revision;
  for (ThingNode* child : thing.children) refresh(*child);
}

void States::end_motion(ThingNode& thing, TimePoint now) {
  for (const auto& a : thing.actions)
    if (may_move(*a->spec)) parts_.invocations.end_by_stop(*a, now);
  for (ThingNode* child : thing.children) end_motion(*child, now);
}

/// Only ActionSetup::set_stop_state() names this.
class StateExtension final : public StopExtension {
 public:
  std::unique_ptr<StopStates> make(Parts& parts) const override { return std::make_unique<States>(parts); }
  Result<void> complete(model::ThingSpec& thing) const override;
};
constexpr StateExtension state_extension;

Result<void> StateExtension::complete(model::ThingSpec& thing) const {
  const model::ActionSpec* stop = nullptr;
  for (const auto& a : thing.actions) {
    if (!a->stop_state) continue;
    if (stop)
      return unexpected(Errc::invalid_option,
                        "thing \"" + thing.path + "\": its stop state is declared twice; for its other stops call stop() without arguments");
    stop = a.get();
  }
  const std::string name = "action \"" + stop->location().substr(1) + "\": stop(): ";
  const auto is_in = [](const auto& all, const auto& one) { return std::find(all.begin(), all.end(), one) != all.end(); };
  const model::StopStateSpec& declared = *stop->stop_state;
  if (!declared.read && !declared.property)
    return unexpected(Errc::invalid_option, name + "expected a Property that Thing::property() returned, found an empty handle");
  if (declared.property && !is_in(thing.properties, declared.property))
    return unexpected(Errc::invalid_option,
                      name + "expected a Property of the same thing, found \"" + declared.property->location().substr(1) + "\"");
  if (declared.release) {
    if (!is_in(thing.actions, declared.release))
      return unexpected(Errc::invalid_option,
                        name + "expected a release of the same thing, found \"" + declared.release->location().substr(1) + "\"");
    if (static_cast<const model::ActionSpec&>(*declared.release).stop) return unexpected(Errc::invalid_option, name + "the release is a stop");
  }
  auto shown = std::make_shared<model::PropertySpec>();
  shown->is_generated = true;
  shown->path = "stopped";
  const auto is_taken = [&](const auto& r) { return r->path == shown->path; };
  while (std::any_of(thing.properties.begin(), thing.properties.end(), is_taken) ||
         std::any_of(thing.collections.begin(), thing.collections.end(), is_taken))
    shown->path += name_aside;
  shown->thing = thing.handles;
  shown->type = &rdf::traits<StopValue>::type();
  shown->slot = model::new_slot<StopValue>();
  shown->slot->set_urgent();
  shown->predicates.push_back(std::string(vocab::lrt_::stopState.text));
  const auto say = [&](Iri predicate, const char* text) { shown->statements.push_back({std::string(predicate.text), Object::tagged(text, "en")}); };
  say(vocab::dcterms::title, "Stopped");
  say(vocab::dcterms::description, "Whether the robot is stopped, since when and by whom. What moves is unavailable meanwhile.");
  thing.properties.push_back(std::move(shown));
  return {};
}

}  // namespace

}  // namespace v0
}  // namespace lrt::engine

namespace lrt::model {
inline namespace v0 {

void ActionSetup::set_stop_state(UniqueFunction<bool()> state, const ResourceSetup& release) {
  set_stop();
  auto& action = static_cast<ActionSpec&>(*spec_);
  action.stop_state = std::make_shared<StopStateSpec>(StopStateSpec{engine::state_extension, std::move(state), nullptr, release.spec_});
  if (release.spec_ && release.spec_->thing == spec_->thing) static_cast<ActionSpec&>(*release.spec_).releases = true;
}

void ActionSetup::set_stop_state(const ResourceSetup& property, const ResourceSetup& release) {
  set_stop_state(UniqueFunction<bool()>(), release);
  static_cast<ActionSpec&>(*spec_).stop_state->property = property.spec_;
}

}  // namespace v0
}  // namespace lrt::model

// SPDX-License-Identifier: Apache-2.0
#include "src/engine/stop_state.hpp"

#include <algorithm>
#include <string_view>

#include <lrt/rdf/lexical.hpp>

#include "src/engine/context.hpp"
#include "src/engine/overview.hpp"
#include "src/engine/resources/action.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/engine/responses.hpp"
#include "src/model/spec.hpp"

namespace lrt::engine {
inline namespace v0 {

namespace {
/// Why commands are refused, for all who see what they are sent to.
constexpr std::string_view stop_reason = "the robot is stopped";
}  // namespace

const StopState* stopped_by(const ThingNode& thing) noexcept {
  for (const ThingNode* t = &thing; t; t = t->parent)
    if (t->stop_state && t->stop_state->hold->holds()) return t->stop_state;
  return nullptr;
}

const StopState* refused_by(const ThingNode& thing) noexcept {
  for (const ThingNode* t = &thing; t; t = t->parent)
    if (const StopState* s = t->stop_state; s && s->hold->holds() && (!s->first_read || s->hold->latched)) return s;
  return nullptr;
}

bool may_move(const model::ResourceSpec& command) noexcept {
  if (command.harmless) return false;
  if (command.kind != model::ResourceSpec::Kind::action) return true;
  const auto& action = static_cast<const model::ActionSpec&>(command);
  return !action.stop && !action.releases;
}

std::string reason_of_stop(const ThingNode& thing, const model::ResourceSpec& command) {
  if (!may_move(command)) return {};
  return stopped_by(thing) ? std::string(stop_reason) : std::string();
}

std::vector<std::shared_ptr<const StopHold>> holds_of(const ThingNode& thing, const model::ResourceSpec& command) {
  std::vector<std::shared_ptr<const StopHold>> all;
  if (!may_move(command)) return all;
  for (const ThingNode* t = &thing; t; t = t->parent)
    if (t->stop_state) all.push_back(t->stop_state->hold);
  return all;
}

namespace {

/// Of the resource that a command names.
bool ends_a_stop(const model::ResourceSpec& command) noexcept {
  return command.kind == model::ResourceSpec::Kind::action && static_cast<const model::ActionSpec&>(command).releases;
}

/// A time as the value of a Property has it.
std::string stop_time(Utc time) { return rdf::lexical::format_instant(time.time_since_epoch()); }

/// Since when and by whom, as far as the sender may see it, and what ends it.
std::string stop_sentence(const StopState& state, const Context& context, const Responses& responses) {
  const Audience& audience = context.audience;
  std::string text(stop_reason);
  if (audience.sees(state.shown)) {
    const StopValue& value = state.value;
    if (value.since) text += " since " + stop_time(*value.since);
    if (value.by) text += " by " + *value.by;
    text += "; see " + responses.iri(context, state.shown.path);
  }
  if (state.release && audience.sees(*state.release)) text += "; what ends the stop is " + responses.iri(context, state.release->path);
  return text;
}

http::Response stop_refusal(const Context& context, const Responses& responses, std::string detail) {
  return responses.problem(context, {409, std::move(detail), {}, std::string(vocab::lrt_::Stopped.text)});
}

}  // namespace

std::optional<http::Response> judge_stop(const Context& context, const Responses& responses) {
  const Resource& resource = *context.resource;
  const model::ResourceSpec* const command = resource.command();
  const StopState* const state = command && may_move(*command) ? refused_by(*resource.thing) : nullptr;
  if (!state) return std::nullopt;
  return stop_refusal(context, responses, "this was not carried out: " + stop_sentence(*state, context, responses));
}

http::Response refused_by_stop(const Context& context, const Responses& responses) {
  const Resource* const resource = context.resource;
  const StopState* const state = resource && resource->thing ? stopped_by(*resource->thing) : nullptr;
  const model::ResourceSpec* const command = resource ? resource->command() : nullptr;
  const bool releases = command && ends_a_stop(*command);
  std::string detail = releases ? "this did not end the stop, because the robot says that it is still stopped, or a stop came after it"
                                : "this was not carried out to its end, because the robot was stopped";
  if (state) detail += ": " + stop_sentence(*state, context, responses);
  return stop_refusal(context, responses, std::move(detail));
}

std::vector<const StopState*> stop_states_of(const ThingNode& thing) {
  std::vector<const StopState*> all;
  for (const ThingNode* t = &thing; t; t = t->parent)
    if (t->stop_state) all.push_back(t->stop_state);
  return all;
}

void write_stop_states(Overview& o, const std::vector<const StopState*>& states) {
  const auto is_seen = [&](const StopState* s) { return o.sees(s->shown) && o.sees(s->thing.self); };
  if (std::none_of(states.begin(), states.end(), is_seen)) return;
  o.begin_array("stopStates");
  for (const StopState* s : states) {
    if (!is_seen(s)) continue;
    o.begin_object({});
    o.text("thing", o.iri(s->thing.self));
    o.text("state", o.iri(s->shown));
    o.json("stopped", s->value.stopped ? "true" : "false");
    if (s->value.since) o.text("since", stop_time(*s->value.since));
    if (s->value.by) o.text("by", *s->value.by);
    if (s->release && o.sees(*s->release)) o.text("release", o.iri(*s->release));
    o.end_object();
  }
  o.end_array();
}

}  // namespace v0
}  // namespace lrt::engine

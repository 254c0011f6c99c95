// SPDX-License-Identifier: Apache-2.0
#include "src/engine/control.hpp"

#include <algorithm>

#include <lrt/rdf/vocab.hpp>

#include "src/engine/context.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/engine/responses.hpp"

namespace lrt::engine {
inline namespace v0 {

namespace {

/// The nearest Thing with control, from this one on upwards; nullptr: there is none.
const ThingNode* controlled(const ThingNode* thing) noexcept {
  while (thing && !thing->control) thing = thing->parent;
  return thing;
}

/// A resource whose methods command the robot.
const ThingNode* commanded(const Context& context) noexcept {
  const Resource* const resource = context.resource;
  return resource && resource->kind().is(Trait::commands) ? controlled(resource->thing) : nullptr;
}

}  // namespace

ControlCheck::ControlCheck(const Context& context) {
  for (const ThingNode* thing = commanded(context); thing; thing = controlled(thing->parent))
    all_.push_back({thing->control->number, thing->control->number->load(std::memory_order_acquire)});
}

bool ControlCheck::passes() const noexcept {
  return std::all_of(all_.begin(), all_.end(), [](const One& one) { return one.number->load(std::memory_order_acquire) == one.seen; });
}

std::optional<http::Response> refused_by_control(const Context& context, const Responses& responses) {
  const ControlBase* required = nullptr;
  bool has_control = false;
  for (const ThingNode* thing = commanded(context); thing; thing = controlled(thing->parent)) {
    const ControlBase& control = *thing->control;
    switch (control.holder(context)) {
      case ControlBase::Holder::another: return controlled_by_another(context, responses, control);
      case ControlBase::Holder::sender: has_control = true; break;
      case ControlBase::Holder::nobody:
        if (control.is_required() && !has_control && !required) required = &control;
    }
  }
  if (!required || has_control) return std::nullopt;
  return control_required(context, responses, *required, 428);
}

http::Response controlled_by_another(const Context& context, const Responses& responses, const ControlBase& control) {
  const bool is_shown = context.audience.sees(control);
  http::Response response =
      responses.problem(context, {409,
                                  is_shown ? control.holder_text(context) : "another client has control of this part of the robot",
                                  {},
                                  std::string(vocab::lrt_::ControlledByAnother.text)});
  response.denial = http::Denial::control;
  return response;
}

http::Response control_required(const Context& context, const Responses& responses, const ControlBase& control, int status) {
  const std::string way = context.audience.sees(control)
                              ? "; take it by POST to " + responses.iri(context, control.path) + " and send its Control-Id with each command"
                              : std::string();
  http::Response response = responses.problem(
      context, {status, "a command needs control, and this client does not have it" + way, {}, std::string(vocab::lrt_::ControlRequired.text)});
  response.denial = http::Denial::control;
  return response;
}

}  // namespace v0
}  // namespace lrt::engine

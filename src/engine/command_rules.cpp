// SPDX-License-Identifier: Apache-2.0
#include "src/engine/command_rules.hpp"

#include <string>

#include <lrt/rdf/vocab.hpp>

#include "src/engine/resources/thing.hpp"
#include "src/model/spec.hpp"

namespace lrt::engine {
inline namespace v0 {

bool requires_expiry(const Resource& resource) noexcept {
  using security::Right;
  const Right right = resource.kind().right_to_change;
  if (!resource.thing || resource.kind().is(Trait::stop) || (right != Right::write && right != Right::invoke && right != Right::release))
    return false;
  if (resource.kind().is(Trait::requires_expiry)) return true;
  for (const ThingNode* thing = resource.thing; thing; thing = thing->parent)
    if (thing->spec->requires_expiry) return true;
  return false;
}

/// A stop must stop the robot whenever it arrives, and whoever cancels an invocation wants that it does not run.
bool CommandRules::always_passes(const Context& context) noexcept {
  const ResourceKind& kind = context.resource->kind();
  return context.is_safe() || kind.is(Trait::stop) || (kind.is(Trait::cancelled_by_delete) && context.request().method == "DELETE");
}

std::optional<http::Response> CommandRules::judge(Context& context) const {
  if (always_passes(context)) return std::nullopt;
  auto read = time_.expiry_of(context.request());
  if (const auto* wrong = std::get_if<std::string>(&read)) return responses_.problem(context, 400, *wrong);
  context.expiry = std::get<Expiry>(read);
  if (auto response = lacks_expiry(context)) return response;
  if (context.expiry.is_late(context.now.steady) || context.expiry.begins_late(context.now.steady)) return refused(context, Refusal::late);
  if (auto response = judge_stop(context, responses_)) return response;
  return refused_by_control(context, responses_);
}

std::optional<http::Response> CommandRules::lacks_expiry(const Context& context) const {
  if (context.expiry.valid_until || !requires_expiry(*context.resource)) return std::nullopt;
  const http::Request& request = context.request();
  const std::string method(request.method), base = responses_.iri(context, "/"), target = responses_.iri(context, context.resource->path);
  return responses_.problem(
      context,
      {428,
       "Valid-Until: this command must say until when it is valid, by the clock of this server: the field Robot-Time of a response, with "
       "milliseconds added. With curl: T=$(curl -sI " +
           base + " | tr -d '\\r' | sed -n 's/^Robot-Time: //p'); curl -X " + method + " -H \"Valid-Until: ${T%/*}/$((${T#*/} + 2000))\" " + target,
       {},
       std::string(http::expiry_required_type)});
}

SharedCheck CommandRules::judge_before_call(const Context& context) const {
  if (!context.resource || always_passes(context)) return nullptr;
  const Resource& resource = *context.resource;
  const model::ResourceSpec* const command = resource.command();
  auto stops = command ? holds_of(*resource.thing, *command) : std::vector<std::shared_ptr<const StopHold>>();
  ControlCheck control(context);
  if (!context.expiry.valid_until && !context.expiry.start_before && stops.empty() && !control.is_needed()) return nullptr;
  return std::make_shared<CommandCheck>(time_.clock(), context.expiry, std::move(stops), std::move(control));
}

http::Response CommandRules::refused(const Context& context, Refusal why) const {
  if (why == Refusal::stopped) return refused_by_stop(context, responses_);
  if (why == Refusal::control)
    if (auto response = refused_by_control(context, responses_)) return *std::move(response);
  const BodyFault what = fault(why);
  http::Response response = responses_.problem(context, {what.status, what.detail, {}, std::string(what.type)});
  response.denial = what.denial;
  return response;
}

BodyFault CommandRules::fault(Refusal why) {
  if (why == Refusal::control) {
    BodyFault fault{409, "another client has taken control while this command waited; it was not carried out"};
    fault.type = vocab::lrt_::ControlledByAnother.text;
    fault.denial = http::Denial::control;
    return fault;
  }
  BodyFault fault{412, "the time until which this command was valid has passed, or was given by another run of the server; it was not carried out"};
  fault.type = http::late_command_type;
  fault.denial = http::Denial::late;
  return fault;
}

std::string CommandRules::reason(Refusal why) {
  if (why == Refusal::stopped) return "the robot was stopped";
  return why == Refusal::control ? "another client has taken control before it began" : "it was to begin before a time that has passed";
}

}  // namespace v0
}  // namespace lrt::engine

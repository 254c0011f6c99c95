// SPDX-License-Identifier: Apache-2.0
#include "src/engine/command_rules.hpp"

#include <string>

namespace lrt::engine {
inline namespace v0 {

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
  if (context.expiry.is_late(context.now.steady) || context.expiry.begins_late(context.now.steady)) return refused(context, Refusal::late);
  return std::nullopt;
}

SharedCheck CommandRules::judge_before_call(const Context& context) const {
  if (!context.expiry.valid_until && !context.expiry.start_before) return nullptr;
  return std::make_shared<CommandCheck>(time_.clock(), context.expiry);
}

http::Response CommandRules::refused(const Context& context, Refusal why) const {
  const BodyFault what = fault(why);
  return responses_.problem(context, {what.status, what.detail, {}, std::string(what.type)});
}

BodyFault CommandRules::fault(Refusal why) {
  (void)why;
  BodyFault fault{412, "the time until which this command was valid has passed, or was given by another run of the server; it was not carried out"};
  fault.type = http::late_command_type;
  return fault;
}

std::string CommandRules::reason(Refusal why) {
  (void)why;
  return "it was to begin before a time that has passed";
}

}  // namespace v0
}  // namespace lrt::engine

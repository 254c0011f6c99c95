// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/http/message.hpp>

#include "src/engine/context.hpp"
#include "src/engine/control.hpp"
#include "src/engine/expiry.hpp"
#include "src/engine/responses.hpp"
#include "src/engine/stop_state.hpp"

namespace lrt::engine {
inline namespace v0 {

/// Why a command is not carried out although its sender may send it and its body is right.
enum class Refusal : std::uint8_t { none, late, stopped, control };

/// What is judged once more just before the host's lambda runs, because the command has waited for the host since. Each rule has a member here.
class CommandCheck {
 public:
  /// @param stops  the stop states that the command is subject to
  CommandCheck(const Clock& clock, const Expiry& expiry, std::vector<std::shared_ptr<const StopHold>> stops, ControlCheck control)
      : expiry_(clock, expiry), stops_(std::move(stops)), control_(std::move(control)) {}

  /// Judges the command. The thread of the lambda calls it once, just before the lambda. Does not lock or allocate.
  bool passes() noexcept {
    refusal_ = judge();
    return refusal_ == Refusal::none;
  }
  /// What passes() has found. The engine's thread, after the message of the job has arrived.
  Refusal refusal() const noexcept { return refusal_; }

  ExpiryCheck& expiry() noexcept { return expiry_; }

 private:
  Refusal judge() noexcept {
    if (!expiry_.passes()) return Refusal::late;
    if (std::any_of(stops_.begin(), stops_.end(), [](const auto& stop) { return stop->holds(); })) return Refusal::stopped;
    return control_.passes() ? Refusal::none : Refusal::control;
  }

  ExpiryCheck expiry_;
  const std::vector<std::shared_ptr<const StopHold>> stops_;
  ControlCheck control_;
  Refusal refusal_ = Refusal::none;
};

/// nullptr: there is nothing to judge.
using SharedCheck = std::shared_ptr<CommandCheck>;

inline bool passes(const SharedCheck& check) noexcept { return !check || check->passes(); }
inline Refusal refusal_of(const SharedCheck& check) noexcept { return check ? check->refusal() : Refusal::none; }

/// Calls the host's lambda, unless the command is refused: then the result is an Error without a message. Does not allocate for that.
template <class T, class F>
Result<T> call_if_passes(const SharedCheck& check, F lambda) {
  if (!passes(check)) return Unexpected{Error{Errc::refused, {}}};
  return lambda();
}

/// Whether commands for a resource must say until when they are valid: the host requires it of the action, or of a Thing that the resource is below.
bool requires_expiry(const Resource& resource) noexcept;

/// Judges commands: requests that would change something. Their sender may send them (AccessControl has judged that before). The rules are asked in this
/// order, and each has a file of its own: expiry, stop_state, control.
///
/// A command is judged at two moments: judge() on the engine's thread, when its header section is complete and when its body is; judge_before_call() just
/// before the host's lambda runs. A stop and the cancelling of an invocation always pass.
class CommandRules {
 public:
  CommandRules(const Responses& responses, const RunTime& time) : responses_(responses), time_(time) {}

  /// The first moment. Sets Context::expiry.
  /// @param context  with its resource
  /// @return the response that refuses the command; nullopt: it may go on, or it is none
  std::optional<http::Response> judge(Context& context) const;
  /// For the second moment: what the job with the host's lambda asks (call_if_passes()). nullptr: nothing.
  SharedCheck judge_before_call(const Context& context) const;
  /// The response to a command that a rule refuses.
  /// @pre why is not Refusal::none
  http::Response refused(const Context& context, Refusal why) const;
  /// The same for a command that writes a graph.
  static BodyFault fault(Refusal why);
  /// The error of an invocation that was accepted and then refused.
  static std::string reason(Refusal why);

 private:
  static bool always_passes(const Context& context) noexcept;
  std::optional<http::Response> lacks_expiry(const Context& context) const;

  const Responses& responses_;
  const RunTime& time_;
};

}  // namespace v0
}  // namespace lrt::engine

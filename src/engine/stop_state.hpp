// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/engine/resource.hpp"

namespace lrt::model {
inline namespace v0 {
struct ResourceSpec;
}  // namespace v0
}  // namespace lrt::model

namespace lrt::engine {

class Responses;

inline namespace v0 {

class ActionResource;
class Context;
class Overview;
struct ThingNode;

/// Whether a stop holds, as the calls of the host read it just before a lambda runs.
/// @par Threads  Any.
struct StopHold {
  enum class Word : std::uint8_t { unknown, moves, stopped };

  std::atomic<bool> latched{false};           ///< a stop was sent, and the host has not confirmed it
  std::atomic<Word> reported{Word::unknown};  ///< by the host

  bool holds() const noexcept { return latched || reported != Word::moves; }
};

/// The value of the Property "stopped".
struct StopValue {
  bool stopped = true;
  std::optional<std::chrono::system_clock::time_point> since{};
  std::optional<std::string> by{};

  friend bool operator==(const StopValue& a, const StopValue& b) { return a.stopped == b.stopped && a.since == b.since && a.by == b.by; }
};

/// The stop state of a Thing, as descriptions read it. StopStates changes it.
struct StopState {
  ThingNode& thing;
  PropertyResource& shown;            ///< "stopped"
  ActionResource* release = nullptr;  ///< nullptr: none is declared
  const std::shared_ptr<StopHold> hold = std::make_shared<StopHold>();
  StopValue value{};
  bool first_read = false;  ///< the host is being asked for the first time: commands are judged just before their lambda
};

/// The nearest stop state that holds for a Thing: its own, or one of the Things above it; nullptr: none.
const StopState* stopped_by(const ThingNode& thing) noexcept;
/// The same for a request: without states that the host is being asked for the first time.
const StopState* refused_by(const ThingNode& thing) noexcept;
/// A command to it may move the robot: it is none that the user has called harmless, no stop and no release.
bool may_move(const model::ResourceSpec& command) noexcept;
/// Why commands to a resource are refused now, a sentence for all who see it; empty: they are not refused by a stop.
std::string reason_of_stop(const ThingNode& thing, const model::ResourceSpec& command);
/// The holds of the stop states that a command is subject to; empty: none.
std::vector<std::shared_ptr<const StopHold>> holds_of(const ThingNode& thing, const model::ResourceSpec& command);

/// The rule of stops, as CommandRules asks it: the response that refuses a command; nullopt: it may go on.
std::optional<http::Response> judge_stop(const Context& context, const Responses& responses);
/// The response to a command that a stop has held up.
http::Response refused_by_stop(const Context& context, const Responses& responses);

/// The member `stopStates` of an overview: those that the audience may see. Nothing if there are none.
void write_stop_states(Overview& o, const std::vector<const StopState*>& states);
/// The stop states that a Thing is subject to, the nearest first.
std::vector<const StopState*> stop_states_of(const ThingNode& thing);

}  // namespace v0
}  // namespace lrt::engine

template <>
struct lrt::rdf::traits<lrt::engine::StopValue> : lrt::rdf::Record<lrt::engine::StopValue> {
  using Value = lrt::engine::StopValue;
  static void describe(Record<Value>& r) {
    const auto named = [](std::string_view name, Iri predicate) {
      FieldName field = predicate;
      field.name = name;
      return field;
    };
    r.is(vocab::lrt_::StopState);
    r.field(named("stopped", vocab::lrt_::stopped), &Value::stopped).title("Stopped", "en");
    r.field(named("since", vocab::lrt_::stoppedSince), &Value::since).title("Stopped since", "en");
    r.field(named("by", vocab::lrt_::stoppedBy), &Value::by).title("Stopped by", "en");
  }
};

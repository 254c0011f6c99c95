// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/rdf/unit.hpp>
#include <lrt/rdf/words.hpp>
#include <lrt/ros2.hpp>
#include <lrt/ros2/message_type.hpp>

namespace lrt::ros2 {

/// What is said of a field. What is empty says nothing.
struct FieldRule {
  std::optional<Unit> unit{};
  std::optional<double> min{}, max{};
  std::string quantity_kind{};  ///< IRI
  std::string name{};           ///< in JSON and RDF
  std::string term{};           ///< IRI of its predicate
  Texts titles{}, descriptions{};
  std::optional<bool> left_out{}, read_only{};
  std::vector<Enumerator> enumerators{};
};

/// What is said of whatever a pattern fits. What is empty says nothing.
struct Rule {
  enum class Of : std::uint8_t { topic, type, service, action, parameter };
  Of of = Of::topic;
  std::string matches{};  ///< a pattern of names in ROS; Of::type: of types; Of::parameter: "/arm/driver:max_speed"
  Texts titles{}, descriptions{};
  std::string frame{};                                     ///< of the numbers, instead of header.frame_id
  FieldRule value{};                                       ///< of a parameter, and of the only field of a message besides `header`
  std::optional<bool> hidden{};                            ///< it has no resource
  std::optional<bool> requires_expiry{};                   ///< each command says until when it is worth carrying out
  std::optional<std::chrono::milliseconds> life{};         ///< of a written value; 0: for ever
  std::optional<std::chrono::milliseconds> interval{};     ///< between two samples
  std::string success{};                                   ///< of a service: field of the response, a boolean; false: the call has failed
  std::string progress{};                                  ///< of an action: field of the feedback, a number of 0 to 1
  std::map<std::string, FieldRule, std::less<>> fields{};  ///< by path: "header.frame_id", "pose.*.x"; `*` is any one name
};

/// The rules of a mapping, in order: the first that says something counts.
struct Mapping::Rules {
  std::vector<Rule> rules;
};

/// Whether the path of a field fits one with `*`.
bool fits_path(std::string_view pattern, std::string_view path) noexcept;

/// The rules of a kind that fit a name, in order. Of::type: those that are shipped come last.
std::vector<const Rule*> matching(const Mapping::Rules& rules, Rule::Of of, std::string_view name);

/// What the rules say of the things that are not fields: the first that says something.
struct Said {
  Texts titles, descriptions;
  std::string frame, success, progress;
  bool hidden = false, requires_expiry = false;
  std::optional<std::chrono::milliseconds> life, interval;
  FieldRule value;
  bool is_command = false;  ///< of a type that is shipped as a command: its value has a life
};
/// @param of    Of::topic, service, action or parameter
/// @param type  of it; may be empty
Said said_of(const Mapping::Rules& rules, Rule::Of of, std::string_view name, std::string_view type);

/// Adds to `to` what it does not say yet.
void complete(FieldRule& to, const FieldRule& from);
/// Adds what a rule says to options.
void apply(const FieldRule& rule, FieldOptions& to);

/// The number of types that the shipped table knows.
std::size_t shipped_types() noexcept;

}  // namespace lrt::ros2

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/ros2/definitions.hpp>

namespace lrt::ros2 {

/// A field whose message has a name and no definition yet: `type.message` is null.
struct ParsedField {
  Field field{};
  std::string message{};  ///< "std_msgs/msg/Header"; empty: a primitive
};
/// A message as its text has it.
struct ParsedMessage {
  std::string name{};  ///< "std_msgs/msg/Header", "demo/action/Wave_Goal"
  std::vector<ParsedField> fields{};
  std::vector<Constant> constants{};
  std::string comment{};
};

/// Whether two messages are the same on the wire.
bool same_structure(const ParsedMessage& a, const ParsedMessage& b) noexcept;

/// Parses the text of a .msg, .srv or .action as rosidl does, or of definitions in a row as bags have them (Definitions::add_text()).
///
/// In a row a definition may occur again, if it has the same structure: the first one counts.
///
/// Tabs are blanks; a '#' begins a comment, except in the quotation marks of a value. Names of fields and constants are
/// letters, digits and '_'. Integers may be decimal, hexadecimal (0x), octal (0o) or binary (0b).
/// @param type  names the first definition, and is_type_name(): "demo/msg/Thing", "demo/srv/Grasp", "demo/action/Wave"
/// @return      the messages in order: of a .srv `_Request` and `_Response`, of a .action `_Goal`, `_Result`, `_Feedback`
/// @par Errors  expected_value with line and column; limit_exceeded
Result<std::vector<ParsedMessage>> parse_definition(std::string_view type, std::string_view text, const DefinitionLimits& limits);

/// The value of a constant or a default: `text` as it is in a definition.
/// @par Errors  expected_value
Result<rdf::Value> parse_value(const FieldType& type, std::string_view text, const DefinitionLimits& limits);

/// The name of a kind in .msg, "float64"; "message".
std::string_view to_string(Kind kind) noexcept;
/// Range of an integer, octet or character.
struct IntegerRange {
  std::int64_t lowest = 0;
  std::uint64_t highest = 0;
};
/// nullopt: it is none of them.
std::optional<IntegerRange> range_of(Kind kind) noexcept;

}  // namespace lrt::ros2

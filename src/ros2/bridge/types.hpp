// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/ros2/definitions.hpp>
#include <lrt/ros2/message_type.hpp>

#include "src/ros2/bridge/mapping.hpp"

namespace lrt::ros2 {

/// A text of a stranger for people: in well-formed UTF-8, in one line, cut where it is too long; empty: it has no letter, as a line of dashes.
std::string words_for_people(std::string_view text);
/// Whether a name of a stranger is in well-formed UTF-8, without control characters, and has 1 to 255 bytes.
bool is_clean_name(std::string_view name) noexcept;

/// What a type is made for.
struct TypeUse {
  Rule::Of of = Rule::Of::topic;        ///< whose rules count
  std::string_view name{};              ///< in ROS
  std::vector<std::string> left_out{};  ///< fields that are no part of the value, by path
  std::string_view inside{};            ///< the field of the message that the rules speak of, such as "goal"; empty: the message
};

/// Makes the types of a bridge from definitions and rules. A record has one name wherever it means the same; one that means
/// something else in a place (metres per second, radians per second) has a name with that place: "geometry_msgs.Twist.linear".
/// @par Threads  One at a time.
class TypeMaker {
 public:
  /// @param max_types    that are made, in all
  /// @param max_members  fields of all of them, counted each time that they occur
  explicit TypeMaker(const Mapping::Rules& rules, std::size_t max_types = 4'096, std::size_t max_members = 100'000)
      : rules_(rules), max_types_(max_types), max_members_(max_members) {}

  /// @par Errors  those of MessageType::of(); limit_exceeded: there would be too many types
  Result<MessageType> make(const MessagePtr& message, const TypeUse& use);
  /// How many it has made. A type that it has made before costs nothing.
  std::size_t count() const noexcept { return made_.size(); }
  /// What the rules say of a field of a message.
  FieldOptions options_of(const Message& root, const TypeUse& use, std::string_view path) const;

 private:
  struct Scope;  ///< the rules that count for a root
  FieldOptions says(const Message& root, const Scope& scope, std::string_view path) const;
  void describe(const Message& root, const Scope& scope, const Message& at, const std::string& path, std::size_t depth, std::string& out) const;
  std::string signature(const Message& root, const Scope& scope, const Message& at, const std::string& path) const;
  std::string name_of(const Message& root, const Scope& scope, const Message& at, std::string_view path);

  const Mapping::Rules& rules_;
  const std::size_t max_types_, max_members_;
  std::size_t members_ = 0;
  /// Made before, by the definition and the rules that count for it: many topics have one type.
  std::map<std::string, std::pair<MessagePtr, Result<MessageType>>> made_;
  std::map<std::string, std::uint64_t> names_;  ///< the hash of what each name of a record means
};

}  // namespace lrt::ros2

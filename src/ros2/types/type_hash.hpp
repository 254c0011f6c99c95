// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/ros2/definitions.hpp>

namespace lrt::ros2 {

/// A description of types as REP 2011 has it: of one type, and of those that it refers to, each as the JSON that is hashed.
class Description {
 public:
  /// A field of a description.
  struct Member {
    std::string_view name;
    unsigned type_id = 0;
    std::uint64_t capacity = 0, string_capacity = 0;
    std::string_view nested{};
  };

  /// Begins a type; members follow. The first one is the type that the description is of.
  void begin(std::string_view type);
  void add(const Member& member);
  /// Adds a message, with what it refers to.
  void add(const Message& message);
  /// "RIHS01_" and the digits.
  std::string hash() const;

 private:
  bool knows(std::string_view type) const { return types_.find(std::string(type)) != types_.end(); }

  std::string first_;
  std::string* open_ = nullptr;
  std::map<std::string, std::string> types_;  // name, and its fields in JSON
};

/// @{
/// The hash of a type.
std::string hash_of(const Message& message);
std::string hash_of_service(std::string_view name, const Message& request, const Message& response);
std::string hash_of_action(const ActionDefinition& action);
/// @}

/// The number of a type in a description, and the reverse.
unsigned type_id_of(const FieldType& type) noexcept;
/// nullopt: .msg has no such type. `type.message` is null.
std::optional<FieldType> type_of_id(unsigned id, std::uint64_t capacity, std::uint64_t string_capacity) noexcept;

}  // namespace lrt::ros2

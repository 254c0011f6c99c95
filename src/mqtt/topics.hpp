// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/base/result.hpp>

namespace lrt::mqtt {
inline namespace v0 {

/// Whether a path fits a pattern: `*` stands for any characters but '/', `**` for any characters. Time: proportional to the product of both lengths.
bool fits(std::string_view pattern, std::string_view path) noexcept;

/// A topic that a message can have (MQTT 5 4.7): UTF-8, 1 to 65,535 bytes, no wildcard, no control character.
bool is_topic(std::string_view topic) noexcept;
/// Text as properties of MQTT have it (MQTT 5 1.5.4).
bool is_text(std::string_view text) noexcept;

/// A name of letters, digits and '-' that begins like a text and is not that of another one: "robots/r7" as "robots-r7-" and 16 digits. Brokers and
/// discovery formats may refuse other characters and long names.
/// @param max_readable  characters before the digits
std::string id_of(std::string_view text, std::size_t max_readable = 28);

/// The topics of one robot. A '+' of a path is %2B in its topic, which names the same resource.
class Topics {
 public:
  enum class Command { put, post, remove };
  /// The command in a message to a topic of the robot.
  struct Demand {
    Command command;
    std::string path;
  };

  /// @par Errors  invalid_option
  static Result<Topics> create(std::string prefix);

  std::string of(std::string_view path) const;
  std::string status() const { return own("status"); }
  std::string time() const { return own("time"); }
  std::string description() const { return own("description"); }
  /// The JSON object of a Thing.
  std::string thing(std::string_view path) const { return own("things") + of(path).substr(prefix_.size()); }
  /// A filter to which nobody subscribes.
  std::string probe() const { return own("probe"); }
  /// The topic for commands to a resource.
  std::string of(Command command, std::string_view path) const;
  /// The filter that a subscription to commands has.
  std::string filter(Command command) const;
  /// The command that a topic stands for; nullopt: the topic is not a command to this robot.
  std::optional<Demand> demand(std::string_view topic) const;
  /// Whether a response may be sent to a topic: not to one of this robot, whose subscribers trust it, and not to one at which a robot takes commands.
  bool may_respond_to(std::string_view topic) const;

 private:
  explicit Topics(std::string prefix) : prefix_(std::move(prefix)) {}
  std::string own(std::string_view name) const { return prefix_ + "/ns/" + std::string(name); }
  std::string prefix_;
};

}  // namespace v0
}  // namespace lrt::mqtt

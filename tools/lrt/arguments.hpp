// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include <lrt/base/result.hpp>

namespace lrt::tool {

/// The arguments of the command, separated into options with their values, the command and its words, before CLI11 sees them. CLI11 takes a value in
/// brackets apart, and an argument that begins with a minus or equals the name of a command for something else. So it gets numbers in place of values, and
/// each option translates them back: a value is what was typed.
///
/// - After "--" everything is a word. "-" is a word. What begins with a minus and a digit, as "-0.5rad", or is "-inf" or a negative duration, is a word.
/// - "--name=VALUE" and "-nVALUE" take any value.
class Arguments {
 public:
  /// @param app    with all options and commands; its options translate values from now on, as long as it lives
  /// @param given  without the name of the program
  /// @par Errors   invalid_option: unknown option or command, a value is missing, too many or too few words; what to do is in the message
  static Result<Arguments> separate(CLI::App& app, const std::vector<std::string>& given);

  /// For CLI::App::parse(), which takes them from the end.
  std::vector<std::string> reversed() const { return {parts_.rbegin(), parts_.rend()}; }
  /// The command; nullptr: none was given.
  const CLI::App* command() const noexcept { return command_; }

 private:
  std::vector<std::string> parts_;
  const CLI::App* command_ = nullptr;
};

/// The names of the commands.
std::vector<std::string> commands_of(const CLI::App& app);

}  // namespace lrt::tool

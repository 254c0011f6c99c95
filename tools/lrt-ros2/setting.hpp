// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <lrt/base/result.hpp>

namespace lrt::ros2_tool {

struct Settings;

/// What a value is in the configuration file. On the command line each is a text.
enum class Kind : unsigned char {
  text,
  number,
  flag,  ///< true or false; on the command line without a value
  list,  ///< of texts; on the command line given several times
};

/// An option of the command line, a key of the configuration file, or both.
struct Setting {
  std::string_view table, key;        ///< in the file; empty: it is not there
  std::string_view option, argument;  ///< on the command line, without "--"; empty: it is not there. What --help calls its value
  Kind kind;
  std::string_view help;
  /// Sets a value, or adds one of a list. A flag is "true" or "false".
  Result<void> (*set)(Settings& settings, const std::string& value);
};

}  // namespace lrt::ros2_tool

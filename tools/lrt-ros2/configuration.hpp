// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <utility>

#include <lrt/base/result.hpp>

#include "tools/lrt-ros2/setting.hpp"

namespace lrt::ros2_tool {

/// Which keys a configuration file has.
struct Configuration {
  std::string name;                                    ///< of the file; empty: there is none
  std::set<std::pair<std::string, std::string>> keys;  ///< table and key
  bool has(std::string_view table, std::string_view key) const { return keys.count({std::string(table), std::string(key)}) != 0; }
};

/// Reads a file in TOML: the tables of lrt::ros2, and those of the settings from `begin` to `end`. Files that it names are
/// relative to the working directory, as on the command line.
/// @par Errors  io_error; expected_value, invalid_option: with the file, line and column
Result<Configuration> read_configuration(const std::string& file, Settings& settings, const Setting* begin, const Setting* end);

}  // namespace lrt::ros2_tool

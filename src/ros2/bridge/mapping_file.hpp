// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/ros2.hpp>

#include "src/ros2/bridge/mapping.hpp"

namespace lrt::ros2 {

constexpr std::size_t max_mapping_bytes = 1024 * 1024;
constexpr std::size_t max_rules = 10'000;

/// The options in a file of TOML: the tables graph, definitions, allowed and limits, and the mapping in topic, type, service, action and
/// parameter. Other tables are others' and are not looked at. The format is in docs/ros2.md.
/// @param name  of the file, which begins the messages; may be empty
/// @par Errors  expected_value, with line and column: no TOML, an unknown key, a value of another type; out_of_range; limit_exceeded
LRT_INTERNAL_API Result<Options> options_from_toml(std::string_view text, std::string_view name);

/// @{
/// The rules of a mapping.
/// @par Errors  as above; expected_rdf
Result<std::vector<Rule>> rules_from_toml(std::string_view text);
Result<std::vector<Rule>> rules_from_turtle(std::string_view text);
/// @}

/// What is wrong with a rule on its own; empty: nothing.
std::string fault_of_rule(const Rule& rule);

}  // namespace lrt::ros2

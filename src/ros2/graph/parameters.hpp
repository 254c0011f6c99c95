// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/ros2/graph.hpp>

/// The messages of rcl_interfaces, in CDR with encapsulation. What is read is of strangers.
namespace lrt::ros2 {

std::string list_request();
/// @return  names, at most `max`
Result<std::vector<std::string>> read_list_response(std::string_view payload, std::size_t max);
/// Of describe_parameters and get_parameters.
std::string names_request(const std::vector<std::string>& names);
/// Fills what descriptors say. Less descriptors than parameters: those without are as they are.
Result<void> read_descriptors(std::string_view payload, std::vector<Parameter>& parameters);
Result<void> read_values(std::string_view payload, std::vector<Parameter>& parameters);
/// @par Errors  expected_value: the value is not of the parameter's type
Result<std::string> set_request(const Parameter& parameter);
/// @par Errors  refused: with the node's reason
Result<void> read_set_response(std::string_view payload);

/// rcl_interfaces/msg/ParameterEvent.
struct ParameterChange {
  std::string node{};
  std::vector<Parameter> parameters{};
  std::vector<std::string> deleted{};
};
Result<ParameterChange> read_event(std::string_view payload);

}  // namespace lrt::ros2

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>

/// "When a property of a kind of Thing crosses a value, invoke an action that changes that property with a number." See rules.ttl.
struct Rule {
  std::string name;
  // when
  std::string thing, property, unit;  ///< IRIs: class, predicate, unit of QUDT
  double value = 0;
  bool above = true;
  // then
  std::string target, affects, input_unit;  ///< IRIs: class, predicate, unit
  double input = 0;
  bool others = true;

  bool holds(double now) const noexcept { return above ? now > value : now < value; }
};

/// Reads rules from Turtle. They are validated by a shape first, so that a mistake gives a clear message.
/// @par Errors  expected_rdf, with the line; expected_value, with what the shape says
lrt::Result<std::vector<Rule>> read_rules(std::string_view turtle);

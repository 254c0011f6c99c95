// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/value.hpp>

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "tests/support/catch.hpp"

using lrt::rdf::Value;

TEST_CASE("a value has one content and is of no other kind", "[rdf]") {
  const std::uint64_t large = std::numeric_limits<std::uint64_t>::max();
  const std::vector<Value> values = {Value(),    Value(false),         Value(std::int64_t{0}),  Value(large),
                                     Value(0.0), Value(std::string()), Value(Value::Sequence())};
  for (std::size_t i = 0; i < values.size(); ++i) {
    CAPTURE(i);
    const Value copy = values[i];
    const std::vector<bool> kinds = {copy.is_null(),         copy.boolean() != nullptr, copy.integer() != nullptr, copy.large_integer() != nullptr,
                                     copy.real() != nullptr, copy.text() != nullptr,    copy.sequence() != nullptr};
    std::vector<bool> expected(kinds.size());
    expected[i] = true;
    CHECK(kinds == expected);
  }
  CHECK(*values[3].large_integer() == large);
}

// SPDX-License-Identifier: Apache-2.0
// expect: an alternative of a variant cannot be absent
#include <lrt/thing.hpp>

#include <optional>
#include <variant>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.property("angle", [] { return std::variant<bool, std::optional<double>>(true); });
#else
  thing.property("angle", [] { return std::variant<bool, double>(true); });
#endif
}

// SPDX-License-Identifier: Apache-2.0
// expect: two alternatives of this std::variant have the same type
#include <lrt/thing.hpp>

#include <variant>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.property("angle", [] { return std::variant<double, double>(std::in_place_index<0>, 1); });
#else
  thing.property("angle", [] { return std::variant<double, bool>(1.0); });
#endif
}

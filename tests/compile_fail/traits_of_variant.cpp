// SPDX-License-Identifier: Apache-2.0
// expect: a std::variant has no rdf::traits
#include <lrt/thing.hpp>

#include <variant>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.property("angle", [] { return std::variant<int, double>(); });
#else
  thing.property("angle", [] { return std::optional<double>(); });
#endif
}

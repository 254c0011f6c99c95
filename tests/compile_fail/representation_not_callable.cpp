// SPDX-License-Identifier: Apache-2.0
// expect: representation expects a callable of const T&
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.property<double>("angle").representation("text/csv", [](const std::string& s) { return s; });
#else
  thing.property<double>("angle").representation("text/csv", [](double v) { return std::to_string(v); });
#endif
}

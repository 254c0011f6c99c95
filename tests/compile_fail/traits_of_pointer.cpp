// SPDX-License-Identifier: Apache-2.0
// expect: a pointer is no value
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.property("angle", [] { return static_cast<double*>(nullptr); });
#else
  thing.property("angle", [] { return std::optional<double>(); });
#endif
}

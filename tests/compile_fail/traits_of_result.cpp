// SPDX-License-Identifier: Apache-2.0
// expect: a Result is no value
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.property("angle", []() -> lrt::Result<double> { return 1.0; });
#else
  thing.action("measure", []() -> lrt::Result<double> { return 1.0; });
#endif
}

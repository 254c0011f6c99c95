// SPDX-License-Identifier: Apache-2.0
// expect: property expects a callable without parameters
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.property("angle", [](auto) { return 1; }).at_least(0);
#else
  thing.property("angle", [] { return 1; }).at_least(0);
#endif
}

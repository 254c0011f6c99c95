// SPDX-License-Identifier: Apache-2.0
// expect: the callable of a property returns nothing
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.property("angle", [] {}).at_least(0);
#else
  thing.property("angle", [] { return 1; }).at_least(0);
#endif
}

// SPDX-License-Identifier: Apache-2.0
// expect: property expects a callable without parameters
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.property("angle", lrt::unit::radian);
#else
  thing.property<double>("angle", lrt::unit::radian);
#endif
}

// SPDX-License-Identifier: Apache-2.0
// expect: an action expects a callable with explicit parameter types
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.action("turn", [](auto degrees) { (void)degrees; }).at_least(0);
#else
  thing.action("turn", [](double degrees) { (void)degrees; }).at_least(0);
#endif
}

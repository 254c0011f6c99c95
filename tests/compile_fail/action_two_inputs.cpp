// SPDX-License-Identifier: Apache-2.0
// expect: an action takes at most one input
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.action("move", [](double, double) {});
#else
  thing.action("move", [](double, lrt::Responder) {});
#endif
}

// SPDX-License-Identifier: Apache-2.0
// expect: an action with a Responder must return void
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.action("move", [](lrt::Responder) { return 1; });
#else
  thing.action("move", [](lrt::Responder) {});
#endif
}

// SPDX-License-Identifier: Apache-2.0
// expect: update expects a callable of lrt::GraphUpdate&
#include <lrt/world.hpp>

void change(lrt::WorldGraph& graph) {
#ifdef LRT_MUST_FAIL
  (void)graph.update([](int) {});
#else
  (void)graph.update([](lrt::GraphUpdate& u) { u.clear(); });
#endif
}

// SPDX-License-Identifier: Apache-2.0
// expect: this type has no rdf::traits\. For a struct write
#include <lrt/thing.hpp>

struct Pose {
  double x, y;
};

#ifndef LRT_MUST_FAIL
template <>
struct lrt::rdf::traits<Pose> : lrt::rdf::Record<Pose> {
  static void describe(Record<Pose>& r) { r.field("x", &Pose::x); }
};
#endif

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.action("go", [](Pose) {});
#else
  thing.action("go", [](Pose) {});
#endif
}

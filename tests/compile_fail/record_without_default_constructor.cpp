// SPDX-License-Identifier: Apache-2.0
// expect: this struct has no default constructor
#include <lrt/thing.hpp>

struct Pose {
  explicit Pose(double its_x) : x(its_x) {}
  double x;
};

template <>
struct lrt::rdf::traits<Pose> : lrt::rdf::Record<Pose> {
  static void describe(Record<Pose>& r) { r.field("x", &Pose::x); }
};

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.action("go", [](Pose) {});
#else
  thing.action("where", [] { return Pose(1); });
#endif
}

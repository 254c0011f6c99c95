// SPDX-License-Identifier: Apache-2.0
// expect: values that are published need a default constructor and copies
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
  thing.property<Pose>("pose").title("Pose");
#else
  thing.property("pose", [] { return Pose(1); }).title("Pose");
#endif
}

// SPDX-License-Identifier: Apache-2.0
// expect: this type has no rdf::traits\. For a struct write
#include <lrt/rdf/traits.hpp>

struct Pose {
  double x, y;
};

#ifndef LRT_MUST_FAIL
template <>
struct lrt::rdf::traits<Pose> : lrt::rdf::Record<Pose> {
  static void describe(Record<Pose>& r) {
    r.field("x", &Pose::x);
    r.field("y", &Pose::y);
  }
};
#endif

lrt::rdf::Value written(const Pose& pose) { return lrt::rdf::traits<Pose>::encode(pose); }

int main() { return 0; }

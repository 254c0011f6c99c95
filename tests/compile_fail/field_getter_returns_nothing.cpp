// SPDX-License-Identifier: Apache-2.0
// expect: the getter of a field returns nothing
#include <lrt/rdf/traits.hpp>

struct S {
  void update() {}
  double x = 0;
};

template <>
struct lrt::rdf::traits<S> : lrt::rdf::Record<S> {
  static void describe(Record<S>& r) {
#ifdef LRT_MUST_FAIL
    r.field("x", &S::update).at_least(0);
#else
    r.field("x", &S::x).at_least(0);
#endif
  }
};

lrt::rdf::Value written(const S& s) { return lrt::rdf::traits<S>::encode(s); }

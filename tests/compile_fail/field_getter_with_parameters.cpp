// SPDX-License-Identifier: Apache-2.0
// expect: a field expects a data member, a getter without parameters
#include <lrt/rdf/traits.hpp>

struct S {
  double joint(int) const { return 0; }
};

template <>
struct lrt::rdf::traits<S> : lrt::rdf::Record<S> {
  static void describe(Record<S>& r) {
#ifdef LRT_MUST_FAIL
    r.field("joint", &S::joint);
#else
    r.field("joint", [](const S& s) { return s.joint(0); });
#endif
  }
};

lrt::rdf::Value written(const S& s) { return lrt::rdf::traits<S>::encode(s); }

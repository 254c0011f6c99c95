// SPDX-License-Identifier: Apache-2.0
// expect: the value of value_if_absent\(\) must have the type of the field
#include <lrt/rdf/traits.hpp>

struct S {
  int x = 0;
};

template <>
struct lrt::rdf::traits<S> : lrt::rdf::Record<S> {
  static void describe(Record<S>& r) {
#ifdef LRT_MUST_FAIL
    r.field("x", &S::x).value_if_absent(1.5);
#else
    r.field("x", &S::x).value_if_absent(1);
#endif
  }
};

lrt::rdf::Value written(const S& s) { return lrt::rdf::traits<S>::encode(s); }

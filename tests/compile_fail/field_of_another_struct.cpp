// SPDX-License-Identifier: Apache-2.0
// expect: the data member of a field must be one of the struct
#include <lrt/rdf/traits.hpp>

struct T {
  double x = 0;
};
struct S {
  T t;
};

template <>
struct lrt::rdf::traits<S> : lrt::rdf::Record<S> {
  static void describe(Record<S>& r) {
#ifdef LRT_MUST_FAIL
    r.field("x", &T::x);
#else
    r.field("x", [](const S& s) { return s.t.x; });
#endif
  }
};

lrt::rdf::Value written(const S& s) { return lrt::rdf::traits<S>::encode(s); }

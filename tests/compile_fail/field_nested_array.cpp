// SPDX-License-Identifier: Apache-2.0
// expect: a const C array or an array of arrays cannot
#include <lrt/rdf/traits.hpp>

struct S {
  double rows[2][3];
};

template <>
struct lrt::rdf::traits<S> : lrt::rdf::Record<S> {
  static void describe(Record<S>& r) {
#ifdef LRT_MUST_FAIL
    r.field("rows", &S::rows);
#else
    r.field("first", [](const S& s) { return s.rows[0][0]; });
#endif
  }
};

lrt::rdf::Value written(const S& s) { return lrt::rdf::traits<S>::encode(s); }

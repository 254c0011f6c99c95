// SPDX-License-Identifier: Apache-2.0
// expect: a const C array cannot be a field
#include <lrt/rdf/traits.hpp>

struct S {
  const double gains[3] = {1, 2, 3};
};

template <>
struct lrt::rdf::traits<S> : lrt::rdf::Record<S> {
  static void describe(Record<S>& r) {
#ifdef LRT_MUST_FAIL
    r.field("gains", &S::gains);
#else
    r.field("gain", [](const S& s) { return s.gains[0]; });
#endif
  }
};

lrt::rdf::Value written(const S& s) { return lrt::rdf::traits<S>::encode(s); }

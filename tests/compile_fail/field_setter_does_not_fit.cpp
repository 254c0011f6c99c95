// SPDX-License-Identifier: Apache-2.0
// expect: the setter of a field expects
#include <lrt/rdf/traits.hpp>

#include <string>

struct S {
  double x() const { return 0; }
  void set(std::string) {}
  void set_x(double) {}
};

template <>
struct lrt::rdf::traits<S> : lrt::rdf::Record<S> {
  static void describe(Record<S>& r) {
#ifdef LRT_MUST_FAIL
    r.field("x", &S::x, &S::set).at_least(0);
#else
    r.field("x", &S::x, &S::set_x).at_least(0);
#endif
  }
};

lrt::rdf::Value written(const S& s) { return lrt::rdf::traits<S>::encode(s); }

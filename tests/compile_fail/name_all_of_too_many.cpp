// SPDX-License-Identifier: Apache-2.0
// expect: name_all\(\) names at most 1024 values
#include <lrt/rdf/traits.hpp>

enum class Code { ok, lost = 2000 };

template <>
struct lrt::rdf::traits<Code> : lrt::rdf::Enumeration<Code> {
  static void describe(Enumeration<Code>& e) {
#ifdef LRT_MUST_FAIL
    e.name_all<0, 2000>();
#else
    e.name_all<1990, 2010>().name(Code::ok, "ok");
#endif
  }
};

const lrt::rdf::Type& described() { return lrt::rdf::traits<Code>::type(); }

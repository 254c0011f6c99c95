// SPDX-License-Identifier: Apache-2.0
// expect: a union does not say
#include <lrt/rdf/traits.hpp>

union U {
  int i;
  double d;
};

#ifdef LRT_MUST_FAIL
using Wanted = U;
#else
using Wanted = std::string;
#endif

const lrt::rdf::Type& described() { return lrt::rdf::traits<Wanted>::type(); }

// SPDX-License-Identifier: Apache-2.0
// expect: no datatype of RDF holds
#include <lrt/rdf/traits.hpp>

#ifdef LRT_MUST_FAIL
using Wanted = long double;
#else
using Wanted = double;
#endif

const lrt::rdf::Type& described() { return lrt::rdf::traits<Wanted>::type(); }

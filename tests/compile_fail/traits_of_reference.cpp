// SPDX-License-Identifier: Apache-2.0
// expect: a reference is no value
#include <functional>

#include <lrt/rdf/traits.hpp>

#ifdef LRT_MUST_FAIL
using Wanted = std::reference_wrapper<double>;
#else
using Wanted = double;
#endif

const lrt::rdf::Type& described() { return lrt::rdf::traits<Wanted>::type(); }

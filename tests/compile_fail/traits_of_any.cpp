// SPDX-License-Identifier: Apache-2.0
// expect: a std::any does not say
#include <any>

#include <lrt/rdf/traits.hpp>

#ifdef LRT_MUST_FAIL
using Wanted = std::any;
#else
using Wanted = std::string;
#endif

const lrt::rdf::Type& described() { return lrt::rdf::traits<Wanted>::type(); }

// SPDX-License-Identifier: Apache-2.0
// expect: a name of a map occurs once
#include <map>

#include <lrt/rdf/traits.hpp>

#ifdef LRT_MUST_FAIL
using Wanted = std::multimap<std::string, double>;
#else
using Wanted = std::map<std::string, double>;
#endif

const lrt::rdf::Type& described() { return lrt::rdf::traits<Wanted>::type(); }

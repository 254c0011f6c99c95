// SPDX-License-Identifier: Apache-2.0
// expect: texts are UTF-8
#include <string>

#include <lrt/rdf/traits.hpp>

#ifdef LRT_MUST_FAIL
using Wanted = std::wstring;
#else
using Wanted = std::string;
#endif

const lrt::rdf::Type& described() { return lrt::rdf::traits<Wanted>::type(); }

// SPDX-License-Identifier: Apache-2.0
// expect: a std::atomic cannot be copied
#include <atomic>

#include <lrt/rdf/traits.hpp>

#ifdef LRT_MUST_FAIL
using Wanted = std::atomic<int>;
#else
using Wanted = int;
#endif

const lrt::rdf::Type& described() { return lrt::rdf::traits<Wanted>::type(); }

// SPDX-License-Identifier: Apache-2.0
// expect: a stack or queue does not show
#include <queue>

#include <lrt/rdf/traits.hpp>

#ifdef LRT_MUST_FAIL
using Wanted = std::queue<double>;
#else
using Wanted = std::deque<double>;
#endif

const lrt::rdf::Type& described() { return lrt::rdf::traits<Wanted>::type(); }

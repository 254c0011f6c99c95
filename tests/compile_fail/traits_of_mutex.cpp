// SPDX-License-Identifier: Apache-2.0
// expect: a mutex is no value
#include <mutex>

#include <lrt/rdf/traits.hpp>

#ifdef LRT_MUST_FAIL
using Wanted = std::mutex;
#else
using Wanted = double;
#endif

const lrt::rdf::Type& described() { return lrt::rdf::traits<Wanted>::type(); }

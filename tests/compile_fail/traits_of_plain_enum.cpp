// SPDX-License-Identifier: Apache-2.0
// expect: the compiler does not tell the enumerators
#include <lrt/rdf/traits.hpp>

enum Mode { idle, busy };
enum Fixed : int { off, on };

#ifdef LRT_MUST_FAIL
using Wanted = Mode;
#else
using Wanted = Fixed;
#endif

const lrt::rdf::Type& described() { return lrt::rdf::traits<Wanted>::type(); }

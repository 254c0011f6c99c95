// SPDX-License-Identifier: Apache-2.0
// expect: Latest<T> hands values to a control loop without allocation
#include <string>

#include <lrt/client/latest.hpp>

#ifdef LRT_MUST_FAIL
using Name = std::string;
#else
using Name = double;
#endif

lrt::client::Latest<Name> name;

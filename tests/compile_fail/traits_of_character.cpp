// SPDX-License-Identifier: Apache-2.0
// expect: a character is neither a number nor a text
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.property<char>("key");
#else
  thing.property<std::string>("key");
#endif
}

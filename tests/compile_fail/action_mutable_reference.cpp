// SPDX-License-Identifier: Apache-2.0
// expect: an action takes its input by value or by const reference
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.action("talk", [](std::string&) {});
#else
  thing.action("talk", [](const std::string&) {});
#endif
}

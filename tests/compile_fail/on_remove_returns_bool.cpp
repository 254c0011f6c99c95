// SPDX-License-Identifier: Apache-2.0
// expect: the callable of on_remove returns void or Result<void>
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.collection<double>("points").on_remove([](const std::string&) { return true; });
#else
  thing.collection<double>("points").on_remove([](const std::string&) -> lrt::Result<void> { return lrt::refused("in use"); });
#endif
}

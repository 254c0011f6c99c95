// SPDX-License-Identifier: Apache-2.0
// expect: the callable of on_create returns void or Result<void>
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.collection<double>("points").on_create([](double) { return true; });
#else
  thing.collection<double>("points").on_create([](double) -> lrt::Result<void> { return {}; });
#endif
}

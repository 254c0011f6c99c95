// SPDX-License-Identifier: Apache-2.0
// expect: on_create cannot see whether this callable takes
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.collection<double>("points").on_create([](auto... all) { static_assert(sizeof...(all) < 3); });
#else
  thing.collection<double>("points").on_create([](auto point) { (void)point; });
#endif
}

// SPDX-License-Identifier: Apache-2.0
// expect: on_create expects a callable \(T\)
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.collection<double>("points").on_create([](const std::string&) {}).max_members(5);
#else
  thing.collection<double>("points").on_create([](const std::string&, double) {}).max_members(5);
#endif
}

// SPDX-License-Identifier: Apache-2.0
// expect: on_remove expects a callable of the member
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.collection<double>("points").on_remove([](double) {});
#else
  thing.collection<double>("points").on_remove([](const std::string&) {});
#endif
}

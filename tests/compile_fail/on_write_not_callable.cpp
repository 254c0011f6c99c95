// SPDX-License-Identifier: Apache-2.0
// expect: on_write expects a callable void\(T\)
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.property<std::string>("name").on_write([](double) {}).title("x");
#else
  thing.property<std::string>("name").on_write([](std::string_view) {}).title("x");
#endif
}

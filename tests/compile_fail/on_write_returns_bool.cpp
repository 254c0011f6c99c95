// SPDX-License-Identifier: Apache-2.0
// expect: the callable of on_write returns void or Result<void>
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.property<double>("angle").on_write([](double v) { return v > 0; });
#else
  thing.property<double>("angle").on_write([](double v) -> lrt::Result<void> {
    if (v > 0) return {};
    return lrt::refused("too small");
  });
#endif
}

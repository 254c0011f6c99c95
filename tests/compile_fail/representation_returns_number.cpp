// SPDX-License-Identifier: Apache-2.0
// expect: the callable of representation returns lrt::Bytes
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.property<double>("angle").representation("text/csv", [](double v) { return v; });
#else
  thing.property<double>("angle").representation("text/csv", [](double) -> lrt::Result<std::string> { return lrt::refused("none"); });
#endif
}

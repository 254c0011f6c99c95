// SPDX-License-Identifier: Apache-2.0
// expect: a pointer is no value
#include <lrt/thing.hpp>

#include <memory>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.property("angle", [] { return std::unique_ptr<double[]>(); });
#else
  thing.property("angle", [] { return std::unique_ptr<double>(); });
#endif
}

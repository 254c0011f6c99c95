// SPDX-License-Identifier: Apache-2.0
// expect: the keys of a map are names
#include <map>

#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.property("gains", [] { return std::map<double, double>(); });
#else
  thing.property("gains", [] { return std::map<int, double>(); });
#endif
}

// SPDX-License-Identifier: Apache-2.0
// expect: a member of a map cannot be absent
#include <map>

#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.property("gains", [] { return std::map<std::string, std::optional<double>>(); });
#else
  thing.property("gains", [] { return std::map<std::string, double>(); });
#endif
}

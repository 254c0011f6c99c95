// SPDX-License-Identifier: Apache-2.0
// expect: a std::string_view or const char. does not own its text
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.property<std::string_view>("name");
#else
  thing.property("name", [] { return std::string_view("arm"); });
#endif
}

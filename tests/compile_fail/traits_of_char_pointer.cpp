// SPDX-License-Identifier: Apache-2.0
// expect: a std::string_view or const char. does not own its text
#include <lrt/thing.hpp>

struct Motor {
  const char* name;
};

template <>
struct lrt::rdf::traits<Motor> : lrt::rdf::Record<Motor> {
  static void describe(Record<Motor>& r) {
#ifdef LRT_MUST_FAIL
    r.field("name", &Motor::name);
#else
    r.field("name", [](const Motor& m) { return m.name; });
#endif
  }
};

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.property<Motor>("motor");
#else
  thing.property<Motor>("motor");
#endif
}

// SPDX-License-Identifier: Apache-2.0
// expect: a C array has rdf::traits only as the data member of a Record
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.action("read", [](lrt::ResponderOf<double[3]>) {});
#else
  thing.action("read", [](lrt::ResponderOf<std::array<double, 3>>) {});
#endif
}

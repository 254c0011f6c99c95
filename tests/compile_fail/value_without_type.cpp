// SPDX-License-Identifier: Apache-2.0
// expect: an rdf::Value does not say its type
#include <lrt/rdf/dynamic_type.hpp>
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing, const lrt::rdf::DynamicType& type) {
#ifdef LRT_MUST_FAIL
  (void)type;
  thing.property("angle", [] { return lrt::rdf::Value(1.5); });
#else
  thing.property("angle", type, [] { return lrt::rdf::Value(1.5); });
#endif
}

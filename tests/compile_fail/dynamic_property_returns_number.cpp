// SPDX-License-Identifier: Apache-2.0
// expect: a property of a DynamicType expects a callable that returns an rdf::Value or a Result of one
#include <lrt/rdf/dynamic_type.hpp>
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing, const lrt::rdf::DynamicType& type) {
#ifdef LRT_MUST_FAIL
  thing.property("angle", type, [] { return 1.5; });
#else
  thing.property("angle", type, [] { return lrt::rdf::Value(1.5); });
#endif
}

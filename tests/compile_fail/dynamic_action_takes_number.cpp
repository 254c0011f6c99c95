// SPDX-License-Identifier: Apache-2.0
// expect: an action with types that are made at run time takes and gives rdf::Value
#include <lrt/rdf/dynamic_type.hpp>
#include <lrt/thing.hpp>

void describe(lrt::Thing& thing, const lrt::rdf::DynamicType& type) {
#ifdef LRT_MUST_FAIL
  thing.action("turn", type, {}, [](double) {});
#else
  thing.action("turn", type, {}, [](const lrt::rdf::Value&) {});
#endif
}

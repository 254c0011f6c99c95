// SPDX-License-Identifier: Apache-2.0
#include "src/shacl/components/all.hpp"

#include <lrt/base/immortal.hpp>

namespace lrt::shacl {

const std::vector<const Component*>& all_components() {
  using namespace components;
  // clang-format off
  static const Immortal<std::vector<const Component*>> all(std::vector<const Component*>{
      &class_, &datatype, &node_kind,                                  // 4.1
      &min_count, &max_count,                                          // 4.2
      &min_exclusive, &min_inclusive, &max_exclusive, &max_inclusive,  // 4.3
      &min_length, &max_length, &pattern, &language_in, &unique_lang,  // 4.4
      &equals, &disjoint, &less_than, &less_than_or_equals,            // 4.5
      &not_, &and_, &or_, &xone,                                       // 4.6
      &node, &property, &qualified_value_shape,                        // 4.7
      &closed, &has_value, &in,                                        // 4.8
  });
  // clang-format on
  return *all;
}

}  // namespace lrt::shacl

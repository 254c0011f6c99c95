// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "src/shacl/compiler.hpp"

/// The constraint components of SHACL Core. Each is one class and one of these; a file has those of one subsection of section
/// 4.
namespace lrt::shacl {
namespace components {

extern const Component class_, datatype, node_kind;                                 // value_type.cpp
extern const Component min_count, max_count;                                        // cardinality.cpp
extern const Component min_exclusive, min_inclusive, max_exclusive, max_inclusive;  // value_range.cpp
extern const Component min_length, max_length, pattern, language_in, unique_lang;   // string_based.cpp
extern const Component equals, disjoint, less_than, less_than_or_equals;            // property_pair.cpp
extern const Component not_, and_, or_, xone;                                       // logical.cpp
extern const Component node, property, qualified_value_shape;                       // shape_based.cpp
extern const Component closed, has_value, in;                                       // other.cpp

}  // namespace components
}  // namespace lrt::shacl

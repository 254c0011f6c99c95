// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/rdf/lexical.hpp>

namespace lrt::rdf::lexical {
inline namespace v0 {

/// The bounds of an integer datatype of XML Schema (Part 2, 3.4.13 to 3.4.25) in digits; empty: there is none.
struct IntegerRange {
  std::string_view lowest{}, highest{};
};
/// @pre is_integer_type(datatype)
LRT_INTERNAL_API IntegerRange range_of(Datatype datatype) noexcept;

}  // namespace v0
}  // namespace lrt::rdf::lexical

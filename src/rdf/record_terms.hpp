// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <lrt/rdf/type.hpp>

namespace lrt::rdf {
inline namespace v0 {
namespace detail {

/// The name with '-' for each run of characters that a term does not have: "LimitsOf-true". A '.' is between two other characters.
std::string term_name(std::string_view name);

/// Puts "#name" predicates below the type's name, and gives a record or variant without classes its own.
void place_terms(Type& type);

}  // namespace detail
}  // namespace v0
}  // namespace lrt::rdf

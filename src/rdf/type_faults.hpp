// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <lrt/base/abi.hpp>
#include <lrt/rdf/type.hpp>

namespace lrt::rdf {

/// What is wrong with a type and the types in it, a sentence that begins with the names of the fields; empty: nothing. Finds types that contain
/// themselves, so a function that follows the members of a type without a fault comes to an end.
LRT_INTERNAL_API std::string fault_of(const Type& type);

/// What is wrong with the unit, bounds and length of values of a type; empty: nothing.
/// @pre  the type has no fault
LRT_INTERNAL_API std::string fault_of(const Facets& facets, const Type& type);

}  // namespace lrt::rdf

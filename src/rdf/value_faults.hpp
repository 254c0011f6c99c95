// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <lrt/base/abi.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::rdf {

/// What makes a value of the type one that has no representation, as a sentence; empty: nothing. An enumerator without a name is an empty text
/// in it, a variant that is valueless by an exception has no alternative, and a value that the host made may not be of its rdf::DynamicType.
LRT_INTERNAL_API std::string fault_of_value(const Type& type, const Value& value);

}  // namespace lrt::rdf

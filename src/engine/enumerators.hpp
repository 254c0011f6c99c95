// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::engine {

/// What is wrong with the names and the defaults in a type, as a sentence; empty: nothing.
std::string fault_of_names(const rdf::Type& type);
/// What makes a value of the type one that has no representation, as a sentence; empty: nothing. An enumerator without a name is an empty text
/// in it, a variant that is valueless by an exception has no alternative.
std::string_view fault_of_value(const rdf::Type& type, const rdf::Value& value);

}  // namespace lrt::engine

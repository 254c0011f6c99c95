// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::engine {

/// What is wrong with the enumerations and the defaults in a type, as a sentence; empty: nothing.
std::string fault_of_names(const rdf::Type& type);
/// Whether an enumerator without a name is in a value of the type. It is an empty text there.
bool has_nameless(const rdf::Type& type, const rdf::Value& value);

}  // namespace lrt::engine

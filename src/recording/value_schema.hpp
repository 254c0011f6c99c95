// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <lrt/rdf/type.hpp>

namespace lrt::recording {

/// The JSON Schema of recorded values of a type whose first value does not show what later ones have, because it is one of several alternatives. An
/// object has the members of all of them, and demands none: viewers read no `oneOf`. Empty: each value of the type has the same members.
std::string schema_of_alternatives(const rdf::Type& type, const rdf::Facets& facets);

}  // namespace lrt::recording

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <lrt/rdf/type.hpp>

namespace lrt::rdf {

/// Describes the values of a type in Plain::json, as a JSON Schema (draft 2020-12) in one line. The member `unit` has the UCUM code, as in the
/// DataSchema of W3C WoT. An optional value has the type ["number", "null"]. Bounds that only repeat the range of a 64-bit number or of a
/// floating-point number are left out.
std::string write_schema(const Type& type, const Facets& facets);

}  // namespace lrt::rdf

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <lrt/rdf/type.hpp>

#include "src/base/function_ref.hpp"

namespace lrt::rdf {

/// Which of several texts a reader gets; nullptr: none.
using ChooseText = FunctionRef<const Text*(const Texts&)>;

/// Describes the values of a type in Plain::json, as a JSON Schema (draft 2020-12) in one line. The member `unit` has the UCUM code, as in the
/// DataSchema of W3C WoT. An optional value has the type ["number", "null"]. Bounds that only repeat the range of a 64-bit number or of a
/// floating-point number are left out.
///
/// @param choose  which of several texts the schema has as `title` and `description` of fields; nullptr: it has none. An enumeration whose names
///                have such words has `oneOf` with `const` for each name beside `enum`.
std::string write_schema(const Type& type, const Facets& facets, const ChooseText* choose = nullptr);

}  // namespace lrt::rdf

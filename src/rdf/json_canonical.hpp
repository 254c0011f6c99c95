// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "src/rdf/json_parse.hpp"

namespace lrt::rdf::json {

/// A value in the canonical form of JSON (RFC 8785): no white space, members sorted by the UTF-16 code units of their names, numbers as
/// ECMAScript writes them, strings with as few escapes as possible.
/// @pre the document was JSON: its numbers are finite
LRT_INTERNAL_API std::string canonical(const Document& document, Document::Id value);

/// A finite number as ECMAScript writes it: 1e+21, 0.000001, 4.5, 0 also for -0 (ECMA-262, Number::toString).
LRT_INTERNAL_API std::string canonical_number(double value);

}  // namespace lrt::rdf::json

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/rdf/type.hpp>

namespace lrt::rdf {
inline namespace v0 {

/// The names of a record's members in JSON and CBOR: the names of the fields; for repeated names "maths:x"; if these are repeated too, the
/// IRIs.
LRT_INTERNAL_API std::vector<std::string> member_names(const Type& record);

/// Whether values of the type have the unit of their facets: see write_value().
LRT_INTERNAL_API bool carries_unit(const Type& type, const Facets& facets) noexcept;

/// The name of a unit in JSON: its UCUM code, or its IRI if it has no code.
std::string_view unit_code(const Unit& unit) noexcept;

}  // namespace v0
}  // namespace lrt::rdf

// SPDX-License-Identifier: Apache-2.0
#include "src/recording/value_schema.hpp"

#include <algorithm>
#include <vector>

#include "src/base/quote.hpp"
#include "src/rdf/plain_names.hpp"

namespace lrt::recording {
namespace {

using rdf::Facets;
using rdf::Type;
using Kind = Type::Kind;

constexpr unsigned max_depth = 16;

bool has_variant(const Type& type, unsigned depth) {
  if (depth > max_depth) return false;
  if (type.kind == Kind::variant) return true;
  if (type.element && has_variant(*type.element, depth + 1)) return true;
  for (const rdf::FieldType& f : type.fields)
    if (has_variant(*f.type, depth + 1)) return true;
  return false;
}

/// Whether {"value": ..., "unit": ...} would be read as the value itself: it is not written then.
bool has_value_member(const Type& type) {
  const std::vector<std::string> names = type.has_fields() ? rdf::member_names(type) : std::vector<std::string>();
  return type.kind == Kind::map || std::find(names.begin(), names.end(), "value") != names.end();
}

/// @param with_units  numbers within a value are {"value": ..., "unit": ...}
std::string schema_of(const Type& type, const Facets& facets, bool with_units, unsigned depth, bool unit_said = false) {
  if (depth > max_depth) return "{}";
  if (type.kind == Kind::optional) return schema_of(*type.element, facets, with_units, depth, unit_said);
  if (with_units && !unit_said && rdf::carries_unit(type, facets) && !has_value_member(type))
    return R"({"type":"object","properties":{"value":)" + schema_of(type, facets, with_units, depth + 1, true) + R"(,"unit":{"type":"string"}}})";
  switch (type.kind) {
    case Kind::boolean: return R"({"type":"boolean"})";
    case Kind::integer:
    case Kind::real: return R"({"type":"number"})";
    case Kind::text:
    case Kind::enumeration:
    case Kind::duration:
    case Kind::instant: return R"({"type":"string"})";
    case Kind::list: return R"({"type":"array","items":)" + schema_of(*type.element, facets, with_units, depth + 1, true) + "}";
    case Kind::map: return R"({"type":"object"})";
    case Kind::record:
    case Kind::variant: {
      std::string members;
      const std::vector<std::string> names = rdf::member_names(type);
      for (std::size_t i = 0; i < names.size() && i < type.fields.size(); ++i)
        members += (members.empty() ? "" : ",") + json_string(names[i]) + ":" +
                   schema_of(*type.fields[i].type, rdf::field_facets(type.fields[i], facets), with_units, depth + 1);
      return std::string(R"({"type":"object",)") + (type.kind == Kind::variant ? R"("description":"one of these members",)" : "") +
             R"("properties":{)" + members + "}}";
    }
    case Kind::optional: break;
  }
  return "{}";
}

}  // namespace

std::string schema_of_alternatives(const Type& type, const Facets& facets) {
  if (!has_variant(type, 0)) return {};
  const bool is_object = type.has_fields() || type.kind == Kind::map;  // as lrt record writes them
  return schema_of(type, is_object ? facets : Facets(), is_object, 0);
}

}  // namespace lrt::recording

// SPDX-License-Identifier: Apache-2.0
#include "src/engine/enumerators.hpp"

#include <algorithm>

namespace lrt::engine {
namespace {

using Kind = rdf::Type::Kind;

bool has_enumeration(const rdf::Type& type) {
  if (type.kind == Kind::enumeration) return true;
  if (type.element) return has_enumeration(*type.element);
  return std::any_of(type.fields.begin(), type.fields.end(), [](const rdf::FieldType& field) { return has_enumeration(*field.type); });
}

bool finds_nameless(const rdf::Type& type, const rdf::Value& value) {
  if (type.kind == Kind::optional) return finds_nameless(*type.element, value);
  if (type.kind == Kind::enumeration) return value.text() && value.text()->empty();
  const rdf::Value::Sequence* const members = value.sequence();
  if (!members) return false;
  if (type.kind == Kind::list) {
    const auto in_member = [&](const rdf::Value& member) { return finds_nameless(*type.element, member); };
    return has_enumeration(*type.element) && std::any_of(members->begin(), members->end(), in_member);
  }
  if (type.kind == Kind::map) {
    const auto in_member = [&](const rdf::Value& member) {
      const rdf::Value::Sequence* const pair = member.sequence();
      return pair && pair->size() == 2 && finds_nameless(*type.element, pair->back());
    };
    return has_enumeration(*type.element) && std::any_of(members->begin(), members->end(), in_member);
  }
  for (std::size_t i = 0; i < std::min(members->size(), type.fields.size()); ++i)
    if (finds_nameless(*type.fields[i].type, (*members)[i])) return true;
  return false;
}

}  // namespace

std::string fault_of_names(const rdf::Type& type) {
  if (!type.fault.empty()) return type.fault;
  if (type.element) return fault_of_names(*type.element);
  for (const rdf::FieldType& field : type.fields) {
    if (const std::string fault = fault_of_names(*field.type); !fault.empty()) return "field \"" + field.name + "\": " + fault;
    if (field.absent && has_nameless(*field.type, *field.absent))
      return "field \"" + field.name + "\": value_if_absent(): the enumerator has no name";
  }
  return {};
}

bool has_nameless(const rdf::Type& type, const rdf::Value& value) { return has_enumeration(type) && finds_nameless(type, value); }

}  // namespace lrt::engine

// SPDX-License-Identifier: Apache-2.0
#include "src/engine/enumerators.hpp"

#include <algorithm>

namespace lrt::engine {
namespace {

using TypeKind = rdf::Type::Kind;

/// Whether there are values of the C++ type that have no representation.
bool may_have_fault(const rdf::Type& type) {
  if (type.kind == TypeKind::enumeration || type.kind == TypeKind::variant) return true;
  if (type.element) return may_have_fault(*type.element);
  return std::any_of(type.fields.begin(), type.fields.end(), [](const rdf::FieldType& field) { return may_have_fault(*field.type); });
}

std::string_view find_fault(const rdf::Type& type, const rdf::Value& value) {
  constexpr std::string_view nameless = "an enumerator in the value has no name; give it one in the traits of its enum";
  constexpr std::string_view valueless = "a variant in the value has no alternative: it is valueless by an exception";
  if (type.kind == TypeKind::optional) return find_fault(*type.element, value);
  if (type.kind == TypeKind::enumeration) return value.text() && value.text()->empty() ? nameless : std::string_view();
  const rdf::Value::Sequence* const members = value.sequence();
  if (!members) return {};
  if (type.kind == TypeKind::list || type.kind == TypeKind::map) {
    if (!may_have_fault(*type.element)) return {};
    for (const rdf::Value& member : *members) {
      const rdf::Value::Sequence* const pair = type.kind == TypeKind::map ? member.sequence() : nullptr;
      const rdf::Value& inner = pair && pair->size() == 2 ? pair->back() : member;
      if (const std::string_view fault = find_fault(*type.element, inner); !fault.empty()) return fault;
    }
    return {};
  }
  const auto is_null = [](const rdf::Value& member) { return member.is_null(); };
  if (type.kind == TypeKind::variant && std::all_of(members->begin(), members->end(), is_null)) return valueless;
  for (std::size_t i = 0; i < std::min(members->size(), type.fields.size()); ++i)
    if (const std::string_view fault = find_fault(*type.fields[i].type, (*members)[i]); !fault.empty()) return fault;
  return {};
}

}  // namespace

std::string fault_of_names(const rdf::Type& type) {
  if (!type.fault.empty()) return type.fault;
  if (type.element) return fault_of_names(*type.element);
  for (const rdf::FieldType& field : type.fields) {
    if (const std::string fault = fault_of_names(*field.type); !fault.empty())
      return (type.kind == TypeKind::variant ? "alternative \"" : "field \"") + field.name + "\": " + fault;
    if (field.absent && !fault_of_value(*field.type, *field.absent).empty())
      return "field \"" + field.name + "\": value_if_absent(): the enumerator has no name";
  }
  return {};
}

std::string_view fault_of_value(const rdf::Type& type, const rdf::Value& value) {
  return may_have_fault(type) ? find_fault(type, value) : std::string_view();
}

}  // namespace lrt::engine

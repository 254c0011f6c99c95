// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/value_faults.hpp"

#include <algorithm>
#include <string_view>

#include <lrt/rdf/dynamic_type.hpp>

namespace lrt::rdf {
namespace {

using TypeKind = Type::Kind;

/// Whether there are values of the C++ type that have no representation.
bool may_have_fault(const Type& type) {
  if (type.kind == TypeKind::enumeration || type.kind == TypeKind::variant) return true;
  if (type.key && may_have_fault(*type.key)) return true;
  if (type.element) return may_have_fault(*type.element);
  return std::any_of(type.fields.begin(), type.fields.end(), [](const FieldType& field) { return may_have_fault(*field.type); });
}

std::string_view find_fault(const Type& type, const Value& value) {
  constexpr std::string_view nameless = "an enumerator in the value has no name; give it one in the traits of its enum";
  constexpr std::string_view valueless = "a variant in the value has no alternative: it is valueless by an exception";
  if (type.kind == TypeKind::optional) return find_fault(*type.element, value);
  if (type.kind == TypeKind::enumeration) return value.text() && value.text()->empty() ? nameless : std::string_view();
  const Value::Sequence* const members = value.sequence();
  if (!members) return {};
  if (type.kind == TypeKind::list || type.kind == TypeKind::map) {
    if (!may_have_fault(type)) return {};
    for (const Value& member : *members) {
      const Value::Sequence* const pair = type.kind == TypeKind::map ? member.sequence() : nullptr;
      if (pair && pair->size() == 2 && type.key)
        if (const std::string_view fault = find_fault(*type.key, pair->front()); !fault.empty()) return fault;
      const Value& inner = pair && pair->size() == 2 ? pair->back() : member;
      if (const std::string_view fault = find_fault(*type.element, inner); !fault.empty()) return fault;
    }
    return {};
  }
  const auto is_null = [](const Value& member) { return member.is_null(); };
  if (type.kind == TypeKind::variant && std::all_of(members->begin(), members->end(), is_null)) return valueless;
  for (std::size_t i = 0; i < std::min(members->size(), type.fields.size()); ++i)
    if (const std::string_view fault = find_fault(*type.fields[i].type, (*members)[i]); !fault.empty()) return fault;
  return {};
}

}  // namespace

std::string fault_of_value(const Type& type, const Value& value) {
  if (type.is_checked) {
    const std::string fault = detail::fault_of(type, value);
    return fault.empty() ? fault : "the value is not of its type: " + fault;
  }
  return std::string(may_have_fault(type) ? find_fault(type, value) : std::string_view());
}

}  // namespace lrt::rdf

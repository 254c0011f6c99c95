// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/type_faults.hpp"

#include <cmath>
#include <initializer_list>
#include <limits>
#include <string_view>

#include <lrt/base/iri.hpp>

#include "src/base/quote.hpp"
#include "src/base/utf8.hpp"

namespace lrt::rdf {
namespace {

using Kind = Type::Kind;

/// Every program has this code, and few need a text of it: texts are put together in one place.
[[gnu::noinline]] std::string joined(std::initializer_list<std::string_view> parts) {
  std::string all;
  for (const std::string_view part : parts) all += part;
  return all;
}

[[gnu::noinline]] std::string said(const char* text) { return text; }

bool is_utf8_text(std::string_view text) { return !utf8::find_invalid(text) && text.find('\0') == std::string_view::npos; }

/// The type of the numbers or texts in lists, maps and optionals. @pre the type has no fault
const Type& innermost_member(const Type& type) {
  const Type* inner = &type;
  while (inner->element) inner = inner->element;
  return *inner;
}

const char* plural_of(Kind kind) {
  switch (kind) {
    case Kind::boolean: return "truth values";
    case Kind::integer:
    case Kind::real: return "numbers";
    case Kind::text: return "texts";
    case Kind::enumeration: return "names";
    case Kind::duration: return "durations";
    case Kind::instant: return "instants";
    case Kind::record: return "records";
    case Kind::variant: return "alternatives";
    default: return "other values";
  }
}

[[gnu::noinline]] std::string expected(std::string_view what, std::string_view need, std::string_view found) {
  return joined({what, ": expected ", need, ", found ", found});
}

std::string fault_of_unit(const Unit& unit) {
  for (const Iri* iri : {&unit.qudt, &unit.vom, &unit.quantity_kind})
    if (!iri->empty() && !iri::is_absolute(iri->text)) return expected("its unit", "an absolute IRI", quoted(iri->text));
  if (!is_utf8_text(unit.ucum)) return said("its unit: expected UTF-8 without NUL as its code");
  if (unit.empty() && !unit.ucum.empty())
    return joined({"its unit ", quoted(unit.ucum), " has no IRI: give it one of QUDT, as the units of lrt::unit have"});
  return {};
}

/// The name and the predicate of a field, and those of the fields before it.
std::string fault_of_name(const Type& type, const FieldType& field) {
  if (field.name.empty()) return said("its name is empty");
  if (!is_utf8_text(field.name)) return said("expected UTF-8 without NUL as its name");
  if (field.predicate.empty() || (field.predicate[0] != '#' && !iri::is_absolute(field.predicate)))
    return joined({"expected an absolute IRI as its predicate, found ", quoted(field.predicate)});
  for (const FieldType* before = type.fields.data(); before != &field; ++before) {
    if (before->name == field.name) return said("two fields have this name");
    if (before->predicate == field.predicate) return joined({"the field ", quoted(before->name), " has the same predicate, <", field.predicate, ">"});
  }
  return {};
}

/// A type, and the types around it.
struct Place {
  const Type& type;
  const Place* outer;
};

std::string fault_in(const Type& type, const Place* outer) {
  if (!type.fault.empty()) return type.fault;
  if (type.key && !type.key->fault.empty()) return joined({"its names: ", type.key->fault});
  std::size_t depth = 0;
  for (const Place* place = outer; place; place = place->outer) {
    if (&place->type == &type) return said("its type contains itself, so its values have no bounded depth");
    if (++depth == 64) return said("its type has more than 64 types within each other");
  }
  const Place here{type, outer};
  if (type.element) return fault_in(*type.element, &here);
  for (const FieldType& field : type.fields) {
    std::string fault = fault_of_name(type, field);
    if (fault.empty()) fault = field.type ? fault_in(*field.type, &here) : said("it has no type");
    if (fault.empty()) fault = fault_of(field.facets, *field.type);
    if (!fault.empty()) return joined({type.kind == Kind::variant ? "alternative " : "field ", quoted(field.name), ": ", fault});
  }
  return {};
}

}  // namespace

std::string fault_of(const Type& type) { return fault_in(type, nullptr); }

std::string fault_of(const Facets& f, const Type& type) {
  const Type& inner = innermost_member(type);
  const char* const found = plural_of(inner.kind);
  if (std::string fault = fault_of_unit(f.unit()); !fault.empty()) return fault;
  if (!f.unit().empty() && !inner.is_number() && inner.kind != Kind::record) return expected("its unit", "numbers", found);
  if (f.allows_non_finite() && inner.kind != Kind::real) return expected("allow_non_finite()", "numbers with a fraction", found);
  const bool has_length = f.min_length() != 0 || f.max_length() != std::numeric_limits<std::size_t>::max();
  if (has_length && inner.kind != Kind::text) return expected("length()", "texts", found);
  if (f.min_length() > f.max_length()) return said("no value is within the bounds of its length");
  if (!f.min() && !f.max()) return {};
  if (!inner.is_number())
    return expected("its bounds", inner.kind == Kind::record ? "numbers (give bounds to the fields of a record)" : "numbers", found);
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const double min = f.min().value_or(-infinity), max = f.max().value_or(infinity);
  if (std::isnan(min) || std::isnan(max)) return expected("its bounds", "a number", "NaN");
  const bool is_empty = min > max || (min == max && (f.min_exclusive() || f.max_exclusive())) || min == infinity || max == -infinity;
  const bool excludes_type = inner.kind == Kind::integer && (min > static_cast<double>(inner.highest) || max < static_cast<double>(inner.lowest));
  return is_empty || excludes_type ? said("no value is within the bounds") : std::string();
}

}  // namespace lrt::rdf

// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/type_faults.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <vector>

#include <lrt/base/iri.hpp>

#include "src/base/quote.hpp"
#include "src/base/utf8.hpp"

namespace lrt::rdf {
namespace {

using Kind = Type::Kind;

constexpr std::size_t max_type_depth = 64;

bool is_utf8_text(std::string_view text) { return !utf8::find_invalid(text) && text.find('\0') == std::string_view::npos; }

/// The type of the numbers or texts in lists, maps and optionals.
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

std::string fault_of_unit(const Unit& unit) {
  for (const Iri iri : {unit.qudt, unit.vom, unit.quantity_kind})
    if (!iri.empty() && !iri::is_absolute(iri.text)) return "its unit: expected an absolute IRI, found " + quoted(iri.text);
  if (!is_utf8_text(unit.ucum)) return "its unit: expected UTF-8 without NUL as its code";
  if (unit.empty() && !unit.ucum.empty()) return "its unit " + quoted(unit.ucum) + " has no IRI: give it one of QUDT, as the units of lrt::unit have";
  return {};
}

/// Follows a type into its members.
class Search {
 public:
  std::string of(const Type& type) {
    if (!type.fault.empty()) return type.fault;
    if (type.key && !type.key->fault.empty()) return "its names: " + type.key->fault;
    if (!type.element && type.fields.empty()) return {};
    if (std::find(done_.begin(), done_.end(), &type) != done_.end()) return {};
    if (std::find(open_.begin(), open_.end(), &type) != open_.end()) return "its type contains itself, so its values have no bounded depth";
    if (open_.size() == max_type_depth) return "its type has more than 64 types within each other";
    open_.push_back(&type);
    std::string fault = type.element ? of(*type.element) : std::string();
    for (std::size_t i = 0; i < type.fields.size() && fault.empty(); ++i) {
      const FieldType& field = type.fields[i];
      fault = of_names(type, i);
      if (fault.empty() && !field.type) fault = "it has no type";
      if (fault.empty()) fault = of(*field.type);
      if (fault.empty()) fault = fault_of(field.facets, *field.type);
      if (!fault.empty()) fault = (type.kind == Kind::variant ? "alternative " : "field ") + quoted(field.name) + ": " + fault;
    }
    open_.pop_back();
    done_.push_back(&type);
    return fault;
  }

 private:
  /// Names and predicates of a field, and of those before it.
  static std::string of_names(const Type& type, std::size_t i) {
    const FieldType& field = type.fields[i];
    if (field.name.empty()) return "its name is empty";
    if (!is_utf8_text(field.name)) return "expected UTF-8 without NUL as its name";
    if (field.predicate.empty() || (field.predicate[0] != '#' && !iri::is_absolute(field.predicate)))
      return "expected an absolute IRI as its predicate, found " + quoted(field.predicate);
    for (std::size_t j = 0; j < i; ++j) {
      if (type.fields[j].name == field.name) return "two fields have this name";
      if (type.fields[j].predicate == field.predicate)
        return "the field " + quoted(type.fields[j].name) + " has the same predicate <" + field.predicate + ">, so their values cannot be told apart";
    }
    return {};
  }

  std::vector<const Type*> open_, done_;
};

}  // namespace

std::string fault_of(const Type& type) { return Search().of(type); }

std::string fault_of(const Facets& f, const Type& type) {
  const Type& inner = innermost_member(type);
  const auto expected = [&](const char* what, const char* need) {
    return std::string(what) + ": expected " + need + ", found " + plural_of(inner.kind);
  };
  if (std::string fault = fault_of_unit(f.unit()); !fault.empty()) return fault;
  if (!f.unit().empty() && !inner.is_number() && inner.kind != Kind::record) return expected("its unit", "numbers");
  if (f.allows_non_finite() && inner.kind != Kind::real) return expected("allow_non_finite()", "numbers with a fraction");
  const bool has_length = f.min_length() != 0 || f.max_length() != std::numeric_limits<std::size_t>::max();
  if (has_length && inner.kind != Kind::text) return expected("length()", "texts");
  if (f.min_length() > f.max_length()) return "no value is within the bounds of its length";
  if (!f.min() && !f.max()) return {};
  if (!inner.is_number()) return expected("its bounds", inner.kind == Kind::record ? "numbers (give bounds to the fields of a record)" : "numbers");
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const double min = f.min().value_or(-infinity), max = f.max().value_or(infinity);
  if (std::isnan(min) || std::isnan(max)) return "its bounds: expected a number, found NaN";
  const bool is_empty = min > max || (min == max && (f.min_exclusive() || f.max_exclusive())) || min == infinity || max == -infinity;
  const bool excludes_type = inner.kind == Kind::integer && (min > static_cast<double>(inner.highest) || max < static_cast<double>(inner.lowest));
  return is_empty || excludes_type ? "no value is within the bounds" : std::string();
}

}  // namespace lrt::rdf

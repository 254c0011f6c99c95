// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/dynamic_type.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <lrt/base/immortal.hpp>
#include <lrt/base/iri.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/base/utf8.hpp"
#include "src/rdf/exactly_one.hpp"

namespace lrt::rdf {
inline namespace v0 {
namespace {

using Kind = Type::Kind;

constexpr std::size_t deepest = 32;         // half of what read_value() follows
constexpr std::size_t most_types = 20'000;  // in a type, each as often as it occurs
constexpr Iri base64_binary("http://www.w3.org/2001/XMLSchema#base64Binary");

bool same_texts(const Texts& a, const Texts& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const Text& x, const Text& y) { return x.text == y.text && x.language == y.language; });
}
bool same_words(const Facets& a, const Facets& b) {
  if (!a.has_words() || !b.has_words()) return a.has_words() == b.has_words();
  const Words x = a.words(), y = b.words();
  return same_texts(x.titles, y.titles) && same_texts(x.descriptions, y.descriptions);
}
bool same_facets(const Facets& a, const Facets& b) {
  return a.unit() == b.unit() && a.min() == b.min() && a.max() == b.max() && a.min_exclusive() == b.min_exclusive() &&
         a.max_exclusive() == b.max_exclusive() && a.allows_non_finite() == b.allows_non_finite() && a.min_length() == b.min_length() &&
         a.max_length() == b.max_length() && same_words(a, b);
}

/// The types of the parts are kept, so equal ones are one object.
bool same_field(const FieldType& a, const FieldType& b) {
  return a.name == b.name && a.predicate == b.predicate && a.type == b.type && a.read_only == b.read_only && same_facets(a.facets, b.facets) &&
         !a.absent == !b.absent && (!a.absent || same(*a.absent, *b.absent));
}
bool same_type(const Type& a, const Type& b) {
  return a.kind == b.kind && a.datatype == b.datatype && a.names == b.names && a.element == b.element && a.shortest == b.shortest &&
         a.longest == b.longest && a.name == b.name && a.classes == b.classes && a.fault == b.fault &&
         std::equal(a.fields.begin(), a.fields.end(), b.fields.begin(), b.fields.end(), same_field);
}

/// Equal types have one number: a host of messages makes thousands.
std::size_t hash_of(const Type& type) {
  std::size_t hash = static_cast<std::size_t>(type.kind);
  const auto mix = [&](std::size_t n) { hash = (hash ^ n) * static_cast<std::size_t>(0x9E3779B97F4A7C15U) + (hash >> 29U); };
  const auto mix_text = [&](std::string_view text) { mix(std::hash<std::string_view>()(text)); };
  mix_text(type.name);
  mix_text(type.datatype.text);
  mix(std::hash<const Type*>()(type.element));
  mix(type.shortest);
  mix(type.longest);
  for (const std::string& name : type.names) mix_text(name);
  for (const FieldType& field : type.fields) {
    mix_text(field.name);
    mix(std::hash<const Type*>()(field.type));
  }
  return hash;
}

/// The types that were made here, and a copy of each other type that was given a DynamicType: its values are checked.
struct Kept {
  std::mutex mutex;  // guards the rest
  std::deque<Type> made;
  std::unordered_multimap<std::size_t, const Type*> by_hash;  // of made
  std::map<const Type*, Type> copies;
};
Kept& all_kept() {
  static Immortal<Kept> kept;
  return *kept;
}

const Type& kept(Type type) {
  type.is_checked = true;
  const std::size_t hash = hash_of(type);
  Kept& all = all_kept();
  const std::lock_guard lock(all.mutex);
  const auto [first, last] = all.by_hash.equal_range(hash);
  const auto known = std::find_if(first, last, [&](const auto& t) { return same_type(*t.second, type); });
  if (known != last) return *known->second;
  const Type& made = all.made.emplace_back(std::move(type));
  all.by_hash.emplace(hash, &made);
  return made;
}

const Type& checked_copy(const Type& type) {
  if (type.is_checked) return type;
  Kept& all = all_kept();
  const std::lock_guard lock(all.mutex);
  const auto [copy, is_new] = all.copies.emplace(&type, type);
  copy->second.is_checked = true;
  return copy->second;
}

/// How deep lists, maps and records are nested.
std::size_t depth_of(const Type& type) {
  std::size_t inner = type.element ? depth_of(*type.element) : 0;
  for (const FieldType& field : type.fields) inner = std::max(inner, depth_of(*field.type));
  return inner + (type.kind == Kind::optional ? 0 : 1);
}

/// Takes the types in a type from `left`. A type that occurs twice counts twice: descriptions and values have it twice.
bool is_large(const Type& type, std::size_t& left) {
  if (left == 0) return true;
  --left;
  if (type.element && is_large(*type.element, left)) return true;
  return std::any_of(type.fields.begin(), type.fields.end(), [&](const FieldType& field) { return is_large(*field.type, left); });
}

Result<DynamicType> kept_within(Type type, const std::string& what) {
  std::size_t left = most_types;
  if (is_large(type, left))
    return unexpected(Errc::limit_exceeded, what + ": expected at most " + std::to_string(most_types) + " fields and members in all");
  if (depth_of(type) > deepest)
    return unexpected(Errc::limit_exceeded, what + ": its types are nested more than " + std::to_string(deepest) + " deep");
  return DynamicType(kept(std::move(type)));
}

bool is_text(const std::string& text) { return !utf8::find_invalid(text) && text.find('\0') == std::string::npos; }

Result<DynamicType> of_members(Kind kind, const char* what, DynamicType element, std::size_t shortest, std::size_t longest) {
  if (!element) return unexpected(Errc::invalid_option, std::string(what) + ": its members have no type");
  if (element->kind == Kind::optional) return unexpected(Errc::invalid_option, std::string(what) + ": its members cannot be optional");
  if (shortest > longest) return unexpected(Errc::invalid_option, std::string(what) + ": expected a minimum length of at most the maximum length");
  Type type;
  type.kind = kind;
  type.element = &*element;
  type.shortest = shortest;
  type.longest = longest;
  return kept_within(std::move(type), what);
}

Result<void> check_unit(const Unit& unit, const std::string& what) {
  for (const Iri term : {unit.qudt, unit.vom})
    if (!term.empty() && !iri::is_absolute(term.text))
      return unexpected(Errc::expected_iri, what + ": expected an absolute IRI as unit, found \"" + std::string(term.text) + '"');
  return {};
}

Result<void> check_bounds(const Facets& f, const std::string& what) {
  const bool is_nan = (f.min() && std::isnan(*f.min())) || (f.max() && std::isnan(*f.max()));
  const bool is_empty = f.min() && f.max() && (*f.min() > *f.max() || (*f.min() == *f.max() && (f.min_exclusive() || f.max_exclusive())));
  if (is_nan || is_empty || f.min_length() > f.max_length()) return unexpected(Errc::invalid_option, what + ": no value is within the bounds");
  return {};
}

Result<DynamicType> of_fields(Kind kind, std::string_view name, std::vector<DynamicField> fields, const std::vector<Iri>& classes) {
  const bool is_variant = kind == Kind::variant;
  const std::string what = std::string(is_variant ? "variant \"" : "record \"") + std::string(name) + '"',
                    part = is_variant ? "alternative" : "field";
  const auto is_of_name = [](char c) { return lrt::detail::is_alpha(c) || lrt::detail::is_digit(c) || c == '-' || c == '_' || c == '.'; };
  if (!std::all_of(name.begin(), name.end(), is_of_name))
    return unexpected(Errc::expected_iri, what + ": expected letters, digits, '-', '_' and '.' as name");
  Type type;
  type.kind = kind;
  if (is_variant && fields.empty()) return unexpected(Errc::invalid_option, what + ": it has no alternatives");
  bool own = classes.empty();
  for (const Iri its_class : classes) {
    if (!iri::is_absolute(its_class.text))
      return unexpected(Errc::expected_iri, what + ": expected an absolute IRI as class, found \"" + std::string(its_class.text) + '"');
    type.classes.emplace_back(its_class.text);
  }
  std::set<std::string> names, predicates;
  for (DynamicField& field : fields) {
    const std::string its = what + ", " + part + " \"" + field.name.name + '"';
    if (field.name.name.empty() || !is_text(field.name.name))
      return unexpected(Errc::invalid_option, what + ": expected UTF-8 without NUL as name of each " + part);
    if (!field.type) return unexpected(Errc::invalid_option, its + ": it has no type");
    if (is_variant && field.type->kind == Kind::optional) return unexpected(Errc::invalid_option, its + ": it cannot be optional");
    std::string predicate = std::move(field.name.predicate);
    if (predicate.empty() || predicate.front() == '#') {
      own = true;
      predicate = "#" + std::string(name) + "/" + iri::encode_segment(field.name.name);
    } else if (!iri::is_absolute(predicate)) {
      return unexpected(Errc::expected_iri, its + ": expected an absolute IRI as term, found \"" + predicate + '"');
    }
    if (!names.insert(field.name.name).second)
      return unexpected(Errc::invalid_option, what + ": two " + part + "s have the name \"" + field.name.name + '"');
    if (!predicates.insert(predicate).second)
      return unexpected(Errc::invalid_option, its + ": another " + part + " has the same term <" + predicate + '>');
    if (Result<void> r = check_unit(field.facets.unit(), its); !r) return Unexpected{std::move(r).error()};
    if (Result<void> r = check_bounds(field.facets, its); !r) return Unexpected{std::move(r).error()};
    if (field.absent) {
      std::string fault = is_variant || field.read_only || field.type->kind == Kind::optional ? "it cannot have a value if it is left out"
                                                                                              : detail::fault_of(*field.type, *field.absent);
      if (fault.empty() && !within(*field.type, field.facets, *field.absent)) fault = "the value if it is left out is outside of the bounds";
      if (!fault.empty()) return unexpected(Errc::invalid_option, its + ": " + fault);
    }
    type.fields.push_back(
        {std::move(field.name.name), std::move(predicate), &*field.type, field.facets, field.read_only, false, std::move(field.absent)});
  }
  if (own && name.empty()) return unexpected(Errc::expected_iri, what + ": it needs a name, because it has terms of its own");
  if (type.classes.empty()) type.classes.push_back("#" + std::string(name));
  if (own) type.name = name;
  return kept_within(std::move(type), what);
}

/// What is wrong with values, with the place.
class Check {
 public:
  std::string fault_of(const Type& type, const Value& value) {
    if (fits(type, value)) return {};
    std::string place = std::exchange(place_, {});
    return place.empty() ? what_ : "\"" + place + "\": " + what_;
  }

 private:
  bool wrong(std::string what) { return what_ = std::move(what), false; }
  bool expected(const char* what, const Value& value) { return wrong(std::string("expected ") + what + ", found " + found(value)); }
  static std::string found(const Value& value) {
    if (value.is_null()) return "no value";
    if (value.boolean()) return "a boolean";
    if (value.integer()) return std::to_string(*value.integer());
    if (value.large_integer()) return std::to_string(*value.large_integer());
    if (value.real()) return "a floating-point number";
    if (value.text()) return "a text";
    return "a sequence of " + std::to_string(value.sequence()->size());
  }
  /// The place is written from the inside outwards, once something is wrong.
  bool at(std::string_view name, const Type& type, const Value& value) {
    if (fits(type, value)) return true;
    place_ = place_.empty() ? std::string(name) : std::string(name) + "/" + place_;
    return false;
  }

  bool fits(const Type& type, const Value& value) {
    switch (type.kind) {
      case Kind::boolean: return value.boolean() || expected("a boolean", value);
      case Kind::integer: {
        if (!value.integer() && !value.large_integer()) return expected("an integer", value);
        const bool in_range = value.integer() ? *value.integer() < 0 ? *value.integer() >= type.lowest
                                                                     : type.highest >= static_cast<std::uint64_t>(*value.integer()) &&
                                                                           (type.lowest <= 0 || *value.integer() >= type.lowest)
                                              : *value.large_integer() <= type.highest;
        return in_range ||
               wrong("expected an integer from " + std::to_string(type.lowest) + " to " + std::to_string(type.highest) + ", found " + found(value));
      }
      case Kind::real:
        if (!value.real()) return expected("a floating-point number", value);
        return !type.single || !std::isfinite(*value.real()) || std::abs(*value.real()) <= static_cast<double>(std::numeric_limits<float>::max()) ||
               wrong("expected a number that a float can hold");
      case Kind::text:
        if (!value.text()) return expected("a text", value);
        return is_text(*value.text()) || wrong("expected a text in UTF-8 without U+0000");
      case Kind::enumeration: {
        if (value.text() && std::find(type.names.begin(), type.names.end(), *value.text()) != type.names.end()) return true;
        return value.text() && is_text(*value.text()) ? wrong("expected one of the names, found \"" + value.text()->substr(0, 80) + '"')
                                                      : expected("one of the names", value);
      }
      case Kind::duration: return value.integer() || expected("a duration, an integer of nanoseconds", value);
      case Kind::instant: return value.integer() || expected("an instant, an integer of nanoseconds", value);
      case Kind::optional: return value.is_null() || fits(*type.element, value);
      case Kind::list: return list(type, value);
      case Kind::map: return map(type, value);
      case Kind::record: return record(type, value);
      case Kind::variant: return variant(type, value);
    }
    return wrong("expected another type");
  }

  bool list(const Type& type, const Value& value) {
    const Value::Sequence* const members = value.sequence();
    if (!members) return expected("a list", value);
    if (members->size() < type.shortest || members->size() > type.longest)
      return wrong("expected a list of another length, found " + std::to_string(members->size()) + " members");
    for (std::size_t i = 0; i < members->size(); ++i)
      if (!fits(*type.element, (*members)[i])) return place_ = std::to_string(i) + (place_.empty() ? "" : "/") + place_, false;
    return true;
  }

  bool map(const Type& type, const Value& value) {
    if (!value.sequence()) return expected("a map", value);
    const std::string* last = nullptr;
    for (const Value& member : *value.sequence()) {
      const Value::Sequence* const pair = member.sequence();
      if (!pair || pair->size() != 2 || !pair->front().text()) return expected("pairs of a name and a value", member);
      const std::string& name = *pair->front().text();
      if (!is_text(name)) return wrong("expected names in UTF-8 without U+0000");
      if (last && *last >= name) return wrong("expected each name once, in the order of their bytes; found \"" + name + "\" after \"" + *last + '"');
      last = &name;
      if (!at(name, *type.element, pair->back())) return false;
    }
    return true;
  }

  bool record(const Type& type, const Value& value) {
    const Value::Sequence* const members = value.sequence();
    if (!members || members->size() != type.fields.size())
      return wrong("expected a sequence of " + std::to_string(type.fields.size()) + ", one for each field, found " + found(value));
    for (std::size_t i = 0; i < members->size(); ++i)
      if (!at(type.fields[i].name, *type.fields[i].type, (*members)[i])) return false;
    return true;
  }

  bool variant(const Type& type, const Value& value) {
    const Value::Sequence* const members = value.sequence();
    if (!members || members->size() != type.fields.size())
      return wrong("expected a sequence of " + std::to_string(type.fields.size()) + ", one for each alternative, found " + found(value));
    ExactlyOne alternatives;
    std::size_t active = 0;
    for (std::size_t i = 0; i < members->size(); ++i) {
      const bool is_present = !(*members)[i].is_null();
      alternatives.add(type.fields[i].name, is_present);
      if (is_present) active = i;
    }
    if (!alternatives.holds()) return wrong(alternatives.message());
    return at(type.fields[active].name, *type.fields[active].type, (*members)[active]);
  }

  std::string what_, place_;
};

}  // namespace

DynamicType::DynamicType(const Type& type) : type_(&checked_copy(type)) {}

DynamicType DynamicType::base64() {
  Type type;
  type.kind = Kind::text;
  type.datatype = base64_binary;
  return DynamicType(kept(std::move(type)));
}

Result<DynamicType> DynamicType::enumeration(std::vector<std::string> names) {
  if (names.empty()) return unexpected(Errc::invalid_option, "an enumeration has no names");
  std::set<std::string_view> known;
  for (const std::string& name : names) {
    if (name.empty() || !is_text(name)) return unexpected(Errc::invalid_option, "expected UTF-8 without NUL as name in an enumeration");
    if (!known.insert(name).second) return unexpected(Errc::invalid_option, "an enumeration has the name \"" + name + "\" twice");
  }
  Type type;
  type.kind = Kind::enumeration;
  type.datatype = vocab::xsd::string;
  type.names = std::move(names);
  return DynamicType(kept(std::move(type)));
}

Result<DynamicType> DynamicType::list(DynamicType element, std::size_t shortest, std::size_t longest) {
  return of_members(Kind::list, "a list", element, shortest, longest);
}
Result<DynamicType> DynamicType::map(DynamicType element) {
  return of_members(Kind::map, "a map", element, 0, std::numeric_limits<std::size_t>::max());
}
Result<DynamicType> DynamicType::optional(DynamicType element) {
  return of_members(Kind::optional, "an optional value", element, 0, std::numeric_limits<std::size_t>::max());
}

Result<DynamicType> DynamicType::record(std::string_view name, std::vector<DynamicField> fields, const std::vector<Iri>& classes) {
  return of_fields(Kind::record, name, std::move(fields), classes);
}
Result<DynamicType> DynamicType::variant(std::string_view name, std::vector<DynamicField> alternatives, const std::vector<Iri>& classes) {
  return of_fields(Kind::variant, name, std::move(alternatives), classes);
}

DynamicType DynamicType::refused(std::string fault) {
  Type type;
  type.kind = Kind::enumeration;
  type.datatype = vocab::xsd::string;
  type.fault = std::move(fault);
  return DynamicType(kept(std::move(type)));
}

Result<void> DynamicType::check(const Value& value) const {
  const std::string fault = type_ ? detail::fault_of(*type_, value) : std::string("there is no type");
  if (!fault.empty()) return unexpected(Errc::expected_value, fault);
  return {};
}

namespace detail {
std::string fault_of(const Type& type, const Value& value) { return Check().fault_of(type, value); }
}  // namespace detail

}  // namespace v0
}  // namespace lrt::rdf

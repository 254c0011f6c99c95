// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/traits.hpp>

#include <lrt/base/immortal.hpp>

namespace lrt::rdf {
inline namespace v0 {

bool same(const Value& a, const Value& b) noexcept {
  if (a.real() || b.real()) return a.real() && b.real() && std::memcmp(a.real(), b.real(), sizeof(double)) == 0;
  if (a.sequence() || b.sequence()) {
    if (!a.sequence() || !b.sequence() || a.sequence()->size() != b.sequence()->size()) return false;
    for (std::size_t i = 0; i < a.sequence()->size(); ++i)
      if (!same((*a.sequence())[i], (*b.sequence())[i])) return false;
    return true;
  }
  const auto equal = [](const auto* x, const auto* y) { return x && y && *x == *y; };
  return (a.is_null() && b.is_null()) || equal(a.boolean(), b.boolean()) || equal(a.integer(), b.integer()) ||
         equal(a.large_integer(), b.large_integer()) || equal(a.text(), b.text());
}

namespace detail {

namespace {
Type scalar(Type::Kind kind, Iri datatype, bool single = false) {
  Type t;
  t.kind = kind;
  t.datatype = datatype;
  t.single = single;
  return t;
}
}  // namespace

const Type& boolean_type() noexcept {
  static const Immortal<Type> t(scalar(Type::Kind::boolean, vocab::xsd::boolean));
  return *t;
}
const Type& text_type() noexcept {
  static const Immortal<Type> t(scalar(Type::Kind::text, vocab::xsd::string));
  return *t;
}
const Type& float_type() noexcept {
  static const Immortal<Type> t(scalar(Type::Kind::real, vocab::xsd::float_, true));
  return *t;
}
const Type& double_type() noexcept {
  static const Immortal<Type> t(scalar(Type::Kind::real, vocab::xsd::double_));
  return *t;
}
const Type& duration_type() noexcept {
  static const Immortal<Type> t(scalar(Type::Kind::duration, vocab::xsd::dayTimeDuration));
  return *t;
}
const Type& instant_type() noexcept {
  static const Immortal<Type> t(scalar(Type::Kind::instant, vocab::xsd::dateTime));
  return *t;
}

Type integer_type(std::int64_t lowest, std::uint64_t highest, std::size_t bytes) {
  const bool is_signed = lowest < 0;
  Type t;
  t.kind = Type::Kind::integer;
  t.lowest = lowest;
  t.highest = highest;
  switch (bytes) {
    case 1: t.datatype = is_signed ? vocab::xsd::byte_ : vocab::xsd::unsignedByte; break;
    case 2: t.datatype = is_signed ? vocab::xsd::short_ : vocab::xsd::unsignedShort; break;
    case 4: t.datatype = is_signed ? vocab::xsd::int_ : vocab::xsd::unsignedInt; break;
    default: t.datatype = is_signed ? vocab::xsd::long_ : vocab::xsd::unsignedLong; break;
  }
  return t;
}

Type list_type(const Type& element, std::size_t shortest, std::size_t longest) {
  Type t;
  t.kind = Type::Kind::list;
  t.element = &element;
  t.shortest = shortest;
  t.longest = longest;
  return t;
}

Type optional_type(const Type& element) {
  Type t;
  t.kind = Type::Kind::optional;
  t.element = &element;
  return t;
}

Type map_type(const Type& element) {
  Type t;
  t.kind = Type::Kind::map;
  t.element = &element;
  return t;
}

Unexpected not_a_value_of(const char* what) { return unexpected(Errc::expected_value, std::string("expected ") + what); }
Unexpected read_only() { return unexpected(Errc::expected_value, "the field is read-only"); }
Unexpected does_not_fit(const char* what) { return unexpected(Errc::out_of_range, std::string("expected ") + what + " that the C++ type can hold"); }

}  // namespace detail
}  // namespace v0
}  // namespace lrt::rdf

// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/traits.hpp>

#include <lrt/base/immortal.hpp>
#include <lrt/rdf/lexical.hpp>

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

Type set_type(const Type& element) {
  Type t = list_type(element, 0, std::numeric_limits<std::size_t>::max());
  t.each_once = true;
  return t;
}

Type map_type(const Type& element, const Type* key) {
  Type t;
  t.kind = Type::Kind::map;
  t.element = &element;
  t.key = key;
  return t;
}

Unexpected not_a_value_of(const char* what) { return unexpected(Errc::expected_value, std::string("expected ") + what); }
Unexpected not_in_set() { return unexpected(Errc::expected_value, "expected each member of the set once"); }
Unexpected read_only() { return unexpected(Errc::expected_value, "the field is read-only"); }
Unexpected does_not_fit(const char* what) { return unexpected(Errc::out_of_range, std::string("expected ") + what + " that the C++ type can hold"); }

Result<std::int64_t> periods_of(std::int64_t nanoseconds, std::int64_t num, std::int64_t den, std::int64_t lowest, std::uint64_t highest,
                                bool is_instant) {
  __extension__ using Wide = __int128;
  constexpr std::int64_t second = 1'000'000'000;
  const Wide divisor = static_cast<Wide>(num) * second;
  const Wide lower = static_cast<Wide>(nanoseconds) * den / divisor;
  bool is_whole = false;
  // A period may be no whole number of nanoseconds, and then its representation is cut to them: 1/3 s is PT0.333333333S.
  for (const Wide periods : {lower, lower + (nanoseconds < 0 ? -1 : 1)}) {
    if (periods * divisor / den != nanoseconds) continue;
    is_whole = true;
    if (periods < lowest || periods > static_cast<Wide>(std::min<std::uint64_t>(highest, std::numeric_limits<std::int64_t>::max()))) break;
    return static_cast<std::int64_t>(periods);
  }
  const std::chrono::nanoseconds found(nanoseconds);
  const std::string text = is_instant ? lexical::format_instant(found) : lexical::format(found);
  if (is_whole)
    return unexpected(Errc::expected_value,
                      std::string("expected ") + (is_instant ? "an instant" : "a duration") + " that the C++ type can hold, found " + text);
  const std::string period = num <= std::numeric_limits<std::int64_t>::max() / second && num * second % den == 0
                                 ? lexical::format(std::chrono::nanoseconds(num * second / den))
                                 : std::to_string(num) + "/" + std::to_string(den) + " s";
  return unexpected(Errc::expected_value, (is_instant ? "expected an instant in steps of " : "expected a multiple of ") + period + ", found " + text);
}

}  // namespace detail
}  // namespace v0
}  // namespace lrt::rdf

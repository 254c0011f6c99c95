// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/unit.hpp>
#include <lrt/rdf/words.hpp>

namespace lrt::rdf {
inline namespace v0 {

/// The unit of a value and the restrictions beyond its type: `Facets{unit::degree}.at_least(0).below(360)`. Those of a
/// record's field also have its words for people.
///
/// Bounds apply to numbers and, for lists and maps, to each number in them. They are compared as numbers. What a client
/// sends is checked; a value that the robot reads or publishes is not.
///
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
class Facets {
 public:
  Facets() = default;
  /// Only a unit.
  explicit Facets(const Unit& u) : unit_(&detail::kept_unit(u)) {}
  /// Sets the unit. Numbers are never converted.
  Facets& unit(const Unit& u) { return unit_ = &detail::kept_unit(u), *this; }
  /// Takes the unit of `other`.
  Facets& unit_of(const Facets& other) { return unit_ = other.unit_, *this; }
  /// Sets the lower bound; `v` itself is allowed.
  Facets& at_least(double v) { return min_ = v, has_min_ = true, min_exclusive_ = false, *this; }
  /// Sets the lower bound; `v` itself is not allowed.
  Facets& above(double v) { return min_ = v, has_min_ = true, min_exclusive_ = true, *this; }
  /// Sets the upper bound; `v` itself is allowed.
  Facets& at_most(double v) { return max_ = v, has_max_ = true, max_exclusive_ = false, *this; }
  /// Sets the upper bound; `v` itself is not allowed.
  Facets& below(double v) { return max_ = v, has_max_ = true, max_exclusive_ = true, *this; }
  /// Sets both bounds; they themselves are allowed.
  Facets& between(double low, double high) { return at_least(low).at_most(high); }
  /// Removes both bounds.
  Facets& without_bounds() { return has_min_ = false, has_max_ = false, *this; }
  /// Accepts NaN and infinities from clients. Values that the robot reads or publishes may always be non-finite.
  Facets& allow_non_finite() { return non_finite_ = true, *this; }
  /// Bounds the length of a text, in code points, or the number of bytes of a value that is bytes.
  Facets& length(std::size_t min, std::size_t max) { return min_length_ = kept_length(min), max_length_ = kept_length(max), *this; }
  /// Sets what people call a field of a record, in one language. Each call adds a language:
  /// `r.field("x", &S::x).title("Width", "en").title("Breite", "de")`. Other values have no such words: a Property and an
  /// Action have title() of their own.
  /// @par Errors  expected_rdf (the language), invalid_option (a language twice): from Server::add()
  Facets& title(std::string text, std::string language = {}) {
    Words more = words();
    more.titles.add(std::move(text), std::move(language));
    return words_ = &detail::kept_words(std::move(more)), *this;
  }
  /// Adds a sentence or more about a field of a record, see title().
  Facets& description(std::string text, std::string language = {}) {
    Words more = words();
    more.descriptions.add(std::move(text), std::move(language));
    return words_ = &detail::kept_words(std::move(more)), *this;
  }

  /// Takes everything that `other` sets. The rest stays as it is.
  Facets& merge(const Facets& other) {
    if (!other.unit_->empty()) unit_ = other.unit_;
    if (other.has_min_) min_ = other.min_, has_min_ = true, min_exclusive_ = other.min_exclusive_;
    if (other.has_max_) max_ = other.max_, has_max_ = true, max_exclusive_ = other.max_exclusive_;
    non_finite_ = non_finite_ || other.non_finite_;
    if (other.min_length_ != 0) min_length_ = other.min_length_;
    if (other.max_length_ != any_length) max_length_ = other.max_length_;
    if (other.words_) words_ = other.words_;
    return *this;
  }

  /// True if nothing is set.
  bool empty() const noexcept { return unit_->empty() && !has_min_ && !has_max_ && !non_finite_ && min_length_ == 0 && max_length_ == any_length; }
  const Unit& unit() const noexcept { return *unit_; }                                                  ///< unit::none: none is set
  std::optional<double> min() const noexcept { return has_min_ ? std::optional(min_) : std::nullopt; }  ///< lower bound
  std::optional<double> max() const noexcept { return has_max_ ? std::optional(max_) : std::nullopt; }  ///< upper bound
  bool min_exclusive() const noexcept { return min_exclusive_; }                                        ///< the lower bound itself is not allowed
  bool max_exclusive() const noexcept { return max_exclusive_; }                                        ///< the upper bound itself is not allowed
  bool allows_non_finite() const noexcept { return non_finite_; }                                       ///< clients may send NaN and infinities
  std::size_t min_length() const noexcept { return min_length_; }                                       ///< of a text, in code points
  std::size_t max_length() const noexcept {                                                             ///< of a text, in code points
    return max_length_ == any_length ? std::numeric_limits<std::size_t>::max() : max_length_;
  }
  Words words() const { return words_ ? *words_ : Words(); }     ///< of a field of a record
  bool has_words() const noexcept { return words_ != nullptr; }  ///< words() is not empty

 private:
  static constexpr std::uint32_t any_length = std::numeric_limits<std::uint32_t>::max();
  static std::uint32_t kept_length(std::size_t n) noexcept { return n < any_length ? static_cast<std::uint32_t>(n) : any_length; }

  const Unit* unit_ = &unit::none;  // kept for the life of the process
  const Words* words_ = nullptr;    // as `unit_`; nullptr: none
  double min_ = 0, max_ = 0;
  bool has_min_ = false, has_max_ = false, min_exclusive_ = false, max_exclusive_ = false, non_finite_ = false;
  std::uint32_t min_length_ = 0, max_length_ = any_length;  // a longer text than 32 bits count is not expected
};

struct Type;
class Value;

/// One field of a record.
struct FieldType {
  std::string name;                       ///< for people and JSON
  std::string predicate;                  ///< a term: an absolute IRI, or "#Type/name" of the server's vocabulary
  const Type* type = nullptr;             ///< of its values
  Facets facets;                          ///< unit and bounds of its values
  bool read_only = false;                 ///< values of the record cannot be decoded
  bool takes_unit = false;                ///< the unit of the record applies to this field, and not to other fields
  std::shared_ptr<const Value> absent{};  ///< its value if a client leaves it out; null: a client must state it
};

/// Describes the values of a C++ type for every representation. Made by rdf::traits<T>::type().
struct Type {
  /// Which C++ types it describes: see rdf::traits.
  enum class Kind : std::uint8_t { boolean, integer, real, text, enumeration, duration, instant, list, optional, record, map, variant };

  Kind kind = Kind::text;                                         ///< which of the members below have a meaning
  Iri datatype;                                                   ///< of the literal; empty for list, optional, record, map and variant
  std::int64_t lowest = 0;                                        ///< integer: smallest value of the C++ type
  std::uint64_t highest = 0;                                      ///< integer: largest value of the C++ type
  bool single = false;                                            ///< real: float, not double
  std::vector<std::string> names;                                 ///< enumeration: names in the given order
  std::vector<Words> name_words;                                  ///< enumeration: words of the name with the same index; may be shorter
  const Type* element = nullptr;                                  ///< list, optional, map: type of the members or of the value
  std::size_t shortest = 0;                                       ///< list: minimum number of members; text of bytes: of bytes
  std::size_t longest = std::numeric_limits<std::size_t>::max();  ///< list: maximum number of members; text of bytes: of bytes
  std::string name;                        ///< record, variant: name of the C++ type, "PidGains"; empty: it has no terms of its own
  std::vector<std::string> classes;        ///< record, variant: its rdf:types, terms: absolute IRIs, or "#Type" of the server's vocabulary
  std::vector<FieldType> fields;           ///< record: its fields in order; variant: its alternatives in order, a value has exactly one
  std::string value_predicate;             ///< record: from its node to a node that has its fields; empty: the fields are at its own node
  std::vector<std::string> value_classes;  ///< record with a value_predicate: rdf:types of that node
  Iri quantity_kind;                       ///< record: object of vom:quantityKind
  std::string fault;                       ///< what is wrong with it, a sentence; Server::add() refuses the type. Empty: nothing
  bool is_checked = false;                 ///< its values are made by the host, not by rdf::traits, and checked: a DynamicType
  bool each_once = false;                  ///< list: no member occurs twice, as in a set
  const Type* key = nullptr;               ///< map: an integer or an enumeration whose values are the names; nullptr: any text

  /// A text that is base64 (xsd:base64Binary): Facets::length() counts its bytes.
  bool is_bytes() const noexcept { return kind == Kind::text && datatype == Iri("http://www.w3.org/2001/XMLSchema#base64Binary"); }
  bool is_number() const noexcept { return kind == Kind::integer || kind == Kind::real; }  ///< integer or real
  /// Record or variant: a node with a predicate for each of the fields that it has.
  bool has_fields() const noexcept { return kind == Kind::record || kind == Kind::variant; }
};

/// The unit stated at the node of a record: none if one of its fields takes it.
inline Unit node_unit(const Type& record, const Facets& facets) {
  for (const FieldType& field : record.fields)
    if (field.takes_unit) return unit::none;
  return facets.unit();
}

/// The facets of a field of a record that has the facets `record`.
inline Facets field_facets(const FieldType& field, const Facets& record) {
  return field.takes_unit ? Facets(field.facets).unit_of(record) : field.facets;
}

}  // namespace v0
}  // namespace lrt::rdf

namespace lrt {
inline namespace v0 {
using rdf::Facets;
}  // namespace v0
}  // namespace lrt

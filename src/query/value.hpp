// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "src/query/budget.hpp"
#include "src/query/dataset.hpp"
#include "src/query/decimal.hpp"
#include "src/query/reading.hpp"
#include "src/query/terms.hpp"

namespace lrt::query {

/// The result of an expression: an error, a term, or a literal without a term number. Numbers are computed without their lexical forms.
struct Value {
  bool failed = true;
  Type type = Type::other;
  bool fits = false;  ///< of an integer: within int64
  bool owns = false;
  TermNumber term = nothing;  ///< if it is known
  union {
    std::int64_t integer;
    double real;  ///< as in Reading
    bool truth;
  };
  std::string_view borrowed, language;  ///< views into Terms
  std::string owned;

  Value() noexcept : integer(0) {}
  explicit Value(bool value) noexcept : failed(false), type(Type::boolean), integer(0) { truth = value; }
  explicit Value(std::int64_t value) noexcept : failed(false), type(Type::integer), fits(true), integer(value) {}
  Value(double value, Type kind) noexcept : failed(false), type(kind), integer(0) { real = value; }
  /// A string, or one with a language that Terms keeps.
  explicit Value(std::string text, std::string_view tag = {}) noexcept
      : failed(false), type(tag.empty() ? Type::string : Type::tagged), owns(true), integer(0), language(tag), owned(std::move(text)) {}

  bool is_literal() const noexcept { return !failed && type != Type::iri && type != Type::blank; }
  /// A string literal of 17.4.3.1: with or without a language.
  bool is_text() const noexcept { return !failed && (type == Type::string || type == Type::tagged); }
  bool is_number() const noexcept { return !failed && query::is_number(type); }
  bool is_floating() const noexcept { return type == Type::float_ || type == Type::double_; }
  double as_double() const noexcept { return type == Type::integer && fits ? static_cast<double>(integer) : real; }
  /// The nearest float: an exact number is rounded once.
  float as_float() const noexcept;
  /// The text of a string, decimal or integer that does not fit; of a term: its IRI or lexical form.
  std::string_view text() const noexcept { return owns ? std::string_view(owned) : borrowed; }
};

/// A number with an exponent, without it: "1.25e-04" is "0.000125".
std::string without_exponent(const std::string& text);

/// The operators of SPARQL 17.3 on values, and those of XPath on times and durations.
class Operators {
 public:
  Operators(Terms& terms, Budget& budget) noexcept : terms_(terms), budget_(budget) {}

  Value of(TermNumber term) const;
  Value of(const Decimal& number, Type type) const;
  /// Makes a literal or finds it. @pre the value is no error
  TermNumber number_of(const Value& value);
  /// The lexical form or IRI; nullopt: a blank node or an error.
  std::optional<std::string> text_of(const Value& value) const;
  rdf::TermView view_of(const Value& value, std::string& memory) const;

  /// The effective boolean value (17.2.2); nullopt: an error.
  static std::optional<bool> truth(const Value& value, const Terms& terms);
  std::optional<bool> truth(const Value& value) const { return truth(value, terms_); }
  std::optional<bool> equal(const Value& a, const Value& b) const;
  std::optional<bool> less(const Value& a, const Value& b) const;
  enum class Arithmetic : std::uint8_t { add, subtract, multiply, divide };
  Value compute(Arithmetic operation, const Value& a, const Value& b) const;
  /// The order of ORDER BY (15.1): negative, 0, positive. Literals of different kinds are ordered by their kind.
  int order(TermNumber a, TermNumber b) const;

 private:
  enum class Order : std::uint8_t { less, equal, greater, none };
  Value compute_times(Arithmetic operation, const Value& a, const Value& b) const;
  Order compare_numbers(const Value& a, const Value& b) const;
  Order compare(const Value& a, const Value& b) const;
  std::string exact_text(const Value& value) const;

  Terms& terms_;
  Budget& budget_;
};

}  // namespace lrt::query

// SPDX-License-Identifier: Apache-2.0
#include "src/query/value.hpp"

#include <cmath>

#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/query/times.hpp"
#include "src/shacl/order.hpp"

namespace lrt::query {
namespace {

namespace lexical = rdf::lexical;
using lexical::Datatype;

int sign(bool less, bool greater) noexcept { return less ? -1 : greater ? 1 : 0; }
int compare_texts(std::string_view a, std::string_view b) noexcept {
  const int order = a.compare(b);
  return sign(order<0, order> 0);
}

/// The place of a kind of term in the order of ORDER BY.
int rank(Type type) noexcept {
  switch (type) {
    case Type::blank: return 1;
    case Type::iri: return 2;
    case Type::integer:
    case Type::decimal:
    case Type::float_:
    case Type::double_: return 3;
    case Type::string: return 4;
    case Type::tagged: return 5;
    case Type::boolean: return 6;
    case Type::date_time: return 7;
    case Type::other: return 8;
  }
  return 8;
}

}  // namespace

float Value::as_float() const noexcept {
  if (type == Type::integer && fits) return static_cast<float>(integer);
  if (type == Type::integer || type == Type::decimal) return lexical::parse_float(text()).value_or(0) + 0.0F;  // they have no -0
  return static_cast<float>(real);
}

std::string without_exponent(const std::string& text) {
  const std::size_t e = text.find('e');
  if (e == std::string::npos) return text;
  int exponent = std::stoi(text.substr(e + 1));
  const bool negative = text[0] == '-';
  std::string digits = text.substr(negative ? 1 : 0, e - (negative ? 1 : 0));
  if (const std::size_t point = digits.find('.'); point != std::string::npos) {
    exponent -= static_cast<int>(digits.size() - point - 1);
    digits.erase(point, 1);
  }
  if (exponent >= 0) {
    digits.append(static_cast<std::size_t>(exponent), '0');
  } else {
    const auto places = static_cast<std::size_t>(-exponent);
    if (digits.size() <= places) digits.insert(0, places - digits.size() + 1, '0');
    digits.insert(digits.size() - places, 1, '.');
  }
  return (negative ? "-" : "") + digits;
}

Value Operators::of(TermNumber term) const {
  Value value;
  if (term == nothing) return value;
  const Reading& reading = terms_.value(term);
  value.failed = false;
  value.type = reading.type;
  value.fits = reading.fits;
  value.term = term;
  switch (reading.type) {
    case Type::boolean: value.truth = reading.truth; break;
    case Type::integer:
      if (reading.fits) {
        value.integer = reading.integer;
        break;
      }
      [[fallthrough]];
    case Type::decimal:
      value.real = reading.real;
      value.borrowed = terms_.term(term).text;
      break;
    case Type::float_:
    case Type::double_: value.real = reading.real; break;
    default: {
      const rdf::TermView view = terms_.term(term);
      value.borrowed = view.text;
      value.language = view.language;
    }
  }
  return value;
}

Value Operators::of(const Decimal& number, Type type) const {
  std::string text = number.text();
  if (type == Type::integer) {
    if (const auto integer = lexical::parse_int64(text)) return Value(*integer);
  }
  Value value(lexical::parse_double(text).value_or(0), type);
  value.owned = std::move(text);
  value.owns = true;
  return value;
}

/// A term of a value, whose text may be put into `memory`.
rdf::TermView Operators::view_of(const Value& value, std::string& memory) const {
  if (value.term != nothing) return terms_.term(value.term);
  switch (value.type) {
    case Type::boolean: return rdf::literal(value.truth ? "true" : "false", vocab::xsd::boolean);
    case Type::integer:
      if (!value.fits) return rdf::literal(value.text(), vocab::xsd::integer);
      memory = std::to_string(value.integer);
      return rdf::literal(memory, vocab::xsd::integer);
    case Type::decimal: return rdf::literal(value.text(), vocab::xsd::decimal);
    case Type::float_: memory = lexical::format(static_cast<float>(value.real)); return rdf::literal(memory, vocab::xsd::float_);
    case Type::double_: memory = lexical::format(value.real); return rdf::literal(memory, vocab::xsd::double_);
    case Type::tagged: return rdf::tagged_literal(value.text(), value.language);
    default: return rdf::literal(value.text(), vocab::xsd::string);
  }
}

TermNumber Operators::number_of(const Value& value) {
  if (value.term != nothing) return value.term;
  std::string memory;
  return terms_.intern(view_of(value, memory));
}

std::optional<std::string> Operators::text_of(const Value& value) const {
  if (value.failed || value.type == Type::blank) return std::nullopt;
  std::string memory;
  return std::string(view_of(value, memory).text);
}

std::optional<bool> Operators::truth(const Value& value, const Terms& terms) {
  if (value.failed) return std::nullopt;
  switch (value.type) {
    case Type::boolean: return value.truth;
    case Type::string:
    case Type::tagged: return !value.text().empty();
    case Type::integer: return value.fits ? value.integer != 0 : true;
    case Type::decimal: return value.text().find_first_of("123456789") != std::string_view::npos;  // the nearest double may be 0
    case Type::float_:
    case Type::double_: return value.real != 0 && !std::isnan(value.real);
    case Type::other: {  // an ill-typed number or boolean is false
      const Datatype datatype = lexical::datatype_of(terms.term(value.term).datatype);
      const bool known = datatype == Datatype::boolean || datatype == Datatype::decimal || datatype == Datatype::float_ ||
                         datatype == Datatype::double_ || lexical::is_integer_type(datatype);
      return known ? std::optional<bool>(false) : std::nullopt;
    }
    default: return std::nullopt;
  }
}

std::string Operators::exact_text(const Value& value) const {
  if (value.type == Type::integer && value.fits) return std::to_string(value.integer);
  return std::string(value.text());
}

Operators::Order Operators::compare_numbers(const Value& a, const Value& b) const {
  if (a.type == Type::integer && b.type == Type::integer && a.fits && b.fits)
    return a.integer < b.integer ? Order::less : a.integer > b.integer ? Order::greater : Order::equal;
  if (a.is_floating() || b.is_floating()) {
    // Without an xsd:double, exact numbers are promoted to xsd:float.
    const bool is_single = a.type != Type::double_ && b.type != Type::double_;
    const double x = is_single ? static_cast<double>(a.as_float()) : a.as_double(), y = is_single ? static_cast<double>(b.as_float()) : b.as_double();
    return x < y ? Order::less : x > y ? Order::greater : x == y ? Order::equal : Order::none;
  }
  const std::string x = exact_text(a), y = exact_text(b);
  budget_.work(x.size() + y.size());
  const int order = lexical::compare_decimal(x, y);
  return order < 0 ? Order::less : order > 0 ? Order::greater : Order::equal;
}

/// The order of values that have one. none: they cannot be compared, or they are not ordered.
Operators::Order Operators::compare(const Value& a, const Value& b) const {
  if (a.is_number() && b.is_number()) return compare_numbers(a, b);
  if (a.type != b.type) return Order::none;
  switch (a.type) {
    case Type::string: {
      budget_.work(std::min(a.text().size(), b.text().size()));
      const int order = a.text().compare(b.text());
      return order < 0 ? Order::less : order > 0 ? Order::greater : Order::equal;
    }
    case Type::boolean: return a.truth == b.truth ? Order::equal : b.truth ? Order::less : Order::greater;
    case Type::date_time:
    case Type::other:
      switch (shacl::compare(shacl::Comparable(terms_.term(a.term)), shacl::Comparable(terms_.term(b.term)))) {
        case shacl::Order::less: return Order::less;
        case shacl::Order::equal: return Order::equal;
        case shacl::Order::greater: return Order::greater;
        case shacl::Order::unordered: return Order::none;
      }
      return Order::none;
    default: return Order::none;
  }
}

std::optional<bool> Operators::equal(const Value& a, const Value& b) const {
  if (a.failed || b.failed) return std::nullopt;
  if (a.is_number() && b.is_number()) return compare_numbers(a, b) == Order::equal;
  if (a.term != nothing && a.term == b.term) return true;
  if (!a.is_literal() || !b.is_literal()) return false;  // the same IRIs and blank nodes have the same number
  if (a.type == Type::tagged && b.type == Type::tagged) return a.text() == b.text() && a.language == b.language;
  if (a.type == Type::tagged || b.type == Type::tagged) return false;
  if (const Order order = compare(a, b); order != Order::none) return order == Order::equal;
  // Different terms of a datatype that is not understood may have the same value, and so may times of which one has no zone. Values of
  // different datatypes that are understood are different.
  const auto is_understood = [&](const Value& v) { return v.type != Type::other || shacl::Comparable(terms_.term(v.term)).ordered(); };
  if (!is_understood(a) || !is_understood(b)) return std::nullopt;
  if (a.type != b.type) return false;
  if (a.type != Type::other) return std::nullopt;
  const rdf::TermView s = terms_.term(a.term), t = terms_.term(b.term);
  const auto is_duration = [](const rdf::TermView& v) { return lexical::datatype_of(v.datatype) >= Datatype::duration; };
  if (s.datatype == t.datatype || (is_duration(s) && is_duration(t))) return std::nullopt;
  return false;
}

std::optional<bool> Operators::less(const Value& a, const Value& b) const {
  if (a.failed || b.failed) return std::nullopt;
  const Order order = compare(a, b);
  if (order != Order::none) return order == Order::less;
  return a.is_number() && b.is_number() ? std::optional<bool>(false) : std::nullopt;  // NaN
}

/// Of times and durations, and of these with numbers.
Value Operators::compute_times(Arithmetic operation, const Value& a, const Value& b) const {
  const auto is_time = [](const Value& v) { return !v.failed && (v.type == Type::date_time || v.type == Type::other) && v.term != nothing; };
  if (!(is_time(a) || a.is_number()) || !(is_time(b) || b.is_number())) return {};
  budget_.step(16);
  const auto number = [&](const Value& v) {
    std::string text = v.is_floating() ? std::isfinite(v.real) ? without_exponent(lexical::format(v.real)) : std::string() : exact_text(v);
    return Decimal::parse(text);
  };
  std::optional<TimeResult> result;
  if (is_time(a) && is_time(b)) {
    const rdf::TermView s = terms_.term(a.term), t = terms_.term(b.term);
    budget_.work(s.text.size() + t.text.size());
    switch (operation) {
      case Arithmetic::add: result = add_times(s, t); break;
      case Arithmetic::subtract: result = subtract_times(s, t); break;
      case Arithmetic::divide: result = divide_durations(s, t); break;
      case Arithmetic::multiply: break;
    }
  } else if (operation == Arithmetic::multiply || (operation == Arithmetic::divide && is_time(a))) {
    const rdf::TermView s = terms_.term(is_time(a) ? a.term : b.term);
    budget_.work(s.text.size());
    if (const auto by = number(is_time(a) ? b : a)) result = operation == Arithmetic::multiply ? multiply_duration(s, *by) : divide_duration(s, *by);
  }
  if (!result) return {};
  if (result->datatype == vocab::xsd::decimal) {
    const auto ratio = Decimal::parse(result->text);
    return ratio ? of(*ratio, Type::decimal) : Value();
  }
  return of(terms_.intern(rdf::literal(result->text, result->datatype)));
}

Value Operators::compute(Arithmetic operation, const Value& a, const Value& b) const {
  if (!a.is_number() || !b.is_number()) return compute_times(operation, a, b);
  if (a.is_floating() || b.is_floating()) {
    const double x = a.as_double(), y = b.as_double();
    if (a.type != Type::double_ && b.type != Type::double_) {
      const float f = a.as_float(), g = b.as_float();
      float result = 0;
      switch (operation) {
        case Arithmetic::add: result = f + g; break;
        case Arithmetic::subtract: result = f - g; break;
        case Arithmetic::multiply: result = f * g; break;
        case Arithmetic::divide: result = f / g; break;
      }
      return Value(static_cast<double>(result), Type::float_);
    }
    switch (operation) {
      case Arithmetic::add: return Value(x + y, Type::double_);
      case Arithmetic::subtract: return Value(x - y, Type::double_);
      case Arithmetic::multiply: return Value(x * y, Type::double_);
      case Arithmetic::divide: return Value(x / y, Type::double_);
    }
  }
  const bool integers = a.type == Type::integer && b.type == Type::integer;
  if (integers && a.fits && b.fits && operation != Arithmetic::divide) {
    std::int64_t result = 0;
    const bool overflow = operation == Arithmetic::add        ? __builtin_add_overflow(a.integer, b.integer, &result)
                          : operation == Arithmetic::subtract ? __builtin_sub_overflow(a.integer, b.integer, &result)
                                                              : __builtin_mul_overflow(a.integer, b.integer, &result);
    if (!overflow) return Value(result);
  }
  const auto x = Decimal::parse(exact_text(a)), y = Decimal::parse(exact_text(b));
  if (!x || !y) return {};
  budget_.step(8);
  std::optional<Decimal> result;
  switch (operation) {
    case Arithmetic::add: result = add(*x, *y); break;
    case Arithmetic::subtract: result = subtract(*x, *y); break;
    case Arithmetic::multiply: result = multiply(*x, *y); break;
    case Arithmetic::divide: result = divide(*x, *y); break;
  }
  if (!result) return {};
  return of(*result, integers && operation != Arithmetic::divide ? Type::integer : Type::decimal);
}

int Operators::order(TermNumber a, TermNumber b) const {
  if (a == b) return 0;
  if (a == nothing || b == nothing) return a == nothing ? -1 : 1;
  const Reading &x = terms_.value(a), &y = terms_.value(b);
  const int rank_a = rank(x.type), rank_b = rank(y.type);
  if (rank_a != rank_b) return sign(rank_a < rank_b, true);
  if (x.type == Type::blank) return sign(a < b, true);
  if (is_number(x.type)) {
    const Value v = of(a), w = of(b);
    switch (compare_numbers(v, w)) {
      case Order::less: return -1;
      case Order::equal: return 0;
      case Order::greater: return 1;
      case Order::none: {  // NaN is before other numbers
        const bool nan_a = v.is_floating() && std::isnan(v.real), nan_b = w.is_floating() && std::isnan(w.real);
        return nan_a && nan_b ? 0 : nan_a ? -1 : 1;
      }
    }
  }
  if (x.type == Type::boolean) return sign(!x.truth && y.truth, x.truth && !y.truth);
  const rdf::TermView s = terms_.term(a), t = terms_.term(b);
  budget_.work(std::min(s.text.size(), t.text.size()));
  if (x.type == Type::date_time || x.type == Type::other) {
    // Total, also where values cannot be compared: without a zone as in UTC, then by the datatype and the text.
    const Datatype datatype_a = lexical::datatype_of(s.datatype), datatype_b = lexical::datatype_of(t.datatype);
    const auto m = lexical::parse_moment(s.text, datatype_a), n = lexical::parse_moment(t.text, datatype_b);
    if (m.has_value() != n.has_value()) return m ? -1 : 1;
    if (x.type == Type::other) {
      if (const int order = compare_texts(s.datatype, t.datatype); order != 0) return order;
    }
    if (const auto v = m || n ? std::nullopt : length_of(s), w = v ? length_of(t) : std::nullopt; v && w) {
      const auto difference = subtract(*v, *w);
      if (difference && !difference->is_zero()) return difference->text().front() == '-' ? -1 : 1;
    }
    if (m && n) {
      if (m->seconds != n->seconds) return sign(m->seconds < n->seconds, true);
      return compare_texts(m->fraction, n->fraction);
    }
  }
  if (const int order = compare_texts(s.text, t.text); order != 0) return order;
  return compare_texts(s.language, t.language);
}

}  // namespace lrt::query

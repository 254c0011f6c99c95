// SPDX-License-Identifier: Apache-2.0
#include "src/shacl/order.hpp"

#include <lrt/rdf/vocab.hpp>

#include "src/base/civil.hpp"

namespace lrt::shacl {
namespace {

using rdf::lexical::Datatype;
using rdf::lexical::Duration;
using rdf::lexical::Moment;

template <class T>
Order of(const T& a, const T& b) noexcept {
  return a < b ? Order::less : b < a ? Order::greater : a == b ? Order::equal : Order::unordered;
}

Order of(const Moment& a, const Moment& b) noexcept {
  if (a.zoned == b.zoned) return a.seconds != b.seconds ? of(a.seconds, b.seconds) : of(a.fraction, b.fraction);
  // XSD 1.1 part 2, E.3.3: without a zone the instant may differ by up to 14 hours to either side.
  constexpr std::int64_t widest = 14 * 3600;
  const auto is_before = [](const Moment& x, const Moment& y) {
    return x.seconds + widest != y.seconds ? x.seconds + widest < y.seconds : x.fraction < y.fraction;
  };
  if (is_before(a, b)) return Order::less;
  return is_before(b, a) ? Order::greater : Order::unordered;
}

Order seconds_of(std::int64_t a, const Duration& x, std::int64_t b, const Duration& y) noexcept {
  if (a != b) return of(a, b);
  if (x.negative != y.negative && !(x.fraction.empty() && y.fraction.empty())) {
    const int left = x.fraction.empty() ? 0 : x.negative ? -1 : 1, right = y.fraction.empty() ? 0 : y.negative ? -1 : 1;
    return of(left, right);
  }
  return x.negative ? of(y.fraction, x.fraction) : of(x.fraction, y.fraction);
}

/// XSD 1.1 part 2, 3.3.6.1: a duration is less if it is less when added to each of four dates.
Order of(const Duration& a, const Duration& b) noexcept {
  if (a.months == b.months) return seconds_of(a.seconds, a, b.seconds, b);
  constexpr std::int64_t enough = INT64_MAX / 86'400 / 64;
  if (a.months > enough || a.months < -enough || b.months > enough || b.months < -enough) return Order::unordered;
  Order common = Order::equal;
  bool first = true;
  constexpr struct { std::int64_t year, month; } starts[] = {{1696, 9}, {1697, 2}, {1903, 3}, {1903, 7}};
  for (const auto& start : starts) {
    const auto seconds_after = [&](const Duration& d, std::int64_t& out) {
      const std::int64_t month = start.year * 12 + start.month - 1 + d.months;
      const std::int64_t year = month >= 0 ? month / 12 : -((-month + 11) / 12);
      const std::int64_t of_year = month - year * 12;
      const std::int64_t days = lrt::detail::days_from_civil(year, static_cast<unsigned>(of_year) + 1, 1);
      return !__builtin_mul_overflow(days, std::int64_t{86'400}, &out) && !__builtin_add_overflow(out, d.seconds, &out);
    };
    std::int64_t x = 0, y = 0;
    if (!seconds_after(a, x) || !seconds_after(b, y)) return Order::unordered;
    const Order here = seconds_of(x, a, y, b);
    if (!first && here != common) return Order::unordered;
    common = here;
    first = false;
  }
  return common;
}

}  // namespace

Comparable::Comparable(const rdf::TermView& term) noexcept {
  if (!term.is_literal() || !term.language.empty()) return;
  text_ = term.text;
  if (term.datatype.empty() || term.datatype == vocab::xsd::string.text) {
    kind_ = Kind::text;
    return;
  }
  const Datatype type = rdf::lexical::datatype_of(term.datatype);
  const auto moment = [&](Kind kind) {
    if (const auto m = rdf::lexical::parse_moment(text_, type)) moment_ = *m, kind_ = kind;
  };
  switch (type) {
    case Datatype::float_:
      if (const auto f = rdf::lexical::parse_float(text_)) number_ = static_cast<double>(*f), kind_ = Kind::single;
      break;
    case Datatype::double_:
      if (const auto d = rdf::lexical::parse_double(text_)) number_ = *d, kind_ = Kind::real;
      break;
    case Datatype::boolean:
      if (const auto b = rdf::lexical::parse_boolean(text_)) number_ = *b ? 1 : 0, kind_ = Kind::boolean;
      break;
    case Datatype::date_time:
    case Datatype::date_time_stamp: moment(Kind::date_time); break;
    case Datatype::date: moment(Kind::date); break;
    case Datatype::time: moment(Kind::time); break;
    case Datatype::g_year: moment(Kind::year); break;
    case Datatype::g_year_month: moment(Kind::year_month); break;
    case Datatype::duration:
    case Datatype::day_time_duration:
    case Datatype::year_month_duration:
      if (const auto d = rdf::lexical::parse_full_duration(text_, type)) duration_ = *d, kind_ = Kind::duration;
      break;
    default:
      if ((type == Datatype::decimal || rdf::lexical::is_integer_type(type)) && rdf::lexical::is_well_formed(text_, type)) kind_ = Kind::decimal;
  }
}

/// XPath and XQuery Operators 3.1, 4.3 with the promotions of XPath 3.1 B.1: exact unless one is a float or double.
Order Comparable::numbers(const Comparable& a, const Comparable& b) noexcept {
  if (a.kind_ == Kind::decimal && b.kind_ == Kind::decimal) {
    const int order = rdf::lexical::compare_decimal(a.text_, b.text_);
    return of(order, 0);
  }
  const bool in_double = a.kind_ == Kind::real || b.kind_ == Kind::real;
  const auto value = [&](const Comparable& c) {
    if (c.kind_ != Kind::decimal) return c.number_;
    if (in_double) return rdf::lexical::parse_double(c.text_).value_or(0);
    return static_cast<double>(rdf::lexical::parse_float(c.text_).value_or(0));
  };
  return of(value(a), value(b));
}

Order compare(const Comparable& a, const Comparable& b) noexcept {
  using Kind = Comparable::Kind;
  const auto is_number = [](const Comparable& c) { return c.kind_ == Kind::decimal || c.kind_ == Kind::single || c.kind_ == Kind::real; };
  if (is_number(a) && is_number(b)) return Comparable::numbers(a, b);
  if (a.kind_ != b.kind_) return Order::unordered;
  switch (a.kind_) {
    case Kind::text: return of(a.text_, b.text_);
    case Kind::boolean: return of(a.number_, b.number_);
    case Kind::date_time:
    case Kind::date:
    case Kind::time:
    case Kind::year:
    case Kind::year_month: return of(a.moment_, b.moment_);
    case Kind::duration: return of(a.duration_, b.duration_);
    default: return Order::unordered;
  }
}

}  // namespace lrt::shacl

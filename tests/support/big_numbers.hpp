// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <boost/multiprecision/cpp_int.hpp>

#include <lrt/rdf/lexical.hpp>

/// A second reader of lexical forms, on integers of any length. It shares no code with lrt and has no bounds of its own.
namespace lrt::test::big {

using Integer = boost::multiprecision::cpp_int;
using rdf::lexical::Datatype;

inline Integer power_of_ten(const Integer& n) { return boost::multiprecision::pow(Integer(10), static_cast<unsigned>(n)); }
inline Integer floor_divided(const Integer& a, const Integer& b) {
  Integer q = a / b;
  if (q * b != a && (a < 0) != (b < 0)) --q;
  return q;
}

/// Cuts a text from the left.
struct Cursor {
  std::string_view rest;
  bool take(char c) {
    if (rest.empty() || rest.front() != c) return false;
    rest.remove_prefix(1);
    return true;
  }
  std::string digits() {
    std::string all;
    while (!rest.empty() && rest.front() >= '0' && rest.front() <= '9') all += rest.front(), rest.remove_prefix(1);
    return all;
  }
};
inline Integer integer_of(std::string digits) {
  digits.erase(0, digits.find_first_not_of('0'));  // Boost reads a leading 0 as octal
  return digits.empty() ? Integer(0) : Integer(digits);
}

/// digits * 10^exponent
struct Number {
  enum class Kind { finite, infinite, nan } kind = Kind::finite;
  bool negative = false;
  Integer digits, exponent;
  bool has_point = false, has_exponent = false;
  bool is_zero() const { return kind == Kind::finite && digits == 0; }
};

inline std::optional<Number> number_of(std::string_view text) {
  Number n;
  if (text == "NaN") return n.kind = Number::Kind::nan, n;
  if (text == "INF" || text == "+INF" || text == "-INF") return n.kind = Number::Kind::infinite, n.negative = text[0] == '-', n;
  Cursor at{text};
  n.negative = at.take('-');
  if (!n.negative) at.take('+');
  const std::string whole = at.digits();
  std::string fraction;
  if (at.take('.')) n.has_point = true, fraction = at.digits();
  if (whole.empty() && fraction.empty()) return std::nullopt;
  n.digits = integer_of(whole + fraction);
  n.exponent = -Integer(fraction.size());
  if (at.take('e') || at.take('E')) {
    n.has_exponent = true;
    const bool minus = at.take('-');
    if (!minus) at.take('+');
    const std::string exponent = at.digits();
    if (exponent.empty()) return std::nullopt;
    n.exponent += minus ? Integer(-integer_of(exponent)) : integer_of(exponent);
  }
  return at.rest.empty() ? std::optional(n) : std::nullopt;
}

/// The nearest number of a binary type, halves to even; infinity and 0 beyond its range.
/// @tparam T  float or double
template <class T>
T nearest(const Number& n) {
  using Limits = std::numeric_limits<T>;
  const auto signed_value = [&](T value) { return n.negative ? -value : value; };
  if (n.kind == Number::Kind::nan) return Limits::quiet_NaN();
  if (n.kind == Number::Kind::infinite) return signed_value(Limits::infinity());
  if (n.digits == 0) return signed_value(0);
  const Integer places = Integer(n.digits.str().size()) + n.exponent;
  if (places > 400) return signed_value(Limits::infinity());
  if (places < -400) return signed_value(0);
  Integer top = n.digits, bottom = 1;
  if (n.exponent >= 0) top *= power_of_ten(n.exponent);
  else bottom = power_of_ten(-n.exponent);
  const int lowest = Limits::min_exponent - Limits::digits;  // of the last bit of a subnormal
  int last = static_cast<int>(boost::multiprecision::msb(top)) - static_cast<int>(boost::multiprecision::msb(bottom)) - Limits::digits;
  for (last = last < lowest ? lowest : last;; ++last) {
    Integer scaled_top = top, scaled_bottom = bottom;
    if (last >= 0) scaled_bottom <<= static_cast<unsigned>(last);
    else scaled_top <<= static_cast<unsigned>(-last);
    Integer q = scaled_top / scaled_bottom;
    const Integer twice = (scaled_top - q * scaled_bottom) * 2;
    if (q >= (Integer(1) << Limits::digits)) continue;
    if (twice > scaled_bottom || (twice == scaled_bottom && q % 2 != 0)) ++q;
    return signed_value(static_cast<T>(std::ldexp(static_cast<long double>(static_cast<std::uint64_t>(q)), last)));
  }
}

/// The integer, if the number is one, however it is written. Only numbers of at most 1,000 digits.
inline std::optional<Integer> whole(const Number& n) {
  if (n.kind != Number::Kind::finite) return std::nullopt;
  if (n.digits == 0) return Integer(0);
  if (n.exponent > 1'000 || n.exponent < -2'000) return std::nullopt;
  Integer value = n.digits;
  if (n.exponent >= 0) {
    value *= power_of_ten(n.exponent);
  } else {
    const Integer divisor = power_of_ten(-n.exponent);
    if (value % divisor != 0) return std::nullopt;
    value /= divisor;
  }
  return n.negative ? Integer(-value) : value;
}

/// -1, 0 or 1. @pre finite, without large exponents
inline int compare_exactly(const Number& a, const Number& b) {
  const Integer lowest = a.exponent < b.exponent ? a.exponent : b.exponent;
  const Integer x = a.digits * power_of_ten(a.exponent - lowest) * (a.negative ? -1 : 1);
  const Integer y = b.digits * power_of_ten(b.exponent - lowest) * (b.negative ? -1 : 1);
  return x < y ? -1 : x > y ? 1 : 0;
}

/// Whole seconds, rounded to minus infinity, and the decimals behind them without zeros at the end.
struct Seconds {
  Integer whole;
  std::string decimals;
  friend bool operator<(const Seconds& a, const Seconds& b) { return a.whole != b.whole ? a.whole < b.whole : a.decimals < b.decimals; }
  friend bool operator==(const Seconds& a, const Seconds& b) { return a.whole == b.whole && a.decimals == b.decimals; }
};
inline std::string without_zeros(std::string decimals) {
  decimals.erase(decimals.find_last_not_of('0') + 1);
  return decimals;
}
/// Of nanoseconds, if they are whole and within int64.
inline std::optional<std::int64_t> nanoseconds(const Integer& whole_seconds, const std::string& decimals, bool negative_decimals = false) {
  if (decimals.size() > 9) return std::nullopt;
  const Integer part = integer_of(decimals + std::string(9 - decimals.size(), '0'));
  const Integer all = whole_seconds * 1'000'000'000 + (negative_decimals ? Integer(-part) : part);
  if (all > std::numeric_limits<std::int64_t>::max() || all < std::numeric_limits<std::int64_t>::min()) return std::nullopt;
  return static_cast<std::int64_t>(all);
}

struct Moment {
  Seconds since;  ///< 1970-01-01T00:00:00, in UTC or as if
  Integer year;
  bool zoned = false;
};

inline bool is_leap(const Integer& year) { return year % 4 == 0 && (year % 100 != 0 || year % 400 == 0); }
/// From 0000-01-01 to the first day of a year.
inline Integer days_before(const Integer& year) {
  return year * 365 + floor_divided(year + 3, 4) - floor_divided(year + 99, 100) + floor_divided(year + 399, 400);
}

/// xsd:dateTime, dateTimeStamp, date, time, gYear and gYearMonth.
inline std::optional<Moment> moment_of(std::string_view text, Datatype type) {
  const bool has_clock = type == Datatype::date_time || type == Datatype::date_time_stamp || type == Datatype::time;
  const bool has_date = type != Datatype::time, has_month = has_date && type != Datatype::g_year;
  const bool has_day = has_month && type != Datatype::g_year_month;
  Cursor at{text};
  Moment m;
  m.year = 1972;
  int month = 1, day = 1, hour = 0, minute = 0, second = 0;
  const auto two = [&](int& out) {
    if (at.rest.size() < 2 || at.rest[0] < '0' || at.rest[0] > '9' || at.rest[1] < '0' || at.rest[1] > '9') return false;
    out = (at.rest[0] - '0') * 10 + at.rest[1] - '0';
    at.rest.remove_prefix(2);
    return true;
  };
  if (has_date) {
    const bool minus = at.take('-');
    const std::string digits = at.digits();
    if (digits.size() < 4 || (digits.size() > 4 && digits[0] == '0')) return std::nullopt;
    m.year = integer_of(digits);
    if (minus) m.year = -m.year;
  }
  if (has_month && (!at.take('-') || !two(month) || month < 1 || month > 12)) return std::nullopt;
  static constexpr int lengths[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
  const auto length = [&](int of) { return of == 2 && is_leap(m.year) ? 29 : lengths[of - 1]; };
  if (has_day && (!at.take('-') || !two(day) || day < 1 || day > length(month))) return std::nullopt;
  if (has_clock) {
    if (has_date && !at.take('T')) return std::nullopt;
    if (!two(hour) || !at.take(':') || !two(minute) || !at.take(':') || !two(second) || minute > 59 || second > 59) return std::nullopt;
    if (at.take('.')) {
      const std::string decimals = at.digits();
      if (decimals.empty()) return std::nullopt;
      m.since.decimals = without_zeros(decimals);
    }
    if (hour > 24 || (hour == 24 && (minute != 0 || second != 0 || !m.since.decimals.empty()))) return std::nullopt;
    if (hour == 24 && type == Datatype::time) hour = 0;
  }
  int zone = 0;
  if (!at.rest.empty()) {
    m.zoned = true;
    if (!at.take('Z')) {
      const bool west = at.take('-');
      if (!west && !at.take('+')) return std::nullopt;
      int hours = 0, minutes = 0;
      if (!two(hours) || !at.take(':') || !two(minutes) || hours > 14 || minutes > 59 || (hours == 14 && minutes != 0)) return std::nullopt;
      zone = (hours * 60 + minutes) * (west ? -60 : 60);
    }
  }
  if (!at.rest.empty() || (type == Datatype::date_time_stamp && !m.zoned)) return std::nullopt;
  Integer days = days_before(m.year) - days_before(1970) + day - 1;
  for (int i = 1; i < month; ++i) days += length(i);
  m.since.whole = days * 86'400 + hour * 3600 + minute * 60 + second - zone;
  return m;
}

struct Duration {
  bool negative = false;
  Integer months, seconds;  ///< without sign
  std::string decimals;
};

inline std::optional<Duration> duration_of(std::string_view text, Datatype type) {
  Cursor at{text};
  Duration d;
  d.negative = at.take('-');
  if (!at.take('P')) return std::nullopt;
  static const std::string letters = "YMDTHMS";
  std::size_t next = 0;
  bool any = false, months = false, clock = false, expects_clock = false;
  while (!at.rest.empty()) {
    if (next <= 3 && at.take('T')) {
      next = 4;
      expects_clock = true;
      continue;
    }
    const std::string digits = at.digits();
    if (digits.empty() || at.rest.empty()) return std::nullopt;
    std::string decimals;
    const bool has_point = at.take('.');
    if (has_point && (decimals = at.digits()).empty()) return std::nullopt;
    if (at.rest.empty()) return std::nullopt;
    const std::size_t found = letters.find(at.rest.front(), next);
    if (found == std::string::npos || found == 3 || (next <= 3 && found > 3) || (has_point && found != 6)) return std::nullopt;
    at.rest.remove_prefix(1);
    const Integer count = integer_of(digits);
    switch (found) {
      case 0: d.months += count * 12, months = true; break;
      case 1: d.months += count, months = true; break;
      case 2: d.seconds += count * 86'400, clock = true; break;
      case 4: d.seconds += count * 3600, clock = true; break;
      case 5: d.seconds += count * 60, clock = true; break;
      default: d.seconds += count, d.decimals = without_zeros(decimals), clock = true;
    }
    next = found + 1;
    any = true;
    if (found > 3) expects_clock = false;
  }
  if (!any || expects_clock) return std::nullopt;
  if ((type == Datatype::day_time_duration && months) || (type == Datatype::year_month_duration && clock)) return std::nullopt;
  return d;
}

/// The bounds of an integer datatype.
inline std::pair<std::optional<Integer>, std::optional<Integer>> bounds_of(Datatype type) {
  const auto bits = [](unsigned n) { return Integer(1) << n; };
  switch (type) {
    case Datatype::long_: return {Integer(-bits(63)), Integer(bits(63) - 1)};
    case Datatype::int_: return {Integer(-bits(31)), Integer(bits(31) - 1)};
    case Datatype::short_: return {Integer(-bits(15)), Integer(bits(15) - 1)};
    case Datatype::byte_: return {Integer(-bits(7)), Integer(bits(7) - 1)};
    case Datatype::unsigned_long: return {Integer(0), Integer(bits(64) - 1)};
    case Datatype::unsigned_int: return {Integer(0), Integer(bits(32) - 1)};
    case Datatype::unsigned_short: return {Integer(0), Integer(bits(16) - 1)};
    case Datatype::unsigned_byte: return {Integer(0), Integer(bits(8) - 1)};
    case Datatype::non_negative_integer: return {Integer(0), std::nullopt};
    case Datatype::positive_integer: return {Integer(1), std::nullopt};
    case Datatype::non_positive_integer: return {std::nullopt, Integer(0)};
    case Datatype::negative_integer: return {std::nullopt, Integer(-1)};
    default: return {};
  }
}

inline bool is_number_type(Datatype t) {
  return t == Datatype::double_ || t == Datatype::float_ || t == Datatype::decimal || rdf::lexical::is_integer_type(t);
}
inline bool is_duration_type(Datatype t) { return t == Datatype::duration || t == Datatype::day_time_duration || t == Datatype::year_month_duration; }

/// Whether the text is a lexical form of a numeric, time or duration type.
inline bool is_well_formed(std::string_view text, Datatype type) {
  if (is_duration_type(type)) return duration_of(text, type).has_value();
  if (!is_number_type(type)) return moment_of(text, type).has_value();
  const auto n = number_of(text);
  if (!n) return false;
  if (type == Datatype::double_ || type == Datatype::float_) return true;
  if (n->kind != Number::Kind::finite || n->has_exponent) return false;
  if (type == Datatype::decimal) return true;
  if (n->has_point) return false;
  const Integer value = n->negative ? Integer(-n->digits) : n->digits;
  const auto [lowest, highest] = bounds_of(type);
  return (!lowest || value >= *lowest) && (!highest || value <= *highest);
}

}  // namespace lrt::test::big

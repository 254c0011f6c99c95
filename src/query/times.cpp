// SPDX-License-Identifier: Apache-2.0
#include "src/query/times.hpp"

#include <algorithm>
#include <cstdint>
#include <string_view>

#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/civil.hpp"

namespace lrt::query {
namespace {

namespace lexical = rdf::lexical;
using lexical::Datatype;

constexpr std::int64_t day_seconds = 86'400;
/// Of 400 years, which have 4,800 months.
constexpr std::int64_t average_month_seconds = 146'097 * day_seconds / 4'800;
constexpr std::int64_t max_year = 999'999'999;

Decimal exact(std::int64_t number) { return *Decimal::parse(std::to_string(number)); }

/// The digits behind the point, added to or taken from whole seconds.
std::optional<Decimal> with_fraction(std::int64_t seconds, std::string_view fraction, bool negative) {
  if (fraction.empty()) return exact(seconds);
  const auto part = Decimal::parse("0." + std::string(fraction));
  if (!part) return std::nullopt;
  return negative ? subtract(exact(seconds), *part) : add(exact(seconds), *part);
}

bool is_negative(const Decimal& number) { return number.text().front() == '-'; }

/// A date, a time, or both.
struct Point {
  Datatype type;
  Decimal seconds;        ///< in UTC, or without a zone as if in UTC
  std::string_view zone;  ///< as in its text; empty: none
  std::int64_t offset;    ///< of the zone, in seconds
};

std::string_view zone_in(std::string_view text) {
  if (text.back() == 'Z') return text.substr(text.size() - 1);
  const std::size_t at = text.size() - 6;  // "+05:30"
  if (text.size() < 6 || (text[at] != '+' && text[at] != '-') || text[text.size() - 3] != ':') return {};
  return text.substr(at);
}

std::optional<Point> point_of(const rdf::TermView& term) {
  if (!term.is_literal()) return std::nullopt;
  Datatype type = lexical::datatype_of(term.datatype);
  if (type != Datatype::date_time && type != Datatype::date_time_stamp && type != Datatype::date && type != Datatype::time) return std::nullopt;
  const auto moment = lexical::parse_moment(term.text, type);
  const auto seconds = moment ? with_fraction(moment->seconds, moment->fraction, false) : std::nullopt;
  if (!seconds) return std::nullopt;
  const std::string_view zone = zone_in(term.text);
  std::int64_t offset = 0;
  if (zone.size() == 6) {
    const auto digit = [&](std::size_t at) { return zone[at] - '0'; };
    offset = 60 * (60 * (10 * digit(1) + digit(2)) + 10 * digit(4) + digit(5));
    if (zone[0] == '-') offset = -offset;
  }
  if (type == Datatype::date_time_stamp) type = Datatype::date_time;
  return Point{type, *seconds, zone, offset};
}

/// A duration of days and seconds, or one of months.
struct Length {
  bool in_months;
  Decimal count;  ///< seconds or months
};

std::optional<Length> length_in(const rdf::TermView& term) {
  if (!term.is_literal()) return std::nullopt;
  const Datatype type = lexical::datatype_of(term.datatype);
  if (type != Datatype::day_time_duration && type != Datatype::year_month_duration) return std::nullopt;
  const auto duration = lexical::parse_full_duration(term.text, type);
  if (!duration) return std::nullopt;
  if (type == Datatype::year_month_duration) return Length{true, exact(duration->months)};
  const auto seconds = with_fraction(duration->seconds, duration->fraction, duration->negative);
  return seconds ? std::optional(Length{false, *seconds}) : std::nullopt;
}

std::string two_digits(std::int64_t number) {
  std::string text = std::to_string(number);
  return text.size() < 2 ? "0" + text : text;
}

/// A number as its whole part, rounded down, and the digits behind the point. nullopt: it is not an int64.
struct Parts {
  std::int64_t whole;
  std::string fraction;
};
std::optional<Parts> parts_of(const Decimal& number) {
  const auto floor = number.rounded(Decimal::Rounding::floor);
  const auto rest = floor ? subtract(number, *floor) : std::nullopt;
  const auto whole = floor ? lexical::parse_int64(floor->text()) : std::nullopt;
  if (!rest || !whole) return std::nullopt;
  const std::string text = rest->text();  // "0" or "0.25"
  return Parts{*whole, text.size() > 2 ? text.substr(2) : std::string()};
}

/// The canonical form (XSD 1.1 part 2, E.2).
std::optional<TimeResult> written(const Length& length) {
  const bool negative = is_negative(length.count);
  const auto parts = parts_of(length.count.absolute());
  if (!parts) return std::nullopt;
  std::string text = negative ? "-P" : "P";
  const auto put = [&](std::int64_t count, char letter) {
    if (count != 0) text.append(std::to_string(count)) += letter;
  };
  if (length.in_months) {
    put(parts->whole / 12, 'Y');
    put(parts->whole % 12, 'M');
    if (parts->whole == 0) text = "P0M";
    return TimeResult{std::move(text), Iri("http://www.w3.org/2001/XMLSchema#yearMonthDuration")};
  }
  put(parts->whole / day_seconds, 'D');
  const std::int64_t rest = parts->whole % day_seconds;
  if (rest != 0 || !parts->fraction.empty()) {
    text += 'T';
    put(rest / 3600, 'H');
    put(rest / 60 % 60, 'M');
    if (rest % 60 != 0 || !parts->fraction.empty()) {
      text += std::to_string(rest % 60);
      if (!parts->fraction.empty()) text.append(".").append(parts->fraction);
      text += 'S';
    }
  }
  if (length.count.is_zero()) text = "PT0S";
  return TimeResult{std::move(text), vocab::xsd::dayTimeDuration};
}

unsigned days_in(std::int64_t year, unsigned month) {
  constexpr unsigned lengths[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
  return month == 2 && year % 4 == 0 && (year % 100 != 0 || year % 400 == 0) ? 29 : lengths[month - 1];
}

std::int64_t floor_divided(std::int64_t a, std::int64_t b) { return a >= 0 ? a / b : -((-a + b - 1) / b); }

/// @param local  seconds of the clock in the zone of the point
std::optional<TimeResult> written(const Point& point, const Decimal& local, std::int64_t months = 0) {
  const auto parts = parts_of(local);
  if (!parts) return std::nullopt;
  const std::int64_t days = floor_divided(parts->whole, day_seconds), rest = parts->whole - days * day_seconds;
  std::string clock = two_digits(rest / 3600) + ":" + two_digits(rest / 60 % 60) + ":" + two_digits(rest % 60);
  if (!parts->fraction.empty()) clock.append(".").append(parts->fraction);
  if (point.type == Datatype::time) return TimeResult{clock.append(point.zone), Iri("http://www.w3.org/2001/XMLSchema#time")};
  constexpr std::int64_t most_days = (max_year + 1) * 366;
  if (days > most_days || days < -most_days) return std::nullopt;
  lrt::detail::CivilDate date = lrt::detail::civil_from_days(days);
  if (months != 0) {
    constexpr std::int64_t most_months = 24 * (max_year + 1);
    if (months > most_months || months < -most_months) return std::nullopt;
    const std::int64_t month = date.year * 12 + date.month - 1 + months;
    date.year = floor_divided(month, 12);
    date.month = static_cast<unsigned>(month - date.year * 12) + 1;
    date.day = std::min(date.day, days_in(date.year, date.month));
  }
  if (date.year > max_year || date.year < -max_year) return std::nullopt;
  std::string text = std::to_string(date.year < 0 ? -date.year : date.year);
  if (text.size() < 4) text.insert(0, 4 - text.size(), '0');
  if (date.year < 0) text.insert(0, 1, '-');
  text.append("-").append(two_digits(date.month)).append("-").append(two_digits(date.day));
  const bool is_date = point.type == Datatype::date;
  if (!is_date) text.append("T").append(clock);
  return TimeResult{text.append(point.zone), is_date ? Iri("http://www.w3.org/2001/XMLSchema#date") : vocab::xsd::dateTime};
}

/// A point later by a duration, or earlier.
std::optional<TimeResult> moved(const Point& point, const Length& by, bool back) {
  const auto local = add(point.seconds, exact(point.offset));
  if (!local) return std::nullopt;
  if (by.in_months) {
    const auto months = lexical::parse_int64(by.count.text());
    if (point.type == Datatype::time || !months || *months == INT64_MIN) return std::nullopt;
    return written(point, *local, back ? -*months : *months);
  }
  const auto later = back ? subtract(*local, by.count) : add(*local, by.count);
  return later ? written(point, *later) : std::nullopt;
}

std::optional<TimeResult> combined(const Length& a, const Length& b, bool subtracted) {
  if (a.in_months != b.in_months) return std::nullopt;
  const auto count = subtracted ? subtract(a.count, b.count) : add(a.count, b.count);
  return count ? written(Length{a.in_months, *count}) : std::nullopt;
}

/// Months are whole: halves are rounded up.
std::optional<TimeResult> scaled(bool in_months, std::optional<Decimal> count) {
  if (count && in_months) count = count->rounded(Decimal::Rounding::half_up);
  return count ? written(Length{in_months, *count}) : std::nullopt;
}

}  // namespace

std::optional<TimeResult> add_times(const rdf::TermView& a, const rdf::TermView& b) {
  const auto first = point_of(a);
  const auto length = length_in(first ? b : a);
  if (!length) return std::nullopt;
  if (first) return moved(*first, *length, false);
  if (const auto second = point_of(b)) return moved(*second, *length, false);
  const auto other = length_in(b);
  return other ? combined(*length, *other, false) : std::nullopt;
}

std::optional<TimeResult> subtract_times(const rdf::TermView& a, const rdf::TermView& b) {
  const auto first = point_of(a), second = point_of(b);
  if (first && second) {
    if (first->type != second->type || first->zone.empty() != second->zone.empty()) return std::nullopt;
    const auto seconds = subtract(first->seconds, second->seconds);
    return seconds ? written(Length{false, *seconds}) : std::nullopt;
  }
  const auto length = length_in(b);
  if (!length) return std::nullopt;
  if (first) return moved(*first, *length, true);
  const auto other = length_in(a);
  return other ? combined(*other, *length, true) : std::nullopt;
}

std::optional<TimeResult> multiply_duration(const rdf::TermView& a, const Decimal& by) {
  const auto length = length_in(a);
  return length ? scaled(length->in_months, multiply(length->count, by)) : std::nullopt;
}

std::optional<TimeResult> divide_duration(const rdf::TermView& a, const Decimal& by) {
  const auto length = length_in(a);
  return length ? scaled(length->in_months, divide(length->count, by)) : std::nullopt;
}

std::optional<TimeResult> divide_durations(const rdf::TermView& a, const rdf::TermView& b) {
  const auto first = length_in(a), second = length_in(b);
  if (!first || !second || first->in_months != second->in_months) return std::nullopt;
  const auto ratio = divide(first->count, second->count);
  return ratio ? std::optional(TimeResult{ratio->text(), vocab::xsd::decimal}) : std::nullopt;
}

std::optional<Decimal> length_of(const rdf::TermView& term) {
  if (!term.is_literal()) return std::nullopt;
  const Datatype type = lexical::datatype_of(term.datatype);
  if (type != Datatype::duration && type != Datatype::day_time_duration && type != Datatype::year_month_duration) return std::nullopt;
  const auto duration = lexical::parse_full_duration(term.text, type);
  if (!duration) return std::nullopt;
  const auto of_months = multiply(exact(duration->months), exact(average_month_seconds));
  const auto seconds = with_fraction(duration->seconds, duration->fraction, duration->negative);
  return of_months && seconds ? add(*of_months, *seconds) : std::nullopt;
}

}  // namespace lrt::query

// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/lexical.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <limits>
#include <type_traits>

#include "src/base/civil.hpp"
#include "src/base/utf8.hpp"
#include "src/rdf/integer_range.hpp"
#include "src/rdf/representable.hpp"

namespace lrt::rdf::lexical {
inline namespace v0 {
namespace {

constexpr bool digit(char c) noexcept { return c >= '0' && c <= '9'; }

std::size_t digits(std::string_view text, std::size_t at) noexcept {
  while (at < text.size() && digit(text[at])) ++at;
  return at;
}

/// The end of `[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)` at the start of `text`, or 0.
std::size_t decimal_end(std::string_view text) noexcept {
  std::size_t at = 0;
  if (at < text.size() && (text[at] == '+' || text[at] == '-')) ++at;
  const std::size_t whole = digits(text, at);
  if (whole == text.size() || text[whole] != '.') return whole > at ? whole : 0;
  const std::size_t fraction = digits(text, whole + 1);
  return whole > at || fraction > whole + 1 ? fraction : 0;
}

std::string_view without_plus(std::string_view text) noexcept { return !text.empty() && text.front() == '+' ? text.substr(1) : text; }

template <class T>
std::optional<T> parse_whole(std::string_view text) noexcept {
  if (!is_integer(text)) return std::nullopt;
  text = without_plus(text);
  if constexpr (std::is_unsigned_v<T>) {
    if (text.front() == '-') {  // "-0" is an integer too
      for (char c : text.substr(1))
        if (c != '0') return std::nullopt;
      return T{0};
    }
  }
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Adds `count` units of `unit_ns`; false on overflow.
bool accumulate(std::int64_t& total, std::int64_t count, std::int64_t unit_ns) noexcept {
  std::int64_t product = 0;
  return !__builtin_mul_overflow(count, unit_ns, &product) && !__builtin_add_overflow(total, product, &total);
}

constexpr std::int64_t second_ns = 1'000'000'000, minute_ns = 60 * second_ns, hour_ns = 60 * minute_ns, day_ns = 24 * hour_ns;

/// Nanoseconds of the digits after a decimal point.
std::int64_t fraction_ns(std::string_view fraction) noexcept {
  std::int64_t ns = 0;
  for (std::size_t i = 0; i < 9; ++i) ns = ns * 10 + (i < fraction.size() ? fraction[i] - '0' : 0);
  return ns;
}

std::string fraction_text(std::int64_t ns) {
  if (ns == 0) return {};
  char digits_text[16];
  std::snprintf(digits_text, sizeof digits_text, ".%09lld", static_cast<long long>(ns));
  std::string text = digits_text;
  text.erase(text.find_last_not_of('0') + 1);
  return text;
}

bool two_digits(std::string_view text, std::size_t at, unsigned& out) noexcept {
  if (at + 2 > text.size() || !digit(text[at]) || !digit(text[at + 1])) return false;
  out = static_cast<unsigned>((text[at] - '0') * 10 + (text[at + 1] - '0'));
  return true;
}

unsigned days_in_month(std::int64_t year, unsigned month) noexcept {
  constexpr unsigned lengths[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
  const bool leap = (year % 4 == 0 && year % 100 != 0) || year % 400 == 0;
  return month == 2 && leap ? 29 : lengths[month - 1];
}

/// What a number beyond the range of a binary type is rounded to: infinity if it is too large, 0 if it is too small. The place of its first digit
/// that is not 0 decides, as no mantissa and exponent near the bounds of either type come here with the other sign.
/// @pre is_double() of the text, which has a mantissa
double beyond_range(std::string_view text) noexcept {
  const bool negative = text.front() == '-';
  if (negative || text.front() == '+') text.remove_prefix(1);
  const std::size_t e = text.find_first_of("eE");
  const std::string_view mantissa = text.substr(0, e);
  const std::size_t first = mantissa.find_first_of("123456789");
  bool is_large = false;
  if (first != std::string_view::npos) {
    const std::size_t whole = std::min(mantissa.find('.'), mantissa.size());
    const auto magnitude = first < whole ? static_cast<std::int64_t>(whole - first) : -static_cast<std::int64_t>(first - whole);
    // A text has less than 2^60 characters, so that the sum cannot overflow.
    constexpr std::int64_t far = std::int64_t{1} << 61;
    std::int64_t exponent = 0;
    if (e != std::string_view::npos) {
      const std::string_view digits_text = text.substr(e + 1);
      exponent = std::clamp(parse_whole<std::int64_t>(digits_text).value_or(digits_text.front() == '-' ? -far : far), -far, far);
    }
    is_large = magnitude + exponent > 0;
  }
  const double limit = is_large ? std::numeric_limits<double>::infinity() : 0.0;
  return negative ? -limit : limit;
}

/// Rounded once, to nearest.
template <class T>
std::optional<T> parse_real(std::string_view text) noexcept {
  if (!is_double(text)) return std::nullopt;
  if (text == "NaN") return std::numeric_limits<T>::quiet_NaN();
  if (text == "INF" || text == "+INF") return std::numeric_limits<T>::infinity();
  if (text == "-INF") return -std::numeric_limits<T>::infinity();
  text = without_plus(text);
  T value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc::result_out_of_range) return static_cast<T>(beyond_range(text));
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

template <class T>
std::string format_real(T value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "INF" : "-INF";
  char text[64];
  const auto [end, error] = std::to_chars(text, text + sizeof text, value);
  return error == std::errc() ? std::string(text, end) : std::string();
}

}  // namespace

bool is_integer(std::string_view text) noexcept {
  const std::size_t start = !text.empty() && (text[0] == '+' || text[0] == '-') ? 1 : 0;
  return start < text.size() && digits(text, start) == text.size();
}

bool is_decimal(std::string_view text) noexcept { return !text.empty() && decimal_end(text) == text.size(); }

bool is_double(std::string_view text) noexcept {
  if (text == "NaN" || text == "INF" || text == "-INF" || text == "+INF") return true;
  const std::size_t mantissa = decimal_end(text);
  if (mantissa == 0) return false;
  if (mantissa == text.size()) return true;
  return (text[mantissa] == 'e' || text[mantissa] == 'E') && is_integer(text.substr(mantissa + 1));
}

std::optional<double> parse_double(std::string_view text) noexcept { return parse_real<double>(text); }
std::optional<float> parse_float(std::string_view text) noexcept { return parse_real<float>(text); }

bool is_rounded_away(std::string_view text, double value) noexcept {
  const std::string_view mantissa = text.substr(0, text.find_first_of("eE"));
  if (std::isinf(value)) return mantissa.find_first_of("0123456789") != std::string_view::npos;
  return value == 0 && mantissa.find_first_of("123456789") != std::string_view::npos;
}

std::optional<double> representable_double(std::string_view text) noexcept {
  const auto value = parse_double(text);
  return value && !is_rounded_away(text, *value) ? value : std::nullopt;
}

std::optional<float> representable_float(std::string_view text) noexcept {
  const auto value = parse_float(text);
  return value && !is_rounded_away(text, static_cast<double>(*value)) ? value : std::nullopt;
}

std::optional<std::int64_t> parse_int64(std::string_view text) noexcept { return parse_whole<std::int64_t>(text); }
std::optional<std::uint64_t> parse_uint64(std::string_view text) noexcept { return parse_whole<std::uint64_t>(text); }

std::optional<bool> parse_boolean(std::string_view text) noexcept {
  if (text == "true" || text == "1") return true;
  if (text == "false" || text == "0") return false;
  return std::nullopt;
}

std::optional<std::chrono::nanoseconds> parse_duration(std::string_view text) noexcept {
  bool negative = false;
  if (!text.empty() && text.front() == '-') negative = true, text.remove_prefix(1);
  if (text.size() < 3 || text.front() != 'P') return std::nullopt;
  text.remove_prefix(1);
  std::int64_t total = 0;
  bool in_time = false;
  int last = -1;  // D 0, H 1, M 2, S 3: each at most once and in this order
  while (!text.empty()) {
    if (text.front() == 'T' && !in_time) {
      in_time = true;
      text.remove_prefix(1);
      if (text.empty()) return std::nullopt;
      continue;
    }
    const std::size_t end = digits(text, 0);
    if (end == 0 || end == text.size()) return std::nullopt;
    const auto count = parse_int64(text.substr(0, end));
    if (!count) return std::nullopt;
    std::size_t unit_at = end;
    std::string_view fraction;
    if (text[end] == '.') {
      unit_at = digits(text, end + 1);
      fraction = text.substr(end + 1, unit_at - end - 1);
      if (fraction.empty() || unit_at == text.size() || text[unit_at] != 'S') return std::nullopt;
    }
    int rank = 0;
    std::int64_t unit_ns = 0;
    switch (text[unit_at]) {
      case 'D': rank = 0, unit_ns = day_ns; break;
      case 'H': rank = 1, unit_ns = hour_ns; break;
      case 'M': rank = 2, unit_ns = minute_ns; break;
      case 'S': rank = 3, unit_ns = second_ns; break;
      default: return std::nullopt;
    }
    if (rank <= last || (rank == 0) == in_time) return std::nullopt;
    last = rank;
    const std::int64_t sign = negative ? -1 : 1;  // per part: the lowest value has no positive counterpart
    if (!accumulate(total, sign * *count, unit_ns) || !accumulate(total, sign * fraction_ns(fraction), 1)) return std::nullopt;
    text.remove_prefix(unit_at + 1);
  }
  if (last < 0) return std::nullopt;
  return std::chrono::nanoseconds(total);
}

std::optional<std::chrono::nanoseconds> parse_instant(std::string_view text) noexcept {
  bool negative_year = false;
  if (!text.empty() && text.front() == '-') negative_year = true, text.remove_prefix(1);
  const std::size_t year_end = digits(text, 0);
  if (year_end < 4 || year_end > 9 || (year_end > 4 && text.front() == '0')) return std::nullopt;
  std::int64_t year = *parse_int64(text.substr(0, year_end));
  if (negative_year) year = -year;
  text.remove_prefix(year_end);
  unsigned month = 0, day = 0, hour = 0, minute = 0, second = 0;
  if (text.size() < 15 || text[0] != '-' || !two_digits(text, 1, month) || text[3] != '-' || !two_digits(text, 4, day) || text[6] != 'T' ||
      !two_digits(text, 7, hour) || text[9] != ':' || !two_digits(text, 10, minute) || text[12] != ':' || !two_digits(text, 13, second))
    return std::nullopt;
  text.remove_prefix(15);
  std::int64_t ns = 0;
  if (!text.empty() && text.front() == '.') {
    const std::size_t end = digits(text, 1);
    if (end == 1) return std::nullopt;
    ns = fraction_ns(text.substr(1, end - 1));
    text.remove_prefix(end);
  }
  if (month < 1 || month > 12 || day < 1 || day > days_in_month(year, month) || minute > 59 || second > 59 || hour > 24 ||
      (hour == 24 && (minute || second || ns)))
    return std::nullopt;
  std::int64_t zone_minutes = 0;
  if (text != "Z") {
    unsigned zone_hour = 0, zone_minute = 0;
    if (text.size() != 6 || (text[0] != '+' && text[0] != '-') || !two_digits(text, 1, zone_hour) || text[3] != ':' ||
        !two_digits(text, 4, zone_minute) || zone_hour > 14 || zone_minute > 59 || (zone_hour == 14 && zone_minute))
      return std::nullopt;
    zone_minutes = static_cast<std::int64_t>(zone_hour * 60 + zone_minute) * (text[0] == '-' ? -1 : 1);
  }
  std::int64_t seconds = lrt::detail::days_from_civil(year, month, day) * (day_ns / second_ns) + std::int64_t{hour} * 3600 +
                         std::int64_t{minute} * 60 + std::int64_t{second} - zone_minutes * 60;
  if (seconds < 0 && ns > 0) ++seconds, ns -= second_ns;  // of one sign, so that no part is out of range unless the sum is
  std::int64_t total = 0;
  if (!accumulate(total, seconds, second_ns) || !accumulate(total, ns, 1)) return std::nullopt;
  return std::chrono::nanoseconds(total);
}

std::string format(double value) { return format_real(value); }
std::string format(float value) { return format_real(value); }

std::string format(std::chrono::nanoseconds duration) {
  const std::int64_t count = duration.count();
  const bool negative = count < 0;
  // Unsigned, so that the magnitude of the lowest value is representable.
  std::uint64_t rest = negative ? 0 - static_cast<std::uint64_t>(count) : static_cast<std::uint64_t>(count);
  const auto take = [&](std::int64_t unit_ns) {
    const std::uint64_t n = rest / static_cast<std::uint64_t>(unit_ns);
    rest %= static_cast<std::uint64_t>(unit_ns);
    return n;
  };
  const std::uint64_t d = take(day_ns), h = take(hour_ns), m = take(minute_ns), s = take(second_ns);
  std::string text = negative ? "-P" : "P";
  if (d) text += std::to_string(d) + "D";
  if (h || m || s || rest || !d) text += "T";
  if (h) text += std::to_string(h) + "H";
  if (m) text += std::to_string(m) + "M";
  if (s || rest || !(d || h || m)) text += std::to_string(s) + fraction_text(static_cast<std::int64_t>(rest)) + "S";
  return text;
}

std::string format_instant(std::chrono::nanoseconds since_epoch) {
  const std::int64_t ns = since_epoch.count();
  const lrt::detail::Civil c = lrt::detail::to_civil(std::chrono::system_clock::time_point(since_epoch));
  char text[64];
  std::snprintf(text, sizeof text, "%04lld-%02u-%02uT%02u:%02u:%02u", static_cast<long long>(c.year), c.month, c.day, c.hour, c.minute, c.second);
  return text + fraction_text(ns % second_ns + (ns % second_ns < 0 ? second_ns : 0)) + "Z";
}

namespace {

constexpr std::string_view xsd_namespace = "http://www.w3.org/2001/XMLSchema#";
constexpr std::string_view rdf_namespace = "http://www.w3.org/1999/02/22-rdf-syntax-ns#";

struct Named {
  std::string_view name;
  Datatype datatype;
};
constexpr Named xsd_datatypes[] = {
    {"string", Datatype::string},
    {"float", Datatype::float_},
    {"double", Datatype::double_},
    {"integer", Datatype::integer},
    {"decimal", Datatype::decimal},
    {"boolean", Datatype::boolean},
    {"dateTime", Datatype::date_time},
    {"int", Datatype::int_},
    {"long", Datatype::long_},
    {"short", Datatype::short_},
    {"byte", Datatype::byte_},
    {"unsignedInt", Datatype::unsigned_int},
    {"unsignedLong", Datatype::unsigned_long},
    {"unsignedShort", Datatype::unsigned_short},
    {"unsignedByte", Datatype::unsigned_byte},
    {"nonNegativeInteger", Datatype::non_negative_integer},
    {"positiveInteger", Datatype::positive_integer},
    {"nonPositiveInteger", Datatype::non_positive_integer},
    {"negativeInteger", Datatype::negative_integer},
    {"dateTimeStamp", Datatype::date_time_stamp},
    {"date", Datatype::date},
    {"time", Datatype::time},
    {"gYear", Datatype::g_year},
    {"gYearMonth", Datatype::g_year_month},
    {"gMonth", Datatype::g_month},
    {"gMonthDay", Datatype::g_month_day},
    {"gDay", Datatype::g_day},
    {"duration", Datatype::duration},
    {"dayTimeDuration", Datatype::day_time_duration},
    {"yearMonthDuration", Datatype::year_month_duration},
    {"anyURI", Datatype::any_uri},
    {"hexBinary", Datatype::hex_binary},
    {"base64Binary", Datatype::base64_binary},
    {"language", Datatype::language},
    {"normalizedString", Datatype::normalized_string},
    {"token", Datatype::token},
    {"NMTOKEN", Datatype::nmtoken},
    {"Name", Datatype::name},
    {"NCName", Datatype::ncname},
};
constexpr Named rdf_datatypes[] = {{"langString", Datatype::lang_string}, {"HTML", Datatype::html}, {"XMLLiteral", Datatype::xml_literal}};

template <std::size_t N>
Datatype look_up(const Named (&table)[N], std::string_view name) noexcept {
  for (const Named& n : table) {
    if (n.name == name) return n.datatype;
  }
  return Datatype::unknown;
}

/// A decimal without sign, leading and trailing zeros; zero has neither digits nor sign.
struct Decimal {
  bool negative = false;
  std::string_view whole, fraction;
};

Decimal split_decimal(std::string_view text) noexcept {
  Decimal d;
  if (text.front() == '+' || text.front() == '-') {
    d.negative = text.front() == '-';
    text.remove_prefix(1);
  }
  const std::size_t point = text.find('.');
  d.whole = text.substr(0, point);
  if (point != std::string_view::npos) d.fraction = text.substr(point + 1);
  d.whole.remove_prefix(std::min(d.whole.find_first_not_of('0'), d.whole.size()));
  d.fraction = d.fraction.substr(0, d.fraction.find_last_not_of('0') + 1);
  if (d.whole.empty() && d.fraction.empty()) d.negative = false;
  return d;
}

/// The parts of a date or time. A datatype may have only some of them.
struct Civil {
  bool negative_year = false;
  std::string_view year;  ///< digits
  unsigned month = 1, day = 1, hour = 0, minute = 0, second = 0;
  std::string_view fraction;
  bool zoned = false;
  std::int64_t zone_minutes = 0;
};

/// Parses `text` from the left. Each step returns false if the text does not match.
struct Cutter {
  std::string_view text;
  bool character(char c) noexcept {
    if (text.empty() || text.front() != c) return false;
    text.remove_prefix(1);
    return true;
  }
  bool two(unsigned& out, unsigned lowest, unsigned highest) noexcept {
    if (!two_digits(text, 0, out) || out < lowest || out > highest) return false;
    text.remove_prefix(2);
    return true;
  }
  bool year(Civil& c) noexcept {
    c.negative_year = character('-');
    const std::size_t end = digits(text, 0);
    if (end < 4 || (end > 4 && text.front() == '0')) return false;
    c.year = text.substr(0, end);
    text.remove_prefix(end);
    return true;
  }
  bool clock(Civil& c) noexcept {
    if (!two(c.hour, 0, 24) || !character(':') || !two(c.minute, 0, 59) || !character(':') || !two(c.second, 0, 59)) return false;
    if (character('.')) {
      const std::size_t end = digits(text, 0);
      if (end == 0) return false;
      c.fraction = text.substr(0, end);
      c.fraction = c.fraction.substr(0, c.fraction.find_last_not_of('0') + 1);
      text.remove_prefix(end);
    }
    return c.hour < 24 || (c.minute == 0 && c.second == 0 && c.fraction.empty());
  }
  /// The optional zone and the end.
  bool zone(Civil& c) noexcept {
    if (text.empty()) return true;
    c.zoned = true;
    if (text == "Z") return true;
    const bool west = text.front() == '-';
    unsigned hour = 0, minute = 0;
    if (!character(west ? '-' : '+') || !two(hour, 0, 14) || !character(':') || !two(minute, 0, 59) || !text.empty()) return false;
    if (hour == 14 && minute != 0) return false;
    c.zone_minutes = static_cast<std::int64_t>(hour * 60 + minute) * (west ? -1 : 1);
    return true;
  }
};

/// The year modulo 400, which determines the length of February. A year may have any number of digits.
unsigned year_mod_400(std::string_view year) noexcept {
  unsigned rest = 0;
  for (const char c : year) rest = (rest * 10 + static_cast<unsigned>(c - '0')) % 400;
  return rest;
}

std::optional<Civil> parse_civil(std::string_view text, Datatype datatype) noexcept {
  Civil c;
  Cutter cut{text};
  const auto day_of_month = [&](unsigned leap_remainder) {
    return cut.two(c.day, 1, days_in_month(static_cast<std::int64_t>(leap_remainder), c.month));
  };
  bool good = false;
  switch (datatype) {
    case Datatype::date_time:
    case Datatype::date_time_stamp:
      good = cut.year(c) && cut.character('-') && cut.two(c.month, 1, 12) && cut.character('-') && day_of_month(year_mod_400(c.year)) &&
             cut.character('T') && cut.clock(c) && cut.zone(c) && (c.zoned || datatype == Datatype::date_time);
      break;
    case Datatype::date:
      good = cut.year(c) && cut.character('-') && cut.two(c.month, 1, 12) && cut.character('-') && day_of_month(year_mod_400(c.year)) && cut.zone(c);
      break;
    case Datatype::time: good = cut.clock(c) && cut.zone(c); break;
    case Datatype::g_year: good = cut.year(c) && cut.zone(c); break;
    case Datatype::g_year_month: good = cut.year(c) && cut.character('-') && cut.two(c.month, 1, 12) && cut.zone(c); break;
    case Datatype::g_month: good = cut.character('-') && cut.character('-') && cut.two(c.month, 1, 12) && cut.zone(c); break;
    case Datatype::g_month_day:
      good = cut.character('-') && cut.character('-') && cut.two(c.month, 1, 12) && cut.character('-') && day_of_month(0) && cut.zone(c);
      break;
    case Datatype::g_day: good = cut.character('-') && cut.character('-') && cut.character('-') && cut.two(c.day, 1, 31) && cut.zone(c); break;
    default: break;
  }
  return good ? std::optional<Civil>(c) : std::nullopt;
}

/// The parts of `-?P(nY)?(nM)?(nD)?(T(nH)?(nM)?(n(.n)?S)?)?`; at least one is present.
struct DurationParts {
  bool negative = false;
  std::string_view count[6];  ///< Y M D H M S
  std::string_view fraction;
};

std::optional<DurationParts> split_duration(std::string_view text, Datatype datatype) noexcept {
  DurationParts parts;
  Cutter cut{text};
  parts.negative = cut.character('-');
  if (!cut.character('P') || cut.text.empty()) return std::nullopt;
  constexpr std::string_view letters = "YMDHMS";
  std::size_t next = 0;
  bool in_time = false;
  while (!cut.text.empty()) {
    if (!in_time && cut.character('T')) {
      in_time = true;
      next = 3;
      if (cut.text.empty()) return std::nullopt;
    }
    const std::size_t end = digits(cut.text, 0);
    if (end == 0 || end == cut.text.size()) return std::nullopt;
    std::size_t letter = end;
    if (cut.text[end] == '.') {
      letter = digits(cut.text, end + 1);
      if (letter == end + 1 || letter == cut.text.size() || cut.text[letter] != 'S' || !in_time) return std::nullopt;
      parts.fraction = cut.text.substr(end + 1, letter - end - 1);
      parts.fraction = parts.fraction.substr(0, parts.fraction.find_last_not_of('0') + 1);
    }
    const std::size_t at = letters.substr(0, in_time ? 6 : 3).find(cut.text[letter], next);
    if (at == std::string_view::npos) return std::nullopt;
    parts.count[at] = cut.text.substr(0, end);
    next = at + 1;
    cut.text.remove_prefix(letter + 1);
  }
  const bool months = !parts.count[0].empty() || !parts.count[1].empty();
  bool clock = false;
  for (std::size_t i = 2; i < 6; ++i) clock = clock || !parts.count[i].empty();
  if (datatype == Datatype::day_time_duration && months) return std::nullopt;
  if (datatype == Datatype::year_month_duration && clock) return std::nullopt;
  return parts;
}

bool is_base64(std::string_view text) noexcept {
  std::size_t count = 0, padding = 0;
  char last = 0;
  bool blank = true;  // single spaces between characters are allowed, spaces at the ends are not
  for (const char c : text) {
    if (c == ' ') {
      if (blank) return false;
      blank = true;
      continue;
    }
    blank = false;
    ++count;
    if (c == '=') {
      if (++padding > 2) return false;
      continue;
    }
    const bool letter = (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || digit(c) || c == '+' || c == '/';
    if (!letter || padding != 0) return false;
    last = c;
  }
  if (count == 0) return text.empty();
  if (blank || count % 4 != 0) return false;
  constexpr std::string_view low_two_bits_0 = "AEIMQUYcgkosw048", low_four_bits_0 = "AQgw";
  if (padding == 1) return low_two_bits_0.find(last) != std::string_view::npos;
  return padding == 0 || low_four_bits_0.find(last) != std::string_view::npos;
}

bool is_hex(std::string_view text) noexcept {
  for (const char c : text) {
    if (!digit(c) && !(c >= 'a' && c <= 'f') && !(c >= 'A' && c <= 'F')) return false;
  }
  return text.size() % 2 == 0;
}

/// XSD 1.1 3.4.3: [a-zA-Z]{1,8}(-[a-zA-Z0-9]{1,8})*
bool is_language(std::string_view text) noexcept {
  std::size_t length = 0;
  bool first = true;
  for (const char c : text) {
    if (c == '-') {
      if (length == 0) return false;
      length = 0;
      first = false;
    } else if ((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (!first && digit(c))) {
      if (++length > 8) return false;
    } else {
      return false;
    }
  }
  return length != 0;
}

/// XML 1.0 (fifth edition) productions 4 and 4a.
bool is_name_start(char32_t c) noexcept {
  return c == ':' || c == '_' || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= 0xC0 && c <= 0x2FF && c != 0xD7 && c != 0xF7) ||
         (c >= 0x370 && c <= 0x1FFF && c != 0x37E) || c == 0x200C || c == 0x200D || (c >= 0x2070 && c <= 0x218F) || (c >= 0x2C00 && c <= 0x2FEF) ||
         (c >= 0x3001 && c <= 0xD7FF) || (c >= 0xF900 && c <= 0xFDCF) || (c >= 0xFDF0 && c <= 0xFFFD) || (c >= 0x10000 && c <= 0xEFFFF);
}
bool is_name_character(char32_t c) noexcept {
  return is_name_start(c) || c == '-' || c == '.' || (c >= '0' && c <= '9') || c == 0xB7 || (c >= 0x300 && c <= 0x36F) ||
         (c >= 0x203F && c <= 0x2040);
}

bool is_xml_name(std::string_view text, bool any_start, bool colon) noexcept {
  if (text.empty() || utf8::find_invalid(text)) return false;
  for (std::size_t at = 0; at < text.size();) {
    const bool start = at == 0 && !any_start;
    const char32_t c = utf8::decode(text, at);
    if ((c == ':' && !colon) || !(start ? is_name_start(c) : is_name_character(c))) return false;
  }
  return true;
}

}  // namespace

Datatype datatype_of(std::string_view iri) noexcept {
  if (iri.size() > xsd_namespace.size() && iri.substr(0, xsd_namespace.size()) == xsd_namespace)
    return look_up(xsd_datatypes, iri.substr(xsd_namespace.size()));
  if (iri.size() > rdf_namespace.size() && iri.substr(0, rdf_namespace.size()) == rdf_namespace)
    return look_up(rdf_datatypes, iri.substr(rdf_namespace.size()));
  return Datatype::unknown;
}

IntegerRange range_of(Datatype datatype) noexcept {
  switch (datatype) {
    case Datatype::long_: return {"-9223372036854775808", "9223372036854775807"};
    case Datatype::int_: return {"-2147483648", "2147483647"};
    case Datatype::short_: return {"-32768", "32767"};
    case Datatype::byte_: return {"-128", "127"};
    case Datatype::unsigned_long: return {"0", "18446744073709551615"};
    case Datatype::unsigned_int: return {"0", "4294967295"};
    case Datatype::unsigned_short: return {"0", "65535"};
    case Datatype::unsigned_byte: return {"0", "255"};
    case Datatype::non_negative_integer: return {"0", {}};
    case Datatype::positive_integer: return {"1", {}};
    case Datatype::non_positive_integer: return {{}, "0"};
    case Datatype::negative_integer: return {{}, "-1"};
    default: return {};
  }
}

bool is_well_formed(std::string_view text, Datatype datatype) noexcept {
  constexpr std::string_view not_normalized("\t\n\r\0", 4);
  switch (datatype) {
    case Datatype::boolean: return parse_boolean(text).has_value();
    case Datatype::decimal: return is_decimal(text);
    case Datatype::double_:
    case Datatype::float_: return is_double(text);
    case Datatype::integer:
    case Datatype::long_:
    case Datatype::int_:
    case Datatype::short_:
    case Datatype::byte_:
    case Datatype::unsigned_long:
    case Datatype::unsigned_int:
    case Datatype::unsigned_short:
    case Datatype::unsigned_byte:
    case Datatype::non_negative_integer:
    case Datatype::positive_integer:
    case Datatype::non_positive_integer:
    case Datatype::negative_integer: {
      const IntegerRange range = range_of(datatype);
      return is_integer(text) && (range.lowest.empty() || compare_decimal(text, range.lowest) >= 0) &&
             (range.highest.empty() || compare_decimal(text, range.highest) <= 0);
    }
    case Datatype::date_time:
    case Datatype::date_time_stamp:
    case Datatype::date:
    case Datatype::time:
    case Datatype::g_year:
    case Datatype::g_year_month:
    case Datatype::g_month:
    case Datatype::g_month_day:
    case Datatype::g_day: return parse_civil(text, datatype).has_value();
    case Datatype::duration:
    case Datatype::day_time_duration:
    case Datatype::year_month_duration: return split_duration(text, datatype).has_value();
    case Datatype::hex_binary: return is_hex(text);
    case Datatype::base64_binary: return is_base64(text);
    case Datatype::language: return is_language(text);
    case Datatype::normalized_string: return text.find_first_of(not_normalized) == std::string_view::npos;
    case Datatype::token:
      return text.find_first_of(not_normalized) == std::string_view::npos && text.find("  ") == std::string_view::npos &&
             (text.empty() || (text.front() != ' ' && text.back() != ' '));
    case Datatype::nmtoken: return is_xml_name(text, true, true);
    case Datatype::name: return is_xml_name(text, false, true);
    case Datatype::ncname: return is_xml_name(text, false, false);
    case Datatype::string: return text.find('\0') == std::string_view::npos;  // XSD 1.1 3.3.1.1: Char of XML
    case Datatype::unknown:
    case Datatype::any_uri:
    case Datatype::lang_string:
    case Datatype::html:
    case Datatype::xml_literal: return true;
  }
  return true;
}

int compare_decimal(std::string_view a, std::string_view b) noexcept {
  const Decimal x = split_decimal(a), y = split_decimal(b);
  if (x.negative != y.negative) return x.negative ? -1 : 1;
  int magnitude = 0;
  if (x.whole.size() != y.whole.size()) magnitude = x.whole.size() < y.whole.size() ? -1 : 1;
  if (magnitude == 0) magnitude = x.whole.compare(y.whole);
  if (magnitude == 0) magnitude = x.fraction.compare(y.fraction);  // no trailing zeros, so a prefix is less
  return x.negative ? -magnitude : magnitude;
}

std::optional<Moment> parse_moment(std::string_view text, Datatype datatype) noexcept {
  if (datatype == Datatype::g_month || datatype == Datatype::g_month_day || datatype == Datatype::g_day) return std::nullopt;
  const auto c = parse_civil(text, datatype);
  if (!c || c->year.size() > 9) return std::nullopt;
  const std::int64_t year = c->year.empty() ? 1972 : *parse_int64(c->year) * (c->negative_year ? -1 : 1);
  const unsigned hour = datatype == Datatype::time ? c->hour % 24 : c->hour;  // 24:00:00 is 00:00:00 of the next day, and a time has no day
  Moment m;
  m.seconds = lrt::detail::days_from_civil(year, c->month, c->day) * 86'400 + static_cast<std::int64_t>(hour) * 3600 +
              static_cast<std::int64_t>(c->minute) * 60 + static_cast<std::int64_t>(c->second) - c->zone_minutes * 60;
  m.fraction = c->fraction;
  m.zoned = c->zoned;
  return m;
}

std::optional<Duration> parse_full_duration(std::string_view text, Datatype datatype) noexcept {
  const auto parts = split_duration(text, datatype);
  if (!parts) return std::nullopt;
  constexpr std::int64_t units[] = {12, 1, 86'400, 3600, 60, 1};
  Duration d;
  for (std::size_t i = 0; i < 6; ++i) {
    if (parts->count[i].empty()) continue;
    const auto count = parse_int64(parts->count[i]);
    const std::int64_t sign = parts->negative ? -1 : 1;  // per part: the lowest value has no positive counterpart
    if (!count || !accumulate(i < 2 ? d.months : d.seconds, sign * *count, units[i])) return std::nullopt;
  }
  d.fraction = parts->fraction;
  d.negative = parts->negative;
  return d;
}

}  // namespace v0
}  // namespace lrt::rdf::lexical

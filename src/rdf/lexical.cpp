#include <lrt/rdf/lexical.hpp>

#include <charconv>
#include <cmath>
#include <cstdio>
#include <limits>

namespace lrt::rdf::lexical {
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

std::string_view without_plus(std::string_view text) noexcept {
  return !text.empty() && text.front() == '+' ? text.substr(1) : text;
}

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

/// Days from 1970-01-01 of a proleptic Gregorian date, and back (Hinnant's era arithmetic: 400 years have 146,097 days).
std::int64_t days_from_civil(std::int64_t year, unsigned month, unsigned day) noexcept {
  year -= month <= 2;
  const std::int64_t era = (year >= 0 ? year : year - 399) / 400;
  const auto year_of_era = static_cast<unsigned>(year - era * 400);
  const unsigned day_of_year = (153 * (month > 2 ? month - 3 : month + 9) + 2) / 5 + day - 1;
  const unsigned day_of_era = year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year;
  return era * 146'097 + static_cast<std::int64_t>(day_of_era) - 719'468;
}

void civil_from_days(std::int64_t days, std::int64_t& year, unsigned& month, unsigned& day) noexcept {
  days += 719'468;
  const std::int64_t era = (days >= 0 ? days : days - 146'096) / 146'097;
  const auto day_of_era = static_cast<unsigned>(days - era * 146'097);
  const unsigned year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36'524 - day_of_era / 146'096) / 365;
  const unsigned day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
  const unsigned shifted = (5 * day_of_year + 2) / 153;
  day = day_of_year - (153 * shifted + 2) / 5 + 1;
  month = shifted < 10 ? shifted + 3 : shifted - 9;
  year = static_cast<std::int64_t>(year_of_era) + era * 400 + (month <= 2);
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

std::optional<double> parse_double(std::string_view text) noexcept {
  if (!is_double(text)) return std::nullopt;
  if (text == "NaN") return std::numeric_limits<double>::quiet_NaN();
  if (text == "INF" || text == "+INF") return std::numeric_limits<double>::infinity();
  if (text == "-INF") return -std::numeric_limits<double>::infinity();
  text = without_plus(text);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc::result_out_of_range) {
    // Too large or too small to tell from the result: the mantissa's first digit that is not 0 against the exponent decides.
    const std::size_t e = text.find_first_of("eE");
    const bool negative = text.front() == '-';
    const std::string_view mantissa = text.substr(negative ? 1 : 0, (e == std::string_view::npos ? text.size() : e) - (negative ? 1 : 0));
    const std::size_t point = mantissa.find('.');
    const std::size_t first = mantissa.find_first_not_of("0.");
    if (first == std::string_view::npos) return negative ? -0.0 : 0.0;
    const std::size_t whole = point == std::string_view::npos ? mantissa.size() : point;
    const auto magnitude = first < whole ? static_cast<std::int64_t>(whole - first) : -static_cast<std::int64_t>(first - whole);
    std::int64_t exponent = 0;
    if (e != std::string_view::npos) {
      const std::string_view digits_text = text.substr(e + 1);
      exponent = parse_int64(digits_text).value_or(digits_text.front() == '-' ? INT64_MIN / 4 : INT64_MAX / 4);
    }
    const double limit = magnitude + exponent / 2 + (exponent - exponent / 2) > 0 ? std::numeric_limits<double>::infinity() : 0.0;
    return negative ? -limit : limit;
  }
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
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
    if (!accumulate(total, *count, unit_ns) || !accumulate(total, fraction_ns(fraction), 1)) return std::nullopt;
    text.remove_prefix(unit_at + 1);
  }
  if (last < 0) return std::nullopt;
  return std::chrono::nanoseconds(negative ? -total : total);
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
  if (text.size() < 15 || text[0] != '-' || !two_digits(text, 1, month) || text[3] != '-' || !two_digits(text, 4, day) ||
      text[6] != 'T' || !two_digits(text, 7, hour) || text[9] != ':' || !two_digits(text, 10, minute) || text[12] != ':' ||
      !two_digits(text, 13, second))
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
  std::int64_t total = 0;
  if (!accumulate(total, days_from_civil(year, month, day), day_ns) || !accumulate(total, hour, hour_ns) ||
      !accumulate(total, minute, minute_ns) || !accumulate(total, second, second_ns) || !accumulate(total, ns, 1) ||
      !accumulate(total, -zone_minutes, minute_ns))
    return std::nullopt;
  return std::chrono::nanoseconds(total);
}

std::string format(double value) { return format_real(value); }
std::string format(float value) { return format_real(value); }

std::string format(std::chrono::nanoseconds duration) {
  const std::int64_t count = duration.count();
  const bool negative = count < 0;
  // As unsigned, so that the lowest value has a magnitude.
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
  const std::int64_t days = ns >= 0 ? ns / day_ns : -((-(ns + 1)) / day_ns) - 1;
  const std::int64_t of_day = ns % day_ns + (ns % day_ns < 0 ? day_ns : 0);
  std::int64_t year = 0;
  unsigned month = 0, day = 0;
  civil_from_days(days, year, month, day);
  char text[64];
  std::snprintf(text, sizeof text, "%04lld-%02u-%02uT%02d:%02d:%02d", static_cast<long long>(year), month, day,
                static_cast<int>(of_day / hour_ns), static_cast<int>(of_day / minute_ns % 60), static_cast<int>(of_day / second_ns % 60));
  return text + fraction_text(of_day % second_ns) + "Z";
}

}  // namespace lrt::rdf::lexical

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>

namespace lrt::detail {

/// A date in the proleptic Gregorian calendar.
struct CivilDate {
  std::int64_t year;
  unsigned month, day;  ///< 1-based
};

/// The opposite of days_from_civil().
inline CivilDate civil_from_days(std::int64_t days) noexcept {
  // Years are counted from March in eras of 400 years (146097 days), so a leap day is the last day of its year.
  const std::int64_t shifted = days + 719'468;  // days since 0000-03-01
  const std::int64_t era = (shifted >= 0 ? shifted : shifted - 146'096) / 146'097;
  const auto day_of_era = static_cast<unsigned>(shifted - era * 146'097);
  const unsigned year_of_era = (day_of_era - day_of_era / 1'460 + day_of_era / 36'524 - day_of_era / 146'096) / 365;
  const unsigned day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
  const unsigned march_month = (5 * day_of_year + 2) / 153;
  const unsigned month = march_month < 10 ? march_month + 3 : march_month - 9;
  return {static_cast<std::int64_t>(year_of_era) + era * 400 + (month <= 2 ? 1 : 0), month, day_of_year - (153 * march_month + 2) / 5 + 1};
}

/// A UTC instant in the proleptic Gregorian calendar.
struct Civil {
  std::int64_t year;
  unsigned month, day;  ///< 1-based
  unsigned hour, minute, second, microsecond;
  unsigned weekday;  ///< 0 is Sunday
};

/// Rounds down to the microsecond, also before 1970. No locale, no time zone, no allocation.
inline Civil to_civil(std::chrono::system_clock::time_point utc) noexcept {
  using std::chrono::floor;
  using Days = std::chrono::duration<std::int64_t, std::ratio<86400>>;
  const auto since_epoch = utc.time_since_epoch();
  const std::int64_t days = floor<Days>(since_epoch).count();
  const std::int64_t micros = floor<std::chrono::microseconds>(since_epoch).count() - days * 86'400'000'000;
  const auto second_of_day = static_cast<unsigned>(micros / 1'000'000);

  const CivilDate date = civil_from_days(days);
  Civil result{};
  result.year = date.year;
  result.month = date.month;
  result.day = date.day;
  result.hour = second_of_day / 3600;
  result.minute = second_of_day / 60 % 60;
  result.second = second_of_day % 60;
  result.microsecond = static_cast<unsigned>(micros % 1'000'000);
  result.weekday = static_cast<unsigned>(((days % 7) + 11) % 7);  // 1970-01-01 was a Thursday
  return result;
}

/// Days from 1970-01-01 of a proleptic Gregorian date (Hinnant's era arithmetic: 400 years have 146,097 days).
inline std::int64_t days_from_civil(std::int64_t year, unsigned month, unsigned day) noexcept {
  year -= month <= 2;
  const std::int64_t era = (year >= 0 ? year : year - 399) / 400;
  const auto year_of_era = static_cast<unsigned>(year - era * 400);
  const unsigned day_of_year = (153 * (month > 2 ? month - 3 : month + 9) + 2) / 5 + day - 1;
  const unsigned day_of_era = year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year;
  return era * 146'097 + static_cast<std::int64_t>(day_of_era) - 719'468;
}

/// Writes `width` decimal digits, zero-padded. Returns the position after them.
inline char* put_digits(char* out, unsigned value, int width) noexcept {
  for (int i = width - 1; i >= 0; --i) {
    out[i] = static_cast<char>('0' + value % 10);
    value /= 10;
  }
  return out + width;
}

}  // namespace lrt::detail

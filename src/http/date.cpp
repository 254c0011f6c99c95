// SPDX-License-Identifier: Apache-2.0
#include <lrt/http/date.hpp>

#include <cstring>

#include "src/base/civil.hpp"

namespace lrt::http {
inline namespace v0 {

std::string to_http_date(std::chrono::system_clock::time_point utc) {
  using detail::put_digits;
  static constexpr char weekdays[] = "SunMonTueWedThuFriSat";
  static constexpr char months[] = "JanFebMarAprMayJunJulAugSepOctNovDec";
  const detail::Civil civil = detail::to_civil(utc);
  char text[29];
  std::memcpy(text, weekdays + std::size_t{3} * civil.weekday, 3);
  std::memcpy(text + 3, ", ", 2);
  put_digits(text + 5, civil.day, 2);
  text[7] = ' ';
  std::memcpy(text + 8, months + std::size_t{3} * (civil.month - 1), 3);
  text[11] = ' ';
  put_digits(text + 12, static_cast<unsigned>(civil.year), 4);
  text[16] = ' ';
  put_digits(text + 17, civil.hour, 2);
  text[19] = ':';
  put_digits(text + 20, civil.minute, 2);
  text[22] = ':';
  put_digits(text + 23, civil.second, 2);
  std::memcpy(text + 25, " GMT", 4);
  return std::string(text, sizeof text);
}

}  // namespace v0
}  // namespace lrt::http

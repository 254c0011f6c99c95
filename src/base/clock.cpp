// SPDX-License-Identifier: Apache-2.0
#include <lrt/base/clock.hpp>

#include <lrt/base/immortal.hpp>

#include "src/base/civil.hpp"

namespace lrt {
inline namespace v0 {
namespace {

class SystemClock final : public Clock {
 public:
  TimePoint now() const noexcept override { return {std::chrono::steady_clock::now(), std::chrono::system_clock::now()}; }
  std::chrono::system_clock::time_point utc() const noexcept override { return std::chrono::system_clock::now(); }
};

}  // namespace

const Clock& system_clock() noexcept {
  static const Immortal<SystemClock> clock;
  return *clock;
}

std::string to_xsd_date_time(std::chrono::system_clock::time_point utc) {
  using detail::put_digits;
  const detail::Civil civil = detail::to_civil(utc);
  char text[40];
  char* out = text;
  std::int64_t year = civil.year;
  if (year < 0) {
    *out++ = '-';
    year = -year;
  }
  int width = 4;  // XML Schema: at least four digits, more only when needed
  for (std::int64_t limit = 10'000; year >= limit; limit *= 10) ++width;
  out = put_digits(out, static_cast<unsigned>(year), width);
  *out++ = '-';
  out = put_digits(out, civil.month, 2);
  *out++ = '-';
  out = put_digits(out, civil.day, 2);
  *out++ = 'T';
  out = put_digits(out, civil.hour, 2);
  *out++ = ':';
  out = put_digits(out, civil.minute, 2);
  *out++ = ':';
  out = put_digits(out, civil.second, 2);
  *out++ = '.';
  out = put_digits(out, civil.microsecond, 6);
  *out++ = 'Z';
  return std::string(text, static_cast<std::size_t>(out - text));
}

}  // namespace v0
}  // namespace lrt

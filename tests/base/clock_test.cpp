// SPDX-License-Identifier: Apache-2.0
#include <cstdint>

#include <lrt/base/clock.hpp>

#include "tests/support/catch.hpp"

using namespace lrt;
using std::chrono::microseconds;

namespace {
std::string at(std::int64_t micros) {
  return to_xsd_date_time(
      std::chrono::system_clock::time_point(std::chrono::duration_cast<std::chrono::system_clock::duration>(microseconds(micros))));
}
constexpr std::int64_t second = 1'000'000;
}  // namespace

TEST_CASE("xsd:dateTime is in UTC with microseconds, before 1970 too", "[base]") {
  CHECK(at(0) == "1970-01-01T00:00:00.000000Z");
  CHECK(at(1795257519 * second + 125) == "2026-11-21T10:38:39.000125Z");
  CHECK(at(-1) == "1969-12-31T23:59:59.999999Z");
  CHECK(at(-86400 * second) == "1969-12-31T00:00:00.000000Z");
  CHECK(at(-2203891200 * second) == "1900-03-01T00:00:00.000000Z");
  CHECK(at(-2203891200 * second - 1) == "1900-02-28T23:59:59.999999Z");  // 1900 was not a leap year
  CHECK(at(951782400 * second) == "2000-02-29T00:00:00.000000Z");
  CHECK(at(4107542399 * second) == "2100-02-28T23:59:59.000000Z");
  CHECK(at(4107542400 * second) == "2100-03-01T00:00:00.000000Z");
}

TEST_CASE("less than a microsecond is rounded down on both sides of 1970", "[base]") {
  using std::chrono::nanoseconds;
  using Clock = std::chrono::system_clock;
  CHECK(to_xsd_date_time(Clock::time_point(std::chrono::duration_cast<Clock::duration>(nanoseconds(999)))) == "1970-01-01T00:00:00.000000Z");
  if (std::ratio_less_v<Clock::period, std::micro>) {
    CHECK(to_xsd_date_time(Clock::time_point(std::chrono::duration_cast<Clock::duration>(nanoseconds(-1)))) == "1969-12-31T23:59:59.999999Z");
  }
}

TEST_CASE("consecutive days follow each other over four centuries", "[base]") {
  std::string before = at(-4'000'000'000 * second);
  for (std::int64_t day = 1; day < 97'000; ++day) {
    std::string now = at((-4'000'000'000 + day * 86400) * second);
    if (!(before < now) || now.size() != 27 || now.substr(10) != before.substr(10)) FAIL(before << " then " << now);
    before = std::move(now);
  }
}

TEST_CASE("the system's steady clock does not go back", "[base]") {
  const TimePoint a = system_clock().now();
  const TimePoint b = system_clock().now();
  CHECK(a.steady <= b.steady);
  CHECK(&system_clock() == &system_clock());
}

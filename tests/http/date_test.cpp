// SPDX-License-Identifier: Apache-2.0
#include <cstdint>

#include <lrt/http/date.hpp>

#include "tests/support/catch.hpp"

using namespace lrt;

TEST_CASE("Date is an IMF-fixdate", "[http][R0.1]") {
  const auto at = [](std::int64_t seconds) { return http::to_http_date(std::chrono::system_clock::time_point(std::chrono::seconds(seconds))); };
  CHECK(at(784111777) == "Sun, 06 Nov 1994 08:49:37 GMT");
  CHECK(at(0) == "Thu, 01 Jan 1970 00:00:00 GMT");
  CHECK(at(-1) == "Wed, 31 Dec 1969 23:59:59 GMT");
  CHECK(at(951782400) == "Tue, 29 Feb 2000 00:00:00 GMT");
  CHECK(at(4107542400) == "Mon, 01 Mar 2100 00:00:00 GMT");
  const char* week[] = {"Thu", "Fri", "Sat", "Sun", "Mon", "Tue", "Wed"};
  for (int day = -7000; day < 7000; ++day) CHECK(at(day * 86400LL).substr(0, 3) == week[((day % 7) + 7) % 7]);
}

// SPDX-License-Identifier: Apache-2.0
#include "src/client/robot_times.hpp"

#include <chrono>
#include <string>

#include "tests/support/catch.hpp"

using namespace lrt;
using client::RobotTimes;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

const std::string here = "http://robot";
constexpr milliseconds life{2000};
RobotTimes::Instant at(int ms) { return RobotTimes::Instant(std::chrono::hours(1)) + milliseconds(ms); }
std::string stamp(int instance, int ms) { return http::RobotTime{static_cast<std::uint64_t>(instance), static_cast<std::uint64_t>(ms)}.text(); }

}  // namespace

TEST_CASE("a command adds only the time that has passed here", "[client][expiry]") {
  RobotTimes times;
  CHECK(times.must_ask(here, "/arm/angle", life, at(0)));
  CHECK_FALSE(times.until(here, "/arm/angle", life, at(0)));
  times.heard(here, "/", stamp(1, 5000), at(0));
  CHECK_FALSE(times.must_ask(here, "/arm/angle?x=1", life, at(0)));
  CHECK(times.until(here, "/arm/angle", life, at(0)) == stamp(1, 7000));
  CHECK(times.until(here, "/arm/angle", life, at(500)) == stamp(1, 7500));
  CHECK(times.until(here, "/arm/angle", life, at(100'000)) == stamp(1, 106'900));  // less than has passed: clocks drift
  CHECK_FALSE(times.must_ask(here, "/arm/angle", life, at(200'000)));
  CHECK(times.must_ask(here, "/arm/angle", life, at(200'001)));
}

TEST_CASE("a response that was delayed does not make the next command late", "[client][expiry]") {
  RobotTimes times;
  times.heard(here, "/", stamp(1, 5000), at(0));
  times.heard(here, "/", stamp(1, 5100), at(1900));  // frozen for 1.8 s
  CHECK(times.until(here, "/", life, at(2000)) == stamp(1, 5000 + 1998 + 2000));
  times.heard(here, "/", stamp(1, 8000), at(3000));
  CHECK(times.until(here, "/", life, at(3000)) == stamp(1, 10'000));
}

TEST_CASE("a restarted server replaces the one before, wherever it was heard", "[client][expiry]") {
  RobotTimes times;
  times.heard(here, "/arm/angle", stamp(1, 5000), at(0));
  times.heard(here, "/", stamp(2, 10), at(1000));
  CHECK(times.until(here, "/arm/angle", life, at(1000)) == stamp(2, 2010));
  times.heard(here, "/arm", stamp(3, 7), at(2000));
  CHECK(times.until(here, "/arm/angle", life, at(2000)) == stamp(3, 2007));
  times.heard(here, "/", stamp(3, 1007), at(3000));
  CHECK(times.until(here, "/leg", life, at(3000)) == stamp(3, 3007));
}

TEST_CASE("robots below the paths of one origin have times of their own", "[client][expiry]") {
  RobotTimes times;
  times.heard(here, "/one/arm", stamp(1, 100), at(0));
  times.heard(here, "/one/leg/foot", stamp(1, 100), at(0));
  times.heard(here, "/two/arm", stamp(2, 900), at(0));
  CHECK(times.until(here, "/one/x", life, at(0)) == stamp(1, 2100));
  CHECK(times.until(here, "/two/arm/angle", life, at(0)) == stamp(2, 2900));
  CHECK(times.must_ask(here, "/three", life, at(0)));
  CHECK(times.must_ask(here, "/oneself", life, at(0)));
  CHECK_FALSE(times.until(here, "/three", life, at(0)));
}

TEST_CASE("a server without the field is not asked again", "[client][expiry]") {
  RobotTimes times;
  times.heard(here, "/", std::nullopt, at(0));
  CHECK_FALSE(times.must_ask(here, "/arm", life, at(0)));
  CHECK_FALSE(times.until(here, "/arm", life, at(0)));
  times.heard(here, "/", "nonsense", at(0));
  CHECK_FALSE(times.until(here, "/arm", life, at(0)));
  times.heard(here, "/", stamp(1, 1), at(0));
  CHECK(times.until(here, "/arm", life, at(0)));
  times.heard(here, "/", std::nullopt, at(0));  // a proxy's own response
  CHECK(times.until(here, "/arm", life, at(0)));
}

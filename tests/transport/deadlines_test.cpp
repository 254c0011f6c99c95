// SPDX-License-Identifier: Apache-2.0
#include "src/transport/http/deadlines.hpp"

#include "tests/support/catch.hpp"

using lrt::transport::Deadlines;
using std::chrono::seconds;

TEST_CASE("deadlines expire in order of time, whatever their kind, and only once", "[transport]") {
  struct Item final : Deadlines::Entry {
    void expire(lrt::TimePoint) override {}
  };
  Deadlines deadlines;
  const Deadlines::Instant start{};
  Item short_one;
  Item long_one;
  Item moved;
  Item cleared;
  CHECK_FALSE(deadlines.next());
  deadlines.set(long_one, 1, start + seconds(10));
  deadlines.set(short_one, 0, start + seconds(5));
  deadlines.set(moved, 0, start + seconds(6));
  deadlines.set(cleared, 0, start + seconds(7));
  deadlines.set(moved, 1, start + seconds(20));
  deadlines.clear(cleared);
  deadlines.clear(cleared);
  CHECK(deadlines.next() == start + seconds(5));
  CHECK(deadlines.expired(start + seconds(4)) == nullptr);
  CHECK(deadlines.expired(start + seconds(5)) == &short_one);
  CHECK(deadlines.expired(start + seconds(9)) == nullptr);
  CHECK(deadlines.expired(start + seconds(30)) == &long_one);
  CHECK(deadlines.expired(start + seconds(30)) == &moved);
  CHECK(deadlines.expired(start + seconds(30)) == nullptr);
  CHECK_FALSE(deadlines.next());
}

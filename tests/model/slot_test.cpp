#include <lrt/model/detail/slot.hpp>

#include <array>
#include <atomic>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/allocations.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"

using namespace lrt;
using test::allocations;
using model::Slot;

namespace {
using Utc = std::chrono::system_clock::time_point;
using Vector = std::array<double, 8>;

/// Like Eigen's fixed sizes: owns no memory and is not trivially copyable.
struct Copied {
  Copied() = default;
  Copied(const Copied& other) : value(other.value) {}
  Copied& operator=(const Copied& other) { return value = other.value, *this; }
  double value = 0;
};
}  // namespace

template <>
struct lrt::rdf::traits<Copied> : lrt::rdf::Record<Copied> {
  static void describe(Record<Copied>& r) { r.field("value", &Copied::value); }
};

TEST_CASE("a slot gives the newest value once, with the time of its publication", "[model][R0.11]") {
  test::FakeClock clock;
  Slot<double> slot;
  slot.set_clock(clock);
  rdf::Value value;
  Utc since;
  CHECK_FALSE(slot.has_change());
  CHECK_FALSE(slot.take(value, since));
  slot.publish(1);
  clock.advance(std::chrono::seconds(1));
  slot.publish(2);
  const Utc then = clock.now().utc;
  clock.advance(std::chrono::seconds(1));
  slot.publish(2);  // bit-identical: not a change
  CHECK(slot.has_change());
  REQUIRE(slot.take(value, since));
  CHECK(*value.real() == 2);
  CHECK(since == then);
  CHECK_FALSE(slot.take(value, since));
  slot.publish(2);
  CHECK_FALSE(slot.has_change());
  slot.publish(-0.0);
  CHECK(slot.take(value, since));
  slot.publish(0.0);
  CHECK(slot.take(value, since));
}

TEST_CASE("after forget a repeated value counts as a change once; with every_sample each value does", "[model][R0.11]") {
  Slot<double> slot;
  Slot<std::string> text;
  rdf::Value value;
  Utc since;
  const auto check = [&](auto& s, const auto& v) {
    s.publish(v);
    REQUIRE(s.take(value, since));
    s.forget();
    s.publish(v);
    CHECK(s.take(value, since));
    s.publish(v);
    CHECK_FALSE(s.take(value, since));
    s.set_every_sample();
    s.publish(v);
    CHECK(s.take(value, since));
    s.publish(v);
    CHECK(s.take(value, since));
  };
  check(slot, 1.5);
  check(text, std::string("x"));
}

TEST_CASE("publish of a value that owns no memory does not allocate", "[model]") {
  static_assert(!std::is_trivially_copyable_v<Copied>);
  Slot<double> number;
  Slot<Vector> vector;
  Slot<Copied> copied;
  Copied c;
  Vector v{};
  const std::size_t before = allocations;
  for (int i = 0; i < 1000; ++i) {
    v[i % 8] = i;
    number.publish(i);
    vector.publish(v);
    c.value = i;
    copied.publish(c);
  }
  CHECK(allocations == before);
}

TEST_CASE("publishing an unchanged text does not allocate either", "[model]") {
  Slot<std::string> slot;
  const std::string text(100, 'x');
  slot.publish(text);
  const std::size_t before = allocations;
  slot.publish(text);
  CHECK(allocations == before);
}

TEST_CASE("another thread takes published values intact and in order", "[model]") {
  Slot<Vector> slot;
  std::atomic<bool> stop{false};
  std::thread writer([&] {
    for (int i = 1; !stop; ++i) {
      Vector v;
      v.fill(i);
      slot.publish(v);
    }
  });
  double last = 0;
  for (int taken = 0; taken < 20'000;) {
    rdf::Value value;
    Utc since;
    if (!slot.take(value, since)) continue;
    ++taken;
    const auto& members = *value.sequence();
    const double first = *members[0].real();
    if (first <= last) FAIL("out of order");
    last = first;
    for (const rdf::Value& m : members)
      if (*m.real() != first) FAIL("torn");
  }
  stop = true;
  writer.join();
}

TEST_CASE("the last published value is taken last", "[model]") {
  for (int round = 0; round < 200; ++round) {
    Slot<double> number;
    Slot<std::string> text;
    std::thread writer([&] {
      for (int i = 1; i <= 50; ++i) {
        number.publish(i);
        text.publish(std::to_string(i));
      }
    });
    rdf::Value n, t;
    Utc since;
    for (int i = 0; i < 20; ++i) {
      (void)number.take(n, since);
      (void)text.take(t, since);
    }
    writer.join();
    (void)number.take(n, since);
    (void)text.take(t, since);
    CHECK(*n.real() == 50);
    CHECK(*t.text() == "50");
  }
}

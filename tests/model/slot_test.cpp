// SPDX-License-Identifier: Apache-2.0
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
using model::Slot;
using test::allocations;

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

TEST_CASE("a value has the time that it is published with, and its number in the order of publication", "[model]") {
  const auto check = [](auto& slot, auto one, auto two) {
    test::FakeClock clock;
    slot.set_clock(clock);
    rdf::Value value;
    Utc since;
    slot.publish(one);
    CHECK_FALSE(slot.has_source_times());
    REQUIRE(slot.take(value, since));
    CHECK(since == clock.now().utc);
    CHECK(slot.taken() == 1);
    const Utc then = clock.now().utc - std::chrono::hours(1);
    slot.publish(one, then);  // bit-identical: not a change, and its time stays
    CHECK_FALSE(slot.take(value, since));
    slot.publish(two, then);
    slot.publish(one, then + std::chrono::seconds(1));
    slot.publish(two, then + std::chrono::seconds(2));
    CHECK(slot.has_source_times());
    REQUIRE(slot.take(value, since));
    CHECK(since == then + std::chrono::seconds(2));
    CHECK(slot.taken() == 4);
  };
  Slot<double> number;
  check(number, 1.0, 2.0);
  Slot<std::string> text;
  check(text, std::string("one"), std::string("two"));
}

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

namespace {

/// Takes all values that there are; the last number.
template <class S>
std::vector<int> taken_from(S& slot) {
  std::vector<int> all;
  rdf::Value value;
  Utc since;
  while (slot.take(value, since)) all.push_back(value.text() ? std::stoi(*value.text()) : static_cast<int>(*value.real()));
  return all;
}
void publish(Slot<double>& slot, int i) { slot.publish(i); }
void publish(Slot<std::string>& slot, int i) { slot.publish(std::to_string(i)); }

}  // namespace

TEMPLATE_TEST_CASE("values are kept between start_keeping and stop_keeping only", "[model][delivery]", double, std::string) {
  Slot<TestType> slot;
  const auto publish_all = [&](int first, int last) {
    for (int i = first; i <= last; ++i) publish(slot, i);
  };
  publish_all(1, 10);
  CHECK(taken_from(slot) == std::vector<int>{10});
  publish_all(11, 20);
  slot.start_keeping(5, 1000);
  slot.set_value_bytes(8);
  publish_all(21, 23);
  CHECK(taken_from(slot) == std::vector<int>{21, 22, 23});
  CHECK(slot.lost() == 0);  // those before were not promised
  publish_all(24, 30);      // five fit, and the last is the newest
  CHECK(taken_from(slot) == std::vector<int>{24, 25, 26, 27, 28, 30});
  CHECK(slot.lost() == 1);
  publish_all(31, 33);
  slot.stop_keeping();
  publish_all(34, 99);
  CHECK(taken_from(slot) == std::vector<int>{99});
  publish_all(100, 110);
  slot.start_keeping(5, 1000);
  CHECK(taken_from(slot) == std::vector<int>{110});  // no news of before
  publish_all(111, 112);
  CHECK(taken_from(slot) == std::vector<int>{111, 112});
  CHECK(slot.lost() == 1);
}

TEST_CASE("the memory of kept values is bounded", "[model][delivery]") {
  Slot<Vector> vector;  // 64 bytes and 16 of its sample
  vector.start_keeping(1000, 800);
  CHECK(vector.available() == 11);
  Slot<Vector> large;
  large.start_keeping(1000, 10);
  for (int i = 1; i <= 5; ++i) {
    Vector v{};
    v[0] = i;
    large.publish(v);
  }
  rdf::Value value;
  Utc since;
  CHECK(large.take(value, since));
  CHECK_FALSE(large.take(value, since));
  Vector v{};
  for (int i = 6; i <= 9; ++i) {
    v[0] = i;
    large.publish(v);
  }
  CHECK(large.take(value, since));
  CHECK(large.lost() == 7);

  Slot<std::string> text;
  text.start_keeping(1000, 10'000);
  for (int i = 1; i <= 5; ++i) publish(text, i);
  CHECK(taken_from(text) == std::vector<int>{1, 5});  // of unknown size: one
  text.set_value_bytes(2000);
  for (int i = 6; i <= 20; ++i) publish(text, i);
  CHECK(taken_from(text) == std::vector<int>{6, 7, 8, 9, 20});
  Slot<std::string> set;
  set.keep(3);  // the limit is not for what the user has set
  set.start_keeping(1000, 0);
  set.set_value_bytes(1'000'000);
  for (int i = 1; i <= 3; ++i) publish(set, i);
  CHECK(taken_from(set) == std::vector<int>{1, 2, 3});
}

TEMPLATE_TEST_CASE("each value of another thread is taken or counted, in order", "[model][delivery]", double, std::string) {
  constexpr int count = 30'000;
  Slot<TestType> slot;
  slot.keep(64);
  slot.start_keeping(0, 0);
  std::atomic<bool> done{false};
  std::thread writer([&] {
    for (int i = 1; i <= count; ++i) publish(slot, i);
    done = true;
  });
  std::uint64_t taken = 0;
  int last = 0;
  while (true) {
    const bool was_done = done;
    for (const int i : taken_from(slot)) {
      ++taken;
      if (i <= last) FAIL("out of order");
      last = i;
    }
    if (was_done) break;
  }
  writer.join();
  CHECK(last == count);
  CHECK(taken + slot.lost() == count);
}

TEMPLATE_TEST_CASE("keeping may begin and end while another thread publishes", "[model][delivery]", double, std::string) {
  Slot<TestType> slot;
  std::atomic<bool> stop{false};
  int published = 0;
  std::thread writer([&] {
    while (!stop) publish(slot, ++published);
  });
  int last = 0;
  for (int round = 0; round < 2'000; ++round) {
    slot.start_keeping(16, 10'000);
    slot.set_value_bytes(100);
    rdf::Value value;
    Utc since;
    for (int i = 0; i < 20 && slot.take(value, since); ++i) {
      const int now = value.text() ? std::stoi(*value.text()) : static_cast<int>(*value.real());
      if (now <= last) FAIL("out of order");
      last = now;
    }
    slot.stop_keeping();
  }
  stop = true;
  writer.join();
  const std::vector<int> rest = taken_from(slot);
  CHECK((rest.empty() ? last : rest.back()) == published);
}

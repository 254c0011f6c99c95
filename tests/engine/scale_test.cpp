// SPDX-License-Identifier: Apache-2.0
// What many Things cost, in bytes of the allocator and in allocations, which do not depend on the machine.

#include <lrt/engine/engine.hpp>

#include <malloc.h>

#include <string>
#include <vector>

#include "tests/support/allocation_counters.hpp"  // counted by subscription_test.cpp
#include "tests/support/bench.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/skip.hpp"

using namespace lrt;
using namespace lrt::engine;
using namespace lrt::test;

namespace {

/// A cell with many equal arms, each with three properties that have values.
class Cell {
 public:
  explicit Cell(std::size_t arms) {
    bench.add(Thing{"cell"});
    while (first_joints.size() < arms) add_arm();
  }
  void add_arm() {
    Thing arm{path_of(first_joints.size()).substr(1)};
    for (const char* name : {"joint1", "joint2", "joint3"}) {
      auto joint = arm.property<double>(name, unit::radian);
      joint.between(-3, 3).publish(0.5);
      if (name[5] == '1') first_joints.push_back(joint);
    }
    bench.add(std::move(arm));
  }
  static std::string path_of(std::size_t arm) { return "/cell/arm" + std::to_string(10'000 + arm); }

  Bench bench;
  std::vector<PushedProperty<double>> first_joints;
};

/// What `work` allocates on this thread: how often and how many bytes.
struct Cost {
  std::size_t times, bytes;
};
template <class Work>
Cost cost_of(Work work) {
  const Cost before{allocations, allocated_bytes};
  work();
  return {allocations - before.times, allocated_bytes - before.bytes};
}

}  // namespace

TEST_CASE("a Thing with three properties takes at most 4 KiB", "[engine][scale]") {
  if (is_sanitized) return print_skip("the allocators of sanitizers use more memory");
  Cell cell(100);
  cell.first_joints.reserve(3000);
  const auto in_use = [] { return ::mallinfo2().uordblks + ::mallinfo2().hblkhd; };
  const std::size_t before = in_use();
  constexpr std::size_t arms = 2000;
  for (std::size_t i = 0; i < arms; ++i) cell.add_arm();
  const std::size_t each = (in_use() - before) / arms;
  INFO(each << " bytes");
  CHECK(each <= 4096);
}

TEST_CASE("registering a Thing costs the same whether there are a hundred or thousands", "[engine][scale]") {
  Cell cell(100);
  const auto add_more = [&] {
    for (int i = 0; i < 100; ++i) cell.add_arm();
  };
  const Cost few = cost_of(add_more);
  while (cell.first_joints.size() < 3000) cell.add_arm();
  const Cost many = cost_of(add_more);
  CHECK(many.times <= few.times + few.times / 20);  // tables that are doubled may be among them
}

TEST_CASE("a kind of its own costs the same whether there are ten kinds or hundreds", "[engine][scale]") {
  Bench bench;
  int number = 0;
  const auto add_more = [&](int count) {
    for (const int end = number + count; number < end; ++number) {
      Thing arm{"arm" + std::to_string(1000 + number)};
      arm.type(vocab::ros::Link);
      arm.property<double>("p" + std::to_string(1000 + number));
      bench.add(std::move(arm));
    }
  };
  add_more(10);
  const Cost few = cost_of([&] { add_more(20); });
  add_more(570);
  const Cost many = cost_of([&] { add_more(20); });
  CHECK(many.times <= few.times + few.times / 4);
  const std::string kind = kind_of(bench, "/arm1003");
  CHECK(bench.get(kind).status == 200);
  CHECK(kind != kind_of(bench, "/arm1004"));
  CHECK(bench.engine.remove("arm1003"));
  CHECK(bench.get(kind).status == 404);
  number = 3;
  add_more(1);
  CHECK(kind_of(bench, "/arm1003") == kind);  // the same registration is the same kind
}

TEST_CASE("a GET of a property costs the same among ten Things and among thousands", "[engine][scale]") {
  const auto cost_among = [](std::size_t arms) {
    Cell cell(arms);
    const auto change_and_get = [&](double value) {
      cell.first_joints[5].publish(value);
      CHECK(cell.bench.get(Cell::path_of(5) + "/joint1").status == 200);
    };
    change_and_get(1);
    return cost_of([&] { change_and_get(2); });
  };
  const Cost few = cost_among(10), many = cost_among(3000);
  CHECK(many.times == few.times);
  CHECK(many.bytes == few.bytes);
}

TEST_CASE("one body for each of many equal Things is judged by one compiled Blueprint", "[engine][scale]") {
  Bench bench;
  double target = 0;
  for (int i = 0; i < 1000; ++i) {
    Thing arm{"arm" + std::to_string(i)};
    arm.property(
           "target", [&] { return target; }, unit::radian)
        .between(-3, 3)
        .on_write([&](double wanted) { target = wanted; });
    bench.add(std::move(arm));
  }
  const auto put = [&](int arm, const char* value) {
    return bench.ask("PUT /arm" + std::to_string(arm) + "/target\nContent-Type: application/json\n\n" + value).status;
  };
  CHECK(put(0, "1") == 204);
  CHECK(put(1, "4") == 422);
  const Cost first = cost_of([&] { CHECK(put(1, "2") == 204); });
  const Cost next = cost_of([&] { CHECK(put(2, "2") == 204); });
  CHECK(next.times <= first.times + first.times / 4);  // the Blueprint is not compiled again
  Thing other{"other"};
  other
      .property(
          "target", [&] { return target; }, unit::radian)
      .between(-5, 5)
      .on_write([&](double wanted) { target = wanted; });
  bench.add(std::move(other));  // the bounds are no longer those of the kind
  CHECK(put(1, "4") == 422);
  CHECK(bench.ask("PUT /other/target\nContent-Type: application/json\n\n4").status == 204);
  CHECK(bench.engine.remove("other"));
  CHECK(put(1, "4") == 422);
  CHECK(put(1, "2") == 204);
}

TEST_CASE("the first page of the root names 500 of many Things, and links to the rest", "[engine][R0.4][scale]") {
  Bench bench;
  for (int i = 0; i < 2100; ++i) bench.add(Thing{"arm" + std::to_string(i)});
  std::size_t pages = 0, things = 0;
  for (std::string path = "/"; !path.empty(); ++pages) {
    const Answer page = bench.ask("GET " + path + "\nAccept: application/n-triples");
    REQUIRE(page.status == 200);
    for (std::size_t at = page.body.find("ldp#contains"); at != std::string::npos; at = page.body.find("ldp#contains", at + 1)) ++things;
    const std::string next = "/?page=" + std::to_string(pages + 2);
    path = page.links_to("http://localhost" + next, "next") ? next : std::string();
  }
  CHECK(pages == 5);
  CHECK(things == 2100);
}

TEST_CASE(
    "one subscription on a parent of a thousand Things gets one message for a change, and nothing is done for the values of "
    "the others",
    "[engine][R0.12][scale]") {
  Cell cell(1000);
  Bench& bench = cell.bench;
  const Channel channel = bench.open("/cell");
  REQUIRE(bench.pushes().size() == 1);
  const auto scan = [&] {
    bench.look();
    CHECK(bench.pushes().empty());
  };
  scan();
  const Cost quiet = cost_of(scan);
  for (auto& joint : cell.first_joints) joint.publish(1);
  CHECK(cost_of(scan).times == quiet.times);  // values that nobody observes are not taken

  for (int i = 0; i < 10; ++i) cell.add_arm();  // one message for all that happens before it is sent
  auto told = bench.pushes();
  REQUIRE(told.size() == 1);
  CHECK(told[0].first == channel);
  CHECK(told[0].second.message->find(Cell::path_of(1009)) != std::string::npos);
  CHECK(bench.pushes().empty());
}

// SPDX-License-Identifier: Apache-2.0
// A robot whose broker is behind a slow link: what arrives is the newest, and what was left out is counted.
#include <lrt/mqtt.hpp>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <iostream>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <lrt/lrt.hpp>

#include "tests/mqtt/broker.hpp"
#include "tests/mqtt/slow_link.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;
using std::chrono::seconds;
using Steady = std::chrono::steady_clock;

namespace {

constexpr int value_count = 8;

/// A robot with numbers that change all the time, and one whose values are each wanted.
struct Robot {
  Robot(std::uint16_t port, int qos) {
    lrt::Options server_options;
    server_options.listen.port = 0;
    server_options.listen.public_base = "http://robot.example";
    server.emplace(Server::create(std::move(server_options)).value());
    Thing arm{"arm"};
    for (int i = 0; i < value_count; ++i) values.push_back(arm.property<int>("v" + std::to_string(i), unit::radian));
    each = arm.property<int>("each");
    server->add(std::move(arm)).value();
    for (auto& value : values) value.publish(0);
    each.publish(0);
    mqtt::Options options;
    options.broker.port = port;
    options.prefix = "r";
    options.description.publish = options.description.things = false;
    mqtt::Publication queued, newest;
    queued.paths = "/arm/each";
    queued.queue_length = 10'000;
    queued.qos = qos;
    newest.kinds = {mqtt::Kind::property};
    newest.qos = qos;
    newest.minimum_interval = milliseconds(0);
    options.publications = {queued, newest};
    options.log = [this](LogLevel, std::string_view message) { log.append(message).append("\n"); };
    bridge.emplace(mqtt::Bridge::create(*server, std::move(options)).value());
  }
  void turn(Watcher& watcher) {
    server->poll();
    bridge->poll();
    watcher.step(0);
  }
  template <class F>
  void until(Watcher& watcher, F condition) {
    const auto end = Steady::now() + seconds(60);
    while (!condition()) {
      if (Steady::now() > end) {
        UNSCOPED_INFO(log);
        FAIL("it did not come true in sixty seconds");
      }
      turn(watcher);
    }
  }

  std::optional<Server> server;
  std::optional<mqtt::Bridge> bridge;
  std::vector<PushedProperty<int>> values;
  PushedProperty<int> each;
  std::string log;
};

}  // namespace

TEST_CASE("behind a slow link the newest values arrive, each value of a queue, and what was left out is counted", "[mqtt][newest]") {
  if (!has_mosquitto()) return;
  const int qos = GENERATE(0, 1, 2);
  Mosquitto broker;
  SlowLink::Options slow;
  slow.to = broker.port();
  slow.stall_every = milliseconds(2'000);
  slow.stall = milliseconds(100);
  SlowLink link(slow);
  Watcher watcher(broker.port());
  watcher.connect();
  watcher.subscribe("r/arm/#", 2);
  Robot robot(link.port(), qos);
  const auto have_all = [&](int value, int of_each) {
    for (int i = 0; i < value_count; ++i)
      if (watcher.payload("r/arm/v" + std::to_string(i)) != std::to_string(value)) return false;
    return watcher.payload("r/arm/each") == std::to_string(of_each);
  };
  robot.until(watcher, [&] { return have_all(0, 0); });

  // For figures. Nothing is asserted of a time.
  std::vector<Steady::time_point> made = {Steady::now()};
  std::vector<double> ages;
  std::size_t seen = 0;
  int newest = 0, last = 0, last_each = 0;
  const Steady::time_point begin = Steady::now();
  while (Steady::now() - begin < seconds(3)) {
    ++last;
    made.push_back(Steady::now());
    for (auto& value : robot.values) value.publish(last);
    if (last % 100 == 0) robot.each.publish(++last_each);
    for (const Steady::time_point next = made.back() + milliseconds(1); Steady::now() < next;) robot.turn(watcher);
    for (; seen < watcher.messages.size(); ++seen)
      if (watcher.messages[seen].topic == "r/arm/v0") newest = std::max(newest, std::stoi(watcher.messages[seen].payload));
    ages.push_back(std::chrono::duration<double>(Steady::now() - made[static_cast<std::size_t>(newest)]).count());
  }
  ++last;
  for (auto& value : robot.values) value.publish(last);
  robot.until(watcher, [&] { return have_all(last, last_each); });
  std::sort(ages.begin(), ages.end());
  std::cout << "QoS " << qos << ": age of the newest value: median " << ages[ages.size() / 2] << " s, worst " << ages.back() << " s; left out "
            << robot.bridge->counters().left_out << "; most bytes in the link " << link.most_kept() << "\n";

  // The link would have taken megabytes.
  CHECK(link.most_kept() < 64 * 1024);
  std::map<std::string, std::set<int>> got;
  std::vector<int> of_each;
  std::map<std::string, std::uint64_t> numbers;
  for (const Watcher::Message& m : watcher.messages) {
    const int value = std::stoi(m.payload);
    if (m.topic == "r/arm/each") of_each.push_back(value);
    else CHECK(got[m.topic].insert(value).second);
    CHECK(m.property("seq") == std::to_string(++numbers[m.topic]));
    CHECK(m.property("time").size() > 20);
  }
  std::uint64_t missing = 0;
  for (const auto& [topic, values] : got) missing += static_cast<std::uint64_t>(last) + 1 - values.size();
  REQUIRE(got.size() == value_count);
  CHECK(missing > 100);
  CHECK(robot.bridge->counters().left_out == missing);
  REQUIRE(of_each.size() == static_cast<std::size_t>(last_each) + 1);
  CHECK(std::is_sorted(of_each.begin(), of_each.end()));
}

TEST_CASE("a link that hangs fills no memory, and the newest value arrives when it works again", "[mqtt][newest]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  SlowLink::Options slow;
  slow.to = broker.port();
  slow.bytes_per_second = 1'000'000;
  slow.delay = milliseconds(0);
  slow.stall_every = milliseconds(0);
  SlowLink link(slow);
  Watcher watcher(broker.port());
  watcher.connect();
  watcher.subscribe("r/arm/v0", 2);
  Robot robot(link.port(), 0);
  robot.until(watcher, [&] { return watcher.payload("r/arm/v0") == "0"; });
  link.hang(true);
  int last = 0;
  std::uint64_t before = 1;
  // Until a round of values passes nothing on.
  while (before != robot.bridge->counters().published) {
    before = robot.bridge->counters().published;
    for (int i = 0; i < 200; ++i) {
      for (auto& value : robot.values) value.publish(++last);
      robot.turn(watcher);
    }
    REQUIRE(last < 10'000'000);
  }
  CHECK(link.most_kept() < 2 * 256 * 1024);
  robot.until(watcher, [&] { return robot.bridge->counters().lag > milliseconds(100); });
  link.hang(false);
  robot.values[0].publish(++last);
  robot.until(watcher, [&] { return watcher.payload("r/arm/v0") == std::to_string(last); });
  robot.until(watcher, [&] { return robot.bridge->counters().lag < milliseconds(100); });
}

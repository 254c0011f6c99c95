// SPDX-License-Identifier: Apache-2.0
// A robot whose broker is behind a slow link, or hangs.
//
//   mqtt_slow_link newest [--properties N] [--rate HZ] [--seconds N] [--bytes N] [--delay MS] [--stall MS]
//       Age of the newest value at a receiver, for QoS 0, 1 and 2: the link passes N bytes on in a second, with a delay in each direction, and stops for so long
//       in each ten seconds. What was left out, by the bridge's counter and as the receiver counts it.
//   mqtt_slow_link lateness [--rate HZ] [--seconds N]
//       How late a control loop of 1 kHz is without a bridge, and beside one whose broker works, hangs, is gone, or floods it with commands.

#include <signal.h>
#include <time.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/lrt.hpp>
#include <lrt/mqtt.hpp>

#include "tests/mqtt/broker.hpp"
#include "tests/mqtt/slow_link.hpp"

namespace {

using Steady = std::chrono::steady_clock;
using std::chrono::milliseconds;

struct Settings {
  unsigned properties = 10, rate_hz = 1'000, seconds = 60, bytes = 20'000, delay_ms = 100, stall_ms = 500;
};

struct Robot {
  Robot(const Settings& settings, std::optional<std::uint16_t> port, int qos, bool commands = false) {
    lrt::Options options;
    options.listen.port = 0;
    options.listen.public_base = "http://robot.example";
    server.emplace(lrt::Server::create(options).value());
    lrt::Thing base{"base"};
    for (unsigned i = 0; i < settings.properties; ++i) values.push_back(base.property<int>("p" + std::to_string(i), lrt::unit::radian));
    base.property("speed", [this] { return speed; }).on_write([this](double value) { speed = value; });
    server->add(std::move(base)).value();
    for (auto& value : values) value.publish(0);
    if (!port) return;
    lrt::mqtt::Options mqtt;
    mqtt.broker.port = *port;
    mqtt.prefix = "robots/r0";
    mqtt.publications.resize(1);
    mqtt.publications[0].paths = "/base/p*";
    mqtt.publications[0].qos = qos;
    mqtt.publications[0].minimum_interval = milliseconds(0);
    mqtt.commands.enabled = mqtt.commands.allow_unprotected = commands;
    bridge.emplace(lrt::mqtt::Bridge::create(*server, mqtt).value());
    bridge->start().value();
  }
  std::optional<lrt::Server> server;
  std::vector<lrt::PushedProperty<int>> values;
  double speed = 0;
  std::optional<lrt::mqtt::Bridge> bridge;
};

double seconds_of(Steady::duration d) { return std::chrono::duration<double>(d).count(); }

/// The value at a part of a sorted list.
double part_of(std::vector<double>& all, double part) {
  if (all.empty()) return 0;
  std::sort(all.begin(), all.end());
  return all[std::min(all.size() - 1, static_cast<std::size_t>(part * static_cast<double>(all.size())))];
}

int newest(const Settings& settings) {
  std::printf("%u B/s, %u ms in each direction, %u ms of 10 s without anything; %u properties at %u Hz, %u s\n%5s %12s %12s %12s %14s %14s %14s\n",
              settings.bytes, settings.delay_ms, settings.stall_ms, settings.properties, settings.rate_hz, settings.seconds, "QoS", "median s",
              "99 % s", "worst s", "received", "left out", "missing there");
  for (const int qos : {0, 1, 2}) {
    lrt::test::Mosquitto broker;
    lrt::test::SlowLink::Options slow;
    slow.to = broker.port();
    slow.bytes_per_second = settings.bytes;
    slow.delay = milliseconds(settings.delay_ms);
    slow.stall = milliseconds(settings.stall_ms);
    if (settings.stall_ms == 0) slow.stall_every = milliseconds(0);
    lrt::test::SlowLink link(slow);
    lrt::test::Watcher watcher(broker.port());
    watcher.connect();
    watcher.subscribe("robots/r0/base/+", 2);
    Robot robot(settings, link.port(), qos);
    std::vector<std::set<int>> got(settings.properties);
    std::vector<Steady::time_point> made = {Steady::now()};
    std::vector<double> ages;
    std::size_t messages = 0;
    const auto take = [&] {
      robot.server->poll();
      watcher.step(0);
      for (; !watcher.messages.empty(); watcher.messages.pop_front(), ++messages) {
        const lrt::test::Watcher::Message& m = watcher.messages.front();
        const auto number = static_cast<std::size_t>(std::atoi(m.topic.c_str() + m.topic.rfind('p') + 1));
        if (number < got.size()) got[number].insert(std::atoi(m.payload.c_str()));
      }
    };
    const auto have_all = [&](int value) {
      return std::all_of(got.begin(), got.end(), [&](const std::set<int>& of) { return !of.empty() && *of.rbegin() == value; });
    };
    while (!have_all(0)) take();
    const Steady::time_point begin = Steady::now();
    int last = 0;
    while (Steady::now() - begin < std::chrono::seconds(settings.seconds)) {
      ++last;
      made.push_back(Steady::now());
      for (auto& value : robot.values) value.publish(last);
      for (const auto next = made.back() + std::chrono::microseconds(1'000'000 / settings.rate_hz); Steady::now() < next;) take();
      for (const std::set<int>& of : got) ages.push_back(seconds_of(Steady::now() - made[static_cast<std::size_t>(*of.rbegin())]));
    }
    ++last;
    for (auto& value : robot.values) value.publish(last);
    while (!have_all(last)) take();
    std::uint64_t missing = 0;
    for (const std::set<int>& of : got) missing += static_cast<std::uint64_t>(last) + 1 - of.size();
    const double median = part_of(ages, 0.5), most = part_of(ages, 0.99);
    std::printf("%5d %12.3f %12.3f %12.3f %14zu %14llu %14llu\n", qos, median, most, ages.back(), messages,
                static_cast<unsigned long long>(robot.bridge->counters().left_out), static_cast<unsigned long long>(missing));
    std::fflush(stdout);
  }
  return 0;
}

/// How late the periods of a control loop begin.
std::vector<double> run_loop(Robot& robot, const Settings& settings) {
  std::vector<double> late;
  const auto period = std::chrono::microseconds(1'000'000 / settings.rate_hz);
  auto next = Steady::now();
  const auto end = next + std::chrono::seconds(settings.seconds);
  for (int i = 1; next < end; ++i) {
    for (auto& value : robot.values) value.publish(i);
    robot.server->poll();
    next += period;
    std::this_thread::sleep_until(next);
    late.push_back(seconds_of(Steady::now() - next) * 1e6);
  }
  return late;
}

int lateness(const Settings& settings) {
  std::printf("control loop at %u Hz, %u properties, %u s each\n%24s %12s %12s %12s\n", settings.rate_hz, settings.properties, settings.seconds,
              "broker", "median us", "99.9 % us", "worst us");
  const auto show = [](const char* name, std::vector<double> late) {
    const double median = part_of(late, 0.5), most = part_of(late, 0.999);
    std::printf("%24s %12.0f %12.0f %12.0f\n", name, median, most, late.back());
    std::fflush(stdout);
  };
  {
    Robot robot(settings, std::nullopt, 0);
    show("(no bridge)", run_loop(robot, settings));
  }
  lrt::test::Mosquitto broker;
  lrt::test::SlowLink::Options fast;
  fast.to = broker.port();
  fast.bytes_per_second = 100e6;
  fast.delay = fast.stall_every = milliseconds(0);
  {
    Robot robot(settings, broker.port(), 1);
    show("works", run_loop(robot, settings));
  }
  {
    lrt::test::SlowLink link(fast);
    Robot robot(settings, link.port(), 1);
    while (robot.bridge->counters().published < 100) {
      for (auto& value : robot.values) value.publish(std::rand());
      robot.server->poll();
    }
    link.hang(true);
    show("hangs", run_loop(robot, settings));
  }
  {
    Robot robot(settings, lrt::test::free_port(), 1);
    show("is gone", run_loop(robot, settings));
  }
  {
    Robot robot(settings, broker.port(), 0, true);
    std::atomic<bool> ends{false};
    std::thread flood([&] {
      lrt::test::Watcher sender(broker.port());
      sender.connect();
      while (!ends) {
        for (int i = 0; i < 50; ++i) sender.publish("robots/r0/ns/put/base/speed", "0.5", {}, 0);
        sender.step(0);
      }
    });
    show("floods with commands", run_loop(robot, settings));
    ends = true;
    flood.join();
    std::printf("%24s %llu commands\n", "", static_cast<unsigned long long>(robot.bridge->counters().commands));
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Settings settings;
  const std::string_view what = argc > 1 ? argv[1] : "";
  for (int i = 2; i + 1 < argc; i += 2) {
    const std::string_view name = argv[i];
    const auto value = static_cast<unsigned>(std::strtoul(argv[i + 1], nullptr, 10));
    if (name == "--properties") settings.properties = std::max(1U, value);
    else if (name == "--rate") settings.rate_hz = std::clamp(value, 1U, 1'000'000U);
    else if (name == "--seconds") settings.seconds = std::max(1U, value);
    else if (name == "--bytes") settings.bytes = std::max(1U, value);
    else if (name == "--delay") settings.delay_ms = value;
    else if (name == "--stall") settings.stall_ms = value;
    else return std::fprintf(stderr, "mqtt_slow_link: unknown option %s\n", argv[i]), 2;
  }
  if (!lrt::test::has_mosquitto()) return 77;
  if (what == "newest") return newest(settings);
  if (what == "lateness") return lateness(settings);
  std::fprintf(stderr, "usage: mqtt_slow_link newest|lateness [OPTION VALUE]...\n");
  return 2;
}

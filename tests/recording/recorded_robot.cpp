// SPDX-License-Identifier: Apache-2.0
// A robot whose values are counted, for recording_test.py: arm/wave is published by commands on standard input, arm/goal and arm/hand/goal can be
// written, and what is written is printed.
//
//   recorded_robot PORT
//
//   burst N       publishes N values of the wave, one each millisecond; the first of its 32 numbers counts them. Value i has the time begin + i ms, by the
//                 clock of this robot. Then prints "published TOTAL"
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/server.hpp>
#include <lrt/thing.hpp>

int main(int argc, char** argv) {
  using Utc = std::chrono::system_clock::time_point;
  lrt::Options options;
  options.listen.port = static_cast<std::uint16_t>(argc > 1 ? std::atoi(argv[1]) : 0);
  lrt::Result<lrt::Server> made = lrt::Server::create(std::move(options));
  if (!made) {
    std::cerr << made.error().message << "\n";
    return 1;
  }
  lrt::Server& server = *made;
  double goal = 0, other = 0;
  lrt::Thing arm("arm"), hand("arm/hand");
  auto wave = arm.property<std::vector<double>>("wave");
  const auto say = [](const char* name, double value) {
    std::printf("%s %g\n", name, value);
    std::fflush(stdout);
  };
  arm.property(
         "goal", [&] { return goal; }, lrt::unit::radian)
      .on_write([&](double value) { say("goal", goal = value); });
  hand.property(
          "goal", [&] { return other; }, lrt::unit::radian)
      .on_write([&](double value) { say("other", other = value); });
  for (lrt::Thing* const thing : {&arm, &hand})
    if (lrt::Result<void> added = server.add(std::move(*thing)); !added) {
      std::cerr << added.error().message << "\n";
      return 1;
    }
  const Utc begin = std::chrono::system_clock::now();
  std::uint64_t count = 0;
  const auto publish = [&] {
    std::vector<double> values(32, 0.123456789);
    values.front() = static_cast<double>(count);
    wave.publish(values, begin + std::chrono::milliseconds(count));
    ++count;
  };
  publish();
  std::printf("%s\n", server.url().c_str());
  std::fflush(stdout);

  std::thread loop([&] { server.run(); });
  std::string command;
  std::uint64_t n = 0;
  while (std::cin >> command >> n) {
    auto due = std::chrono::steady_clock::now();
    for (std::uint64_t i = 0; i < n; ++i) {
      std::this_thread::sleep_until(due += std::chrono::milliseconds(1));
      publish();
    }
    std::printf("published %llu\n", static_cast<unsigned long long>(count));
    std::fflush(stdout);
  }
  server.stop();
  loop.join();
  return 0;
}

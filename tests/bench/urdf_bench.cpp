// SPDX-License-Identifier: Apache-2.0
// What a robot of a URDF costs: reading its description, the memory of its Things, and publish() of all joints and link poses at 1 kHz on
// the control thread, with its allocations.
//
//   urdf_bench FILE...      a file's `${namespace}` is taken as empty

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include <lrt/lrt.hpp>
#include <lrt/urdf.hpp>

#include "tests/support/allocations.hpp"

namespace {

using Clock = std::chrono::steady_clock;

double microseconds(Clock::duration d) { return std::chrono::duration<double, std::micro>(d).count(); }

/// [KiB]
long resident() {
  long pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return resident * (::sysconf(_SC_PAGESIZE) / 1024);
}

}  // namespace

int main(int argc, char** argv) {
  lrt::urdf::ParseOptions options;
  options.arguments["namespace"] = "";
  for (int i = 1; i < argc; ++i) {
    std::vector<double> load;
    for (int n = 0; n < 20; ++n) {
      const auto start = Clock::now();
      if (!lrt::urdf::load(argv[i], options)) return std::fprintf(stderr, "%s\n", lrt::urdf::load(argv[i], options).error().message.c_str()), 1;
      load.push_back(microseconds(Clock::now() - start));
    }
    std::sort(load.begin(), load.end());

    lrt::Options server_options;
    server_options.listen.port = 0;
    lrt::Server server = lrt::Server::create(server_options).value();
    const long before = resident();
    auto robot = lrt::urdf::load(argv[i], options).value();
    const std::size_t links = robot.model().links.size(), joints = robot.model().joints.size(), variables = robot.model().variables.size();
    const auto start = Clock::now();
    robot.add_to(server).value();
    const double add = microseconds(Clock::now() - start);
    std::printf("%s: %zu links, %zu joints, %zu to move; loaded in %.1f ms, added in %.1f ms, %ld KiB\n", argv[i], links, joints, variables,
                load[load.size() / 2] / 1000, add / 1000, resident() - before);

    std::vector<double> positions(variables), velocities(variables), efforts(variables), took;
    took.reserve(5000);
    auto next = Clock::now();
    std::size_t allocations = 0;
    for (int step = 0; step < 5000; ++step) {
      for (std::size_t v = 0; v < variables; ++v) {
        const double phase = 0.001 * step + static_cast<double>(v);
        positions[v] = 0.3 * std::sin(phase);
        velocities[v] = 0.3 * std::cos(phase);
        efforts[v] = positions[v] * 10;
      }
      const std::size_t had = lrt::test::allocations;
      const auto begun = Clock::now();
      robot.publish(positions, velocities, efforts);
      took.push_back(microseconds(Clock::now() - begun));
      allocations += lrt::test::allocations - had;
      std::this_thread::sleep_until(next += std::chrono::milliseconds(1));
    }
    std::sort(took.begin(), took.end());
    std::printf("  publish at 1 kHz: median %.1f us, 99 %% %.1f us, max %.1f us, %zu allocations in %zu steps\n", took[took.size() / 2],
                took[took.size() * 99 / 100], took.back(), allocations, took.size());
    server.stop();
  }
}

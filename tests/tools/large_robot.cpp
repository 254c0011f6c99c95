// SPDX-License-Identifier: Apache-2.0
// A robot with many properties.
//
//   large_robot THINGS PROPERTIES
//
// THINGS      how many Things: cell/joint0, ...
// PROPERTIES  of each: p0, ..., numbers that can be written; and an action `turn`

#include <poll.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>

#include <lrt/lrt.hpp>

namespace {
volatile std::sig_atomic_t interrupted = 0;
}

int main(int argc, char** argv) {
  if (argc != 3) return std::fputs("usage: large_robot THINGS PROPERTIES\n", stderr), 2;
  const int things = std::atoi(argv[1]), properties = std::atoi(argv[2]);
  lrt::Options options;
  options.listen.port = 0;
  auto created = lrt::Server::create(std::move(options));
  if (!created) return std::fprintf(stderr, "large_robot: %s\n", created.error().message.c_str()), 1;
  lrt::Server server = *std::move(created);
  for (int i = 0; i < things; ++i) {
    lrt::Thing joint{"cell/joint" + std::to_string(i)};
    for (int k = 0; k < properties; ++k) joint.property<double>("p" + std::to_string(k), lrt::unit::radian).on_write([](double) {}).publish(0.25 * k);
    joint.action("turn", [](double) {});
    if (auto added = server.add(std::move(joint)); !added) return std::fprintf(stderr, "large_robot: %s\n", added.error().message.c_str()), 1;
  }
  std::signal(SIGTERM, [](int) { interrupted = 1; });
  std::signal(SIGINT, [](int) { interrupted = 1; });
  std::printf("large_robot serves at %s\n", server.url().c_str());
  std::fflush(stdout);
  while (interrupted == 0) {
    const auto idle = server.poll();
    pollfd work{server.descriptor(), POLLIN, 0};
    ::poll(&work, 1, static_cast<int>(std::min<std::chrono::milliseconds::rep>(idle.count(), 50)));
  }
  return 0;
}

// SPDX-License-Identifier: Apache-2.0
// The server under tests/bench/http_load: one pushed property, optionally among many things and published at 1 kHz.
//
//   pushed_server [--things 1] [--publish] [--period 1000 (us) | --irregular] [--keep N] [--tick] [--in-poll] [--urgent]
//                 [--transport http|libwebsockets] [--tls DIR] [--tokens FILE] [--policy FILE]
//
// The property is at /arm/joint/angle. An irregular source publishes after 1 to 40 ms, in steps that repeat in each run. Ends on SIGINT or SIGTERM and prints its resident memory.

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>
#include <string>
#include <thread>

#include <lrt/lrt.hpp>

#include "tests/bench/transport_option.hpp"

namespace {
volatile std::sig_atomic_t ended = 0;
}

int main(int argc, char** argv) {
  std::size_t things = 1;
  bool publish = false, irregular = false, tick = false, urgent = false;
  std::size_t keep = 0;
  long period = 1000;
  lrt::Options options;
  options.security.clients.requests_per_second = 0;  // a client with a token sends more than its share
  for (int i = 1; i < argc; ++i) {
    const std::string arg = argv[i];
    if (arg == "--things" && i + 1 < argc) things = static_cast<std::size_t>(std::atol(argv[++i]));
    else if (arg == "--publish") publish = true;
    else if (arg == "--period" && i + 1 < argc) period = std::atol(argv[++i]);
    else if (arg == "--irregular") irregular = true;
    else if (arg == "--keep" && i + 1 < argc) keep = static_cast<std::size_t>(std::atol(argv[++i]));
    else if (arg == "--tick") tick = true;
    else if (arg == "--in-poll") options.threads.io = lrt::Io::in_poll;
    else if (arg == "--urgent") urgent = true;
    else if (arg == "--tokens" && i + 1 < argc) options.security.token_file = argv[++i];
    else if (arg == "--policy" && i + 1 < argc) options.security.policy_file = argv[++i];
    else if (arg == "--transport" && i + 1 < argc) bench::use_transport(argv[++i], options);
    else if (arg == "--tls" && i + 1 < argc) bench::use_tls(argv[++i], options);
    else
      return std::fprintf(stderr,
                          "usage: pushed_server [--things N] [--publish] [--period US | --irregular] [--keep N] [--tick] [--in-poll] [--urgent] "
                          "[--transport NAME] "
                          "[--tls DIR] [--tokens FILE] [--policy FILE]\n"),
             2;
  }
  std::signal(SIGINT, [](int) { ended = 1; });
  std::signal(SIGTERM, [](int) { ended = 1; });

  options.listen.port = 0;
  options.limits.max_connections = 4096;
  options.subscriptions.max_subscriptions = 4096;
  options.subscriptions.always_scan = tick;
  auto server = lrt::Server::create(std::move(options));
  if (!server) return std::fprintf(stderr, "%s\n", server.error().message.c_str()), 1;
  lrt::Thing joint{"arm/joint"};
  auto angle = joint.property<double>("angle", lrt::unit::radian);
  if (keep > 0) angle.keep(keep);
  if (urgent) angle.urgent();
  angle.publish(0.5);
  server->add(std::move(joint)).value();
  for (std::size_t i = 1; i < things; ++i) {
    lrt::Thing thing{"thing" + std::to_string(i)};
    thing.property<double>("angle", lrt::unit::radian).publish(static_cast<double>(i));
    server->add(std::move(thing)).value();
  }
  std::printf("listening on %s\n", server->url().c_str());
  std::fflush(stdout);

  double t = 0;
  std::minstd_rand steps;
  auto next = std::chrono::steady_clock::now();
  while (!ended) {
    if (publish) angle.publish(t += 0.001);
    server->poll(std::chrono::microseconds(200));
    if (irregular) period = static_cast<long>(1000 + steps() % 39'000);
    next += std::chrono::microseconds(publish ? period : 50'000);
    std::this_thread::sleep_until(next);
  }
  server->stop();
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.compare(0, 6, "VmRSS:") == 0) std::printf("%s\n", line.c_str());
}

// SPDX-License-Identifier: Apache-2.0
// A robot for tests of caches: it counts how often it is read.
//
//   aged_robot [--port 0] [--public-base URL] [--token TOKEN] [--age SECONDS] [--more SECONDS]
//
// /arm/battery may be SECONDS old, and while a cache asks again --more besides; /arm/angle states no age; /arm/reads is how often /arm/battery was read.
// With --token, reading needs this bearer token.

#include <poll.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstdint>
#include <string>

#include <lrt/server.hpp>
#include <lrt/thing.hpp>

namespace {

std::atomic<bool> ended{false};
lrt::Server* running = nullptr;

void on_signal(int) {
  ended = true;
  if (running) running->wake();
}

}  // namespace

int main(int argc, char** argv) {
  lrt::Options options;
  options.listen.port = 0;
  std::string token;
  double age = 1, more = 0;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string name = argv[i];
    if (name == "--port") options.listen.port = static_cast<std::uint16_t>(std::atoi(argv[i + 1]));
    else if (name == "--public-base") options.listen.public_base = argv[i + 1];
    else if (name == "--token") token = argv[i + 1];
    else if (name == "--age") age = std::atof(argv[i + 1]);
    else if (name == "--more") more = std::atof(argv[i + 1]);
  }
  if (!token.empty()) {
    options.security.authorize = [expected = "Bearer " + token](const lrt::http::Request& request) {
      return request.find("Authorization") == expected ? lrt::engine::Access::granted : lrt::engine::Access::unauthenticated;
    };
  }
  const auto milliseconds = [](double seconds) { return std::chrono::milliseconds(static_cast<std::int64_t>(seconds * 1000)); };
  std::int64_t reads = 0;
  double angle = 0;
  lrt::Thing arm{"arm"};
  // A cache asks with the entity tag: the value is read, and most often it is the same.
  arm.property("battery", [&reads] { return ++reads, 0.5; }).max_age(milliseconds(age), milliseconds(more));
  arm.property("angle", [&angle] { return angle; }).on_write([&angle](double value) { angle = value; });
  arm.property("reads", [&reads] { return reads; });
  lrt::Result<lrt::Server> server = lrt::Server::create(std::move(options));
  if (!server) return std::fprintf(stderr, "%s\n", server.error().message.c_str()), 1;
  if (lrt::Result<void> added = server->add(std::move(arm)); !added) return std::fprintf(stderr, "%s\n", added.error().message.c_str()), 1;
  running = &*server;
  std::signal(SIGTERM, on_signal);
  std::signal(SIGINT, on_signal);
  std::printf("listening on %s\n", server->url().c_str());
  std::fflush(stdout);
  while (!ended) {
    const std::chrono::milliseconds pause = std::min(server->poll(), std::chrono::milliseconds(1'000));
    pollfd event{server->descriptor(), POLLIN, 0};
    ::poll(&event, 1, static_cast<int>(pause.count()));
  }
}

// SPDX-License-Identifier: Apache-2.0
// A robot whose values are one of several alternatives, for tests that run programs. With --turn its target is another one at each reading.
#include <chrono>
#include <csignal>
#include <cstdio>
#include <string>
#include <thread>

#include <lrt/lrt.hpp>

#include "tests/support/mover.hpp"

namespace {
volatile std::sig_atomic_t ended = 0;
}

int main(int argc, char** argv) {
  lrt::Options options;
  options.listen.port = 0;
  lrt::Server server = lrt::Server::create(std::move(options)).value();
  lrt::test::Mover mover;
  mover.turns = argc > 1 && std::string(argv[1]) == "--turn";
  server.add(mover.thing()).value();
  std::signal(SIGTERM, [](int) { ended = 1; });
  std::signal(SIGINT, [](int) { ended = 1; });
  std::printf("%s\n", server.url().c_str());
  std::fflush(stdout);
  while (!ended) {
    server.poll();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  server.stop();
}

// SPDX-License-Identifier: Apache-2.0
// A joint on a custom transport: epoll_transport.cpp implements the HTTP server for lrt on an epoll loop.
//
//   ex_own_transport [--port N]
//
//   $ curl http://127.0.0.1:8080/baxter/right_s1/rotation
//   $ curl --data-binary '@command.ttl' -H 'Content-Type: text/turtle' http://127.0.0.1:8080/baxter/right_s1/actions/rotate
//
// where command.ttl is:  <> <http://vocab.arvida.de/2015/06/vom/vocab#numericalValue> 0.75 .

#include <charconv>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <string_view>
#include <thread>

#include <lrt/lrt.hpp>

#include "examples/ex_own_transport/epoll_transport.hpp"

namespace {

volatile std::sig_atomic_t interrupted = 0;

}  // namespace

int main(int argc, char** argv) {
  lrt::Options options;
  options.listen.transport = make_epoll_transport;
  if (argc == 3 && argv[1] == std::string_view("--port")) {
    const std::string_view text = argv[2];
    const auto [read_to, error] = std::from_chars(text.data(), text.data() + text.size(), options.listen.port);
    if (error != std::errc() || read_to != text.data() + text.size()) return std::fprintf(stderr, "--port wants 0 to 65535\n"), 2;
  } else if (argc != 1) {
    return std::fprintf(stderr, "usage: ex_own_transport [--port N]\n"), 2;
  }

  double angle = 0.5, target = 0.5;  // [rad], owned by this thread
  lrt::Thing joint{"baxter/right_s1"};
  joint.property(
      "rotation", [&] { return angle; }, lrt::unit::radian);
  joint.action("rotate", [&](double to) { target = to; });

  auto server = lrt::Server::create(std::move(options));
  if (!server) return std::fprintf(stderr, "%s\n", server.error().message.c_str()), 1;
  server->add(std::move(joint)).value();
  std::signal(SIGINT, [](int) { interrupted = 1; });
  std::signal(SIGTERM, [](int) { interrupted = 1; });
  std::printf("a joint is at %sbaxter/right_s1 (Ctrl-C ends)\n", server->url().c_str());
  std::fflush(stdout);

  for (auto next = std::chrono::steady_clock::now(); !interrupted; std::this_thread::sleep_until(next)) {
    angle += (target - angle) / 100;
    server->poll();
    next += std::chrono::milliseconds(1);
  }
  server->stop();
}

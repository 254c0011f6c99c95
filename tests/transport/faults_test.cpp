// SPDX-License-Identifier: Apache-2.0
#include <lrt/transport/named.hpp>

#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/wait.h>

#include <csignal>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <thread>

#include "tests/support/catch.hpp"
#include "tests/support/skip.hpp"
#include "tests/transport/harness.hpp"

// What the world around a transport may do to it; what clients may do is in port_test.cpp, tls_test.cpp and websocket_test.cpp.

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;

namespace {

transport::TransportOptions options_on(std::uint16_t port) {
  transport::TransportOptions options;
  options.port = port;
  options.limits.stop_timeout = milliseconds(200);
  return options;
}

bool serves(transport::Transport& server, RawClient& client, std::size_t answers, int polls = 20'000) {
  for (int i = 0; i < polls && !client.ended; ++i) {
    client.step();
    const auto got = parse_answers(client.received);
    if (got.size() >= answers && got[answers - 1].complete) return true;
    server.poll(milliseconds(1), milliseconds(1));
  }
  return false;
}

/// Sets the loopback interface up or down.
bool set_loopback(bool up) {
  const int s = ::socket(AF_INET, SOCK_DGRAM, 0);
  ifreq request{};
  std::strcpy(request.ifr_name, "lo");
  bool done = ::ioctl(s, SIOCGIFFLAGS, &request) == 0;
  if (up) request.ifr_flags = static_cast<short>(request.ifr_flags | IFF_UP);
  else request.ifr_flags = static_cast<short>(request.ifr_flags & ~IFF_UP);
  done = done && ::ioctl(s, SIOCSIFFLAGS, &request) == 0;
  ::close(s);
  return done;
}

enum Outcome { good = 0, no_namespace = 77, not_served, not_alive, not_again };

/// In a process of its own with a network of its own.
int lose_the_interface() {
  if (::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0 && ::unshare(CLONE_NEWNET) != 0) return no_namespace;
  if (!set_loopback(true)) return no_namespace;
  TestHandler handler;
  const auto server = make_network(options_on(0));
  if (!server->start(handler)) return not_served;
  RawClient early(server->port()), deaf(server->port());
  early.send(get("/"));
  deaf.paused = true;
  deaf.send(get("/big?20000000"));
  deaf.step();
  if (!serves(*server, early, 1)) return not_served;
  set_loopback(false);
  early.send(get("/"));
  for (int i = 0; i < 200; ++i) {
    early.step();
    server->poll(milliseconds(1), milliseconds(1));
  }
  if (!set_loopback(true)) return no_namespace;
  RawClient late(server->port());
  late.send(get("/"));
  return serves(*server, late, 1) ? good : not_again;
}

}  // namespace

TEST_CASE("a client that breaks off does not end the process by SIGPIPE, and the host's way with that signal stays", "[transport]") {
  struct sigaction before {
  }, after{};
  struct sigaction standard {};
  standard.sa_handler = SIG_DFL;
  ::sigaction(SIGPIPE, &standard, &before);
  {
    TestHandler handler;
    const auto server = make_network(options_on(0));
    REQUIRE(server->start(handler));
    for (int i = 0; i < 20; ++i) {
      RawClient client(server->port(), "127.0.0.1", 4096);
      client.paused = true;
      client.send(get("/big?2000000") + get("/"));
      client.step();
      for (int turn = 0; turn < 5; ++turn) server->poll(milliseconds(1), milliseconds(1));
      if (i % 2 == 0) client.reset();
      else client.close();
      for (int turn = 0; turn < 5; ++turn) server->poll(milliseconds(1), milliseconds(1));
    }
    RawClient client(server->port());
    client.send(get("/"));
    CHECK(serves(*server, client, 1));
    CHECK(handler.requests >= 21);
    server->stop();
  }
  ::sigaction(SIGPIPE, &before, &after);
  CHECK(after.sa_handler == SIG_DFL);
}

TEST_CASE("a robot that is started again listens on its port at once", "[transport]") {
  TestHandler handler;
  std::uint16_t port = 0;
  for (int life = 0; life < 3; ++life) {
    auto server = make_network(options_on(port));
    REQUIRE(server->start(handler));
    port = server->port();
    RawClient closed(port), open(port);
    closed.send(get("/", "Connection: close\r\n"));  // the server closes first: its end stays in TIME_WAIT
    open.send(get("/"));
    CHECK(serves(*server, closed, 1));
    CHECK(serves(*server, open, 1));
    if (life == 1) server->stop();  // or is destroyed as it is
    server.reset();
  }
  CHECK(handler.requests == 6);
}

TEST_CASE("the network may go away and come back", "[transport]") {
  std::fflush(nullptr);
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    int outcome = not_alive;
    try {
      outcome = lose_the_interface();
    } catch (const std::exception& e) { std::fprintf(stderr, "%s\n", e.what()); }
    std::_Exit(outcome);
  }
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  REQUIRE(WIFEXITED(status));
  if (WEXITSTATUS(status) == no_namespace) {
    print_skip("this system gives no network namespace");
    return;
  }
  CHECK(WEXITSTATUS(status) == good);
}

// What clients leave behind in memory. The bytes in use are those of the allocator (mallinfo2): resident memory also has what the allocator
// keeps for later.

#include <lrt/server.hpp>

#include <malloc.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/sample_robot.hpp"
#include "tests/support/socket.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

std::size_t bytes_in_use() {
  if (is_sanitized) return 0;  // their allocators do not count here
  return ::mallinfo2().uordblks + ::mallinfo2().hblkhd;
}

}  // namespace

TEST_CASE("the memory of subscribers with queues is free when they have left", "[server]") {
  Options options;
  options.listen.port = 0;
  SampleRobot robot;
  Server server = Server::create(std::move(options)).value();
  server.add(robot.arm()).value();
  double angle = 0;
  const auto publish = [&](int count) {
    for (int i = 0; i < count; ++i) {
      robot.angle_handle->publish(angle += 0.001);
      server.poll();
      std::this_thread::yield();
    }
  };
  const std::string subscribe =
      "GET /arm/angle?queueLength=256\nHost: 127.0.0.1:" + std::to_string(server.port()) +
      "\nConnection: Upgrade\nUpgrade: websocket\nSec-WebSocket-Version: 13\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==";
  std::size_t with_clients = 0;
  const auto come_and_go = [&] {
    std::vector<std::unique_ptr<Socket>> clients;
    for (int i = 0; i < 200; ++i) {
      clients.push_back(std::make_unique<Socket>(server.port()));
      REQUIRE(clients.back()->ask(subscribe).status == 101);
    }
    publish(500);
    with_clients = bytes_in_use();
  };
  come_and_go();  // what the first alone makes stays: tables, and the ring of the property
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  const auto comes_true = [&](auto condition) {
    while (!condition() && std::chrono::steady_clock::now() < until) publish(1);
    return condition();
  };
  Socket watcher(server.port());
  const auto all_left = [&] {
    return watcher
               .ask("GET /arm/subscriptions\nAccept: application/n-triples\nHost: 127.0.0.1:" + std::to_string(server.port()),
                    [&] { server.poll(); })
               .body.find("ldp#contains") == std::string::npos;
  };
  REQUIRE(comes_true(all_left));
  const std::size_t before = bytes_in_use();
  for (int round = 0; round < 3; ++round) {
    come_and_go();
    REQUIRE(comes_true(all_left));
    const bool is_free = comes_true([&] { return bytes_in_use() <= before + (with_clients - before) / 10; });
    std::printf("200 subscribers with queues: %zu bytes in use before, %zu with them, %zu afterwards\n", before, with_clients,
                bytes_in_use());
    CHECK(is_free);
  }
}

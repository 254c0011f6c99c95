// SPDX-License-Identifier: Apache-2.0
// What clients leave behind in memory. The bytes in use are those of the allocator (mallinfo2): resident memory also has what the allocator
// keeps for later.

#include <lrt/server.hpp>

#include <arpa/inet.h>
#include <malloc.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/sample_robot.hpp"
#include "tests/support/skip.hpp"
#include "tests/support/socket.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

std::size_t bytes_in_use() {
  if (is_sanitized) return 0;  // their allocators do not count here
  return ::mallinfo2().uordblks + ::mallinfo2().hblkhd;
}

/// A connection without a buffer of its own.
class BareClient {
 public:
  explicit BareClient(std::uint16_t port) : descriptor_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    REQUIRE(::connect(descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  }
  BareClient(BareClient&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  ~BareClient() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }

  /// Returns the status. What follows it is not read.
  template <class Meanwhile>
  int ask(const http::Request& request, Meanwhile meanwhile) {
    std::string bytes = std::string(request.method) + " " + std::string(request.target) + " HTTP/1.1\r\n";
    for (const http::Field& field : request.fields) bytes += std::string(field.name) + ": " + std::string(field.value) + "\r\n";
    bytes += "\r\n";
    REQUIRE(::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size()));
    char status[12];
    for (int i = 0; i < 100'000; ++i) {
      meanwhile();
      if (::recv(descriptor_, status, sizeof status, MSG_PEEK | MSG_DONTWAIT) == sizeof status) return std::stoi(std::string(status + 9, 3));
    }
    return 0;
  }

 private:
  int descriptor_;
};

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
  const std::string subscribe = "GET /arm/angle?queueLength=256\nHost: 127.0.0.1:" + std::to_string(server.port()) +
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
               .ask("GET /arm/subscriptions\nAccept: application/n-triples\nHost: 127.0.0.1:" + std::to_string(server.port()), [&] { server.poll(); })
               .body.find("ldp#contains") == std::string::npos;
  };
  REQUIRE(comes_true(all_left));
  const std::size_t before = bytes_in_use();
  for (int round = 0; round < 3; ++round) {
    come_and_go();
    REQUIRE(comes_true(all_left));
    const bool is_free = comes_true([&] { return bytes_in_use() <= before + (with_clients - before) / 10; });
    std::printf("200 subscribers with queues: %zu bytes in use before, %zu with them, %zu afterwards\n", before, with_clients, bytes_in_use());
    CHECK(is_free);
  }
}

TEST_CASE("an idle connection needs at most half a KiB, a WebSocket two, and nothing is left of them", "[server]") {
  if (is_sanitized) return print_skip("the allocators of sanitizers do not count here");
  Options options;
  options.listen.port = 0;
  options.threads.io = Io::in_poll;
  SampleRobot robot;
  Server server = Server::create(std::move(options)).value();
  server.add(robot.arm()).value();
  robot.angle_handle->publish(1.0);
  const std::string get = "GET /arm/angle\nHost: 127.0.0.1:" + std::to_string(server.port()),
                    subscribe =
                        get + "\nConnection: Upgrade\nUpgrade: websocket\nSec-WebSocket-Version: 13\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==";
  constexpr std::size_t count = 500;
  const auto poll = [&] { server.poll(); };
  Socket watcher(server.port());
  const auto all_left = [&] {
    const auto answer = watcher.ask("GET /arm/subscriptions\nAccept: application/n-triples\nHost: 127.0.0.1:" + std::to_string(server.port()), poll);
    return answer.body.find("ldp#contains") == std::string::npos;
  };
  for (const auto& [request, status, max_bytes] : {std::tuple(get, 200, std::size_t{512}), std::tuple(subscribe, 101, std::size_t{2048})}) {
    INFO(request);
    std::size_t with_clients = 0, before = 0;
    // What the first round makes stays: tables. A busy machine makes some later. What clients leave would be there after each round.
    const auto has_grown = [&] { return bytes_in_use() > before + 1024; };
    for (int round = 0; round < 2 || (round < 6 && has_grown()); ++round) {
      before = bytes_in_use();
      {
        std::vector<BareClient> clients;
        clients.reserve(count);
        for (std::size_t i = 0; i < count; ++i) REQUIRE(clients.emplace_back(server.port()).ask(RequestText(request).get(), poll) == status);
        for (int i = 0; i < 20; ++i) poll();
        with_clients = bytes_in_use() - clients.capacity() * sizeof(BareClient);
      }
      for (int i = 0; i < 1000 && !all_left(); ++i) poll();
      for (int i = 0; i < 20; ++i) poll();
    }
    const std::size_t afterwards = bytes_in_use();
    std::printf("%zu clients: %zu bytes in use before, %zu with them (%zu each), %zu afterwards\n", count, before, with_clients,
                (with_clients - before) / count, afterwards);
    CHECK((with_clients - before) / count <= max_bytes);
    CHECK(afterwards <= before + 1024);
  }
}

// SPDX-License-Identifier: Apache-2.0
// What a process that the host starts inherits of a server: nothing.

#include <lrt/server.hpp>

#include <chrono>
#include <filesystem>
#include <string>

#include <lrt/transport/named.hpp>

#include "tests/support/callback.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/descriptors.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/sample_robot.hpp"
#include "tests/support/socket.hpp"

using namespace lrt;
using namespace lrt::test;
namespace fs = std::filesystem;

TEST_CASE("every descriptor of a server is close-on-exec while clients, callbacks and files are in use", "[server]") {
  for (const std::string_view name : transport::names())
    for (const Io io : {Io::own_thread, Io::in_poll}) {
      CAPTURE(name, io == Io::in_poll);
      const Folder folder;
      const SilentReceiver receiver;
      const auto before = descriptors(true);
      const std::size_t all_before = descriptors(false).size();
      SampleRobot robot;
      Options options;
      options.listen.port = 0;
      options.security.allowed_hosts = {"localhost:80"};  // the clients'
      options.listen.transport = [name](transport::TransportOptions t) { return transport::make_named(name, std::move(t)); };
      options.threads.io = io;
      options.callbacks.allow = {"127.0.0.1"};
      options.callbacks.file = folder / "subscriptions";
      Server server = Server::create(std::move(options)).value();
      server.add(robot.arm()).value();
      (void)server.descriptor();
      server.start();

      Socket client(server.port()), stream(server.port()), unfinished(server.port());
      const auto at_most = std::chrono::steady_clock::now() + std::chrono::seconds(20);
      CHECK(client.ask(receiver.subscription("angle")).status == 201);
      CHECK(client.ask("GET /arm/angle").status == 200);
      stream.send("GET /arm/angle\nAccept: text/event-stream");
      while (!fs::exists(folder / "subscriptions") && std::chrono::steady_clock::now() < at_most) REQUIRE(client.ask("GET /arm/angle").status == 200);

      const auto now = descriptors(true);
      for (const auto& [number, what] : now) {
        CAPTURE(number, what);
        CHECK(before.count(number) == 1);
      }
      CHECK(descriptors(false).size() >= all_before + 7);  // three clients at both ends, the port
    }
}

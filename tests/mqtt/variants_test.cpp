// SPDX-License-Identifier: Apache-2.0
// Values that are one of several alternatives, at a broker.
#include <lrt/mqtt.hpp>

#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include <lrt/lrt.hpp>

#include "tests/mqtt/broker.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/mover.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

struct Robot {
  explicit Robot(std::uint16_t port) {
    lrt::Options server_options;
    server_options.listen.port = 0;
    server_options.identity.iri = "https://robots.example/r1";
    server.emplace(Server::create(std::move(server_options)).value());
    server->add(mover.thing()).value();
    mqtt::Options options;
    options.broker.port = port;
    options.prefix = "robots/r1";
    options.commands.enabled = true;
    options.commands.allow_unprotected = true;
    options.log = [this](LogLevel, std::string_view message) { log.append(message).append("\n"); };
    bridge.emplace(mqtt::Bridge::create(*server, std::move(options)).value());
  }
  template <class F>
  void until(Watcher& watcher, F condition) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!condition()) {
      if (std::chrono::steady_clock::now() > end) {
        for (const Watcher::Message& m : watcher.messages) UNSCOPED_INFO(m.topic << " " << m.payload);
        UNSCOPED_INFO(log);
        FAIL("it did not come true in thirty seconds");
      }
      server->poll();
      bridge->poll();
      watcher.step();
    }
  }
  Watcher::Message command(Watcher& watcher, const std::string& topic, const std::string& payload) {
    Watcher::Properties properties;
    properties.response_topic = "replies/c1";
    properties.correlation = "n" + std::to_string(++commands);
    watcher.publish("robots/r1/ns/" + topic, payload, properties);
    until(watcher, [&] { return !watcher.messages.empty() && watcher.messages.back().correlation == properties.correlation; });
    return watcher.messages.back();
  }

  Mover mover;
  std::optional<Server> server;
  std::optional<mqtt::Bridge> bridge;
  int commands = 0;
  std::string log;
};

}  // namespace

TEST_CASE("a variant is published as its one alternative, and written and invoked by commands", "[mqtt]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  Watcher watcher(broker.port());
  watcher.connect();
  watcher.subscribe("robots/r1/mover/#");
  watcher.subscribe("robots/r1/ns/status");
  watcher.subscribe("replies/c1");
  Robot robot(broker.port());
  const std::string topic = "robots/r1/mover/target";
  robot.until(watcher, [&] {
    return watcher.payload(topic) == R"({"moveTo":{"x":1,"y":2}})" && watcher.payload("robots/r1/mover/limit") == R"({"text":"soft"})" &&
           watcher.payload("robots/r1/ns/status").find("\"online\":true") != std::string::npos;
  });
  for (const char* value : {R"({"grip":"closed"})", R"({"height":0.5})", R"({"hold":{}})"}) {
    CAPTURE(value);
    CHECK(robot.command(watcher, "put/mover/target", value).property("status") == "204");
    robot.until(watcher, [&] { return watcher.payload(topic) == value; });
  }
  CHECK(std::holds_alternative<std::monostate>(robot.mover.target));
  for (const char* wrong : {R"({"grip":"open","hold":{}})", "{}", R"({"grab":"open"})", "\"grip\""}) {
    CAPTURE(wrong);
    const Watcher::Message refused = robot.command(watcher, "put/mover/target", wrong);
    CHECK(refused.property("status") == "422");
    CHECK(refused.content_type == "application/problem+json");
    if (std::string(wrong).find("hold") != std::string::npos) {
      CHECK_THAT(refused.payload, Catch::Matchers::ContainsSubstring("grip"));
      CHECK_THAT(refused.payload, Catch::Matchers::ContainsSubstring("hold"));
    }
  }
  CHECK(std::holds_alternative<std::monostate>(robot.mover.target));
  const Watcher::Message went = robot.command(watcher, "post/mover/actions/go", R"({"moveTo":{"x":2.5,"y":0}})");
  CHECK(went.property("status").substr(0, 1) == "2");
  REQUIRE(robot.mover.went.size() == 1);
  CHECK(std::get<MoveTo>(robot.mover.went.front()).x == 2.5);
  CHECK(went.payload == R"({"number":2.5})");
}

// SPDX-License-Identifier: Apache-2.0
// Commands from a broker.
#include <lrt/mqtt.hpp>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <sys/stat.h>

#include <lrt/lrt.hpp>

#include "tests/mqtt/broker.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/frozen_link.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

const std::string operator_token = "operator-0123456789abcdef", reader_token = "reader-0123456789abcdef";

struct Arm {
  explicit Arm(std::uint16_t port, const std::function<void(mqtt::Options&)>& change = {},
               const std::function<void(lrt::Options&)>& change_server = {}) {
    const std::string file = folder / "tokens";
    std::ofstream(file) << "alice operator " << operator_token << "\nbob reader " << reader_token << "\n";
    ::chmod(file.c_str(), 0600);
    lrt::Options server_options;
    server_options.listen.port = 0;
    server_options.security.token_file = file;
    server_options.identity.iri = "https://robots.example/r1";
    if (change_server) change_server(server_options);
    server.emplace(Server::create(std::move(server_options)).value());
    Thing arm{"arm"};
    arm.property("speed", [this] { return speed; }).on_write([this](double value) -> Result<void> {
      if (value > 10) return refused("too fast");
      speed = value;
      return {};
    });
    arm.action("turn", [this](double target, Responder done) {
      turned = target;
      if (target < 0) kept.emplace(std::move(done));
      else std::move(done).succeed();
    });
    server->add(std::move(arm)).value();
    mqtt::Options options;
    options.broker.port = port;
    options.prefix = "robots/r1";
    options.commands.enabled = true;
    options.commands.max_payload_bytes = 1'000;
    options.commands.max_user_properties = 4;
    options.commands.max_property_bytes = 200;
    options.log = [this](LogLevel, std::string_view message) { log.append(message).append("\n"); };
    if (change) change(options);
    bridge.emplace(mqtt::Bridge::create(*server, std::move(options)).value());
  }
  template <class F>
  void until(Watcher& client, F condition) {
    const auto end = std::chrono::steady_clock::now() + seconds(30);
    while (!condition()) {
      if (std::chrono::steady_clock::now() > end) {
        for (const Watcher::Message& m : client.messages) UNSCOPED_INFO(m.topic << " " << m.property("status") << " " << m.payload);
        UNSCOPED_INFO(log);
        FAIL("it did not come true in thirty seconds");
      }
      server->poll();
      bridge->poll();
      client.step();
    }
  }
  /// Sends a command and waits for its response.
  Watcher::Message command(Watcher& client, const std::string& topic, const std::string& payload, Watcher::Properties properties = {}) {
    properties.response_topic = "replies/c1";
    properties.correlation = "n" + std::to_string(++commands);
    client.publish("robots/r1/ns/" + topic, payload, properties);
    until(client, [&] { return !client.messages.empty() && client.messages.back().correlation == properties.correlation; });
    return client.messages.back();
  }

  const Folder folder;
  std::optional<Server> server;
  std::optional<mqtt::Bridge> bridge;
  std::optional<Responder> kept;
  double speed = 2, turned = 0;
  int commands = 0;
  std::string log;
};

Watcher::Properties with_token(const std::string& token) {
  Watcher::Properties p;
  p.user.emplace_back("token", token);
  return p;
}

/// A client that the robot's commands are ready for.
struct Client {
  Client(Mosquitto& broker, Arm& arm) : watcher(broker.port()) {
    watcher.connect();
    watcher.subscribe("replies/c1");
    watcher.subscribe("robots/r1/ns/status");
    arm.until(watcher, [&] { return watcher.payload("robots/r1/ns/status").find("\"online\":true") != std::string::npos; });
  }
  Watcher watcher;
};

}  // namespace

TEST_CASE("a command writes a property, and the response has status and correlation data", "[mqtt]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  Arm arm(broker.port());
  Client client(broker, arm);
  const Watcher::Message done = arm.command(client.watcher, "put/arm/speed", "3.5", with_token(operator_token));
  CHECK(done.property("status") == "204");
  CHECK(arm.speed == 3.5);
  CHECK(done.has_expiry);

  const Watcher::Message refused = arm.command(client.watcher, "put/arm/speed", "30", with_token(operator_token));
  CHECK(refused.property("status") == "409");
  CHECK(refused.content_type == "application/problem+json");
  CHECK_THAT(refused.payload, Catch::Matchers::ContainsSubstring("too fast"));
  const Watcher::Message invalid = arm.command(client.watcher, "put/arm/speed", "\"fast\"", with_token(operator_token));
  CHECK(invalid.property("status").substr(0, 1) == "4");
  CHECK(arm.command(client.watcher, "put/arm/nothing", "1", with_token(operator_token)).property("status") == "404");
  Watcher::Properties turtle = with_token(operator_token);
  turtle.content_type = "image/png";
  CHECK(arm.command(client.watcher, "put/arm/speed", "1", turtle).property("status") == "415");
  CHECK(arm.speed == 3.5);
}

TEST_CASE("a command invokes an action, and another cancels it", "[mqtt]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  Arm arm(broker.port());
  Client client(broker, arm);
  Watcher::Properties now = with_token(operator_token);
  now.user.emplace_back("prefer", "respond-async");
  const Watcher::Message made = arm.command(client.watcher, "post/arm/actions/turn", "-1", now);
  CHECK(made.property("status") == "202");
  const std::string location = made.property("location");
  REQUIRE_FALSE(location.empty());
  arm.until(client.watcher, [&] { return arm.kept.has_value(); });
  const std::string path = location.substr(location.find("/arm/"));
  CHECK(arm.command(client.watcher, "delete" + path, "", with_token(operator_token)).property("status").substr(0, 1) == "2");
  CHECK(arm.kept->cancelled());
}

TEST_CASE("a command has the rights of its token and no others", "[mqtt]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  Arm arm(broker.port());
  Client client(broker, arm);
  CHECK(arm.command(client.watcher, "put/arm/speed", "3").property("status") == "401");
  CHECK(arm.command(client.watcher, "put/arm/speed", "3", with_token("wrong")).property("status") == "401");
  CHECK(arm.command(client.watcher, "put/arm/speed", "3", with_token(reader_token)).property("status") == "403");
  CHECK(arm.speed == 2);
}

TEST_CASE("a token can stand for all who may publish to a broker", "[mqtt]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  Arm arm(broker.port(), [](mqtt::Options& o) { o.commands.token = operator_token; });
  Client client(broker, arm);
  CHECK(arm.command(client.watcher, "put/arm/speed", "3").property("status") == "204");
  CHECK(arm.command(client.watcher, "put/arm/speed", "4", with_token(reader_token)).property("status") == "403");
  CHECK(arm.speed == 3);
}

TEST_CASE("hostile commands neither move nor end a robot", "[mqtt]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  Arm arm(broker.port(), [](mqtt::Options& o) { o.commands.token = operator_token; });
  Client client(broker, arm);
  const auto dropped = [&](const std::string& topic, const std::string& payload, const Watcher::Properties& properties) {
    const std::uint64_t before = arm.bridge->counters().dropped_commands;
    client.watcher.publish(topic, payload, properties);
    arm.until(client.watcher, [&] { return arm.bridge->counters().dropped_commands > before; });
  };
  // Topics.
  dropped("robots/r1/ns/put", "1", {});
  dropped("robots/r1/ns/put/", "1", {});
  dropped("robots/r1/ns/put/" + std::string(3'000, 'a'), "1", {});
  CHECK(arm.command(client.watcher, "put/../../arm/speed", "1").property("status") == "404");
  CHECK(arm.command(client.watcher, "put/%", "1").property("status") == "404");
  CHECK(arm.command(client.watcher, "put/%00", "1").property("status") == "404");
  CHECK(arm.command(client.watcher, "put//arm//speed", "1").property("status") == "404");
  CHECK(arm.command(client.watcher, "put/http://other.example/arm/speed", "1").property("status") == "404");
  CHECK(arm.command(client.watcher, "put/arm/speed HTTP/1.1", "1").property("status").substr(0, 1) == "4");
  // Response topics: of this robot, of another one's commands, with wildcards.
  for (const char* to : {"robots/r1/arm/speed", "robots/r1/ns/status", "robots/r2/ns/put/arm/speed", "ns/post/x/ns/put", "$SYS/x"}) {
    Watcher::Properties p;
    p.response_topic = to;
    dropped("robots/r1/ns/put/arm/speed", "9", p);
  }
  // And those that are not in Commands::response_topics.
  for (const char* to : {"clients/c1", "replies", "x/replies/c1", "homeassistant/switch/door/set"}) {
    Watcher::Properties p;
    p.response_topic = to;
    dropped("robots/r1/ns/put/arm/speed", "9", p);
  }
  // What a robot has sent is no command.
  Watcher::Properties reply;
  reply.user.emplace_back("response-of", "robots/r2");
  dropped("robots/r1/ns/put/arm/speed", "9", reply);
  // What the broker has kept.
  Watcher::Properties retained;
  retained.retain = true;
  client.watcher.publish("robots/r1/ns/put/arm/speed", "", retained);
  // Sizes.
  CHECK(arm.command(client.watcher, "put/arm/speed", std::string(1'001, '1')).property("status") == "413");
  Watcher::Properties many, longer, twice, broken, typed;
  for (int i = 0; i < 5; ++i) many.user.emplace_back("x", "y");
  longer.user.emplace_back("x", std::string(201, 'y'));
  twice.user = {{"token", operator_token}, {"token", reader_token}};
  broken.user.emplace_back("token", "a b\xC3\xA4");
  typed.content_type = "application/json\xC3\xA4";
  for (const Watcher::Properties& p : {many, longer, twice, broken, typed})
    CHECK(arm.command(client.watcher, "put/arm/speed", "9", p).property("status") == "400");
  Watcher::Properties correlated;
  correlated.correlation = std::string(2'000, 'c');
  dropped("robots/r1/ns/put/arm/speed", "9", correlated);
  CHECK(arm.speed == 2);
  CHECK(arm.command(client.watcher, "put/arm/speed", "1").property("status") == "204");
}

TEST_CASE("retained commands are not carried out", "[mqtt]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  Watcher sender(broker.port());
  sender.connect();
  sender.subscribe("robots/#");
  Watcher::Properties retained;
  retained.retain = true;
  sender.publish("robots/r1/ns/put/arm/speed", "9", retained);
  const auto end = std::chrono::steady_clock::now() + seconds(20);
  while (sender.messages.empty() && std::chrono::steady_clock::now() < end) sender.step(10);
  REQUIRE_FALSE(sender.messages.empty());
  Arm arm(broker.port(), [](mqtt::Options& o) { o.commands.token = operator_token; });
  Client client(broker, arm);
  CHECK(arm.command(client.watcher, "put/arm/speed", "1").property("status") == "204");
  CHECK(arm.bridge->counters().commands == 1);
}

TEST_CASE("a command that a frozen link to the broker delays is not carried out, and its sender is told", "[mqtt][expiry]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  FrozenLink link(broker.port());
  FakeClock clock;
  Arm arm(
      link.port(), [](mqtt::Options& o) { o.commands.token = operator_token; }, [&](lrt::Options& o) { o.clock = &clock; });
  Client client(broker, arm);
  client.watcher.subscribe("robots/r1/ns/time");
  arm.until(client.watcher, [&] { return client.watcher.newest("robots/r1/ns/time").has_value(); });
  const std::string time = client.watcher.payload("robots/r1/ns/time");
  const std::size_t slash = time.find('/');
  const std::string until = time.substr(0, slash + 1) + std::to_string(std::stoull(time.substr(slash + 1)) + 1'000);
  Watcher::Properties by_user;
  by_user.response_topic = "replies/c1";
  by_user.user.emplace_back("valid-until", until);
  Watcher::Properties by_payload;
  by_payload.response_topic = "replies/c1";
  link.freeze_to_client();
  client.watcher.publish("robots/r1/ns/put/arm/speed", "5", by_user);
  client.watcher.publish("robots/r1/ns/put/arm/speed", "{\"validUntil\":\"" + until + "\",\"value\":6}", by_payload);
  clock.advance(seconds(12));
  link.thaw();
  const auto late = [](const Watcher::Message& m) { return m.property("status") == "412"; };
  arm.until(client.watcher, [&] { return std::count_if(client.watcher.messages.begin(), client.watcher.messages.end(), late) == 2; });
  CHECK(arm.speed == 2);
  CHECK(arm.command(client.watcher, "put/arm/speed", "3").property("status") == "204");
  CHECK(arm.speed == 3);
}

TEST_CASE("too many commands at once get 503", "[mqtt]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  Arm arm(broker.port(), [](mqtt::Options& o) {
    o.commands.token = operator_token;
    o.commands.max_waiting = 2;
  });
  Client client(broker, arm);
  Watcher::Properties p;
  p.response_topic = "replies/c1";
  for (int i = 0; i < 5; ++i) client.watcher.publish("robots/r1/ns/put/arm/speed", "1", p);
  const auto end = std::chrono::steady_clock::now() + seconds(20);
  std::size_t refused = 0;
  while (refused < 3 && std::chrono::steady_clock::now() < end) {  // the server is not polled
    arm.bridge->poll();
    client.watcher.step();
    refused = static_cast<std::size_t>(
        std::count_if(client.watcher.messages.begin(), client.watcher.messages.end(), [](const auto& m) { return m.property("status") == "503"; }));
  }
  CHECK(refused == 3);
}

TEST_CASE("the topics to which responses go are an option", "[mqtt]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  Arm arm(broker.port(), [](mqtt::Options& o) { o.commands.response_topics = {"*/in", "cells/**"}; });
  Client client(broker, arm);
  client.watcher.subscribe("hmi/in");
  Watcher::Properties p = with_token(operator_token);
  p.response_topic = "replies/c1";
  client.watcher.publish("robots/r1/ns/put/arm/speed", "9", p);
  arm.until(client.watcher, [&] { return arm.bridge->counters().dropped_commands == 1; });
  p.response_topic = "hmi/in";
  client.watcher.publish("robots/r1/ns/put/arm/speed", "3", p);
  arm.until(client.watcher, [&] { return client.watcher.newest("hmi/in").has_value(); });
  CHECK(client.watcher.newest("hmi/in")->property("status") == "204");
  CHECK(arm.speed == 3);
}

TEST_CASE("commands without a token have one limit together", "[mqtt][security]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  Arm arm(broker.port(), {}, [](lrt::Options& o) {
    o.security.clients.requests_per_second = 1;
    o.security.clients.burst = seconds(1);
    o.security.anyone = security::Right::read | security::Right::write;
  });
  Client client(broker, arm);
  std::vector<std::string> statuses;
  for (int i = 0; i < 5; ++i) statuses.push_back(arm.command(client.watcher, "put/arm/speed", "3").property("status"));
  CHECK(std::count(statuses.begin(), statuses.end(), "429") > 0);
  CHECK(arm.command(client.watcher, "put/arm/speed", "4", with_token(operator_token)).property("status") == "204");
}

TEST_CASE("a client of the broker takes control, and commands with its id", "[mqtt]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  Arm arm(
      broker.port(), [](mqtt::Options& o) { o.commands.allow_unprotected = true; }, [](lrt::Options& o) { o.security.token_file.clear(); });
  double drive = 0;
  Thing base{"base"};
  base.control();
  base.property("drive", [&] { return drive; }).on_write([&](double value) { drive = value; });
  arm.server->add(std::move(base)).value();
  Client client(broker, arm);
  client.watcher.subscribe("robots/r1/base/control");
  const auto taken = arm.command(client.watcher, "post/base/control", "");
  CHECK(taken.property("status") == "200");
  const std::string id = taken.property("control-id");
  CHECK(id.size() == 32);
  arm.until(client.watcher, [&] { return client.watcher.payload("robots/r1/base/control").find("\"held\":true") != std::string::npos; });
  CHECK(client.watcher.payload("robots/r1/base/control").find(id) == std::string::npos);
  const auto refused = arm.command(client.watcher, "put/base/drive", "0.5");
  CHECK(refused.property("status") == "409");
  CHECK(refused.payload.find("ControlledByAnother") != std::string::npos);
  Watcher::Properties with_id;
  with_id.user.emplace_back("control-id", id);
  CHECK(arm.command(client.watcher, "put/base/drive", "0.5", with_id).property("status") == "204");
  CHECK(drive == 0.5);
  CHECK(arm.command(client.watcher, "delete/base/control", "", with_id).property("status") == "204");
  CHECK(arm.command(client.watcher, "put/base/drive", "0.6").property("status") == "204");
}

TEST_CASE("commands that nothing restricts are refused when the bridge is made", "[mqtt]") {
  lrt::Options server_options;
  server_options.identity.iri = "https://robots.example/r1";
  server_options.listen.port = 0;
  Server server = Server::create(std::move(server_options)).value();
  mqtt::Options options;
  options.prefix = "robots/r1";
  options.commands.enabled = true;
  const auto made = mqtt::Bridge::create(server, options);
  REQUIRE_FALSE(made);
  CHECK(made.error().code == Errc::insecure_address);
  options.commands.allow_unprotected = true;
  CHECK(mqtt::Bridge::create(server, options));
}

TEST_CASE("options that cannot work are refused", "[mqtt]") {
  lrt::Options server_options;
  server_options.identity.iri = "https://robots.example/r1";
  server_options.listen.port = 0;
  Server server = Server::create(std::move(server_options)).value();
  const auto error_of = [&](const std::function<void(mqtt::Options&)>& change) {
    mqtt::Options options;
    options.prefix = "robots/r1";
    change(options);
    const auto made = mqtt::Bridge::create(server, options);
    return made ? std::string() : made.error().message;
  };
  CHECK(error_of([](mqtt::Options&) {}).empty());
  for (const char* prefix : {"/r1", "r1/", "a//b", "a/+/b", "a/#", "$SYS/r1", "a\nb", "a\xFF"})
    CHECK_THAT(error_of([&](mqtt::Options& o) { o.prefix = prefix; }), Catch::Matchers::ContainsSubstring("prefix"));
  CHECK_THAT(error_of([](mqtt::Options& o) { o.publications[0].qos = 3; }), Catch::Matchers::ContainsSubstring("qos"));
  CHECK_THAT(error_of([](mqtt::Options& o) { o.broker.keep_alive = seconds(1); }), Catch::Matchers::ContainsSubstring("keep_alive"));
  CHECK_THAT(error_of([](mqtt::Options& o) { o.broker.host = ""; }), Catch::Matchers::ContainsSubstring("host"));
  CHECK_THAT(error_of([](mqtt::Options& o) { o.commands.response_topics = {""}; }), Catch::Matchers::ContainsSubstring("response_topics"));
  CHECK_THAT(error_of([](mqtt::Options& o) { o.commands.token = "a b"; }), Catch::Matchers::ContainsSubstring("token"));
  CHECK_THAT(error_of([](mqtt::Options& o) { o.broker.tls.emplace().ca_file = "/nonexistent"; }), Catch::Matchers::ContainsSubstring("tls"));
}

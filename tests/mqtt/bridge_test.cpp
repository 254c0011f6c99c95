// SPDX-License-Identifier: Apache-2.0
// A server, its bridge, a Mosquitto and clients of it.
#include <lrt/mqtt.hpp>

#include <signal.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/lrt.hpp>
#include <lrt/served.hpp>

#include "tests/mqtt/broker.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/message.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

/// A robot with its bridge, driven by one thread.
struct Robot {
  explicit Robot(std::uint16_t port, const std::function<void(mqtt::Options&)>& change = {}, lrt::Options server_options = {},
                 Io io = Io::own_thread) {
    server_options.listen.port = 0;
    server_options.threads.io = io;
    server_options.identity.iri = "https://robots.example/r1";
    server.emplace(Server::create(std::move(server_options)).value());
    Thing arm{"arm"};
    angle = arm.property<double>("angle");
    arm.property("speed", [this] { return speed; }).on_write([this](double value) { speed = value; });
    arm.action("turn", [this](double target, Responder done) {
      turned = target;
      if (target > 100) std::move(done).fail("too far");
      else std::move(done).succeed();
    });
    server->add(std::move(arm)).value();
    angle.publish(1.5);
    mqtt::Options options;
    options.broker.port = port;
    options.broker.first_pause = milliseconds(20);
    options.broker.max_pause = milliseconds(50);
    options.prefix = "robots/r1";
    options.log = [this](LogLevel, std::string_view message) { log.append(message).append("\n"); };
    if (change) change(options);
    bridge.emplace(mqtt::Bridge::create(*server, std::move(options)).value());
  }
  template <class F>
  void until(Watcher& watcher, F condition) {
    const auto end = std::chrono::steady_clock::now() + seconds(30);
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
  std::string get(const std::string& path, const std::string& accept) {
    RequestText request("GET " + path + "\nHost: localhost:" + std::to_string(server->port()) + "\nAccept: " + accept);
    const Served served = server->serve(request.get());
    return std::string(served.response.content());
  }

  std::optional<Server> server;
  std::optional<mqtt::Bridge> bridge;
  PushedProperty<double> angle;
  double speed = 2, turned = 0;
  std::string log;
};

}  // namespace

TEST_CASE("a bridge publishes properties, a birth message and a JSON object for each Thing", "[mqtt]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  Watcher watcher(broker.port());
  watcher.connect();
  watcher.subscribe("robots/#");
  Robot robot(broker.port(), {}, {}, GENERATE(Io::own_thread, Io::in_poll));
  robot.until(watcher, [&] {
    return watcher.payload("robots/r1/arm/angle") == "1.5" && watcher.newest("robots/r1/arm/speed") && watcher.newest("robots/r1/ns/things/arm") &&
           watcher.newest("robots/r1/ns/description");
  });
  const auto angle = *watcher.newest("robots/r1/arm/angle");
  CHECK(angle.content_type == "application/json");
  CHECK(angle.property("seq") == "1");
  CHECK(angle.property("time").find('T') == 10);
  CHECK(angle.property("datatype") == "http://www.w3.org/2001/XMLSchema#double");
  CHECK(angle.is_utf8);
  CHECK_FALSE(watcher.newest("robots/r1/arm/state"));  // it would repeat the Properties
  const std::string thing = watcher.payload("robots/r1/ns/things/arm");
  CHECK_THAT(thing, Catch::Matchers::ContainsSubstring("\"topic\":\"robots/r1/arm/angle\"") &&
                        Catch::Matchers::ContainsSubstring("\"topic\":\"robots/r1/ns/status\""));
  CHECK(watcher.payload("robots/r1/arm/speed") == "2");
  CHECK_THAT(watcher.payload("robots/r1/ns/status"), Catch::Matchers::ContainsSubstring("\"online\":true"));
  CHECK_THAT(watcher.payload("robots/r1/ns/description"), Catch::Matchers::ContainsSubstring("RoboticThing"));
  CHECK(watcher.newest("robots/r1/ns/description")->content_type.substr(0, 11) == "text/turtle");

  robot.angle.publish(2.5);
  robot.until(watcher, [&] { return watcher.payload("robots/r1/arm/angle") == "2.5"; });
  CHECK(watcher.newest("robots/r1/arm/angle")->property("seq") == "2");

  // Who comes later gets what the broker keeps.
  Watcher late(broker.port());
  late.connect();
  late.subscribe("robots/r1/arm/angle");
  robot.until(late, [&] { return late.payload("robots/r1/arm/angle") == "2.5"; });
  CHECK(late.newest("robots/r1/arm/angle")->retained);
}

TEST_CASE("a resource and its subscription say in RDF where they are published", "[mqtt]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  Watcher watcher(broker.port());
  watcher.connect();
  watcher.subscribe("robots/#");
  Robot robot(broker.port(), [](mqtt::Options& o) { o.broker.public_url = "mqtts://broker.example:8883"; });
  robot.until(watcher, [&] { return watcher.newest("robots/r1/arm/angle").has_value(); });
  const std::string document = robot.get("/arm/angle", "application/n-triples");
  CHECK_THAT(document, Catch::Matchers::ContainsSubstring("ns#mqttTopic> \"robots/r1/arm/angle\"") &&
                           Catch::Matchers::ContainsSubstring("\"mqtts://broker.example:8883\""));
  // So does the document of all Things.
  robot.until(watcher, [&] { return watcher.payload("robots/r1/ns/description").find("mqttTopic \"robots/r1/arm/angle\"") != std::string::npos; });
  const std::string container = robot.get("/arm/subscriptions", "application/n-triples");
  CHECK_THAT(container, Catch::Matchers::ContainsSubstring("ns#Feed>") && Catch::Matchers::ContainsSubstring("\"robots/r1/arm/angle\""));
  // It goes with the bridge.
  robot.bridge.reset();
  CHECK_THAT(robot.get("/arm/angle", "application/n-triples"), !Catch::Matchers::ContainsSubstring("mqttTopic"));
}

TEST_CASE("publications are chosen by path and kind", "[mqtt][json_ld]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  Watcher watcher(broker.port());
  watcher.connect();
  watcher.subscribe("robots/#");
  Robot robot(broker.port(), [](mqtt::Options& o) {
    mqtt::Publication none, binary, graphs;
    none.paths = "/arm/speed";
    none.publish = false;
    binary.kinds = {mqtt::Kind::property};
    binary.media_type = "application/cbor";
    binary.qos = 2;
    binary.expiry = seconds(60);
    graphs.paths = "/*";
    graphs.kinds = {mqtt::Kind::thing};
    graphs.media_type = "application/ld+json";
    o.publications = {none, binary, graphs};
    o.description.media_type = "application/n-triples";
  });
  robot.until(watcher,
              [&] { return watcher.newest("robots/r1/arm/angle") && watcher.newest("robots/r1/arm") && watcher.newest("robots/r1/ns/description"); });
  CHECK(watcher.newest("robots/r1/arm/angle")->content_type == "application/cbor");
  CHECK(watcher.newest("robots/r1/arm/angle")->has_expiry);
  CHECK(watcher.payload("robots/r1/arm/angle") == std::string("\xFB\x3F\xF8\0\0\0\0\0\0", 9));
  CHECK(watcher.newest("robots/r1/arm")->content_type == "application/ld+json");
  CHECK(watcher.newest("robots/r1/ns/description")->content_type == "application/n-triples");
  CHECK_FALSE(watcher.newest("robots/r1/arm/speed"));
  CHECK_FALSE(watcher.newest("robots/r1/arm/state"));
}

TEST_CASE("things that come and go later are published and forgotten", "[mqtt]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  Watcher watcher(broker.port());
  watcher.connect();
  watcher.subscribe("robots/#");
  Robot robot(broker.port(), [](mqtt::Options& o) { o.description.minimum_interval = milliseconds(1); });
  robot.until(watcher, [&] { return watcher.newest("robots/r1/arm/angle").has_value(); });
  Thing tool{"arm/tool+1"};
  PushedProperty<int> width = tool.property<int>("width");
  REQUIRE(robot.server->add(std::move(tool)));
  width.publish(7);
  robot.until(watcher, [&] { return watcher.payload("robots/r1/arm/tool%2B1/width") == "7"; });
  robot.until(watcher, [&] { return watcher.payload("robots/r1/ns/description").find("tool") != std::string::npos; });
  REQUIRE(robot.server->remove("arm/tool+1"));
  robot.until(watcher, [&] { return watcher.payload("robots/r1/arm/tool%2B1/width").empty(); });
  robot.until(watcher, [&] { return watcher.payload("robots/r1/ns/description").find("tool") == std::string::npos; });
  Watcher late(broker.port());
  late.connect();
  late.subscribe("robots/#");
  robot.until(late, [&] { return late.newest("robots/r1/arm/angle").has_value(); });
  CHECK_FALSE(late.newest("robots/r1/arm/tool%2B1/width"));
}

TEST_CASE("each change of an invocation is published", "[mqtt]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  Watcher watcher(broker.port());
  watcher.connect();
  watcher.subscribe("robots/+/arm/actions/#");
  Robot robot(broker.port());
  Watcher other(broker.port());
  other.connect();
  other.subscribe("robots/r1/arm/angle");
  robot.until(other, [&] { return other.newest("robots/r1/arm/angle").has_value(); });
  RequestText request("POST /arm/actions/turn\nHost: localhost:" + std::to_string(robot.server->port()) +
                      "\nContent-Type: application/json\nPrefer: respond-async\n\n5");
  const Served served = robot.server->serve(request.get());
  CHECK(served.response.status == 202);
  robot.until(watcher, [&] { return !watcher.messages.empty() && watcher.messages.back().payload.find("succeeded") != std::string::npos; });
  CHECK(watcher.messages.back().qos == 1);
  CHECK_FALSE(watcher.messages.back().retained);
  std::uint64_t expected = 0;
  for (const Watcher::Message& m : watcher.messages) CHECK(m.property("seq") == std::to_string(++expected));
}

TEST_CASE("the Last Will tells that a robot is gone, also when it takes leave", "[mqtt]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  Watcher watcher(broker.port());
  watcher.connect();
  watcher.subscribe("robots/r1/ns/status");
  std::optional<Robot> robot(std::in_place, broker.port());
  robot->until(watcher, [&] { return watcher.payload("robots/r1/ns/status").find("\"online\":true") != std::string::npos; });
  robot->bridge.reset();
  const auto end = std::chrono::steady_clock::now() + seconds(20);
  while (watcher.payload("robots/r1/ns/status").find("\"online\":false") == std::string::npos && std::chrono::steady_clock::now() < end)
    watcher.step(10);
  CHECK_THAT(watcher.payload("robots/r1/ns/status"), Catch::Matchers::ContainsSubstring("\"online\":false"));
}

TEST_CASE("when the broker comes back, the newest values come first", "[mqtt]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  std::optional<Watcher> watcher(std::in_place, broker.port());
  watcher->connect();
  watcher->subscribe("robots/#");
  Robot robot(broker.port(), [](mqtt::Options& o) {
    mqtt::Publication each, newest;
    each.paths = "/arm/angle";
    each.queue_length = 50;
    each.qos = 1;
    newest.paths = "/arm/speed";
    newest.minimum_interval = milliseconds(0);
    o.publications = {each, newest};
  });
  robot.until(*watcher, [&] { return watcher->payload("robots/r1/arm/angle") == "1.5" && watcher->newest("robots/r1/arm/speed"); });
  broker.end(SIGKILL);
  watcher.emplace(broker.port());
  while (robot.bridge->counters().online) robot.bridge->poll();
  for (int i = 1; i <= 10; ++i) {
    robot.angle.publish(i);
    for (int turn = 0; turn < 50; ++turn) {
      robot.server->poll();
      robot.bridge->poll();
    }
  }
  REQUIRE(broker.start());
  watcher->connect();
  watcher->subscribe("robots/#");
  robot.until(*watcher, [&] { return watcher->payload("robots/r1/arm/angle") == "10"; });
  std::size_t speed_at = 0, first_angle_at = 0;
  std::vector<std::uint64_t> numbers;
  for (std::size_t i = 0; i < watcher->messages.size(); ++i) {
    const Watcher::Message& m = watcher->messages[i];
    if (m.topic == "robots/r1/arm/speed" && speed_at == 0) speed_at = i + 1;
    if (m.topic != "robots/r1/arm/angle") continue;
    if (first_angle_at == 0) first_angle_at = i + 1;
    numbers.push_back(std::stoull(m.property("seq")));
  }
  CHECK(speed_at != 0);
  CHECK(speed_at < first_angle_at);
  CHECK(std::is_sorted(numbers.begin(), numbers.end()));
  CHECK(robot.bridge->counters().connections == 2);
}

TEST_CASE("nothing of QoS 1 is lost over restarts of the broker", "[mqtt]") {
  if (!has_mosquitto()) return;
  // A broker that keeps what it has taken, and a watcher whose session it keeps.
  Mosquitto broker("allow_anonymous true\npersistence true\nmax_queued_messages 0\nmax_inflight_messages 0\n");
  mosquitto* client = nullptr;
  std::vector<std::uint64_t> numbers;
  struct Session {
    std::vector<std::uint64_t>* numbers;
    bool connected;
  } session{&numbers, false};
  client = ::mosquitto_new("watcher", false, &session);
  ::mosquitto_int_option(client, MOSQ_OPT_PROTOCOL_VERSION, MQTT_PROTOCOL_V311);
  ::mosquitto_connect_callback_set(client, [](mosquitto* m, void* s, int) {
    static_cast<Session*>(s)->connected = true;
    ::mosquitto_subscribe(m, nullptr, "robots/r1/arm/angle", 1);
  });
  ::mosquitto_message_callback_set(client, [](mosquitto*, void* s, const mosquitto_message* m) {
    static_cast<Session*>(s)->numbers->push_back(
        std::stoull(std::string(static_cast<const char*>(m->payload), static_cast<std::size_t>(m->payloadlen))));
  });
  const auto reach = [&] {
    while (::mosquitto_connect(client, "127.0.0.1", broker.port(), 60) != MOSQ_ERR_SUCCESS) {}
    session.connected = false;
    while (!session.connected) ::mosquitto_loop(client, 10, 1);
    for (int i = 0; i < 5; ++i) ::mosquitto_loop(client, 1, 1);
  };
  reach();
  Robot robot(broker.port(), [](mqtt::Options& o) {
    mqtt::Publication each;
    each.paths = "/arm/angle";
    each.queue_length = 1'000;
    each.qos = 1;
    o.publications = {each};
    o.description.publish = false;
  });
  constexpr int count = 600;
  const auto end = std::chrono::steady_clock::now() + seconds(60);
  const auto turn = [&] {
    robot.server->poll();
    robot.bridge->poll();
    if (::mosquitto_loop(client, 0, 1) != MOSQ_ERR_SUCCESS) ::mosquitto_reconnect(client);
  };
  // Each value is taken before the next is published, so that none is superseded on its way into the queue.
  const auto sent = [&] { return robot.server->counters().messages_sent + robot.server->counters().queued_bytes; };
  for (int i = 1; i <= count; ++i) {
    const auto before = sent();
    robot.angle.publish(1'000'000 + i);
    while (sent() == before && std::chrono::steady_clock::now() < end) turn();
    if (i == 200 || i == 400) broker.restart(SIGTERM);
  }
  while ((numbers.empty() || numbers.back() != 1'000'000 + count) && std::chrono::steady_clock::now() < end) turn();
  std::vector<std::uint64_t> all = numbers;
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  all.erase(std::remove_if(all.begin(), all.end(), [](std::uint64_t n) { return n <= 1'000'000; }), all.end());
  UNSCOPED_INFO(robot.log);
  CHECK(all.size() == count);
  CHECK(robot.bridge->counters().connections >= 3);
  ::mosquitto_destroy(client);
}

TEST_CASE("a bridge runs on a thread of its own, and ends while it waits for a broker", "[mqtt][threads]") {
  if (!has_mosquitto()) return;
  std::optional<Mosquitto> broker(std::in_place);
  Watcher watcher(broker->port());
  watcher.connect();
  watcher.subscribe("robots/#");
  Robot robot(broker->port());
  REQUIRE(robot.bridge->start());
  REQUIRE(robot.bridge->start());
  const auto end = std::chrono::steady_clock::now() + seconds(30);
  while (watcher.payload("robots/r1/arm/angle") != "4" && std::chrono::steady_clock::now() < end) {
    robot.server->poll();
    robot.angle.publish(4);
    (void)robot.bridge->counters();
    watcher.step();
  }
  CHECK(watcher.payload("robots/r1/arm/angle") == "4");
  broker.reset();
  while (robot.bridge->counters().online && std::chrono::steady_clock::now() < end) robot.server->poll();
  CHECK_FALSE(robot.bridge->counters().online);
  robot.bridge->stop();
  robot.bridge->stop();
  CHECK(robot.bridge->poll() > milliseconds(0));
  const Result<void> again = robot.bridge->start();
  REQUIRE_FALSE(again);
  CHECK(again.error().code == Errc::closed);
}

TEST_CASE("a client of MQTT 3.1.1 reads time, unit and datatype in the payload", "[mqtt][meaning]") {
  if (!has_mosquitto()) return;
  Mosquitto broker;
  Robot robot(broker.port(), [](mqtt::Options& o) { o.publications.front().form = mqtt::Form::with_meaning; });
  std::string seen;
  mosquitto* const client = ::mosquitto_new(nullptr, true, &seen);
  ::mosquitto_int_option(client, MOSQ_OPT_PROTOCOL_VERSION, MQTT_PROTOCOL_V311);
  ::mosquitto_connect_callback_set(client, [](mosquitto* m, void*, int) { ::mosquitto_subscribe(m, nullptr, "robots/r1/arm/angle", 0); });
  ::mosquitto_message_callback_set(client, [](mosquitto*, void* to, const mosquitto_message* m) {
    *static_cast<std::string*>(to) = std::string(static_cast<const char*>(m->payload), static_cast<std::size_t>(m->payloadlen));
  });
  REQUIRE(::mosquitto_connect(client, "127.0.0.1", broker.port(), 60) == MOSQ_ERR_SUCCESS);
  Watcher watcher(broker.port());
  watcher.connect();
  robot.until(watcher, [&] {
    ::mosquitto_loop(client, 0, 1);
    return !seen.empty();
  });
  ::mosquitto_destroy(client);
  CHECK(seen.find(R"({"value":1.5,"seq":)") == 0);
  CHECK(seen.find(R"("time":"20)") != std::string::npos);
  CHECK(seen.find(R"("datatype":"http://www.w3.org/2001/XMLSchema#double")") != std::string::npos);
}

// SPDX-License-Identifier: Apache-2.0
#include "src/mqtt/metrics.hpp"

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include <lrt/base/metric.hpp>
#include <lrt/lrt.hpp>
#include <lrt/mqtt.hpp>
#include <lrt/served.hpp>
#include <lrt/server_thing.hpp>
#include <lrt/transport/loopback.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/message.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

/// A server with its counters and without a network.
struct Counted {
  Counted() {
    lrt::Options options;
    options.listen.transport = transport::no_network;
    options.identity.iri = "https://robots.example/r1";
    options.threads.dispatch = Dispatch::io_thread;
    server.emplace(Server::create(std::move(options)).value());
    server->add(server_thing(*server)).value();
  }
  std::string text() {
    RequestText request("GET /server/metrics\nHost: localhost:4711");
    request.get().local_port = 4711;
    return std::string(server->serve(request.get()).response.content());
  }
  bool says(const std::string& line) { return text().find("\n" + line + "\n") != std::string::npos; }

  std::optional<Server> server;
};

mqtt::Options to(std::uint16_t port, const std::string& prefix) {
  mqtt::Options options;
  options.broker.port = port;
  options.prefix = prefix;
  return options;
}

}  // namespace

TEST_CASE("the numbers of a bridge are metrics, each with the broker and the prefix", "[mqtt]") {
  mqtt::Counters counters;
  counters.online = true;
  counters.published = 7;
  counters.published_bytes = 70;
  counters.refused = 2;
  counters.taken_over = 3;
  counters.left_out = 4;
  counters.lag = std::chrono::milliseconds(1'500);
  Counted robot;
  const std::string text = prometheus_text(robot.server->counters(), mqtt::metrics_of(counters, "mqtt://b:1883", "robots/r7"));
  const std::string labels = "{broker=\"mqtt://b:1883\",prefix=\"robots/r7\"} ";
  CHECK(text.find("\nlrt_mqtt_online" + labels + "1\n") != std::string::npos);
  CHECK(text.find("\nlrt_mqtt_published_total" + labels + "7\n") != std::string::npos);
  CHECK(text.find("\nlrt_mqtt_published_bytes_total" + labels + "70\n") != std::string::npos);
  CHECK(text.find("\nlrt_mqtt_refused_total" + labels + "2\n") != std::string::npos);
  CHECK(text.find("\nlrt_mqtt_taken_over_total" + labels + "3\n") != std::string::npos);
  CHECK(text.find("\nlrt_mqtt_left_out_total" + labels + "4\n") != std::string::npos);
  CHECK(text.find("\nlrt_mqtt_lag_seconds" + labels + "1.5\n") != std::string::npos);
  CHECK(text.find("\nlrt_metrics_left_out 0\n") != std::string::npos);
}

TEST_CASE("a server shows its bridges as long as they exist", "[mqtt]") {
  Counted robot;
  const std::string first = "lrt_mqtt_online{broker=\"mqtt://127.0.0.1:1883\",prefix=\"robots/r7\"} 0";
  const std::string second = "lrt_mqtt_online{broker=\"mqtt://127.0.0.1:1884\",prefix=\"robots/r7\"} 0";
  {
    mqtt::Bridge bridge = mqtt::Bridge::create(*robot.server, to(1883, "robots/r7")).value();  // it connects when it is started
    CHECK(robot.says(first));
    std::optional<mqtt::Bridge> other = mqtt::Bridge::create(*robot.server, to(1884, "robots/r7")).value();
    CHECK(robot.says(first));
    CHECK(robot.says(second));
    CHECK(robot.says("lrt_metrics_left_out 0"));
    other.reset();
    CHECK_FALSE(robot.says(second));
    const mqtt::Bridge moved = std::move(bridge);
    CHECK(robot.says(first));
  }
  CHECK_FALSE(robot.says(first));
}

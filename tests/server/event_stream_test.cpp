// SPDX-License-Identifier: Apache-2.0
// Event streams end to end: a server, the HTTP transport, a client's socket.

#include <lrt/server.hpp>
#include <lrt/transport/named.hpp>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/event_stream.hpp"
#include "tests/support/message.hpp"
#include "tests/support/socket.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

struct Arm {
  explicit Arm(Options options = {}) {
    options.listen.port = 0;
    options.threads.io = GENERATE(Io::own_thread, Io::in_poll);
    server.emplace(Server::create(std::move(options)).value());
    Thing thing{"arm"};
    angle = thing.property<double>("angle");
    name = thing.property<std::string>("name");
    thing.property("pulled", [this] { return ++reads; });
    server->add(std::move(thing)).value();
    angle->publish(1);
    name->publish("arm");
  }
  template <class F>
  void until(StreamClient& client, F condition) {
    const auto end = std::chrono::steady_clock::now() + seconds(20);
    while (!condition()) {
      if (std::chrono::steady_clock::now() > end) FAIL("it did not come true in twenty seconds");
      server->poll();
      client.step();
    }
  }
  std::vector<Event> events(StreamClient& client, std::size_t count) {
    std::vector<Event> all;
    until(client, [&] {
      for (Event& e : client.take()) all.push_back(std::move(e));
      return all.size() >= count;
    });
    return all;
  }
  Answer ask(const std::string& text) {
    return Socket(server->port()).ask(text + "\nHost: 127.0.0.1:" + std::to_string(server->port()), [this] { server->poll(); });
  }
  std::size_t subscriptions() { return ask("GET /arm/subscriptions").linked("related").size(); }
  std::optional<Server> server;
  std::optional<PushedProperty<double>> angle;
  std::optional<PushedProperty<std::string>> name;
  int reads = 0;
};

}  // namespace

TEST_CASE("an event stream over a socket has the representation of GET, and then each change", "[server][event stream][R0.12]") {
  Arm arm;
  StreamClient client(arm.server->port(), "/arm/angle");
  const Answer got = arm.ask("GET /arm/angle");
  CHECK(arm.events(client, 1) == std::vector<Event>{{got.tag(), got.body}});
  CHECK(client.status == 200);
  CHECK(client.header.find("\r\nContent-Type: text/event-stream\r\n") != std::string::npos);
  arm.angle->publish(2);
  const Answer later = arm.ask("GET /arm/angle");
  CHECK(arm.events(client, 1) == std::vector<Event>{{later.tag(), later.body}});

  StreamClient again(arm.server->port(), "/arm/angle", "Last-Event-ID: " + later.tag() + "\r\n");
  arm.until(again, [&] { return again.status == 200; });
  arm.angle->publish(3);
  CHECK(arm.events(again, 1).at(0).data == arm.ask("GET /arm/angle").body);
}

TEST_CASE("lines of a text arrive as they were", "[server][event stream]") {
  Arm arm;
  arm.name->publish("one\n\n two\n");
  StreamClient client(arm.server->port(), "/arm/name?accept=text/plain");
  CHECK(arm.events(client, 1).at(0).data == "one\n\n two\n");
}

TEST_CASE("an event stream ends with DELETE, and its connection serves on", "[server][event stream][R1.8]") {
  Arm arm;
  StreamClient client(arm.server->port(), "/arm/angle");
  (void)arm.events(client, 1);
  const auto members = arm.ask("GET /arm/subscriptions").linked("related");
  REQUIRE(members.size() == 1);
  CHECK(arm.ask("DELETE " + members[0].substr(arm.server->url().size() - 1)).status == 204);
  arm.until(client, [&] { return client.finished; });
  CHECK_FALSE(client.ended);
  CHECK(arm.subscriptions() == 0);
}

TEST_CASE("a client that closes its event stream is no subscriber any more", "[server][event stream][R1.8]") {
  Arm arm;
  StreamClient client(arm.server->port(), "/arm/angle");
  (void)arm.events(client, 1);
  CHECK(arm.subscriptions() == 1);
  client.close();
  const auto end = std::chrono::steady_clock::now() + seconds(20);
  while (arm.subscriptions() != 0) REQUIRE(std::chrono::steady_clock::now() < end);
}

TEST_CASE("the end of the Thing or of the server ends an event stream", "[server][event stream]") {
  Arm arm;
  StreamClient client(arm.server->port(), "/arm/angle");
  (void)arm.events(client, 1);
  SECTION("the Thing") { arm.server->remove("arm").value(); }
  SECTION("the server") { arm.server->stop(); }
  arm.until(client, [&] { return client.finished; });
}

TEST_CASE("an event stream of a pulled property begins after the read", "[server][event stream][R0.5]") {
  Arm arm;
  StreamClient client(arm.server->port(), "/arm/pulled?accept=application/json");
  CHECK(arm.events(client, 1).at(0).data == "1");
}

TEST_CASE("HTTP/1.0 has event streams that end with the connection", "[server][event stream]") {
  Arm arm;
  StreamClient client(arm.server->port(), "/arm/angle", {}, 0);
  CHECK(arm.events(client, 1).size() == 1);
  CHECK(client.header.find("chunked") == std::string::npos);
  arm.server->remove("arm").value();
  arm.until(client, [&] { return client.ended; });
}

TEST_CASE("no transport opens a WebSocket or event stream for a page of another origin by default", "[server][security]") {
  for (const std::string_view name : transport::names()) {
    CAPTURE(name);
    Options options;
    options.listen.transport = [name](transport::TransportOptions t) { return transport::make_named(name, std::move(t)); };
    Arm arm(std::move(options));
    for (const std::string foreign : {"https://evil.example", "null", "http://127.0.0.1:1"}) {
      CHECK(arm.ask("GET /arm/angle\nAccept: text/event-stream\nOrigin: " + foreign).status == 403);
      const Answer refused = arm.ask(
          "GET /arm/angle\nConnection: Upgrade\nUpgrade: websocket\nSec-WebSocket-Version: 13\n"
          "Sec-WebSocket-Key: AQIDBAUGBwgJCgsMDQ4PEA==\nOrigin: " +
          foreign);
      CHECK(refused.status == 403);
      CHECK(refused.field("X-Content-Type-Options") == "nosniff");
      CHECK(refused.field("Cross-Origin-Resource-Policy") == "same-origin");
    }
    CHECK(arm.ask("GET /arm/angle\nOrigin: https://evil.example").status == 200);  // which its browser does not show the page
    const Answer twice = arm.ask("GET /arm/angle\nHost: another");
    CHECK(twice.status == 400);  // from the transport
    CHECK(twice.field("X-Content-Type-Options") == "nosniff");
    CHECK(twice.field("Cross-Origin-Resource-Policy") == "same-origin");
    CHECK(arm.subscriptions() == 0);
  }
}

TEST_CASE("what cannot be an event stream is refused over a socket as on the engine", "[server][event stream][R0.6]") {
  Options options;
  options.subscriptions.max_subscriptions = 1;
  options.security.allowed_origins = {"https://dashboard.example"};
  Arm arm(std::move(options));
  const auto status = [&](const std::string& text) { return arm.ask(text + "\nAccept: text/event-stream").status; };
  CHECK(status("GET /") == 406);
  CHECK(status("GET /arm/angle?accept=application/cbor") == 406);
  CHECK(status("GET /arm/angle\nOrigin: https://evil.example") == 403);
  CHECK(status("HEAD /arm/angle") == 200);
  CHECK(arm.subscriptions() == 0);
  StreamClient client(arm.server->port(), "/arm/angle", "Origin: https://dashboard.example\r\n");
  (void)arm.events(client, 1);
  CHECK(status("GET /arm/angle") == 503);
}

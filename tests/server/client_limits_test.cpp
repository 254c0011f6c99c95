// SPDX-License-Identifier: Apache-2.0
#include <lrt/server.hpp>

#include <atomic>
#include <fstream>
#include <optional>
#include <string>
#include <utility>

#include <lrt/served.hpp>
#include <lrt/transport/loopback.hpp>
#include <lrt/transport/named.hpp>

#include "src/server/client_limiter.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/message.hpp"
#include "tests/support/sample_robot.hpp"
#include "tests/support/socket.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace std::chrono_literals;

namespace {

const std::string token_of_anna = "anna-0123456789abcdef", token_of_bert = "bert-0123456789abcdef";
const std::string anna = "Authorization: Bearer " + token_of_anna, bert = "Authorization: Bearer " + token_of_bert;
const std::string number = "\nContent-Type: application/json\n\n5";

/// A robot whose clients may send two requests in a second.
struct Limited {
  static security::ClientLimits two_per_second() {
    security::ClientLimits limits;
    limits.requests_per_second = 2;
    limits.burst = 1s;
    return limits;
  }
  explicit Limited(security::ClientLimits limits = two_per_second(), bool with_tokens = false, std::string transport = "") {
    Options options;
    options.listen.port = 0;
    options.listen.transport = transport::no_network;
    if (!transport.empty())
      options.listen.transport = [transport](transport::TransportOptions t) { return transport::make_named(transport, std::move(t)); };
    options.security.clients = limits;
    if (with_tokens) {
      std::ofstream(folder / "tokens") << "anna reader " + token_of_anna + "\nbert operator " + token_of_bert + "\n";
      options.security.token_file = folder / "tokens";
    }
    options.threads.dispatch = Dispatch::io_thread;
    options.clock = &clock;
    options.callbacks.allow = {"127.0.0.1"};
    server.emplace(Server::create(std::move(options)).value());
    Thing arm = robot.arm();
    arm.action("halt", [this] { ++halted; }).stop();
    server->add(std::move(arm)).value();
  }

  http::Response ask(const std::string& text, std::string_view peer = "192.0.2.1", const std::string& fields = "") {
    const std::size_t body = text.find("\n\n");
    RequestText request(text.substr(0, body) + "\nHost: localhost:4711\n" + fields + (body == std::string::npos ? "" : text.substr(body)));
    request.get().local_port = 4711;
    request.get().peer = peer;
    return server->serve(request.get()).response;
  }
  int status(const std::string& text, std::string_view peer = "192.0.2.1", const std::string& fields = "") { return ask(text, peer, fields).status; }
  engine::HeaderVerdict judge(RequestText& request, std::optional<std::uint64_t> body_bytes) {
    request.get().local_port = 4711;
    request.get().peer = "192.0.2.1";
    return server->judge_header(request.get(), body_bytes);
  }

  Folder folder;
  FakeClock clock;
  SampleRobot robot;
  std::atomic<int> halted{0};
  std::optional<Server> server;
};

}  // namespace

TEST_CASE("a client that sends too much gets 429 until its time has come, and others do not", "[server][security][R0.2]") {
  Limited g;
  CHECK(g.status("GET /arm") == 200);
  CHECK(g.status("GET /arm") == 200);
  const Answer refused(g.ask("GET /arm"));
  CHECK(refused.status == 429);
  CHECK(refused.field("Retry-After") == "1");
  CHECK(refused.field("Content-Type") == "application/problem+json");
  CHECK(refused.says("\"status\":429"));
  CHECK(g.status("GET /nothing") == 429);  // what exists makes no difference
  CHECK(g.status("PUT /arm/angle" + number) == 429);
  CHECK(g.robot.angle == 10);
  CHECK(g.status("GET /arm", "192.0.2.2") == 200);
  g.clock.advance(499ms);
  CHECK(g.status("GET /arm") == 429);
  g.clock.advance(1ms);
  CHECK(g.status("GET /arm") == 200);
  CHECK(g.status("GET /arm") == 429);
  g.clock.advance(1h);
  CHECK(g.status("GET /arm") == 200);
  CHECK(g.status("GET /arm") == 200);
  CHECK(g.status("GET /arm") == 429);  // an hour of silence gives no more than `burst`
}

TEST_CASE("the addresses of one /64 network are one client, and this machine is none", "[server][security][R0.2]") {
  Limited g;
  CHECK(g.status("GET /arm", "2001:db8:0:1::1") == 200);
  CHECK(g.status("GET /arm", "2001:db8:0:1:ffff::2") == 200);
  CHECK(g.status("GET /arm", "2001:db8:0:1::3") == 429);
  CHECK(g.status("GET /arm", "2001:db8:0:2::1") == 200);
  CHECK(g.status("GET /arm", "::ffff:192.0.2.9") == 200);
  CHECK(g.status("GET /arm", "192.0.2.9") == 200);
  CHECK(g.status("GET /arm", "::ffff:192.0.2.9") == 429);
  for (const std::string_view local : {"127.0.0.1", "127.8.0.1", "::1", "::ffff:127.0.0.1", ""})
    for (int i = 0; i < 20; ++i) CHECK(g.status("GET /arm", local) == 200);
}

TEST_CASE("a principal is one client wherever it is, and requests without one count for their address", "[server][security][R0.2]") {
  Limited g(Limited::two_per_second(), true);
  CHECK(g.status("GET /arm", "192.0.2.1", anna) == 200);
  CHECK(g.status("GET /arm", "127.0.0.1", anna) == 200);
  CHECK(g.status("GET /arm", "192.0.2.7", anna) == 429);
  CHECK(g.status("GET /arm", "127.0.0.1", anna) == 429);
  CHECK(g.status("GET /arm", "192.0.2.1", bert) == 200);
  // Tokens are tried at the address's rate.
  CHECK(g.status("GET /arm", "192.0.2.1", "Authorization: Bearer unknown-0123456789") == 401);
  CHECK(g.status("GET /arm", "192.0.2.1") == 401);
  CHECK(g.status("GET /arm", "192.0.2.1", "Authorization: Bearer unknown-9876543210") == 429);
  CHECK(g.status("GET /arm", "192.0.2.1", bert) == 200);
}

TEST_CASE("a stop passes all limits of a client, for those who may invoke it", "[server][security][R0.2]") {
  security::ClientLimits limits = Limited::two_per_second();
  limits.max_invocations = 1;
  Limited g(limits, true);
  for (const std::string& token : {anna, bert})
    while (g.status("GET /arm", "192.0.2.1", token) == 200) {}
  CHECK(g.status("POST /arm/actions/home", "192.0.2.1", bert) == 429);
  CHECK(g.robot.homed == 0);
  for (int i = 1; i < 20; ++i) {
    CHECK(g.status("POST /arm/actions/halt", "192.0.2.1", bert) == 204);
    CHECK(g.halted == i);
  }
  CHECK(g.status("POST /arm/actions/halt", "192.0.2.1", anna) == 403);
  CHECK(g.status("POST /arm/actions/halt", "192.0.2.1") == 401);
  CHECK(g.halted == 19);
}

TEST_CASE("bodies are limited by their bytes before they are received, and each request is counted once", "[server][security][R0.2]") {
  security::ClientLimits limits;
  limits.requests_per_second = 1000;
  limits.body_bytes_per_second = 1024;
  limits.burst = 1s;
  Limited g(limits);
  RequestText put("PUT /arm/gains\nHost: localhost:4711\nContent-Type: application/json\n\n[1, 2]");
  put.get().body = {};
  engine::HeaderVerdict verdict = g.judge(put, 2048);
  CHECK_FALSE(verdict.response);
  CHECK(verdict.judged);
  put.get().judged = verdict.judged;
  put.get().body = "[1, 2]";
  CHECK(g.server->serve(put.get()).response.status == 204);  // the limit is used up, by this request itself
  CHECK(g.status("PUT /arm/angle" + number) == 429);
  CHECK(g.status("GET /arm") == 200);  // it has no body
  put.get().judged = nullptr;
  put.get().body = {};
  verdict = g.judge(put, 1);
  REQUIRE(verdict.response);
  CHECK(verdict.response->status == 429);
  CHECK(verdict.response->fields.find("Retry-After") == "1");
  g.clock.advance(1001ms);
  CHECK(g.status("PUT /arm/angle" + number) == 204);
  g.clock.advance(1s);

  // A body that is refused costs nothing, a chunked one as much as its resource may take.
  RequestText to_angle("PUT /arm/angle\nHost: localhost:4711\nContent-Type: application/json");
  verdict = g.judge(to_angle, 1'000'000);
  REQUIRE(verdict.response);
  CHECK(verdict.response->status == 413);
  CHECK(g.status("PUT /arm/angle" + number) == 204);
  CHECK_FALSE(g.judge(put, std::nullopt).response);
  const Answer refused(g.ask("PUT /arm/angle" + number));
  CHECK(refused.status == 429);
  CHECK(refused.field("Retry-After") == "1024");  // 1 MiB
}

TEST_CASE("a client has so many invocations at a time, and again when one has ended", "[server][security][R0.2]") {
  security::ClientLimits limits;
  limits.max_invocations = 2;
  Limited g(limits);
  const auto grip = [&](std::string_view peer) { return g.ask("POST /arm/actions/grip\nPrefer: respond-async", peer); };
  const http::Response first = grip("192.0.2.1");
  CHECK(first.status == 202);
  CHECK(grip("192.0.2.1").status == 202);
  const Answer refused(grip("192.0.2.1"));
  CHECK(refused.status == 429);
  CHECK(refused.field("Retry-After") == "1");
  CHECK(refused.says("2 active invocations"));
  CHECK(g.status("POST /arm/actions/home") == 429);
  CHECK(g.robot.homed == 0);
  CHECK(grip("192.0.2.2").status == 202);
  const std::string path(first.fields.find("Location")->substr(std::string("http://localhost:4711").size()));
  CHECK(g.status("DELETE " + path) == 204);
  CHECK(g.status("POST /arm/actions/home") == 204);
  CHECK(g.status("POST /arm/actions/home") == 204);
  CHECK(grip("192.0.2.1").status == 202);
  CHECK(g.status("POST /arm/actions/home") == 429);
  g.server->remove("arm").value();  // its invocations are gone, too
  SampleRobot other;
  g.server->add(other.arm()).value();
  CHECK(g.status("POST /arm/actions/home") == 204);
}

TEST_CASE("a client has so many subscriptions at a time, and again when one has ended", "[server][security][R0.2]") {
  security::ClientLimits limits;
  limits.max_subscriptions = 2;
  Limited g(limits);
  const auto subscribe = [&](std::string_view peer) {
    return g.ask("GET /arm/angle", peer, "Upgrade: callback\nConnection: Upgrade\nCallback: http://127.0.0.1:9/\n");
  };
  const http::Response first = subscribe("192.0.2.1");
  CHECK(first.status == 201);
  CHECK(g.status("POST /arm/subscriptions\nContent-Type: text/turtle\n\n<> a <http://hybrit.org/ns#WebCallback> .") != 201);
  CHECK(subscribe("192.0.2.1").status == 201);
  const Answer refused(subscribe("192.0.2.1"));
  CHECK(refused.status == 429);
  CHECK(refused.field("Retry-After") == "1");
  CHECK(refused.says("2 subscriptions"));
  CHECK(subscribe("192.0.2.2").status == 201);
  const std::string path(first.fields.find("Location")->substr(std::string("http://localhost:4711").size()));
  CHECK(g.status("DELETE " + path) == 204);
  CHECK(subscribe("192.0.2.1").status == 201);
  CHECK(subscribe("192.0.2.1").status == 429);
}

TEST_CASE("a flood of addresses makes nobody wait, and hides what nobody has used", "[server][security][R0.2]") {
  security::ClientLimits limits = Limited::two_per_second();
  limits.max_clients = 64;
  ClientLimiter limiter(limits);
  const TimePoint now = FakeClock().now();
  const auto passes = [&](const std::string& address) {
    engine::Caller caller;
    return !limiter.count(caller, address, false, now);
  };
  CHECK(passes("192.0.2.1"));
  CHECK(passes("192.0.2.1"));
  CHECK_FALSE(passes("192.0.2.1"));
  for (int i = 0; i < 10'000; ++i) CHECK(passes("10.0." + std::to_string(i / 256) + "." + std::to_string(i % 256)));
  CHECK_FALSE(passes("192.0.2.1"));  // of all it has used most
  engine::Caller caller;
  caller.principal = std::make_shared<const security::Principal>(security::Principal{"192.0.2.1", {}});
  CHECK_FALSE(limiter.count(caller, "192.0.2.1", false, now));  // a principal is no address, whatever its name
}

TEST_CASE("limits of clients out of their range are errors of Server::create", "[server][security]") {
  const auto error = [](auto change) {
    Options options;
    options.listen.transport = transport::no_network;
    change(options.security.clients);
    const auto made = Server::create(std::move(options));
    return made ? std::string() : made.error().message;
  };
  CHECK(error([](security::ClientLimits&) {}).empty());
  CHECK(error([](security::ClientLimits& l) { l.requests_per_second = 1'000'001; }) ==
        "security.clients.requests_per_second: expected 0 to 1000000, found 1000001");
  CHECK(error([](security::ClientLimits& l) { l.body_bytes_per_second = 1023; }) ==
        "security.clients.body_bytes_per_second: expected 0, or 1024 to 2^40, found 1023");
  CHECK(error([](security::ClientLimits& l) { l.burst = 0ms; }) == "security.clients.burst: expected 1 ms to 1 h, found 0 ms");
  CHECK(error([](security::ClientLimits& l) { l.max_clients = 15; }) == "security.clients.max_clients: expected 16 to 1000000, found 15");
}

TEST_CASE("a request over a port is counted once, whether its body comes with it or later", "[server][security][R0.2]") {
  for (const std::string_view transport : transport::names()) {
    CAPTURE(transport);
    security::ClientLimits limits;
    limits.requests_per_second = 1;
    limits.burst = 5s;
    limits.body_bytes_per_second = 0;
    Limited g(limits, true, std::string(transport));
    const std::string field = "\nHost: 127.0.0.1:" + std::to_string(g.server->port()) + "\n" + bert;
    const std::string put = "PUT /arm/angle" + field + "\nContent-Type: application/json";
    Socket socket(g.server->port());
    CHECK(socket.ask("GET /arm" + field).status == 200);
    CHECK(socket.ask(put + "\n\n5").status == 204);
    Socket slow(g.server->port());
    slow.send_header(put, 1, true);
    CHECK(slow.await().status == 100);
    slow.write("5");
    CHECK(slow.await().status == 204);
    CHECK(socket.ask("GET /arm" + field).status == 200);
    CHECK(socket.ask("GET /arm" + field).status == 200);
    CHECK(socket.ask("GET /arm" + field).status == 429);
    Socket refused(g.server->port());
    CHECK(refused.ask(put + "\n\n5").status == 429);
    CHECK(g.status("GET /arm", "192.0.2.1", bert) == 429);
  }
}

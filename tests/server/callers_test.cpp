// SPDX-License-Identifier: Apache-2.0
#include <lrt/server.hpp>

#include <atomic>
#include <chrono>
#include <fstream>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <lrt/served.hpp>
#include <lrt/transport/loopback.hpp>
#include <lrt/transport/named.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/message.hpp"
#include "tests/support/sample_robot.hpp"
#include "tests/support/socket.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

const std::string token_of_reader = "reader-0123456789abcdef", token_of_operator = "operator-0123456789abcdef",
                  token_of_administrator = "administrator-0123456789abcdef", token_of_expired = "expired-0123456789abcdef",
                  token_of_nobody = "nobody-0123456789abcdef";

void put(const std::string& path, const std::string& text) { std::ofstream(path) << text; }

/// A robot with a file of tokens, one of each role.
struct Guarded {
  explicit Guarded(Security security = {}, std::string transport = "") {
    put(folder / "tokens", "anna reader " + token_of_reader + "\nbert operator " + token_of_operator + "\ncarl administrator " +
                               token_of_administrator + "\ndora operator " + token_of_expired + " 2020-01-01T00:00:00Z\nemil guest " +
                               token_of_nobody + "\n");
    Options options;
    options.listen.port = 0;
    options.security = std::move(security);
    options.security.token_file = folder / "tokens";
    options.threads.dispatch = Dispatch::io_thread;
    options.clock = &clock;
    options.callbacks.allow = {"127.0.0.1"};
    if (transport.empty()) options.listen.transport = transport::no_network;
    else options.listen.transport = [transport](transport::TransportOptions t) { return transport::make_named(transport, std::move(t)); };
    server.emplace(Server::create(std::move(options)).value());
    server->add(robot.arm()).value();
  }

  http::Response ask(const std::string& text, const std::string& fields = "", bool secure = false, std::string_view certificate = "") {
    const std::size_t body = text.find("\n\n");
    RequestText request(text.substr(0, body) + "\nHost: localhost:4711\n" + fields + (body == std::string::npos ? "" : text.substr(body)));
    request.get().local_port = 4711;
    request.get().can_stream = true;
    request.get().secure = secure;
    request.get().client_certificate = certificate;
    return server->serve(request.get()).response;
  }
  int status(const std::string& text, const std::string& token) { return ask(text, "Authorization: Bearer " + token).status; }
  Served stream(const std::string& fields) {
    RequestText request("GET /arm/angle\nAccept: text/event-stream\nHost: localhost:4711\n" + fields);
    request.get().local_port = 4711;
    request.get().can_stream = true;
    return server->serve(request.get());
  }
  /// Within that time. Requests wake the thread that serves, because the clock is moved by hand.
  bool ends(Served& stream, std::chrono::milliseconds within) {
    for (const auto late = std::chrono::steady_clock::now() + within; std::chrono::steady_clock::now() < late;) {
      (void)ask("GET /nothing");
      for (int i = 0; i < 20; ++i)
        if (stream.events->next(std::chrono::milliseconds(1)).end) return true;
    }
    return false;
  }

  Folder folder;
  FakeClock clock;
  SampleRobot robot;
  std::optional<Server> server;
};

const std::string callback = "Upgrade: callback\nConnection: Upgrade\nCallback: http://127.0.0.1:9/\n";

}  // namespace

TEST_CASE("with a file of tokens nobody without one gets anything but 401", "[server][security][R0.2]") {
  Guarded g;
  for (const char* method : {"GET", "HEAD", "OPTIONS", "PUT", "POST", "DELETE", "PATCH", "BREW"})
    for (const char* path : {"/", "/arm", "/arm/angle", "/arm/actions/turn", "/arm/points", "/arm/subscriptions", "/all", "/arm/blueprint", "/ns/lrt",
                             "/nothing", "*"}) {
      CAPTURE(method, path);
      const http::Response response = g.ask(std::string(method) + " " + path);
      CHECK(response.status == 401);
      CHECK(response.fields.find("WWW-Authenticate") == "Bearer realm=\"lrt\"");
      for (const std::string& token : {token_of_expired, std::string("unknown-0123456789"), std::string()}) {
        const http::Response refused = g.ask(std::string(method) + " " + path, "Authorization: Bearer " + token);
        CHECK(refused.status == 401);
        CHECK(refused.fields.find("WWW-Authenticate") == "Bearer realm=\"lrt\", error=\"invalid_token\"");
        CHECK(refused.content() == response.content());  // nothing tells a resource from none
      }
    }
  CHECK(g.robot.homed == 0);
}

TEST_CASE("each role may do what its rights say to each kind of resource", "[server][security][R0.2]") {
  Guarded g;
  const std::string number = "\nContent-Type: application/json\n\n5";
  const std::string started = g.ask("POST /arm/actions/turn" + number, "Authorization: Bearer " + token_of_operator).status == 204 ? "" : "not ";
  CHECK(started.empty());
  struct Row {
    std::string request;
    int reader, other;  ///< status for a reader, and for an operator and an administrator
  };
  const std::vector<Row> rows = {
      {"GET /", 200, 200},
      {"GET /arm", 200, 200},
      {"HEAD /arm/name", 200, 200},
      {"OPTIONS /arm/angle", 204, 204},
      {"GET /arm/angle", 200, 200},
      {"GET /arm/blueprint", 200, 200},
      {"GET /all", 200, 200},
      {"GET /nothing", 404, 404},
      {"GET /arm/angle\nAccept: text/event-stream", 200, 200},
      {"PUT /arm/angle" + number, 403, 204},
      {"PUT /arm/speed" + number, 403, 405},
      {"POST /arm/actions/turn" + number, 403, 204},
      {"DELETE /arm/angle", 403, 405},
      {"PATCH /arm/angle", 403, 405},
      {"PUT /nothing" + number, 404, 404},
      {"GET /arm/angle\n" + callback.substr(0, callback.size() - 1), 201, 201},
  };
  for (const Row& row : rows) {
    CAPTURE(row.request);
    const double turned = g.robot.turned_to;
    CHECK(g.status(row.request, token_of_reader) == row.reader);
    CHECK(g.robot.turned_to == turned);
    CHECK(g.status(row.request, token_of_operator) == row.other);
    CHECK(g.status(row.request, token_of_administrator) == row.other);
    CHECK(g.status(row.request, token_of_nobody) == 403);  // a role without rights learns nothing
  }
}

TEST_CASE("a token that leaves the file is refused a second later", "[server][security][R0.2]") {
  Guarded g;
  CHECK(g.status("GET /arm", token_of_reader) == 200);
  put(g.folder / "tokens", "bert operator " + token_of_operator + "\n");
  g.clock.advance(std::chrono::seconds(1));
  CHECK(g.status("GET /arm", token_of_reader) == 401);
  CHECK(g.status("GET /arm", token_of_operator) == 200);
}

TEST_CASE("a stream ends with the token that opened it, also if the program's own function may know its owner", "[server][security][R0.2]") {
  Security security;
  security.authenticate = [](const http::Request& request) -> std::optional<security::Principal> {
    if (request.find("X-Badge") == "7") return security::Principal{"anna", {"operator"}};
    return std::nullopt;
  };
  Guarded g(security);
  Served by_token = g.stream("Authorization: Bearer " + token_of_reader), by_function = g.stream("X-Badge: 7");
  REQUIRE((by_token.events && by_function.events));
  SECTION("the token leaves the file") { put(g.folder / "tokens", "bert operator " + token_of_operator + "\n"); }
  SECTION("the token expires") { put(g.folder / "tokens", "anna reader " + token_of_reader + " 2020-01-01T00:00:00Z\n"); }
  g.clock.advance(std::chrono::seconds(2));
  CHECK(g.ends(by_token, std::chrono::minutes(1)));
  CHECK_FALSE(g.ends(by_function, std::chrono::milliseconds(1)));
  CHECK(g.server->counters().event_streams == 1);
}

TEST_CASE("HTTP Basic takes name and token over TLS only", "[server][security][R0.2]") {
  Guarded g;
  const std::string basic = "Authorization: Basic YW5uYTpyZWFkZXItMDEyMzQ1Njc4OWFiY2RlZg==";  // anna:reader-0123456789abcdef
  CHECK(g.ask("GET /arm", basic, true).status == 200);
  CHECK(g.ask("GET /arm", basic, false).status == 401);
  CHECK(g.ask("GET /arm", "Authorization: Basic YmVydDpyZWFkZXItMDEyMzQ1Njc4OWFiY2RlZg==", true).status == 401);  // bert with anna's token
  CHECK(g.ask("GET /arm", "", true).fields.find("WWW-Authenticate") == "Bearer realm=\"lrt\", Basic realm=\"lrt\", charset=\"UTF-8\"");
}

TEST_CASE("principals by certificate and by the user's own function, and rights without credentials", "[server][security][R0.2]") {
  Security security;
  security.anyone = security::Right::read;
  security.authenticate = [](const http::Request& request) -> std::optional<security::Principal> {
    if (request.find("X-Badge") == "7") return security::Principal{"seven", {"operator"}};
    return std::nullopt;
  };
  Guarded g(security);
  CHECK(g.ask("GET /arm").status == 200);
  CHECK(g.ask("GET /nothing").status == 404);
  const http::Response response = g.ask("PUT /arm/angle\nContent-Type: application/json\n\n5");
  CHECK(response.status == 401);
  CHECK(response.fields.find("WWW-Authenticate") == "Bearer realm=\"lrt\"");
  CHECK(g.ask("GET /arm", "Authorization: Bearer unknown-0123456789").status == 401);  // what is wrong is not nothing
  CHECK(g.ask("PUT /arm/angle\nContent-Type: application/json\n\n5", "X-Badge: 7").status == 204);
  CHECK(g.ask("PUT /arm/angle\nContent-Type: application/json\n\n5", "X-Badge: 8").status == 401);
}

TEST_CASE("a certificate's subject names a principal", "[server][security][R0.2]") {
  Options options;
  options.listen.port = 0;
  options.security.certificates["CN=panel"] = {"panel", {"reader"}};
  const auto refused = Server::create(options);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message == "security.certificates: clients cannot present a certificate without security.tls and its client_ca_file");
}

TEST_CASE("an authorizer is asked after the tokens, and only for those that they let in", "[server][security][R0.2]") {
  std::atomic<int> calls{0};
  Security security;
  security.authorize = [&](const http::Request& request) {
    ++calls;
    return request.target == "/arm/name" ? engine::Access::forbidden : engine::Access::granted;
  };
  Guarded g(security);
  CHECK(g.ask("GET /arm").status == 401);
  CHECK(calls == 0);
  CHECK(g.status("GET /arm", token_of_reader) == 200);
  CHECK(g.status("GET /arm/name", token_of_operator) == 403);
  CHECK(calls == 2);
}

TEST_CASE("tokens guard a port of each transport, WebSockets included", "[server][security][R0.2]") {
  for (const std::string_view transport : transport::names()) {
    CAPTURE(transport);
    Guarded g({}, std::string(transport));
    const std::string host = "\nHost: 127.0.0.1:" + std::to_string(g.server->port());
    const std::string handshake =
        host + "\nConnection: Upgrade\nUpgrade: websocket\nSec-WebSocket-Version: 13\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==";
    const auto status = [&](const std::string& request) { return Socket(g.server->port()).ask(request).status; };
    const std::string reader = "\nAuthorization: Bearer " + token_of_reader, other = "\nAuthorization: Bearer " + token_of_operator;
    CHECK(status("GET /arm" + host) == 401);
    CHECK(status("GET /arm" + host + reader) == 200);
    CHECK(status("GET /arm/angle" + handshake) == 401);
    CHECK(status("GET /arm/angle" + handshake + reader) == 101);
    CHECK(status("GET /arm/angle" + handshake + "\nAuthorization: Bearer " + token_of_nobody) == 403);
    CHECK(status("PUT /arm/angle" + host + reader + "\nContent-Type: application/json\n\n5") == 403);
    CHECK(status("PUT /arm/angle" + host + other + "\nContent-Type: application/json\n\n5") == 204);
  }
}

// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;

TEST_CASE("names are percent-encoded, and any spelling of a path finds its resource", "[engine][R0.3]") {
  Bench bench;
  Thing thing{"caf\u00e9 1/gr\u00fcn+"};
  thing.property("a b", [] { return 1; });
  bench.add(std::move(thing));
  const std::string self = "/caf%C3%A9%201/gr%C3%BCn+";
  const Answer a = bench.get(self);
  REQUIRE(a.status == 200);
  CHECK(a.links_to("http://localhost" + self + "/a%20b", "related"));
  CHECK(missing(a, "<" + self + "> dcterms:title \"gr\u00fcn+\" ; hybrit:property <" + self + "/a%20b> .") == "");
  CHECK(bench.get("/caf%c3%a9%201/%67r%c3%bcn%2B").body == a.body);
  CHECK(bench.get(self + "/a%20b").status == 200);
  CHECK(bench.get(self + "/a+b").status == 404);
}

TEST_CASE("what can name nothing is 400", "[engine][R0.6]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  for (const char* path : {"/arm/..", "/arm/../arm", "/./arm", "/%2e%2E/arm", "/arm/%2e", "/arm%00", "/%00", "/%ff", "/arm/%C3", "/%ED%A0%80", "/%zz",
                           "/arm%", "/arm%4"}) {
    CAPTURE(path);
    const Answer a = bench.get(path);
    CHECK(a.status == 400);
    CHECK(a.says("target: "));
  }
}

TEST_CASE("what names nothing is 404, also with a slash too many", "[engine][R0.6]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  for (const char* path : {"/nowhere", "/arm/", "//arm", "/arm//angle", "/arm/actions", "/arm/actions/", "/arm/actions/turn/i1", "/ARM",
                           "/arm/waypoints/x", "/arm%2Fangle", "/arm/state/x"}) {
    CAPTURE(path);
    for (const char* method : {"GET", "HEAD", "OPTIONS", "PUT", "POST", "DELETE"}) CHECK(bench.ask(std::string(method) + " " + path).status == 404);
  }
}

TEST_CASE("unknown query parameters are ignored", "[engine][R0.3]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  CHECK(bench.get("/arm?x=1&page=7").body == bench.get("/arm").body);
  CHECK(bench.get("/?x=%00").body == bench.get("/").body);
  CHECK(bench.get("/?").body == bench.get("/").body);
  CHECK(bench.turtle("PUT", "/arm/count?x", number_body("9")).status == 204);
  CHECK(robot.count == 9);
}

TEST_CASE("an absolute target is like its path with its host", "[engine][R0.3]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  CHECK(bench.ask("GET http://127.0.0.1/arm").body == bench.ask("GET /arm\nHost: 127.0.0.1").body);
  CHECK(bench.ask("GET http://127.0.0.1").body == bench.ask("GET /\nHost: 127.0.0.1").body);
  CHECK(bench.ask("GET http://elsewhere.example/arm").status == 421);
}

TEST_CASE("IRIs follow the host of the request; a stranger's is 421", "[engine][R0.6]") {
  Bench bench;
  bench.add(Thing{"arm"});
  const auto base = [&](const std::string& host) {
    const Answer a = bench.ask("GET /arm\nHost: " + host);
    if (a.status != 200) return std::to_string(a.status);
    return a.linked("up").front();
  };
  CHECK(base("localhost") == "http://localhost/");
  CHECK(base("LocalHost:80") == "http://localhost/");
  CHECK(base("localhost:") == "http://localhost/");
  CHECK(base("127.0.0.1") == "http://127.0.0.1/");
  CHECK(base("[::1]") == "http://[::1]/");
  CHECK(base("localhost:8080") == "http://localhost:8080/");  // a port that somebody forwards
  CHECK(base("robot.local") == "421");
  CHECK(base("localhost.evil.example") == "421");
  CHECK(bench.ask("GET /arm\nHost:").linked("up").front() == "http://127.0.0.1/");  // HTTP/1.0

  bench.engine.listens_on("192.168.7.3", 8080);
  CHECK(base("192.168.7.3:8080") == "http://192.168.7.3:8080/");
  CHECK(base("localhost:8080") == "http://localhost:8080/");
  CHECK(base("192.168.7.3") == "421");
  bench.engine.listens_on("fd00::3", 8080);
  CHECK(base("[fd00::3]:8080") == "http://[fd00::3]:8080/");
  CHECK(base("[FD00::3]:8080") == "http://[fd00::3]:8080/");
}

TEST_CASE("representations name the forwarded port of their request, and a subscription keeps its own", "[engine][R0.6][SPEC 3.7]") {
  engine::EngineOptions options;
  options.max_forwarded_bases = 2;
  SampleRobot robot;
  Bench bench(options);
  bench.add(robot.arm());
  const auto at = [](int port) { return "localhost:" + std::to_string(port); };
  const auto channel = bench.open("/arm/angle", "Host: " + at(1) + "\n");
  (void)bench.messages(channel);
  for (const int port : {2, 3, 4, 2, 3, 5}) {  // each replaces the one before
    CAPTURE(port);
    for (const char* path : {"/", "/arm", "/arm/angle", "/arm/count"}) {
      const Answer answer = bench.ask("GET " + std::string(path) + "\nHost: " + at(port));
      CHECK(answer.status == 200);
      CHECK(answer.says("http://" + at(port) + "/"));
      for (const int other : {1, 2, 3, 4, 5})
        if (other != port) CHECK_FALSE(answer.says("http://" + at(other) + "/"));
    }
    const std::string body = "<http://" + at(port) + "/arm/count> vom:numericalValue " + std::to_string(port) + " .";
    CHECK(bench.turtle("PUT", "/arm/count", body, "Host: " + at(port) + "\n").status == 204);
    CHECK(robot.count == port);
    const Answer refused = bench.turtle("PUT", "/arm/count", "<> vom:numericalValue \"x\" .", "Host: " + at(port) + "\nAccept: text/turtle\n");
    CHECK(refused.status == 422);
    CHECK(refused.says("http://" + at(port) + "/"));
  }
  robot.angle_handle->publish(33);
  bench.clock.advance(std::chrono::milliseconds(100));
  const auto messages = bench.messages(channel);
  REQUIRE_FALSE(messages.empty());
  CHECK(messages.back().find("http://localhost:1/arm/angle") != std::string::npos);
}

TEST_CASE("an integrator names further hosts", "[engine][R0.6]") {
  engine::EngineOptions options;
  options.allowed_hosts = {"Robot.local", "gate.example:443"};
  Bench bench(options);
  bench.engine.listens_on("127.0.0.1", 8080);
  CHECK(bench.ask("GET /\nHost: robot.local:8080").status == 200);
  CHECK(bench.ask("GET /\nHost: gate.example:443").status == 200);
  CHECK(bench.ask("GET /\nHost: robot.local").status == 421);
  CHECK(bench.ask("GET /\nHost: gate.example:8080").status == 421);
}

TEST_CASE("a public base is used whichever name of the server a request has", "[engine][R0.6]") {
  engine::EngineOptions options;
  options.public_base = "https://robots.example/cell7/";
  Bench bench(options);
  bench.add(Thing{"arm"});
  const Answer a = bench.ask("GET /arm\nHost: robots.example");
  CHECK(a.status == 200);
  CHECK(missing(a, "<https://robots.example/cell7/arm> a hybrit:RoboticThing .") == "");
  CHECK(a.links_to("https://robots.example/cell7/arm/state", "related"));
  CHECK(bench.ask("GET /arm\nHost: localhost").tag() == a.tag());
  CHECK(bench.ask("GET /arm\nHost: other").status == 421);  // a page of another name that resolves to this machine
}

TEST_CASE("a proxy may keep the path of the public base in targets", "[engine][R0.6]") {
  engine::EngineOptions options;
  options.public_base = "https://robots.example/cell7";
  Bench bench(options);
  bench.add(Thing{"arm"});
  const std::string tag = bench.get("/arm").tag();
  CHECK(bench.get("/cell7/arm").tag() == tag);
  CHECK(bench.get("/cell7/%61rm").tag() == tag);
  CHECK(bench.get("/cell7/arm?accept=application/json-seq").status == 406);
  CHECK(bench.ask("GET http://robots.example/cell7/arm\nHost: robots.example").tag() == tag);
  for (const char* root : {"/", "/cell7", "/cell7/"})
    CHECK(missing(bench.get(root), "<https://robots.example/cell7/> ldp:contains <https://robots.example/cell7/arm> .") == "");
  CHECK(bench.get("/cell7/ns/lrt").status == 200);
  CHECK(bench.get("/cell78/arm").status == 404);
  CHECK(bench.get("/cell7/cell7/arm").status == 404);
  CHECK(bench.get("/cell7arm").status == 404);
  // "/cell7/arm" can no longer be read in two ways.
  bench.add(Thing{"cell7/arm"});
  CHECK(missing(bench.get("/cell7/arm"), "<https://robots.example/cell7/cell7/arm> a hybrit:RoboticThing .") == "");
  CHECK(bench.get("/cell7/cell7/arm").status == 404);
  CHECK(bench.get("/arm").tag() == tag);
}

TEST_CASE("over TLS the base is https", "[engine][R0.6]") {
  Bench bench;
  bench.add(Thing{"arm"});
  RequestText request("GET /arm\nHost: localhost:443");
  request.get().secure = true;
  const Bench::Sent a = bench.sent(bench.engine.handle(request.get(), bench.clock.now()));
  CHECK(a.answer.linked("up").front() == "https://localhost/");
}

TEST_CASE("an authorizer decides before anything else does", "[engine][R0.6]") {
  engine::EngineOptions options;
  int asked = 0;
  options.challenge = "Basic realm=\"robot\"";
  options.authorize = [&](const http::Request& r) {
    ++asked;
    if (r.target == "/throws") throw std::runtime_error("no key");
    const auto who = r.find("Authorization");
    if (!who) return engine::Access::unauthenticated;
    return *who == "me" ? engine::Access::granted : engine::Access::forbidden;
  };
  SampleRobot robot;
  Bench bench(options);
  bench.add(robot.arm());
  const Answer anonymous = bench.ask("POST /arm/actions/home");
  CHECK(anonymous.status == 401);
  CHECK(anonymous.field("WWW-Authenticate") == "Basic realm=\"robot\"");
  CHECK(bench.ask("POST /arm/actions/home\nAuthorization: you").status == 403);
  CHECK(bench.ask("GET /nowhere").status == 401);  // what exists is no business of strangers
  CHECK(bench.ask("OPTIONS *").status == 401);
  CHECK(bench.ask("GET /throws").status == 500);
  CHECK(robot.homed == 0);
  CHECK(bench.ask("POST /arm/actions/home\nAuthorization: me").status == 204);
  CHECK(bench.ask("GET /arm/count\nAuthorization: me").status == 200);
  CHECK(robot.homed == 1);
  CHECK(asked >= 7);
}

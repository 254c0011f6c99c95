// SPDX-License-Identifier: Apache-2.0
#include "src/engine/cors.hpp"

#include <set>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

struct Arm {
  explicit Arm(std::vector<std::string> readers, std::vector<std::string> commanders = {}, engine::Authorizer authorize = {})
      : bench(options(std::move(readers), std::move(commanders), std::move(authorize))) {
    bench.add(robot.arm());
  }
  static engine::EngineOptions options(std::vector<std::string> readers, std::vector<std::string> commanders, engine::Authorizer authorize) {
    engine::EngineOptions o;
    o.read_origins = std::move(readers);
    o.allowed_origins = std::move(commanders);
    o.authorize = std::move(authorize);
    return o;
  }
  SampleRobot robot;
  Bench bench;
};

const std::string reader = "\nOrigin: https://reader.example", stranger = "\nOrigin: http://evil.example",
                  commander = "\nOrigin: https://dashboard.example";

std::string preflight(const std::string& path, const std::string& origin, const std::string& method = "GET") {
  return "OPTIONS " + path + origin + "\nAccess-Control-Request-Method: " + method;
}

}  // namespace

TEST_CASE("by default no page of another origin can read, and responses have no field of CORS", "[engine][security]") {
  Arm arm({});
  for (const std::string& request : {"GET /arm" + reader, "OPTIONS /arm" + reader, preflight("/arm", reader), "GET /nowhere" + reader}) {
    const Answer answer = arm.bench.ask(request);
    CHECK_FALSE(answer.has("Access-Control-Allow-Origin"));
    CHECK_FALSE(answer.has("Access-Control-Allow-Methods"));
    CHECK(answer.members("Vary").count("Origin") == 0);
  }
}

TEST_CASE("no browser guesses the type of a response, and only pages that may read can embed it", "[engine][security]") {
  const auto policy = [](Arm& arm, const std::string& request) {
    const Answer answer = arm.bench.ask(request);
    CAPTURE(request);
    CHECK(answer.members("X-Content-Type-Options") == std::set<std::string>{"nosniff"});
    return answer.field("Cross-Origin-Resource-Policy");
  };
  Arm closed({}), listed({"https://reader.example"}), open({"*"});
  for (const std::string request :
       {"GET /", "GET /arm", "HEAD /arm/angle", "GET /arm/speed", "OPTIONS /arm/angle", "OPTIONS *", "GET /nowhere", "GET /arm/broken", "DELETE /arm",
        "BREW /arm", "POST /arm/actions/home", "GET /arm\nHost: elsewhere", "GET /arm\nAccept: text/html", "GET /arm\nAccept: text/event-stream"}) {
    CHECK(policy(closed, request) == "same-origin");
    CHECK(policy(closed, request + reader) == "same-origin");
    CHECK(policy(listed, request) == "same-origin");
    CHECK(policy(listed, request + reader) == "cross-origin");
    CHECK(policy(listed, request + stranger) == "same-origin");
    CHECK(policy(open, request) == "cross-origin");
  }
  CHECK(policy(listed, preflight("/arm", reader)) == "cross-origin");
}

TEST_CASE("a browser runs nothing in a document of the robot, but for lrt's page", "[engine][security]") {
  Bench bench;
  Thing thing{"camera"};
  const auto drawing = [](const int&) { return std::string("<svg xmlns='http://www.w3.org/2000/svg'><script>move()</script></svg>"); };
  const std::vector<std::string> active = {"image/svg+xml",   "Image/SVG+XML;q=1", "application/xhtml+xml",     "text/xml; charset=utf-8",
                                           "application/xml", "text/xsl",          "multipart/x-mixed-replace", "application/x-html+xml"};
  const std::vector<std::string> passive = {"image/png", "application/pdf", "text/css", "text/csv", "application/octet-stream", "image/x-xmlish"};
  std::vector<PushedProperty<int>> properties;
  for (const auto* types : {&active, &passive})
    for (const std::string& type : *types) {
      properties.push_back(thing.property<int>("p" + std::to_string(properties.size())));
      properties.back().representation(type, drawing);
    }
  bench.add(std::move(thing));
  for (auto& property : properties) property.publish(1);
  bench.look();
  for (std::size_t i = 0; i < properties.size(); ++i) {
    const std::string path = "/camera/p" + std::to_string(i), type = i < active.size() ? active[i] : passive[i - active.size()];
    const std::string essence = type.substr(0, type.find(';'));
    CAPTURE(type);
    const Answer answer = bench.ask("GET " + path + "\nAccept: " + essence);
    CHECK(answer.status == 200);
    CHECK(answer.body.find("<svg") == 0);
    CHECK(answer.field("X-Content-Type-Options") == "nosniff");
    const std::string policy = answer.field("Content-Security-Policy");
    CHECK((policy.rfind("sandbox; default-src 'none';", 0) == 0) == (i < active.size()));
    CHECK(policy.find("script") == std::string::npos);
    CHECK(policy.find("allow-") == std::string::npos);
    const Answer same = bench.ask("GET " + path + "\nAccept: " + essence + "\nIf-None-Match: " + answer.tag());
    CHECK(same.status == 304);
    CHECK(same.field("X-Content-Type-Options") == "nosniff");
  }
  if (rdf::syntax_of("application/rdf+xml"))
    CHECK(bench.ask("GET /camera\nAccept: application/rdf+xml").field("Content-Security-Policy").rfind("sandbox", 0) == 0);
  CHECK_FALSE(bench.ask("GET /camera").has("Content-Security-Policy"));
}

TEST_CASE("a listed origin may read: GET, HEAD and OPTIONS, at once and deferred, with the fields it needs", "[engine][security]") {
  Arm arm({"https://reader.example"});
  for (const std::string method : {"GET", "HEAD", "OPTIONS"})
    for (const std::string path : {"/", "/arm", "/arm/angle", "/arm/speed", "/arm/state", "/arm/blueprint", "/nowhere", "/arm/broken"}) {
      CAPTURE(method, path);
      const Answer answer = arm.bench.ask(method + " " + path + reader);
      CHECK(answer.field("Access-Control-Allow-Origin") == "https://reader.example");
      CHECK_FALSE(answer.has("Access-Control-Allow-Credentials"));
      for (const char* name : {"ETag", "Link", "Location", "Allow", "Accept-Post", "Content-Location"})
        CHECK(answer.members("Access-Control-Expose-Headers").count(name) == 1);
      CHECK(answer.members("Vary").count("Origin") == 1);
      for (const std::string& other : {stranger, std::string("\nOrigin: null"), std::string(), reader + stranger}) {
        const Answer hidden = arm.bench.ask(method + " " + path + other);
        CHECK(hidden.status == answer.status);
        CHECK_FALSE(hidden.has("Access-Control-Allow-Origin"));
        CHECK(hidden.members("Vary").count("Origin") == 1);  // a cache must not give it to the reader
      }
    }
  const Answer first = arm.bench.ask("GET /arm/angle" + reader);
  const Answer again = arm.bench.ask("GET /arm/angle" + reader + "\nIf-None-Match: " + first.tag());
  CHECK(again.status == 304);
  CHECK(again.field("Access-Control-Allow-Origin") == "https://reader.example");
  CHECK(again.members("Vary") == std::set<std::string>{"Accept", "Origin"});
}

TEST_CASE("a reader's preflight names the methods that read; its commands are refused", "[engine][security]") {
  Arm arm({"https://reader.example"});
  const Answer answer = arm.bench.ask(preflight("/arm/angle", reader, "PUT"));
  CHECK(answer.status == 204);
  CHECK(answer.members("Access-Control-Allow-Methods") == std::set<std::string>{"GET", "HEAD", "OPTIONS"});
  for (const char* name : {"Accept", "Content-Type", "If-Match", "If-None-Match", "Prefer", "Authorization", "Range"})
    CHECK(answer.members("Access-Control-Allow-Headers").count(name) == 1);
  CHECK(answer.has("Access-Control-Max-Age"));
  CHECK_FALSE(arm.bench.ask(preflight("/arm/angle", stranger)).has("Access-Control-Allow-Origin"));
  CHECK(arm.bench.ask("POST /arm/actions/home" + reader).status == 403);
  CHECK(arm.bench.ask("DELETE /arm/subscriptions/i1" + reader).status == 403);
  CHECK(arm.robot.homed == 0);
}

TEST_CASE("an origin that may send commands can do so from a browser, and reads what comes back", "[engine][security]") {
  Arm arm({}, {"https://dashboard.example"});
  for (const char* method : {"PUT", "POST", "DELETE"}) {
    const Answer answer = arm.bench.ask(preflight("/arm/angle", commander, method));
    CHECK(answer.status == 204);
    CHECK(answer.field("Access-Control-Allow-Origin") == "https://dashboard.example");
    CHECK(answer.members("Access-Control-Allow-Methods").count(method) == 1);
    for (const char* name : {"Content-Type", "If-Match", "Prefer", "Accept"}) CHECK(answer.members("Access-Control-Allow-Headers").count(name) == 1);
  }
  const Answer read = arm.bench.ask("GET /arm/angle" + commander);
  CHECK(read.field("Access-Control-Allow-Origin") == "https://dashboard.example");
  const Answer put = arm.bench.ask("PUT /arm/angle" + commander + "\nContent-Type: application/json\nIf-Match: " + read.tag() + "\n\n12");
  CHECK(put.status == 204);
  CHECK(put.field("Access-Control-Allow-Origin") == "https://dashboard.example");
  const Answer posted = arm.bench.ask("POST /arm/actions/home" + commander);
  CHECK(posted.status == 204);
  CHECK(posted.has("Location"));
  CHECK(posted.field("Access-Control-Allow-Origin") == "https://dashboard.example");
  CHECK(arm.robot.homed == 1);
  const auto stream = arm.bench.stream("/arm/angle", commander.substr(1) + "\n");
  REQUIRE(stream.channel);
  CHECK(stream.answer.field("Access-Control-Allow-Origin") == "https://dashboard.example");
  CHECK(arm.bench.stream("/arm/angle", stranger.substr(1) + "\n").answer.status == 403);
}

TEST_CASE("with \"*\" every page reads, and caches need not distinguish origins", "[engine][security]") {
  Arm arm({"*"}, {"https://dashboard.example"});
  for (const std::string& origin : {std::string(), reader, stranger, std::string("\nOrigin: null")}) {
    const Answer answer = arm.bench.ask("GET /arm/angle" + origin);
    CHECK(answer.field("Access-Control-Allow-Origin") == "*");
    CHECK(answer.members("Vary") == std::set<std::string>{"Accept"});
  }
  CHECK(arm.bench.ask(preflight("/arm", stranger)).members("Access-Control-Allow-Methods").count("PUT") == 0);
  CHECK(arm.bench.ask(preflight("/arm", commander)).members("Access-Control-Allow-Methods").count("PUT") == 1);
  CHECK(arm.bench.ask("POST /arm/actions/home" + stranger).status == 403);
}

TEST_CASE("a preflight is not judged by the authorizer, which gets no credentials with it; the request itself is", "[engine][security]") {
  Arm arm({"https://reader.example"}, {},
          [](const http::Request& request) { return request.find("Authorization") ? engine::Access::granted : engine::Access::unauthenticated; });
  CHECK(arm.bench.ask(preflight("/arm", reader)).status == 204);
  CHECK(arm.bench.ask(preflight("/nowhere", reader)).status == 204);  // what exists is not revealed
  CHECK(arm.bench.ask(preflight("/arm", stranger)).status == 401);
  const Answer refused = arm.bench.ask("GET /arm" + reader);
  CHECK(refused.status == 401);
  CHECK(refused.field("Access-Control-Allow-Origin") == "https://reader.example");  // the page learns why
  CHECK(arm.bench.ask("GET /arm" + reader + "\nAuthorization: Bearer x").status == 200);
}

TEST_CASE("what is no origin is refused as an option", "[engine][security]") {
  for (const char* good : {"*", "null", "https://robot.example", "http://localhost:8080", "chrome-extension://abc"}) {
    CAPTURE(good);
    CHECK(engine::Engine(Arm::options({good}, {good}, {})).check());
  }
  for (const char* bad : {"", "robot.example", "https://robot.example/", "https://", "https://a.example, https://b.example"}) {
    CAPTURE(bad);
    const auto read = engine::Engine(Arm::options({bad}, {}, {})).check(), command = engine::Engine(Arm::options({}, {bad}, {})).check();
    REQUIRE_FALSE(read);
    CHECK(read.error().code == Errc::invalid_option);
    CHECK(read.error().message.find("read_origins") == 0);
    REQUIRE_FALSE(command);
    CHECK(command.error().message.find("allowed_origins") == 0);
  }
}

TEST_CASE("responses that share prepared fields have those of their own request, in whatever order requests come", "[engine][security]") {
  std::vector<std::string> all;
  for (const std::string& origin : {std::string(), reader, stranger, commander, reader + stranger})
    for (const char* more : {"", "\nIf-None-Match: TAG", "\nRange: bytes=0-3", "\nAccept: application/json"})
      for (const char* method : {"GET", "HEAD"}) all.push_back(method + std::string(" /arm/angle") + origin + more);
  /// Without the entity tag: the time of the value is in it.
  const auto fields = [](Arm& arm, std::string request) {
    if (const std::size_t at = request.find("TAG"); at != std::string::npos) request.replace(at, 3, arm.bench.get("/arm/angle").field("ETag"));
    Answer answer = arm.bench.ask(request);
    answer.fields.remove("ETag");
    return std::to_string(answer.status) + answer.fields.block();
  };
  using Origins = std::vector<std::string>;
  for (const auto& [readers, commanders] :
       {std::pair<Origins, Origins>{{}, {}}, {{"https://reader.example"}, {"https://dashboard.example"}}, {{"*"}, {}}}) {
    std::vector<std::string> alone;  // of an engine that has had no other request
    for (const std::string& request : all) {
      Arm fresh(readers, commanders);
      alone.push_back(fields(fresh, request));
    }
    Arm arm(readers, commanders);
    for (std::size_t i = 0; i < 5 * all.size(); ++i) {
      const std::size_t n = i * 13 % all.size();
      CAPTURE(all[n]);
      REQUIRE(fields(arm, all[n]) == alone[n]);
    }
  }
}

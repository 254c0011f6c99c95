// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include <map>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {
struct Robot {
  explicit Robot(engine::EngineOptions options = {}) : bench(std::move(options)) {
    bench.add(robot.arm());
    bench.add(robot.tool());
  }
  SampleRobot robot;
  Bench bench;
};
}  // namespace

TEST_CASE("an entity tag changes exactly when the bytes of its representation do", "[engine][json_ld][rdf_xml][R0.11]") {
  Robot r;
  const std::vector<std::string> paths = {"/",
                                          "/arm",
                                          "/arm/angle",
                                          "/arm/count",
                                          "/arm/tool",
                                          "/arm/tool/state",
                                          "/arm/blueprint",
                                          "/arm/subscriptions",
                                          "/arm/actions/home",
                                          "/arm/actions/grip",
                                          "/arm/actions/grip/i1",
                                          "/arm/waypoints"};
  const std::string types[] = {"text/turtle", "application/n-triples", "application/rdf+xml", "application/ld+json"};
  const std::string hosts[] = {"localhost", "127.0.0.1"};
  REQUIRE(r.bench.ask("POST /arm/actions/grip").status == 204);

  std::map<std::string, std::string> bytes_of_tag;                  // of any time: a tag never names two texts
  std::map<std::string, std::pair<std::string, std::string>> last;  // tag and bytes, by path, type and host
  const auto look = [&](const char* when) {
    for (const auto& path : paths)
      for (const auto& type : types)
        for (const auto& host : hosts) {
          CAPTURE(when, path, type, host);
          const Answer a = r.bench.ask("GET " + path + "\nAccept: " + type + "\nHost: " + host);
          REQUIRE(a.status == 200);
          const std::string tag = a.tag();
          REQUIRE(tag.size() > 2);
          CHECK(tag.front() == '"');  // strong
          CHECK(tag.back() == '"');
          CHECK(bytes_of_tag.emplace(tag, type + a.body).first->second == type + a.body);
          const auto known = last.find(path + type + host);
          if (known != last.end()) CHECK((known->second.first == tag) == (known->second.second == a.body));
          last[path + type + host] = {tag, a.body};
          const Answer again = r.bench.ask("GET " + path + "\nAccept: " + type + "\nHost: " + host + "\nIf-None-Match: " + tag);
          CHECK(again.status == 304);
        }
  };
  look("at first");
  look("unchanged");
  r.bench.clock.advance(std::chrono::seconds(1));
  look("later");
  r.robot.angle_handle->publish(r.robot.angle);
  look("published the same");
  r.robot.angle_handle->publish(12);
  look("published");
  r.robot.count = 8;
  look("another value to pull");
  REQUIRE(r.bench.ask("POST /arm/actions/home").status == 204);
  look("invoked");
  r.robot.grips[0].progress(0.5);
  look("progressed");
  r.robot.grips[0].succeed();
  look("ended");
  r.bench.add(Thing{"arm/other"});
  look("a thing more");
  REQUIRE(r.bench.engine.remove("arm/other"));
  look("a thing less");
}

TEST_CASE("different media types and bases have different tags", "[engine][json_ld][rdf_xml][R0.11]") {
  Robot r;
  std::set<std::string> tags;
  for (const char* type : {"text/turtle", "application/n-triples", "application/rdf+xml", "application/ld+json"})
    for (const char* host : {"localhost", "127.0.0.1", "[::1]"})
      tags.insert(r.bench.ask(std::string("GET /arm/angle\nAccept: ") + type + "\nHost: " + host).tag());
  CHECK(tags.size() == 12);
}

TEST_CASE("a bit-identical value changes neither tag nor time", "[engine][R0.11]") {
  Bench bench;
  double value = 0.0;
  Thing thing{"arm"};
  thing.property("pulled", [&] { return value; });
  auto pushed = thing.property<double>("pushed");
  bench.add(std::move(thing));
  pushed.publish(0.0);
  const Answer pulled_before = bench.get("/arm/pulled"), pushed_before = bench.get("/arm/pushed"), state = bench.get("/arm/state");
  bench.clock.advance(std::chrono::seconds(5));
  pushed.publish(0.0);
  CHECK(bench.get("/arm/pulled").body == pulled_before.body);
  CHECK(bench.get("/arm/pushed").body == pushed_before.body);
  CHECK(bench.get("/arm/state").tag() == state.tag());
  // -0.0 equals 0.0 but has other bits.
  pushed.publish(-0.0);
  value = -0.0;
  CHECK(missing(bench.get("/arm/pushed"),
                "<arm/pushed> vom:numericalValue \"-0\"^^xsd:double ; dcterms:modified"
                " \"2026-11-21T10:38:44.000000Z\"^^xsd:dateTime .") == "");
  CHECK(missing(bench.get("/arm/pulled"), "<arm/pulled> dcterms:modified \"2026-11-21T10:38:44.000000Z\"^^xsd:dateTime .") == "");
}

TEST_CASE("a property that counts every sample changes with each", "[engine][R0.11]") {
  Bench bench;
  Thing thing{"arm"};
  auto sample = thing.property<double>("sample");
  sample.every_sample();
  bench.add(std::move(thing));
  sample.publish(1);
  const Answer first = bench.get("/arm/sample");
  bench.clock.advance(std::chrono::milliseconds(1));
  sample.publish(1);
  const Answer second = bench.get("/arm/sample");
  CHECK(first.tag() != second.tag());
  CHECK(missing(second, "<arm/sample> dcterms:modified \"2026-11-21T10:38:39.001000Z\"^^xsd:dateTime .") == "");
}

TEST_CASE("If-None-Match responds 304 with the tag and without a body", "[engine][R0.6][R0.11]") {
  Robot r;
  const Answer a = r.bench.get("/arm/angle");
  for (const std::string& field : {a.tag(), "W/" + a.tag(), "\"x\", " + a.tag(), std::string("*")}) {
    CAPTURE(field);
    const Answer b = r.bench.ask("GET /arm/angle\nIf-None-Match: " + field);
    CHECK(b.status == 304);
    CHECK(b.body.empty());
    CHECK(b.tag() == a.tag());
    CHECK(b.field("Vary") == "Accept");
    CHECK_FALSE(b.has("Content-Type"));
    CHECK(r.bench.ask("HEAD /arm/angle\nIf-None-Match: " + field).status == 304);
  }
  CHECK(r.bench.ask("GET /arm/angle\nIf-None-Match: \"x\"\nIf-None-Match: " + a.tag()).status == 304);
  CHECK(r.bench.ask("GET /arm/angle\nIf-None-Match: \"x\"").status == 200);
  // The tag of another media type is another representation.
  CHECK(r.bench.ask("GET /arm/angle\nAccept: application/n-triples\nIf-None-Match: " + a.tag()).status == 200);
  CHECK(r.bench.ask("GET /arm/angle\nIf-None-Match: ").status == 200);
  CHECK(r.bench.ask("GET /arm/angle\nIf-None-Match: x").status == 400);
  CHECK(r.bench.ask("GET /arm/angle\nIf-Match: x").status == 400);
}

TEST_CASE("a pulled value is read before a condition is judged", "[engine][R0.11]") {
  Robot r;
  const std::string tag = r.bench.get("/arm/count").tag();
  r.robot.count = 100;
  CHECK(r.bench.ask("GET /arm/count\nIf-None-Match: " + tag).status == 200);
}

TEST_CASE("If-Match guards PUT: of two writers with the same tag one wins", "[engine][rdf_xml][R0.6][R0.11]") {
  Robot r;
  SECTION("pulled") {
    const std::string tag = r.bench.get("/arm/count").tag();
    const auto first = r.bench.send(Bench::turtle_request("PUT", "/arm/count", number_body("1"), "If-Match: " + tag + "\n"));
    const auto second = r.bench.send(Bench::turtle_request("PUT", "/arm/count", number_body("2"), "If-Match: " + tag + "\n"));
    r.bench.run();
    CHECK(r.bench.answer(first)->status == 204);
    CHECK(r.bench.answer(second)->status == 412);
    CHECK(r.robot.count == 1);
  }
  SECTION("pushed") {
    const std::string tag = r.bench.get("/arm/angle").tag();
    const auto first = r.bench.send(Bench::turtle_request("PUT", "/arm/angle", number_body("1", "maths:Degree"), "If-Match: " + tag + "\n"));
    const auto second = r.bench.send(Bench::turtle_request("PUT", "/arm/angle", number_body("2", "maths:Degree"), "If-Match: " + tag + "\n"));
    r.bench.run();
    CHECK(r.bench.answer(first)->status == 204);
    CHECK(r.bench.answer(second)->status == 412);
    CHECK(r.robot.angle == 1);
  }
  SECTION("a tag of any media type will do") {
    const std::string tag = r.bench.ask("GET /arm/count\nAccept: application/rdf+xml").tag();
    CHECK(r.bench.turtle("PUT", "/arm/count", number_body("3"), "If-Match: " + tag + "\n").status == 204);
  }
  SECTION("a weak tag matches nothing") {
    const std::string tag = r.bench.get("/arm/count").tag();
    CHECK(r.bench.turtle("PUT", "/arm/count", number_body("3"), "If-Match: W/" + tag + "\n").status == 412);
  }
  SECTION("* matches what exists, and If-None-Match: * does not") {
    CHECK(r.bench.turtle("PUT", "/arm/count", number_body("3"), "If-Match: *\n").status == 204);
    CHECK(r.bench.turtle("PUT", "/arm/count", number_body("4"), "If-None-Match: *\n").status == 412);
    CHECK(r.robot.count == 3);
    CHECK(r.bench.turtle("PUT", "/arm/count", number_body("4"), "If-None-Match: \"x\"\n").status == 204);
  }
  SECTION("an empty If-Match matches nothing, an empty If-None-Match excludes nothing") {
    const Answer empty = r.bench.turtle("PUT", "/arm/count", number_body("3"), "If-Match: \n");
    CHECK(empty.status == 412);
    CHECK(empty.says("If-Match: expected an entity tag, found none"));
    CHECK(r.robot.count == 7);
    CHECK(r.bench.turtle("PUT", "/arm/count", number_body("3"), "If-None-Match: \n").status == 204);
  }
  SECTION("a malformed one is 400 and nothing is written") {
    CHECK(r.bench.turtle("PUT", "/arm/count", number_body("3"), "If-Match: x\n").status == 400);
    CHECK(r.robot.count == 7);
  }
  SECTION("the tag of before a publish is old") {
    const std::string tag = r.bench.get("/arm/angle").tag();
    r.robot.angle_handle->publish(33);
    CHECK(r.bench.turtle("PUT", "/arm/angle", number_body("1", "maths:Degree"), "If-Match: " + tag + "\n").status == 412);
    CHECK(r.robot.angle == 10);
  }
}

TEST_CASE("If-Match guards DELETE and POST too", "[engine][R0.11]") {
  Robot r;
  REQUIRE(r.bench.ask("POST /arm/actions/grip").status == 204);
  const std::string running = r.bench.get("/arm/actions/grip/i1").tag();
  r.robot.grips[0].succeed();
  CHECK(r.bench.ask("DELETE /arm/actions/grip/i1\nIf-Match: " + running).status == 412);
  CHECK(r.bench.get("/arm/actions/grip/i1").status == 200);
  CHECK(r.bench.ask("DELETE /arm/actions/grip/i1\nIf-Match: " + r.bench.get("/arm/actions/grip/i1").tag()).status == 204);
  CHECK(r.bench.ask("POST /arm/actions/home\nIf-Match: \"x\"").status == 412);
  CHECK(r.robot.homed == 0);
}

TEST_CASE("responses that depend on Accept have Vary", "[engine][R0.11]") {
  Robot r;
  for (const char* request : {"GET /arm", "HEAD /arm", "GET /arm\nAccept: image/png", "GET /nowhere", "PATCH /arm", "GET /arm\nIf-None-Match: *"}) {
    CAPTURE(request);
    CHECK(r.bench.ask(request).field("Vary") == "Accept");
  }
}

TEST_CASE("responses that depend on Prefer say so in Vary, whether the request has it or not", "[engine][rdf_xml][R0.7][R0.11]") {
  Robot r;
  const std::string pose = "Content-Type: application/json\n\n{\"x\":1,\"y\":2,\"frame\":\"base\"}";
  for (const std::string fields :
       {"", "Prefer: return=representation\n", "Prefer: return=minimal\n", "Prefer: wait=0\n", "Prefer: respond-async\n"}) {
    for (const std::string& request :
         {std::string("GET /\n"), std::string("HEAD /arm/subscriptions\n"), std::string("GET /arm/waypoints\nIf-None-Match: *\n"),
          std::string("GET /arm/waypoints\nAccept: image/png\n"), "PUT /arm/angle\n" + fields + "Content-Type: application/json\n\n12",
          "PUT /arm/angle\n" + fields + "Content-Type: application/json\n\n\"x\"", "POST /arm/actions/grip\n" + fields,
          "POST /arm/actions/home\n" + fields, "POST /arm/waypoints\n" + fields + pose}) {
      CAPTURE(request);
      CHECK(r.bench.ask(request.find(fields) == std::string::npos ? request + fields : request).members("Vary") ==
            std::set<std::string>{"Accept", "Prefer"});
    }
  }
  for (const char* request : {"GET /arm", "GET /arm/angle", "GET /arm/actions/grip", "GET /arm/blueprint"}) {
    CAPTURE(request);
    CHECK(r.bench.ask(request).field("Vary") == "Accept");
  }
}

// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

const std::string pose =
    "<> a maths:Vector3D ; maths:x [ vom:numericalValue 1 ; qudt:hasUnit unit:M ] ; maths:y [ vom:numericalValue 2 ; qudt:hasUnit unit:M ] ;"
    " <http://localhost/ns/vocabulary#Pose/frame> \"base\" .";

struct Robot {
  explicit Robot(engine::EngineOptions options = {}) : bench(std::move(options)) { bench.add(robot.arm()); }
  std::size_t members() {
    return bench.get("/arm/waypoints").graph().objects(rdf::iri("http://localhost/arm/waypoints"), vocab::ldp::contains).size();
  }
  SampleRobot robot;
  Bench bench;
};

}  // namespace

TEST_CASE("POST to a collection creates a member: 201, Location, ldp:contains", "[engine][R0.5][R0.7][R0.8]") {
  Robot r;
  CHECK(r.members() == 0);
  const std::string before = r.bench.get("/arm/waypoints").tag();
  const Answer a = r.bench.turtle("POST", "/arm/waypoints", pose);
  CHECK(a.status == 201);
  CHECK(a.body.empty());
  CHECK(a.field("Location") == "http://localhost/arm/waypoints/i1");
  const Answer container = r.bench.get("/arm/waypoints");
  CHECK(container.tag() != before);
  CHECK(missing(container, "<arm/waypoints> a ldp:BasicContainer ; ldp:contains <arm/waypoints/i1> . <arm/waypoints/i1> a ldp:RDFSource .") == "");
  CHECK(container.links_to("http://localhost/arm/waypoints/i1", "related"));
  const Answer member = r.bench.get("/arm/waypoints/i1");
  CHECK(missing(member,
                "<arm/waypoints/i1> a maths:Vector3D ; maths:x [ vom:numericalValue \"1\"^^xsd:double ] ; <ns/vocabulary#Pose/frame> \"base\" .") ==
        "");
  CHECK(member.links_to("http://localhost/arm/waypoints", "up"));
}

TEST_CASE("a POST with return=representation gives the member", "[engine][R0.7]") {
  Robot r;
  const Answer a = r.bench.turtle("POST", "/arm/waypoints", pose, "Prefer: return=representation\n");
  CHECK(a.status == 201);
  CHECK(a.field("Preference-Applied") == "return=representation");
  const Answer member = r.bench.get("/arm/waypoints/i1");
  CHECK(a.body == member.body);
  CHECK(a.tag() == member.tag());
  CHECK(a.field("Location") == a.field("Content-Location"));
}

TEST_CASE("DELETE of a member takes it out of its container", "[engine][R0.5]") {
  Robot r;
  r.bench.turtle("POST", "/arm/waypoints", pose);
  r.bench.turtle("POST", "/arm/waypoints", pose);
  CHECK(r.bench.ask("DELETE /arm/waypoints/i1\nIf-Match: \"old\"").status == 412);
  CHECK(r.bench.ask("DELETE /arm/waypoints/i1").status == 204);
  CHECK(r.bench.get("/arm/waypoints/i1").status == 404);
  CHECK(r.bench.ask("DELETE /arm/waypoints/i1").status == 404);
  CHECK(r.members() == 1);
  CHECK(r.bench.turtle("POST", "/arm/waypoints", pose).field("Location") == "http://localhost/arm/waypoints/i3");  // no URI twice
}

TEST_CASE("what the lambdas of a collection refuse is 409 and changes nothing", "[engine][R0.6]") {
  Robot r;
  r.bench.turtle("POST", "/arm/waypoints", pose);
  r.robot.locked = true;
  const Answer refused = r.bench.turtle("POST", "/arm/waypoints", pose);
  CHECK(refused.status == 409);
  CHECK(refused.says("the robot is locked"));
  CHECK_FALSE(refused.has("Location"));
  CHECK(r.bench.ask("DELETE /arm/waypoints/i1").status == 409);
  CHECK(r.members() == 1);
  r.robot.locked = false;
  CHECK(r.bench.ask("DELETE /arm/waypoints/i1").status == 204);
}

TEST_CASE("a full collection is 409, and counts what is on its way", "[engine][R0.6]") {
  Robot r;  // at most 3
  std::vector<Bench::Sent> sent;
  for (int i = 0; i < 5; ++i) sent.push_back(r.bench.send(Bench::turtle_request("POST", "/arm/waypoints", pose)));
  r.bench.run();
  std::vector<int> statuses;
  for (const auto& s : sent) statuses.push_back(r.bench.answer(s)->status);
  CHECK(statuses == std::vector<int>{201, 201, 201, 409, 409});
  r.bench.ask("DELETE /arm/waypoints/i1");
  CHECK(r.bench.turtle("POST", "/arm/waypoints", pose).status == 201);
}

TEST_CASE("two DELETEs of one member: the second is 409 while the first is under way", "[engine][R0.6]") {
  Robot r;
  r.bench.turtle("POST", "/arm/waypoints", pose);
  const auto first = r.bench.send("DELETE /arm/waypoints/i1"), second = r.bench.send("DELETE /arm/waypoints/i1");
  CHECK(second.answer.status == 409);
  r.bench.run();
  CHECK(r.bench.answer(first)->status == 204);
}

TEST_CASE("a collection without lambdas is a container that is only read", "[engine][R0.5]") {
  Bench bench;
  Thing thing{"arm"};
  thing.collection<int>("closed");
  bool thrown = false;
  thing.collection<int>("throwing").on_create([&](const std::string& id, int) {
    CHECK(id == "i1");
    thrown = true;
    throw 1;
  });
  bench.add(std::move(thing));
  CHECK(bench.turtle("POST", "/arm/closed", "<> vom:numericalValue 1 .").status == 405);
  CHECK(bench.get("/arm/closed").members("Allow") == std::set<std::string>{"GET", "HEAD", "OPTIONS"});
  CHECK(bench.turtle("POST", "/arm/throwing", "<> vom:numericalValue 1 .").status == 500);
  CHECK(thrown);
}

TEST_CASE("a collection pages above 500 members", "[engine][R0.9]") {
  Bench bench;
  Thing thing{"arm"};
  thing.collection<int>("c").on_create([](int) {}).max_members(2000);
  bench.add(std::move(thing));
  for (int i = 0; i < 501; ++i) REQUIRE(bench.turtle("POST", "/arm/c", "<> vom:numericalValue 1 .").status == 201);
  const Answer first = bench.get("/arm/c"), second = bench.get("/arm/c?page=2");
  CHECK(first.graph().objects(rdf::iri("http://localhost/arm/c"), vocab::ldp::contains).size() == 500);
  CHECK(second.graph().objects(rdf::iri("http://localhost/arm/c"), vocab::ldp::contains).size() == 1);
  CHECK(first.links_to("http://localhost/arm/c?page=2", "next"));
  CHECK(bench.turtle("POST", "/arm/c?page=2", "<http://localhost/arm/c> vom:numericalValue 1 .").status == 201);
}

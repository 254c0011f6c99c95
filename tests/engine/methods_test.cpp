// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

struct Robot {
  explicit Robot(engine::EngineOptions options = {}) : bench(std::move(options)) {
    bench.add(robot.arm());
    bench.add(robot.tool());
    CHECK(bench.ask("POST /arm/actions/home").status == 204);  // i1
    CHECK(bench
              .turtle("POST", "/arm/waypoints",
                      "<> a maths:Vector3D ; maths:x [ vom:numericalValue 1 ; qudt:hasUnit unit:M ] ; maths:y [ vom:numericalValue 2 ;"
                      " qudt:hasUnit unit:M ] ; <http://localhost/ns/vocabulary#Pose/frame> \"base\" .")
              .status == 201);  // i2
  }
  SampleRobot robot;
  Bench bench;
};

struct Allowed {
  const char* path;
  const char* methods;  ///< besides GET, HEAD, OPTIONS
};
const Allowed resources[] = {
    {"/", ""},
    {"/ns/lrt", ""},
    {"/arm", ""},
    {"/arm/tool/state", ""},
    {"/arm/blueprint", ""},
    {"/arm/subscriptions", "POST"},
    {"/arm/angle", "PUT"},
    {"/arm/speed", ""},
    {"/arm/count", "PUT"},
    {"/arm/actions/turn", "POST"},
    {"/arm/actions/grip", "POST"},
    {"/arm/actions/home/i1", "DELETE"},
    {"/arm/waypoints", "POST"},
    {"/arm/waypoints/i2", "DELETE"},
};

const std::string ldp = "http://www.w3.org/ns/ldp#";

}  // namespace

TEST_CASE("OPTIONS on every resource has the methods that it allows, and GET and HEAD have the same", "[engine][json_ld][rdf_xml][R0.10]") {
  Robot r;
  for (const Allowed& resource : resources) {
    CAPTURE(resource.path);
    std::set<std::string> expected = {"GET", "HEAD", "OPTIONS"};
    if (*resource.methods) expected.insert(resource.methods);
    const Answer options = r.bench.ask(std::string("OPTIONS ") + resource.path);
    CHECK(options.status == 204);
    CHECK(options.body.empty());
    CHECK(options.members("Allow") == expected);
    CHECK(r.bench.get(resource.path).members("Allow") == expected);
    CHECK(r.bench.ask(std::string("HEAD ") + resource.path).members("Allow") == expected);
    const bool posts = expected.count("POST") != 0;
    CHECK(options.has("Accept-Post") == posts);
    if (posts) {
      std::set<std::string> types = {"text/turtle",         "application/n-triples", "application/rdf+xml",
                                     "application/ld+json", "application/trig",      "application/n-quads"};
      if (std::string(resource.path).find("subscriptions") == std::string::npos) types.insert({"application/json", "text/plain", "application/cbor"});
      CHECK(options.members("Accept-Post") == types);
    }
    CHECK_FALSE(options.has("Accept-Patch"));  // there is no PATCH
  }
  CHECK(r.bench.ask("OPTIONS /nowhere").status == 404);
}

TEST_CASE("OPTIONS links to the class of the resource's kind, which no representation can change", "[engine][R0.9]") {
  Robot r;
  const std::string hybrit = "https://hybr-it-projekt.de/ns/hybr-it#", lrt = "https://w3id.org/lrt/ns#";
  for (const auto& [path, its_class] : std::vector<std::pair<std::string, std::string>>{{"/arm", hybrit + "RoboticThing"},
                                                                                        {"/arm/angle", hybrit + "Property"},
                                                                                        {"/arm/actions/turn", hybrit + "Action"},
                                                                                        {"/arm/actions/home/i1", lrt + "Invocation"}}) {
    CAPTURE(path);
    CHECK(r.bench.ask("OPTIONS " + path).links_to(its_class, "type"));
  }
  for (const std::string path : {"/", "/arm/state", "/arm/waypoints", "/arm/waypoints/i2"})
    for (const char* name : {"RoboticThing", "Property", "Action"}) CHECK_FALSE(r.bench.ask("OPTIONS " + path).links_to(hybrit + name, "type"));
}

TEST_CASE("OPTIONS * has the methods of the server", "[engine][R0.10]") {
  Robot r;
  const Answer a = r.bench.ask("OPTIONS *");
  CHECK(a.status == 204);
  CHECK(a.members("Allow").count("POST") == 1);
}

TEST_CASE("a method that a resource does not have is 405 with Allow, and nothing happens", "[engine][R0.5][R0.6][R0.10]") {
  Robot r;
  const double angle = r.robot.angle;
  for (const Allowed& resource : resources)
    for (const char* method : {"PUT", "POST", "DELETE", "PATCH"}) {
      if (std::string(resource.methods) == method) continue;
      CAPTURE(resource.path, method);
      const Answer a = r.bench.turtle(method, resource.path, number_body("1", "maths:Degree"));
      CHECK(a.status == 405);
      std::set<std::string> expected = {"GET", "HEAD", "OPTIONS"};
      if (*resource.methods) expected.insert(resource.methods);
      CHECK(a.members("Allow") == expected);
      CHECK(a.says("\"status\":405"));
    }
  CHECK(r.robot.angle == angle);
  CHECK(r.robot.homed == 1);
  CHECK(r.bench.get("/arm/waypoints/i2").status == 200);
}

TEST_CASE("a method that HTTP does not know is 501", "[engine][R0.6]") {
  Robot r;
  CHECK(r.bench.ask("BREW /arm").status == 501);
  CHECK(r.bench.ask("PROPFIND /nowhere").status == 501);
}

TEST_CASE("HEAD has the status and fields of GET", "[engine][json_ld][R0.5][R0.11]") {
  Robot r;
  for (const Allowed& resource : resources)
    for (const char* accept : {"text/turtle", "application/n-triples", "application/rdf+xml", "application/ld+json", "image/png"}) {
      CAPTURE(resource.path, accept);
      const std::string rest = std::string(resource.path) + "\nAccept: " + accept;
      const Answer get = r.bench.ask("GET " + rest), head = r.bench.ask("HEAD " + rest);
      CHECK(head.status == get.status);
      CHECK(head.fields.block() == get.fields.block());
    }
}

TEST_CASE("every response about a resource has its LDP type", "[engine][R0.9]") {
  Robot r;
  for (const Allowed& resource : resources) {
    const bool container =
        std::string(resource.path) == "/" || std::string(resource.path) == "/arm/waypoints" || std::string(resource.path) == "/arm/subscriptions";
    const std::string path = resource.path;
    const auto check = [&](const Answer& a, const char* what) {
      CAPTURE(path, what, a.status);
      CHECK(a.links_to(ldp + "Resource", "type"));
      if (container) CHECK(a.links_to(ldp + "BasicContainer", "type"));  // LDP 5.2.1.4
    };
    const Answer get = r.bench.get(path);
    check(get, "GET");
    if (path != "/ns/lrt") CHECK(get.links_to(ldp + "RDFSource", "type"));
    check(r.bench.ask("HEAD " + path), "HEAD");
    check(r.bench.ask("OPTIONS " + path), "OPTIONS");
    check(r.bench.ask("PATCH " + path), "PATCH");
    check(r.bench.ask("GET " + path + "\nAccept: image/png"), "406");
    check(r.bench.ask("GET " + path + "\nIf-Match: \"x\""), "412");
    check(r.bench.ask("GET " + path + "\nIf-None-Match: *"), "304");
    if (std::string(resource.methods) == "PUT" || std::string(resource.methods) == "POST") {
      check(r.bench.ask(std::string(resource.methods) + " " + path + "\nContent-Type: a/b\n\nx"), "415");
      check(r.bench.turtle(resource.methods, path, "."), "400");
    }
  }
  const Answer done = r.bench.turtle("PUT", "/arm/count", number_body("1"));
  CHECK(done.status == 204);
  CHECK(done.links_to(ldp + "Resource", "type"));
  const Answer made =
      r.bench.turtle("POST", "/arm/waypoints",
                     "<> maths:x [ vom:numericalValue 1 ; qudt:hasUnit unit:M ] ; maths:y [ vom:numericalValue 2 ; qudt:hasUnit unit:M ] ;"
                     " <http://localhost/ns/vocabulary#Pose/frame> \"base\" .");
  CHECK(made.status == 201);
  CHECK(made.links_to(ldp + "BasicContainer", "type"));
  CHECK(r.bench.ask("DELETE /arm/waypoints/i2").links_to(ldp + "Resource", "type"));
}

TEST_CASE("a refused PUT or POST says what constrains it", "[engine][R0.9][R1.11]") {
  Robot r;
  r.robot.locked = true;
  const auto check = [&](const Answer& a, int status) {
    CAPTURE(a.body);
    CHECK(a.status == status);
    CHECK((a.links_to("http://localhost" + kind_of(r.bench, "/arm"), ldp + "constrainedBy") ||
           a.links_to("http://localhost" + bounds_of(r.bench, "/arm"), ldp + "constrainedBy")));
  };
  check(r.bench.turtle("PUT", "/arm/angle", "broken ["), 400);
  check(r.bench.turtle("PUT", "/arm/speed", number_body("1")), 405);
  check(r.bench.turtle("PUT", "/arm/angle", number_body("1", "maths:Degree")), 409);
  check(r.bench.turtle("PUT", "/arm/count", number_body("1"), "If-Match: \"old\"\n"), 412);
  check(r.bench.ask("PUT /arm/angle\nContent-Type: text/csv\n\n1"), 415);
  check(r.bench.turtle("PUT", "/arm/angle", number_body("91", "maths:Degree")), 422);
  check(r.bench.turtle("POST", "/arm/actions/turn", ""), 422);
  check(r.bench.turtle("POST", "/arm/waypoints", ""), 422);
  check(r.bench.ask("POST /arm"), 405);
}

TEST_CASE("a POST may not request a member that is a container", "[engine][R0.5]") {
  Robot r;
  const std::string member =
      "<> maths:x [ vom:numericalValue 1 ; qudt:hasUnit unit:M ] ; maths:y [ vom:numericalValue 2 ; qudt:hasUnit unit:M ] ;"
      " <http://localhost/ns/vocabulary#Pose/frame> \"base\" .";
  for (const char* model : {"Container", "BasicContainer", "DirectContainer", "IndirectContainer", "NonRDFSource"})
    for (const char* form : {"; rel=\"type\"", ";rel=type", "; title=\"x\"; REL = \"type\""}) {
      CAPTURE(model, form);
      CHECK(r.bench.turtle("POST", "/arm/waypoints", member, "Link: <" + ldp + model + ">" + form + "\n").status == 409);
    }
  CHECK(r.bench.turtle("POST", "/arm/waypoints", member, "Link: <http://a.example/>; rel=\"type\", <" + ldp + "BasicContainer>; rel=type\n").status ==
        409);
  CHECK(
      r.bench.turtle("POST", "/arm/waypoints", member, "Link: <" + ldp + "Resource>; rel=\"type\", <" + ldp + "RDFSource>; rel=\"type\"\n").status ==
      201);
  CHECK(r.bench.turtle("POST", "/arm/waypoints", member, "Link: <" + ldp + "BasicContainer>; rel=\"describedby\"\n").status == 201);
}

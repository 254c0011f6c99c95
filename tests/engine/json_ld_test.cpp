// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include <string>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

constexpr const char* inlined = "application/ld+json;profile=\"https://w3id.org/lrt/ns#inlineContext\"";

struct Robot {
  explicit Robot(engine::EngineOptions options = {}) : bench(std::move(options)) { bench.add(robot.arm()); }

  Answer get(const std::string& path, const std::string& accept = "application/ld+json") { return bench.ask("GET " + path + "\nAccept: " + accept); }
  Answer send(const std::string& method, const std::string& path, const std::string& body, const std::string& type = "application/ld+json") {
    return bench.ask(method + " " + path + "\nContent-Type: " + type + "\n\n" + body);
  }
  /// By which representations refer to the context.
  std::string context() {
    const std::string body = get("/arm").body, before = "\"@context\": \"";
    const std::size_t from = body.find(before) + before.size();
    return body.substr(from, body.find('"', from) - from);
  }

  SampleRobot robot;
  Bench bench;
};

/// The request of Figure 5b, as JSON-LD.
std::string figure_5b(const std::string& value = "43.6", const std::string& context = "\"/ns/context.jsonld\"") {
  return "{\"@context\": " + context + ", \"id\": \"\", \"type\": \"Scalar\", \"numericalValue\": " + value + ", \"unit\": \"maths:Degree\"}";
}

}  // namespace

TEST_CASE("every resource has a JSON-LD representation that refers to the robot's context", "[engine][json_ld][R1.2]") {
  Robot r;
  for (const char* path : {"/", "/arm", "/arm/angle", "/arm/pose", "/arm/gains", "/arm/blueprint", "/arm/actions/turn", "/arm/subscriptions",
                           "/arm/waypoints", "/ns/lrt"}) {
    CAPTURE(path);
    const Answer answer = r.get(path);
    REQUIRE(answer.status == 200);
    CHECK(answer.field("Content-Type") == "application/ld+json");
    CHECK(answer.body.find("{\n  \"@context\": \"http://localhost/ns/context.jsonld?v=") == 0);
    CHECK(rdf::isomorphic(answer.graph(), r.bench.get(path).graph()));
    CHECK(r.bench.ask(std::string("GET ") + path + "\nAccept: application/ld+json\nIf-None-Match: " + answer.tag()).status == 304);
  }
  const Answer angle = r.get("/arm/angle");
  CHECK(angle.says("  \"id\": \"http://localhost/arm/angle\",\n  \"type\": [\"Property\", \"Scalar\"],\n"));
  CHECK(angle.says("  \"unit\": \"maths:Degree\",\n"));
  CHECK(angle.says("\"modified\": \"20"));
}

TEST_CASE("the context is a resource that may be kept, and changes its name when it changes", "[engine][json_ld][R1.2]") {
  Robot r;
  const std::string iri = r.context();
  REQUIRE(iri.find("http://localhost/ns/context.jsonld?v=") == 0);
  const Answer context = r.bench.get(iri.substr(16));
  CHECK(context.status == 200);
  CHECK(context.field("Content-Type") == "application/ld+json");
  CHECK(context.field("Cache-Control") == "max-age=31536000, immutable");  // RFC 8246: the query names the version
  CHECK(r.bench.ask("GET " + iri.substr(16) + "\nIf-None-Match: " + context.tag()).field("Cache-Control") == "max-age=31536000, immutable");
  CHECK(r.bench.get("/ns/context.jsonld?v=another").field("Cache-Control") == "max-age=86400");
  CHECK(context.field("Allow") == "GET, HEAD, OPTIONS");
  CHECK(context.body == rdf::json_ld_context());
  CHECK(r.bench.get("/ns/context.jsonld").body == context.body);
  const Answer kept = r.bench.ask("GET /ns/context.jsonld\nIf-None-Match: " + context.tag());
  CHECK(kept.status == 304);
  CHECK(kept.field("Cache-Control") == "max-age=86400");
  CHECK(r.get("/ns/context.jsonld", "application/ld+json, application/json").status == 200);
  const Answer turtle = r.get("/ns/context.jsonld", "text/turtle");
  CHECK(turtle.status == 406);
  CHECK(turtle.says("available are application/ld+json"));
  CHECK(r.send("PUT", "/ns/context.jsonld", "{}").status == 405);
  CHECK(r.bench.ask("GET /ns/context.jsonld\nUpgrade: websocket\nConnection: Upgrade").status == 200);

  engine::EngineOptions options;
  options.prefixes.emplace_back("mine", "http://mine/");
  Robot other(std::move(options));
  CHECK(other.context() != iri);
  CHECK(other.bench.get("/ns/context.jsonld").says("\"mine\": \"http://mine/\""));
}

TEST_CASE("a client that cannot fetch the context requests it in the document", "[engine][json_ld][R1.2]") {
  Robot r;
  const Answer answer = r.get("/arm/angle", inlined);
  CHECK(answer.status == 200);
  CHECK(answer.field("Content-Type") == inlined);
  CHECK(answer.body.find("{\n  \"@context\": {\n") == 0);
  CHECK(answer.tag() != r.get("/arm/angle").tag());
  CHECK(rdf::isomorphic(rdf::read(answer.body, rdf::Syntax::json_ld, {}).value(), r.bench.get("/arm/angle").graph()));
  CHECK(r.get("/arm/angle", std::string("text/turtle;q=0.5, ") + inlined).field("Content-Type") == inlined);
  // JSON-LD's own profiles are a wish.
  for (const char* form : {"compacted", "expanded", "flattened", "compacted http://www.w3.org/ns/json-ld#flattened"}) {
    CAPTURE(form);
    const std::string accept = std::string("application/ld+json;profile=\"http://www.w3.org/ns/json-ld#") + form + "\"";
    CHECK(r.get("/arm/angle", accept).field("Content-Type") == "application/ld+json");
  }
  CHECK(r.get("/arm/angle", "application/ld+json;profile=\"http://example.org/other\"").status == 406);
}

TEST_CASE("Figure 5b in JSON-LD moves the joint", "[engine][json_ld][R0.7][R0.8]") {
  Robot r;
  CHECK(r.send("POST", "/arm/actions/turn", figure_5b()).status == 204);
  CHECK(r.robot.turned_to == 43.6);
  const std::string full = r.context();
  CHECK(r.send("POST", "/arm/actions/turn", figure_5b("44", "\"" + full + "\"")).status == 204);
  CHECK(r.robot.turned_to == 44);
  CHECK(r.send("POST", "/arm/actions/turn", figure_5b("0.30000000000000004", "\"https://w3id.org/lrt/context.jsonld\"")).status == 204);
  CHECK(r.robot.turned_to == 0.30000000000000004);
  CHECK(r.send("POST", "/arm/actions/turn",
               R"([{"@id": "http://localhost/arm/actions/turn", "@type": ["http://vocab.arvida.de/2015/06/maths/vocab#Scalar"],
      "http://vocab.arvida.de/2015/06/vom/vocab#numericalValue": [{"@value": "45.5", "@type": "http://www.w3.org/2001/XMLSchema#float"}],
      "http://vocab.arvida.de/2015/06/vom/vocab#unit": [{"@id": "http://vocab.arvida.de/2015/06/maths/vocab#Degree"}]}])",
               "application/ld+json; charset=utf-8; profile=\"http://www.w3.org/ns/json-ld#expanded\"")
            .status == 204);
  CHECK(r.robot.turned_to == 45.5);
}

TEST_CASE("PUT takes JSON-LD, and what GET gave", "[engine][json_ld][R0.5]") {
  Robot r;
  CHECK(r.send("PUT", "/arm/angle", figure_5b("20.5")).status == 204);
  CHECK(r.robot.angle == 20.5);
  CHECK(r.send("PUT", "/arm/gains", R"({"@context": "/ns/context.jsonld", "id": "", "value": {"@list": [0.25, 3, 1e-7]}})").status == 204);
  CHECK(r.robot.gains == std::vector<double>{0.25, 3, 1e-7});
  for (const char* type : {"application/ld+json", inlined}) {
    const Answer before = r.get("/arm/gains", type);
    r.robot.gains.push_back(5);
    CHECK(r.send("PUT", "/arm/gains", before.body, type).status == 204);
    CHECK(r.robot.gains == std::vector<double>{0.25, 3, 1e-7});
  }
}

TEST_CASE("a body may refer to a context that the host has registered", "[engine][json_ld][R0.5]") {
  engine::EngineOptions options;
  options.contexts
      .add("http://stranger.example/c", R"({"@context": [{"id": "@id", "reading": {
      "@id": "http://vocab.arvida.de/2015/06/vom/vocab#numericalValue", "@type": "http://www.w3.org/2001/XMLSchema#double"}}]})")
      .value();
  Robot r(std::move(options));
  const std::string members =
      R"("id": "", "reading": 43.6, "http://vocab.arvida.de/2015/06/vom/vocab#unit": {"id": "http://vocab.arvida.de/2015/06/maths/vocab#Degree"}})";
  CHECK(r.send("PUT", "/arm/angle", R"({"@context": "http://stranger.example/c", )" + members).status == 204);
  const Answer other = r.send("PUT", "/arm/angle", R"({"@context": "http://stranger.example/d", )" + members);
  CHECK(other.status == 422);
  CHECK(other.says("the context <http://stranger.example/d> is not registered, and lrt fetches none"));
}

TEST_CASE("JSON-LD bodies that are none say what is wrong, and where", "[engine][json_ld][R0.6]") {
  Robot r;
  const auto put = [&](const std::string& body) { return r.send("PUT", "/arm/angle", body); };
  const Answer broken = put("{\n  \"id\": ,\n}");
  CHECK(broken.status == 400);
  CHECK(broken.says("line 2, column 9"));
  const Answer foreign = put(figure_5b("20", "\"https://schema.org/\""));
  CHECK(foreign.status == 422);
  CHECK(foreign.says("the context <https://schema.org/> is not registered"));
  CHECK(foreign.says("http://localhost/ns/context.jsonld"));
  const Answer twice = put(R"({"@id": "", "http://e/p": 1, "http://e/p": 2})");
  CHECK(twice.status == 400);
  CHECK(twice.says("a second member of this name"));
  const Answer named = put(R"({"@id": "http://g/", "@graph": []})");
  CHECK(named.status == 422);
  CHECK(named.says("a named graph, where one graph is read, is not supported"));
  CHECK(put(std::string(300, '[')).status == 413);
  const Answer violates = put(figure_5b("200"));
  CHECK(violates.status == 422);
  const Answer empty = put("{}");
  CHECK(empty.status == 422);
  CHECK(r.robot.angle == 10);
  const Answer other = r.send("POST", "/arm/actions/turn", "43.6", "application/xml");
  CHECK(other.status == 415);
  CHECK(other.says("application/ld+json"));
  CHECK(other.members("Accept-Post").count("application/ld+json") == 1);
  // The report, too.
  const Answer report = r.bench.ask("PUT /arm/angle\nAccept: application/ld+json\nContent-Type: application/ld+json\n\n" + figure_5b("200"));
  CHECK(report.status == 422);
  CHECK(report.field("Content-Type") == "application/ld+json");
  CHECK(report.says("\"sh:conforms\": false"));
}

TEST_CASE("a subscriber gets the JSON-LD that GET would give", "[engine][json_ld][R0.12][R0.17]") {
  Robot r;
  CHECK(r.bench.messages(r.bench.open("/arm/angle?accept=application%2Fld%2Bjson")) == std::vector<std::string>{r.get("/arm/angle").body});
  const auto channel = r.bench.open("/arm/angle", std::string("Accept: ") + inlined + "\n");
  CHECK(r.bench.messages(channel) == std::vector<std::string>{r.get("/arm/angle", inlined).body});
  CHECK(r.bench.get("/arm/subscriptions/i2").says("inlineContext"));
}

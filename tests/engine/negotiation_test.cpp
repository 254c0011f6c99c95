// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include <set>
#include <string>

#include <lrt/rdf/codec.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;

TEST_CASE("a representation is Turtle unless Accept selects another", "[engine][rdf_xml][R1.2]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  const auto type = [&](const char* accept) {
    const Answer a = bench.ask(std::string("GET /arm\nAccept: ") + accept);
    return a.status == 200 ? a.field("Content-Type") : std::to_string(a.status);
  };
  CHECK(bench.get("/arm").field("Content-Type") == "text/turtle");
  const std::string turtle = "text/turtle", triples = "application/n-triples", xml = "application/rdf+xml";
  CHECK(type("*/*") == turtle);
  CHECK(type("text/*") == turtle);
  CHECK(type("") == turtle);
  CHECK(type("application/*") == triples);
  CHECK(type("application/rdf+xml") == xml);
  CHECK(type("application/rdf+xml;q=0.5, text/turtle;q=0.4") == xml);
  CHECK(type("application/rdf+xml;q=0.5, text/turtle;q=0.5") == turtle);
  CHECK(type("application/rdf+xml, */*;q=0.1") == xml);
  CHECK(type("text/turtle;q=0, */*") == triples);
  CHECK(type("text/turtle;q=0") == "406");
  CHECK(type("*/*;q=0") == "406");
  CHECK(type("image/png") == "406");
  CHECK(type("TEXT/Turtle") == turtle);
  CHECK(type("text/turtle; charset=utf-8") == turtle);
  CHECK(type("text/turtle;q=1.001, application/rdf+xml;q=0.1") == xml);
  CHECK(type("application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8") == turtle);
  CHECK(bench.ask("GET /arm\nAccept: image/png\nAccept: application/n-triples").field("Content-Type") == triples);
}

TEST_CASE("406 lists what there is", "[engine][json_ld][rdf_xml][R0.6][R1.2]") {
  Bench bench;
  const Answer a = bench.ask("GET /\nAccept: image/png");
  CHECK(a.status == 406);
  for (const char* type : {"text/turtle", "application/n-triples", "application/rdf+xml", "application/ld+json"}) CHECK(a.says(type));
  CHECK(a.field("Content-Type") == "application/problem+json");
}

TEST_CASE("what is offered and taken is what this build can read and write", "[engine][R0.6][R1.2]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  std::set<std::string> available;
  for (const rdf::Syntax syntax : rdf::available_syntaxes()) available.emplace(rdf::media_type(syntax));
  const Answer refused = bench.ask("PUT /arm/angle\nContent-Type: image/png\n\nx");
  const Answer none = bench.ask("GET /arm\nAccept: image/png");
  const std::set<std::string> taken = refused.members("Accept");
  for (const char* type : {"text/turtle", "application/n-triples", "application/rdf+xml", "application/ld+json"}) {
    CAPTURE(type);
    const bool has = available.count(type) != 0;
    CHECK(bench.ask(std::string("GET /arm\nAccept: ") + type).status == (has ? 200 : 406));
    CHECK(bench.ask(std::string("GET /arm?accept=") + type).status == (has ? 200 : 406));
    CHECK(bench.ask(std::string("PUT /arm/angle\nContent-Type: ") + type + "\n\n<").status == (has ? 400 : 415));
    CHECK((taken.count(type) != 0) == has);
    CHECK(none.says(type) == has);
    CHECK((bench.get("/arm").field("Link").find(type) != std::string::npos) == has);
  }
  CHECK(bench.get("/ns/context.jsonld").status == (available.count("application/ld+json") != 0 ? 200 : 404));
}

TEST_CASE("the media types carry the same graph", "[engine][json_ld][rdf_xml][R1.2]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  for (const char* path : {"/", "/arm", "/arm/pose", "/arm/gains", "/arm/blueprint", "/arm/actions/turn"}) {
    CAPTURE(path);
    const rdf::Graph turtle = bench.get(path).graph();
    for (const char* type :
         {"application/n-triples", "application/rdf+xml", "application/ld+json;profile=\"https://w3id.org/lrt/ns#inlineContext\""}) {
      CAPTURE(type);
      const Answer a = bench.ask(std::string("GET ") + path + "\nAccept: " + type);
      REQUIRE(a.status == 200);
      CHECK(rdf::isomorphic(turtle, a.graph()));
    }
  }
}

TEST_CASE("RDF/XML that cannot carry a graph gives way to another type, or is 406", "[engine][R0.6][R1.2]") {
  Bench bench;
  Thing thing{"arm"};
  thing.add(Iri{"http://example.org/ns#1"}, "a predicate without a local name that XML could write");
  bench.add(std::move(thing));
  const Answer refused = bench.ask("GET /arm\nAccept: application/rdf+xml");
  CHECK(refused.status == 406);
  const Answer other = bench.ask("GET /arm\nAccept: application/rdf+xml, application/n-triples;q=0.5");
  CHECK(other.status == 200);
  CHECK(other.field("Content-Type") == "application/n-triples");
}

TEST_CASE("an error has a body that says what was found, in JSON or Turtle, and is never turned into 406", "[engine][R0.6]") {
  Bench bench;
  const Answer json = bench.get("/nowhere");
  CHECK(json.status == 404);
  CHECK(json.field("Content-Type") == "application/problem+json");
  CHECK(json.says("\"status\":404"));
  CHECK(json.says("\"title\":\"Not Found\""));
  const Answer turtle = bench.ask("GET /nowhere\nAccept: text/turtle");
  CHECK(turtle.status == 404);
  CHECK(missing(turtle, "[] a http-core:Response ; http-core:statusCodeValue 404 ; http-core:reasonPhrase \"Not Found\" .") == "");
  const Answer image = bench.ask("GET /nowhere\nAccept: image/png");
  CHECK(image.status == 404);
  CHECK(image.field("Content-Type") == "application/problem+json");
  CHECK(bench.ask("GET /nowhere\nAccept: application/json").field("Content-Type") == "application/json");
}

// SPDX-License-Identifier: Apache-2.0
// A robot whose values are one of several alternatives: its header, and the same robot made of the types of that header.
#include "tests/codegen/mover.hpp"

#include <lrt/codegen.hpp>

#include <fstream>
#include <sstream>
#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include <lrt/client.hpp>
#include <lrt/rdf/codec.hpp>

#include "tests/client/robot_host.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/mover.hpp"

using namespace lrt;

namespace {

/// The documents of a server, with a host and a port that do not differ.
rdf::Graph documents_of(Thing thing) {
  test::RobotHost host(test::one_thing(std::move(thing)));
  Client client = Client::create().value();
  const client::Robot robot = client.open(host.url()).value();
  std::vector<std::string> problems;
  const rdf::Graph graph = client::read_documents(client, robot, problems).value();
  CHECK(problems.empty());
  std::string text = rdf::write(graph, rdf::Syntax::n_triples).value();
  for (std::size_t at = 0; (at = text.find(host.url(), at)) != std::string::npos;) text.replace(at, host.url().size(), "http://robot.example/");
  return rdf::read(text, rdf::Syntax::n_triples, {}).value();
}

std::string header_of(const rdf::Graph& graph) {
  codegen::GenerateOptions options;
  options.name_space = "made";
  const Result<codegen::Generated> generated = codegen::generate(client::describe(graph).value(), options);
  if (!generated) FAIL(generated.error().message);
  CHECK(generated->warnings.empty());
  return generated->header;
}

/// Without values: the shapes, and what Things are.
std::string shapes_of(const rdf::Graph& graph) {
  rdf::Graph shapes;
  std::vector<rdf::TermId> open;
  std::set<rdf::TermId> seen;
  for (std::size_t i = 0; i < graph.term_count(); ++i)
    if (const rdf::TermView term = graph.term(static_cast<rdf::TermId>(i)); term.is_iri() && term.text.find("/blueprint") != std::string_view::npos)
      open.push_back(static_cast<rdf::TermId>(i));
  while (!open.empty()) {
    const rdf::TermId node = open.back();
    open.pop_back();
    if (!seen.insert(node).second) continue;
    for (const rdf::Triple& t : graph.match(node, std::nullopt, std::nullopt)) {
      shapes.add(graph.term(t.subject), graph.term(t.predicate), graph.term(t.object));
      if (graph.term(t.object).is_blank()) open.push_back(t.object);
    }
  }
  return rdf::write(shapes, rdf::Syntax::turtle).value();
}

/// The same robot as lrt::test::Mover, made of the types of its header.
Thing made_mover() {
  Thing thing{"mover"};
  thing.property("target", [] { return made::Target(made::MoveTo{1, 2, {}}); }).on_write([](const made::Target&) {});
  thing.property("next", [] { return std::optional<made::Target>(); }).on_write([](const std::optional<made::Target>&) {});
  thing.property("plan", [] { return std::vector<made::Target>(); }).on_write([](const std::vector<made::Target>&) {});
  thing.property("job", [] { return made::Job{"first", {}}; }).on_write([](const made::Job&) {});
  thing.property("limit", [] { return made::Limit(std::string("soft")); }).on_write([](const made::Limit&) {});
  thing.action("go", [](const made::Target&) { return made::NumberOrText(2.0); });
  return thing;
}

}  // namespace

TEST_CASE("a variant becomes a std::variant in the header", "[codegen][R1.6]") {
  test::Mover mover;
  const std::string header = header_of(documents_of(mover.thing()));
  std::ifstream file(LRT_SOURCE_DIR "/tests/codegen/mover.hpp");
  std::stringstream golden;
  golden << file.rdbuf();
  INFO(header);
  CHECK(header == golden.str());  // if the difference is meant, copy it
  CHECK(header.find("using Target = std::variant<MoveTo, Grip, double, std::monostate>;") != std::string::npos);
  // The types of the header have the alternatives in the order of the robot.
  static_assert(std::is_same_v<std::variant_alternative_t<0, made::Target>, made::MoveTo>);
  static_assert(std::is_same_v<std::variant_alternative_t<3, made::Target>, std::monostate>);
}

TEST_CASE("the types of a header have the Blueprint that it was made of", "[codegen][R1.6][R1.11]") {
  test::Mover mover;
  const rdf::Graph original = documents_of(mover.thing()), again = documents_of(made_mover());
  CHECK(shapes_of(original) == shapes_of(again));
  CHECK(header_of(original) == header_of(again));
  CHECK(codegen::check(header_of(original), client::describe(again).value()).value().empty());
}

TEST_CASE("a header that was made of a variant finds out that an alternative is new", "[codegen][R1.6]") {
  const auto robot = [](const std::string& more) {
    const std::string text =
        "@prefix ex: <http://example.org/ns#> . @prefix sh: <http://www.w3.org/ns/shacl#> . @prefix xsd: <http://www.w3.org/2001/XMLSchema#> . "
        "ex:T a sh:NodeShape ; sh:targetClass ex:Target ; sh:xone ( [ sh:path ex:a ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:date ] " +
        more + "[ sh:path ex:b ; sh:minCount 1 ; sh:maxCount 1 ; sh:nodeKind sh:BlankNodeOrIRI ] ) .";
    return client::describe(rdf::read(text, rdf::Syntax::turtle, {}).value()).value();
  };
  const std::string header = codegen::generate(robot("")).value().header;
  INFO(header);
  CHECK(header.find("struct Target : std::variant<std::string, std::monostate> {") != std::string::npos);  // others may have that variant, too
  CHECK(header.find("lrt::client::with_datatype(*t.fields[0].type, lrt::Iri{\"http://www.w3.org/2001/XMLSchema#date\"})") != std::string::npos);
  CHECK(codegen::check(header, robot("")).value().empty());
  const std::vector<std::string> differences =
      codegen::check(header, robot("[ sh:path ex:c ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:int ] ")).value();
  REQUIRE(differences.size() == 1);
  CHECK(differences.front().find("c") != std::string::npos);
}

TEST_CASE("values of the types of a header are those of the robot", "[codegen][R1.6]") {
  test::Mover mover;
  test::RobotHost host(test::one_thing(mover.thing()));
  Client client = Client::create().value();
  const client::Robot robot = client.open(host.url()).value();
  const std::vector<made::Mover> all = made::Mover::all(robot);
  REQUIRE(all.size() == 1);
  const made::Mover& found = all.front();
  CHECK(std::get<made::MoveTo>(found.target.read().value()).y == 2);
  REQUIRE(found.target.write(1.5));
  CHECK(std::get<double>(mover.target) == 1.5);
  REQUIRE(found.target.write(std::monostate()));
  CHECK(std::holds_alternative<std::monostate>(found.target.read().value()));
  REQUIRE(found.job.write({"third", made::Grip::closed}));
  CHECK(std::get<made::Grip>(found.job.read().value().target) == made::Grip::closed);
  CHECK(std::get<std::string>(found.limit.read().value()) == "soft");
  const auto went = found.go(made::Target(made::MoveTo{4, 0, 1.0}));
  if (!went) FAIL(went.error().message);
  CHECK(std::get<double>(went->result().value()) == 4);
}

// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/value_places.hpp"

#include <array>
#include <chrono>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/rdf/traits.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/graphs.hpp"

using namespace lrt;
using rdf::literal;
using rdf::PlacedMismatch;
using rdf::TermView;
using rdf::traits;
using rdf::ValuePlaces;

namespace {

struct Wheel {
  double radius = 0;
  std::vector<std::vector<double>> rows;
  std::map<std::string, double> loads;
};
struct Car {
  Wheel left, right;
  std::optional<std::string> name;
};

constexpr const char* names = "http://localhost/b#";

}  // namespace

template <>
struct lrt::rdf::traits<Wheel> : lrt::rdf::Record<Wheel> {
  static void describe(Record<Wheel>& r) {
    r.field("radius", &Wheel::radius).unit(unit::metre);
    r.field("rows", &Wheel::rows);
    r.field("loads", &Wheel::loads);
  }
};
template <>
struct lrt::rdf::traits<Car> : lrt::rdf::Record<Car> {
  static void describe(Record<Car>& r) {
    r.field("left", &Car::left);
    r.field("right", &Car::right);
    r.field("name", &Car::name);
  }
};

namespace {

/// The graph of "<x>", its places, and those of single nodes.
struct Body {
  explicit Body(const std::string& triples)
      : graph(test::turtle(
            "@prefix schema: <http://schema.org/> . @prefix car: <http://localhost/b#Car/> . @prefix wheel: <http://localhost/b#Wheel/> . " +
            triples)),
        places(graph, graph.intern(rdf::iri("http://localhost/x")), traits<Car>::type(), {}, names) {}
  /// @param node  an IRI below http://localhost/
  std::string at(const std::string& node, const std::string& predicate = {}, const std::optional<TermView>& value = std::nullopt) const {
    const std::string here = "http://localhost/" + node, of = "http://localhost/b#" + predicate;
    return places.pointer(rdf::iri(here), predicate.empty() ? std::nullopt : std::optional(rdf::iri(of)), value);
  }
  rdf::Graph graph;
  ValuePlaces places;
};

}  // namespace

TEST_CASE("nodes, fields, members of lists and of maps have a place, also if they are missing or do not fit", "[rdf][R0.6]") {
  const Body body(
      "<x> car:left <left> ; car:right <right>, <other> . <left> wheel:radius <r> ; wheel:rows ( <row> ) ; wheel:loads ( <load> ) . "
      "<r> vom:numericalValue 1e0 . <row> rdf:first 1e0 ; rdf:rest <rest> . <rest> rdf:first \"two\" ; rdf:rest () . "
      "<load> schema:name \"a/b\" ; schema:value 1e0 . <right> wheel:radius 7 .");
  CHECK(body.at("x").empty());
  CHECK(body.at("x", "Car/left") == "/left");
  CHECK(body.at("x", "Car/name") == "/name");
  CHECK(body.at("x", "Car/unknown").empty());
  CHECK(body.at("left") == "/left");
  CHECK(body.at("left", "Wheel/unknown") == "/left");
  CHECK(body.at("r") == "/left/radius");
  CHECK(body.at("row") == "/left/rows/0");
  CHECK(body.at("row", {}, literal("two")) == "/left/rows/0/1");
  CHECK(body.at("load") == "/left/loads/a~1b");
  CHECK(body.at("right", "Wheel/radius") == "/right/radius");
  CHECK(body.at("right", "Wheel/rows") == "/right/rows");
  CHECK(body.at("other") == "/right");
  CHECK(body.at("elsewhere").empty());
  CHECK(Body("<y> car:name 1 .").at("x", "Car/left") == "/left");
}

TEST_CASE("a node that two fields share has the place where it does not fit", "[rdf][R0.6]") {
  const Body body("<x> car:left [ wheel:rows () ; wheel:radius () ] ; car:right [ wheel:loads <r>, () ] .");
  CHECK(body.places.pointer(vocab::rdf_::nil, std::nullopt, std::nullopt) == "/left/radius");
}

TEST_CASE("a mismatch has its place in JSON", "[rdf][R0.6]") {
  const rdf::Graph graph = test::turtle("@prefix schema: <http://schema.org/> . <x> rdf:value ( [ schema:name \"left\" ; schema:value 1 ] ) .");
  std::vector<PlacedMismatch> mismatches;
  CHECK_FALSE(
      rdf::read_value(graph, *graph.find(rdf::iri("http://localhost/x")), traits<std::map<std::string, std::string>>::type(), {}, names, mismatches));
  REQUIRE(mismatches.size() == 1);
  CHECK(mismatches[0].pointer == "/left");
  CHECK(mismatches[0].mismatch.path == "rdf:value/[0]/<http://schema.org/value>");
}

TEST_CASE("a graph that leads to its nodes on many ways is read to an end", "[rdf][R0.6]") {
  std::string list = "[ rdf:first <9> ; rdf:rest () ]";
  for (int i = 0; i < 200; ++i) list = "[ rdf:first <9> ; rdf:rest " + list + " ]";
  const rdf::Graph graph = test::turtle("<x> rdf:value <0> . <0> rdf:first <0> ; rdf:rest " + list + " .");
  using Rows = std::vector<std::vector<std::vector<std::vector<double>>>>;
  const ValuePlaces places(graph, *graph.find(rdf::iri("http://localhost/x")), traits<Rows>::type(), {}, names);
  CHECK_FALSE(places.pointer(rdf::iri("http://localhost/9"), std::nullopt, std::nullopt).empty());
}

// SPDX-License-Identifier: Apache-2.0
#include "src/engine/contract.hpp"

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/rdf/traits.hpp>
#include <lrt/rdf/vocab.hpp>
#include <lrt/thing.hpp>

#include "src/engine/named_blank.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"

// What Blueprints promise does not depend on the moment, and what documents say can be merged (SPEC 3.12, 3.19).

using namespace lrt;
using namespace lrt::test;

namespace test {
struct Limit {
  double lower = -1, upper = 1;
};
}  // namespace test

template <>
struct lrt::rdf::traits<::test::Limit> : lrt::rdf::Record<::test::Limit> {
  static void describe(lrt::rdf::Record<::test::Limit>& r) {
    r.named("Limit");
    r.field("lower", &::test::Limit::lower).unit(lrt::unit::radian);
    r.field("upper", &::test::Limit::upper).unit(lrt::unit::radian);
  }
};

namespace {

Answer get(Bench& bench, const std::string& path) { return bench.get(path); }

/// What the documents of a Thing violate of shapes that were published before.
std::string violations_of(Bench& bench, const rdf::Graph& shapes, const std::vector<std::string>& paths) {
  rdf::Graph all;
  for (const std::string& path : paths) all.merge(get(bench, path).graph());
  const Result<shacl::Shapes> compiled = shacl::Shapes::compile(shapes);
  if (!compiled) return compiled.error().message;
  const Result<shacl::Report> report = shacl::validate(*compiled, all);
  return report ? report->to_text() : report.error().message;
}

rdf::Graph blueprints(Bench& bench, const std::string& path) {
  return blueprint_of([&](const std::string& at) { return get(bench, at); }, path);
}

Thing joint(const std::string& path, double most) {
  Thing thing{path};
  thing.type(vocab::ros::RevoluteJoint);
  thing
      .property(
          "angle", [] { return 0.5; }, unit::radian)
      .at_most(most)
      .predicate(vocab::ros::position);
  return thing;
}

}  // namespace

TEST_CASE("a Blueprint stays true when an Action becomes unavailable and when the Things around it go", "[engine][SPEC 3.12]") {
  Bench bench;
  Thing arm{"robot/arm"};
  arm.property("angle", [] { return 0.5; });
  auto turn = arm.action("turn", [](double) {});
  bench.add(Thing{"robot"});
  bench.add(Thing{"tool"});
  arm.add(Iri{"http://e/near"}, Object::resource("tool"));
  bench.add(std::move(arm));
  bench.add(Thing{"robot/arm/hand"});
  const std::string kind = kind_of(bench, "/robot/arm"), tag = get(bench, kind).tag();
  const rdf::Graph before = blueprints(bench, "/robot/arm");
  const std::vector<std::string> documents = {"/robot/arm/state", "/robot/arm/actions/turn"};
  CHECK(violations_of(bench, before, documents) == "");

  turn.available(false, "no power");
  bench.look();
  CHECK(get(bench, "/robot/arm/actions/turn").says("no power"));
  CHECK(violations_of(bench, before, documents) == "");
  for (const char* other : {"robot/arm/hand", "tool"}) {
    REQUIRE(bench.engine.remove(other));
    CHECK(violations_of(bench, before, documents) == "");
  }
  CHECK(get(bench, kind).tag() == tag);
  CHECK(kind_of(bench, "/robot/arm") == kind);

  // It can be violated: without its Property, the Thing is none of the kind.
  rdf::Graph without;
  const rdf::Graph state = get(bench, "/robot/arm/state").graph();
  for (const rdf::Triple& t : state.triples())
    if (state.term(t.predicate) != rdf::TermView(vocab::hybrit::property))
      without.add(state.term(t.subject), state.term(t.predicate), state.term(t.object));
  CHECK_FALSE(shacl::validate(*shacl::Shapes::compile(before), without)->conforms());
}

TEST_CASE("equal registrations have one kind in every process, others have another", "[engine][SPEC 3.12]") {
  const auto kind = [](auto registration) {
    Bench bench;
    Thing thing{"arm"};
    registration(thing);
    bench.add(std::move(thing));
    return kind_of(bench, "/arm");
  };
  const std::string plain = kind([](Thing& t) { t.property("angle", [] { return 0.5; }); });
  CHECK(plain.substr(0, 16) == "/blueprints/arm-");
  CHECK(plain.size() == 24);
  CHECK(kind([](Thing& t) { t.property("angle", [] { return 0.7; }); }) == plain);
  CHECK(kind([](Thing& t) { t.property("angle", [] { return 0.5; }).at_most(7); }) == plain);
  CHECK(kind([](Thing& t) { t.property("angle", [] { return 0.5F; }); }) != plain);
  CHECK(kind([](Thing& t) {
          t.property(
              "angle", [] { return 0.5; }, unit::degree);
        }) != plain);
  const std::string pushed = kind([](Thing& t) { t.property<double>("angle"); });
  CHECK(pushed != plain);  // it may have no value
  CHECK(kind([](Thing& t) { t.property<double>("angle").publish(1); }) == plain);
  CHECK(kind([](Thing& t) { t.property("angle", [] { return 0.5; }), t.action("turn", [] {}); }) != plain);
}

TEST_CASE("Things of a kind with the same bounds share the Blueprint of these bounds, which judges no others", "[engine][SPEC 3.12]") {
  Bench bench;
  bench.add(joint("a", 1));
  bench.add(joint("b", 1));
  bench.add(joint("c", 0.25));  // its value is beyond
  CHECK(kind_of(bench, "/a") == kind_of(bench, "/c"));
  CHECK(bounds_of(bench, "/a") == bounds_of(bench, "/b"));
  CHECK(bounds_of(bench, "/a") != bounds_of(bench, "/c"));
  CHECK(violations_of(bench, blueprints(bench, "/a"), {"/a/state", "/b/state", "/c/state"}) == "");
  CHECK(violations_of(bench, blueprints(bench, "/c"), {"/a/state", "/b/state"}) == "");
  CHECK(violations_of(bench, blueprints(bench, "/c"), {"/a/state", "/b/state", "/c/state"}) != "");
  const std::string bounds = bounds_of(bench, "/a");
  REQUIRE(bench.engine.remove("a"));
  CHECK(get(bench, bounds).status == 200);
  REQUIRE(bench.engine.remove("b"));
  CHECK(get(bench, bounds).status == 404);
}

TEST_CASE("a value has the same nodes in each document that shows it", "[engine][SPEC 3.19]") {
  Bench bench;
  Thing arm{"arm"};
  arm.property("limit", [] { return ::test::Limit(); });
  arm.property("path", [] { return std::vector<double>{1, 2}; });
  arm.property("limits", [] { return std::vector<::test::Limit>(2); });
  arm.add_turtle("<> <http://e/weight> [ <http://e/value> 12 ; <http://e/parts> ( 1 2 ) ] .");
  bench.add(std::move(arm));
  rdf::Graph merged = get(bench, "/arm/state").graph();
  const std::size_t size = merged.size();
  for (const char* path : {"/all", "/arm", "/arm/limit", "/arm/path", "/arm/limits"}) {
    const rdf::Graph one = get(bench, path).graph();
    for (const rdf::Triple& t : one.triples()) {
      CHECK_FALSE(one.term(t.object).is_blank());
      const bool is_about_document = one.term(t.predicate) == rdf::TermView(vocab::hybrit::subscriptions) ||
                                     one.term(t.predicate) == rdf::TermView(vocab::hybrit::websocketUrl) ||
                                     one.term(t.object) == rdf::TermView(vocab::ldp::RDFSource);
      if (!is_about_document) merged.add(one.term(t.subject), one.term(t.predicate), one.term(t.object));
    }
  }
  CHECK(merged.size() == size);
  CHECK(missing(get(bench, "/arm/limits"),
                "<arm/limits> rdf:value <arm/limits#value-0> . <arm/limits#value-0> rdf:first <arm/limits#value.0> ; rdf:rest <arm/limits#value-1> ."
                "<arm/limits#value-1> rdf:rest () . <arm/limits#value.1> </ns/vocabulary#Limit/upper> <arm/limits#value.1.upper> ."
                "<arm/limits#value.1.upper> vom:numericalValue \"1\"^^xsd:double .") == "");
}

TEST_CASE("property paths in the user's Turtle keep their blank nodes", "[engine][SPEC 3.19]") {
  Bench bench;
  Thing arm{"arm"};
  arm.add_turtle(
      "@prefix sh: <http://www.w3.org/ns/shacl#> . <#s> sh:property [ sh:path [ sh:inversePath <http://e/p> ] ; sh:minCount 1 ] . <> <http://e/q> [] "
      ".");
  bench.add(std::move(arm));
  CHECK(missing(get(bench, "/arm"), "<arm#s> sh:property [ sh:path [ sh:inversePath <http://e/p> ] ] . <arm> <http://e/q> <arm#_b2> .") != "");
  CHECK(missing(get(bench, "/arm"), "<arm#s> sh:property [ sh:path [ sh:inversePath <http://e/p> ] ] .") == "");
  const rdf::Graph graph = get(bench, "/arm").graph();
  for (const rdf::TermView& path : graph.objects(rdf::blank("b0"), rdf::TermView(vocab::sh::path))) CHECK(path.is_blank());
}

TEST_CASE("names of blank nodes are hidden with what leads to them", "[engine][rights]") {
  CHECK(engine::is_named_blank(engine::named_blank("http://robot/arm", 12)));
  CHECK_FALSE(engine::is_named_blank("http://robot/arm#_b"));
  CHECK_FALSE(engine::is_named_blank("http://robot/arm#_b1x"));
  const auto visible = [](const std::string& turtle) {
    const rdf::Graph all = rdf::read(turtle, rdf::Syntax::turtle, {}).value();
    return engine::visible_part(all, [](std::string_view iri) { return iri.find("hidden") == std::string_view::npos; }).size();
  };
  CHECK(visible("<p:hidden> <p:b> <p:a#_b0> . <p:a#_b0> <p:c> 1 .") == 0);
  CHECK(visible("<p:a> <p:b> <p:a#_b0> . <p:a#_b0> <p:c> 1 .") == 2);
}

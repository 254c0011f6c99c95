// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include <lrt/shacl/validator.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

/// The components of a validation report in a response, in order.
std::vector<std::string> components(const Answer& answer) {
  std::vector<std::string> names;
  const rdf::Graph report = answer.graph();
  for (const rdf::Triple& t : report.triples()) {
    if (report.term(t.predicate).text != vocab::sh::sourceConstraintComponent.text) continue;
    const std::string_view text = report.term(t.object).text;
    names.emplace_back(text.substr(text.find('#') + 1));
  }
  std::sort(names.begin(), names.end());
  return names;
}

struct Joint {
  Joint() {
    Thing joint{"joint"};
    joint.action("rotate", [this](float target) { angle = target, ++commands; }).consumes(Facets{unit::degree}.at_least(0).below(360));
    bench.add(std::move(joint));
  }
  Answer rotate(const std::string& said, const std::string& fields = {}) {
    return bench.turtle("POST", "/joint/actions/rotate", "<> a maths:Scalar ; " + said + " .", fields);
  }
  Bench bench;
  float angle = 0;
  int commands = 0;
};

}  // namespace

TEST_CASE("the state of a thing conforms to its blueprint", "[engine][R1.11]") {
  Bench bench;
  bench.add(Thing{"robot"});
  Thing thing{"robot/arm"};
  thing.type(vocab::ros::RevoluteJoint);
  thing
      .property(
          "angle", [] { return 10.0; }, unit::degree)
      .between(-90, 90)
      .predicate(vocab::ros::rotation);
  thing.property("count", [] { return std::uint8_t{7}; });
  thing.property("name", [] { return "arm 1"; });
  thing.property("mode", [] { return Mode::idle; });
  thing.property("pose", [] { return Pose{}; });
  thing.property("gains", [] { return std::vector<float>{1, 2.5F}; });
  thing.property("period", [] { return std::chrono::milliseconds(1); });
  thing.property("note", [] { return std::optional<std::string>(); });
  thing.property<double>("pushed").publish(0.25);
  thing.action("turn", [](double) {});
  thing.collection<Pose>("waypoints");
  bench.add(std::move(thing));
  bench.add(Thing{"robot/arm/hand"});
  const auto get = [&](const std::string& path) { return bench.get(path); };
  CHECK(violations(get, "/robot/arm") == "");

  // It is no empty promise: the thing without its values does not.
  CHECK(violations(get, "/robot/arm", "http://localhost", "") != "");
}

TEST_CASE("a Blueprint promises the same before the first publish of a pushed property and after it", "[engine][R1.11]") {
  Bench bench;
  Thing thing{"t"};
  auto value = thing.property<double>("value");
  thing.property<double>("written").on_write([](double) {});
  bench.add(std::move(thing));
  const auto conforms = [&] { return violations([&](const std::string& path) { return bench.get(path); }, "/t").empty(); };
  CHECK(conforms());
  const std::string kind = kind_of(bench, "/t"), before = bench.get(kind).tag();
  value.publish(1);
  CHECK(conforms());
  CHECK(bench.get(kind).tag() == before);
  CHECK(bench.ask("PUT /t/written\nContent-Type: application/json\n\n2").status == 204);
  CHECK(conforms());
  CHECK(bench.get(kind).tag() == before);
  // But it judges the value.
  const rdf::Graph state = bench.get("/t/state").graph();
  const rdf::TermId node = *state.find(rdf::iri("http://localhost/t/value"));
  rdf::Graph wrong;
  for (const rdf::Triple& t : state.triples()) {
    const bool is_value = t.subject == node && state.term(t.predicate) == rdf::TermView(vocab::vom::numericalValue);
    wrong.add(state.term(t.subject), state.term(t.predicate), is_value ? rdf::literal("fast") : state.term(t.object));
  }
  const auto shapes = shacl::Shapes::compile(blueprint_of([&](const std::string& path) { return bench.get(path); }, "/t"));
  CHECK_FALSE(shacl::validate(*shapes, wrong)->conforms());
}

TEST_CASE("Figure 5: a body that the shape excludes gets the report, and no lambda is called", "[engine][R0.6][R1.11]") {
  const struct {
    const char* said;
    std::vector<std::string> expected;
  } cases[] = {
      {"vom:numericalValue 360 ; vom:unit maths:Degree", {"MaxExclusiveConstraintComponent"}},
      {"vom:numericalValue -1 ; vom:unit maths:Degree", {"MinInclusiveConstraintComponent"}},
      {"vom:numericalValue \"fast\"^^xsd:float ; vom:unit maths:Degree",
       {"DatatypeConstraintComponent", "MaxExclusiveConstraintComponent", "MinInclusiveConstraintComponent"}},
      {"vom:numericalValue 1 , 2 ; vom:unit maths:Degree", {"MaxCountConstraintComponent"}},
      {"vom:unit maths:Degree", {"MinCountConstraintComponent"}},
      {"vom:numericalValue 1", {"HasValueConstraintComponent", "MinCountConstraintComponent"}},
      {"vom:numericalValue 1 ; vom:unit maths:Radian", {"HasValueConstraintComponent"}},
  };
  Joint joint;
  for (const auto& c : cases) {
    CAPTURE(c.said);
    const Answer answer = joint.rotate(c.said);
    REQUIRE(answer.status == 422);
    CHECK(answer.field("Content-Type") == "text/turtle");
    CHECK(components(answer) == c.expected);
    CHECK(answer.links_to("http://localhost" + bounds_of(joint.bench, "/joint"), "http://www.w3.org/ns/ldp#constrainedBy"));
  }
  CHECK(joint.commands == 0);
  CHECK(joint.rotate("vom:numericalValue \"43.6\"^^xsd:float ; vom:unit maths:Degree").status == 204);
  CHECK(joint.angle == 43.6F);
  CHECK(joint.rotate("vom:numericalValue 1 ; vom:unit maths:Degree ; rdfs:label \"more than asked\"").status == 204);
}

TEST_CASE("an empty body does not conform vacuously", "[engine][R0.6]") {
  Joint joint;
  const Answer answer = joint.bench.turtle("POST", "/joint/actions/rotate", "");
  CHECK(answer.status == 422);
  CHECK(components(answer) == std::vector<std::string>{"HasValueConstraintComponent", "MinCountConstraintComponent", "MinCountConstraintComponent"});
}

TEST_CASE("the report comes in the RDF syntax that is preferred, else its messages as problem details", "[engine][rdf_xml][R1.2]") {
  Joint joint;
  const char* said = "vom:numericalValue 360 ; vom:unit maths:Degree";
  CHECK(joint.rotate(said, "Accept: application/n-triples\n").field("Content-Type") == "application/n-triples");
  CHECK(components(joint.rotate(said, "Accept: application/rdf+xml\n")) == std::vector<std::string>{"MaxExclusiveConstraintComponent"});
  for (const char* accept : {"application/json", "application/problem+json", "text/html"}) {
    CAPTURE(accept);
    const Answer answer = joint.rotate(said, std::string("Accept: ") + accept + "\n");
    CHECK(answer.status == 422);
    CHECK(answer.field("Content-Type").rfind(accept, 0) == 0);
    CHECK(answer.says("expected less than 360, found 360"));
  }
}

TEST_CASE("an action links the shapes of what it consumes and produces, and its binding the body", "[engine][R1.10]") {
  Bench bench;
  Thing thing{"t"};
  thing.action("square", [](double x) { return x * x; }).consumes(Facets{}.at_least(0)).produces(Facets{unit::metre});
  bench.add(std::move(thing));
  CHECK(missing(bench.get("/t/actions/square"),
                with_kind("<t/actions/square> hybrit:consumes _:input ; hybrit:produces <KIND#actions/square/output> ;"
                          " hybrit:binding [ a http-core:Request ; http-core:mthd http-methods:POST ; http-core:requestURI <t/actions/square> ;"
                          "   http-core:body [ a maths:Scalar ; dcterms:conformsTo _:input ] ] ."
                          "_:input a sh:NodeShape ; sh:property [ sh:path vom:numericalValue ; sh:minInclusive 0 ] .",
                          kind_of(bench, "/t"))) == "");
}

TEST_CASE("a shape of the user replaces the generated one of its name and is taken literally", "[engine][R1.11]") {
  Bench bench;
  std::string name = "a";
  Thing thing{"t"};
  thing.property("name", [&] { return name; }).on_write([&](std::string v) { name = std::move(v); });
  thing.property("other", [] { return 1; });
  thing.shapes(
      "@prefix sh: <http://www.w3.org/ns/shacl#> . @prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> ."
      "<#name> a sh:NodeShape ; sh:property [ sh:path rdf:value ; sh:maxLength 3 ; sh:minCount 1 ] . <#more> a sh:NodeShape .");
  bench.add(std::move(thing));
  const Answer blueprint = bench.get("/t/blueprint");
  const std::string kind = kind_of(bench, "/t");
  CHECK(
      missing(blueprint,
              "[] sh:targetNode <t/name> ; sh:or ( [] <t/blueprint#name> ) . <t/blueprint#name> sh:property [ sh:path rdf:value ; sh:maxLength 3 ] ."
              "<t/blueprint#more> a sh:NodeShape .") == "");
  CHECK(missing(bench.get(kind), with_kind("<KIND#other> a sh:NodeShape .", kind)) == "");
  CHECK_FALSE(bench.get(kind).graph().find(rdf::iri("http://localhost" + kind + "#name")));
  CHECK(missing(bench.get("/t"), with_kind("<t> hybrit:blueprint <KIND> , <t/blueprint> .", kind)) == "");
  CHECK_FALSE(missing(blueprint, "<t/blueprint#name> sh:property [ sh:datatype xsd:string ] .").empty());
  CHECK(bench.turtle("PUT", "/t/name", "<> rdf:value \"abc\" .").status == 204);
  CHECK(components(bench.turtle("PUT", "/t/name", "<> rdf:value \"abcd\" .")) == std::vector<std::string>{"MaxLengthConstraintComponent"});
  // What the shape lets pass and the C++ type cannot hold is still 422.
  CHECK(bench.turtle("PUT", "/t/name", "<> rdf:value 5 .").status == 422);
  CHECK(name == "abc");
}

TEST_CASE("ill-formed shapes and broken Turtle are refused when the thing is added, and nothing of it stays", "[engine][R1.11]") {
  Bench bench;
  const auto add = [&](const char* shapes) {
    Thing thing{"t"};
    thing.property("p", [] { return 1; });
    thing.shapes(shapes);
    return bench.engine.add(std::move(thing));
  };
  const auto ill_formed = add("@prefix sh: <http://www.w3.org/ns/shacl#> . <#p> a sh:NodeShape ; sh:property [ sh:minCount 1 ] .");
  REQUIRE_FALSE(ill_formed);
  CHECK(ill_formed.error().message.find("sh:path") != std::string::npos);
  const auto broken = add("<#p> a");
  REQUIRE_FALSE(broken);
  CHECK(broken.error().code == Errc::expected_rdf);
  Thing from_file{"t"};
  from_file.shapes_from_file("no/such/file.ttl");
  CHECK(bench.engine.add(std::move(from_file)).error().code == Errc::io_error);
  CHECK(bench.get("/t").status == 404);
  CHECK(bench.engine.add(Thing{"t"}));
}

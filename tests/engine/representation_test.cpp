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
  }
  SampleRobot robot;
  Bench bench;
};

const std::vector<std::string> all_paths = {"/",
                                            "/ns/lrt",
                                            "/arm",
                                            "/arm/blueprint",
                                            "/arm/subscriptions",
                                            "/arm/angle",
                                            "/arm/speed",
                                            "/arm/count",
                                            "/arm/name",
                                            "/arm/mode",
                                            "/arm/pose",
                                            "/arm/gains",
                                            "/arm/silent",
                                            "/arm/actions/turn",
                                            "/arm/actions/home",
                                            "/arm/actions/grip",
                                            "/arm/waypoints",
                                            "/arm/tool",
                                            "/arm/tool/state",
                                            "/arm/tool/weight"};

}  // namespace

TEST_CASE("every resource has a URI of its own and responds to GET with Turtle there", "[engine][R0.3][R1.1][R1.2]") {
  Robot r;
  REQUIRE(r.bench.ask("POST /arm/actions/home").status == 204);
  REQUIRE(r.bench
              .turtle("POST", "/arm/waypoints",
                      "<> a maths:Vector3D ; maths:x [ vom:numericalValue 1 ; qudt:hasUnit unit:M ] ; maths:y [ vom:numericalValue 2 ; "
                      "qudt:hasUnit unit:M ] ; <http://localhost/ns/vocabulary#Pose/frame> \"base\" .")
              .status == 201);
  std::vector<std::string> paths = all_paths;
  paths.push_back("/arm/actions/home/i1");
  paths.push_back("/arm/waypoints/i2");
  for (const std::string& path : paths) {
    CAPTURE(path);
    const Answer a = r.bench.get(path);
    CHECK(a.status == 200);
    CHECK(a.field("Content-Type") == "text/turtle");
  }
}

TEST_CASE("every RDF representation states at least one type of its resource", "[engine][R1.3][R1.4][R1.7]") {
  Robot r;
  for (const std::string& path : all_paths) {
    if (path == "/ns/lrt") continue;  // about the terms, not about itself
    CAPTURE(path);
    const rdf::Graph graph = r.bench.get(path).graph();
    std::string self = "http://localhost" + path;
    if (path == "/arm/tool/state") self = "http://localhost/arm/tool";  // the thing as it is now
    CHECK(graph.object(rdf::iri(self), vocab::rdf_::type));
  }
  const Answer thing = r.bench.get("/arm");
  CHECK(missing(thing, "<arm> a hybrit:RoboticThing , ros:RevoluteJoint .") == "");
}

TEST_CASE("the root lists the outermost things as a container, with a link to each", "[engine][R0.4][R0.9]") {
  Robot r;
  const Answer a = r.bench.get("/");
  CHECK(missing(a, "<> a ldp:BasicContainer , ldp:Container ; ldp:contains <arm> . <arm> a hybrit:RoboticThing , ros:RevoluteJoint .") == "");
  CHECK(a.graph().objects(rdf::iri("http://localhost/"), vocab::ldp::contains).size() == 1);
  CHECK(a.linked("related") == std::vector<std::string>{"http://localhost/arm", "http://localhost/all"});
  CHECK(a.links_to("http://www.w3.org/ns/ldp#BasicContainer", "type"));

  Bench empty;
  const Answer nothing = empty.get("/");
  CHECK(nothing.status == 200);
  CHECK(missing(nothing, "<> a ldp:BasicContainer .") == "");
  CHECK(nothing.graph().objects(rdf::iri("http://localhost/"), vocab::ldp::contains).empty());
}

TEST_CASE("a thing names its subscriptions, state, blueprint, properties, actions, collections and parts", "[engine][R1.8][R1.9][R1.10][R1.11]") {
  Robot r;
  const Answer a = r.bench.get("/arm");
  CHECK(missing(a, with_kind("<arm> dcterms:title \"arm\" ; hybrit:subscriptions <arm/subscriptions> ; lrt:state <arm/state> ; hybrit:blueprint "
                             "<KIND> ;"
                             " hybrit:property <arm/angle> , <arm/speed> , <arm/silent> ; ros:rotation <arm/angle> ;"
                             " hybrit:action <arm/actions/turn> , <arm/actions/grip> ; lrt:collection <arm/waypoints> ;"
                             " dcterms:hasPart <arm/tool> ; rdfs:label \"Arm\"@en ."
                             " <arm/angle> a hybrit:Property , maths:Scalar . <arm/pose> a hybrit:Property , maths:Vector3D ."
                             " <arm/actions/grip> a hybrit:Action , hybrit:AsynchronousAction . <arm/actions/turn> a hybrit:Action ."
                             " <arm/waypoints> a ldp:BasicContainer . <arm/tool> a hybrit:RoboticThing .",
                             kind_of(r.bench, "/arm"))) == "");
  const std::vector<std::string> related = a.linked("related");
  const std::set<std::string> links(related.begin(), related.end());
  for (const char* path : {"state", "subscriptions", "angle", "speed", "actions/turn", "actions/grip", "waypoints", "tool"})
    CHECK(links.count(std::string("http://localhost/arm/") + path) == 1);
  CHECK(a.links_to("http://localhost/", "up"));
  CHECK(a.links_to("http://localhost" + kind_of(r.bench, "/arm"), "describedby"));

  const Answer tool = r.bench.get("/arm/tool");
  CHECK(missing(tool, "<arm/tool> a hybrit:RoboticThing ; dcterms:title \"The tool\" ; dcterms:isPartOf <arm> .") == "");
  CHECK(tool.links_to("http://localhost/arm", "up"));
}

TEST_CASE("a thing's representation has no values; its state has them all", "[engine][R0.11]") {
  Robot r;
  const Answer thing = r.bench.get("/arm");
  CHECK_FALSE(thing.says("numericalValue"));
  r.robot.angle_handle->publish(11);
  CHECK(r.bench.get("/arm").tag() == thing.tag());
  const Answer tool = r.bench.get("/arm/tool/state");
  CHECK(missing(tool, "<arm/tool/weight> vom:numericalValue \"0.25\"^^xsd:double ; qudt:hasUnit unit:KiloGM .") == "");
  const Answer arm = r.bench.get("/arm/state");  // `broken` is among its properties
  CHECK(missing(arm, "<arm/broken> lrt:error \"it could not be read: it threw: the encoder does not answer\" . <arm/name> rdf:value \"arm 1\" .") ==
        "");
}

TEST_CASE("the state is the thing's graph merged with those of its properties", "[engine][R0.3]") {
  Bench bench;
  int reads = 0;
  Thing thing{"arm"};
  thing.property("a", [&] { return ++reads; });
  auto b = thing.property<double>("b");
  thing.property("c", [] { return std::string("text"); });
  bench.add(std::move(thing));
  b.publish(0.5);
  const Answer state = bench.get("/arm/state");
  rdf::Graph expected = bench.get("/arm").graph();
  CHECK(missing(state.graph(), expected) == "");
  CHECK(missing(state, "<arm/a> vom:numericalValue \"1\"^^xsd:int . <arm/b> vom:numericalValue \"0.5\"^^xsd:double . <arm/c> rdf:value \"text\" .") ==
        "");
  CHECK(reads == 1);
  for (const char* path : {"/arm/b", "/arm/c"}) {
    const rdf::Graph property = bench.get(path).graph();
    for (const rdf::Triple& t : property.triples()) {
      if (property.term(t.predicate).text == vocab::hybrit::subscriptions.text) continue;  // says how the property can be watched
      expected.add(property.term(t.subject), property.term(t.predicate), property.term(t.object));
    }
  }
  CHECK(missing(state.graph(), expected) == "");
}

TEST_CASE("a property says datatype, unit and kind of quantity, also before it has a value", "[engine][R1.9]") {
  Bench bench;
  Thing thing{"arm"};
  auto angle = thing.property<float>("angle", unit::degree);
  thing.property<std::optional<int>>("count");
  thing.property<std::vector<double>>("efforts", unit::newton_metre);
  thing.property<std::string>("name");
  thing.property<double>("load", unit::percent);
  bench.add(std::move(thing));
  const char* quantity =
      "<arm/angle> lrt:datatype xsd:float ; vom:unit maths:Degree ; qudt:hasUnit unit:DEG ;"
      " qudt:hasQuantityKind <http://qudt.org/vocab/quantitykind/Angle> .";
  CHECK(missing(bench.get("/arm/angle"), quantity) == "");
  CHECK_FALSE(bench.get("/arm/angle").says("numericalValue"));
  angle.publish(1);
  CHECK(missing(bench.get("/arm/angle"), quantity) == "");
  CHECK(missing(bench.get("/arm/count"), "<arm/count> lrt:datatype xsd:int .") == "");
  CHECK(missing(bench.get("/arm/efforts"),
                "<arm/efforts> lrt:elementType xsd:double ; qudt:hasUnit unit:N-M ;"
                " qudt:hasQuantityKind <http://qudt.org/vocab/quantitykind/Torque> .") == "");
  CHECK(missing(bench.get("/arm/name"), "<arm/name> lrt:datatype xsd:string .") == "");
  CHECK_FALSE(bench.get("/arm/load").says("hasQuantityKind"));
}

TEST_CASE("properties show every type with its datatype and unit", "[engine][R1.5][R1.9]") {
  Robot r;
  r.robot.angle_handle->publish(10.5);
  const auto shows = [&](const char* path, const char* pattern) { return missing(r.bench.get(path), pattern); };
  CHECK(shows("/arm/angle",
              "<arm/angle> a hybrit:Property , maths:Scalar ; vom:numericalValue \"10.5\"^^xsd:double ; vom:unit maths:Degree ;"
              " qudt:hasUnit unit:DEG ; rdfs:seeAlso <arm> ; dcterms:modified \"2026-11-21T10:38:39.000000Z\"^^xsd:dateTime .") == "");
  CHECK(shows("/arm/speed", "<arm/speed> vom:numericalValue \"1.5\"^^xsd:float .") == "");
  CHECK(shows("/arm/count", "<arm/count> vom:numericalValue \"7\"^^xsd:int .") == "");
  CHECK(shows("/arm/name", "<arm/name> a hybrit:Property ; rdf:value \"arm 1\" .") == "");
  CHECK(shows("/arm/mode", "<arm/mode> rdf:value \"idle\" .") == "");
  CHECK(shows("/arm/gains", "<arm/gains> rdf:value ( \"1\"^^xsd:double \"2.5\"^^xsd:double ) .") == "");
  CHECK(shows("/arm/pose",
              "<arm/pose> a maths:Vector3D ; maths:x [ a maths:Scalar ; vom:numericalValue \"0\"^^xsd:double ; qudt:hasUnit unit:M ] ;"
              " <ns/vocabulary#Pose/frame> \"base\" .") == "");
  CHECK_FALSE(r.bench.get("/arm/pose").says("tolerance"));
  r.robot.pose.tolerance = 0.5;
  CHECK(shows("/arm/pose", "<arm/pose> <ns/vocabulary#Pose/tolerance> \"0.5\"^^xsd:double .") == "");
  const Answer silent = r.bench.get("/arm/silent");
  CHECK(silent.status == 200);
  CHECK_FALSE(silent.says("numericalValue"));
  CHECK_FALSE(silent.says("dcterms:modified"));
}

TEST_CASE("users add types, triples, Turtle and predicates to any resource", "[engine][R1.4][R1.12]") {
  Bench bench;
  Thing thing{"arm"};
  const Iri example{"http://example.org/ns#Thing"};
  thing.type(example)
      .title("An arm \"of\" ours\n")
      .add(vocab::rdfs::comment, "says \\ and \u00e9")
      .add(vocab::rdfs::seeAlso, Iri{"http://example.org/manual"})
      .add(vocab::dcterms::hasPart, Object::resource("other thing"))
      .add(Iri{"http://example.org/ns#mass"}, 2.5)
      .add(Iri{"http://example.org/ns#axes"}, 7)
      .add(Iri{"http://example.org/ns#real"}, true)
      .add(Iri{"http://example.org/ns#made"}, Object::typed("2017", Iri{"http://www.w3.org/2001/XMLSchema#gYear"}))
      .add_turtle("<> <http://example.org/ns#by> [ <http://example.org/ns#name> \"a\" ] . <#part> <http://example.org/ns#of> <> .")
      .add_turtle("<> <http://example.org/ns#by> [ <http://example.org/ns#name> \"b\" ] .");
  thing.property("p", [] { return true; }).type(example).add(vocab::rdfs::label, "property").predicate(Iri{"http://example.org/ns#p"});
  thing.action("a", [] {}).type(example).add(vocab::rdfs::label, "action").predicate(Iri{"http://example.org/ns#a"});
  thing.collection<int>("c").add(vocab::rdfs::label, "collection").predicate(Iri{"http://example.org/ns#c"});
  bench.add(std::move(thing));
  bench.add(Thing{"other thing"});
  CHECK(missing(bench.get("/arm"),
                "@prefix e: <http://example.org/ns#> . <arm> a hybrit:RoboticThing , e:Thing ; dcterms:title \"An arm \\\"of\\\" ours\\n\" ;"
                " rdfs:comment \"says \\\\ and \u00e9\" ; rdfs:seeAlso <http://example.org/manual> ; dcterms:hasPart <other%20thing> ;"
                " e:mass \"2.5\"^^xsd:double ; e:axes 7 ; e:real true ; e:made \"2017\"^^xsd:gYear ; e:by [ e:name \"a\" ] , [ e:name \"b\" ] ;"
                " e:p <arm/p> ; e:a <arm/actions/a> ; e:c <arm/c> . <arm#part> e:of <arm> . <other%20thing> a hybrit:RoboticThing .") == "");
  CHECK(missing(bench.get("/arm/p"), "<arm/p> a <http://example.org/ns#Thing> ; rdfs:label \"property\" ; rdf:value true .") == "");
  CHECK(missing(bench.get("/arm/actions/a"), "<arm/actions/a> a <http://example.org/ns#Thing> ; rdfs:label \"action\" .") == "");
  CHECK(missing(bench.get("/arm/c"), "<arm/c> a ldp:BasicContainer ; rdfs:label \"collection\" .") == "");
  const rdf::Graph graph = bench.get("/arm").graph();
  CHECK(graph.objects(rdf::iri("http://localhost/arm"), Iri{"http://example.org/ns#by"}).size() == 2);
}

TEST_CASE("a thing may refer to a blueprint elsewhere", "[engine][R1.11]") {
  Bench bench;
  Thing thing{"arm"};
  thing.blueprint(Iri{"http://example.org/shapes#Joint"});
  thing.property<double>("p").on_write([](double) {});
  bench.add(std::move(thing));
  const Answer a = bench.get("/arm");
  CHECK(missing(a, "<arm> hybrit:blueprint <http://example.org/shapes#Joint> .") == "");
  CHECK(a.links_to("http://example.org/shapes#Joint", "describedby"));
  // What bodies are judged by is our own.
  CHECK(bench.turtle("PUT", "/arm/p", "").links_to("http://localhost" + kind_of(bench, "/arm"), "http://www.w3.org/ns/ldp#constrainedBy"));
}

TEST_CASE("the generated blueprint lists types, units and bounds", "[engine][R1.11]") {
  Robot r;
  const std::string kind = kind_of(r.bench, "/arm");
  const Answer a = r.bench.get(kind);
  CHECK(
      missing(a,
              with_kind(
                  "<KIND> a sh:NodeShape , rdfs:Class ; rdfs:label \"RevoluteJoint\" ; sh:property"
                  " [ sh:path ros:rotation ; sh:minCount 1 ; sh:maxCount 1 ; sh:class hybrit:Property ; sh:or ( [] <KIND#angle> ) ] ."
                  "<KIND#angle> a sh:NodeShape ; sh:class maths:Scalar ; sh:property [ sh:path vom:numericalValue ; sh:minCount 1 ; sh:maxCount 1 ] ,"
                  " [ sh:path vom:unit ; sh:minCount 1 ; sh:maxCount 1 ; sh:hasValue maths:Degree ] ."
                  "<KIND#mode> sh:property [ sh:path rdf:value ; sh:in ( \"idle\" \"active\" ) ] .",
                  kind)) == "");
  CHECK_FALSE(a.says("sh:minInclusive -90"));
  CHECK_FALSE(a.says("sh:targetClass"));
  // Things with the same bounds share these.
  const std::string bounds = bounds_of(r.bench, "/arm");
  CHECK(bounds.substr(0, kind.size() + 1) == kind + "-");
  CHECK(missing(r.bench.get(bounds),
                with_kind("<KIND> a sh:NodeShape , rdfs:Class ; sh:node <" + kind.substr(1) +
                              "> ; sh:property [ sh:path ros:rotation ; sh:or ( [] <KIND#angle> ) ] ."
                              "<KIND#angle> a sh:NodeShape ; sh:property [ sh:path vom:numericalValue ; sh:minInclusive -90 ; sh:maxInclusive 90 ] ,"
                              " [ sh:path vom:unit ; sh:minCount 1 ; sh:maxCount 1 ; sh:hasValue maths:Degree ] ."
                              "<KIND#actions/turn/input> a sh:NodeShape ; sh:property [ sh:path vom:numericalValue ; sh:minCount 1 ;"
                              " sh:maxCount 1 ; sh:minInclusive 0 ; sh:maxExclusive 360 ] .",
                          bounds)) == "");
}

TEST_CASE("an action publishes the method and URI that really work", "[engine][R1.10][R0.5]") {
  Robot r;
  const Answer a = r.bench.get("/arm/actions/grip");
  CHECK(missing(a,
                "<arm/actions/grip> a hybrit:Action , hybrit:AsynchronousAction ; rdfs:seeAlso <arm> ; hybrit:binding"
                " [ a http-core:Request ; http-core:mthd http-methods:POST ; http-core:requestURI <arm/actions/grip> ] .") == "");
  CHECK(r.bench.ask("POST /arm/actions/grip").status == 204);
}

TEST_CASE("the list of lrt's own terms is served", "[engine][R1.5]") {
  Bench bench;
  const Answer a = bench.get("/ns/lrt");
  CHECK(a.status == 200);
  CHECK(missing(a, "lrt:state a rdf:Property . lrt:Invocation a rdfs:Class . hybrit:subscriptions a rdf:Property .") == "");
  CHECK(bench.get("/").links_to("http://localhost/ns/lrt", "describedby"));
}

TEST_CASE("the subscriptions container exists and is empty", "[engine][R1.8][R0.3]") {
  Robot r;
  const Answer a = r.bench.get("/arm/subscriptions");
  CHECK(a.status == 200);
  CHECK(missing(a, "<arm/subscriptions> a ldp:BasicContainer , ldp:Container .") == "");
  CHECK(a.links_to("http://www.w3.org/ns/ldp#BasicContainer", "type"));
  CHECK_FALSE(a.says("ldp:contains"));
}

TEST_CASE("no term of lrt's own stands in a representation that the term list lacks", "[engine][R1.5]") {
  Robot r;
  (void)r.bench.ask("POST /arm/actions/measure");
  (void)r.bench.turtle("POST", "/arm/actions/turn", number_body("1", "maths:Degree"));
  const rdf::Graph terms = r.bench.get("/ns/lrt").graph();
  std::vector<std::string> paths = all_paths;
  paths.push_back("/arm/actions/measure/i1");
  paths.push_back("/arm/actions/turn/i2");
  for (const std::string& path : paths) {
    CAPTURE(path);
    const rdf::Graph graph = r.bench.get(path).graph();
    for (const rdf::Triple& t : graph.triples())
      for (const rdf::TermId id : {t.predicate, t.object}) {
        const rdf::TermView term = graph.term(id);
        if (!term.is_iri() || term.text.find("https://w3id.org/lrt/ns#") != 0) continue;
        CAPTURE(std::string(term.text));
        CHECK(terms.object(term, vocab::rdf_::type));
      }
  }
}

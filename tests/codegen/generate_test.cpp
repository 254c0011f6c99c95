// SPDX-License-Identifier: Apache-2.0
#include <lrt/codegen.hpp>

#include <algorithm>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <lrt/client.hpp>
#include <lrt/rdf/codec.hpp>

#include "src/codegen/cpp_text.hpp"
#include "tests/client/robot_host.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

namespace {

using lrt::client::describe;
using lrt::client::Description;
using lrt::codegen::check;
using lrt::codegen::generate;
using lrt::codegen::GenerateOptions;
using lrt::rdf::Graph;
namespace cpp = lrt::codegen::cpp;
namespace unit = lrt::unit;
namespace vocab = lrt::vocab;

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }
std::string all(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& l : lines) text += l + "\n";
  return text;
}

/// The documents of a server with these Things.
Graph documents_of(std::vector<lrt::Thing> things) {
  lrt::test::RobotHost host(std::move(things));
  lrt::Client client = lrt::Client::create().value();
  const lrt::client::Robot robot = client.open(host.url()).value();
  std::vector<std::string> problems;
  Graph graph = lrt::client::read_documents(client, robot, problems).value();
  for (const std::string& p : problems) CHECK(contains(p, "/arm/broken"));  // the sample robot has a property that cannot be read
  return graph;
}
std::string header_of(const Graph& graph, const GenerateOptions& options = {}) { return generate(describe(graph).value(), options).value().header; }

Graph parse(const std::string& text) {
  static const std::string prefixes =
      "@prefix ex: <http://example.org/ns#> . @prefix sh: <http://www.w3.org/ns/shacl#> . @prefix xsd: <http://www.w3.org/2001/XMLSchema#> . "
      "@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> . @prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> . "
      "@prefix dcterms: <http://purl.org/dc/terms/> . @prefix hybrit: <https://hybr-it-projekt.de/ns/hybr-it#> . @prefix qudt: "
      "<http://qudt.org/schema/qudt/> . "
      "@prefix unit: <http://qudt.org/vocab/unit/> . @prefix http-core: <http://www.w3.org/2011/http#> . @prefix http-methods: "
      "<http://www.w3.org/2011/http-methods#> .\n";
  lrt::rdf::ReadOptions options;
  options.base = "http://robot.example/";
  options.max_triples = 1'000'000;
  options.max_bytes = 512 * 1024 * 1024;
  const auto graph = lrt::rdf::read(prefixes + text, lrt::rdf::Syntax::turtle, options);
  if (!graph) FAIL(graph.error().message);
  return *graph;
}

const lrt::client::PropertyDescription& property(const lrt::client::ThingDescription& thing, const std::string& name) {
  for (const auto& p : thing.properties)
    if (p.name == name) return p;
  FAIL("no property " + name);
  return thing.properties.front();
}

/// A Thing in the way of another author: one document, one Blueprint, no binding.
std::string thing(const std::string& value_shape, const std::string& more = "") {
  return R"(<joint> a hybrit:RoboticThing , ex:Joint ; dcterms:title "joint" ; hybrit:blueprint <blueprint> ; hybrit:property <joint/angle> ; ex:angle <joint/angle> )" +
         more + R"( .
    <joint/angle> a hybrit:Property .
    <blueprint> a sh:NodeShape ; sh:targetClass ex:Joint ; sh:property [ sh:path ex:angle ; sh:minCount 1 ; sh:maxCount 1 ; sh:node <angle> ] .
    <angle> a sh:NodeShape ; )" +
         value_shape + " .\n";
}
const std::string plain_number = "sh:property [ sh:path vom:numericalValue ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:double ]";

}  // namespace

TEST_CASE("a description has the words of all languages, and a header the English ones", "[codegen][R1.12]") {
  lrt::Thing door("door");
  door.title("Tür", "de").title("Door", "en");
  door.property("angle", [] { return 1.5; })
      .title("Winkel", "de")
      .title("Angle", "en")
      .description("Null ist zu.", "de")
      .description("Zero is shut.", "en");
  door.action("open", [] {}).title("Öffnen", "de");
  std::vector<lrt::Thing> things;
  things.push_back(std::move(door));
  const auto robot = describe(documents_of(std::move(things)));
  if (!robot) FAIL(robot.error().message);
  const auto& made = robot->things.front();
  CHECK(made.title == "Door");
  CHECK(made.words.titles.size() == 2);
  const lrt::rdf::Words& words = property(made, "angle").words;
  REQUIRE(words.titles.choose({"de-CH"}));
  CHECK(words.titles.choose({"de-CH"})->text == "Winkel");
  CHECK(words.descriptions.choose({"de"})->text == "Null ist zu.");
  CHECK(property(made, "angle").title == "Angle");
  CHECK(made.actions.front().title == "Öffnen");
  const std::string header = generate(*robot).value().header;
  CHECK(contains(header, "/// Angle. Zero is shut.\n"));
  CHECK(contains(header, "/// Öffnen.\n"));
}

TEST_CASE("words of a stranger are limited, and of one language the same in each reading", "[codegen]") {
  const std::string many = [] {
    std::string text;
    for (int i = 0; i < 1000; ++i) text += "<d> dcterms:title \"t\"@en-a" + std::to_string(1000 + i) + " . ";
    return text;
  }();
  const Graph graph =
      parse("<a> dcterms:title \"two\"@en , \"one\"@en , \"" + std::string(200, 'x') + "\"@de , <iri> . <b> dcterms:title 5 . " + many);
  const auto words = [&](const char* node) {
    return lrt::client::words_of(graph, *graph.find(lrt::rdf::iri("http://robot.example/" + std::string(node))), 100);
  };
  REQUIRE(words("a").titles.size() == 1);
  CHECK(words("a").titles.begin()->text == "one");
  CHECK(words("b").titles.begin()->text == "5");
  CHECK(words("d").titles.size() <= 101);
}

TEST_CASE("a robot is described by its links and Blueprints", "[codegen][R1.6][R1.11]") {
  lrt::test::SampleRobot sample;
  std::vector<lrt::Thing> things;
  things.push_back(sample.arm());
  things.push_back(sample.tool());
  const auto robot = describe(documents_of(std::move(things)));
  if (!robot) FAIL(robot.error().message);
  INFO(all(robot->warnings));
  REQUIRE(robot->things.size() == 2);
  const auto& arm = robot->things[0];
  CHECK(arm.title == "arm");
  CHECK(arm.classes == std::vector<std::string>{std::string(vocab::ros::RevoluteJoint.text)});
  CHECK(contains(arm.kind, "/blueprints/RevoluteJoint"));
  const auto& angle = property(arm, "angle");
  CHECK(angle.writable);
  REQUIRE(angle.schema);
  CHECK(angle.schema->facets().unit() == unit::degree);
  CHECK(angle.schema->facets().max() == 90.0);
  CHECK(angle.predicates == std::vector<std::string>{std::string(vocab::ros::rotation.text)});
  CHECK(!property(arm, "speed").writable);
  CHECK(property(arm, "speed").schema->type().single);
  CHECK(property(arm, "mode").schema->type().kind == lrt::rdf::Type::Kind::enumeration);
  CHECK(property(arm, "pose").schema->type().fields.size() == 4);
  CHECK(property(arm, "gains").schema->type().kind == lrt::rdf::Type::Kind::list);
  CHECK(property(robot->things[1], "weight").schema->facets().unit() == unit::kilogram);
  std::string actions;
  for (const auto& a : arm.actions) actions += a.name + (a.asynchronous ? " async" : "") + (a.input ? " in" : "") + (a.output ? " out" : "") + ", ";
  CHECK(actions == "fail, grip async, home, measure out, refuse, turn in, ");
  for (const auto& a : arm.actions) {
    if (a.name == "turn") CHECK(a.input->facets().unit() == unit::degree);
    if (a.name == "measure") CHECK(a.output->facets().unit() == unit::metre);
  }
}

TEST_CASE("the header is the same at each run, on each port and from a file", "[codegen][json_ld][R1.6]") {
  lrt::test::SampleRobot one, other;
  const Graph graph = documents_of(lrt::test::one_thing(one.arm()));
  const std::string header = header_of(graph);
  CHECK(header == header_of(documents_of(lrt::test::one_thing(other.arm()))));
  CHECK(!contains(header, "127.0.0.1"));
  for (const lrt::rdf::Syntax syntax : {lrt::rdf::Syntax::turtle, lrt::rdf::Syntax::n_triples, lrt::rdf::Syntax::json_ld}) {
    const auto text = lrt::rdf::write(graph, syntax);
    REQUIRE(text);
    const auto again = lrt::rdf::read(*text, syntax, {});
    REQUIRE(again);
    CHECK(header_of(*again) == header);
  }
  // A server may give its triples in another order. Then the fields of a struct may be in another order, too, but nothing has changed.
  std::mt19937 random(7);
  std::vector<lrt::rdf::Triple> triples = graph.triples();
  std::shuffle(triples.begin(), triples.end(), random);
  Graph shuffled;
  for (const auto& t : triples) shuffled.add(graph.term(t.subject), graph.term(t.predicate), graph.term(t.object));
  CHECK(all(check(header, describe(shuffled).value()).value()) == "");
  CHECK(all(check(header_of(shuffled), describe(graph).value()).value()) == "");
}

TEST_CASE("a shape that several documents repeat is understood as one", "[codegen][R1.6]") {
  lrt::test::SampleRobot sample;
  const Graph own = documents_of(lrt::test::one_thing(sample.arm())), with_blank_nodes = parse(thing(plain_number));
  for (const Graph* graph : {&own, &with_blank_nodes}) {
    Graph twice;
    lrt::client::merge_document(twice, *graph);
    lrt::client::merge_document(twice, *graph);
    if (graph == &with_blank_nodes) CHECK(twice.size() > graph->size());
    const Description one = describe(*graph).value(), two = describe(twice).value();
    CHECK(all(two.warnings) == all(one.warnings));
    CHECK(generate(two).value().header == generate(one).value().header);
  }
}

TEST_CASE("a kind has the name of its label, and the shape of a Thing alone replaces that of the kind", "[codegen][R1.6][R1.11]") {
  // Named nodes everywhere, lists too. The Blueprint of the kind is a class; each Thing has bounds of its own in a Blueprint of its own.
  const auto joint = [](const std::string& name, const std::string& hash, const std::string& low) {
    return "<" + name + "> a hybrit:RoboticThing , ex:Joint , <kinds/Joint-1a2b3c4d> , <" + name + "/blueprint#" + hash + "> ; dcterms:title \"" +
           name + "\" ; hybrit:blueprint <kinds/Joint-1a2b3c4d> , <" + name + "/blueprint> ; hybrit:property <" + name + "/angle> , <" + name +
           "/mode> ; ex:angle <" + name + "/angle> ; ex:mode <" + name + "/mode> . <" + name + "/angle> a hybrit:Property . <" + name +
           "/mode> a hybrit:Property . <" + name + "/blueprint#" + hash + "> a sh:NodeShape , rdfs:Class ; sh:property <" + name + "/blueprint#" +
           hash + ".1> . <" + name + "/blueprint#" + hash + ".1> sh:path ex:angle ; sh:node <" + name + "/blueprint#" + hash + "/angle> . <" + name +
           "/blueprint#" + hash + "/angle> a sh:NodeShape ; sh:property <" + name + "/blueprint#" + hash + "/angle.1> . <" + name + "/blueprint#" +
           hash + "/angle.1> sh:path vom:numericalValue ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:double ; sh:minInclusive " + low + " .\n";
  };
  const Graph graph =
      parse("@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .\n" + joint("a", "3f2a9c1e", "-1e0") + joint("b", "77770000", "-2e0") + R"(
    <kinds/Joint-1a2b3c4d> a sh:NodeShape , rdfs:Class ; rdfs:label "Shoulder" ; sh:property <kinds/Joint-1a2b3c4d#_1> , <kinds/Joint-1a2b3c4d#_2> .
    <kinds/Joint-1a2b3c4d#_1> sh:path ex:angle ; sh:minCount 1 ; sh:node <kinds/Joint-1a2b3c4d#about> , <kinds/Joint-1a2b3c4d#angle> .
    <kinds/Joint-1a2b3c4d#about> sh:property <kinds/Joint-1a2b3c4d#about.1> . <kinds/Joint-1a2b3c4d#about.1> sh:path dcterms:modified .
    <kinds/Joint-1a2b3c4d#angle> a sh:NodeShape ; sh:property <kinds/Joint-1a2b3c4d#angle.1> .
    <kinds/Joint-1a2b3c4d#angle.1> sh:path vom:numericalValue ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:double .
    <kinds/Joint-1a2b3c4d#_2> sh:path ex:mode ; sh:node <kinds/Joint-1a2b3c4d#about> , <kinds/Joint-1a2b3c4d#mode> .
    <kinds/Joint-1a2b3c4d#mode> a sh:NodeShape ; sh:property <kinds/Joint-1a2b3c4d#mode.1> .
    <kinds/Joint-1a2b3c4d#mode.1> sh:path rdf:value ; sh:minCount 1 ; sh:maxCount 1 ; sh:in <kinds/Joint-1a2b3c4d#mode.1-0> .
    <kinds/Joint-1a2b3c4d#mode.1-0> rdf:first "slow" ; rdf:rest <kinds/Joint-1a2b3c4d#mode.1-1> .
    <kinds/Joint-1a2b3c4d#mode.1-1> rdf:first "fast" ; rdf:rest rdf:nil .)");
  const Description robot = describe(graph).value();
  CHECK(all(robot.warnings) == "");
  REQUIRE(robot.things.size() == 2);
  CHECK(robot.things[0].kind == "http://robot.example/kinds/Joint-1a2b3c4d");
  CHECK(robot.things[0].kind_name == "Shoulder");
  CHECK(robot.things[0].classes == std::vector<std::string>{"http://example.org/ns#Joint"});
  CHECK(property(robot.things[0], "angle").schema->facets().min() == -1.0);
  CHECK(property(robot.things[1], "angle").schema->facets().min() == -2.0);
  CHECK(property(robot.things[1], "mode").schema->type().names == std::vector<std::string>{"slow", "fast"});
  const std::string header = generate(robot).value().header;
  CHECK(contains(header, "/// a, b.\nclass Shoulder {"));
  CHECK(contains(header, "Each Thing has its own bounds."));
  // Things with equal bounds may share a Blueprint, which refers to that of the kind. A value may be absent.
  const Graph shared = parse(R"(<c> a hybrit:RoboticThing , <kinds/C-1a2b3c4d> , <kinds/C-1a2b3c4d-5e6f7a8b> ; hybrit:blueprint <kinds/C-1a2b3c4d> ,
      <kinds/C-1a2b3c4d-5e6f7a8b> ; hybrit:property <c/angle> ; ex:angle <c/angle> . <c/angle> a hybrit:Property .
    <kinds/C-1a2b3c4d> a sh:NodeShape ; <http://www.w3.org/2000/01/rdf-schema#label> "C" ; sh:property [ sh:path ex:angle ; sh:or ( [ sh:property [ sh:path
      vom:numericalValue ; sh:maxCount 0 ] ] <kinds/C-1a2b3c4d#angle> ) ] .
    <kinds/C-1a2b3c4d#angle> a sh:NodeShape ; sh:property [ sh:path vom:numericalValue ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:double ] .
    <kinds/C-1a2b3c4d-5e6f7a8b> a sh:NodeShape ; sh:node <kinds/C-1a2b3c4d> ; sh:property [ sh:path ex:angle ; sh:or ( [ sh:property [ sh:path
      vom:numericalValue ; sh:maxCount 0 ] ] <kinds/C-1a2b3c4d-5e6f7a8b#angle> ) ] .
    <kinds/C-1a2b3c4d-5e6f7a8b#angle> a sh:NodeShape ; sh:property [ sh:path vom:numericalValue ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype
      xsd:double ; sh:maxInclusive 5e0 ] .)");
  const Description third = describe(shared).value();
  CHECK(all(third.warnings) == "");
  CHECK(third.things[0].kind == "http://robot.example/kinds/C-1a2b3c4d");
  CHECK(third.things[0].classes.empty());
  CHECK(property(third.things[0], "angle").schema->facets().max() == 5.0);
  for (const char* hash : {"1a2b3c4d", "3f2a9c1e", "77770000"}) CHECK(!contains(header, hash));
  // Without a label: sh:name, then the target class, then the IRI.
  const auto named = [](const std::string& more) { return describe(parse(thing(plain_number) + more)).value().things[0].kind_name; };
  CHECK(named("") == "Joint");
  CHECK(named("<blueprint> sh:name \"Elbow\" .") == "Elbow");
  CHECK(named("<blueprint> sh:name \"Elbow\" ; <http://www.w3.org/2000/01/rdf-schema#label> \"Wrist\" .") == "Wrist");
}

TEST_CASE("Things of one kind give one class, and bounds that differ are left out", "[codegen][R1.6]") {
  const auto joint = [](const std::string& path, double low, bool other_unit = false) {
    lrt::Thing t{path};
    t.type(vocab::ros::RevoluteJoint)
        .property(
            "angle", [] { return 0.5; }, other_unit ? unit::degree : unit::radian)
        .between(low, 7);
    t.property(
         "load", [] { return 0.5; }, unit::newton)
        .between(0, 5);
    return t;
  };
  std::vector<lrt::Thing> things;
  for (const char* path : {"a", "b", "c"}) things.push_back(joint(path, path[0] == 'b' ? -2 : -1));
  things.push_back(joint("d", -1, true));
  const std::string header = header_of(documents_of(std::move(things)));
  CHECK(contains(header, "/// a, b, c.\nclass RevoluteJoint {"));
  CHECK(contains(header, "/// angle: [rad]. Each Thing has its own bounds.\n"));
  CHECK(contains(header, "/// load: [N], at least 0, at most 5.\n"));
  CHECK(contains(header, "/// d.\nclass RevoluteJoint2 {"));
  CHECK(contains(header, "/// angle: [deg], at least -1, at most 7.\n"));
}

TEST_CASE("a Blueprint of another author is understood", "[codegen][R1.6]") {
  const auto robot = describe(parse(thing(plain_number)));
  REQUIRE(robot);
  CHECK(all(robot->warnings) == "");
  REQUIRE(robot->things.size() == 1);
  CHECK(robot->things[0].kind == "http://robot.example/blueprint");
  REQUIRE(property(robot->things[0], "angle").schema);
  CHECK(contains(header_of(parse(thing(plain_number))), "class Joint {"));
  // Without a Blueprint the Property's own statements count.
  const auto bare = describe(parse(R"(<joint> hybrit:property <joint/a> , <joint/b> , <joint/c> , <joint/d> .
    <joint/a> qudt:dataType xsd:int ; qudt:hasUnit unit:M . <joint/b> rdf:value "x" . <joint/c> a hybrit:Property .
    <joint/d> <https://w3id.org/lrt/ns#datatype> xsd:int ; qudt:hasUnit unit:M .)"));
  REQUIRE(bare);
  for (const char* name : {"a", "d"}) {
    const lrt::rdf::Type& type = property(bare->things[0], name).schema->type();
    REQUIRE(type.kind == lrt::rdf::Type::Kind::optional);
    CHECK(type.element->kind == lrt::rdf::Type::Kind::integer);
    CHECK(property(bare->things[0], name).schema->facets().unit() == unit::metre);
  }
  CHECK(property(bare->things[0], "b").schema);
  CHECK(!property(bare->things[0], "c").schema);
  CHECK(contains(all(bare->warnings), "joint/c>: no shape says what its value is"));
}

TEST_CASE("what C++ cannot express is a comment and a warning", "[codegen][R1.6]") {
  const auto robot = describe(
      parse(thing("sh:property [ sh:path ex:to ; sh:minCount 1 ; sh:maxCount 1 ; sh:nodeKind sh:IRI ]", "; hybrit:action <joint/actions/go>") +
            "<joint/actions/go> a hybrit:Action ; hybrit:consumes [ sh:property [ sh:path ex:to ; sh:minCount 1 ; sh:nodeKind sh:IRI ] ] ."));
  REQUIRE(robot);
  const auto made = generate(*robot);
  REQUIRE(made);
  CHECK(contains(made->header, "// What C++ cannot express:\n"));
  CHECK(contains(made->header, "//   Joint, property angle: no shape says what the value is"));
  CHECK(contains(made->header, "//   Joint, action go: no C++ type for its input"));
  CHECK(contains(made->header, "lrt::client::Untyped angle;"));
  CHECK(contains(made->header, "lrt::client::UntypedAction go;"));
  CHECK(contains(all(made->warnings), "is an IRI, which a type does not have"));
}

TEST_CASE("a check names each difference with its Thing and its field", "[codegen][R1.6]") {
  const std::string fields =
      "sh:class ex:Point ; sh:property [ sh:path ex:x ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:double ; sh:maxInclusive 5 ] , "
      "[ sh:path ex:mode ; sh:minCount 1 ; sh:maxCount 1 ; sh:in ( \"a\" \"b\" ) ]";
  const std::string header = header_of(parse(thing(fields)));
  const auto differences = [&](const std::string& other) {
    const auto found = check(header, describe(parse(other)).value());
    return found ? all(*found) : "error: " + found.error().message;
  };
  CHECK(differences(thing(fields)) == "");
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string changed = fields;
    changed.replace(changed.find(from), from.size(), to);
    return differences(thing(changed));
  };
  CHECK(with("xsd:double", "xsd:float") ==
        "Joint, property angle, field x: the header has xsd:double, at most 5, the robot has xsd:float, at most 5\n");
  CHECK(with("sh:maxInclusive 5", "sh:maxExclusive 5") ==
        "Joint, property angle, field x: the header has xsd:double, at most 5, the robot has xsd:double, below 5\n");
  CHECK(with("\"b\"", "\"b\" \"c\"") ==
        "Joint, property angle, field mode: the header has one of \"a\" \"b\", the robot has one of \"a\" \"b\" \"c\"\n");
  CHECK(with("ex:mode ; sh:minCount 1", "ex:mode") ==
        "Joint, property angle, field mode: the header has one of \"a\" \"b\", the robot has optional one of \"a\" \"b\"\n");
  CHECK(contains(with("ex:x", "ex:z"), "Joint, property angle, field x: the robot does not have it any more: xsd:double"));
  CHECK(contains(with("ex:x", "ex:z"), "Joint, property angle, field z: the header does not have it yet: xsd:double"));
  CHECK(contains(with("ex:Point", "ex:Place"),
                 "Joint, property angle: the header has record http://example.org/ns#Point, the robot has record http://example.org/ns#Place"));
  const std::string go = thing(fields, "; hybrit:action <joint/actions/go>");
  CHECK(differences(go + "<joint/actions/go> dcterms:title \"go\" .") == "Joint, action go: the header does not have it yet\n");
  CHECK(contains(differences(go), "Joint, input of action go: the header does not have it yet"));  // its document is missing
  CHECK(contains(differences("<lamp> a hybrit:RoboticThing , ex:Lamp ; dcterms:title \"lamp\" ."), "Joint: the robot does not have it any more"));
  CHECK(contains(differences("<lamp> a hybrit:RoboticThing , ex:Lamp ; dcterms:title \"lamp\" ."), "Lamp: the header does not have it yet"));
  // A Property that has become writable.
  CHECK(contains(differences(thing(fields) + "<joint/angle> hybrit:binding [ http-core:mthd http-methods:PUT ] ."), "the header has read-only"));
  CHECK(differences(thing(fields, "; dcterms:description \"words do not count\"")) == "");
}

TEST_CASE("a check refuses what is no header or has been edited", "[codegen][R1.6]") {
  const Description robot = describe(parse(thing(plain_number))).value();
  std::string header = generate(robot).value().header;
  CHECK(check(header, robot).value().empty());
  CHECK(!check("", robot));
  CHECK(!check("#pragma once\n", robot));
  CHECK(contains(check(header.substr(0, header.size() - 20), robot).error().message, "made by lrt generate"));
  std::string edited = header;
  edited.replace(edited.find("| xsd:double"), 12, "| xsd:float ");
  CHECK(contains(check(edited, robot).error().message, "has been changed"));
  edited = header;
  edited.insert(edited.find("class Joint"), "/* a comment of a person */ ");
  CHECK(check(edited, robot).value().empty());
}

TEST_CASE("texts of a robot stay within their comments, literals and identifiers", "[codegen][R1.6]") {
  for (const std::string& text : {std::string("a */ b"), std::string("// /* x"), std::string("line\nbreak\r\nend \\"),
                                  std::string("?"
                                              "?/"),
                                  std::string("a\"b"), std::string("\\"),
                                  std::string("\xE2\x80\xAE"
                                              "reversed"),
                                  std::string("\xFF\xFE"), std::string("nul\0byte", 8), std::string("\xE2\x80\xA8line"), std::string("R\"(x)\""),
                                  std::string("?"
                                              "?"
                                              "?/\n#define x"),
                                  std::string(300, '*') + "/", std::string("%s%n")}) {
    CAPTURE(text);
    const std::string comment = cpp::comment_text(text, 200);
    CHECK(comment.size() <= 203);
    for (const char* bad : {"*/", "/*", "\n", "\r",
                            "?"
                            "?",
                            "\\", "\xE2\x80\xAE", "\xE2\x80\xA8", "\xFF"})
      CHECK(!contains(comment, bad));
    CHECK(comment.find('\0') == std::string::npos);
    const std::string literal = cpp::string_literal(text);
    CHECK(std::all_of(literal.begin(), literal.end(), [](char c) { return c >= 0x20 && c < 0x7F; }));
    CHECK(std::count(literal.begin(), literal.end(), '"') == 2);
    CHECK(std::count(literal.begin(), literal.end(), '?') == 0);
    for (const std::string& name : {cpp::type_name(text, 64), cpp::member_name(text, 64)}) {
      CHECK(!name.empty());
      CHECK(name.size() <= 66);
      CHECK(std::all_of(name.begin(), name.end(),
                        [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_'; }));
      CHECK(name.find("__") == std::string::npos);
      CHECK(!(name.front() >= '0' && name.front() <= '9'));
      CHECK(name.front() != '_');
    }
  }
}

TEST_CASE("names become identifiers", "[codegen][R1.6]") {
  struct {
    const char *name, *member, *type;
  } const table[] = {{"rotation", "rotation", "Rotation"},
                     {"RevoluteJoint", "revoluteJoint", "RevoluteJoint"},
                     {"joint-limits", "joint_limits", "JointLimits"},
                     {"class", "class_", "Class"},
                     {"NULL", "null", "Null"},
                     {"EOF", "eof", "Eof"},
                     {"2nd axis", "n2nd_axis", "N2ndAxis"},
                     {"gr\xC3\xB6\xC3\x9F"
                      "e",
                      "groesse", "Groesse"},
                     {"\xE4\xB8\xAD", "u4e2d", "U4e2d"},
                     {"", "unnamed", "Unnamed"},
                     {"---", "unnamed", "Unnamed"},
                     {"linux", "linux_", "Linux"},
                     {"IOLevel", "ioLevel", "IOLevel"},
                     {"Vector3D", "vector3D", "Vector3D"},
                     {"a__b", "a_b", "AB"},
                     {"_x_", "x", "X"},
                     {"co_await", "co_await_", "CoAwait"},
                     {"std", "std_", "Std"}};
  for (const auto& row : table) {
    CAPTURE(row.name);
    CHECK(cpp::member_name(row.name, 64) == row.member);
    CHECK(cpp::type_name(row.name, 64) == row.type);
  }
  cpp::Scope scope;
  CHECK(scope.add("a") == "a");
  CHECK(scope.add("a") == "a2");
  CHECK(scope.add("a2") == "a2_2");
  CHECK(scope.add("a") == "a3");
}

TEST_CASE("only a namespace of identifiers is accepted", "[codegen][R1.6]") {
  const Description robot = describe(parse(thing(plain_number))).value();
  for (const char* good : {"robot", "acme::robot", "a1", "client", "rdf"}) {
    GenerateOptions options;
    options.name_space = good;
    CHECK(generate(robot, options));
  }
  for (const char* bad : {"", "::a", "a::", "a:b", "a b", "1a", "class", "lrt", "a::std", "_a", "a__b", "a;", "a::::b"}) {
    CAPTURE(bad);
    GenerateOptions options;
    options.name_space = bad;
    const auto made = generate(robot, options);
    REQUIRE(!made);
    CHECK(made.error().code == lrt::Errc::invalid_option);
  }
}

TEST_CASE("a hostile description ends at the limits", "[codegen][R1.6]") {
  SECTION("a long header") {
    GenerateOptions options;
    options.max_bytes = 500;
    CHECK(generate(describe(parse(thing(plain_number))).value(), options).error().code == lrt::Errc::limit_exceeded);
  }
  SECTION("many Things") {
    std::string text;
    for (int i = 0; i < 10'001; ++i) text += "<t" + std::to_string(i) + "> hybrit:blueprint <b> .\n";
    CHECK(describe(parse(text)).error().code == lrt::Errc::limit_exceeded);
  }
  SECTION("many members") {
    std::string text;
    for (int i = 0; i < 1'001; ++i) text += "<t> hybrit:property <p" + std::to_string(i) + "> .\n";
    CHECK(describe(parse(text)).error().code == lrt::Errc::limit_exceeded);
  }
  SECTION("Blueprints in a circle, and one that is its own") {
    const auto robot = describe(parse("<t> hybrit:blueprint <a> ; hybrit:property <p> . <a> sh:node <b> . <b> sh:node <a> , <b> ."));
    REQUIRE(robot);
    CHECK(generate(*robot));
  }
  SECTION("an ill-formed shape is a warning") {
    const auto robot = describe(parse(thing("sh:property \"x\"")));
    REQUIRE(robot);
    CHECK(contains(all(robot->warnings), "expected a shape as sh:property"));
  }
  SECTION("long names") {
    const std::string name(6'000, 'x');
    const auto made = generate(describe(parse("<t> hybrit:property <t/" + name + "> . <t/" + name + "> rdf:value 5 .")).value());
    REQUIRE(made);
    CHECK(contains(made->header, "the name of a property is too long"));
    CHECK(made->header.size() < 40'000);
  }
}

TEST_CASE("a file of shapes alone gives their types", "[codegen][R1.6]") {
  const auto robot = describe(parse(R"(ex:PersonShape a sh:NodeShape ; sh:targetClass ex:Person ;
      sh:property [ sh:path ex:name ; sh:minCount 1 ; sh:maxCount 1 ; sh:datatype xsd:string ] , [ sh:path ex:born ; sh:maxCount 1 ; sh:datatype xsd:date ] .
    ex:SpeedShape a sh:NodeShape ; )" +
                                    plain_number + " ."));
  REQUIRE(robot);
  const auto made = generate(*robot);
  REQUIRE(made);
  CHECK(contains(made->header, "struct Person {\n  std::string name;\n  std::optional<std::string> born;  ///< may be absent\n};"));
  CHECK(contains(made->header, "with_datatype(*t.fields[1].type, lrt::Iri{\"http://www.w3.org/2001/XMLSchema#date\"})"));
  CHECK(contains(made->header, "using SpeedShape = double;"));
  CHECK(check(made->header, *robot).value().empty());
}

TEST_CASE("a type with another datatype is read and written with it", "[codegen][R1.6]") {
  using lrt::rdf::traits;
  const lrt::Iri date{"http://www.w3.org/2001/XMLSchema#date"};
  const auto& texts = lrt::client::with_datatype(traits<std::vector<std::string>>::type(), date);
  CHECK(&texts == &lrt::client::with_datatype(traits<std::vector<std::string>>::type(), date));
  CHECK(texts.element->datatype == date);
  Graph graph;
  const auto focus = graph.fresh_blank();
  lrt::rdf::write_value(graph, focus, texts, {}, traits<std::vector<std::string>>::encode({"2020-01-02"}), {});
  CHECK(graph.find(lrt::rdf::literal("2020-01-02", date)));
  std::vector<lrt::rdf::Mismatch> mismatches;
  CHECK(lrt::rdf::read_value(graph, focus, texts, {}, {}, mismatches));
}

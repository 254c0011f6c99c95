// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/tree.hpp"

#include <string>

#include <lrt/thing.hpp>
#include <lrt/world.hpp>

#include "tests/support/allocation_counters.hpp"  // counted by subscription_test.cpp
#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

/// A robot with an arm, whose joint is a Thing below the arm; and another Thing.
struct Robot {
  explicit Robot(engine::EngineOptions options = {}) : bench(std::move(options)) {
    Thing robot{"robot"};
    robot.property("battery", [this] { return battery; });
    Thing arm{"robot/arm"};
    arm.title("The arm");
    Thing joint{"robot/arm/j 1"};
    angle = joint.property<double>("angle", unit::degree);
    angle->publish(10);
    joint.property<double>("silent");
    joint.property("encoder", [this] {
      if (broken) throw std::runtime_error("the encoder does not answer");
      return 42;
    });
    joint.action("home", [] {});
    Thing lamp{"lamp"};
    lamp.property("on", [] { return true; });
    for (Thing* thing : {&robot, &arm, &joint, &lamp}) bench.add(std::move(*thing));
  }
  Answer get(const std::string& path, const std::string& accept) { return bench.ask("GET " + path + "\nAccept: " + accept); }

  int battery = 77;
  bool broken = false;
  std::optional<PushedProperty<double>> angle;
  Bench bench;
};

/// All graphs of a document in N-Quads, by name; the default graph has an empty one.
std::map<std::string, rdf::Graph> graphs_of(const std::string& n_quads) {
  std::map<std::string, std::string> texts;
  for (std::size_t at = 0; at < n_quads.size();) {
    const std::size_t end = n_quads.find('\n', at);
    std::string line = n_quads.substr(at, end - at);
    at = end + 1;
    // "... <graph> ." or "... object .": the graph is a fourth term.
    const std::size_t dot = line.rfind(" ."), from = line.rfind(" <", dot);
    std::string name;
    if (from != std::string::npos && line[dot - 1] == '>') {
      const std::string without = line.substr(0, from) + " .";
      if (rdf::read(without, rdf::Syntax::n_triples, {})) {
        name = line.substr(from + 2, dot - from - 3);
        line = without;
      }
    }
    texts[name] += line + "\n";
  }
  std::map<std::string, rdf::Graph> graphs;
  for (const auto& [name, text] : texts) graphs[name] = rdf::read(text, rdf::Syntax::n_triples, {}).value();
  return graphs;
}

}  // namespace

TEST_CASE("a Thing with others below, and the root, link to one document of all of them", "[engine][R0.9]") {
  Robot r;
  for (const auto& [path, all] : {std::pair<std::string, std::string>("/", "http://localhost/all"),
                                  {"/robot", "http://localhost/robot/all"},
                                  {"/robot/arm", "http://localhost/robot/arm/all"}}) {
    CAPTURE(path);
    const Answer answer = r.bench.get(path);
    CHECK(missing(answer, "<" + path.substr(1) + "> lrt:all <" + all + "> .") == "");
    CHECK(answer.links_to(all, "https://w3id.org/lrt/ns#all"));
    CHECK(answer.links_to(all, "related"));
    const Answer document = r.bench.get(all.substr(16));
    CHECK(document.status == 200);
    CHECK(document.links_to("http://localhost" + path, "up"));
    CHECK(document.field("Allow") == "GET, HEAD, OPTIONS");
  }
  CHECK_FALSE(r.bench.get("/lamp").says("lrt:all"));
  CHECK(r.bench.get("/robot").linked("https://w3id.org/lrt/ns#all").size() == 1);
  CHECK(r.get("/robot", "application/json").says("\"all\":{\"href\":\"http://localhost/robot/all\",\"kind\":\"all\""));
}

TEST_CASE("the document has the state of each Thing below, in every syntax", "[engine][json_ld][R1.2]") {
  Robot r;
  rdf::Graph states;
  for (const char* thing : {"/robot/state", "/robot/arm/state", "/robot/arm/j%201/state"}) {
    const rdf::Graph state = r.get(thing, "application/n-triples").graph();
    for (const rdf::Triple& t : state.triples())
      if (state.term(t.subject).text != std::string("http://localhost") + thing)  // how the state can be watched
        states.add(state.term(t.subject), state.term(t.predicate), state.term(t.object));
  }
  const Answer turtle = r.bench.get("/robot/all");
  CHECK(turtle.field("Content-Type") == "text/turtle");
  CHECK(missing(turtle,
                "<robot> dcterms:hasPart <robot/arm> . <robot/battery> vom:numericalValue \"77\"^^xsd:int ."
                "<robot/arm/j%201> hybrit:action <robot/arm/j%201/actions/home> . <robot/arm/j%201/angle> vom:numericalValue "
                "\"10\"^^xsd:double ; vom:unit maths:Degree .") == "");
  CHECK_FALSE(turtle.says("lamp"));
  for (const char* syntax : {"application/n-triples", "application/ld+json", "text/turtle"}) {
    CAPTURE(syntax);
    const Answer answer = r.get("/robot/all", syntax);
    REQUIRE(answer.status == 200);
    CHECK(answer.graph().size() == turtle.graph().size());
    CHECK(missing(answer.graph(), turtle.graph()) == "");
  }
  CHECK(missing(turtle.graph(), states) == "");
  CHECK(r.bench.get("/all").says("<http://localhost/lamp/on>"));
}

TEST_CASE("the document of all Things in RDF/XML has the same triples", "[engine][rdf_xml][R1.2]") {
  Robot r;
  const Answer turtle = r.bench.get("/robot/all"), xml = r.get("/robot/all", "application/rdf+xml");
  REQUIRE(xml.status == 200);
  CHECK(xml.graph().size() == turtle.graph().size());
  CHECK(missing(xml.graph(), turtle.graph()) == "");
}

TEST_CASE("TriG and N-Quads have a graph for each resource, and all of them as the default graph", "[engine][R1.2]") {
  Robot r;
  const Answer turtle = r.bench.get("/robot/all"), quads = r.get("/robot/all", "application/n-quads"), trig = r.get("/robot/all", "application/trig");
  REQUIRE(quads.status == 200);
  REQUIRE(quads.field("Content-Type") == "application/n-quads");
  REQUIRE(trig.field("Content-Type") == "application/trig");
  const auto graphs = graphs_of(quads.body);
  std::set<std::string> names;
  for (const auto& [name, graph] : graphs) names.insert(name);
  const std::string base = "http://localhost/robot";
  CHECK(names == std::set<std::string>{"", base, base + "/battery", base + "/arm", base + "/arm/j%201", base + "/arm/j%201/angle",
                                       base + "/arm/j%201/silent", base + "/arm/j%201/encoder"});
  CHECK(graphs.at("").size() == turtle.graph().size());
  CHECK(missing(graphs.at(""), turtle.graph()) == "");
  CHECK(missing(graphs.at(base + "/arm/j%201/angle"), "<robot/arm/j%201/angle> a hybrit:Property ; vom:numericalValue \"10\"^^xsd:double .") == "");
  CHECK(graphs.at(base + "/arm/j%201/angle").find(vocab::dcterms::title) == std::nullopt);
  for (const std::string& name : names)
    if (!name.empty()) CHECK(trig.says("\n<" + name + "> {\n"));
  CHECK(quads.tag() != trig.tag());
  const auto of_state = graphs_of(r.get("/robot/arm/j%201/state", "application/n-quads").body);
  CHECK(of_state.size() == 5);
  // Of another resource they are the default graph.
  CHECK(r.get("/robot/battery", "application/n-quads").body == r.get("/robot/battery", "application/n-triples").body);
  CHECK(r.get("/robot/battery", "application/trig").body == r.get("/robot/battery", "text/turtle").body);
}

TEST_CASE("as JSON a Thing's state has a member for each Thing below it", "[engine][R1.2]") {
  Robot r;
  CHECK(r.get("/robot/all", "application/json").body == R"({"battery":77,"arm":{"j 1":{"angle":10,"encoder":42}}})");
  CHECK(r.get("/all", "application/json").body == R"({"robot":{"battery":77,"arm":{"j 1":{"angle":10,"encoder":42}}},"lamp":{"on":true}})");
  CHECK(r.get("/lamp/all", "application/json").body == r.get("/lamp/state", "application/json").body);
}

TEST_CASE("its entity tag moves with each value and with the structure, and only then", "[engine][R0.11]") {
  Robot r;
  const std::string first = r.bench.get("/robot/all").tag();
  CHECK(r.bench.get("/robot/all").tag() == first);
  CHECK(r.bench.ask("GET /robot/all\nIf-None-Match: " + first).status == 304);
  r.battery = 76;
  const std::string second = r.bench.get("/robot/all").tag();
  CHECK(second != first);
  r.angle->publish(11);
  const std::string third = r.bench.get("/robot/all").tag();
  CHECK(third != second);
  r.bench.add(Thing{"robot/leg"});
  CHECK(r.bench.get("/robot/all").tag() != third);
  CHECK(r.bench.engine.remove("robot/leg"));
  CHECK(r.bench.get("/robot/all").tag() == third);
}

TEST_CASE("one property that cannot be read does not hide the robot; it says why", "[engine][R0.6]") {
  Robot r;
  const Answer whole = r.bench.get("/robot/all");
  r.broken = true;
  CHECK(r.bench.get("/robot/arm/j%201/state").status == 200);
  const Answer partial = r.bench.get("/robot/all");
  REQUIRE(partial.status == 200);
  CHECK(missing(partial,
                "<robot/arm/j%201> hybrit:property <robot/arm/j%201/encoder> . <robot/arm/j%201/angle> vom:numericalValue "
                "\"10\"^^xsd:double .") == "");
  CHECK(missing(partial, "<robot/arm/j%201/encoder> vom:numericalValue [] .") != "");
  CHECK(missing(partial, "<robot/arm/j%201/encoder> lrt:error \"it could not be read: it threw: the encoder does not answer\" .") == "");
  CHECK(r.get("/robot/all", "application/json").body ==
        R"({"battery":77,"arm":{"j 1":{"angle":10,"@errors":{"encoder":"it could not be read: it threw: the encoder does not answer"}}}})");
  auto graphs = graphs_of(r.get("/robot/all", "application/n-quads").body);
  CHECK(missing(graphs.at("http://localhost/robot/arm/j%201/encoder"), "<robot/arm/j%201/encoder> lrt:error [] .", "http://localhost/") == "");
  r.broken = false;
  CHECK(r.bench.get("/robot/all").tag() == whole.tag());
}

TEST_CASE("a document that is too large is 406, and its size is an option", "[engine][R0.6]") {
  engine::EngineOptions options;
  options.max_all_bytes = 2000;
  Robot r(std::move(options));
  const Answer answer = r.get("/robot/all", "text/turtle");
  CHECK(answer.status == 406);
  CHECK(answer.says("2000 bytes"));
  CHECK(r.bench.get("/robot/all").field("Content-Type") == "application/json");  // what fits
  CHECK(r.bench.get("/robot/arm/j%201/state").status == 200);
}

TEST_CASE("a document that is too large in every form is 406 for a client that accepts anything, after one attempt in RDF", "[engine][R0.6]") {
  engine::EngineOptions options;
  options.max_all_bytes = 10;
  Robot r(std::move(options));
  const auto cost = [&](const std::string& accept) {
    const std::size_t before = allocated_bytes;
    CHECK(r.get("/robot/all", accept).status == 406);
    return allocated_bytes - before;
  };
  const std::size_t turtle = cost("text/turtle");
  CHECK(cost("text/turtle, application/n-triples, application/trig, application/n-quads, application/ld+json") <= 2 * turtle);
  CHECK(r.bench.get("/robot/all").status == 406);
  CHECK(r.get("/robot/all", "*/*").status == 406);
  CHECK(r.get("/robot/all", "text/html").status == 200);
}

TEST_CASE("a name of the user has precedence over \"all\", and the document cannot be watched", "[engine][R0.3][R0.12]") {
  Robot r;
  Thing thing{"all"};
  thing.property<int>("all").publish(3);
  r.bench.add(std::move(thing));
  CHECK(r.get("/all/all", "application/json").body == "3");
  CHECK(missing(r.bench.get("/"), "<> lrt:all <all-lrt> .") == "");
  CHECK(r.get("/all-lrt", "application/json").says("\"all\":{\"all\":3}"));
  CHECK(r.bench.ask("GET /robot/all\nUpgrade: callback\nCallback: http://127.0.0.1:9/").status == 200);
}

TEST_CASE("members in JSON have the names that people gave, without percent-encoding", "[engine]") {
  Bench bench;
  Thing odd{"x y"};
  odd.property("val ue+", [] { return 1; });
  odd.property(
      "gr\xC3\xB6\xC3\x9F"
      "e/max \"1\"",
      [] { return 2; });
  odd.property("%FF", [] { return 3; });
  odd.action("turn left", [] {});
  bench.add(std::move(odd));
  const auto get = [&](const std::string& path) { return bench.ask("GET " + path + "\nAccept: application/json"); };
  const std::string members =
      "{\"val ue+\":1,\"gr\xC3\xB6\xC3\x9F"
      "e/max \\\"1\\\"\":2,\"%FF\":3}";
  CHECK(get("/x%20y/state").body == members);
  CHECK(get("/x%20y/all").body == members);
  CHECK(get("/all").body == "{\"x y\":" + members + "}");
  CHECK(get("/x%20y").says("\"val ue+\":{\"href\":\"http://localhost/x%20y/val%20ue+\""));
  CHECK(get("/x%20y").says("\"turn left\":{\"href\":\"http://localhost/x%20y/actions/turn%20left\""));
}

TEST_CASE("a document of many resources is made again when the structure and its first part change together", "[engine][world]") {
  Bench bench;
  Thing arm{"arm"};
  auto angle = arm.property<int>("angle");
  bench.add(std::move(arm));
  World world("world");
  auto map = world.graph("map");
  bench.add(std::move(world));
  for (int i = 0; i < 8; ++i) {
    for (const char* path : {"/all", "/world?default"}) (void)bench.get(path);
    angle.publish(1000 + i);
    map.update([&](GraphUpdate& u) { u.add("#x", vocab::rdfs::label, 1000 + i); }).value();
    bench.add(Thing{"other" + std::to_string(i)});
    CAPTURE(i);
    for (const char* path : {"/all", "/world?default"}) CHECK(bench.get(path).body.find(std::to_string(1000 + i)) != std::string::npos);
  }
}

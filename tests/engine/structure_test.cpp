// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/structure.hpp"

#include <lrt/engine/engine.hpp>

#include <string>
#include <vector>

#include "src/security/policy.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/graphs.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;
using security::Principal;
using security::Right;
using security::Rights;
using security::Rule;

namespace {

const std::string host = "http://localhost";
const std::string json_type = "\nAccept: application/json";

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

std::string structure_of(Bench& bench, const std::string& query = {}, const std::string& fields = {}) {
  const Answer a = bench.ask("GET /ns/structure" + query + json_type + "\n" + fields);
  CHECK(a.status == 200);
  return a.body;
}

/// The member `structure`.
std::string version_of(const std::string& document) {
  const std::string name = R"("structure":")";
  const std::size_t at = document.find(name) + name.size();
  return document.substr(at, document.find('"', at) - at);
}

/// A cell with equal joints: "cell/joint0", ...
void add_joints(Bench& bench, std::size_t n) {
  bench.add(Thing{"cell"});
  for (std::size_t i = 0; i < n; ++i) {
    Thing joint{"cell/joint" + std::to_string(i)};
    joint.type(Iri("http://ros.org/#RevoluteJoint"));
    joint.property<double>("angle", unit::radian).between(-1 - static_cast<double>(i), 1).publish(0.5);
    bench.add(std::move(joint));
  }
}

/// An engine whose callers are named by the field Who, with rules of a policy.
struct Ruled {
  explicit Ruled(const std::vector<Rule>& rules) : policy(security::Policy::create(rules).value()), bench(with_rules()) {}
  engine::EngineOptions with_rules() {
    engine::EngineOptions options;
    options.authorize = [this](const http::Request& request) {
      engine::Caller caller;
      const auto who = request.find("Who");
      if (who) caller.principal = std::make_shared<const Principal>(Principal{std::string(*who), {}});
      caller.view = policy->view(caller.principal.get());
      return caller;
    };
    return options;
  }
  std::shared_ptr<security::Policy> policy;
  Bench bench;
};

}  // namespace

TEST_CASE("the structure document has what a robot is, without values", "[engine][R0.4]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  bench.add(robot.tool());
  const std::string all = structure_of(bench);
  CHECK(all.substr(0, all.find("\"kinds\"")) ==
        R"({"href":"http://localhost/ns/structure","kind":"structure","methods":["GET","HEAD","OPTIONS"],"parent":{"href":"http://localhost/",)"
        R"("kind":"root","methods":["GET","HEAD","OPTIONS"]},"structure":")" +
            version_of(all) + R"(","vocabulary":"http://localhost/ns/vocabulary#Thing/","count":2,)");
  CHECK(version_of(all).size() == 16);
  CHECK(contains(all, R"("schema":{"type":"number","unit":"deg"},"datatype":"http://www.w3.org/2001/XMLSchema#double",)"
                      R"("units":["http://qudt.org/vocab/unit/DEG","http://vocab.arvida.de/2015/06/maths/vocab#Degree"])"));
  CHECK(contains(all, R"("mode":{"schema":{"type":"string","enum":["idle","active"]},)"));
  CHECK(contains(all, R"("turn":{"path":"actions/turn","input":{"type":"number","unit":"deg"},)"));
  CHECK(contains(all, R"("waypoints":{)"));
  CHECK(contains(all, R"("things":[{"path":"/arm","names":["Arm"],"kind":"RevoluteJoint-)"));
  CHECK(contains(all, R"({"path":"/arm/tool","title":"The tool","kind":")"));
  CHECK(contains(all, R"("parent":"/arm"})"));

  const std::string tag = bench.ask("GET /ns/structure" + json_type).field("ETag");
  robot.angle_handle->publish(77);
  bench.look();
  CHECK(bench.ask("PUT /arm/angle\nContent-Type: application/json\n\n12").status == 204);
  CHECK(bench.ask("POST /arm/actions/grip").status == 204);
  CHECK(bench.ask("GET /ns/structure" + json_type).field("ETag") == tag);
  CHECK(bench.ask("GET /ns/structure" + json_type + "\nIf-None-Match: " + tag).status == 304);
  bench.add(Thing{"other"});
  CHECK(bench.ask("GET /ns/structure" + json_type + "\nIf-None-Match: " + tag).status == 200);
  CHECK(version_of(structure_of(bench)) != version_of(all));
  CHECK(bench.engine.remove("other"));
  CHECK(bench.ask("GET /ns/structure" + json_type).field("ETag") == tag);
}

TEST_CASE("the list of Things leads to the structure document", "[engine][R0.4][R0.9]") {
  Bench bench;
  bench.add(Thing{"arm"});
  CHECK(bench.get("/").graph().objects(rdf::iri(host + "/"), rdf::TermView(vocab::lrt_::structure)).front().text == host + "/ns/structure");
  CHECK(contains(bench.get("/").field("Link"), "<http://localhost/ns/structure>; rel=\"https://w3id.org/lrt/ns#structure\""));
  CHECK(contains(bench.ask("GET /" + json_type).body, R"("structure":{"href":"http://localhost/ns/structure",)"));
}

TEST_CASE("in RDF the structure document has the Things as they describe themselves", "[engine][R1.3]") {
  SampleRobot robot;
  Bench bench;
  bench.add(robot.arm());
  bench.add(robot.tool());
  const rdf::Graph all = bench.get("/ns/structure").graph();
  for (const char* path : {"/arm", "/arm/tool"}) {
    const rdf::Graph one = bench.get(path).graph();
    for (const rdf::TermView& p : one.objects(rdf::iri(host + path), rdf::TermView(vocab::hybrit::property)))
      CHECK(all.contains(*all.find(rdf::iri(host + path)), *all.find(vocab::hybrit::property), *all.find(p)));
  }
  CHECK_FALSE(all.find(vocab::vom::numericalValue));
}

TEST_CASE("Things that look the same share a kind, whatever their bounds are", "[engine]") {
  Bench bench;
  add_joints(bench, 50);
  const std::string all = structure_of(bench);
  CHECK(count(all, R"("label":)") == 2);
  CHECK(count(all, R"("kind":"RevoluteJoint-)") == 50);
}

TEST_CASE("the structure document has pages of whole Things", "[engine][R0.9]") {
  engine::EngineOptions options;
  options.max_page_members = 1;  // 40 resources on a page
  Bench bench{options};
  add_joints(bench, 50);
  const Answer first = bench.ask("GET /ns/structure" + json_type);
  CHECK(count(first.body, R"("path":)") == 20);  // the cell, and 19 joints with a property each
  CHECK(contains(first.body, R"("next":{"href":"http://localhost/ns/structure?page=2&accept=application/json"})"));
  CHECK(contains(first.field("Link"), "<http://localhost/ns/structure?page=2>; rel=\"next\""));
  const std::string second = structure_of(bench, "?page=2"), last = structure_of(bench, "?page=3");
  CHECK(count(second, R"("path":)") == 20);
  CHECK(count(last, R"("path":)") == 11);
  CHECK(contains(second, R"("previous":{"href":)"));
  CHECK_FALSE(contains(last, R"("next":)"));
  for (const std::string& page : {second, last}) {
    CHECK(version_of(page) == version_of(first.body));
    CHECK(contains(page, R"("count":51,)"));
    CHECK(count(page, R"("label":)") == 1);
  }
  CHECK(bench.ask("GET /ns/structure?page=4" + json_type).status == 404);
  CHECK(bench.ask("GET /ns/structure?page=0" + json_type).status == 404);
  CHECK(bench.ask("GET /ns/structure?page=x" + json_type).status == 400);
  CHECK(bench.get("/ns/structure?page=3").graph().objects(rdf::iri(host + "/ns/structure"), rdf::TermView(vocab::dcterms::hasPart)).size() == 11);
}

TEST_CASE("a text finds Things and resources by names and titles", "[engine]") {
  Bench bench;
  Thing arm{"arm"};
  arm.title("Left Arm", "en").title("Linker Arm", "de");
  arm.property<double>("angle", unit::radian).publish(1);
  arm.property<double>("d\xC3\xA4mpfung").title("Damping", "en").publish(1);
  bench.add(std::move(arm));
  add_joints(bench, 3);
  const auto paths = [&](const std::string& query) { return count(structure_of(bench, query), R"("path":)"); };
  CHECK(paths("?q=joint2") == 1);
  CHECK(paths("?q=JOINT") == 3);
  CHECK(paths("?q=linker+arm") == 1);
  CHECK(paths("?q=angle") == 4);
  CHECK(paths("?q=joint1/ang") == 1);
  CHECK(paths("?q=%2Fcell") == 4);
  CHECK(paths("?q=d%C3%A4mpf") == 1);
  CHECK(paths("?q=damping") == 1);
  CHECK(paths("?q=nowhere") == 0);
  CHECK(paths("?q=") == 5);
  const std::string found = structure_of(bench, "?q=damping");
  CHECK_FALSE(contains(found, "\"angle\""));  // the other property of that Thing
  CHECK(contains(found, R"("href":"http://localhost/ns/structure?q=damping")"));
  for (int i = 0; i < 20; ++i) CHECK(paths("?q=none" + std::to_string(i)) == 0);
  CHECK(structure_of(bench, "?q=damping") == found);
  CHECK(bench.ask("GET /ns/structure?q=" + std::string(257, 'x') + json_type).status == 400);
  CHECK(bench.ask("HEAD /ns/structure?q=angle" + json_type).status == 200);
  CHECK(bench.ask("GET /arm?q=angle").status == 200);
}

TEST_CASE("titles are in the reader's language, and in all of them", "[engine]") {
  Bench bench;
  Thing arm{"arm"};
  arm.title("Left arm", "en").title("Linker Arm", "de");
  bench.add(std::move(arm));
  const Answer german = bench.ask("GET /ns/structure" + json_type + "\nAccept-Language: de-CH");
  CHECK(contains(german.body, R"("title":"Linker Arm","titles":{"en":"Left arm","de":"Linker Arm"})"));
  CHECK(contains(german.field("Vary"), "Accept-Language"));
  CHECK(contains(structure_of(bench), R"("title":"Left arm","titles":)"));
}

TEST_CASE("pages have the languages of the whole document", "[engine]") {
  engine::EngineOptions options;
  options.max_page_members = 1;
  Bench bench{options};
  add_joints(bench, 50);
  Thing last{"cell/zone"};
  last.title("Zone", "en").title("Bereich", "de");
  bench.add(std::move(last));
  CHECK(contains(structure_of(bench, "?page=3", "Accept-Language: de\n"), R"("title":"Bereich")"));
  CHECK(contains(structure_of(bench, "?page=3", "Accept-Language: en\n"), R"("title":"Zone")"));
  CHECK(contains(structure_of(bench, "?page=3", "Accept-Language: de\n"), R"("title":"Bereich")"));
}

TEST_CASE("what is hidden from a reader changes nothing in the structure document", "[engine][rights][R0.2]") {
  const security::Who chief{security::Who::Kind::principal, "chief"};
  Ruled ruled({{"/", security::Scope::tree, {}, Right::read},
               {"/veiled", security::Scope::tree, chief, Rights::all()},
               {"/arm/secret", security::Scope::tree, chief, Rights::all()},
               {"/arm/actions/secret", security::Scope::tree, chief, Rights::all()}});
  const auto add_arm = [&](bool with_secrets) {
    Thing arm{"arm"};
    arm.property<double>("angle", unit::radian).on_write([](double) {}).publish(1);
    if (with_secrets) {
      arm.property<double>("secret").title("Geheim", "de").title("Secret", "en").publish(1);
      arm.action("secret", [] {});
    }
    ruled.bench.add(std::move(arm));
  };
  const auto sees = [&](const std::string& who, const std::string& query = {}) {
    const Answer a = ruled.bench.ask("GET /ns/structure" + query + json_type + "\nWho: " + who);
    CHECK(a.status == 200);
    return a;
  };
  add_arm(false);
  ruled.bench.add(Thing{"zone"});
  const Answer before = sees("bert"), chiefs = sees("chief");
  CHECK(contains(before.body, "\"count\":2,"));
  CHECK_FALSE(contains(before.body, "writable"));
  CHECK(contains(before.field("Cache-Control"), "private"));

  ruled.bench.add(Thing{"veiled"});
  Thing below{"veiled/zone"};
  below.type(Iri("http://example.org/Veiled"));
  ruled.bench.add(std::move(below));
  ruled.bench.engine.remove("arm").value();
  ruled.bench.engine.remove("zone").value();
  add_arm(true);
  ruled.bench.add(Thing{"zone"});
  const Answer after = sees("bert");
  CHECK(after.body == before.body);
  CHECK(after.field("ETag") == before.field("ETag"));
  for (const char* text : {"secret", "veiled", "geheim"}) CHECK(contains(sees("bert", "?q=" + std::string(text)).body, R"("count":0,)"));
  const std::string all = sees("chief").body;
  CHECK(version_of(all) != version_of(chiefs.body));
  CHECK(contains(all, R"("secret":{)"));
  CHECK(contains(all, R"({"path":"/veiled/zone","kind":)"));
  CHECK(contains(all, R"("parent":"/veiled")"));
  CHECK(sees("bert").body == before.body);
}

TEST_CASE("a Thing below a hidden one is shown below the nearest that is not", "[engine][rights]") {
  const security::Who chief{security::Who::Kind::principal, "chief"};
  Ruled ruled({{"/", security::Scope::tree, {}, Right::read}, {"/a/b", security::Scope::here, chief, Right::read}});
  for (const char* path : {"a", "a/b", "a/b/c"}) ruled.bench.add(Thing{path});
  const std::string shown = ruled.bench.ask("GET /ns/structure" + json_type + "\nWho: bert").body;
  CHECK_FALSE(contains(shown, R"("/a/b")"));
  CHECK(contains(shown, R"({"path":"/a/b/c","kind":)"));
  CHECK(contains(shown, R"("parent":"/a"})"));
}

// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

/// Lines and bytes of Link fields as they go on the wire.
struct LinkSize {
  explicit LinkSize(const Answer& a) {
    for (const http::Field& f : a.fields.list()) {
      if (!http::iequals(f.name, "Link")) continue;
      const std::size_t line = f.name.size() + 2 + f.value.size() + 2;
      longest = std::max(longest, line);
      all += line;
    }
  }
  std::size_t longest = 0, all = 0;
};

}  // namespace

TEST_CASE("links of a thing with very many properties are cut at whole links, and say where the rest is", "[engine][R0.9]") {
  Bench bench;
  Thing thing{"arm"};
  for (int i = 0; i < 10'000; ++i) thing.property<double>("property_number_" + std::to_string(i));
  bench.add(std::move(thing));
  for (const char* method : {"GET", "HEAD", "OPTIONS"}) {
    CAPTURE(method);
    const Answer a = bench.ask(std::string(method) + " /arm");
    const LinkSize size(a);
    CHECK(size.longest <= 4096);
    CHECK(size.all <= 8192);
    CHECK(a.linked("related").size() > 50);
    for (const std::string& target : a.linked("related")) CHECK(bench.get(target.substr(16)).status == 200);
    REQUIRE(a.links().back().rel == "next");
    CHECK(a.links().back().target.find("http://localhost/arm?links=") == 0);
  }
  // "next" leads on to all the others, each once.
  std::multiset<std::string> found;
  for (std::string path = "/arm"; !path.empty();) {
    const Answer a = bench.ask("HEAD " + path);
    CHECK(LinkSize(a).all <= 8192);
    for (const std::string& target : a.linked("related")) found.insert(target);
    CHECK(a.links_to("http://www.w3.org/ns/ldp#Resource", "type"));
    const auto next = a.linked("next");
    REQUIRE(next.size() <= 1);
    path = next.empty() ? std::string() : next[0].substr(16);
  }
  CHECK(found.size() == 10'003);  // with state, Blueprint and subscriptions
  CHECK(std::set<std::string>(found.begin(), found.end()).size() == found.size());
  CHECK(bench.get("/arm?links=5").body == bench.get("/arm").body);
  CHECK(bench.get("/arm?links=5").tag() == bench.get("/arm").tag());
  CHECK(bench.get("/arm?links=99999").linked("related").empty());
  CHECK(bench.get("/arm?links=4294967296").linked("related").empty());  // 2 to the 32: more than a size_t of 32 bits
  CHECK(bench.get("/arm?links=x").status == 400);
  // The representation always lists all.
  CHECK(bench.get("/arm").graph().objects(rdf::iri("http://localhost/arm"), vocab::hybrit::property).size() == 10'000);
}

TEST_CASE("the budget of links is an option", "[engine][R0.9]") {
  engine::EngineOptions options;
  options.max_link_bytes = 1024;
  Bench bench(options);
  Thing thing{"arm"};
  for (int i = 0; i < 100; ++i) thing.property<double>("property_number_" + std::to_string(i));
  bench.add(std::move(thing));
  CHECK(LinkSize(bench.get("/arm")).all <= 1024);
}

TEST_CASE("a container of more than 500 members comes in pages that a client can walk by links", "[engine][R0.4][R0.9]") {
  Bench bench;
  constexpr std::size_t count = 1201;
  for (std::size_t i = 0; i < count; ++i) bench.add(Thing{"thing" + std::to_string(i)});
  std::set<std::string> found, tags;
  std::string path = "/";
  std::size_t pages = 0;
  while (!path.empty()) {
    CAPTURE(path);
    const Answer a = bench.get(path);
    REQUIRE(a.status == 200);
    ++pages;
    tags.insert(a.tag());
    const LinkSize size(a);
    CHECK(size.longest <= 4096);
    CHECK(size.all <= 8192);
    const rdf::Graph graph = a.graph();
    const auto members = graph.objects(rdf::iri("http://localhost/"), vocab::ldp::contains);
    CHECK(members.size() <= 500);
    for (const rdf::TermView& m : members) CHECK(found.insert(std::string(m.text)).second);
    CHECK(a.linked("first") == std::vector<std::string>{"http://localhost/?page=1"});
    CHECK(a.linked("last") == std::vector<std::string>{"http://localhost/?page=3"});
    CHECK(a.linked("prev").size() == (pages == 1 ? 0 : 1));
    const auto next = a.linked("next");
    // Another "next" names the links of this page that were left out.
    path.clear();
    for (const std::string& n : next)
      if (n.find("links=") == std::string::npos) path = n.substr(16);
      else CHECK(n.find(pages == 1 ? "http://localhost/?links=" : "http://localhost/?page=" + std::to_string(pages) + "&links=") == 0);
  }
  CHECK(pages == 3);
  CHECK(found.size() == count);
  CHECK(tags.size() == 3);
  CHECK(bench.get("/?page=4").status == 404);
  CHECK(bench.get("/?page=0").status == 404);
  CHECK(bench.get("/?page=x").status == 400);
  CHECK(bench.get("/?page=-1").status == 400);
  CHECK(bench.get("/?page=99999999999999999999").status == 400);
  CHECK(bench.get("/?other=1&page=3").body == bench.get("/?page=3").body);
}

TEST_CASE("up to 500 members there is one page", "[engine][R0.9]") {
  Bench bench;
  for (std::size_t i = 0; i < 500; ++i) bench.add(Thing{"thing" + std::to_string(i)});
  const Answer a = bench.get("/");
  for (const std::string& next : a.linked("next")) CHECK(next.find("page=") == std::string::npos);
  CHECK(a.graph().objects(rdf::iri("http://localhost/"), vocab::ldp::contains).size() == 500);
}

TEST_CASE("a thing with very many parts keeps its links to the budget and lists all parts", "[engine][R0.9]") {
  Bench bench;
  bench.add(Thing{"robot"});
  for (int i = 0; i < 10'000; ++i) bench.add(Thing{"robot/part_number_" + std::to_string(i)});
  const Answer a = bench.get("/robot");
  const LinkSize size(a);
  CHECK(size.longest <= 4096);
  CHECK(size.all <= 8192);
  CHECK(a.links().back().rel == "next");
  CHECK(a.graph().objects(rdf::iri("http://localhost/robot"), vocab::dcterms::hasPart).size() == 10'000);
  CHECK(bench.get("/").linked("related") == std::vector<std::string>{"http://localhost/robot", "http://localhost/all"});
}

TEST_CASE("links lead from the root to every resource and back up", "[engine][R0.9]") {
  Bench bench;
  Thing arm{"robot/arm"};
  arm.property("a", [] { return 1; });
  arm.action("go", [] {});
  arm.collection<int>("c").on_create([](int) {});
  Thing robot{"robot"};
  robot.property<int>("deep/b");
  bench.add(std::move(arm));
  bench.add(std::move(robot));  // registered after its part
  REQUIRE(bench.turtle("POST", "/robot/arm/c", "<> vom:numericalValue 5 .").status == 201);
  REQUIRE(bench.ask("POST /robot/arm/actions/go").status == 204);

  std::set<std::string> seen = {"http://localhost/"};
  std::vector<std::string> open = {"http://localhost/"};
  while (!open.empty()) {
    const std::string at = open.back();
    open.pop_back();
    const Answer a = bench.get(at.substr(16));
    CAPTURE(at);
    CHECK(a.status == 200);
    for (const std::string& target : a.linked("related"))
      if (seen.insert(target).second) open.push_back(target);
  }
  std::set<std::string> expected;
  for (const char* path :
       {"", "all", "robot", "robot/all", "robot/state", "robot/subscriptions", "robot/deep/b", "robot/arm", "robot/arm/state",
        "robot/arm/subscriptions", "robot/arm/a", "robot/arm/actions/go", "robot/arm/actions/go/i2", "robot/arm/c", "robot/arm/c/i1"})
    expected.insert(std::string("http://localhost/") + path);
  for (const char* thing : {"/robot", "/robot/arm"}) expected.insert("http://localhost" + kind_of(bench, thing));
  CHECK(seen == expected);

  for (const std::string& target : seen) {
    CAPTURE(target);
    std::string at = target;
    for (int steps = 0; at != "http://localhost/" && steps < 10; ++steps) at = bench.get(at.substr(16)).linked("up").at(0);
    CHECK(at == "http://localhost/");
  }
}

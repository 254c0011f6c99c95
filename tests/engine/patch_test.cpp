// SPDX-License-Identifier: Apache-2.0
#include "src/engine/value_patch.hpp"

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/thing.hpp>

#include "src/security/policy.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

struct Range {
  double low = 100, high = 200;
};
struct Settings {
  double gain = 7, limit = 8;
  int count = 9;
  std::string name = "initialiser";
  std::optional<double> offset;
  std::vector<int> steps = {1, 2};
  Range range;
  std::map<std::string, double> extra;
};

}  // namespace

template <>
struct lrt::rdf::traits<Range> : lrt::rdf::Record<Range> {
  static void describe(Record<Range>& r) {
    r.field("low", &Range::low).value_if_absent(-1);
    r.field("high", &Range::high);
  }
};
template <>
struct lrt::rdf::traits<Settings> : lrt::rdf::Record<Settings> {
  static void describe(Record<Settings>& r) {
    Facets& gain = r.field("gain", &Settings::gain).unit(unit::metre).between(0, 10).value_if_absent(1.5);
    r.field("limit", &Settings::limit);
    r.field("count", &Settings::count).value_if_absent(3);
    r.field("name", &Settings::name).value_if_absent("none");
    r.field("offset", &Settings::offset);
    r.field("steps", &Settings::steps).value_if_absent({4, 5});
    r.field("range", &Settings::range);
    r.field("extra", &Settings::extra).value_if_absent({});
    gain.at_most(9);  // it is still the facets of that field
  }
};

namespace {

struct Robot {
  explicit Robot(bool pushed = false, engine::EngineOptions options = {}) : bench(std::move(options)) {
    Thing arm("arm");
    settings.limit = 2;
    settings.range = {0, 1};
    settings.gain = 1;
    settings.count = 1;
    settings.name = "a";
    if (pushed) {
      slot = arm.property<Settings>("settings").on_write([this](Settings s) { ++writes, settings = std::move(s); });
      slot.publish(settings);
    } else {
      arm.property("settings", [this] { return ++reads, settings; }).on_write([this](Settings s) { ++writes, settings = std::move(s); });
    }
    arm.property("shown", [this] { return settings; });
    arm.property("number", [this] { return settings.gain; }).on_write([](double) {});
    bench.add(std::move(arm));
    reads = writes = 0;
  }
  Answer merge(const std::string& body, const std::string& fields = {}) {
    return bench.ask("PATCH /arm/settings\nContent-Type: application/merge-patch+json\n" + fields + "\n" + body);
  }
  Answer update(const std::string& body) {
    return bench.ask(
        "PATCH /arm/settings\nContent-Type: application/sparql-update\n\nPREFIX s: <http://localhost/ns/vocabulary#Settings/> "
        "PREFIX vom: <http://vocab.arvida.de/2015/06/vom/vocab#> " +
        body);
  }
  Settings settings;
  PushedProperty<Settings> slot;
  int reads = 0, writes = 0;
  Bench bench;
};

}  // namespace

TEST_CASE("a field that is left out has its declared default, and never that of a C++ initialiser", "[engine][R0.5]") {
  Robot r;
  const Answer put = r.bench.ask("PUT /arm/settings\nContent-Type: application/json\n\n{\"limit\":4,\"range\":{\"high\":5}}");
  CAPTURE(put.body);
  REQUIRE(put.status == 204);
  CHECK(r.settings.gain == 1.5);
  CHECK(r.settings.limit == 4);
  CHECK(r.settings.count == 3);
  CHECK(r.settings.name == "none");
  CHECK_FALSE(r.settings.offset);
  CHECK(r.settings.steps == std::vector<int>{4, 5});
  CHECK(r.settings.range.low == -1);
  CHECK(r.settings.range.high == 5);
  CHECK(r.settings.extra.empty());
  r.settings = {};
  const Answer turtle = r.bench.turtle("PUT", "/arm/settings",
                                       "@prefix s: <http://localhost/ns/vocabulary#Settings/> . @prefix r: <http://localhost/ns/vocabulary#Range/> . "
                                       "<> s:limit 4.5 ; s:range [ r:high 5.0 ] .");
  CAPTURE(turtle.body);
  CHECK(turtle.status == 204);
  CHECK(r.settings.limit == 4.5);
  CHECK(r.settings.gain == 1.5);
  const Answer missing = r.bench.ask("PUT /arm/settings\nContent-Type: application/json\n\n{\"range\":{\"high\":5}}");
  CHECK(missing.status == 422);
  CHECK(missing.says("#/limit"));
  // The bound that was set after the next field() holds.
  CHECK(r.merge("{\"gain\":9.5}").status == 422);
}

TEST_CASE("defaults are stated in the shape of what clients send and in the JSON Schema, and not of what only the robot writes", "[engine][R1.6]") {
  Robot r;
  const Answer blueprint = r.bench.get(kind_of(r.bench, "/arm"));
  CAPTURE(blueprint.body);
  CHECK(blueprint.says("sh:defaultValue"));
  rdf::Graph graph = blueprint.graph();
  std::size_t stated = 0, zero = 0;
  const auto predicate = graph.find(rdf::iri("http://www.w3.org/ns/shacl#defaultValue"));
  const auto min_count = graph.find(rdf::iri("http://www.w3.org/ns/shacl#minCount"));
  REQUIRE(predicate);
  for (const rdf::Triple& t : graph.match(std::nullopt, *predicate, std::nullopt)) {
    ++stated;
    for (const rdf::Triple& count : graph.match(t.subject, *min_count, std::nullopt)) zero += graph.term(count.object).text == "0";
  }
  CHECK(stated == 6);  // of "settings", not of "shown"
  CHECK(zero == 6);
  const Answer overview = r.bench.ask("GET /arm\nAccept: application/json");
  CHECK(overview.says("\"default\":1.5"));
  CHECK(overview.says("\"default\":[4,5]"));
}

TEST_CASE("PATCH by JSON merges with the value that the host has now, in one read and one write", "[engine][R0.5]") {
  Robot r;
  const Answer a = r.merge("{\"limit\":3,\"range\":{\"high\":6},\"extra\":{\"x\":1},\"offset\":0.5}");
  CAPTURE(a.body);
  REQUIRE(a.status == 204);
  CHECK(r.reads == 1);
  CHECK(r.writes == 1);
  CHECK(r.settings.limit == 3);
  CHECK(r.settings.gain == 1);
  CHECK(r.settings.range.low == 0);
  CHECK(r.settings.range.high == 6);
  CHECK(r.settings.extra.at("x") == 1);
  CHECK(r.settings.offset == 0.5);
  // null: an optional is cleared, a default restored, a member of a map removed, the rest refused.
  CHECK(r.merge("{\"offset\":null,\"gain\":null,\"extra\":{\"x\":null,\"y\":2,\"z\":null}}").status == 204);
  CHECK_FALSE(r.settings.offset);
  CHECK(r.settings.gain == 1.5);
  CHECK(r.settings.extra == std::map<std::string, double>{{"y", 2}});
  const Answer refused = r.merge("{\"limit\":null,\"count\":5}");
  CHECK(refused.status == 422);
  CHECK(refused.says("#/limit"));
  CHECK(r.settings.count == 1);
  const Answer inner = r.merge("{\"range\":{\"high\":null}}");
  CHECK(inner.status == 422);
  CHECK(inner.says("#/range/high"));
  CHECK(r.merge("{\"range\":{\"low\":null}}").status == 204);
  CHECK(r.settings.range.low == -1);
  // An array is whole.
  CHECK(r.merge("{\"steps\":[9]}").status == 204);
  CHECK(r.settings.steps == std::vector<int>{9});
  CHECK(r.merge("{}").status == 204);
  CHECK(r.merge("{\"gain\":{\"value\":2,\"unit\":\"m\"}}").status == 204);
  CHECK(r.settings.gain == 2);
  const int writes = r.writes;
  for (const char* bad : {"{\"gain\":{\"value\":2,\"unit\":\"cm\"}}", "{\"gain\":11}", "{\"nosuch\":1}", "{\"nosuch\":null}", "{\"count\":\"x\"}",
                          "null", "5", "[]", "{\"range\":5}", "{\"range\":null}", "{\"range\":{\"nosuch\":null}}"}) {
    CAPTURE(bad);
    CHECK(r.merge(bad).status == 422);
  }
  for (const char* bad : {"", "{", "{\"gain\":1,\"gain\":2}", "{} {}"}) {
    CAPTURE(bad);
    CHECK(r.merge(bad).status == 400);
  }
  CHECK(r.writes == writes);
}

TEST_CASE("PATCH keeps what JSON cannot carry of the other fields", "[engine][R0.5]") {
  Robot r;
  r.settings.name = "bad \xFF";
  CHECK(r.merge("{\"limit\":0.1}").status == 204);
  CHECK(r.settings.name == "bad \xFF");
}

TEST_CASE("PATCH by SPARQL adds and removes ground triples of the value", "[engine][R0.5]") {
  Robot r;
  const std::string double_ = "^^<http://www.w3.org/2001/XMLSchema#double>";
  const Answer a = r.update("DELETE DATA { <> s:limit \"2\"" + double_ + " } ; INSERT DATA { <> s:limit 3.5 ; s:offset 1 }");
  CAPTURE(a.body, r.bench.get("/arm/settings").body);
  REQUIRE(a.status == 204);
  CHECK(r.reads >= 1);
  CHECK(r.settings.limit == 3.5);
  CHECK(r.settings.offset == 1);
  CHECK(r.settings.name == "a");
  // The node of a number with a unit has a name.
  const Answer unit = r.update("DELETE DATA { <#gain> vom:numericalValue \"1\"" + double_ + " } ; INSERT DATA { <#gain> vom:numericalValue 2 }");
  CAPTURE(unit.body);
  CHECK(unit.status == 204);
  CHECK(r.settings.gain == 2);
  CHECK(r.update("DELETE DATA { <> s:name \"a\" }").status == 204);
  CHECK(r.settings.name == "none");
  const Answer two = r.update("INSERT DATA { <> s:limit 4 }");
  CHECK(two.status == 422);
  CHECK(two.says("Settings/limit"));
  CHECK(r.update("DELETE WHERE { ?s ?p ?o }").status == 422);
  CHECK(r.update("INSERT DATA { ").status == 400);
  CHECK(r.settings.limit == 3.5);
}

TEST_CASE("Allow, Accept-Patch and 415 say how a Property is patched, and a number is not", "[engine][R0.10]") {
  Robot r;
  const std::string types = "application/merge-patch+json, application/sparql-update";
  for (const char* method : {"OPTIONS", "GET"}) {
    const Answer a = r.bench.ask(std::string(method) + " /arm/settings");
    CHECK(a.members("Allow").count("PATCH") == 1);
    CHECK(a.field("Accept-Patch") == types);
  }
  for (const char* path : {"/arm/shown", "/arm/number", "/arm"}) {
    CAPTURE(path);
    const Answer a = r.bench.ask(std::string("OPTIONS ") + path);
    CHECK(a.members("Allow").count("PATCH") == 0);
    CHECK_FALSE(a.has("Accept-Patch"));
    CHECK(r.bench.ask(std::string("PATCH ") + path + "\nContent-Type: application/merge-patch+json\n\n{}").status == 405);
  }
  for (const char* type : {"Content-Type: application/json\n", "Content-Type: text/turtle\n", ""}) {
    const Answer a = r.bench.ask(std::string("PATCH /arm/settings\n") + type + "\n{}");
    CHECK(a.status == 415);
    CHECK(a.field("Accept-Patch") == types);
  }
}

TEST_CASE("a PATCH is judged by its preconditions as a PUT is", "[engine][R0.11]") {
  Robot r;
  const std::string tag = r.bench.get("/arm/settings").tag();
  CHECK(r.merge("{\"limit\":4}", "If-Match: \"x\"\n").status == 412);
  CHECK(r.merge("{\"limit\":4}", "If-None-Match: *\n").status == 412);
  CHECK(r.settings.limit == 2);
  CHECK(r.merge("{\"limit\":4}", "If-Match: " + tag + "\n").status == 204);
  CHECK(r.merge("{\"limit\":5}", "If-Match: " + tag + "\n").status == 412);
  const Answer shown = r.merge("{\"limit\":6}", "Prefer: return=representation\nAccept: application/json\n");
  CHECK(shown.status == 200);
  CHECK(shown.says("\"limit\":6"));
}

TEST_CASE("two clients that patch different fields both win, of a pulled and of a pushed Property", "[engine][R0.5]") {
  for (const bool pushed : {false, true}) {
    CAPTURE(pushed);
    Robot r(pushed);
    const std::string head = "PATCH /arm/settings\nContent-Type: application/merge-patch+json\n\n";
    const auto a = r.bench.send(head + "{\"limit\":5}"), b = r.bench.send(head + "{\"count\":8}");
    const auto put = r.bench.send("GET /arm/settings");
    r.bench.run();
    CHECK(r.bench.answer(a)->status == 204);
    CHECK(r.bench.answer(b)->status == 204);
    CHECK(r.bench.answer(put)->status == 200);
    CHECK(r.settings.limit == 5);
    CHECK(r.settings.count == 8);
    CHECK(r.settings.gain == 1);
    // What the robot publishes while a PATCH waits is not overwritten.
    const auto c = r.bench.send(head + "{\"limit\":6}");
    r.settings.count = 11;
    if (pushed) r.slot.publish(r.settings);
    r.bench.run();
    CHECK(r.bench.answer(c)->status == 204);
    CHECK(r.settings.limit == 6);
    CHECK(r.settings.count == 11);
  }
}

TEST_CASE("a read lambda does not run while a PATCH reads, and readers that wait get the new value", "[engine][judged_at_once]") {
  Robot r;
  const auto first = r.bench.send("GET /arm/settings\nAccept: application/json");
  const auto patch = r.bench.send("PATCH /arm/settings\nContent-Type: application/merge-patch+json\n\n{\"limit\":5}");
  auto jobs = r.bench.take_jobs();
  CHECK(jobs.size() == 1);  // the read of the first; the patch waits for its end
  for (engine::Job& job : jobs) job.run();
  r.bench.collect();
  const auto second = r.bench.send("GET /arm/settings\nAccept: application/json");
  jobs = r.bench.take_jobs();
  CHECK(jobs.size() == 1);  // the patch
  for (engine::Job& job : jobs) job.run();
  r.bench.run();
  CHECK(r.bench.answer(patch)->status == 204);
  CHECK(r.bench.answer(first)->says("\"limit\":2"));
  CHECK(r.bench.answer(second)->says("\"limit\":5"));
  CHECK(r.bench.get("/arm/settings").status == 200);
}

TEST_CASE("a PATCH whose time has passed ends, and the next read and write go on", "[engine]") {
  Robot r;
  const auto blocked = r.bench.send("GET /arm/settings");
  const auto patch = r.bench.send("PATCH /arm/settings\nContent-Type: application/merge-patch+json\n\n{\"limit\":5}");
  r.bench.clock.advance(std::chrono::seconds(60));
  r.bench.collect();
  CHECK(r.bench.answer(patch)->status == 503);
  r.bench.run();
  CHECK(r.settings.limit == 2);
  CHECK(r.bench.get("/arm/settings").status == 200);
  CHECK(r.merge("{\"limit\":7}").status == 204);
  CHECK(r.settings.limit == 7);
  (void)blocked;
}

TEST_CASE("a client that may write and not read has no PATCH, because a refusal would show the value", "[engine]") {
  Robot r;
  const auto ask = [&](const std::string& method, security::Rights rights) {
    engine::Caller caller;
    caller.view = std::make_shared<const security::View>(rights);
    RequestText request(method + " /arm/settings\nContent-Type: application/merge-patch+json\n\n{\"limit\":null}");
    const auto sent = r.bench.sent(r.bench.engine.handle(request.get(), caller, r.bench.clock.now()));
    r.bench.run();
    return *r.bench.answer(sent);
  };
  const Answer refused = ask("PATCH", security::Right::write);
  CHECK(refused.status == 405);
  CHECK(refused.members("Allow").count("PATCH") == 0);
  CHECK(refused.members("Allow").count("PUT") == 1);
  CHECK(ask("PATCH", security::Right::write | security::Right::read).status == 422);
  CHECK(ask("PATCH", security::Right::read).status == 401);  // nobody has logged in
  CHECK(ask("OPTIONS", security::Right::read).members("Allow").count("PATCH") == 0);
  CHECK(r.writes == 0);
}

TEST_CASE("a pushed Property that has no value yet cannot be patched", "[engine]") {
  Bench bench;
  Thing arm("arm");
  arm.property<Range>("range").on_write([](Range) {});
  bench.add(std::move(arm));
  const std::string head = "PATCH /arm/range\nContent-Type: application/merge-patch+json\n\n";
  CHECK(bench.ask(head + "{\"high\":5}").status == 409);
  CHECK(bench.ask("PUT /arm/range\nContent-Type: application/json\n\n{\"high\":5}").status == 204);
  CHECK(bench.ask(head + "{\"high\":6}").status == 204);
  CHECK(bench.ask("GET /arm/range\nAccept: application/json").body == "{\"low\":-1,\"high\":6}");
}

namespace {
struct OutOfBounds {
  double x = 0;
};
struct Narrow {
  std::uint8_t x = 0;
};
struct Constant {
  const double x = 0;
};
}  // namespace
template <>
struct lrt::rdf::traits<OutOfBounds> : lrt::rdf::Record<OutOfBounds> {
  static void describe(Record<OutOfBounds>& r) { r.field("x", &OutOfBounds::x).value_if_absent(11).between(0, 10); }
};
template <>
struct lrt::rdf::traits<Narrow> : lrt::rdf::Record<Narrow> {
  static void describe(Record<Narrow>& r) { r.field("x", &Narrow::x).value_if_absent(256); }
};
template <>
struct lrt::rdf::traits<Constant> : lrt::rdf::Record<Constant> {
  static void describe(Record<Constant>& r) { r.field("x", &Constant::x).value_if_absent(1); }
};

TEST_CASE("add() refuses a default that is no value of its field", "[engine]") {
  const auto refused = [](auto value) {
    Bench bench;
    Thing arm("arm");
    arm.property("p", [value] { return value; });
    const Result<void> added = bench.engine.add(std::move(arm));
    return added ? std::string() : added.error().message;
  };
  CHECK(refused(OutOfBounds()).find("outside of the bounds") != std::string::npos);
  CHECK(refused(Narrow()).find("cannot hold") != std::string::npos);
  CHECK(refused(Constant()).find("read-only") != std::string::npos);
}

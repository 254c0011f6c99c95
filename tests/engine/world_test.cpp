// SPDX-License-Identifier: Apache-2.0
#include <lrt/world.hpp>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "src/engine/parts.hpp"
#include "src/engine/resources/world.hpp"
#include "src/security/policy.hpp"
#include "tests/support/allocation_counters.hpp"  // counted by subscription_test.cpp
#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/event_stream.hpp"
#include "tests/support/graphs.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

constexpr Iri label = vocab::rdfs::label;
constexpr Iri pose{"https://example.org/pose"};
const std::string a_cup = "<#cup> rdfs:label \"a cup\" .";

WorldOptions creation(std::size_t max = 3) {
  WorldOptions options;
  options.clients_may_create = true;
  options.max_created = max;
  return options;
}

GraphOptions writable() {
  GraphOptions options;
  options.clients_may_write = true;
  return options;
}

/// A World with a graph that clients may write, and one that they may not.
struct Robot {
  explicit Robot(GraphOptions options = writable(), WorldOptions world_options = {}, engine::EngineOptions engine_options = {})
      : bench(std::move(engine_options)) {
    World world("world", std::move(world_options));
    map = world.graph("map", std::move(options));
    tasks = world.graph("tasks");
    bench.add(std::move(world));
  }
  Answer put(const std::string& body, const std::string& fields = {}) { return bench.turtle("PUT", "/world/map", body, fields); }
  Answer patch(const std::string& body, const std::string& fields = {}) {
    return bench.ask("PATCH /world/map\nContent-Type: application/sparql-update\n" + fields + "\n" + body);
  }
  void say(const std::string& text) {
    map.update([&](GraphUpdate& u) { u.add("#cup", label, text); }).value();
  }
  Answer get(const std::string& fields = {}) { return bench.ask("GET /world/map\n" + fields); }
  /// Adds that many triples.
  void fill(int triples) {
    map.update([&](GraphUpdate& u) {
         for (int i = 0; i < triples; ++i) u.add("#" + std::to_string(i), label, i);
       })
        .value();
  }

  WorldGraph map, tasks;
  Bench bench;
};

std::string shapes() {
  return "@prefix sh: <http://www.w3.org/ns/shacl#> . @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> . @prefix ex: <https://example.org/> ."
         "<#cup> a sh:NodeShape ; sh:targetClass ex:Cup ; sh:property [ sh:path rdfs:label ; sh:minCount 1 ] .";
}

}  // namespace

TEST_CASE("a graph of a World is read in every syntax, with an ETag", "[engine][json_ld][world]") {
  Robot r;
  r.say("a cup");
  const Answer a = r.get();
  CHECK(a.status == 200);
  CHECK(missing(a, "<world/map#cup> rdfs:label \"a cup\" .") == "");
  CHECK(r.get("If-None-Match: " + a.tag() + "\n").status == 304);
  for (const char* type : {"text/turtle", "application/n-triples", "application/ld+json", "application/trig", "application/n-quads"}) {
    CAPTURE(type);
    const Answer b = r.get("Accept: " + std::string(type) + "\n");
    CHECK(b.field("Content-Type") == type);
    CHECK(b.body.find("a cup") != std::string::npos);
  }
  CHECK(r.bench.ask("HEAD /world/map").status == 200);
  CHECK(a.field("Allow") == "GET, HEAD, OPTIONS, PUT, POST, DELETE, PATCH");
  CHECK(a.field("Accept-Patch") == "application/sparql-update");
  CHECK(r.bench.get("/world/tasks").field("Allow") == "GET, HEAD, OPTIONS");
  r.say("another");
  CHECK(r.get("If-None-Match: " + a.tag() + "\n").status == 200);
}

TEST_CASE("a World lists its graphs, and is listed itself", "[engine][world]") {
  Robot r;
  const Answer a = r.bench.get("/world");
  CHECK(missing(a,
                "<world> a lrt:World, ldp:BasicContainer ; ldp:contains <world/map>, <world/tasks> ; lrt:allGraphs <world?default> . "
                "<world/map> a lrt:WorldGraph ; dcterms:title \"map\" .") == "");
  CHECK(a.links_to("http://www.w3.org/ns/ldp#BasicContainer", "type"));
  CHECK(missing(r.bench.get("/"), "<> ldp:contains <world> .") == "");
}

TEST_CASE("the JSON of a World has the present number of triples of each graph", "[engine][world]") {
  Robot r;
  const auto get = [&](const std::string& fields = {}) { return r.bench.ask("GET /world\nAccept: application/json\n" + fields); };
  const Answer before = get();
  CHECK(before.says("\"triples\":0"));
  const engine::Channel json = r.bench.open("/world?accept=application/json"), turtle = r.bench.open("/world");
  CHECK(turtle != json);
  CHECK(r.bench.pushes().size() == 2);
  r.say("a cup");
  r.bench.look();
  const auto told = r.bench.pushes();
  REQUIRE(told.size() == 1);  // Turtle does not have the number
  CHECK(told[0].first == json);
  CHECK(told[0].second.message->find("\"triples\":1") != std::string::npos);
  const Answer after = get("If-None-Match: " + before.tag() + "\n");
  CHECK(after.status == 200);
  CHECK(after.says("\"triples\":1"));
}

TEST_CASE("all graphs are one at ?default", "[engine][world]") {
  Robot r;
  r.say("a cup");
  r.tasks.update([](GraphUpdate& u) { u.add("#1", label, "clean up"); }).value();
  CHECK(missing(r.bench.get("/world?default"), "<world/map#cup> rdfs:label \"a cup\" . <world/tasks#1> rdfs:label \"clean up\" .") == "");
  CHECK(r.bench.turtle("PUT", "/world?default", a_cup).status == 405);
}

TEST_CASE("all graphs that are too large for one document are refused before they are described", "[engine][world][limits]") {
  engine::EngineOptions options;
  options.max_all_bytes = 20'000;
  Robot r(writable(), {}, options);
  r.fill(100);
  CHECK(r.bench.get("/world?default").status == 200);
  r.fill(1000);
  const auto cost = [&](const std::string& fields) {
    const std::size_t before = allocated_bytes;
    const Answer a = r.bench.ask("GET /world?default\n" + fields);
    CHECK(a.status == 406);
    CHECK(a.says("20000 bytes"));
    return allocated_bytes - before;
  };
  for (const char* accept : {"", "Accept: */*\n", "Accept: application/n-quads\n", "Accept: text/turtle, text/html;q=0.5\n"}) {
    CAPTURE(accept);
    CHECK(cost(accept) < 50'000);  // the description has 1,000 triples
  }
  CHECK(r.bench.ask("GET /world?default\nAccept: text/html\n").field("Content-Type").find("text/html") == 0);
  CHECK(r.bench.get("/world/map").status == 200);
}

TEST_CASE("an update takes effect as a whole or not at all", "[engine][world]") {
  Robot r;
  r.say("a cup");
  const auto before = r.map.snapshot();
  CHECK(r.map.update([](GraphUpdate& u) { u.clear().add("no iri", label, "x"); }).error().code == Errc::expected_iri);
  CHECK(r.map.update([](GraphUpdate& u) { u.clear().add_turtle("<a"); }).error().code == Errc::expected_rdf);
  CHECK(r.map
            .update([](GraphUpdate& u) {
              u.clear();
              throw std::runtime_error("no camera");
            })
            .error()
            .code == Errc::failed);
  CHECK(r.map.snapshot() == before);
  CHECK_FALSE(r.map.update([](GraphUpdate& u) { u.set("#cup", label, "x").add_turtle("<#plate> rdfs:label \"x\" ."); }));  // no such prefix
  CHECK(r.map.snapshot() == before);
  r.map.update([](GraphUpdate& u) { u.set("#cup", label, "a red cup").add("#cup", pose, 7); }).value();
  CHECK(r.map.snapshot()->size() == 2);
  CHECK(before->size() == 1);
  r.map
      .update([](GraphUpdate& u) {
        u.remove("#cup", pose, 7);
        CHECK(u.size() == 1);
        CHECK(u.graph().size() == 1);
      })
      .value();
  CHECK(r.map.revision() == 4);
  r.map.update([](GraphUpdate& u) { u.add("#cup", label, "x").remove("#cup", label, "x"); }).value();
  CHECK(r.map.revision() == 4);  // nothing has changed
  r.map.update([](GraphUpdate& u) { u.add_turtle("<#cup> <p:at> [ <p:x> 1 ; <p:in> [ <p:y> 2 ] ] . <#table> <p:has> <#cup> ."); }).value();
  r.map
      .update([](GraphUpdate& u) {
        u.remove_node("#cup");
        CHECK(u.size() == 0);
      })
      .value();
  CHECK(r.map.update([&](GraphUpdate&) { r.map.update([](GraphUpdate&) {}).value(); }).error().code == Errc::refused);
}

TEST_CASE("clients replace, add, remove and patch", "[engine][world]") {
  Robot r;
  CHECK(r.put(a_cup).status == 204);
  CHECK(missing(r.get(), "<world/map#cup> rdfs:label \"a cup\" .") == "");
  CHECK(r.map.snapshot()->contains(rdf::iri("http://lrt.invalid/world/map#cup"), label, rdf::literal("a cup")));
  CHECK(r.bench.turtle("POST", "/world/map", "<#plate> rdfs:label \"a plate\" .").status == 204);
  CHECK(r.map.snapshot()->size() == 2);
  CHECK(r.patch("PREFIX rdfs: <http://www.w3.org/2000/01/rdf-schema#>\nDELETE DATA { <#cup> rdfs:label \"a cup\" } ;\n"
                "INSERT DATA { <#cup> rdfs:label \"a red cup\" . <http://localhost/arm> rdfs:label 'arm' }")
            .status == 204);
  CHECK(missing(r.get(), "<world/map#cup> rdfs:label \"a red cup\" . <arm> rdfs:label \"arm\" .") == "");
  CHECK(r.map.snapshot()->size() == 3);
  CHECK(r.bench.ask("DELETE /world/map").status == 204);
  CHECK(r.get().status == 200);
  CHECK(r.map.snapshot()->empty());
  CHECK(r.bench.turtle("PUT", "/world/tasks", a_cup).status == 405);
  CHECK(r.bench.ask("PATCH /world/tasks\nContent-Type: application/sparql-update\n\nINSERT DATA {}").status == 405);
  CHECK(r.bench.ask("PUT /world/map\nContent-Type: text/plain\n\nx").status == 415);
  const Answer a = r.bench.ask("PATCH /world/map\nContent-Type: text/turtle\n\n<a> <b> <c> .");
  CHECK(a.status == 415);
  CHECK(a.field("Accept-Patch") == "application/sparql-update");
}

TEST_CASE("what a PATCH does not take is refused with its place, and changes nothing", "[engine][world]") {
  Robot r;
  r.say("a cup");
  const auto before = r.map.snapshot();
  const auto refused = [&](const std::string& body, int status, const std::string& text) {
    CAPTURE(body);
    const Answer a = r.patch(body);
    CHECK(a.status == status);
    CHECK(a.body.find(text) != std::string::npos);
    if (a.body.find(text) == std::string::npos) UNSCOPED_INFO(a.body);
    CHECK(r.map.snapshot() == before);
  };
  refused("LOAD <http://example.org/>", 422, "line 1, column 1: LOAD is not supported");
  refused("CLEAR ALL", 422, "CLEAR");
  refused("INSERT DATA {} ;\n DELETE WHERE { ?s ?p ?o }", 422, "line 2, column 9: DELETE WHERE");
  refused("DELETE { ?s ?p ?o } WHERE {}", 422, "DELETE with a pattern");
  refused("INSERT DATA { GRAPH <http://example.org/> { <a:b> <c:d> 1 } }", 422, "GRAPH");
  refused("INSERT DATA { <#a> <p:b> ?x }", 400, "variable");
  refused("INSERT DATA { <#a> <p:b> 1 ", 400, "expected '}'");
  refused("INSERT DATA { <#a> <p:b> 'x }", 400, "end of a string");
  refused("INSERT DATA { <#a> <p:b> <c }", 400, "end of an IRI");
  refused("INSERT DATA { <#a> x:b 1 }", 400, "line 1, column 20");
  refused("INSERT DATA { @prefix x: <x:> . <#a> x:b 1 }", 400, "directive");
  refused("INSERT DATA { PREFIX x: <x:> <#a> x:b 1 }", 400, "PREFIX");
  refused("DELETE DATA { _:a <p:b> 1 }", 400, "blank");
  refused("INSERT DATA {} INSERT DATA {}", 400, "';'");
  refused("", 400, "expected INSERT DATA");
  refused("INSERT DATA { <#a> <p:b> 1 } ; INSERT DATA { <#a> <p:b> }", 400, "");
  std::string many;
  for (int i = 0; i < 101; ++i) many += "INSERT DATA {};";
  refused(many, 413, "100 operations");
}

TEST_CASE("a PATCH takes what SPARQL writes otherwise than Turtle", "[engine][world]") {
  Robot r;
  CHECK(r.patch("# a comment }\nBASE <http://example.org/>\nPREFIX : <#>\ninsert data { # and }\n <a> :b 'x}', \"\"\"y\"}\"\"\", <c#d> . :e :f 1.5 . "
                "}\n;\n"
                "PREFIX x: <x:> INSERT DATA { x:a x:b.c 5 ; a x:\\# };")
            .status == 204);
  CHECK(r.map.snapshot()->size() == 6);
  CHECK(r.patch("PREFIX x: <x:> DELETE DATA { x:a x:b.c 5 }").status == 204);
  CHECK(r.map.snapshot()->size() == 5);
}

TEST_CASE("the tag of a graph's JSON is another for readers with other rights, the tag of its triples is not", "[engine][world][security]") {
  using security::Right;
  std::vector<security::Rule> rules;
  std::shared_ptr<security::Policy> policy;
  const auto load = [&](security::Rights of_map, bool world_is_hidden) {
    rules = {{"/", security::Scope::tree, {}, Right::read}, {"/world/map", security::Scope::tree, {}, of_map}};
    if (world_is_hidden) rules.push_back({"/world", security::Scope::here, {security::Who::Kind::role, "chief"}, Right::read});
    policy = security::Policy::create(rules).value();
  };
  load(Right::read | Right::subscribe, false);
  const auto caller = [&] {
    engine::Caller made;
    made.view = policy->view(nullptr);
    return made;
  };
  engine::EngineOptions options;
  options.authorize = [&](const http::Request&) { return caller(); };
  options.renew = [&](const security::Principal*) { return std::optional(caller()); };
  Robot r(writable(), {}, std::move(options));
  r.say("a cup");
  const auto json = [&](const std::string& fields = {}) { return r.bench.ask("GET /world/map\nAccept: application/json" + fields); };
  const Answer reads = json(), triples = r.bench.ask("GET /world/map\nAccept: text/turtle");
  CHECK_FALSE(reads.says("\"PUT\""));
  CHECK(reads.says("\"parent\""));
  const auto channel = r.bench.open_stream("/world/map?accept=application/json");
  CHECK(r.bench.messages(channel).size() == 1);

  load(Right::read | Right::subscribe | Right::write, false);
  r.bench.engine.renew_rights();
  const Answer writes = json("\nIf-None-Match: " + reads.tag());
  CHECK(writes.status == 200);
  CHECK(writes.says("\"PUT\""));
  CHECK(writes.tag() != reads.tag());
  CHECK(r.bench.messages(channel).size() == 1);

  load(Right::read | Right::subscribe | Right::write, true);
  r.bench.engine.renew_rights();
  const Answer hidden = json("\nIf-None-Match: " + writes.tag());
  CHECK(hidden.status == 200);
  CHECK_FALSE(hidden.says("\"parent\""));
  CHECK(json("\nIf-None-Match: " + hidden.tag()).status == 304);
  CHECK(r.bench.messages(channel).size() == 1);

  CHECK(r.bench.ask("GET /world/map\nAccept: text/turtle\nIf-None-Match: " + triples.tag()).status == 304);
  // A client may write what it has read, whatever it was allowed then.
  CHECK(r.put("<#a> <p:b> 1 .", "If-Match: " + reads.tag() + "\n").status == 204);
  CHECK(r.put("<#a> <p:b> 2 .", "If-Match: " + reads.tag() + "\n").status == 412);
}

TEST_CASE("who may write a graph and not read it learns its limits, not its size", "[engine][world][security]") {
  using security::Right;
  security::Rights rights = Right::read | Right::write;
  engine::EngineOptions options;
  options.authorize = [&](const http::Request&) {
    engine::Caller caller;
    caller.view = std::make_shared<const security::View>(rights);
    return caller;
  };
  GraphOptions limits = writable();
  limits.max_triples = 20;
  limits.max_bytes = 3000;
  Robot r(limits, {}, std::move(options));
  r.fill(17);
  const std::string many = "<#a> <p:b> 1, 2, 3, 4, 5 .", large = "<#a> <p:b> '" + std::string(2500, 'x') + "' .";
  const auto post = [&](const std::string& body) { return r.bench.ask("POST /world/map\nContent-Type: text/turtle\n\n" + body); };
  CHECK(post(many).says("it would have 22 triples; 20 are allowed"));
  CHECK(post(large).says("; 3000 are allowed"));
  rights = Right::write;
  for (const Answer& refused : {post(many), r.patch("INSERT DATA { " + many + " }")}) {
    CHECK(refused.status == 413);
    CHECK(refused.says("it would have more than 20 triples"));
    CHECK_FALSE(refused.says("22"));
  }
  const Answer refused = post(large);
  CHECK(refused.status == 413);
  CHECK(refused.says("it would have more than 3000 bytes"));
  CHECK_FALSE(refused.says("are allowed"));
}

TEST_CASE("of two writers with the same If-Match the second is refused", "[engine][world]") {
  Robot r;
  r.say("a cup");
  const std::string tag = r.get().tag(), triples = r.get("Accept: application/n-triples\n").tag();
  CHECK(r.put("<#x> rdfs:label \"x\" .", "If-Match: " + tag + "\n").status == 204);
  CHECK(r.put("<#y> rdfs:label \"y\" .", "If-Match: " + tag + "\n").status == 412);
  CHECK(r.put("<#y> rdfs:label \"y\" .", "If-Match: " + triples + "\n").status == 412);
  CHECK(r.put("<#y> rdfs:label \"y\" .", "If-None-Match: *\n").status == 412);
  CHECK(r.patch("INSERT DATA {}", "If-Match: " + tag + "\n").status == 412);
  CHECK(missing(r.get(), "<world/map#x> rdfs:label \"x\" .") == "");
}

TEST_CASE("a write whose precondition held when it came is refused if the graph has changed meanwhile", "[engine][world]") {
  engine::EngineOptions options;
  options.body_jobs = true;
  options.small_body_bytes = 0;
  Robot r(writable(), {}, options);
  r.say("a cup");
  const std::string tag = r.get().tag();
  const auto first = r.bench.send(Bench::turtle_request("PUT", "/world/map", "<#x> rdfs:label \"x\" .", "If-Match: " + tag + "\n"));
  const auto second = r.bench.send(Bench::turtle_request("PUT", "/world/map", "<#y> rdfs:label \"y\" .", "If-Match: " + tag + "\n"));
  r.bench.run();
  CHECK(r.bench.answer(first)->status == 204);
  CHECK(r.bench.answer(second)->status == 412);
  CHECK(missing(r.get(), "<world/map#x> rdfs:label \"x\" .") == "");
}

TEST_CASE("If-Match: * holds for a graph that has changed meanwhile", "[engine][world]") {
  engine::EngineOptions options;
  options.body_jobs = true;
  options.small_body_bytes = 0;
  Robot r(writable(), {}, options);
  r.say("a cup");
  for (const char* field : {"If-Match: *\n", "If-None-Match: \"x\"\n"}) {
    CAPTURE(field);
    const auto sent = r.bench.send(Bench::turtle_request("POST", "/world/map", "<#x> rdfs:label \"x\" .", field));
    r.say("another cup " + std::string(field, 8));
    r.bench.run();
    CHECK(r.bench.answer(sent)->status == 204);
  }
}

TEST_CASE("writes without a body wait at the same time", "[engine][world][limits]") {
  engine::EngineOptions options;
  options.body_jobs = true;
  Robot r(writable(), {}, options);
  r.fill(600);  // more than the engine changes at once
  std::vector<Bench::Sent> sent;
  for (const char* request : {"POST /world/map\n", "POST /world/map\n", "DELETE /world/map\n", "PUT /world/map\n"})
    sent.push_back(r.bench.send(request));
  for (const auto& one : sent) REQUIRE(one.ticket);
  r.bench.run();
  for (const auto& one : sent) CHECK(r.bench.answer(one)->status == 204);
  CHECK(r.map.snapshot()->empty());
}

TEST_CASE("a small change of a large graph counts as the work that it is", "[engine][world][limits]") {
  engine::EngineOptions options;
  options.body_jobs = true;
  Robot r(writable(), {}, options);
  const auto effort = [&] {
    const auto sent = r.bench.send("PATCH /world/map\nContent-Type: application/sparql-update\n\nINSERT DATA { <#x> <p:q> 1 }");
    auto jobs = r.bench.take_body_jobs();
    REQUIRE(jobs.size() == 1);
    const std::size_t bytes = jobs[0].bytes;
    jobs[0].run();
    CHECK(r.bench.answer(sent)->status == 204);
    return bytes;
  };
  r.fill(1000);
  const std::size_t first = effort();
  CHECK(first > 1000);
  r.fill(3000);
  CHECK(effort() > first + 2000);
}

TEST_CASE("shapes judge what code writes and what clients write", "[engine][world]") {
  GraphOptions options = writable();
  options.shapes = shapes();
  Robot r(options);
  const Result<void> refused = r.map.update([](GraphUpdate& u) { u.add("#cup", vocab::rdf_::type, Iri("https://example.org/Cup")); });
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::expected_value);
  CHECK(refused.error().message.find("MinCount") != std::string::npos);
  CHECK(r.map.snapshot()->empty());
  const std::string cup = "<#cup> a <https://example.org/Cup> .";
  const Answer a = r.put(cup);
  CHECK(a.status == 422);
  CHECK(missing(a, "[] a sh:ValidationReport ; sh:conforms false ; sh:result [ sh:focusNode <world/map#cup> ] .") == "");
  CHECK(r.put(cup, "Accept: application/json\n").body.find("http://localhost/world/map#cup") != std::string::npos);
  CHECK(r.put(cup + a_cup).status == 204);
  // The whole graph that results is judged, not the change alone.
  CHECK(r.patch("DELETE DATA { <#cup> <http://www.w3.org/2000/01/rdf-schema#label> \"a cup\" }").status == 422);
  CHECK(r.bench.ask("DELETE /world/map").status == 204);
  CHECK(r.bench.get("/world/blueprint").body.find("targetClass") != std::string::npos);
}

TEST_CASE("a graph has its limits", "[engine][world]") {
  GraphOptions options = writable();
  options.max_triples = 2;
  options.max_bytes = 4000;
  Robot r(options);
  CHECK(r.put("<#a> <p:b> 1, 2 .").status == 204);
  CHECK(r.put("<#a> <p:b> 1, 2, 3 .").status == 413);
  CHECK(r.bench.turtle("POST", "/world/map", "<#a> <p:b> 3 .").status == 413);
  CHECK(r.patch("INSERT DATA { <#a> <p:b> 3 }").status == 413);
  CHECK(r.map.update([](GraphUpdate& u) { u.add("#a", pose, 3); }).error().code == Errc::limit_exceeded);
  CHECK(r.map.update([](GraphUpdate& u) { u.clear().add("#a", pose, std::string(4000, 'x')); }).error().code == Errc::limit_exceeded);
  CHECK(r.patch("INSERT DATA { <#a> <p:b> '" + std::string(4000, 'x') + "' }").status == 413);  // the body alone
  CHECK(r.map.snapshot()->size() == 2);
}

TEST_CASE("what clients send for a graph that takes more triples than other bodies is read to its end", "[engine][world][limits]") {
  GraphOptions options = writable();
  options.max_triples = 350'000;  // of a body: 100,000 otherwise
  options.max_bytes = 256 * 1024 * 1024;
  Robot r(options);
  const auto numbers = [](int from, const char* separator) {
    std::string text = std::to_string(from);
    for (int i = from + 1; i < from + 110'000; ++i) text += separator + std::to_string(i);
    return text;
  };
  CHECK(r.put("<#x> <p:q> " + numbers(0, ",") + " .").status == 204);
  CHECK(r.map.snapshot()->size() == 110'000);
  CHECK(r.patch("INSERT DATA { <#x> <p:q> " + numbers(200'000, ",") + " }").status == 204);
  CHECK(r.map.snapshot()->size() == 220'000);
  std::string lines;
  for (int i = 0; i < 110'000; ++i) lines += "<p:s> <p:q> \"" + std::to_string(i) + "\" .\n";
  CHECK(r.bench.ask("POST /world/map\nContent-Type: application/n-triples\n\n" + lines).status == 204);
  CHECK(r.map.snapshot()->size() == 330'000);
  CHECK(r.bench.ask("POST /world/map\nContent-Type: application/n-triples\n\n<p:t> <p:q> <p:r> .\n" + lines).status == 204);
  CHECK(
      r.put("<#x> <p:q> " + numbers(500'000, ",") + "," + numbers(700'000, ",") + "," + numbers(900'000, ",") + "," + numbers(1'100'000, ",") + " .")
          .status == 413);
  CHECK(r.map.snapshot()->size() == 330'001);
}

TEST_CASE("clients make graphs where they may, up to a number, and remove them", "[engine][world]") {
  Robot r(writable(), creation(2));
  const Answer a = r.bench.turtle("PUT", "/world/seen/1.ttl", a_cup);
  CHECK(a.status == 201);
  CHECK(a.field("Location") == "http://localhost/world/seen/1.ttl");
  CHECK(missing(r.bench.get("/world/seen/1.ttl"), "<world/seen/1.ttl#cup> rdfs:label \"a cup\" .") == "");
  const Answer b = r.bench.turtle("POST", "/world", a_cup);
  CHECK(b.status == 201);
  const std::string made = b.field("Location").substr(std::string("http://localhost").size());
  CHECK(r.bench.get(made).status == 200);
  CHECK(r.bench.get("/world").body.find(made.substr(7)) != std::string::npos);
  CHECK(r.bench.turtle("PUT", "/world/third", a_cup).status == 409);
  CHECK(r.bench.turtle("PUT", "/world/seen/1.ttl", a_cup).status == 204);
  CHECK(r.bench.ask("DELETE " + made).status == 204);
  CHECK(r.bench.get(made).status == 404);
  CHECK(r.bench.ask("DELETE " + made).status == 404);
  CHECK(r.bench.turtle("PUT", "/world/third", a_cup, "If-Match: *\n").status == 412);
  CHECK(r.bench.turtle("PUT", "/world/third", a_cup, "If-None-Match: *\n").status == 201);
  CHECK(r.bench.turtle("PUT", "/elsewhere", a_cup).status == 404);
  CHECK(r.bench.ask("HEAD /world/none").status == 404);
  Robot none;
  CHECK(none.bench.turtle("PUT", "/world/new", a_cup).status == 404);
  CHECK(none.bench.turtle("POST", "/world", a_cup).status == 405);
}

TEST_CASE("graphs of clients have a limit together", "[engine][world][limits]") {
  WorldOptions world_options = creation(10);
  world_options.max_created_bytes = 10'000;
  Robot r(writable(), world_options);
  const auto text = [](std::size_t bytes) { return "<#x> <p:q> \"" + std::string(bytes, 'x') + "\" ."; };
  CHECK(r.bench.turtle("PUT", "/world/a", text(4000)).status == 201);
  CHECK(r.bench.turtle("PUT", "/world/b", text(4000)).status == 201);
  const Answer refused = r.bench.turtle("PUT", "/world/c", text(4000));
  CHECK(refused.status == 413);
  CHECK(refused.says("10000 bytes"));
  CHECK(r.bench.get("/world/c").status == 404);
  CHECK(r.bench.turtle("POST", "/world", text(4000)).status == 413);
  CHECK(r.bench.turtle("POST", "/world/a", text(4001)).status == 413);
  CHECK(r.bench.ask("PATCH /world/a\nContent-Type: application/sparql-update\n\nINSERT DATA { " + text(4001) + " }").status == 413);
  CHECK(r.bench.turtle("PUT", "/world/map", text(40'000)).status == 204);  // which code has made
  CHECK(r.bench.turtle("PUT", "/world/a", text(100)).status == 204);
  CHECK(r.bench.turtle("PUT", "/world/c", text(4000)).status == 201);
  CHECK(r.bench.turtle("PUT", "/world/d", text(4000)).status == 413);
  CHECK(r.bench.ask("DELETE /world/b").status == 204);
  r.bench.take_discarded();
  CHECK(r.bench.turtle("PUT", "/world/d", text(4000)).status == 201);
}

TEST_CASE("requests that create the same graph at once are executed one after another", "[engine][world]") {
  engine::EngineOptions options;
  options.body_jobs = true;
  options.small_body_bytes = 0;
  Robot r(writable(), creation(1), options);
  const auto send = [&](const std::string& method, const std::string& target, const std::string& text, const std::string& fields = {}) {
    return r.bench.send(Bench::turtle_request(method, target, "<#cup> rdfs:label \"" + text + "\" .", fields));
  };
  const auto first = send("PUT", "/world/new", "first"), second = send("PUT", "/world/new", "second"),
             third = send("POST", "/world?graph=http://localhost/world/new", "third"), fourth = send("PUT", "/world/new", "4", "If-None-Match: *\n"),
             other = send("PUT", "/world/other", "x");
  r.bench.run();
  CHECK(r.bench.answer(first)->status == 201);
  CHECK(r.bench.answer(second)->status == 204);
  CHECK(r.bench.answer(third)->status == 204);
  CHECK(r.bench.answer(fourth)->status == 412);
  CHECK(r.bench.answer(other)->status == 409);  // there may be one only
  const Answer a = r.bench.get("/world/new");
  CHECK(missing(a, "<world/new#cup> rdfs:label \"second\", \"third\" .") == "");
  CHECK_FALSE(a.says("first"));
}

TEST_CASE("graphs are named by the parameter graph, too", "[engine][world]") {
  Robot r(writable(), creation());
  CHECK(r.bench.turtle("PUT", "/world?graph=http%3A%2F%2Flocalhost%2Fworld%2Fmap", a_cup).status == 204);
  CHECK(missing(r.bench.get("/world?graph=http://localhost/world/map"), "<world/map#cup> rdfs:label \"a cup\" .") == "");
  CHECK(r.bench.turtle("PUT", "/world?graph=http://localhost/world/new", a_cup).status == 201);
  CHECK(r.bench.get("/world/new").status == 200);
  CHECK(r.bench.ask("DELETE /world?graph=http://localhost/world/new").status == 204);
  CHECK(r.bench.get("/world?graph=http://localhost/world/new").status == 404);
  CHECK(r.bench.get("/world?graph=http://example.org/g").status == 404);
  CHECK(Robot().bench.turtle("PUT", "/world?graph=http://example.org/g", a_cup).status == 404);  // which has only its own graphs
}

TEST_CASE("parameters that name no graph, or several, are refused with the reason", "[engine][world]") {
  Robot r(writable(), creation());
  const auto says = [&](const std::string& query, const std::string& reason) {
    const Answer put = r.bench.turtle("PUT", "/world?" + query, a_cup);
    return put.status == 400 && put.says(reason);
  };
  CHECK(says("graph=http://example.org/g", "expected an IRI below <http://localhost/world/>, found <http://example.org/g>"));
  CHECK(says("graph=http://localhost/elsewhere", "expected an IRI below"));
  CHECK(says("graph=http://localhost/world/new%23part", "expected an IRI below"));
  for (const char* query : {"graph=new", "graph=/world/map", "graph=", "graph", "graph=%ZZ"}) {
    CAPTURE(query);
    CHECK(says(query, "expected an absolute IRI"));
    CHECK(r.bench.get("/world?" + std::string(query)).status == 400);
  }
  for (const char* query : {"default&graph=http://localhost/world/map", "graph=http://localhost/world/map&graph=http://localhost/world/tasks",
                            "graph=http://localhost/world/map&default=", "default&default"}) {
    CAPTURE(query);
    CHECK(says(query, "found several"));
    CHECK(r.bench.get("/world?" + std::string(query)).status == 400);
  }
  CHECK(r.map.snapshot()->empty());
  CHECK(r.bench.get("/world?graph=http://localhost/world/map&accept=text/turtle").status == 200);
}

TEST_CASE("the path below a resource stays free for that resource, in whatever way a request names it", "[engine][world]") {
  Robot r(writable(), creation());
  CHECK(r.bench.turtle("PUT", "/world/map/cup", a_cup).status == 404);
  CHECK(r.bench.turtle("PUT", "/world?graph=http://localhost/world/map/cup", a_cup).status == 404);
  CHECK(r.bench.turtle("PUT", "/world?graph=http://localhost/world/map/cup/pose", a_cup).status == 404);
  auto cup = r.map.published<double>("cup", pose);
  cup.publish(0.5);
  CHECK(missing(r.bench.get("/world/map/cup"), "<world/map/cup> vom:numericalValue \"0.5\"^^xsd:double .") == "");
  CHECK(r.bench.turtle("PUT", "/world?graph=http://localhost/world/map/cup", a_cup).status == 404);
  CHECK(r.bench.turtle("PUT", "/world?graph=http://localhost/world/seen/cup", a_cup).status == 201);
}

TEST_CASE("what the control loop publishes is in the graph, and clients cannot write it", "[engine][world]") {
  Robot r;
  auto cup = r.map.published<double>("cup", pose, unit::metre);
  CHECK_FALSE(r.map.published<double>("cup", pose));
  CHECK(r.get().body.find("example.org") == std::string::npos);
  const std::string stored = r.get().tag();
  cup.publish(0.5);
  const Answer a = r.get();
  CHECK(missing(a,
                "<world/map#cup> <https://example.org/pose> <world/map/cup> . <world/map/cup> a hybrit:Property ; vom:numericalValue "
                "\"0.5\"^^xsd:double .") == "");
  CHECK(a.body.find("dcterms:modified") != std::string::npos);
  CHECK(a.tag() != stored);
  CHECK(missing(r.bench.get("/world/map/cup"), "<world/map/cup> vom:numericalValue \"0.5\"^^xsd:double .") == "");
  CHECK(missing(r.bench.get("/world?default"), "<world/map/cup> vom:numericalValue \"0.5\"^^xsd:double .") == "");
  // A client writes back what it has read, while the cup moves.
  cup.publish(0.6);
  CHECK(r.bench.ask("PUT /world/map\nContent-Type: text/turtle\nIf-Match: " + a.tag() + "\n\n" + a.body).status == 204);
  CHECK(r.map.snapshot()->empty());
  CHECK(missing(r.get(), "<world/map/cup> vom:numericalValue \"0.6\"^^xsd:double .") == "");
  CHECK(r.get().body.find("0.5") == std::string::npos);
  cup.remove();
  CHECK(r.bench.get("/world/map/cup").status == 404);
  CHECK(r.get().body.find("example.org") == std::string::npos);
  cup.publish(1);
}

TEST_CASE("observers of a graph get what code, clients and the control loop change", "[engine][world]") {
  Robot r;
  auto cup = r.map.published<double>("cup", pose);
  const engine::Channel channel = r.bench.open("/world/map");
  const auto says = [&](const std::string& text) {
    r.bench.look();
    const std::vector<std::string> messages = r.bench.messages(channel);
    return messages.size() == 1 && messages[0].find(text) != std::string::npos;
  };
  CHECK(r.bench.messages(channel).size() == 1);
  r.say("a red cup");
  CHECK(says("a red cup"));
  CHECK(r.put("<#x> rdfs:label \"a green cup\" .").status == 204);
  CHECK(says("a green cup"));
  CHECK(r.patch("INSERT DATA { <#x> <p:b> 'blue' }").status == 204);
  CHECK(says("blue"));
  cup.publish(0.25);
  CHECK(says("0.25"));
  auto plate = r.map.published<double>("plate", pose);
  plate.publish(0.75);
  CHECK(says("0.75"));
  cup.remove();
  CHECK(says("0.75"));
  CHECK(r.map.update([](GraphUpdate& u) { u.add("#x", pose, 1).remove("#x", pose, 1); }));
  CHECK(r.bench.messages(channel).empty());
}

TEST_CASE("an observer of a graph that takes long to represent leaves most of the time to others", "[engine][world][limits]") {
  using std::chrono::milliseconds;
  Robot r;
  r.say("a cup");
  const engine::Channel channel = r.bench.open("/world/map");
  CHECK(r.bench.messages(channel).size() == 1);
  r.say("a second cup");
  r.bench.run();
  const auto ready = r.bench.engine.next_ready(r.bench.clock.now());
  REQUIRE(ready);
  const TimePoint now = r.bench.clock.now();
  r.bench.clock.run_slowly(milliseconds(20));
  CHECK(r.bench.engine.next_push(*ready, now));
  r.bench.clock.run_slowly({});
  CHECK_FALSE(r.bench.engine.next_push(*ready, now));
  const TimePoint end = {now.steady + milliseconds(20 + 4 * 20), now.utc};
  r.say("a third cup");
  CHECK(r.bench.messages(channel).empty());
  CHECK(r.bench.engine.next_deadline() == end.steady);
  CHECK(r.bench.get("/world/tasks").status == 200);  // others do not wait
  r.bench.clock.advance(std::chrono::duration_cast<std::chrono::microseconds>(end.steady - r.bench.clock.now().steady));
  const std::vector<std::string> last = r.bench.messages(channel);
  CHECK((last.size() == 1 && last[0].find("a third cup") != std::string::npos));
  r.say("a fourth cup");
  CHECK(r.bench.messages(channel).size() == 1);  // the third took no time
}

TEST_CASE("an observer with a queue gets each published value of an object that came later", "[engine][world]") {
  Robot r;
  const engine::Channel channel = r.bench.open("/world/map?queueLength=10&delivery=queue");
  auto cup = r.map.published<double>("cup", pose);
  r.bench.run();
  CHECK(r.bench.messages(channel).size() == 1);
  for (const double x : {1.5, 2.5, 3.5}) cup.publish(x);
  r.bench.look();
  CHECK(r.bench.messages(channel).size() == 3);
  cup.remove();
  r.bench.run();
  r.bench.engine.closed(channel);
  CHECK(r.get().status == 200);
}

TEST_CASE("a value that is not published for a while leaves the graph, and observers learn that", "[engine][world]") {
  Robot r;
  PublishedOptions options(unit::metre);
  options.expires_after = std::chrono::seconds(2);
  auto cup = r.map.published<double>("cup", pose, options);
  cup.publish(0.5);
  CHECK(r.get().body.find("0.5") != std::string::npos);
  r.bench.clock.advance(std::chrono::seconds(1));
  cup.publish(0.5);  // it is still there
  CHECK(r.get().status == 200);
  r.bench.clock.advance(std::chrono::milliseconds(1500));
  CHECK(r.get().body.find("0.5") != std::string::npos);
  r.bench.clock.advance(std::chrono::milliseconds(600));
  CHECK(r.bench.get("/world?default").body.find("0.5") == std::string::npos);
  CHECK(r.bench.get("/world/map/cup").body.find("0.5") == std::string::npos);
  const engine::Channel channel = r.bench.open("/world/map");
  CHECK(r.bench.messages(channel).size() == 1);
  cup.publish(0.75);
  r.bench.look();
  CHECK(r.bench.messages(channel).size() == 1);
  r.bench.clock.advance(std::chrono::milliseconds(2001));
  REQUIRE(r.bench.engine.next_deadline());
  CHECK(*r.bench.engine.next_deadline() <= r.bench.clock.now().steady);
  const std::vector<std::string> gone = r.bench.messages(channel);
  REQUIRE(gone.size() == 1);
  CHECK(gone[0].find("0.75") == std::string::npos);
}

TEST_CASE("what is compared for the queries of one change is not compared for the next if an observer throws", "[engine][world]") {
  struct Failing final : engine::Observer {
    engine::Variant variant() const noexcept override { return {}; }
    void resource_changed(engine::SeenBy) override { throw std::runtime_error("no memory"); }
    void resource_changes(engine::SeenBy) override {}
    void values_missed(std::uint64_t, engine::SeenBy) override {}
    void resource_removed() override {}
    bool queues() const noexcept override { return false; }
  };
  FakeClock clock;
  engine::EngineOptions options;
  options.clock = &clock;
  options.ids = std::make_shared<FixedIds>();
  engine::Parts parts(std::move(options));
  World world("world");
  WorldGraph map = world.graph("map");
  parts.add(std::move(world)).value();
  auto& graph = static_cast<engine::WorldGraphResource&>(*parts.registry.find("/world/map"));
  Failing failing;
  for (engine::Resource* observed : {static_cast<engine::Resource*>(&graph.world), static_cast<engine::Resource*>(&graph)}) {
    observed->observers.push_back(&failing);
    map.update([](GraphUpdate& u) { u.add("#cup", label, u.graph().size()); }).value();
    CHECK_THROWS_AS(graph.take_changes(parts), std::runtime_error);
    observed->observers.remove(&failing);
    CHECK_FALSE(graph.world.only_sizes_change);
    engine::QueryDependencies others;
    others.predicates = {"https://example.org/other"};
    CHECK(graph.is_change_for(others, "http://localhost"));  // nothing is known
  }
}

TEST_CASE("a World that is removed leaves working handles", "[engine][world]") {
  Robot r;
  auto cup = r.map.published<double>("cup", pose);
  const engine::Channel channel = r.bench.open("/world/map");
  r.bench.engine.remove("world").value();
  CHECK(r.bench.get("/world/map").status == 404);
  r.say("a cup");
  cup.publish(1);
  cup.remove();
  CHECK(r.map.snapshot()->size() == 1);
  (void)channel;
}

TEST_CASE("what is wrong with a World is said when it is added", "[engine][world]") {
  const auto code = [](GraphOptions options, const char* path = "map") {
    Bench bench;
    World world("world");
    world.graph(path, std::move(options));
    world.graph("map2");
    const Result<void> added = bench.engine.add(std::move(world));
    REQUIRE_FALSE(added);
    INFO(added.error().message);
    return added.error().code;
  };
  GraphOptions bad_shapes, bad_turtle, not_conforming;
  bad_shapes.shapes = "<#a> <b";
  bad_turtle.turtle = "<#a> <b";
  not_conforming.shapes = shapes();
  not_conforming.turtle = "<#cup> a <https://example.org/Cup> .";
  CHECK(code(bad_shapes) == Errc::expected_rdf);
  CHECK(code(bad_turtle) == Errc::expected_rdf);
  CHECK(code(not_conforming) == Errc::expected_value);
  CHECK(code({}, "") == Errc::expected_iri);
  CHECK(code({}, "map2") == Errc::duplicate_path);
}

TEST_CASE("threads update a graph while requests read and write it", "[engine][world][threads]") {
  Robot r;
  std::atomic<bool> done{false};
  std::vector<std::thread> writers;
  for (int n = 0; n < 2; ++n)
    writers.emplace_back([&, n] {
      const std::string me = "#w" + std::to_string(n);
      for (int i = 0; i < 200; ++i) r.map.update([&](GraphUpdate& u) { u.set(me, label, i).set(me, pose, i); }).value();
      if (n == 0) done = true;
    });
  while (!done) {
    const auto graph = r.map.snapshot();
    CHECK(graph->size() % 2 == 0);  // never half an update
    (void)r.get();
    const int status = r.patch("INSERT DATA { <#c> <p:a> 1 . <#c> <p:b> 1 }").status;
    CHECK((status == 204 || status == 503));
  }
  for (std::thread& w : writers) w.join();
  CHECK(r.map.snapshot()->size() >= 4);
}

TEST_CASE("triples are removed by any of their terms, and a relative IRI is that of the graph", "[engine]") {
  Robot r;
  constexpr Iri on{"https://example.org/on"};
  r.map
      .update([&](GraphUpdate& u) {
        u.add("#cup", label, "a cup")
            .add("#cup", pose, 1)
            .add("#plate", label, "a plate")
            .add("#plate", pose, 1)
            .add("#cup", on, Object(Iri("#table")));
        CHECK(u.size() == 5);
      })
      .value();
  const rdf::TermView cup = rdf::iri("#cup"), plate = rdf::iri("#plate"), has_label = label, table = rdf::iri("#table"),
                      text = rdf::literal("a plate");
  std::size_t left = 0;
  SECTION("nothing is given") {
    r.map.update([](GraphUpdate& u) { u.remove_matching(nullptr, nullptr, nullptr); }).value();
  }
  SECTION("a subject") {
    r.map.update([&](GraphUpdate& u) { u.remove_matching(&cup, nullptr, nullptr); }).value();
    left = 2;
  }
  SECTION("a predicate") {
    r.map.update([&](GraphUpdate& u) { u.remove_matching(nullptr, &has_label, nullptr); }).value();
    left = 3;
  }
  SECTION("an object, which is an IRI") {
    r.map.update([&](GraphUpdate& u) { u.remove_matching(nullptr, nullptr, &table); }).value();
    left = 4;
  }
  SECTION("subject and object") {
    r.map.update([&](GraphUpdate& u) { u.remove_matching(&plate, nullptr, &text); }).value();
    left = 4;
  }
  SECTION("all terms, and a further triple that is added in the same update") {
    r.map
        .update([&](GraphUpdate& u) {
          u.remove_matching(&plate, &has_label, &text).add("#plate", label, "a plate");
          CHECK(u.size() == 5);
          u.remove_matching(&plate, &has_label, &text);
          CHECK(u.size() == 4);
        })
        .value();
    left = 4;
  }
  SECTION("terms that no triple has") {
    const std::uint64_t revision = r.map.revision();
    const rdf::TermView other = rdf::literal("a bowl"), absolute = rdf::iri("http://elsewhere.example/map#cup");
    r.map
        .update([&](GraphUpdate& u) {
          u.remove_matching(&cup, nullptr, &text).remove_matching(nullptr, nullptr, &other).remove_matching(&absolute, nullptr, nullptr);
        })
        .value();
    CHECK(r.map.revision() == revision);
    left = 5;
  }
  CHECK(r.map.snapshot()->size() == left);
}

TEST_CASE("an update with a text that is no IRI removes nothing", "[engine]") {
  Robot r;
  r.say("a cup");
  const auto before = r.map.snapshot();
  const rdf::TermView bad = rdf::iri("#a cup");
  CHECK(r.map.update([&](GraphUpdate& u) { u.clear().remove_matching(&bad, nullptr, nullptr); }).error().code == Errc::expected_iri);
  CHECK(r.map.snapshot() == before);
}

TEST_CASE("a term that no syntax can write is refused where it is added", "[engine][world]") {
  Robot r;
  r.say("a cup");
  const auto before = r.map.snapshot();
  const auto code = [&](const std::function<void(GraphUpdate&)>& change) {
    const Result<void> updated = r.map.update(change);
    CHECK(r.map.snapshot() == before);
    CHECK(r.get().status == 200);
    return updated ? std::string("updated") : std::string(to_string(updated.error().code));
  };
  const auto graph_with = [](const rdf::TermView& subject, const rdf::TermView& object) {
    rdf::Graph graph;
    graph.add(subject, label, object);
    return graph;
  };
  const std::string refused(to_string(Errc::expected_rdf));
  CHECK(code([](GraphUpdate& u) { u.add("#b", label, Object(std::string_view("caf\xe9"))); }) == refused);
  CHECK(code([](GraphUpdate& u) { u.add(rdf::iri("#b"), label, rdf::tagged_literal("x", "e n")); }) == refused);
  CHECK(code([](GraphUpdate& u) { u.add(rdf::iri("#b"), label, rdf::literal("x", Iri("nope"))); }) == refused);
  CHECK(code([&](GraphUpdate& u) { u.add(graph_with(rdf::iri("relative"), rdf::literal("x"))); }) == refused);
  CHECK(code([&](GraphUpdate& u) { u.add(graph_with(rdf::blank("b"), rdf::literal("caf\xe9"))); }) == refused);
  CHECK(code([&](GraphUpdate& u) { u.add(graph_with(rdf::iri("a b:c"), rdf::literal("x"))); }) == refused);
  CHECK(r.map.update([&](GraphUpdate& u) { u.add(graph_with(rdf::blank("b . <x>"), rdf::literal("x"))); }));
  CHECK(r.get().status == 200);
}

TEST_CASE("an IRI of a graph has at most 8,192 bytes where code and files have it", "[engine][world]") {
  Robot r;
  const std::string at_limit = "http://lrt.invalid/world/map#" + std::string(8192 - 29, 'x'), name_of = at_limit.substr(28);
  CHECK(r.map.update([&](GraphUpdate& u) { u.add(at_limit, label, "x").add("#x", label, Object(Iri(std::string_view(at_limit)))); }));
  CHECK(r.map.update([&](GraphUpdate& u) { u.clear(); }));
  CHECK(r.map.update([&](GraphUpdate& u) { u.add(at_limit + "x", label, "x"); }).error().code == Errc::limit_exceeded);
  CHECK(r.map.update([&](GraphUpdate& u) { u.add(name_of + "x", label, "x"); }).error().code == Errc::limit_exceeded);
  CHECK(r.map.update([&](GraphUpdate& u) { u.add(rdf::iri("#x"), label, rdf::literal("x", Iri("p:" + std::string(8191, 'x')))); }).error().code ==
        Errc::limit_exceeded);
  // The base of clients is shorter than World::base: http://localhost
  CHECK(r.put("<" + name_of + "> rdfs:label \"x\" .").status == 204);
  for (const char* more : {"x", "xx"}) {
    CAPTURE(more);
    const std::string statement = "<" + name_of + more + "> <http://www.w3.org/2000/01/rdf-schema#label> \"y\" .";
    CHECK(r.put(statement).status == 413);
    CHECK(r.bench.turtle("POST", "/world/map", statement).status == 413);
    CHECK(r.patch("INSERT DATA { " + statement + " }").status == 413);
  }
  CHECK(r.map.snapshot()->size() == 1);
}

TEST_CASE("a graph is added to itself with new blank nodes", "[engine][world]") {
  Robot r;
  for (std::size_t n = 1; n < 100; ++n) {
    std::string text = "<#a> <p:q> 1 .";
    for (std::size_t i = 0; i < n; ++i) text += "[] <p:q> [ <p:r> " + std::to_string(i) + " ] .";
    r.map.update([&](GraphUpdate& u) { u.clear().add_turtle(text); }).value();
    r.map.update([](GraphUpdate& u) { u.add(u.graph()); }).value();
    CHECK(r.map.snapshot()->size() == 4 * n + 1);
  }
}

TEST_CASE("an update within an update is refused, also of another graph", "[engine][world]") {
  Robot r;
  const auto names = [](GraphUpdate& u) { u.add("#x", label, "x"); };
  r.map
      .update([&](GraphUpdate& u) {
        names(u);
        CHECK(r.tasks.update(names).error().code == Errc::refused);
        CHECK(r.map.update(names).error().code == Errc::refused);
        CHECK(r.tasks.snapshot()->empty());
      })
      .value();
  CHECK(r.map.snapshot()->size() == 1);
  CHECK_FALSE(r.map.update([](GraphUpdate&) { throw std::runtime_error("no camera"); }));
  CHECK(r.tasks.update(names));  // after it, also if it failed
}

TEST_CASE("an update whose function returns an error changes nothing and returns it", "[engine][world]") {
  Robot r;
  const Result<void> updated = r.map.update([](GraphUpdate& u) -> Result<void> {
    u.add("#x", label, "x");
    return unexpected(Errc::out_of_range, "no camera");
  });
  REQUIRE_FALSE(updated);
  CHECK(updated.error().code == Errc::out_of_range);
  CHECK(updated.error().message == "no camera");
  CHECK(r.map.snapshot()->empty());
  CHECK(r.map.update([](GraphUpdate& u) -> Result<int> { return u.add("#x", label, "x"), 1; }));
  CHECK(r.map.snapshot()->size() == 1);
}

TEST_CASE("a client that writes back what it read keeps stored triples that refer to a published value", "[engine][world]") {
  Robot r;
  constexpr Iri relative_to{"https://example.org/relativeTo"};
  auto cup = r.map.published<double>("cup", pose);
  cup.publish(0.5);
  r.map
      .update([&](GraphUpdate& u) {
        u.add("#grasp", relative_to, Object::resource("world/map/cup")).add("#cup", relative_to, Object::resource("world/map/cup"));
        u.add("#plate", pose, Object::resource("world/map/cup"));
      })
      .value();
  const Answer a = r.get("Accept: application/n-triples\n");
  CHECK(r.bench.ask("PUT /world/map\nContent-Type: application/n-triples\nIf-Match: " + a.tag() + "\n\n" + a.body).status == 204);
  CHECK(r.map.snapshot()->size() == 3);
  CHECK(r.patch("INSERT DATA { <#grasp2> <https://example.org/relativeTo> </world/map/cup> }").status == 204);
  CHECK(r.map.snapshot()->size() == 4);
  CHECK(r.patch("INSERT DATA { <#cup> <https://example.org/pose> </world/map/cup> }").status == 204);  // the robot's
  CHECK(r.map.snapshot()->size() == 4);
}

TEST_CASE("the log says why a value is not published", "[engine][world]") {
  std::string log;
  engine::EngineOptions options;
  options.log = [&](LogLevel, std::string_view text) { log.append(text).append("\n"); };
  Robot r(writable(), {}, options);
  const auto refused = [&](const char* path, Iri predicate, const std::string& sentence) {
    log.clear();
    CHECK_FALSE(r.map.published<double>(path, predicate));
    r.bench.run();
    CHECK(log.find(sentence) != std::string::npos);
    if (log.find(sentence) == std::string::npos) UNSCOPED_INFO(log);
  };
  refused("a//b", pose, "\"a//b\"");
  refused("cup", Iri("relative"), "\"relative\"");
  auto cup = r.map.published<double>("cup", pose);
  CHECK(cup);
  refused("cup", pose, "\"world/map/cup\"");
}

// --------------------------------------------------------------------------------------------------------- several graphs

namespace {

/// A request with a document of several graphs.
std::string dataset_request(const std::string& method, const std::string& body, const std::string& fields = {},
                            const std::string& type = "application/trig") {
  return method + " /world\nContent-Type: " + type + "\n" + fields + "\n@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> . " + body;
}
std::string quads_request(const std::string& method, const std::string& body) {
  return method + " /world\nContent-Type: application/n-quads\n\n" + body;
}

/// A World whose clients may create graphs, with two graphs that they may write and one that they may not.
struct Store {
  explicit Store(WorldOptions world_options = creation(), engine::EngineOptions engine_options = {}, GraphOptions of_map = writable())
      : bench(std::move(engine_options)) {
    World world("world", std::move(world_options));
    map = world.graph("map", std::move(of_map));
    seen = world.graph("seen", writable());
    tasks = world.graph("tasks");
    bench.add(std::move(world));
  }
  Answer ask(const std::string& method, const std::string& body, const std::string& fields = {}) {
    return bench.ask(dataset_request(method, body, fields));
  }
  std::string lacks(const std::string& path, const std::string& turtle) { return missing(bench.get(path), turtle); }

  WorldGraph map, seen, tasks;
  Bench bench;
};

}  // namespace

TEST_CASE("PUT of a dataset replaces and creates the graphs that it names, and leaves the others", "[engine][world]") {
  Store r;
  r.map.update([](GraphUpdate& u) { u.add("#old", label, "old"); }).value();
  r.seen.update([](GraphUpdate& u) { u.add("#ball", label, "a ball"); }).value();
  const Answer a = r.ask("PUT", "<world/map> { <world/map#cup> rdfs:label \"a cup\" } <world/new> { <world/new#1> rdfs:label \"new\" }");
  CHECK(a.status == 204);
  CHECK(r.map.snapshot()->size() == 1);
  CHECK(r.lacks("/world/map", "<world/map#cup> rdfs:label \"a cup\" .") == "");
  CHECK(r.lacks("/world/new", "<world/new#1> rdfs:label \"new\" .") == "");
  CHECK(r.seen.snapshot()->size() == 1);
  CHECK(missing(r.bench.get("/world"), "<world> ldp:contains <world/new> . <world/new> a lrt:WorldGraph .") == "");
  CHECK(r.bench.ask("DELETE /world/new").status == 204);  // as one that a PUT at its own URI has made
  CHECK(r.ask("PUT", "<world/map> { }").status == 204);
  CHECK(r.map.snapshot()->empty());
  CHECK(r.bench.ask(quads_request("PUT", "<http://e/s> <http://e/p> <http://e/o> <http://localhost/world/map> .")).status == 204);
  CHECK(r.map.snapshot()->size() == 1);
  const std::string json = R"({"@id": "http://localhost/world/map", "@graph": [{"@id": "http://e/s", "http://e/p": [1, 2]}]})";
  if (rdf::syntax_of("application/ld+json")) {
    CHECK(r.bench.ask("PUT /world\nContent-Type: application/ld+json\n\n" + json).status == 204);
    CHECK(r.map.snapshot()->size() == 2);
  }
}

TEST_CASE("POST of a dataset adds to the graphs that it names; one graph without a name is a new graph", "[engine][world]") {
  Store r;
  r.map.update([](GraphUpdate& u) { u.add("#old", label, "old"); }).value();
  const std::string body = "<world/map> { <#x> rdfs:label [] } <world/new> { <#y> rdfs:label [] }";
  CHECK(r.ask("POST", body).status == 204);
  CHECK(r.ask("POST", body).status == 204);
  CHECK(r.map.snapshot()->size() == 3);
  CHECK(r.lacks("/world/new", "<world#y> rdfs:label _:a, _:b .") == "");
  const Answer one = r.ask("POST", "<#cup> rdfs:label \"a cup\" .");
  CHECK(one.status == 201);
  const std::string at = one.field("Location").substr(std::string("http://localhost").size());
  CHECK(r.lacks(at, "<" + at.substr(1) + "#cup> rdfs:label \"a cup\" .") == "");  // relative to the new graph, as in Turtle
  CHECK(r.bench.ask(quads_request("POST", "<http://e/s> <http://e/p> <http://e/o> .")).status == 201);
}

TEST_CASE("a dataset changes all its graphs or none, and the response names the graph that refuses", "[engine][world]") {
  GraphOptions shaped = writable();
  shaped.shapes = shapes();
  shaped.max_triples = 3;
  WorldOptions world_options = creation(2);
  world_options.max_created_bytes = 10'000;
  Store r(world_options, {}, shaped);
  r.seen.update([](GraphUpdate& u) { u.add("#ball", label, "a ball"); }).value();
  const auto refused = [&](const std::string& graphs, int status, const std::string& sentence, const std::string& method = "PUT") {
    CAPTURE(graphs);
    const Answer a = r.ask(method, "<world/seen> { } <world/new> { <#y> rdfs:label [] } " + graphs, "Accept: application/problem+json\n");
    CHECK(a.status == status);
    CHECK(a.says(sentence));
    CHECK(r.seen.snapshot()->size() == 1);
    CHECK(r.map.snapshot()->empty());
    CHECK(r.bench.get("/world/new").status == 404);
    CHECK_FALSE(r.bench.get("/world").says("world/new"));
  };
  refused("<world/map> { <world/map#x> a <https://example.org/Cup> }", 422, "<http://localhost/world/map#x>");
  refused("<world/map> { <#a> rdfs:label 1, 2, 3, 4 }", 413, "the graph <http://localhost/world/map>: it would have 4 triples");
  refused("<world/tasks> { }", 409, "the graph <http://localhost/world/tasks>: clients may not change it");
  refused("<world/tasks> { }", 409, "clients may not change it", "POST");
  refused("<elsewhere> { }", 422, "the graph <http://localhost/elsewhere>: expected an IRI below <http://localhost/world/>");
  refused("<http://example.org/world/map> { }", 422, "the graph <http://example.org/world/map>: expected an IRI below");
  refused("<world/map#part> { }", 422, "expected an IRI below");
  refused("<world/%6eew> { }", 422, "the graph <http://localhost/world/%6eew>: the document has it twice");
  refused("<world/map/cup> { }", 409, "its path, or one above it, belongs to another resource");
  refused("<world/new/below> { }", 503, "none was changed");
  refused("<world/two> { } <world/three> { }", 409, "the World has reached its maximum of 2 graphs");
  refused("<world/two> { <#a> <#b> \"" + std::string(20'000, 'x') + "\" }", 413, "10000 bytes");
  refused("<#a> <#b> <#c> .", 422, "the default graph: expected only triples that a named graph has too");
  refused("_:a { }", 422, "a blank node is not supported");
  refused("<world/map> { ", 400, "line 1");
  CHECK(r.ask("PUT", "<world/seen> { } <world/new> { <#y> rdfs:label [] }").status == 204);
  CHECK(r.bench.get("/world/new").status == 200);
}

TEST_CASE("a World says which documents it takes, and refuses others", "[engine][world]") {
  Store r;
  const Answer a = r.bench.get("/world");
  CHECK(a.field("Allow") == "GET, HEAD, OPTIONS, PUT, POST");
  std::string all = "application/trig, application/n-quads";
  if (rdf::syntax_of("application/ld+json")) all = "application/ld+json, " + all;
  CHECK(a.field("Accept-Put") == all);
  const Answer turtle = r.bench.turtle("PUT", "/world", a_cup);
  CHECK(turtle.status == 415);
  CHECK(turtle.field("Accept") == all);
  CHECK(turtle.says("PUT a single graph at its own URI"));
  const Answer unnamed = r.ask("PUT", "<#a> <#b> <#c> .");
  CHECK(unnamed.status == 422);
  CHECK(unnamed.says("expected named graphs, found none"));
  // One graph takes no others.
  for (const char* method : {"PUT", "POST"}) {
    const Answer one = r.bench.ask(std::string(method) + " /world/map\nContent-Type: application/trig\n\n<world/seen> { <#a> <#b> 1 }");
    CHECK(one.status == 422);
    CHECK(one.says("expected one graph, found the named graph <http://localhost/world/world/seen>"));
  }
  CHECK(r.bench.ask("PUT /world/map\nContent-Type: application/trig\n\n{ <#a> <#b> 1 }").status == 204);
  // Where clients may not create graphs, they change those that they may write; where there is none of these, no document is taken.
  Robot fixed;
  CHECK(fixed.bench.get("/world").field("Allow") == "GET, HEAD, OPTIONS, PUT");
  CHECK(fixed.bench.ask(dataset_request("PUT", "<world/map> { <#a> <#b> 1 }")).status == 204);
  CHECK(fixed.bench.ask(dataset_request("PUT", "<world/new> { <#a> <#b> 1 }")).status == 409);
  Robot none{GraphOptions()};
  CHECK(none.bench.get("/world").field("Allow") == "GET, HEAD, OPTIONS");
  CHECK(none.bench.ask(dataset_request("PUT", "<world/map> { }")).status == 405);
}

TEST_CASE("all graphs of a World, as it represents them, restore another World", "[engine][world]") {
  Store from, to;
  from.map.update([](GraphUpdate& u) { u.add("#cup", label, "a cup").add_turtle("<#a> <p:q> [ <p:r> ( 1 [] ) ] ."); }).value();
  from.seen.update([](GraphUpdate& u) { u.add("#ball", label, "a ball"); }).value();
  auto at = from.map.published<double>("cup", pose);
  at.publish(0.5);
  CHECK(from.bench.turtle("PUT", "/world/new", a_cup).status == 201);
  to.seen.update([](GraphUpdate& u) { u.add("#ball", label, "another ball"); }).value();
  for (const char* type : {"application/trig", "application/n-quads"}) {
    CAPTURE(type);
    const Answer all = from.bench.ask("GET /world?default\nAccept: " + std::string(type) + "\n");
    REQUIRE(all.status == 200);
    const std::string put = "PUT /world\nContent-Type: " + std::string(type) + "\n\n";
    // It also has the graph that clients may not write.
    CHECK(to.bench.ask(put + all.body).status == (all.says("world/tasks") ? 409 : 204));
    from.bench.take_discarded();
  }
  Robot one(writable(), creation()), other(writable(), creation());
  one.say("a cup");
  CHECK(one.bench.turtle("PUT", "/world/new", "<#x> rdfs:seeAlso [ rdfs:label ( 1 [] ) ] .").status == 201);
  for (const char* type : {"application/trig", "application/n-quads"}) {
    CAPTURE(type);
    const Answer all = one.bench.ask("GET /world?default\nAccept: " + std::string(type) + "\n");
    std::string body = all.body;
    if (const std::size_t empty = body.find("<http://localhost/world/tasks> {"); empty != std::string::npos)
      body.erase(empty, body.find('}', empty) + 1 - empty);
    const Answer put = other.bench.ask("PUT /world\nContent-Type: " + std::string(type) + "\n\n" + body);
    CHECK(put.status == 204);
    for (const char* path : {"/world/map", "/world/new"}) CHECK(rdf::isomorphic(one.bench.get(path).graph(), other.bench.get(path).graph()));
    other.bench.ask("DELETE /world/new");
  }
}

TEST_CASE("large datasets are read and judged as jobs, and begin again if a graph has changed meanwhile", "[engine][world]") {
  engine::EngineOptions options;
  options.body_jobs = true;
  options.small_body_bytes = 0;
  Store r(creation(), options);
  const std::string body = "<world/map> { <#x> rdfs:label 1 } <world/new> { <#y> rdfs:label 2 }";
  const auto first = r.bench.send(dataset_request("PUT", body));
  REQUIRE(first.ticket);
  CHECK(r.map.snapshot()->empty());
  r.bench.run();
  CHECK(r.bench.answer(first)->status == 204);
  CHECK(r.map.snapshot()->size() == 1);
  CHECK(r.bench.get("/world/new").status == 200);
  // Between the judging and the change, code writes one of the graphs. What it adds stays, because this is a POST.
  std::string large;
  for (int i = 0; i < 600; ++i) large += "<#" + std::to_string(i) + "> rdfs:label " + std::to_string(i) + " . ";
  const auto second = r.bench.send(dataset_request("POST", "<world/map> { " + large + " } <world/new> { <#z> rdfs:label 3 }"));
  int rounds = 0;
  for (auto jobs = r.bench.take_body_jobs(); !jobs.empty(); jobs = r.bench.take_body_jobs()) {
    for (auto& job : jobs) job.run();
    if (++rounds == 2) r.map.update([](GraphUpdate& u) { u.add("#code", label, "code"); }).value();
    (void)r.bench.answer(second);
  }
  CHECK(rounds == 3);
  CHECK(r.bench.answer(second)->status == 204);
  CHECK(r.map.snapshot()->size() == 602);
  // If it is changed each time, the request gives up and has changed nothing.
  const auto third = r.bench.send(dataset_request("POST", "<world/map> { " + large + " } <world/other> { <#z> rdfs:label 3 }"));
  rounds = 0;
  for (auto jobs = r.bench.take_body_jobs(); !jobs.empty(); jobs = r.bench.take_body_jobs()) {
    for (auto& job : jobs) job.run();
    r.map.update([&](GraphUpdate& u) { u.add("#code", label, ++rounds); }).value();
    (void)r.bench.answer(third);
  }
  CHECK(rounds == 5);
  const auto gave_up = r.bench.answer(third);
  CHECK(gave_up->status == 503);
  CHECK(gave_up->field("Retry-After") != "");
  CHECK(r.bench.get("/world/other").status == 404);
  // One graph without a name.
  const auto one = r.bench.send(dataset_request("POST", large));
  r.bench.run();
  CHECK(r.bench.answer(one)->status == 201);
  // Two requests that create the same graph: the second one may try again.
  Store two(creation(), options);
  const auto a = two.bench.send(dataset_request("PUT", "<world/new> { " + large + " }"));
  const auto b = two.bench.send(dataset_request("PUT", "<world/new> { <#b> rdfs:label 1 }"));
  two.bench.run();
  CHECK(two.bench.answer(a)->status + two.bench.answer(b)->status == 204 + 503);
}

TEST_CASE("each graph of a dataset needs the rights that a PUT of it alone would need", "[engine][world][security]") {
  using security::Right, security::Rights, security::View;
  const Rights reads = Right::read, writes = Right::read | Right::write;
  auto targets = std::make_shared<View::Targets>();
  targets->all = {{"/", true, true}, {"/world", true, false}, {"/world/map", true, true}, {"/world/seen", true, true}, {"/world/new", true, true}};
  for (std::size_t i = 0; i < targets->all.size(); ++i) targets->by_path.emplace(targets->all[i].path, i);
  Rights of_map = writes, of_seen = reads, of_new = writes;
  engine::EngineOptions options;
  options.authorize = [&](const http::Request&) {
    engine::Caller caller;
    caller.view = std::make_shared<const View>(
        targets, std::vector<View::Granted>{{reads, reads}, {writes, writes}, {of_map, of_map}, {of_seen, of_seen}, {of_new, of_new}});
    return caller;
  };
  Store r(creation(), options);
  const auto status = [&](const std::string& graphs) {
    const Answer a = r.ask("PUT", graphs);
    if (a.status == 403) CHECK(a.says("these credentials do not"));
    return a.status;
  };
  const std::string map = "<world/map> { <#x> rdfs:label 1 }", seen = "<world/seen> { <#x> rdfs:label 1 }",
                    made = "<world/new> { <#x> rdfs:label 1 }";
  CHECK(status(map) == 204);
  CHECK(status(map + seen) == 403);
  CHECK(r.seen.snapshot()->empty());
  CHECK(r.ask("PUT", map + seen).says("the graph <http://localhost/world/seen>"));
  of_new = reads;
  CHECK(status(map + made) == 403);
  of_new = writes;
  CHECK(status(map + made) == 204);
  CHECK(status(map + "<world/other> { }") == 403);
  // Who may not read at a name cannot create it.
  of_new = Right::write;
  CHECK(status("<world/new/below> { }") == 403);
}

TEST_CASE("the preconditions of a dataset are those of the World", "[engine][world]") {
  Store r;
  const std::string map = "<world/map> { <#x> rdfs:label 1 }";
  const std::string tag = r.bench.get("/world").tag();
  CHECK(r.ask("PUT", map, "If-Match: \"other\"\n").status == 412);
  CHECK(r.ask("PUT", map, "If-None-Match: *\n").status == 412);
  CHECK(r.ask("PUT", map, "If-Match: " + tag + "\n").status == 204);
  CHECK(r.map.snapshot()->size() == 1);
}

// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

constexpr Errc not_refused{255};

enum class Full : unsigned char { slow, fast };
enum class Hole { slow, fast = 5, stopped = 40 };
enum class Counted : int { slow, fast, count };
enum class Unnamed { a };
enum class Twice { a, b };
enum class Alias { a, b };
enum class Empty { a };
enum Old { old_a, old_b };
struct Drive {
  std::vector<Hole> modes;
};

Errc refusal(Bench& bench, Thing thing) {
  const std::string path = "/" + thing.path();
  const std::string root = bench.get("/").body;
  const Result<void> added = bench.engine.add(std::move(thing));
  if (added) {
    CHECK(bench.engine.remove(path.substr(1)));
    return not_refused;
  }
  CHECK(added.error().message.size() > 10);
  CHECK(bench.get("/").body == root);  // nothing is registered
  return added.error().code;
}

}  // namespace

namespace lrt::rdf {
template <>
struct traits<Full> : Enumeration<Full> {
  static void describe(Enumeration& e) { e.name(Full::slow, "slow").name(Full::fast, "fast"); }
};
template <>
struct traits<Hole> : Enumeration<Hole> {
  static void describe(Enumeration& e) { e.name(Hole::slow, "slow").name(Hole::fast, "fast"); }
};
template <>
struct traits<Counted> : Enumeration<Counted> {
  static void describe(Enumeration& e) { e.name(Counted::slow, "slow").name(Counted::fast, "fast").without_name(Counted::count); }
};
template <>
struct traits<Unnamed> : Enumeration<Unnamed> {
  static void describe(Enumeration&) {}
};
template <>
struct traits<Twice> : Enumeration<Twice> {
  static void describe(Enumeration& e) { e.name(Twice::a, "a").name(Twice::b, "a"); }
};
template <>
struct traits<Alias> : Enumeration<Alias> {
  static void describe(Enumeration& e) { e.name(Alias::a, "a").name(Alias::a, "b"); }
};
template <>
struct traits<Empty> : Enumeration<Empty> {
  static void describe(Enumeration& e) { e.name(Empty::a, ""); }
};
template <>
struct traits<Old> : Enumeration<Old> {
  static void describe(Enumeration& e) { e.name(old_a, "a"); }
};
template <>
struct traits<Drive> : Record<Drive> {
  static void describe(Record& r) { r.field("modes", &Drive::modes); }
};
}  // namespace lrt::rdf

TEST_CASE("a path is given once, and a thing that collides registers nothing", "[engine][R0.3]") {
  Bench bench;
  SampleRobot robot;
  bench.add(robot.arm());
  CHECK(refusal(bench, Thing{"arm"}) == Errc::duplicate_path);
  CHECK(refusal(bench, Thing{"arm/angle"}) == Errc::duplicate_path);
  CHECK(refusal(bench, Thing{"ns/lrt"}) == Errc::duplicate_path);
  const auto with = [](auto f) {
    Thing thing{"other"};
    f(thing);
    return thing;
  };
  CHECK(refusal(bench, with([](Thing& t) { t.property<int>("a"), t.property<int>("a"); })) == Errc::duplicate_path);
  CHECK(refusal(bench, with([](Thing& t) { t.property<int>("state"), t.collection<int>("state"); })) == Errc::duplicate_path);
  CHECK(refusal(bench, with([](Thing& t) { t.action("go", [] {}), t.action("go", [] {}); })) == Errc::duplicate_path);
  CHECK(refusal(bench, with([](Thing& t) { t.property<int>("c"), t.collection<int>("c"); })) == Errc::duplicate_path);
  for (const char* path : {"/other", "/other/a", "/other/state", "/other/actions/go", "/other/c"}) CHECK(bench.get(path).status == 404);
  bench.add(Thing{"other"});
  CHECK(bench.get("/other/state").status == 200);
}

TEST_CASE("what is no path, IRI, Turtle or text is refused when the thing is added", "[engine][R0.3][R1.12]") {
  Bench bench;
  for (const char* path : {"", "/", "//arm", "arm/", "a//b", ".", "a/..", "a/./b"}) {
    CAPTURE(path);
    CHECK(refusal(bench, Thing{path}) == Errc::expected_iri);
  }
  const auto with = [](auto f) {
    Thing thing{"other"};
    f(thing);
    return thing;
  };
  const Iri bad{"no iri"}, relative{"relative"}, good{"http://example.org/x"};
  CHECK(refusal(bench, with([&](Thing& t) { t.property<int>(""); })) == Errc::expected_iri);
  CHECK(refusal(bench, with([&](Thing& t) { t.action("..", [] {}); })) == Errc::expected_iri);
  CHECK(refusal(bench, with([&](Thing& t) { t.collection<int>("a//b"); })) == Errc::expected_iri);
  CHECK(refusal(bench, with([&](Thing& t) { t.type(bad); })) == Errc::expected_iri);
  CHECK(refusal(bench, with([&](Thing& t) { t.add(relative, "x"); })) == Errc::expected_iri);
  CHECK(refusal(bench, with([&](Thing& t) { t.add(good, bad); })) == Errc::expected_iri);
  CHECK(refusal(bench, with([&](Thing& t) { t.blueprint(relative); })) == Errc::expected_iri);
  CHECK(refusal(bench, with([&](Thing& t) { t.property<int>("p").predicate(bad); })) == Errc::expected_iri);
  CHECK(refusal(bench, with([&](Thing& t) { t.action("a", [] {}).type(bad); })) == Errc::expected_iri);
  CHECK(refusal(bench, with([&](Thing& t) { t.collection<int>("c").add(good, relative); })) == Errc::expected_iri);
  CHECK(refusal(bench, with([&](Thing& t) { t.add_turtle("<> <http://example.org/x> ] ."); })) == Errc::expected_rdf);
  CHECK(refusal(bench, with([&](Thing& t) { t.add_turtle("<> a x:Undeclared ."); })) == Errc::expected_rdf);
  // What would make a representation that no client can read.
  CHECK(refusal(bench, with([&](Thing& t) { t.add(good, Object::typed("1", relative)); })) == Errc::expected_iri);
  CHECK(refusal(bench, with([&](Thing& t) { t.add(good, Object::resource("a/../b")); })) == Errc::expected_iri);
  CHECK(refusal(bench, with([&](Thing& t) { t.add(good, Object::tagged("x", "no tag")); })) != not_refused);
  CHECK(refusal(bench, with([&](Thing& t) { t.add(good, "\xff\xfe"); })) != not_refused);
  CHECK(refusal(bench, with([&](Thing& t) { t.title("\xff"); })) != not_refused);
  CHECK(refusal(bench, Thing{"\xff"}) != not_refused);
  CHECK(refusal(bench, with([&](Thing& t) { t.property<int>("a\xc3"); })) != not_refused);
  CHECK(refusal(bench, Thing{std::string_view("a\0b", 3)}) != not_refused);
}

TEST_CASE("each enumerator has a name of its own, or the thing is not added", "[engine][R0.3]") {
  Bench bench;
  const auto said = [&](auto value, bool in_action = false) {
    Thing thing{"other"};
    if (in_action) thing.action("go", [value](decltype(value)) { return value; });
    else thing.property("mode", [value] { return value; });
    const Result<void> added = bench.engine.add(std::move(thing));
    if (added) return std::string(bench.engine.remove("other") ? "" : "not removed");
    CHECK(added.error().code == Errc::invalid_option);
    return added.error().message;
  };
  const auto has = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  CHECK(said(Full::slow) == "");
  CHECK(said(Full::slow, true) == "");
  CHECK(said(Counted::slow) == "");
  const std::string hole = said(Hole::slow);
  CHECK(has(hole, "property \"other/mode\": the enumerator "));
  CHECK(has(hole, "Hole::stopped has no name"));
  CHECK(has(said(Hole::slow, true), "action \"other/actions/go\": the enumerator "));
  CHECK(has(said(Drive{}), "field \"modes\": the enumerator "));
  CHECK(has(said(std::optional<Hole>()), "Hole::stopped has no name"));
  CHECK(has(said(Unnamed::a), "no enumerator has a name"));
  CHECK(has(said(Twice::a), "two enumerators have the name \"a\""));
  CHECK(has(said(Alias::a), "one enumerator has the names \"a\" and \"b\""));
  CHECK(has(said(Empty::a), "an empty name"));
  CHECK(said(old_a) == "");  // the compiler does not tell what it has
}

TEST_CASE("a value that is no enumerator is an error, and no hole in a document", "[engine][R0.6]") {
  engine::EngineOptions options;
  std::vector<std::string> log;
  options.log = [&](LogLevel level, std::string_view text) { log.push_back((level == LogLevel::error ? "error: " : "") + std::string(text)); };
  Bench bench(std::move(options));
  Full now = Full::slow;
  Thing thing{"arm"};
  thing.property("mode", [&] { return now; });
  auto pushed = thing.property<std::vector<Full>>("modes");
  thing.action("next", [&] { return now; });
  bench.add(std::move(thing));
  pushed.publish({Full::fast});
  CHECK(bench.ask("GET /arm/mode\nAccept: application/json").body == "\"slow\"");
  CHECK(bench.ask("GET /arm/modes\nAccept: application/json").body == "[\"fast\"]");
  now = static_cast<Full>(9);
  pushed.publish({Full::fast, now});
  const Answer answer = bench.get("/arm/mode");
  CHECK(answer.status == 500);
  CHECK(answer.says("has no name"));
  CHECK(bench.turtle("POST", "/arm/actions/next", "").status == 500);
  const Answer modes = bench.get("/arm/modes");
  CHECK(modes.status == 500);
  CHECK(modes.says("has no name"));
  const auto logged = [&] {
    return std::count(log.begin(), log.end(),
                      "error: property \"/arm/modes\" has no value: an enumerator in the value has no name; "
                      "give it one in the traits of its enum");
  };
  CHECK(logged() == 1);
  pushed.publish({now});
  (void)bench.get("/arm/modes");
  CHECK(logged() == 1);  // once, until it has a value again
  now = Full::fast;
  pushed.publish({now});
  CHECK(bench.ask("GET /arm/modes\nAccept: application/json").body == "[\"fast\"]");
  CHECK(bench.get("/arm/mode").status == 200);
}

TEST_CASE("the first error of a thing is the one that add() returns", "[engine][R0.3]") {
  Bench bench;
  Thing thing{"arm"};
  thing.property<int>("ok");
  thing.property<int>("first//bad");
  thing.action("second//bad", [] {});
  const Result<void> added = bench.engine.add(std::move(thing));
  REQUIRE_FALSE(added);
  CHECK(added.error().message.find("first//bad") != std::string::npos);
}

#ifdef NDEBUG  // else an assertion fails: handle_test.cpp
TEST_CASE("a handle changes nothing once its thing is added", "[engine][R0.3]") {
  Bench bench;
  Thing thing{"arm"};
  auto property = thing.property("p", [] { return 1; });
  auto action = thing.action("a", [] {});
  bench.add(std::move(thing));
  const std::string before = bench.get("/arm").body + bench.get("/arm/p").body + bench.get("/arm/actions/a").body;
  property.type(Iri{"not an iri"}).predicate(Iri{"http://example.org/p"}).on_write([](int) {});
  action.type(Iri{"http://example.org/T"}).policy(ActionPolicy::reject());
  bench.add(Thing{"x/y"});
  CHECK(bench.get("/arm").body + bench.get("/arm/p").body + bench.get("/arm/actions/a").body == before);
  CHECK(bench.turtle("PUT", "/arm/p", number_body("2")).status == 405);
}
#endif

TEST_CASE("things nest by their paths, whatever the order of registration", "[engine][R0.4]") {
  Bench bench;
  bench.add(Thing{"a/b/c/d"});
  bench.add(Thing{"a/b"});
  bench.add(Thing{"a/bb"});
  bench.add(Thing{"a"});
  CHECK(bench.get("/").linked("related") == std::vector<std::string>{"http://localhost/a", "http://localhost/all"});
  const auto parts = [&](const char* path) {
    const std::string self = std::string("http://localhost") + path;
    const rdf::Graph graph = bench.get(path).graph();
    std::set<std::string> all;
    for (const auto& part : graph.objects(rdf::iri(self), vocab::dcterms::hasPart)) all.insert(std::string(part.text.substr(16)));
    return all;
  };
  CHECK(parts("/a") == std::set<std::string>{"/a/b", "/a/bb"});
  CHECK(parts("/a/b") == std::set<std::string>{"/a/b/c/d"});
  REQUIRE(bench.engine.remove("a/b"));  // with what is below
  CHECK(parts("/a") == std::set<std::string>{"/a/bb"});
  CHECK(bench.get("/a/b/c/d").status == 404);
  CHECK(bench.get("/a/bb").status == 200);
}

TEST_CASE("several things are added at once, or none of them", "[engine][R0.3]") {
  Bench bench;
  bench.add(Thing{"a/b/c"});
  const auto batch = [](const char* last) {
    std::vector<Thing> things;
    for (const char* path : {"a", "a/b", "x", last}) things.emplace_back(path);
    return things;
  };
  CHECK(bench.engine.add(batch("x")).error().code == Errc::duplicate_path);
  for (const char* path : {"/a", "/a/b", "/x"}) CHECK(bench.get(path).status == 404);
  CHECK(bench.get("/a/b/c").status == 200);  // what was there before stays, in the root as before
  CHECK(bench.get("/").linked("related") == std::vector<std::string>{"http://localhost/a/b/c", "http://localhost/all"});
  REQUIRE(bench.engine.add(batch("y")));
  for (const char* path : {"/a", "/a/b", "/a/b/c", "/x", "/y"}) CHECK(bench.get(path).status == 200);
  CHECK(missing(bench.get("/a/b"), "<a/b> dcterms:hasPart <a/b/c> .") == "");
  REQUIRE(bench.engine.remove("a"));
  CHECK(bench.get("/a/b/c").status == 404);
  CHECK(bench.engine.add(std::vector<Thing>()));
}

TEST_CASE("remove takes a thing and all its resources away", "[engine][R0.3]") {
  Bench bench;
  SampleRobot robot;
  bench.add(robot.arm());
  bench.add(robot.tool());
  bench.ask("POST /arm/actions/home");
  CHECK(bench.engine.remove("nothing").error().code == Errc::unknown_path);
  CHECK(bench.engine.remove("arm/angle").error().code == Errc::unknown_path);
  REQUIRE(bench.engine.remove("arm"));
  for (const char* path : {"/arm", "/arm/state", "/arm/angle", "/arm/actions/home", "/arm/actions/home/i1", "/arm/waypoints", "/arm/tool"})
    CHECK(bench.get(path).status == 404);
  robot.angle_handle->publish(5);  // inert
  SampleRobot other;
  bench.add(other.arm());
  CHECK(bench.get("/arm/angle").status == 200);
}

TEST_CASE("requests that wait when their thing is removed get a response, and no lambda of it begins any more", "[engine][R0.6][judged_at_once]") {
  Bench bench;
  int calls = 0;
  const auto make = [&] {
    Thing thing{"arm"};
    thing.property("p", [&] { return ++calls; }).on_write([&](int) { ++calls; });
    thing.action("a", [&] { ++calls; });
    thing.collection<int>("c").on_create([&](int) { ++calls; }).on_remove([&](const std::string&) { ++calls; });
    return thing;
  };
  bench.add(make());
  REQUIRE(bench.turtle("POST", "/arm/c", "<> vom:numericalValue 1 .").status == 201);
  calls = 0;
  std::vector<Bench::Sent> sent;
  sent.push_back(bench.send("GET /arm/p"));
  sent.push_back(bench.send("GET /arm/p"));
  sent.push_back(bench.send("GET /arm/state"));
  sent.push_back(bench.send(Bench::turtle_request("PUT", "/arm/p", number_body("1"))));
  sent.push_back(bench.send(Bench::turtle_request("PUT", "/arm/p", number_body("2"), "If-Match: *\n")));
  sent.push_back(bench.send("POST /arm/actions/a"));
  sent.push_back(bench.send("POST /arm/actions/a\nPrefer: wait=9"));
  sent.push_back(bench.send(Bench::turtle_request("POST", "/arm/c", "<> vom:numericalValue 1 .")));
  sent.push_back(bench.send("DELETE /arm/c/i1"));
  REQUIRE(bench.engine.remove("arm"));
  for (std::size_t i = 0; i < sent.size(); ++i) {
    CAPTURE(i);
    const auto answer = bench.answer(sent[i]);
    REQUIRE(answer);
    CHECK(answer->status == 404);
  }
  bench.add(make());  // another one in its place must not hear of them
  bench.run();
  CHECK(calls == 0);
  CHECK(bench.turtle("POST", "/arm/c", "<> vom:numericalValue 1 .").status == 201);
  CHECK(calls == 1);
  CHECK(bench.get("/arm/p").status == 200);
}

TEST_CASE("removing a thing cancels what it is doing", "[engine][R0.5]") {
  Bench bench;
  SampleRobot robot;
  bench.add(robot.arm());
  bench.ask("POST /arm/actions/grip");
  REQUIRE(bench.engine.remove("arm"));
  bench.run();
  CHECK(robot.grips[0].cancelled());
  CHECK(robot.stops == std::vector<std::string>{"grip 0"});
  robot.grips[0].succeed();
  bench.collect();
}

TEST_CASE("a property, an action and a collection may each say where their lambdas run, or else their thing says", "[engine][judged_at_once]") {
  engine::EngineOptions options;
  options.dispatch = Dispatch::executor;
  Bench bench(options);
  Thing thing{"arm"};
  thing.dispatch(Dispatch::in_poll);
  thing.property("p", [] { return 1; }).on_write([](int) {});
  thing.property("quick", [] { return 1; }).on_write([](int) {}).dispatch(Dispatch::io_thread);
  std::optional<Responder> kept;
  thing.action("a", [] {});
  thing
      .action("quick",
              [&](Responder done) {
                done.on_cancel([] {});
                kept = done;
              })
      .policy(ActionPolicy::parallel(4))
      .dispatch(Dispatch::io_thread);
  thing.action("server", [] {}).dispatch(Dispatch::as_server);
  thing.collection<int>("c").on_create([](int) {});
  thing.collection<int>("quick_c").on_create([](int) {}).on_remove([](const std::string&) {}).dispatch(Dispatch::io_thread);
  bench.add(std::move(thing));
  const auto where = [&](const std::string& text) {
    (void)bench.send(text);
    bench.collect();
    std::vector<engine::Job> jobs = bench.take_jobs();
    REQUIRE(jobs.size() == 1);
    jobs[0].run();
    bench.run();
    return jobs[0].where;
  };
  const std::string value = "\nContent-Type: application/json\n\n1";
  CHECK(where("GET /arm/p") == Dispatch::in_poll);
  CHECK(where("PUT /arm/p" + value) == Dispatch::in_poll);
  CHECK(where("GET /arm/quick") == Dispatch::io_thread);
  CHECK(where("PUT /arm/quick" + value) == Dispatch::io_thread);
  CHECK(where("POST /arm/actions/a") == Dispatch::in_poll);
  CHECK(where("POST /arm/actions/quick") == Dispatch::io_thread);
  CHECK(where("DELETE /arm/actions/quick/i2") == Dispatch::io_thread);  // its hook
  CHECK(where("POST /arm/actions/server") == Dispatch::executor);
  CHECK(where("POST /arm/c" + value) == Dispatch::in_poll);
  CHECK(where("POST /arm/quick_c" + value) == Dispatch::io_thread);
  CHECK(where("DELETE /arm/quick_c/i5") == Dispatch::io_thread);
}

TEST_CASE("the lambdas of a Thing that goes are destroyed where the host says", "[engine]") {
  Bench bench;
  const auto owned = std::make_shared<int>(7);
  const auto thing = [&](const std::string& path, double low = 0) {
    Thing made{path};
    made.property("angle", [owned] { return *owned; }).between(low, 1);
    made.action("turn", [owned](double) {});
    return made;
  };
  CHECK(bench.take_discarded().empty());
  bench.add(thing("arm"));
  bench.add(thing("arm/hand"));
  CHECK(bench.take_discarded().empty());
  CHECK(owned.use_count() == 5);

  SECTION("removed, with the Things below it") {
    bench.engine.remove("arm").value();
    CHECK(owned.use_count() == 5);
    auto discarded = bench.take_discarded();
    CHECK(discarded.size() >= 2);
    CHECK(bench.take_discarded().empty());
    CHECK(owned.use_count() == 5);
    discarded.clear();
    CHECK(owned.use_count() == 1);
  }
  SECTION("refused, with those that were given with it") {
    std::vector<Thing> things;
    things.push_back(thing("leg"));
    things.push_back(thing("arm"));
    things.push_back(thing("head"));
    CHECK(bench.engine.add(std::move(things)).error().code == Errc::duplicate_path);
    things.clear();
    CHECK(owned.use_count() == 11);
    auto discarded = bench.take_discarded();
    CHECK(owned.use_count() == 11);
    discarded.clear();
    CHECK(owned.use_count() == 5);
  }
  SECTION("not taken: destroyed by the next add() or remove()") {
    bench.engine.remove("arm/hand").value();
    CHECK(owned.use_count() == 5);
    if (GENERATE(true, false)) bench.add(Thing("leg"));
    else bench.engine.remove("nothing").error();
    CHECK(owned.use_count() == 3);
    CHECK(bench.take_discarded().empty());
  }
}

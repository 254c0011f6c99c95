// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/plain_state.hpp"

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/bench.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"

// A state keeps what can be read (0068).

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;

namespace test {
enum class Gear { low, high };
struct Limit {
  double lower = -1, upper = 1;
};
/// Its traits throw.
struct Torn {
  bool is_torn = false;
};
}  // namespace test

template <>
struct lrt::rdf::traits<::test::Gear> : lrt::rdf::Enumeration<::test::Gear> {
  static void describe(lrt::rdf::Enumeration<::test::Gear>& e) { e.name(::test::Gear::low, "low").name(::test::Gear::high, "high"); }
};
template <>
struct lrt::rdf::traits<::test::Limit> : lrt::rdf::Record<::test::Limit> {
  static void describe(lrt::rdf::Record<::test::Limit>& r) {
    r.field("lower", &::test::Limit::lower).unit(lrt::unit::radian);
    r.field("upper", &::test::Limit::upper).unit(lrt::unit::radian);
  }
};
template <>
struct lrt::rdf::traits<::test::Torn> {
  static const Type& type() noexcept { return traits<bool>::type(); }
  static Value encode(const ::test::Torn& v) {
    if (v.is_torn) throw std::runtime_error("it is torn");
    return traits<bool>::encode(v.is_torn);
  }
  static Result<::test::Torn> decode(const Value& v) {
    Result<bool> is = traits<bool>::decode(v);
    if (!is) return Unexpected{is.error()};
    return ::test::Torn{*is};
  }
  static bool same(const ::test::Torn& a, const ::test::Torn& b) noexcept { return a.is_torn == b.is_torn; }
};

namespace {

struct Odd {};  // no std::exception

/// A Thing with a property of each kind of value; `fails` says what the getter of one does.
struct Arm {
  enum class Way : std::uint8_t { works, throws, throws_number, throws_odd, has_no_value, grows, blocks };

  explicit Arm(engine::EngineOptions options = {}) : bench(std::move(options)) {
    Thing arm{"arm"};
    good = arm.property<double>("good", unit::degree);
    good->publish(10);
    add(arm, "number", 0.5, unit::ampere);
    add(arm, "text", std::string("x"));
    add(arm, "record", ::test::Limit());
    add(arm, "list", std::vector<double>{1, 2});
    add(arm, "maybe", std::optional<double>());
    add(arm, "gear", ::test::Gear::high);
    gear = arm.property<::test::Gear>("pushedGear");
    torn = arm.property<::test::Torn>("pushedTorn");
    bench.add(std::move(arm));
  }
  template <class T>
  void add(Thing& thing, const char* name, T value, const Unit& its_unit = unit::none) {
    names.emplace_back(name);
    thing.property(
        name,
        [this, name = std::string(name), value]() -> T {
          const auto found = fails.find(name);
          switch (found == fails.end() ? Way::works : found->second) {
            case Way::works: return value;
            case Way::throws: throw std::runtime_error("no \xFFvoltage\n" + std::string(400, 'x'));
            case Way::throws_number: throw 7;
            case Way::throws_odd: throw Odd{};
            case Way::has_no_value: return Result<T>(unexpected(Errc::closed, "the bus is closed")).value();
            case Way::blocks: meanwhile(); return value;
            case Way::grows: throw std::runtime_error("attempt " + std::to_string(++attempts));
          }
          return value;
        },
        its_unit);
  }
  Answer get(const std::string& path, const std::string& accept = "text/turtle", const std::string& fields = {}) {
    return bench.ask("GET " + path + "\nAccept: " + accept + "\n" + fields);
  }
  std::string json() { return get("/arm/state", "application/json").body; }
  std::string tag(const std::string& accept = "text/turtle") { return get("/arm/state", accept).tag(); }
  std::string wrong() {
    return violations([&](const std::string& path) { return get(path); }, "/arm");
  }

  std::map<std::string, Way> fails;
  std::vector<std::string> names;
  int attempts = 0;
  std::function<void()> meanwhile;
  std::optional<PushedProperty<double>> good;
  std::optional<PushedProperty<::test::Gear>> gear;
  std::optional<PushedProperty<::test::Torn>> torn;
  Bench bench;
};

rdf::Graph with(const rdf::Graph& graph, std::string_view more) {
  rdf::Graph all = graph;
  all.merge(turtle(more, "http://localhost/"));
  return all;
}

rdf::Graph without(const rdf::Graph& graph, std::string_view subject, Iri predicate) {
  rdf::Graph rest;
  for (const rdf::Triple& t : graph.triples())
    if (graph.term(t.subject).text != subject || graph.term(t.predicate).text != predicate.text)
      rest.add(graph.term(t.subject), graph.term(t.predicate), graph.term(t.object));
  return rest;
}

}  // namespace

TEST_CASE("a getter that fails in any way leaves the other properties in the state, and says why", "[engine][json_ld][rdf_xml][R0.6][R1.11]") {
  Arm arm;
  CHECK(arm.wrong() == "");
  const Arm::Way way = GENERATE(Arm::Way::throws, Arm::Way::throws_number, Arm::Way::throws_odd, Arm::Way::has_no_value);
  for (const std::string& name : arm.names) {
    INFO(name << " " << int(way));
    arm.fails = {{name, way}};
    const Answer state = arm.get("/arm/state");
    REQUIRE(state.status == 200);
    const std::string self = "http://localhost/arm/" + name;
    const rdf::Graph graph = state.graph();
    const auto error = graph.object(rdf::iri(self), vocab::lrt_::error);
    REQUIRE(error);
    const std::string said(error->text);
    CHECK(said.substr(0, 22) == "it could not be read: ");
    CHECK(said.size() < 240);
    CHECK(said.find('\n') == std::string::npos);
    CHECK_FALSE(graph.object(rdf::iri(self), vocab::dcterms::modified));
    CHECK(missing(state, "<arm/good> vom:numericalValue \"10\"^^xsd:double . <arm/" + name + "> a hybrit:Property .") == "");
    CHECK(arm.get("/arm/" + name).status == 500);
    CHECK(arm.wrong() == "");
    // In the others, too.
    for (const char* type : {"application/n-triples", "application/ld+json", "application/rdf+xml"})
      CHECK(isomorphic(arm.get("/arm/state", type).graph(), graph));
    CHECK(arm.json().find("\"@errors\":{\"" + name + "\":\"it could not be read: ") != std::string::npos);
    CHECK(arm.json().find("\"good\":10") != std::string::npos);
    CHECK(arm.get("/arm/state", "application/cbor").body.find("@errors") != std::string::npos);
    CHECK(arm.get("/all", "application/json").body.find("\"@errors\":{\"" + name + "\":") != std::string::npos);
    CHECK(missing(arm.get("/all"), "<arm/" + name + "> lrt:error [] .") == "");
    const Answer head = arm.bench.ask("HEAD /arm/state");
    CHECK(head.status == 200);
    CHECK(head.tag() == state.tag());
    CHECK(arm.get("/arm/state", "text/turtle", "If-None-Match: " + state.tag() + "\n").status == 304);
  }
  for (const std::string& name : arm.names) arm.fails[name] = way;
  CHECK(arm.get("/arm/state").status == 200);
  CHECK(arm.wrong() == "");
}

TEST_CASE("the Blueprint refuses a property with neither value nor error, and one with both", "[engine][R1.11]") {
  Arm arm;
  const rdf::Graph shapes = blueprint_of([&](const std::string& path) { return arm.get(path); }, "/arm");
  const Result<shacl::Shapes> compiled = shacl::Shapes::compile(shapes);
  REQUIRE(compiled);
  const auto conforms = [&](const rdf::Graph& graph) { return shacl::validate(*compiled, graph)->conforms(); };
  const rdf::Graph whole = arm.get("/arm/state").graph();
  CHECK(conforms(whole));
  for (const std::string& name : arm.names) {
    INFO(name);
    const std::string self = "http://localhost/arm/" + name;
    const bool may_be_absent = name == "maybe";
    CHECK(conforms(with(whole, "<arm/" + name + "> lrt:error \"no\" .")) == may_be_absent);
    arm.fails = {{name, Arm::Way::throws}};
    const rdf::Graph failed = arm.get("/arm/state").graph();
    arm.fails.clear();
    CHECK(conforms(failed));
    CHECK(conforms(without(failed, self, vocab::lrt_::error)) == may_be_absent);
    CHECK_FALSE(conforms(with(failed, "<arm/" + name + "> lrt:error \"a second\" .")));
  }
  // What was never published promises nothing.
  CHECK(conforms(with(whole, "<arm/pushedGear> lrt:error \"no\" .")));
  CHECK_FALSE(conforms(with(whole, "<arm/pushedGear> lrt:error \"no\" ; rdf:value \"low\" .")));
}

TEST_CASE("a published value that cannot be represented is an error in the state", "[engine][R0.6]") {
  Arm arm;
  arm.gear->publish(::test::Gear{7});
  CHECK(missing(arm.get("/arm/state"), "<arm/pushedGear> lrt:error [] .") == "");
  CHECK(arm.json().find("\"@errors\":{\"pushedGear\":\"it could not be read: an enumerator") != std::string::npos);
  CHECK(arm.wrong() == "");
  for (int i = 0; i < 2; ++i) CHECK(arm.get("/arm/pushedGear").status == 500);
  arm.gear->publish(::test::Gear::low);
  CHECK(arm.json().find("@errors") == std::string::npos);
  CHECK(arm.json().find("\"pushedGear\":\"low\"") != std::string::npos);

  arm.torn->publish({true});
  CHECK(arm.json().find("\"@errors\":{\"pushedTorn\":\"it could not be read: it threw: it is torn\"}") != std::string::npos);
  CHECK(arm.wrong() == "");
  for (int i = 0; i < 2; ++i) CHECK(arm.get("/arm/pushedTorn").status == 500);
  arm.torn->publish({false});
  CHECK(arm.json().find("@errors") == std::string::npos);
  CHECK(arm.wrong() == "");
}

TEST_CASE("failing and recovering change the entity tag once each, whatever the reasons say", "[engine][R0.11]") {
  Arm arm;
  const std::string whole = arm.tag();
  arm.fails = {{"number", Arm::Way::grows}};
  const std::string failed = arm.tag();
  CHECK(failed != whole);
  for (int i = 0; i < 3; ++i) CHECK(arm.tag() == failed);
  CHECK(arm.get("/arm/state", "text/turtle", "If-None-Match: " + failed + "\n").status == 304);
  arm.fails.clear();
  CHECK(arm.tag() == whole);
  CHECK(arm.get("/arm/state", "text/turtle", "If-None-Match: " + failed + "\n").status == 200);
}

TEST_CASE("subscribers of the state get one message when a property fails, and one when it recovers", "[engine][R0.12]") {
  Arm arm;
  arm.fails = {};
  const std::string queue = GENERATE("", "&queueLength=20");
  const engine::Channel channel = arm.bench.open("/arm/state?accept=application/json" + queue);
  const engine::Channel own = arm.bench.open("/arm/number?accept=application/json" + queue);
  CHECK(arm.bench.messages(channel).size() == 1);
  const auto next = [&] {
    std::vector<std::string> bodies;
    for (int i = 0; i < 3; ++i) {
      arm.bench.clock.advance(milliseconds(100));
      for (const auto& [c, push] : arm.bench.pushes()) {
        CHECK(c != own);
        if (c == channel && push.message) bodies.push_back(*push.message);
      }
    }
    return bodies;
  };
  CHECK(next().empty());
  arm.fails = {{"number", Arm::Way::grows}};
  std::vector<std::string> bodies = next();
  REQUIRE(bodies.size() == 1);
  CHECK(bodies.front() == arm.json());
  CHECK(bodies.front().find("\"@errors\":{\"number\":\"it could not be read: it threw: attempt 1\"}") != std::string::npos);
  arm.fails.clear();
  bodies = next();
  REQUIRE(bodies.size() == 1);
  CHECK(bodies.front() == arm.json());
  CHECK(bodies.front().find("@errors") == std::string::npos);

  // One that begins while a property fails, without a first value.
  Arm failing;
  failing.fails = {{"number", Arm::Way::throws}};
  const auto first = failing.bench.messages(failing.bench.open("/arm/state?accept=application/json" + queue));
  REQUIRE(first.size() == 1);
  CHECK(first.front() == failing.json());
  CHECK(failing.bench.messages(failing.bench.open_stream("/arm/state?accept=application/json" + queue)).size() == 1);
}

TEST_CASE("a property that has recovered with another value is one change, with the new value", "[engine][R0.12]") {
  Bench bench;
  double value = 1;
  bool works = true;
  Thing thing{"arm"};
  thing.property("p", [&] {
    if (!works) throw 7;
    return value;
  });
  bench.add(std::move(thing));
  const engine::Channel channel = bench.open("/arm/state?accept=application/json&queueLength=20");
  const auto next = [&] {
    std::vector<std::string> bodies;
    for (int i = 0; i < 3; ++i) {
      bench.clock.advance(milliseconds(100));
      for (std::string& body : bench.messages(channel)) bodies.push_back(std::move(body));
    }
    return bodies;
  };
  CHECK(bench.messages(channel).size() == 1);
  works = false;
  CHECK(next().size() == 1);
  works = true;
  value = 2;
  CHECK(next() == std::vector<std::string>{R"({"p":2})"});
}

TEST_CASE("a getter that does not return fails after the time of a request, and later requests do not wait for it", "[engine][R0.6]") {
  Arm arm;
  const std::string whole = arm.json();
  arm.fails = {{"number", Arm::Way::blocks}};
  const Bench::Sent first = arm.bench.send("GET /arm/state\nAccept: application/json");
  arm.meanwhile = [&] {
    for (engine::Job& job : arm.bench.take_jobs()) job.run();  // those of other threads
    CHECK_FALSE(arm.bench.answer(first));
    arm.bench.clock.advance(std::chrono::seconds(3));
    const auto late = arm.bench.answer(first);
    REQUIRE(late);
    CHECK(late->status == 200);
    CHECK(late->body.find("\"@errors\":{\"number\":\"it could not be read: the robot's program has not returned it in time\"") != std::string::npos);
    CHECK(late->body.find("\"good\":10") != std::string::npos);
    CHECK(arm.json().find("\"text\":\"x\"") != std::string::npos);  // at once
    CHECK(arm.wrong() == "");
  };
  auto jobs = arm.bench.take_jobs();
  REQUIRE(jobs.size() == arm.names.size());
  for (auto job = jobs.rbegin(); job != jobs.rend(); ++job) job->run();  // the last one blocks
  arm.fails.clear();
  CHECK(arm.json() == whole);
}

TEST_CASE("if the host reads nothing and nothing was published, a state is 503", "[engine][R0.6]") {
  Bench bench;
  Thing thing{"arm"};
  thing.property("a", [] { return 1; });
  thing.property("b", [] { return 2; });
  bench.add(std::move(thing));
  for (int i = 0; i < 2; ++i) {
    const Bench::Sent sent = bench.send("GET /arm/state");
    bench.clock.advance(std::chrono::seconds(3));
    REQUIRE(bench.answer(sent));
    CHECK(bench.answer(sent)->status == 503);
  }
  CHECK(bench.get("/arm/state").status == 200);
}

TEST_CASE("a property named as the errors keeps its name", "[engine][R0.6]") {
  Bench bench;
  Thing thing{"arm"};
  thing.property("@errors", [] { return 1; });
  thing.property("b", []() -> int { throw 7; });
  bench.add(std::move(thing));
  CHECK(bench.ask("GET /arm/state\nAccept: application/json").body ==
        R"({"@errors":1,"@errors-lrt":{"b":"it could not be read: it threw: an exception that is not a std::exception"}})");
}

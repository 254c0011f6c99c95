// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/variant.hpp>

#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/rdf/codec.hpp>

#include "src/rdf/plain.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

struct MoveJ {
  std::vector<double> angles;  // [rad]
  double speed = 0;            // [rad/s]
};
struct MoveL {
  double x = 0, y = 0;  // [m]
};
struct Hold {};
enum class Pace { slow, fast };
using Motion = std::variant<std::monostate, MoveJ, MoveL, Hold>;
using Target = std::variant<double, double, std::string>;
/// Loses its value when it is assigned, if asked to.
struct Fragile {
  Fragile() = default;
  Fragile(const Fragile&) = default;
  Fragile(Fragile&&) { throw std::runtime_error("fragile"); }
  Fragile& operator=(const Fragile&) = default;
  int n = 0;
};
using Weak = std::variant<int, Fragile>;
struct Fixed {
  int n = 1;
};

struct Step {
  std::string name;
  std::optional<Target> to;
  std::vector<Motion> motions;
};

Weak valueless() {
  Weak weak = 1;
  try {
    weak.emplace<Fragile>(Fragile());
  } catch (const std::runtime_error&) {}
  return weak;
}

}  // namespace

namespace lrt::rdf {
template <>
struct traits<MoveJ> : Record<MoveJ> {
  static void describe(Record& r) {
    r.field("angles", &MoveJ::angles).unit(unit::radian).between(-3, 3);
    r.field("speed", &MoveJ::speed).unit(unit::radian_per_second).above(0);
  }
};
template <>
struct traits<MoveL> : Record<MoveL> {
  static void describe(Record& r) {
    r.field("x", &MoveL::x).unit(unit::metre);
    r.field("y", &MoveL::y).unit(unit::metre);
  }
};
template <>
struct traits<Hold> : Record<Hold> {
  static void describe(Record&) {}
};
template <>
struct traits<Pace> : Enumeration<Pace> {
  static void describe(Enumeration& e) { e.name(Pace::slow, "slow").name(Pace::fast, "fast"); }
};
template <>
struct traits<Fragile> : Record<Fragile> {
  static void describe(Record& r) { r.field("n", &Fragile::n); }
};
template <>
struct traits<Fixed> : Record<Fixed> {
  static void describe(Record& r) {
    r.field("n", [](const Fixed& f) { return f.n; });
  }
};
template <>
struct traits<Motion> : Variant<Motion> {
  static void describe(Variant& v) { v.named("Motion"); }
};
template <>
struct traits<Target> : Variant<Target> {
  static void describe(Variant& v) {
    v.named("Target");
    v.alternative<0>("angle").unit(unit::radian).between(-3, 3).title("Angle", "en");
    v.alternative<1>("height").unit(unit::metre);
    v.alternative<std::string>("place").length(1, 8);
  }
};
template <>
struct traits<Step> : Record<Step> {
  static void describe(Record& r) {
    r.field("name", &Step::name);
    r.field("to", &Step::to);
    r.field("motions", &Step::motions);
  }
};
}  // namespace lrt::rdf

namespace {

/// A robot with variants everywhere, and what it got.
struct Robot {
  Motion motion;
  Target target = Target(std::in_place_index<1>, 0.5);
  std::optional<Target> maybe;
  std::vector<Motion> plan;
  std::map<std::string, Target> named;
  std::variant<Motion, Pace> nested = Pace::fast;
  std::variant<bool, int, double, std::string, Pace> basic = 1;
  Step step;
  std::vector<std::string> done;
  std::optional<PushedProperty<Target>> pushed;
  std::optional<PushedProperty<Weak>> weak;
  bool is_valueless = false;
  Bench bench;

  Robot() {
    Thing arm{"arm"};
    const auto add = [&](const char* name, auto& value) {
      using T = std::decay_t<decltype(value)>;
      arm.property(name, [&value] { return value; }).on_write([&value](const T& wanted) { value = wanted; });
    };
    add("motion", motion), add("target", target), add("maybe", maybe), add("plan", plan), add("named", named), add("basic", basic), add("step", step);
    pushed = arm.property<Target>("pushed");
    weak = arm.property<Weak>("weak");
    arm.property("broken", [this] { return is_valueless ? valueless() : Weak(1); });
    arm.action("move", [this](const Motion& m) -> Motion {
      done.push_back(std::to_string(m.index()));
      return m;
    });
    arm.action("lose", [] { return valueless(); });
    arm.collection<Target>("targets");
    bench.add(std::move(arm));
  }
  Answer get(const std::string& path, const std::string& accept = "application/json") { return bench.ask("GET " + path + "\nAccept: " + accept); }
  Answer send(const std::string& method, const std::string& path, const std::string& type, const std::string& body) {
    return bench.ask(method + " " + path + "\nContent-Type: " + type + "\nAccept: application/problem+json\n\n" + body);
  }
  Answer put(const std::string& name, const std::string& body) { return send("PUT", "/arm/" + name, "application/json", body); }
};

bool has(const Answer& a, const std::string& text) { return a.body.find(text) != std::string::npos; }

}  // namespace

TEST_CASE("a variant has the member of its active alternative in JSON, CBOR and RDF", "[engine][variant]") {
  Robot r;
  CHECK(r.get("/arm/motion").body == R"({"none":{}})");
  CHECK(r.get("/arm/target").body == R"({"height":0.5})");
  CHECK(r.get("/arm/target", "application/json;profile=\"https://w3id.org/lrt/ns#withUnits\"").body == R"({"height":{"value":0.5,"unit":"m"}})");
  CHECK(r.get("/arm/target", "text/plain").body == R"({"height":0.5})");
  CHECK(r.get("/arm/target", "application/cbor").body == std::string("\xA1\x66height\xFB\x3F\xE0\0\0\0\0\0\0", 17));
  CHECK(r.get("/arm/maybe").body == "null");
  r.motion = MoveJ{{1, 2}, 0.5};
  CHECK(r.get("/arm/motion").body == R"({"moveJ":{"angles":[1,2],"speed":0.5}})");
  const std::string turtle = r.get("/arm/motion", "text/turtle").body;
  CHECK(turtle.find("Motion") != std::string::npos);
  CHECK(turtle.find("/moveJ>") != std::string::npos);
  CHECK(turtle.find("moveL") == std::string::npos);
  r.plan = {Hold{}, MoveL{1, 2}, {}};
  CHECK(r.get("/arm/plan").body == R"([{"hold":{}},{"moveL":{"x":1,"y":2}},{"none":{}}])");
  r.named = {{"a", Target(std::in_place_index<0>, 1)}, {"b", Target("there")}};
  CHECK(r.get("/arm/named").body == R"({"a":{"angle":1},"b":{"place":"there"}})");
  CHECK(r.get("/arm/basic").body == R"({"integer":1})");
  r.basic = Pace::fast;
  CHECK(r.get("/arm/basic").body == R"({"pace":"fast"})");
}

TEST_CASE("what is written is exactly one alternative, in each format", "[engine][variant][json_ld]") {
  Robot r;
  CHECK(r.put("motion", R"({"moveL":{"x":1,"y":2}})").status == 204);
  REQUIRE(std::get_if<MoveL>(&r.motion));
  CHECK(std::get<MoveL>(r.motion).y == 2);
  CHECK(r.put("motion", R"({"hold":{}})").status == 204);
  CHECK(r.motion.index() == 3);
  CHECK(r.put("motion", R"({"none":{},"moveJ":null})").status == 204);
  CHECK(r.motion.index() == 0);
  CHECK(r.put("target", R"({"angle":1.5})").status == 204);
  CHECK(r.target.index() == 0);
  CHECK(r.put("target", R"({"angle":{"value":2,"unit":"rad"}})").status == 204);
  CHECK(std::get<0>(r.target) == 2);
  CHECK(r.put("maybe", R"({"place":"x"})").status == 204);
  CHECK(r.maybe);
  CHECK(r.put("maybe", "null").status == 204);
  CHECK_FALSE(r.maybe);
  CHECK(r.put("step", R"({"name":"s","to":{"height":1},"motions":[{"hold":{}},{"moveL":{"x":1,"y":1}}]})").status == 204);
  CHECK(r.step.motions.size() == 2);
  CHECK(r.put("basic", R"({"boolean":true})").status == 204);
  CHECK(r.basic.index() == 0);
  CHECK(r.put("basic", R"({"pace":"slow"})").status == 204);
  // Each value comes back as it was sent, in each format.
  r.motion = MoveJ{{1, 2}, 0.5};
  r.plan = {Hold{}, MoveL{1, 2}, {}, MoveJ{{}, 1}};
  r.maybe = Target(std::in_place_index<1>, 3);
  r.named = {{"a", Target(std::in_place_index<0>, 1)}, {"b", Target("there")}};
  for (const char* name : {"motion", "plan", "maybe", "named", "target", "basic"})
    for (const char* type : {"application/json", "application/cbor", "text/turtle", "application/n-triples", "application/ld+json", "text/plain"}) {
      CAPTURE(name, type);
      const std::string path = std::string("/arm/") + name;
      const Answer before = r.get(path, type);
      REQUIRE(before.status == 200);
      const Answer done = r.send("PUT", path, type, before.body);
      CAPTURE(done.body, before.body);
      CHECK(done.status == 204);
      CHECK(r.get(path, "application/json").body == r.get(path, "application/json").body);
    }
  CHECK(r.get("/arm/plan").body == R"([{"hold":{}},{"moveL":{"x":1,"y":2}},{"none":{}},{"moveJ":{"angles":[],"speed":1}}])");
}

TEST_CASE("no alternative and several are refused, with their names and the place", "[engine][variant]") {
  Robot r;
  const auto refused = [&](const std::string& name, const std::string& body, const std::string& message, const std::string& pointer) {
    const Answer a = r.put(name, body);
    CAPTURE(body, a.body);
    CHECK(a.status == 422);
    CHECK(has(a, message));
    CHECK(has(a, "\"pointer\":\"#" + pointer + "\""));
  };
  const std::string of_motion = "expected exactly one of none, moveJ, moveL, hold; found ";
  const std::string of_target = "expected exactly one of angle, height, place; found ";
  refused("motion", "{}", of_motion + "none", "");
  refused("motion", R"({"moveL":{"x":1,"y":1},"hold":{}})", of_motion + "moveL and hold", "");
  refused("target", R"({"angle":1,"height":1,"place":"x"})", of_target + "angle and height and place", "");
  refused("target", R"({"angle":null})", of_target + "none", "");
  refused("maybe", "{}", of_target + "none", "");
  refused("maybe", R"({"angle":1,"height":1})", of_target + "angle and height", "");
  refused("step", R"({"name":"s","to":{},"motions":[]})", of_target + "none", "/to");
  refused("step", R"({"name":"s","to":{"angle":1,"place":"x"},"motions":[]})", of_target + "angle and place", "/to");
  refused("step", R"({"name":"s","motions":[{"hold":{}},{"hold":{},"none":{}}]})", of_motion + "none and hold", "/motions/1");
  refused("plan", R"([{"hold":{}},{}])", of_motion + "none", "/1");
  refused("named", R"({"a":{"angle":1},"b":{}})", of_target + "none", "/b");
  // A name that is not known, and what is wrong within an alternative.
  refused("motion", R"({"moveC":{}})", R"(expected one of \"none\", \"moveJ\", \"moveL\", \"hold\", found \"moveC\")", "/moveC");
  refused("motion", R"({"moveL":{"x":1}})", "expected", "/moveL/y");
  refused("motion", R"({"moveJ":{"angles":[1,4],"speed":1}})", "expected", "/moveJ/angles/1");
  refused("target", R"({"angle":4})", "3", "/angle");
  refused("target", R"({"place":""})", "expected", "/place");
  refused("motion", R"({"hold":1})", "found 1", "/hold");
  refused("motion", R"("moveL")", "expected an object", "");
  CHECK(r.motion.index() == 0);
  CHECK(r.target.index() == 1);
}

TEST_CASE("RDF with no alternative or with several is refused, and other triples change nothing", "[engine][variant][json_ld]") {
  Robot r;
  const std::string v = "http://localhost/ns/vocabulary#Target/";
  const auto put = [&](const std::string& body) { return r.send("PUT", "/arm/target", "text/turtle", body); };
  CHECK(put("<> <" + v + "place> \"a\" .").status == 204);
  CHECK(r.target.index() == 2);
  CHECK(put("<> <" + v + "place> \"b\" ; <urn:example:other> 1 .").status == 204);
  const std::string message = "expected exactly one of angle, height, place; found ";
  const auto both = put("<> <" + v + "place> \"a\" ; <" + v +
                        "height> [ <http://vocab.arvida.de/2015/06/vom/vocab#numericalValue> 1e0 ; <http://qudt.org/schema/qudt/hasUnit> "
                        "<http://qudt.org/vocab/unit/M> ] .");
  CHECK(both.status == 422);
  CHECK(has(both, message + "height and place"));
  const auto none = put("<> a <http://localhost/ns/vocabulary#Target> .");
  CHECK(none.status == 422);
  CHECK(has(none, message + "none"));
  CHECK(put("<> <" + v + "place> \"a\", \"c\" .").status == 422);  // one alternative, two values
  CHECK(put("<> <" + v + "other> \"a\" .").status == 422);
  const Answer n_triples = r.send("PUT", "/arm/target", "application/n-triples", "<http://localhost/arm/target> <" + v + "place> \"n\" .\n");
  CHECK(n_triples.status == 204);
  const Answer two =
      r.send("PUT", "/arm/target", "application/ld+json", "{\"" + v + "place\":\"a\",\"" + v + "angle\":{\"@id\":\"_:b\"},\"@id\":\"\"}");
  CHECK(two.status == 422);
  CHECK(has(two, message + "angle and place"));
  CHECK(std::get<std::string>(r.target) == "n");
  // A violation is reported by the shape too.
  const Answer report =
      r.bench.ask("PUT /arm/target\nContent-Type: text/turtle\nAccept: text/turtle\n\n<> a <http://localhost/ns/vocabulary#Target> .");
  CHECK(report.status == 422);
  CHECK(has(report, "XoneConstraintComponent"));
}

TEST_CASE("a variant is the input and the output of an action, and a member of a collection", "[engine][variant]") {
  Robot r;
  const Answer done = r.send("POST", "/arm/actions/move", "application/json", R"({"moveL":{"x":1,"y":2}})");
  CHECK(done.status == 200);
  CHECK(r.done == std::vector<std::string>{"2"});
  CHECK(has(done, "#Motion/moveL> "));
  const Answer refused = r.send("POST", "/arm/actions/move", "application/json", R"({"moveL":{"x":1,"y":2},"none":{}})");
  CHECK(refused.status == 422);
  CHECK(has(refused, "found none and moveL"));
  CHECK(r.done.size() == 1);
}

TEST_CASE("a variant without a value is an error of the robot", "[engine][variant]") {
  Robot r;
  REQUIRE(valueless().valueless_by_exception());
  CHECK(r.get("/arm/broken").body == R"({"integer":1})");
  r.is_valueless = true;
  r.bench.clock.advance(std::chrono::seconds(1));
  CHECK(r.get("/arm/broken").status == 500);
  CHECK(has(r.get("/arm/broken"), "valueless"));
  r.weak->publish(Weak(4));
  r.bench.look();
  CHECK(r.get("/arm/weak").body == R"({"integer":4})");
  r.weak->publish(valueless());
  r.bench.look();
  CHECK(r.get("/arm/weak").status == 500);
  CHECK(has(r.get("/arm/weak"), "valueless"));
  const Answer lost = r.send("POST", "/arm/actions/lose", "application/json", "");
  CHECK(lost.status == 500);
  CHECK(has(lost, "valueless"));
}

TEST_CASE("a variant that clients cannot send, or whose alternatives have one name, is refused when the thing is added", "[engine][variant]") {
  Bench bench;
  const auto refusal = [&](Thing thing) {
    const Result<void> added = bench.engine.add(std::move(thing));
    return added ? std::string("none") : added.error().message;
  };
  Thing fixed{"fixed"}, twice{"twice"}, nested{"nested"};
  fixed.property("v", [] { return std::variant<Fixed, bool>(true); }).on_write([](const std::variant<Fixed, bool>&) {});
  CHECK(refusal(std::move(fixed)).find("its field \"fixed/n\" is read-only") != std::string::npos);
  twice.property("v", [] { return std::vector<std::variant<int, long>>(); });
  CHECK(refusal(std::move(twice)).find("the alternatives 0 and 1 of a variant have the same name \"integer\"") != std::string::npos);
  nested.action("go", [](const std::variant<bool, std::variant<int, long>>&) {});
  CHECK(refusal(std::move(nested)).find("the alternative 1 of a variant has no name") != std::string::npos);
  Thing shown{"shown"};
  shown.property("v", [] { return std::variant<Fixed, bool>(Fixed()); });
  CHECK(refusal(std::move(shown)) == "none");
  CHECK(bench.ask("GET /shown/v\nAccept: application/json").body == R"({"fixed":{"n":1}})");
}

TEST_CASE("watchers are told of another alternative", "[engine][variant]") {
  Robot r;
  r.pushed->publish(Target(std::in_place_index<0>, 1));
  r.bench.look();
  const engine::Channel channel = r.bench.open("/arm/pushed", "Accept: application/json\n");
  CHECK(r.bench.messages(channel) == std::vector<std::string>{R"({"angle":1})"});
  r.pushed->publish(Target(std::in_place_index<1>, 1));  // the same number, another alternative
  r.bench.look();
  CHECK(r.bench.messages(channel) == std::vector<std::string>{R"({"height":1})"});
  r.pushed->publish(Target(std::in_place_index<1>, 1));
  r.bench.look();
  CHECK(r.bench.messages(channel).empty());
}

TEST_CASE("the schema of a variant has an object for each alternative", "[engine][variant]") {
  Robot r;
  const std::string overview = r.get("/arm").body;
  CHECK(overview.find(R"("oneOf":[{"type":"object","properties":{"angle":{"type":"number","minimum":-3,"maximum":3,"unit":"rad","title":"Angle"}},)"
                      R"("required":["angle"],"additionalProperties":false})") != std::string::npos);
  CHECK(overview.find(R"(,{"type":"null"}]})") != std::string::npos);
}

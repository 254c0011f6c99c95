// SPDX-License-Identifier: Apache-2.0
// Classes as they are, seen by clients: maps, optional records, views of text, read-only fields.
#include <lrt/engine/engine.hpp>

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using test::Answer;
using test::Bench;

namespace classes_test {
struct Limits {
  std::optional<double> speed, force;
};
class Axis {
 public:
  double target() const { return target_; }
  Result<void> set_target(double v) {
    if (v > 10) return refused("beyond the end stop");
    target_ = v;
    return {};
  }
  double twice() const { return 2 * target_; }
  char label[4] = "x";

 private:
  double target_ = 1;
};
struct Reading : Axis {};
struct Nested {
  std::map<std::string, std::vector<Reading>> all;
};
}  // namespace classes_test

using classes_test::Axis;
using classes_test::Nested;
using classes_test::Reading;

template <>
struct lrt::rdf::traits<classes_test::Limits> : Record<classes_test::Limits> {
  static void describe(Record<classes_test::Limits>& r) {
    r.is(Iri{"http://example.org/Limits"});
    r.field("speed", &classes_test::Limits::speed);
    r.field("force", &classes_test::Limits::force);
  }
};
template <>
struct lrt::rdf::traits<Axis> : Record<Axis> {
  static void describe(Record<Axis>& r) {
    r.field("target", &Axis::target, &Axis::set_target);
    r.field("label", &Axis::label);
  }
};
template <>
struct lrt::rdf::traits<Reading> : Record<Reading> {
  static void describe(Record<Reading>& r) { r.field("twice", &Reading::twice); }
};
template <>
struct lrt::rdf::traits<Nested> : Record<Nested> {
  static void describe(Record<Nested>& r) { r.field("all", &Nested::all); }
};

namespace {
Answer send(Bench& bench, const char* method, const std::string& path, const std::string& body, const char* type = "application/json") {
  return bench.ask(std::string(method) + " " + path + "\nContent-Type: " + type + "\n\n" + body);
}
Answer get(Bench& bench, const std::string& path, const char* accept = "application/json") {
  return bench.ask("GET " + path + "\nAccept: " + accept);
}
}  // namespace

TEST_CASE("a map is read and written by clients, in JSON and in RDF", "[engine][R1.2]") {
  Bench bench;
  std::map<std::string, double> gains{{"p", 1}, {"i", 0.5}};
  Thing thing{"arm"};
  thing.property("gains", [&] { return gains; }).at_least(0).on_write([&](const std::map<std::string, double>& g) { gains = g; });
  bench.add(std::move(thing));
  CHECK(get(bench, "/arm/gains").body == R"({"i":0.5,"p":1})");
  const std::string turtle = get(bench, "/arm/gains", "text/turtle").body;
  CHECK(turtle.find("<http://schema.org/name> \"i\"") != std::string::npos);
  CHECK(send(bench, "PUT", "/arm/gains", R"({"d": 2})").status == 204);
  CHECK(gains == std::map<std::string, double>{{"d", 2}});
  CHECK(send(bench, "PUT", "/arm/gains", turtle, "text/turtle").status == 204);  // what GET gave
  CHECK(gains == std::map<std::string, double>{{"p", 1}, {"i", 0.5}});
  CHECK(send(bench, "PUT", "/arm/gains", "{}").status == 204);
  CHECK(gains.empty());
  CHECK(get(bench, "/arm/gains").body == "{}");
  CHECK(send(bench, "PUT", "/arm/gains", R"({"d": -2})").status == 422);
  const Answer refused = send(bench, "PUT", "/arm/gains", R"({"d": "high"})");
  CHECK(refused.status == 422);
  CHECK(refused.body.find(R"("pointer":"#/d")") != std::string::npos);
  CHECK(send(bench, "PUT", "/arm/gains", "[1]").status == 422);
  CHECK(send(bench, "PUT", "/arm/gains", R"(<> <http://www.w3.org/1999/02/22-rdf-syntax-ns#value> (
      [ <http://schema.org/name> "a" ; <http://schema.org/value> 1 ] [ <http://schema.org/name> "a" ; <http://schema.org/value> 2 ] ) .)",
             "text/turtle")
            .status == 422);
  CHECK(gains.empty());
  CHECK(get(bench, "/arm").status == 200);
  CHECK(get(bench, "/arm/blueprint", "text/turtle").status == 200);
}

TEST_CASE("an optional record without members is told from an absent one, in JSON and in RDF", "[engine][R1.2]") {
  Bench bench;
  std::optional<classes_test::Limits> limits;
  std::optional<classes_test::Limits> given;
  Thing thing{"arm"};
  thing.property("limits", [&] { return limits; }).on_write([&](const std::optional<classes_test::Limits>& l) { limits = l; });
  thing.action("move", [&](const std::optional<classes_test::Limits>& l) { given = l; });
  bench.add(std::move(thing));
  CHECK(get(bench, "/arm/limits").body == "null");
  const std::string absent = get(bench, "/arm/limits", "text/turtle").body;
  CHECK(send(bench, "PUT", "/arm/limits", "{}").status == 204);
  REQUIRE(limits.has_value());
  CHECK_FALSE(limits->speed);
  CHECK(get(bench, "/arm/limits").body == "{}");
  const std::string present = get(bench, "/arm/limits", "text/turtle").body;
  CHECK(present.find("rdfs:Resource") != std::string::npos);
  CHECK(send(bench, "PUT", "/arm/limits", absent, "text/turtle").status == 204);
  CHECK_FALSE(limits.has_value());
  CHECK(send(bench, "PUT", "/arm/limits", present, "text/turtle").status == 204);
  CHECK(limits.has_value());
  CHECK(send(bench, "PUT", "/arm/limits", "null").status == 204);
  CHECK_FALSE(limits.has_value());
  CHECK(send(bench, "PUT", "/arm/limits", R"({"speed": 2})").status == 204);
  CHECK(limits->speed == 2.0);
  CHECK(send(bench, "POST", "/arm/actions/move", "{}").status / 100 == 2);
  CHECK(given.has_value());
  CHECK(send(bench, "POST", "/arm/actions/move", "null").status / 100 == 2);
  CHECK_FALSE(given.has_value());
}

TEST_CASE("the setter of a field may refuse, and a text that does not fit its array is refused", "[engine][R0.5]") {
  Bench bench;
  Axis axis;
  Thing thing{"arm"};
  thing.property("axis", [&] { return axis; }).on_write([&](const Axis& a) { axis = a; });
  bench.add(std::move(thing));
  CHECK(get(bench, "/arm/axis").body == R"({"target":1,"label":"x"})");
  CHECK(send(bench, "PUT", "/arm/axis", R"({"target":5,"label":"abc"})").status == 204);
  CHECK(axis.target() == 5);
  CHECK(std::string(axis.label) == "abc");
  const Answer refused = send(bench, "PUT", "/arm/axis", R"({"target":11,"label":"abc"})");
  CHECK(refused.status == 409);
  CHECK(refused.body.find("beyond the end stop") != std::string::npos);
  CHECK(send(bench, "PUT", "/arm/axis", R"({"target":1,"label":"abcd"})").status == 422);
  CHECK(send(bench, "PUT", "/arm/axis", "{\"target\":1,\"label\":\"\u00e4\u00e4\"}").status == 422);  // 4 bytes
  CHECK(axis.target() == 5);
}

TEST_CASE("an action may take its text as a view", "[engine][R0.5]") {
  Bench bench;
  std::string heard;
  Thing thing{"arm"};
  thing.action("talk", [&](std::string_view text) { heard = text; });
  thing.action("sing", [&](const char* text) { heard = std::string("la ") + text; });
  thing.property<std::string>("name").on_write([&](std::string_view text) { heard = text; });
  bench.add(std::move(thing));
  CHECK(send(bench, "POST", "/arm/actions/talk", "\"a text that is too long for the inside of a string\"").status / 100 == 2);
  CHECK(heard == "a text that is too long for the inside of a string");
  CHECK(send(bench, "POST", "/arm/actions/sing", "\"low\"").status / 100 == 2);
  CHECK(heard == "la low");
  CHECK(send(bench, "PUT", "/arm/name", "\"new\"").status == 204);
  CHECK(heard == "new");
}

TEST_CASE("a value with a read-only field cannot be an input: add names the field", "[engine]") {
  const auto refusal = [](auto describe) {
    engine::Engine engine;
    Thing thing{"arm"};
    describe(thing);
    const Result<void> added = engine.add(std::move(thing));
    return added ? std::string() : added.error().message;
  };
  CHECK(refusal([](Thing& t) { t.property("r", [] { return Reading(); }); }) == "");
  CHECK(refusal([](Thing& t) { t.action("a", [] { return Nested(); }); }) == "");
  CHECK(refusal([](Thing& t) { t.collection<Reading>("c"); }) == "");
  CHECK(refusal([](Thing& t) { t.property("r", [] { return Reading(); }).on_write([](const Reading&) {}); }) ==
        "property \"arm/r\": clients cannot send it, because its field \"twice\" is read-only; give the field a setter");
  CHECK(refusal([](Thing& t) { t.action("a", [](const Nested&) {}); }) ==
        "the input of action \"arm/actions/a\": clients cannot send it, because its field \"all/twice\" is read-only; give the field a setter");
  CHECK(refusal([](Thing& t) { t.collection<std::optional<Reading>>("c").on_create([](const std::optional<Reading>&) {}); }) ==
        "collection \"arm/c\": clients cannot send it, because its field \"twice\" is read-only; give the field a setter");
}

// SPDX-License-Identifier: Apache-2.0
#include "src/engine/body_errors.hpp"

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <lrt/engine/engine.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

enum class Gait { walk, trot };

struct Motion {
  double speed = 0;
  std::int32_t steps = 0;
  bool backwards = false;
  Gait gait = Gait::walk;
  std::string label;
  std::array<double, 3> axis{};
  std::chrono::milliseconds pause{};
  std::chrono::system_clock::time_point start;
  std::optional<double> tolerance;
};

struct Plan {
  Motion motion;
  std::vector<std::vector<double>> rows;
};

struct Slots {
  std::string name;
  std::vector<double> any;
  std::array<double, 2> two{};
  std::array<double, 3> three{};
};

}  // namespace

template <>
struct lrt::rdf::traits<Gait> : lrt::rdf::Enumeration<Gait> {
  static void describe(Enumeration<Gait>& e) { e.name(Gait::walk, "walk").name(Gait::trot, "trot"); }
};

template <>
struct lrt::rdf::traits<Motion> : lrt::rdf::Record<Motion> {
  static void describe(Record<Motion>& r) {
    r.field("speed", &Motion::speed).unit(unit::metre).between(0, 1.5);
    r.field("steps", &Motion::steps);
    r.field("backwards", &Motion::backwards);
    r.field("gait", &Motion::gait);
    r.field("label", &Motion::label).length(2, 4);
    r.field("axis", &Motion::axis);
    r.field("pause", &Motion::pause);
    r.field("start", &Motion::start);
    r.field("tolerance", &Motion::tolerance).above(0);
  }
};

template <>
struct lrt::rdf::traits<Plan> : lrt::rdf::Record<Plan> {
  static void describe(Record<Plan>& r) {
    r.field("motion", &Plan::motion);
    r.field("rows", &Plan::rows);
  }
};

template <>
struct lrt::rdf::traits<Slots> : lrt::rdf::Record<Slots> {
  static void describe(Record<Slots>& r) {
    r.field("name", &Slots::name);
    r.field("any", &Slots::any);
    r.field("two", &Slots::two);
    r.field("three", &Slots::three).unit(unit::metre);
  }
};

namespace {

const std::string good =
    R"("speed":1,"steps":2,"backwards":true,"gait":"trot","label":"abc","axis":[0,0,1],"pause":"PT1S","start":"2026-11-21T10:38:39Z")";

struct Robot {
  Robot() {
    Thing thing{"dog"};
    thing.action("move", [this](const Motion&) { ++calls; });
    thing.action("plan", [this](const Plan&) { ++calls; });
    thing.action("place", [this](const Slots&) { ++calls; });
    thing.action("load", [this](const std::map<std::string, float>&) { ++calls; });
    thing.action("turn", [this](double) { ++calls; }).consumes(Facets{unit::degree}.at_least(0).below(360));
    thing.action("count", [this](std::uint8_t) { ++calls; });
    thing.action("lift", [this](float) { ++calls; });
    thing.action("wait", [this](std::optional<double>) { ++calls; }).consumes(Facets{}.unit(unit::second).at_most(5));
    thing.action("trim", [this](std::vector<double>) { ++calls; }).consumes(Facets{}.at_most(1));
    bench.add(std::move(thing));
  }
  Answer post(const std::string& action, const std::string& body, const std::string& fields = {}) {
    return bench.ask("POST /dog/actions/" + action + "\nContent-Type: application/json\n" + fields + "\n" + body);
  }
  /// The member `errors` of the response.
  std::string errors(const std::string& action, const std::string& body) {
    const Answer a = post(action, body);
    CHECK(a.status == 422);
    CHECK(a.field("Content-Type") == "application/problem+json");
    const std::size_t at = a.body.find("\"errors\":");
    return at == std::string::npos ? a.body : a.body.substr(at + 9, a.body.size() - at - 10);
  }
  int calls = 0;
  Bench bench;
};

std::string error(const std::string& pointer, const std::string& detail, const std::string& value, const std::string& component) {
  std::string text = R"({"detail":")" + detail + R"(","pointer":"#)" + pointer + "\"";
  if (!value.empty()) text += ",\"value\":" + value;
  return text + R"(,"constraint":"sh:)" + component + R"(ConstraintComponent"})";
}

}  // namespace

TEST_CASE("a value of the wrong kind is named with what belongs there", "[engine][R0.6]") {
  Robot r;
  CHECK(r.errors("turn", "\"abc\"") == "[" + error("", "expected a number, found \\\"abc\\\"", "\"abc\"", "Datatype") + "]");
  CHECK(r.errors("turn", "360") == "[" + error("", "expected less than 360, found 360", "360", "MaxExclusive") + "]");
  CHECK(r.errors("turn", "-1") == "[" + error("", "expected at least 0, found -1", "-1", "MinInclusive") + "]");
  CHECK(r.errors("turn", "true") == "[" + error("", "expected a number, found true", "true", "Datatype") + "]");
  CHECK(r.errors("turn", "null") == "[" + error("", "expected a number, found none", "", "MinCount") + "]");
  CHECK(r.errors("lift", "\"NaN\"") == "[" + error("", "expected a finite number, found NaN", "\"NaN\"", "Pattern") + "]");
  CHECK(r.errors("lift", "1e39") == R"([{"detail":"expected a number that a float of 32 bits can hold, found 1e39","pointer":"#"}])");
  CHECK(r.errors("count", "256") == "[" + error("", "expected an integer from 0 to 255, found 256", "256", "Datatype") + "]");
  CHECK(r.errors("count", "1.5") == "[" + error("", "expected an integer from 0 to 255, found 1.5", "1.5", "Datatype") + "]");
  CHECK(r.errors("count", "\"five\"") == "[" + error("", "expected an integer from 0 to 255, found \\\"five\\\"", "\"five\"", "Datatype") + "]");
  CHECK(r.errors("trim", "[0,2]") == "[" + error("/1", "expected at most 1, found 2", "2", "MaxInclusive") + "]");
  CHECK(r.errors("trim", "\"abc\"") == "[" + error("", "expected a list, found \\\"abc\\\"", "\"abc\"", "HasValue") + "]");
  CHECK(r.errors("wait", "\"abc\"") == "[" + error("", "expected a number, found \\\"abc\\\"", "", "Or") + "]");
  CHECK(r.errors("wait", "6") == "[" + error("", "expected at most 5, found 6", "", "Or") + "]");
  CHECK(r.calls == 0);
}

TEST_CASE("a field is named by the name that JSON has, whether it is wrong, missing or unknown", "[engine][R0.6]") {
  Robot r;
  CHECK(r.post("move", "{" + good + "}").status == 204);
  const auto with = [&](const std::string& field, const std::string& value) {
    const std::size_t at = good.find("\"" + field + "\":");
    std::size_t end = at + field.size() + 3;
    for (int open = 0; end < good.size() && (open > 0 || good[end] != ','); ++end) open += good[end] == '[' ? 1 : good[end] == ']' ? -1 : 0;
    return "{" + good.substr(0, at) + "\"" + field + "\":" + value + good.substr(end) + "}";
  };
  const auto only = [](const std::string& one) { return "[" + one + "]"; };
  CHECK(r.errors("move", with("speed", "\"abc\"")) == only(error("/speed", "expected a number, found \\\"abc\\\"", "\"abc\"", "Datatype")));
  CHECK(r.errors("move", with("speed", "\"\"")) == only(error("/speed", "expected a number, found \\\"\\\"", "\"\"", "Datatype")));
  CHECK(r.errors("move", with("speed", "2")) == only(error("/speed", "expected at most 1.5, found 2", "2", "MaxInclusive")));
  CHECK(r.errors("move", with("speed", "null")) == only(error("/speed", "expected a number for \\\"speed\\\", found none", "", "MinCount")));
  CHECK(r.errors("move", with("steps", "1.5")) ==
        only(error("/steps", "expected an integer from -2147483648 to 2147483647, found 1.5", "1.5", "Datatype")));
  CHECK(r.errors("move", with("backwards", "1")) == only(error("/backwards", "expected true or false, found 1", "1", "Datatype")));
  CHECK(r.errors("move", with("gait", "\"run\"")) ==
        only(error("/gait", "expected one of \\\"walk\\\", \\\"trot\\\", found \\\"run\\\"", "\"run\"", "In")));
  CHECK(r.errors("move", with("label", "5")) == only(error("/label", "expected a text, found 5", "5", "Datatype") + "," +
                                                     error("/label", "expected at least 2 characters, found 5", "5", "MinLength")));
  CHECK(r.errors("move", with("label", "\"\"")) == only(error("/label", "expected at least 2 characters, found \\\"\\\"", "\"\"", "MinLength")));
  CHECK(r.errors("move", with("axis", "[0,1]")) == only(error("/axis", "expected a list of 3 values, found 2 values", "", "MinCount")));
  CHECK(r.errors("move", with("axis", "[0,1,\"z\"]")) == only(error("/axis/2", "expected a number, found \\\"z\\\"", "\"z\"", "Datatype")));
  CHECK(r.errors("move", with("axis", "7")) == only(error("/axis", "expected a list of 3 values, found 7", "7", "HasValue")));
  CHECK(r.errors("move", with("pause", "\"1s\"")) ==
        only(error("/pause", "expected a duration like \\\"PT1.5S\\\", found \\\"1s\\\"", "\"1s\"", "Or")));
  const std::string time = "expected a date and time with its zone like \\\"2026-11-21T10:38:39Z\\\", found ";
  CHECK(r.errors("move", with("start", "\"noon\"")) == only(error("/start", time + "\\\"noon\\\"", "\"noon\"", "Datatype")));
  CHECK(r.errors("move", with("start", "\"2026-11-21T10:38:39\"")) ==
        only(error("/start", time + "\\\"2026-11-21T10:38:39\\\"", "\"2026-11-21T10:38:39\"", "Pattern")));
  CHECK(r.errors("move", "{" + good + ",\"tolerance\":0}") == only(error("/tolerance", "expected more than 0, found 0", "0", "MinExclusive")));
  CHECK(
      r.errors("move", "{" + good + ",\"speeed\":1}") ==
      R"([{"detail":"expected one of \"speed\", \"steps\", \"backwards\", \"gait\", \"label\", \"axis\", \"pause\", \"start\", \"tolerance\", found \"speeed\"","pointer":"#/speeed"}])");
  CHECK(r.errors("move", with("speed", R"({"value":1,"unit":"km"})")) == R"([{"detail":"expected \"m\", found \"km\"","pointer":"#/speed/unit"}])");
  CHECK(r.calls == 1);
}

TEST_CASE("a term that two parts of a value share does not move an error to the other part", "[engine][R0.6]") {
  Robot r;
  const std::string two = "expected a list of 2 values, found ";
  CHECK(r.errors("place", R"({"name":"x","any":[],"two":[],"three":[1,2,3]})") == "[" + error("/two", two + "0 values", "", "MinCount") + "]");
  CHECK(r.errors("place", R"({"name":"x","any":[],"two":"x","three":[1,2,3]})") == "[" + error("/two", two + "\\\"x\\\"", "\"x\"", "HasValue") + "]");
}

TEST_CASE("a value that its C++ type cannot hold is named by the name of its member", "[engine][R0.6]") {
  Robot r;
  const std::string detail = R"("detail":"expected a number that a float of 32 bits can hold, found 1e39")";
  CHECK(r.errors("load", R"({"left":1,"a/b":1e39})") == "[{" + detail + R"(,"pointer":"#/a~1b"}])");
}

TEST_CASE("the detail of a problem has all places in one sentence", "[engine][R0.6]") {
  Robot r;
  const Answer a =
      r.post("move", R"({"speed":2,"steps":1,"backwards":true,"gait":"trot","axis":[0,0,1],"pause":"PT1S","start":"2026-11-21T10:38:39Z"})");
  CHECK(a.says(R"("detail":"at \"/speed\": expected at most 1.5, found 2; at \"/label\": expected a text for \"label\", found none","errors":[)"));
  const Answer nested = r.post("plan", "{\"motion\":{" + good + "},\"rows\":[[1,2],[3,\"x\"]]}");
  CHECK(nested.says(R"(at \"/rows/1/1\": expected a number, found \"x\")"));
  const Answer missing = r.post("plan", "{\"rows\":[]}");
  CHECK(missing.says(R"(at \"/motion\": expected an object with \"speed\", \"steps\", )"));
  CHECK(missing.says(R"( for \"motion\", found none)"));
}

TEST_CASE("a client with a plain body and no preference gets problem details, and one with RDF its report", "[engine][json_ld][R1.2]") {
  Robot r;
  for (const char* accept : {"", "Accept: */*\n", "Accept: application/json;q=0.9, text/turtle;q=0.5\n"})
    CHECK(r.post("turn", "400", accept).says("\"errors\":[{"));
  CHECK(r.post("turn", "400", "Accept: application/json\n").field("Content-Type") == "application/json");
  CHECK(r.post("turn", "400", "Accept: text/html\n").field("Content-Type") == "text/html; charset=utf-8");
  for (const char* type : {"text/plain", "application/cbor"}) {
    const std::string body = std::string(type) == "text/plain" ? "400" : std::string("\x19\x01\x90");
    CHECK(r.bench.ask(std::string("POST /dog/actions/turn\nContent-Type: ") + type + "\nAccept: */*\n\n" + body).field("Content-Type") ==
          "application/problem+json");
  }
  CHECK(r.post("turn", "400", "Accept: text/turtle\n").field("Content-Type") == "text/turtle");
  CHECK(r.post("turn", "400", "Accept: application/ld+json, */*;q=0.1\n").field("Content-Type") == "application/ld+json");
  for (const char* accept : {"", "Accept: */*\n"})
    CHECK(r.bench.turtle("POST", "/dog/actions/turn", number_body("400", "maths:Degree"), accept).field("Content-Type") == "text/turtle");
}

TEST_CASE("the report in RDF has the same messages, with the predicates, and problem details of an RDF body have the names", "[engine][R0.6]") {
  Robot r;
  const Answer report = r.bench.turtle("POST", "/dog/actions/turn", "<> vom:numericalValue \"abc\" ; vom:unit maths:Degree .");
  CHECK(report.status == 422);
  CHECK(missing(report, "[] sh:resultPath vom:numericalValue ; sh:value \"abc\" ; sh:resultMessage 'expected a number, found \"abc\"' .") == "");
  CHECK_FALSE(report.says("e+308"));
  const std::string body =
      "@prefix d: <http://localhost/ns/vocabulary#Motion/> . <> d:steps 1 ; d:backwards true ; d:gait \"trot\" ; d:label \"abc\" ; "
      "d:axis ( 0 0 ) ;"
      " d:pause \"PT1S\"^^xsd:duration ; d:start \"2026-11-21T10:38:39Z\"^^xsd:dateTime .";
  const Answer turtle = r.bench.turtle("POST", "/dog/actions/move", body);
  CHECK(missing(turtle,
                "[] sh:resultPath <http://localhost/ns/vocabulary#Motion/speed> ; sh:resultMessage 'expected a number for \"speed\", "
                "found none' .") == "");
  const Answer json = r.bench.turtle("POST", "/dog/actions/move", body, "Accept: application/json\n");
  CHECK(json.says(error("/speed", "expected a number for \\\"speed\\\", found none", "", "MinCount")));
  CHECK(json.says(error("/axis", "expected a list of 3 values, found 2 values", "", "MinCount")));
  const Answer bare =
      r.bench.turtle("POST", "/dog/actions/move", "@prefix d: <http://localhost/ns/vocabulary#Motion/> . " + body + " <> d:speed 1 .");
  CHECK(missing(bare, "[] sh:resultMessage 'expected a number with its unit, as a node with vom:numericalValue, found 1' .") == "");
  CHECK(r.bench.turtle("POST", "/dog/actions/move", "", "Accept: application/json\n").says("\"pointer\":\"#/gait\""));
}

TEST_CASE("a shape of the user keeps its messages", "[engine][R1.11]") {
  Bench bench;
  Thing thing{"arm"};
  thing.property("level", [] { return 1.0; }).on_write([](double) {});
  thing.shapes(
      "@prefix sh: <http://www.w3.org/ns/shacl#> . @prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> ."
      "<#level> a sh:NodeShape ; sh:property [ sh:path vom:numericalValue ; sh:maxInclusive 3 ; sh:message \"the tank is too "
      "small\" ] .");
  bench.add(std::move(thing));
  const Answer a = bench.ask("PUT /arm/level\nContent-Type: application/json\n\n4");
  CHECK(a.says(R"("errors":[{"detail":"the tank is too small","pointer":"#","value":4,)"));
}

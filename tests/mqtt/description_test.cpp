// SPDX-License-Identifier: Apache-2.0
#include "src/mqtt/description.hpp"

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "src/rdf/json_parse.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::mqtt;
using rdf::json::Document;

namespace {

constexpr const char* structure = R"({"structure":"1","count":2,
  "kinds":{"arm-1":{"label":"arm","types":["http://example.org/Arm"],
      "properties":{"angle":{"title":"Angle","schema":{"type":"number","minimum":-1.5,"unit":"deg"},"datatype":"http://www.w3.org/2001/XMLSchema#double",
                              "units":["http://qudt.org/vocab/unit/DEG"],"writable":true},
                    "holds":{"schema":{"type":["boolean","null"]}},
                    "pose":{"schema":{"type":"object"}},
                    "hidden":{"schema":{"type":"number"}}},
      "actions":{"turn":{"path":"actions/turn","input":{"type":"number"},"invocable":true}}}},
  "things":[{"path":"/arm","kind":"arm-1","title":"Left \"arm\""},{"path":"/arm/tool+1","kind":"arm-1"}],
  "next":{"href":"http://robot/ns/structure?page=2"}})";

/// A robot that publishes all but `hidden`.
struct Robot {
  Topics topics = Topics::create("robots/r1").value();
  Publication how;
  RobotFacts facts{"http://robot", topics, true, true, true, {}};

  Robot() {
    how.retain = true;
    facts.published = [this](const std::string& topic) -> std::optional<PublishedAs> {
      if (topic.find("hidden") != std::string::npos) return std::nullopt;
      return PublishedAs{&how, std::chrono::milliseconds(100), "http://robot/base"};
    };
  }
};

/// The text or the digits at a path of members.
std::string at(const std::string& text, std::initializer_list<const char*> members) {
  rdf::json::Limits limits;
  limits.values = 10'000;
  limits.depth = 50;
  const Result<Document> document = Document::parse(text, limits);
  REQUIRE(document);
  Document::Id id = document->root();
  for (const char* const member : members) {
    id = document->member(id, member);
    if (id == Document::none) return "(none)";
  }
  return std::string(document->text(id));
}

}  // namespace

TEST_CASE("the JSON object of a Thing has topics, units, schemas and where to read whether the robot is connected", "[mqtt][meaning]") {
  Robot robot;
  const Result<DescribedPage> page = describe_things(structure, robot.facts);
  REQUIRE(page);
  REQUIRE(page->things.size() == 2);
  CHECK(page->next == "/ns/structure?page=2");
  CHECK(page->things[0].path == "/arm");
  const std::string& arm = page->things[0].json;
  CHECK(at(arm, {"thing"}) == "http://robot/arm");
  CHECK(at(arm, {"title"}) == "Left \"arm\"");
  CHECK(at(arm, {"availability", "topic"}) == "robots/r1/ns/status");
  CHECK(at(arm, {"document"}) == "robots/r1/ns/description");
  CHECK(at(arm, {"properties", "angle", "resource"}) == "http://robot/arm/angle");
  CHECK(at(arm, {"properties", "angle", "topic"}) == "robots/r1/arm/angle");
  CHECK(at(arm, {"properties", "angle", "commandTopic"}) == "robots/r1/ns/put/arm/angle");
  CHECK(at(arm, {"properties", "angle", "unit"}) == "http://qudt.org/vocab/unit/DEG");
  CHECK(at(arm, {"properties", "angle", "datatype"}) == "http://www.w3.org/2001/XMLSchema#double");
  CHECK(at(arm, {"properties", "angle", "frame"}) == "http://robot/base");
  CHECK(at(arm, {"properties", "angle", "schema", "minimum"}) == "-1.5");
  CHECK(at(arm, {"properties", "angle", "minimumInterval"}) == "0.1");
  CHECK(at(arm, {"properties", "holds", "commandTopic"}) == "(none)");  // not writable
  CHECK(at(arm, {"properties", "hidden", "topic"}) == "(none)");
  CHECK(at(arm, {"properties", "hidden", "resource"}) == "http://robot/arm/hidden");
  CHECK(at(arm, {"actions", "turn", "commandTopic"}) == "robots/r1/ns/post/arm/actions/turn");
  CHECK(at(arm, {"actions", "turn", "invocations"}) == "robots/r1/arm/actions/turn/+");
  CHECK(at(page->things[1].json, {"properties", "angle", "topic"}) == "robots/r1/arm/tool%2B1/angle");

  robot.facts.takes_commands = robot.facts.describes = robot.facts.discovers = false;
  const DescribedPage without = describe_things(structure, robot.facts).value();
  CHECK(at(without.things[0].json, {"properties", "angle", "commandTopic"}) == "(none)");
  CHECK(at(without.things[0].json, {"document"}) == "(none)");
  CHECK(without.things[0].discovery.empty());
}

TEST_CASE("Home Assistant finds numbers, texts and truth values of a Thing", "[mqtt][meaning]") {
  Robot robot;
  const std::string arm = describe_things(structure, robot.facts).value().things[0].discovery;
  const std::string angle = id_of("robots/r1/arm/angle"), holds = id_of("robots/r1/arm/holds");
  CHECK(angle.substr(0, 20) == "robots-r1-arm-angle-");
  CHECK(at(arm, {"device", "name"}) == "Left \"arm\"");
  CHECK(at(arm, {"origin", "name"}) == "lrt");
  CHECK(arm.find(R"("availability":[{"topic":"robots/r1/ns/status")") != std::string::npos);
  CHECK(at(arm, {"components", angle.c_str(), "platform"}) == "sensor");
  CHECK(at(arm, {"components", angle.c_str(), "unique_id"}) == angle);
  CHECK(at(arm, {"components", angle.c_str(), "name"}) == "Angle");
  CHECK(at(arm, {"components", angle.c_str(), "state_topic"}) == "robots/r1/arm/angle");
  CHECK(at(arm, {"components", angle.c_str(), "unit_of_measurement"}) == "\xC2\xB0");
  CHECK(at(arm, {"components", angle.c_str(), "value_template"}) == "{{ value_json }}");
  CHECK(at(arm, {"components", holds.c_str(), "platform"}) == "binary_sensor");
  CHECK(at(arm, {"components", holds.c_str(), "name"}) == "holds");
  CHECK(at(arm, {"components", id_of("robots/r1/arm/pose").c_str()}) == "(none)");
  CHECK(at(arm, {"components", id_of("robots/r1/arm/hidden").c_str()}) == "(none)");

  robot.how.form = Form::with_meaning;
  CHECK(at(describe_things(structure, robot.facts).value().things[0].discovery, {"components", angle.c_str(), "value_template"}) ==
        "{{ value_json.value }}");
  robot.how.form = Form::value;
  robot.how.media_type = "application/cbor";
  CHECK(describe_things(structure, robot.facts).value().things[0].discovery.empty());
}

TEST_CASE("descriptions say which robot they are of", "[mqtt][identity]") {
  Robot robot;
  CHECK(at(describe_things(structure, robot.facts).value().things[0].json, {"robot", "iri"}) == "(none)");
  robot.facts.identity.iri = "https://robots.example/r1";
  robot.facts.identity.serial_number = "A-1047";
  robot.facts.identity.software_version = "2.4.1";
  const DescribedThing arm = describe_things(structure, robot.facts).value().things[0];
  CHECK(at(arm.json, {"robot", "iri"}) == "https://robots.example/r1");
  CHECK(at(arm.json, {"robot", "serialNumber"}) == "A-1047");
  CHECK(at(arm.discovery, {"device", "serial_number"}) == "A-1047");
  CHECK(at(arm.discovery, {"device", "sw_version"}) == "2.4.1");
  CHECK(at(arm.discovery, {"device", "model"}) == "(none)");
}

TEST_CASE("a document that is no structure document is refused", "[mqtt][meaning]") {
  const Robot robot;
  for (const char* const text :
       {"", "{", "[]", "1", "{}", R"({"kinds":{},"things":{}})", R"({"kinds":{},"things":[1]})", R"({"kinds":{},"things":[{}]})",
        R"({"kinds":{},"things":[{"path":"/a","kind":"x"}]})", R"({"kinds":{"x":{}},"things":[{"kind":"x"}]})"}) {
    CAPTURE(text);
    CHECK_FALSE(describe_things(text, robot.facts));
  }
  CHECK(describe_things(R"({"kinds":{"x":{}},"things":[{"path":"/a","kind":"x"}]})", robot.facts));
  CHECK(describe_things(R"({"kinds":{},"things":[]})", robot.facts).value().things.empty());
}

// SPDX-License-Identifier: Apache-2.0
// The rules of a mapping: the shipped table, TOML, Turtle.
#include <lrt/ros2.hpp>

#include <cstdio>
#include <fstream>
#include <string>

#include "src/ros2/bridge/mapping.hpp"
#include "src/ros2/bridge/mapping_file.hpp"
#include "src/ros2/bridge/types.hpp"
#include "src/ros2/bridge/units.hpp"
#include "tests/support/catch.hpp"

namespace {

using namespace lrt;
using namespace lrt::ros2;

std::string fault(const std::string& toml) {
  const Result<ros2::Options> read = options_from_toml(toml, "robot.toml");
  return read ? std::string() : read.error().message;
}
std::string fault_of_turtle(const std::string& body) {
  const Result<void> added = Mapping().add(
      "@prefix : <https://w3id.org/lrt/ros2#> . @prefix unit: <http://qudt.org/vocab/unit/> .\n"
      "@prefix qudt: <http://qudt.org/schema/qudt/> . @prefix dcterms: <http://purl.org/dc/terms/> .\n" +
          body,
      "text/turtle");
  return added ? std::string() : added.error().message;
}
/// What is said of a field of a type, with the shipped definitions.
FieldOptions field(const Mapping& mapping, const std::string& type, const std::string& path, const std::string& topic = "/t") {
  Definitions definitions;
  const Result<MessagePtr> message = definitions.message(type);
  REQUIRE(message);
  TypeMaker types(mapping.rules());
  return types.options_of(**message, TypeUse{Rule::Of::topic, topic, {}}, path);
}

TEST_CASE("the shipped table knows more than fifty types, and each of its names exists", "[ros2][mapping]") {
  CHECK(shipped_types() > 50);
  Definitions definitions;
  Mapping mapping;
  std::size_t known = 0;
  for (const char* type : {"geometry_msgs/msg/Twist", "geometry_msgs/msg/Pose", "geometry_msgs/msg/Wrench", "geometry_msgs/msg/Accel",
                           "sensor_msgs/msg/Imu", "sensor_msgs/msg/BatteryState", "sensor_msgs/msg/LaserScan", "sensor_msgs/msg/NavSatFix",
                           "sensor_msgs/msg/Range", "sensor_msgs/msg/MagneticField", "sensor_msgs/msg/Temperature", "sensor_msgs/msg/FluidPressure",
                           "sensor_msgs/msg/Illuminance", "sensor_msgs/msg/RelativeHumidity", "nav_msgs/msg/OccupancyGrid", "nav_msgs/msg/Odometry",
                           "tf2_msgs/msg/TFMessage", "diagnostic_msgs/msg/DiagnosticArray"}) {
    CAPTURE(type);
    const Result<MessagePtr> message = definitions.message(type);
    REQUIRE(message);
    TypeMaker types(mapping.rules());
    const Result<MessageType> made = types.make(*message, TypeUse{Rule::Of::topic, "/t", {}});
    CHECK((made ? std::string() : made.error().message) == "");
    // Each field that the table names is one of the message.
    for (const Rule* rule : matching(mapping.rules(), Rule::Of::type, type))
      for (const auto& [path, said] : rule->fields) {
        if (path.find('*') != std::string::npos) continue;
        CAPTURE(path);
        CHECK(made->place(path).has_value());
        ++known;
      }
  }
  CHECK(known >= 30);
}

TEST_CASE("units follow the message around a field", "[ros2][mapping]") {
  const Mapping shipped;
  CHECK(field(shipped, "geometry_msgs/msg/Twist", "linear.x").facets.unit() == unit::metre_per_second);
  CHECK(field(shipped, "geometry_msgs/msg/Twist", "angular.z").facets.unit() == unit::radian_per_second);
  CHECK(field(shipped, "nav_msgs/msg/Odometry", "twist.twist.angular.z").facets.unit() == unit::radian_per_second);
  CHECK(field(shipped, "nav_msgs/msg/Odometry", "pose.pose.position.x").facets.unit() == unit::metre);
  CHECK(field(shipped, "geometry_msgs/msg/Vector3", "x").facets.unit() == unit::none);
  CHECK(field(shipped, "sensor_msgs/msg/NavSatFix", "latitude").facets.max() == 90);
  const FieldOptions level = field(shipped, "diagnostic_msgs/msg/DiagnosticArray", "status.level");
  REQUIRE(level.enumerators.size() == 4);
  CHECK(level.enumerators[2].name == "ERROR");
  CHECK(field(shipped, "sensor_msgs/msg/BatteryState", "power_supply_status").enumerators.size() > 3);
}

TEST_CASE("a user's rule comes before the shipped one, a topic's before a type's", "[ros2][mapping]") {
  Mapping mapping;
  mapping
      .add(R"(
[[topic]]
name = "/wheels/*"
title = { en = "Wheels", de = "Räder" }
frame = "axle"
interval_ms = 20
fields = { "linear.x" = { unit = "mm", min = -5, max = 5, name = "forward", title = "Forward" }, "angular.*" = { left_out = true } }
[[type]]
type = "geometry_msgs/msg/Twist"
life_ms = 0
fields = { "linear.x" = { unit = "cm" }, "linear.y" = { unit = "cm" } }
[[topic]]
name = "/level"
unit = "L"
)",
           "application/toml")
      .value();
  const FieldOptions x = field(mapping, "geometry_msgs/msg/Twist", "linear.x", "/wheels/left");
  CHECK(x.facets.unit() == unit::millimetre);
  CHECK(x.facets.min() == -5);
  CHECK(x.name == "forward");
  CHECK(x.facets.words().titles.begin()->text == "Forward");
  CHECK(field(mapping, "geometry_msgs/msg/Twist", "angular.z", "/wheels/left").left_out);
  CHECK(field(mapping, "geometry_msgs/msg/Twist", "linear.y", "/wheels/left").facets.unit().ucum == "cm");
  CHECK(field(mapping, "geometry_msgs/msg/Twist", "linear.x", "/other").facets.unit().ucum == "cm");
  CHECK(field(mapping, "geometry_msgs/msg/Twist", "linear.z", "/other").facets.unit() == unit::metre_per_second);
  CHECK(field(mapping, "std_msgs/msg/Float64", "data", "/level").facets.unit().ucum == "L");
  const Said said = said_of(mapping.rules(), Rule::Of::topic, "/wheels/left", "geometry_msgs/msg/Twist");
  CHECK(said.titles.size() == 2);
  CHECK(said.frame == "axle");
  CHECK(said.life == std::chrono::milliseconds(0));
  CHECK(said.interval == std::chrono::milliseconds(20));
  CHECK(said.is_command);
}

TEST_CASE("a mapping in Turtle says the same", "[ros2][mapping]") {
  Mapping mapping;
  mapping
      .add(R"(
@prefix : <https://w3id.org/lrt/ros2#> .
@prefix qudt: <http://qudt.org/schema/qudt/> .
@prefix unit: <http://qudt.org/vocab/unit/> .
@prefix dcterms: <http://purl.org/dc/terms/> .
[] a :TopicRule ; :matches "/wheels/*" ; dcterms:title "Wheels"@en , "Räder"@de ; :frame "axle" ; :lifeMilliseconds 250 ;
   :field [ :path "linear.x" ; qudt:hasUnit unit:MilliM ; :min -5 ; :max 5.5 ; :as "forward" ] , [ :path "angular.*" ; :leftOut true ] .
[] a :TypeRule ; :matches "demo/msg/*" ; :field [ :path "mode" ; :value [ :name "SLOW" ; :number 1 ] , [ :name "FAST" ; :number 2 ] ] .
)",
           "text/turtle")
      .value();
  const FieldOptions x = field(mapping, "geometry_msgs/msg/Twist", "linear.x", "/wheels/left");
  CHECK(x.facets.unit() == unit::millimetre);
  CHECK(x.facets.max() == 5.5);
  CHECK(x.name == "forward");
  CHECK(field(mapping, "geometry_msgs/msg/Twist", "angular.z", "/wheels/left").left_out);
  const Said said = said_of(mapping.rules(), Rule::Of::topic, "/wheels/left", {});
  CHECK(said.titles.size() == 2);
  CHECK(said.life == std::chrono::milliseconds(250));
  REQUIRE(mapping.rules().rules.size() == 2);
  CHECK(matching(mapping.rules(), Rule::Of::type, "demo/msg/Odd").at(0)->fields.at("mode").enumerators.size() == 2);
}

TEST_CASE("what toml++ does not define is refused in each build", "[ros2][mapping]") {
  for (const char* text : {"[@prefix : <hh]ttps", "[[@a]]", "[=]", "[#", "[\n", "title\xc3\xa4 = 1", "a = 1 \xc3\xa4", "a = \"\\\xc3\xa4\"",
                           "a = '\xc3\xa4'", "a = -\"R\xc3\xa4\" }", "# \xff"}) {
    CAPTURE(text);
    const Result<ros2::Options> read = options_from_toml(text, "robot.toml");
    REQUIRE_FALSE(read);
    CHECK(read.error().message.find("line 1") != std::string::npos);
  }
}

TEST_CASE("texts and comments of TOML have any characters", "[ros2][mapping]") {
  const auto title = [](const std::string& text) {
    Mapping mapping;
    mapping.add("\xef\xbb\xbf# \u00e4 \"\n[[topic]]\nname = '/a'  # '\u00e4\ntitle = " + text + "\n", "application/toml").value();
    return said_of(mapping.rules(), Rule::Of::topic, "/a", {}).titles.begin()->text;
  };
  CHECK(title("\"R\u00e4der \\\" '\"  # \u00e4") == "R\u00e4der \" '");
  CHECK(title("\"\"\"\u00e4 \"\" \u00e4\"\"\"\"\"") == "\u00e4 \"\" \u00e4\"\"");
  CHECK(title("\"\"\"a\\\n  \U0001f916\"\"\"") == "a\U0001f916");
  CHECK(title("'a\\'") == "a\\");
}

TEST_CASE("a file of options is read, and says what is wrong with line and column", "[ros2][mapping]") {
  const ros2::Options options = options_from_toml(R"(
[server]
port = 80
[graph]
domain = 7
interfaces = ["127.0.0.1"]
namespaces = ["/arm"]
path = "robots/r7"
max_endpoints = 5
[definitions]
folders = ["/opt/ros/humble/share"]
[allowed]
topics = ["/cmd_vel"]
parameters = ["/arm/**:*"]
[limits]
command_life_ms = 250
max_things = 9
[[parameter]]
name = "/arm/*:max_speed"
unit = "m/s"
)",
                                                  "robot.toml")
                                    .value();
  CHECK(options.graph.domain == 7);
  CHECK(options.graph.interfaces == std::vector<std::string>{"127.0.0.1"});
  CHECK(options.graph.limits.max_endpoints == 5);
  CHECK(options.namespaces == std::vector<std::string>{"/arm"});
  CHECK(options.path == "robots/r7");
  CHECK(options.definitions == std::vector<std::string>{"/opt/ros/humble/share"});
  CHECK(options.allowed.topics == std::vector<std::string>{"/cmd_vel"});
  CHECK(options.limits.command_life == std::chrono::milliseconds(250));
  CHECK(options.limits.max_things == 9);
  CHECK(options.mapping.rules().rules.size() == 1);

  CHECK(fault("[graph]\ndomian = 7\n").find("robot.toml, line 2, column 1: unknown key \"domian\" in [graph]; expected one of domain") == 0);
  CHECK(fault("[graph]\ndomain = 233\n").find("line 2, column 10: \"domain\": expected 0 to 232, found 233") != std::string::npos);
  CHECK(fault("[graph]\ndomain = \"7\"\n").find("expected an integer") != std::string::npos);
  CHECK(fault("graph = 3\n").find("expected a table") != std::string::npos);
  CHECK(fault("[graph\n").find("line 1") != std::string::npos);
  CHECK(fault("[topic]\nname = \"/a\"\n").find("expected [[topic]]") != std::string::npos);
  CHECK(fault("[[topic]]\ntitle = \"A\"\n").find("says what it is for") != std::string::npos);
  CHECK(fault("[[topic]]\nname = \"/a\"\nunit = \"furlong\"\n").find("unknown unit \"furlong\"") != std::string::npos);
  CHECK(fault("[[topic]]\nname = \"/a\"\nfields = { x = { min = 3, max = 2 } }\n").find("above the greatest") != std::string::npos);
  CHECK(fault("[[topic]]\nname = \"/a\"\nfields = { x = { term = \"no iri\" } }\n").find("absolute IRI") != std::string::npos);
  CHECK(fault("[[parameter]]\nname = \"/a\"\nframe = \"x\"\n").find("unknown key \"frame\"") != std::string::npos);
  CHECK(fault("[allowed]\ntopics = \"/cmd_vel\"\n").find("a list of texts") != std::string::npos);
  CHECK(fault(std::string(max_mapping_bytes + 1, '#')).find("more than") != std::string::npos);
  CHECK(Mapping().add("[graph]\n", "application/toml").error().message.find("unknown table \"graph\"") != std::string::npos);
}

TEST_CASE("each key that the guide has is read", "[ros2][mapping]") {
  std::ifstream page(LRT_SOURCE_DIR "/docs/ros2.md");
  std::size_t keys = 0;
  for (std::string line; std::getline(page, line);) {
    const std::size_t table_end = line.find("]` | ");
    if (line.compare(0, 4, "| `[") != 0 || line[4] == '[' || table_end == std::string::npos) continue;
    const std::string table = line.substr(4, table_end - 4);
    if (table != "graph" && table != "definitions" && table != "allowed" && table != "limits") continue;  // others are of the program
    for (std::size_t at = line.find('`', table_end + 2); at != std::string::npos; at = line.find('`', at + 1)) {
      const std::size_t key_end = line.find('`', at + 1);
      REQUIRE(key_end != std::string::npos);
      const std::string key = line.substr(at + 1, key_end - at - 1);
      INFO("[" << table << "] " << key);
      CHECK(fault("[" + table + "]\n" + key + " = {}\n").find('"' + key + "\": expected ") != std::string::npos);
      at = key_end;
      ++keys;
    }
  }
  CHECK(keys >= 40);
}

TEST_CASE("a mapping in Turtle says what is wrong", "[ros2][mapping]") {
  CHECK(fault_of_turtle("[] a :TopicRule ; :matches \"/a\" .") == "");
  CHECK(fault_of_turtle("[] a :TopicRule .").find("says what it is for") != std::string::npos);
  CHECK(fault_of_turtle("[] a :Topicrule ; :matches \"/a\" .").find("unknown class") != std::string::npos);
  CHECK(fault_of_turtle("[] a :TopicRule ; :matches \"/a\" ; :frme \"x\" .").find("unknown predicate") != std::string::npos);
  CHECK(fault_of_turtle("[] a :TopicRule ; :matches \"/a\" ; :min \"x\" .").find("expected a number") != std::string::npos);
  CHECK(fault_of_turtle("[] a :TopicRule ; :matches \"/a\" ; :field [ qudt:hasUnit unit:M ] .").find("a path") != std::string::npos);
  CHECK(fault_of_turtle("<#a> dcterms:title \"a\" .").find("no rule") != std::string::npos);
  CHECK_FALSE(fault_of_turtle("[] a :TopicRule ;").empty());
  CHECK(Mapping().add("{}", "application/json").error().code == Errc::unsupported_syntax);
  CHECK(Mapping().add_file("/tmp/mapping.json").error().code == Errc::unsupported_syntax);
  CHECK(Mapping().add_file("/nowhere/mapping.ttl").error().code == Errc::io_error);
}

TEST_CASE("units are found by their code and by their IRI", "[ros2][mapping]") {
  CHECK(find_unit("m/s")->qudt.text == "http://qudt.org/vocab/unit/M-PER-SEC");
  CHECK(find_unit("http://qudt.org/vocab/unit/M-PER-SEC")->ucum == "m/s");
  CHECK(find_unit("http://example.org/furlong")->qudt.text == "http://example.org/furlong");
  CHECK_FALSE(find_unit(""));
  CHECK_FALSE(find_unit("furlong"));
}

TEST_CASE("a pattern of fields fits names one by one", "[ros2][mapping]") {
  CHECK(fits_path("a.*.c", "a.b.c"));
  CHECK_FALSE(fits_path("a.*", "a.b.c"));
  CHECK_FALSE(fits_path("a.*.c", "a.b"));
  CHECK(fits_path("*", "a"));
}

}  // namespace

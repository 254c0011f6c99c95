// SPDX-License-Identifier: Apache-2.0
#include <lrt/client/patch.hpp>

#include <optional>
#include <string>
#include <vector>

#include <lrt/client.hpp>
#include <lrt/client/schema.hpp>
#include <lrt/thing.hpp>

#include "tests/client/robot_host.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

struct Bounds {
  double lower = 5, upper = 6;
};
struct Command {
  double position = 7, velocity = 8;
  std::string label = "initialiser";
  std::optional<double> effort;
  Bounds bounds;
};

}  // namespace

template <>
struct lrt::rdf::traits<Bounds> : lrt::rdf::Record<Bounds> {
  static void describe(Record<Bounds>& r) {
    r.field("lower", &Bounds::lower).value_if_absent(-1);
    r.field("upper", &Bounds::upper);
  }
};
template <>
struct lrt::rdf::traits<Command> : lrt::rdf::Record<Command> {
  static void describe(Record<Command>& r) {
    r.field("position", &Command::position).unit(unit::radian);
    r.field("velocity", &Command::velocity).unit(unit::radian_per_second).value_if_absent(2);
    r.field("label", &Command::label).value_if_absent("none");
    r.field("effort", &Command::effort);
    r.field("bounds", &Command::bounds).value_if_absent({-3, 3});
  }
};

namespace {

struct Rig {
  Rig() {
    command.position = 1;
    command.velocity = 1;
    command.label = "a";
  }
  std::vector<Thing> things() {
    Thing joint("joint");
    joint.property("command", [this] { return command; }).on_write([this](Command c) -> Result<void> {
      if (c.position > 100) return refused("too far");
      command = std::move(c);
      return {};
    });
    joint.property("number", [] { return 1.0; }).on_write([](double) {});
    return one_thing(std::move(joint));
  }
  Command command;
  RobotHost host{things()};
  Client client = Client::create().value();
  client::Property property = client.property(host.url() + "joint/command").value();
};

}  // namespace

TEST_CASE("a patch is a JSON document", "[client]") {
  CHECK(client::Patch().json() == "{}");
  client::Patch inner;
  inner.set("upper", 2.5);
  CHECK(client::Patch().set("position", 0.1).set("label", "a \"b\"").clear("effort").set("bounds", inner).json() ==
        "{\"position\":0.1,\"label\":\"a \\\"b\\\"\",\"effort\":null,\"bounds\":{\"upper\":2.5}}");
  CHECK(client::Patch().set("all", std::vector<int>{1, 2}).json() == "{\"all\":[1,2]}");
  CHECK(client::Patch::from_json("{\"a\": null}").json() == "{\"a\": null}");
}

TEST_CASE("a client changes parts of a value, and the server says what it refuses", "[client]") {
  Rig rig;
  const Result<void> done =
      rig.property.patch(client::Patch().set("position", 0.5).set("effort", 3.0).set("bounds", client::Patch().set("upper", 9.0)));
  REQUIRE(done.has_value());
  CHECK(rig.command.position == 0.5);
  CHECK(rig.command.velocity == 1);
  CHECK(rig.command.effort == 3);
  CHECK(rig.command.bounds.upper == 9);
  CHECK(rig.command.bounds.lower == 5);
  CHECK(rig.property.patch(client::Patch().clear("effort").clear("velocity")).has_value());
  CHECK_FALSE(rig.command.effort);
  CHECK(rig.command.velocity == 2);
  const Result<void> missing = rig.property.patch(client::Patch().clear("position"));
  REQUIRE_FALSE(missing);
  CHECK(missing.error().message.find("position") != std::string::npos);
  CHECK(rig.property.patch(client::Patch().set("position", 101.0)).error().message.find("too far") != std::string::npos);
  CHECK(rig.property.patch(client::Patch().set("position", 1.0), {{}, "\"other\""}).error().message.find("412") != std::string::npos);
  CHECK(rig.property.patch(client::Patch(), {unit::radian, {}}).error().code == Errc::invalid_option);
  const client::Property number = rig.client.property(rig.host.url() + "joint/number").value();
  CHECK(number.patch(client::Patch().set("x", 1.0)).error().code == Errc::unsupported_syntax);
}

TEST_CASE("a schema has the defaults that a shape states, and a value without them can be written", "[client]") {
  Rig rig;
  const std::optional<client::Shape> shape = rig.property.shape().value();
  REQUIRE(shape.has_value());
  const client::Schema schema = client::Schema::read(shape->graph, shape->node).value();
  REQUIRE(schema.usable());
  std::size_t defaults = 0;
  for (const rdf::FieldType& field : schema.type().fields) {
    CAPTURE(field.name);
    CHECK((field.type->kind == rdf::Type::Kind::optional) == (field.name == "effort"));
    if (field.absent) ++defaults;
    if (field.name == "velocity") CHECK(*field.absent->real() == 2);
    if (field.name == "bounds") CHECK(*(*field.absent->sequence())[1].real() == 3);
  }
  CHECK(defaults == 3);
}

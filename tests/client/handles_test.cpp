// SPDX-License-Identifier: Apache-2.0
// Handles by URL, value shapes and result nodes of lrt/client.hpp, which programs without types need.
#include <lrt/client.hpp>

#include <algorithm>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <lrt/client/schema.hpp>

#include "tests/client/robot_host.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::seconds;

namespace {

struct Rig {
  SampleRobot robot;
  RobotHost host{one_thing(robot.arm())};
  Client client = Client::create().value();
};

}  // namespace

TEST_CASE("a program that knows a URL needs no discovery", "[client][R1.6]") {
  Rig rig;
  const std::string arm = rig.host.url() + "arm";
  const client::Property angle = rig.client.property(arm + "/angle").value();
  CHECK(angle.name() == "angle");
  CHECK(angle.read<double>(unit::degree).value() == 10);
  CHECK(angle.write(20.0).has_value());
  CHECK(rig.robot.angle == 20);
  const client::Invocation run = rig.client.action(arm + "/actions/turn").value().invoke(43.0).value();
  const client::Invocation kept = rig.client.invocation(run.url()).value();
  CHECK(kept.wait(seconds(10)).value().status == client::Invocation::Status::succeeded);
  CHECK(rig.client.property("angle").error().code == Errc::expected_iri);
  CHECK(rig.client.action("ftp://robot/").error().code == Errc::expected_iri);
  CHECK(rig.client.invocation("").error().code == Errc::expected_iri);
}

TEST_CASE("a property that cannot be written has the shape that its Blueprint says", "[client][R1.11]") {
  Rig rig;
  const client::Thing arm = rig.client.open(rig.host.url()).value().thing("arm").value();
  const client::Property speed = arm.property("speed").value();
  CHECK_FALSE(speed.shape().value().has_value());
  const std::optional<client::Shape> shape = speed.value_shape().value();
  REQUIRE(shape.has_value());
  const client::Schema schema = client::Schema::read(shape->graph, shape->node).value();
  REQUIRE(schema.usable());
  const client::RepresentationPtr found = speed.get().value();
  const rdf::TermId node = speed.value_node(found->graph, found->focus).value();
  const rdf::Value value = schema.read_value(found->graph, node).value();
  REQUIRE(value.real());
  CHECK(*value.real() == 1.5);
  // One that can be written has the shape by which it is judged.
  const client::Property angle = arm.property("angle").value();
  CHECK(rdf::to_string(angle.value_shape().value()->node.view()) == rdf::to_string(angle.shape().value()->node.view()));
  CHECK(angle.value_node(rdf::Graph(), std::nullopt).error().code == Errc::expected_value);
}

TEST_CASE("the node of a result can be read without its type", "[client]") {
  Rig rig;
  const client::Thing arm = rig.client.open(rig.host.url()).value().thing("arm").value();
  const client::Invocation measured = arm.action("measure").value().invoke().value();
  measured.wait(seconds(10)).value();
  const client::Invocation::ResultNode result = measured.result_node().value();
  const auto number = result.representation->graph.find(vocab::vom::numericalValue);
  REQUIRE(number.has_value());
  const auto object = result.representation->graph.object(result.node, *number);
  REQUIRE(object.has_value());
  CHECK(result.representation->graph.term(*object).text == "2.5");
}

TEST_CASE("an unknown part of a known Thing is an error that lists what that Thing has", "[client]") {
  Rig rig;
  const Result<client::Property> found = rig.client.open(rig.host.url()).value().property("arm/colour");
  REQUIRE_FALSE(found);
  CHECK(found.error().message.find("\"arm\" has no property \"colour\"; it has rotation, speed") == 0);
}

TEST_CASE("the log has each request with its status", "[client]") {
  SampleRobot robot;
  RobotHost host{one_thing(robot.arm())};
  std::mutex mutex;
  std::vector<std::string> lines;
  client::Options options;
  options.log = [&](LogLevel level, std::string_view text) {
    const std::lock_guard lock(mutex);
    if (level == LogLevel::debug) lines.emplace_back(text);
  };
  Client client = Client::create(options).value();
  CHECK(client.get(host.url() + "arm").has_value());
  CHECK_FALSE(client.get(host.url() + "leg").has_value());
  CHECK_FALSE(client.get("http://127.0.0.1:1/").has_value());
  const std::lock_guard lock(mutex);
  CHECK(lines == std::vector<std::string>{"GET " + host.url() + "arm: 200", "GET " + host.url() + "leg: 404", "GET http://127.0.0.1:1/: io_error"});
}

TEST_CASE("an action has the shape of its input, or none", "[client][R1.11]") {
  Rig rig;
  const client::Thing arm = rig.client.open(rig.host.url()).value().thing("arm").value();
  const std::optional<client::Shape> turn = arm.action("turn").value().input_shape().value();
  REQUIRE(turn);
  const client::Schema schema = client::Schema::read(turn->graph, turn->node.view()).value();
  CHECK(schema.type().kind == rdf::Type::Kind::real);
  CHECK(schema.facets().unit() == unit::degree);
  CHECK_FALSE(arm.action("home").value().input_shape().value());
  CHECK_FALSE(arm.action("measure").value().input_shape().value());  // it has an output
  CHECK(rig.client.action(rig.host.url() + "arm/actions/none").value().input_shape().error().code == Errc::unknown_path);
}

TEST_CASE("an action names the classes of its output and of its effects", "[client][R1.10]") {
  Rig rig;
  const client::Thing arm = rig.client.open(rig.host.url()).value().thing("arm").value();
  const std::vector<std::string> scalar = {std::string(vocab::maths::Scalar.text)};
  CHECK(arm.action("measure").value().produced_classes().value() == scalar);
  CHECK(arm.action("measure").value().consumed_classes().value().empty());
  CHECK(arm.action("turn").value().consumed_classes().value() == scalar);
  CHECK(arm.action("home").value().produced_classes().value().empty());
  CHECK(rig.client.action(rig.host.url() + "arm/actions/none").value().produced_classes().error().code == Errc::unknown_path);
}

TEST_CASE("an action links to its invocations", "[client][R0.8]") {
  Rig rig;
  const client::Action home = rig.client.action(rig.host.url() + "arm/actions/home").value();
  CHECK(home.invocations().value().empty());
  const client::Invocation first = home.invoke().value(), second = home.invoke().value();
  CHECK(first.wait(seconds(10)).value().status == client::Invocation::Status::succeeded);
  CHECK(second.wait(seconds(10)).value().status == client::Invocation::Status::succeeded);
  std::vector<std::string> listed = home.invocations().value(), made = {first.url(), second.url()};
  std::sort(listed.begin(), listed.end());
  std::sort(made.begin(), made.end());
  CHECK(listed == made);
  CHECK(rig.client.action(rig.host.url() + "arm/actions/measure").value().invocations().value().empty());  // not those of other actions
  CHECK(rig.client.action(rig.host.url() + "arm/actions/none").value().invocations().error().code == Errc::unknown_path);
}

// SPDX-License-Identifier: Apache-2.0
#include "src/client/structure.hpp"

#include <lrt/client.hpp>

#include <atomic>
#include <string>
#include <utility>
#include <vector>

#include "tests/client/robot_host.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/folder.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

/// A cell with joints of two numbers and an action each.
std::vector<Thing> joints(int n) {
  std::vector<Thing> things;
  for (int i = 0; i < n; ++i) {
    Thing joint{"cell/joint" + std::to_string(i)};
    joint.title("Joint " + std::to_string(i), "en").title("Gelenk " + std::to_string(i), "de").type(vocab::ros::RevoluteJoint);
    joint.property<double>("angle", unit::degree).on_write([](double) {}).publish(i);
    joint.property<double>("speed", unit::radian_per_second).publish(0);
    joint.action("turn", [](double) {});
    joint.action("stop", [] {}).stop();
    things.push_back(std::move(joint));
  }
  return things;
}

client::Options options_with(const std::string& folder, std::string token = {}) {
  client::Options options;
  options.cache_folder = folder;
  options.identity.token = std::move(token);
  return options;
}

}  // namespace

TEST_CASE("a client opens a robot by its structure document", "[client][structure]") {
  RobotHost host(joints(200));
  Client client = Client::create().value();
  const client::Robot robot = client.open(host.url()).value();
  CHECK(robot.requests() == 2);
  REQUIRE(robot.things().size() == 200);
  CHECK(client.open(host.url()).value().requests() == 1);
  CHECK(robot.refresh().value().requests() == 1);

  const client::Thing joint = robot.thing("joint7").value();
  CHECK(joint.url() == host.url() + "cell/joint7");
  CHECK(joint.names().titles == std::vector<std::string>{"Joint 7", "Gelenk 7"});
  CHECK(robot.thing("Gelenk 7").value().url() == joint.url());
  CHECK(joint.is(vocab::ros::RevoluteJoint));
  CHECK(joint.is(vocab::hybrit::RoboticThing));
  CHECK(joint.state() == joint.url() + "/state");
  CHECK(joint.subscriptions() == joint.url() + "/subscriptions");
  const client::Property angle = joint.property("angle").value();
  REQUIRE(angle.declared());
  CHECK(angle.declared()->is_simple);
  CHECK(angle.unit().value() == unit::degree);
  CHECK(angle.is_writable().value());
  CHECK_FALSE(joint.property("speed").value().is_writable().value());
  CHECK(angle.read<double>(unit::degree).value() == 7);
  CHECK(angle.write(3.5, {unit::degree}).has_value());
  CHECK(joint.action("turn").value().declared()->has_value);
  CHECK(joint.action("stop").value().declared()->is_stop);
  CHECK_FALSE(joint.action("stop").value().declared()->has_value);
  CHECK(joint.action("turn").value().invoke(3.0).has_value());
  CHECK_FALSE(joint.blueprints().empty());  // its document is read for that
  CHECK(joint.representation()->url == joint.url());
  CHECK(robot.property("joint9/speed").value().url() == host.url() + "cell/joint9/speed");
}

TEST_CASE("what links and the structure document say of a robot is the same", "[client][structure]") {
  RobotHost host(joints(5));
  Client client = Client::create().value();
  const client::Robot robot = client.open(host.url()).value(), by_links = client.open(host.url() + "cell/joint3").value();
  CHECK(robot.things().front().properties().front().declared());
  for (const client::Thing& thing : by_links.things()) {
    CHECK_FALSE(thing.properties().front().declared());
    const client::Thing same = robot.thing(thing.url()).value();
    CHECK(same.name() == thing.name());
    CHECK(same.subscriptions() == thing.subscriptions());
    CHECK(same.state() == thing.state());
    CHECK(same.properties().size() == thing.properties().size());
    CHECK(same.actions().size() == thing.actions().size());
    for (const client::Property& property : thing.properties()) {
      const client::Property other = same.property(property.url()).value();
      CHECK(other.name() == property.name());
      CHECK(other.names().predicates == property.names().predicates);
      CHECK(other.unit().value() == property.unit().value());
      CHECK(other.is_writable().value() == property.is_writable().value());
    }
  }
}

TEST_CASE("a structure document is read again when the robot has changed", "[client][structure]") {
  RobotHost host(joints(2));
  const Folder folder;
  Client client = Client::create(options_with(folder / "lrt")).value();
  CHECK(client.open(host.url()).value().things().size() == 2);
  Client next = Client::create(options_with(folder / "lrt")).value();
  CHECK(next.open(host.url()).value().requests() == 1);
  host.server().add(Thing{"other"}).value();
  CHECK(next.open(host.url()).value().things().size() == 3);
  CHECK(client.open(host.url()).value().things().size() == 3);
  host.server().remove("other").value();
  CHECK(client.open(host.url()).value().things().size() == 2);

  client::Options patient = options_with(folder / "lrt");
  patient.cache_age = std::chrono::hours(1);
  CHECK(Client::create(patient).value().open(host.url()).value().requests() == 0);
}

TEST_CASE("a document in a file is for one identity", "[client][structure]") {
  const Folder folder;
  using client::StructureStore;
  const client::StructureStore store(folder / "lrt");
  const std::string mine = StructureStore::key("http://robot/", {{"Authorization", "Bearer mine"}});
  CHECK(mine != StructureStore::key("http://robot/", {{"Authorization", "Bearer yours"}}));
  CHECK(mine != StructureStore::key("http://robot/x", {{"Authorization", "Bearer mine"}}));
  CHECK(StructureStore::key("http://a", {{"b", "c"}}) != StructureStore::key("http://a", {{"bc", ""}}));
  CHECK_FALSE(store.find(mine));
  const client::StoredStructure document{"http://robot/", "http://robot/ns/structure", "\"1\"", {"{}", "[]"}};
  store.put(mine, document);
  const auto found = store.find(mine);
  REQUIRE(found);
  CHECK(found->document.pages == document.pages);
  CHECK(found->document.url == document.url);
  store.put(mine, {"http://robot/\nx", "http://robot/ns/structure", "\"2\"", {"{}"}});  // no URL has a line feed
  CHECK(store.find(mine)->document.entity_tag == "\"1\"");
  CHECK_FALSE(store.find("../" + mine));
  store.remove(mine);
  CHECK_FALSE(store.find(mine));
}

TEST_CASE("a structure document of a stranger is judged", "[client][structure]") {
  const auto add = [](const std::string& text) {
    client::StructureReader reader("http://robot/ns/structure");
    Result<void> added = reader.add(text);
    return added ? reader.things(nullptr).has_value() : false;
  };
  const std::string head = R"({"href":"http://robot/ns/structure","structure":"1",)";
  CHECK(add(head + R"("kinds":{},"things":[]})"));
  CHECK(add(head + R"("kinds":{"a":{"properties":{"x":{}}}},"things":[{"path":"/a","kind":"a"}]})"));
  for (const std::string& text :
       {std::string(), std::string("[]"), std::string("{"), head + R"("kinds":{}})", head + R"("kinds":[],"things":[]})",
        head + R"("kinds":{"a":1},"things":[]})", head + R"("kinds":{},"things":[1]})", head + R"("kinds":{},"things":[{"path":"/a","kind":"a"}]})",
        head + R"("kinds":{"a":{}},"things":[{"path":"a","kind":"a"}]})", std::string(R"({"structure":"1","kinds":{},"things":[]})"),
        std::string(R"({"href":"http://elsewhere/ns/structure","structure":"1","kinds":{},"things":[]})"),
        head + R"("kinds":{},"things":[],"next":{"href":"http://elsewhere/"}})"}) {
    CAPTURE(text);
    CHECK_FALSE(add(text));
  }
  client::StructureReader reader("http://robot/ns/structure");
  CHECK(reader.add(head + R"("kinds":{},"things":[],"next":{"href":"http://robot/ns/structure?page=2"}})").has_value());
  CHECK(reader.next() == "http://robot/ns/structure?page=2");
  const std::string other = R"({"href":"http://robot/ns/structure","structure":"2","kinds":{},"things":[]})";
  CHECK(reader.add(other).error().code == Errc::expected_value);
}

// SPDX-License-Identifier: Apache-2.0
#include <lrt/client.hpp>

#include <future>
#include <thread>

#include <lrt/responder.hpp>

#include "tests/client/robot_host.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

/// A robot with an arm and a tool, and a client that has found them.
struct Rig {
  explicit Rig(std::string_view transport = {}, Options options = {}) : host(parts(robot), transport, std::move(options)) {}
  static std::vector<Thing> parts(SampleRobot& robot) {
    std::vector<Thing> things;
    things.push_back(robot.arm());
    things.push_back(robot.tool());
    return things;
  }
  client::Thing arm() { return found().thing("arm").value(); }
  client::Robot found() { return client.open(host.url()).value(); }

  SampleRobot robot;
  RobotHost host;
  Client client = Client::create().value();
};

template <class T>
std::string message_of(const Result<T>& result) {
  return result ? "a value" : result.error().message;
}

}  // namespace

TEST_CASE("a client finds all Things from one URL by links", "[client][R1.6][R0.9]") {
  Rig rig{GENERATE(from_range(transport::names()))};
  const client::Robot robot = rig.found();
  REQUIRE(robot.things().size() == 2);
  CHECK(robot.problems().empty());
  CHECK(robot.requests() == 2);  // the list and the structure document; other parts are read when they are used
  CHECK(robot.things(vocab::ros::RevoluteJoint).size() == 1);
  const client::Thing arm = robot.thing("arm").value();
  CHECK(arm.properties().size() == 9);
  CHECK(arm.names().titles == std::vector<std::string>{"arm", "Arm"});
  CHECK(arm.property(vocab::ros::rotation).value().url() == arm.url() + "/angle");
  CHECK(robot.thing("The tool").value().url() == arm.url() + "/tool");
  CHECK(robot.property("tool/weight").value().name() == "weight");

  SECTION("also from a part") {
    const client::Robot from_part = rig.client.open(arm.url() + "/tool").value();
    CHECK(from_part.things().size() == 2);
    CHECK(from_part.requests() == 3);  // the two Things, and the collection, whose kind no triple says
  }
  SECTION("a name that does not exist is an error that lists what there is") {
    CHECK(message_of(arm.property("colour")) ==
          "\"arm\" has no property \"colour\"; it has rotation, speed, count, name, mode, pose, gains, silent, broken");
    CHECK(robot.thing("leg").error().code == Errc::unknown_path);
  }
}

TEST_CASE("values are read and written with their C++ types", "[client][R0.5][R1.6]") {
  Rig rig{GENERATE(from_range(transport::names()))};
  const client::Thing arm = rig.arm();
  CHECK(arm.property("angle").value().read<double>(unit::degree).value() == 10);
  CHECK(arm.property("speed").value().read<float>().value() == 1.5F);
  CHECK(arm.property("name").value().read<std::string>().value() == "arm 1");
  CHECK(arm.property("mode").value().read<Mode>().value() == Mode::idle);
  CHECK(arm.property("gains").value().read<std::vector<double>>().value() == std::vector<double>{1, 2.5});
  CHECK(arm.property("pose").value().read<Pose>().value().frame == "base");

  CHECK(arm.property("angle").value().write(45.0, {unit::degree}).has_value());
  CHECK(rig.robot.angle == 45);
  CHECK(message_of(arm.property("angle").value().write(30)) == "a value");  // in the declared unit
  CHECK(rig.robot.angle == 30);
  CHECK(arm.property("mode").value().write(Mode::active).has_value());
  CHECK(rig.robot.mode == Mode::active);
  CHECK(arm.property("pose").value().write(Pose{1, 2, "tool", 0.5}).has_value());
  CHECK(rig.robot.pose.frame == "tool");
  CHECK(rig.robot.pose.tolerance == 0.5);
  CHECK(arm.property("gains").value().write(std::vector<double>{3}).has_value());
  CHECK(rig.robot.gains == std::vector<double>{3});
  CHECK(arm.property("angle").value().is_writable().value());
  CHECK_FALSE(arm.property("speed").value().is_writable().value());
  CHECK(arm.property("angle").value().unit().value() == unit::degree);
}

TEST_CASE("another unit is an error, not a conversion", "[client]") {
  Rig rig;
  const client::Property angle = rig.arm().property("angle").value();
  CHECK(angle.read<double>(unit::radian).error().code == Errc::expected_value);
  CHECK(message_of(angle.write(1.0, {unit::radian})) == "expected the unit deg, found rad");
  CHECK(rig.robot.angle == 10);
}

TEST_CASE("in the state of a Thing, a property that the robot cannot read has its error, and the others have their values", "[client][R0.6]") {
  Rig rig{transport::names().front()};
  const client::Thing arm = rig.arm();
  const client::RepresentationPtr state = rig.client.get(arm.state()).value();
  CHECK(*arm.property("speed").value().decode(*state, rdf::traits<float>::type()).value().real() == 1.5);
  CHECK(*arm.property("angle").value().decode(*state, rdf::traits<double>::type(), unit::degree).value().real() == 10);
  const client::Property broken = arm.property("broken").value();
  const Result<rdf::Value> value = broken.decode(*state, rdf::traits<double>::type());
  REQUIRE_FALSE(value);
  CHECK(value.error().code == Errc::failed);
  CHECK(value.error().message == "\"" + broken.url() + "\": it could not be read: it threw: the encoder does not answer");
}

TEST_CASE("an input that violates the published shape is not sent", "[client][R1.11]") {
  Rig rig;
  const client::Thing arm = rig.arm();
  const Result<void> written = arm.property("angle").value().write(91.0);
  REQUIRE_FALSE(written);
  CHECK(written.error().code == Errc::expected_value);
  CHECK(written.error().message.find("not sent") == 0);
  const auto invoked = arm.action("turn").value().invoke(360.0);
  REQUIRE_FALSE(invoked);
  CHECK(invoked.error().message.find("not sent") == 0);

  // Without that judgement the server refuses it, with its own reason.
  client::Options options;
  options.validate = false;
  Client careless = Client::create(options).value();
  const Result<void> refused = careless.open(rig.host.url()).value().property("arm/angle").value().write(91.0);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::expected_value);
  CHECK(refused.error().message.find("422") != std::string::npos);
  CHECK(rig.robot.angle == 10);
}

TEST_CASE("unchanged representations are not transferred again", "[client][R0.11]") {
  Rig rig;
  const client::Property angle = rig.arm().property("angle").value();
  const client::RepresentationPtr first = angle.get().value();
  CHECK_FALSE(first->entity_tag.empty());
  CHECK(angle.get().value() == first);  // the same object: 304
  rig.robot.angle_handle->publish(11);
  const client::RepresentationPtr second = angle.get().value();
  CHECK(second != first);
  CHECK(angle.write(12.0, {unit::none, first->entity_tag}).error().code == Errc::refused);  // 412
  CHECK(angle.write(12.0, {unit::none, second->entity_tag}).has_value());
}

TEST_CASE("actions are invoked by their bindings", "[client][R1.10][R0.8]") {
  Rig rig{GENERATE(from_range(transport::names()))};
  const client::Thing arm = rig.arm();
  const client::Invocation turned = arm.action("turn").value().invoke(43.0).value();
  CHECK(turned.wait(seconds(10)).value().status == client::Invocation::Status::succeeded);
  CHECK(rig.robot.turned_to == 43);
  CHECK(arm.action("home").value().invoke().value().wait(seconds(10)).has_value());
  CHECK(rig.robot.homed == 1);
  const client::Invocation measured = arm.action("measure").value().invoke().value();
  CHECK(measured.result<double>(unit::metre).value() == 2.5);
  CHECK(message_of(arm.action("refuse").value().invoke()) ==
        "POST " + arm.url() + "/actions/refuse: 409: action \"/arm/actions/refuse\" failed: the brake is on");
  CHECK(arm.action("refuse").value().invoke().error().code == Errc::refused);
  CHECK(arm.action("fail").value().invoke().error().code == Errc::failed);
  CHECK_FALSE(arm.action("park").value().is_available().value());  // nothing links to it now, and the structure document has it
}

TEST_CASE("an invocation has a status and progress, and can be cancelled", "[client]") {
  Rig rig;
  const client::Action grip = rig.arm().action("grip").value();
  const client::Invocation first = grip.invoke().value();
  REQUIRE_FALSE(first.url().empty());
  CHECK(first.state().value().status == client::Invocation::Status::running);
  CHECK(first.wait(milliseconds(1)).error().code == Errc::timed_out);
  rig.robot.grips.front().progress(0.5);
  std::vector<double> seen;
  auto ended = std::async(std::launch::async, [&] {
    return first.wait(seconds(20), [&](const client::Invocation::State& state) {
      if (state.progress) seen.push_back(*state.progress);
      if (state.progress == 0.5) rig.robot.grips.front().succeed();
    });
  });
  CHECK(ended.get().value().status == client::Invocation::Status::succeeded);
  CHECK(seen.front() == 0.5);

  const client::Invocation second = grip.invoke().value();
  CHECK(second.cancel().has_value());
  CHECK(second.wait(seconds(10)).value().status == client::Invocation::Status::cancelled);
}

TEST_CASE("actions are found by what they consume, produce and change", "[client][R1.10]") {
  SampleRobot robot;
  Thing arm = robot.arm();
  RobotHost host(one_thing(std::move(arm)));
  Client client = Client::create().value();
  const client::Robot found = client.open(host.url()).value();
  client::ActionQuery query;
  query.consumes = vocab::maths::Scalar;
  const auto consuming = found.actions(query).value();
  REQUIRE(consuming.size() == 1);
  CHECK(consuming.front().name() == "turn");
  query = {};
  query.produces = vocab::maths::Scalar;
  const auto producing = found.actions(query).value();
  REQUIRE(producing.size() == 1);
  CHECK(producing.front().name() == "measure");
}

TEST_CASE("work that waits is done elsewhere, and poll() hands over its result", "[client]") {
  Rig rig;
  const client::Property angle = rig.arm().property("angle").value();
  std::optional<double> read;
  const std::thread::id here = std::this_thread::get_id();
  std::thread::id there;
  REQUIRE(rig.client.async([angle] { return angle.read<double>(); },
                           [&](Result<double> value) {
                             read = value.value();
                             there = std::this_thread::get_id();
                           }));
  while (!read) {
    rig.client.wait(seconds(10));
    rig.client.poll();
  }
  CHECK(read == 10);
  CHECK(there == here);
}

TEST_CASE("a property is watched in poll(), and followed by a control loop", "[client][R0.14]") {
  Rig rig{GENERATE(from_range(transport::names()))};
  const client::Property angle = rig.arm().property("angle").value();
  std::vector<double> seen;
  const client::Watch watch = angle
                                  .watch({},
                                         [&](const client::Change& change) {
                                           if (change.kind == client::Change::Kind::value)
                                             seen.push_back(angle.value_of<double>(change, unit::degree).value());
                                         })
                                  .value();
  client::Latest<double> latest = angle.latest<double>(unit::degree).value();
  const auto wait_for = [&](double wanted) {
    double followed = -1;
    while (seen.empty() || seen.back() != wanted || followed != wanted) {
      rig.client.wait(milliseconds(20));
      rig.client.poll();
      latest.take(followed);
    }
  };
  wait_for(10);
  rig.robot.angle_handle->publish(20);
  wait_for(20);
  CHECK(watch.is_connected());
  CHECK(latest.is_connected());
  CHECK(latest.counts().unreadable == 0);
  const client::Latest<double> wrong_unit = angle.latest<double>(unit::radian).value();
  while (wrong_unit.counts().unreadable == 0) std::this_thread::yield();
}

TEST_CASE("a stopped client says so, and its handles do no harm", "[client]") {
  Rig rig;
  const client::Property angle = rig.arm().property("angle").value();
  rig.client.stop();
  CHECK(angle.read<double>().error().code == Errc::cancelled);
  CHECK_FALSE(rig.client.async([] { return 1; }, [](int) {}));
}

TEST_CASE("a server that is not there is an error", "[client]") {
  Client client = Client::create().value();
  CHECK(client.open("http://127.0.0.1:1/").error().code == Errc::io_error);
  CHECK(client.open("robot").error().code == Errc::expected_iri);
  CHECK(client.open("ftp://127.0.0.1/").error().code == Errc::expected_iri);
}

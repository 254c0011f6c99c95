// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <lrt/thing.hpp>

namespace lrt::test {

enum class Mode : std::uint8_t { idle, active };

struct Pose {
  double x = 0, y = 0;
  std::string frame = "base";
  std::optional<double> tolerance;
};

/// A robot that has one of everything. Its state is open to tests.
class SampleRobot {
 public:
  double angle = 10;                  ///< [deg], pushed, writable, -90 to 90
  float speed = 1.5F;                 ///< pulled, read-only
  std::int32_t count = 7;             ///< pulled, writable
  std::string name = "arm 1";         ///< pulled, writable
  Mode mode = Mode::idle;             ///< pulled, writable
  Pose pose;                          ///< pulled, writable
  std::vector<double> gains{1, 2.5};  ///< pulled, writable
  bool locked = false;                ///< writes and grips are refused
  bool hot = false;                   ///< action grip throws
  double turned_to = -1;              ///< by action turn
  int homed = 0;                      ///< calls of action home
  int thrown = 0;                     ///< exceptions of its lambdas
  std::vector<Responder> grips;       ///< of action grip, for the test to use
  std::vector<std::string> stops;
  std::optional<PushedProperty<double>> angle_handle;

  Thing arm();
  Thing tool() {
    Thing thing{"arm/tool"};
    thing.title("The tool")
        .property(
            "weight", [] { return 0.25; }, unit::kilogram);
    return thing;
  }
};

}  // namespace lrt::test

template <>
struct lrt::rdf::traits<lrt::test::Mode> : lrt::rdf::Enumeration<lrt::test::Mode> {
  static void describe(Enumeration<test::Mode>& e) { e.name(test::Mode::idle, "idle").name(test::Mode::active, "active"); }
};

template <>
struct lrt::rdf::traits<lrt::test::Pose> : lrt::rdf::Record<lrt::test::Pose> {
  static void describe(Record<test::Pose>& r) {
    r.is(vocab::maths::Vector3D);
    r.field(vocab::maths::x, &test::Pose::x).unit(unit::metre);
    r.field(vocab::maths::y, &test::Pose::y).unit(unit::metre);
    r.field("frame", &test::Pose::frame);
    r.field("tolerance", &test::Pose::tolerance).at_least(0);
  }
};

inline lrt::Thing lrt::test::SampleRobot::arm() {
  Thing thing{"arm"};
  thing.type(vocab::ros::RevoluteJoint).add(vocab::rdfs::label, Object::tagged("Arm", "en"));
  const auto guard = [this]() -> Result<void> {
    if (locked) return unexpected(Errc::refused, "the robot is locked");
    return {};
  };
  angle_handle = thing.property<double>("angle", unit::degree).between(-90, 90).predicate(vocab::ros::rotation).on_write([this, guard](double v) {
    Result<void> allowed = guard();
    if (allowed) angle = v;
    return allowed;
  });
  angle_handle->publish(angle);
  thing.property("speed", [this] { return speed; });
  thing.property("count", [this] { return count; }).on_write([this](std::int32_t v) { count = v; });
  thing.property("name", [this] { return name; }).on_write([this](std::string v) { name = std::move(v); });
  thing.property("mode", [this] { return mode; }).on_write([this](Mode v) { mode = v; });
  thing.property("pose", [this] { return pose; }).on_write([this](Pose v) { pose = std::move(v); });
  thing.property("gains", [this] { return gains; }).on_write([this](std::vector<double> v) { gains = std::move(v); });
  thing.property<double>("silent");
  thing.property("broken", [this]() -> double {
    ++thrown;
    throw std::runtime_error("the encoder does not answer");
  });
  thing.action("turn", [this](double to) { turned_to = to; }).consumes(rdf::Facets{}.unit(unit::degree).at_least(0).below(360));
  thing.action("home", [this] { ++homed; });
  thing.action("park", [] {}).available(false, "the brake is hot");
  thing.action("measure", [] { return 2.5; }).produces(rdf::Facets{}.unit(unit::metre));
  thing.action("refuse", []() -> Result<void> { return unexpected(Errc::refused, "the brake is on"); });
  thing.action("fail", [this] {
    ++thrown;
    throw std::runtime_error("the motor is hot");
  });
  thing
      .action("grip",
              [this](Responder done) {
                if (locked) return done.fail({Errc::refused, "the robot is locked"});
                if (hot) {
                  ++thrown;
                  throw std::runtime_error("the motor is hot");
                }
                done.on_cancel([this, n = grips.size()] { stops.push_back("grip " + std::to_string(n)); });
                grips.push_back(std::move(done));
              })
      .policy(ActionPolicy::parallel(3));
  thing.collection<Pose>("waypoints")
      .on_create([guard](const Pose&) { return guard(); })
      .on_remove([guard](const std::string&) { return guard(); })
      .max_members(3);
  return thing;
}

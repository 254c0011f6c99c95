// SPDX-License-Identifier: Apache-2.0
#include "examples/baxter/linked_arm.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace vocab = lrt::vocab;

namespace baxter {
namespace {

constexpr double pi = 3.14159265358979323846;
constexpr double tolerance_rad = 1e-6;  // an angle in degrees is sent and stored as a float
constexpr lrt::Unit newton_metre_second_per_radian{lrt::Iri{"http://qudt.org/vocab/unit/N-M-SEC-PER-RAD"}, {}, "N.m.s/rad"};

/// What `rotate` takes: the joint's limits in degrees, with two digits, not beyond them.
lrt::Facets reach_of(const JointParameters& joint) {
  const auto hundredths = [](double rad) { return rad * 180 / pi * 100; };
  return lrt::Facets(lrt::unit::degree).between(std::ceil(hundredths(joint.lower_rad)) / 100, std::floor(hundredths(joint.upper_rad)) / 100);
}

}  // namespace

lrt::Result<std::array<JointParameters, joint_count>> LinkedArm::parameters(const lrt::urdf::Model& description) {
  std::array<JointParameters, joint_count> all;
  const auto wrong = [](const std::string& sentence) { return lrt::unexpected(lrt::Errc::expected_value, sentence); };
  if (description.variables.size() != joint_count) return wrong("expected 7 joints that move, found " + std::to_string(description.variables.size()));
  for (std::size_t i = 0; i < joint_count; ++i) {
    const lrt::urdf::Joint& joint = description.joints[description.variables[i]];
    if (joint.name != RightArm::name(i)) return wrong(std::string("expected joint ") + RightArm::name(i) + ", found " + joint.name);
    const auto& limits = joint.limits;
    if (!limits || !limits->lower || !limits->upper || !limits->velocity || !limits->effort ||
        !(*limits->lower <= 0 && *limits->upper >= 0 && *limits->velocity > 0))
      return wrong("expected limits with 0 rad between them, a velocity and an effort, in joint " + joint.name);
    all[i] = {*limits->lower, *limits->upper, *limits->velocity, *limits->effort, joint.dynamics ? joint.dynamics->damping : 0};
  }
  return all;
}

LinkedArm::LinkedArm(RightArm& arm, lrt::urdf::Robot description) : arm_(arm), robot_(std::move(description)) {
  robot_.thing().title("Baxter's right arm", "en").description("Seven joints, from the shoulder to the wrist.", "en");
  add_stop();
  lrt::Action move_all = robot_.thing()
                             .action("moveTo", [this](const JointAngles& target, lrt::Responder done) { move_to(target, done); })
                             .title("Move all joints", "en")
                             .description("All joints rotate at the same time, each to its target angle.", "en")
                             .policy(lrt::ActionPolicy::preempt());
  for (std::size_t i = 0; i < joint_count; ++i) {
    const std::size_t index = robot_.model().variables[i];
    const std::string rotation = robot_.joint_path(index) + "/rotation";
    const auto& position = robot_.position(index);
    const lrt::Facets reach = reach_of(arm_.parameters(i));
    robot_.position(index).on_write([this, i](double target_rad) {
      take_over(i);
      arm_.move_to(i, target_rad);
    });
    lrt::Thing& joint = robot_.joint(index);
    joint
        .property(
            "friction", [this, i] { return arm_.friction(i); }, newton_metre_second_per_radian)
        .title("Friction", "en")
        .description("The coefficient of viscous friction that the control loop uses.", "en")
        .predicate(vocab::ros::friction)
        .between(0, arm_.greatest_friction(i))
        .harmless()
        .on_write([this, i](double coefficient) { arm_.set_friction(i, coefficient); });
    lrt::Action rotate_one = joint.action("rotate", [this, i](float target_deg, lrt::Responder done) { rotate(i, target_deg, std::move(done)); })
                                 .title("Rotate", "en")
                                 .description("Turns the joint to an angle within its limits.", "en")
                                 .consumes(reach)
                                 .effect(position, lrt::from_input.within(tolerance_rad))
                                 .effect(rotation)
                                 .policy(lrt::ActionPolicy::preempt());
    move_all.composed_of(rotate_one)
        .consumes(RightArm::name(i), reach)
        .effect(position, lrt::from_input.field(RightArm::name(i)).within(tolerance_rad))
        .effect(rotation);
  }
}

/// The stop of the arm: publish() obeys the flag in each period.
void LinkedArm::add_stop() {
  lrt::Action release = robot_.thing().action("release", [this] { stopped_ = false; });
  release.title("Release", "en").description("Ends the stop. The arm stays where it is until the next command.", "en");
  robot_.thing()
      .action("stop", [this] { stopped_ = true; })
      .title("Stop", "en")
      .description("All joints brake, and take no command until the release.", "en")
      .stop([this] { return stopped_.load(); }, release);
}

double LinkedArm::target_rad(std::size_t index, double target_deg) const noexcept {
  const JointParameters& joint = arm_.parameters(index);
  return std::clamp(target_deg * pi / 180, joint.lower_rad, joint.upper_rad);  // a float may be rounded
}

void LinkedArm::take_over(std::size_t index) {
  std::exchange(moves_[index], {}).fail(std::string(RightArm::name(index)) + " was given another target by a later command");
}

/// Figure 5. The server has compared the angle with the joint's limits.
void LinkedArm::rotate(std::size_t index, double target_deg, lrt::Responder done) {
  take_over(index);
  arm_.move_to(index, target_rad(index, target_deg));
  done.on_cancel([this, index] { arm_.stop(index); });
  moves_[index] = std::move(done);
}

/// All joints rotate at the same time.
void LinkedArm::move_to(const JointAngles& target, const lrt::Responder& done) {
  const std::vector<lrt::Responder> parts = done.split(joint_count);
  for (std::size_t i = 0; i < joint_count; ++i) rotate(i, target.degrees[i], parts[i]);
}

lrt::Result<void> LinkedArm::add_to(lrt::Server& server) {
  publish();  // so that all properties have a value
  return robot_.add_to(server);
}

void LinkedArm::publish() noexcept {
  std::array<double, joint_count> positions, velocities;
  for (std::size_t i = 0; i < joint_count; ++i) {
    positions[i] = arm_.position(i);
    velocities[i] = arm_.velocity(i);
  }
  robot_.publish(positions, velocities);
  if (stopped_)
    for (std::size_t i = 0; i < joint_count; ++i) arm_.stop(i);
  for (std::size_t i = 0; i < joint_count; ++i) {
    lrt::Responder& move = moves_[i];
    if (!move) continue;
    if (move.cancelled()) move = {};
    else if (!arm_.moving(i)) move.succeed();
    else move.progress(arm_.progress(i));
  }
}

}  // namespace baxter

void lrt::rdf::traits<baxter::JointAngles>::describe(Record& r) {
  for (std::size_t i = 0; i < baxter::joint_count; ++i)
    r.field(
         baxter::RightArm::name(i), [i](const baxter::JointAngles& a) { return a.degrees[i]; },
         [i](baxter::JointAngles& a, float degrees) { a.degrees[i] = degrees; })
        .title(std::string("Angle of ") + baxter::RightArm::name(i), "en")
        .unit(lrt::unit::degree);
}

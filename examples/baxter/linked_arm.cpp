#include "examples/baxter/linked_arm.hpp"

#include <cstdio>
#include <utility>

namespace vocab = lrt::vocab;

namespace baxter {
namespace {

constexpr double pi = 3.14159265358979323846;
constexpr lrt::Unit newton_metre_second_per_radian{lrt::Iri{"http://qudt.org/vocab/unit/N-M-SEC-PER-RAD"}, {}, "N.m.s/rad"};

}  // namespace

lrt::Result<std::array<JointParameters, joint_count>> LinkedArm::parameters(const lrt::urdf::Model& description) {
  std::array<JointParameters, joint_count> all;
  const auto wrong = [](const std::string& sentence) { return lrt::unexpected(lrt::Errc::expected_value, sentence); };
  if (description.variables.size() != joint_count)
    return wrong("expected 7 joints that move, found " + std::to_string(description.variables.size()));
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
  robot_.thing().title("Baxter's right arm");
  for (std::size_t i = 0; i < joint_count; ++i) {
    const std::size_t index = robot_.model().variables[i];
    robot_.position(index).on_write([this, i](double target_rad) {
      moves_[i] = {};  // a running `rotate` gets another target now: it fails
      arm_.move_to(i, target_rad);
    });
    lrt::Thing& joint = robot_.joint(index);
    joint.property("friction", [this, i] { return arm_.friction(i); }, newton_metre_second_per_radian)
        .predicate(vocab::ros::friction)
        .between(0, arm_.greatest_friction(i))
        .on_write([this, i](double coefficient) { arm_.set_friction(i, coefficient); });
    joint.action("rotate", [this, i](float target_deg, lrt::Responder done) { rotate(i, target_deg, std::move(done)); })
        .unit(lrt::unit::degree)
        .at_least(0)
        .below(360)
        .policy(lrt::ActionPolicy::preempt());
  }
}

/// Figure 5: the target angle is taken modulo 360 degrees, as an angle that the joint can reach.
void LinkedArm::rotate(std::size_t index, double target_deg, lrt::Responder done) {
  for (const double turn : {0.0, -360.0}) {
    if (arm_.move_to(index, (target_deg + turn) * pi / 180) != MoveResult::accepted) continue;
    done.on_cancel([this, index] { arm_.stop(index); });
    moves_[index] = std::move(done);
    return;
  }
  const JointParameters& joint = arm_.parameters(index);
  char text[160];
  std::snprintf(text, sizeof text, "%g degrees is outside the limits of %s: %.1f to %.1f degrees, modulo 360", target_deg,
                RightArm::name(index), joint.lower_rad * 180 / pi, joint.upper_rad * 180 / pi);
  done.fail({lrt::Errc::refused, text});
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
  for (std::size_t i = 0; i < joint_count; ++i) {
    lrt::Responder& move = moves_[i];
    if (!move) continue;
    if (move.cancelled()) move = {};
    else if (!arm_.moving(i)) move.succeed();
    else move.progress(arm_.progress(i));
  }
}

}  // namespace baxter

// SPDX-License-Identifier: Apache-2.0
#include "examples/ex_urdf_robot/moving_robot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace ex_urdf_robot {

MovingRobot::MovingRobot(lrt::urdf::Robot robot, std::optional<Trajectory> trajectory)
    : robot_(std::move(robot)), trajectory_(std::move(trajectory)), variables_(robot_.model().variables.size()) {
  const double unknown = std::numeric_limits<double>::quiet_NaN();  // publish() ignores it
  positions_.assign(variables_.size(), 0);
  velocities_.assign(variables_.size(), trajectory_ ? unknown : 0);
  efforts_.assign(variables_.size(), unknown);
  for (std::size_t v = 0; v < variables_.size(); ++v) {
    const auto& limits = robot_.model().joints[robot_.model().variables[v]].limits;
    if (limits) positions_[v] = limits->clamp(0);
    if (limits && limits->velocity.value_or(0) > 0) variables_[v].velocity = *limits->velocity;  // 0 in many files: unknown
    variables_[v].target = positions_[v];
    if (!trajectory_) command(v);
  }
  if (!trajectory_) add_stop();
}

/// What moves is unavailable until the release, and step() obeys the flag.
void MovingRobot::add_stop() {
  lrt::Action release = robot_.thing().action("release", [this] { stopped_ = false; });
  release.title("Release", "en");
  robot_.thing().action("stop", [this] { stopped_ = true; }).title("Stop", "en").stop([this] { return stopped_.load(); }, release);
}

/// Lets clients set the target of a joint.
void MovingRobot::command(std::size_t variable) {
  const std::size_t index = robot_.model().variables[variable];
  const lrt::urdf::Joint& joint = robot_.model().joints[index];
  if (!joint.takes_commands) return;
  lrt::Facets facets(joint.type == lrt::urdf::JointType::prismatic ? lrt::unit::metre : lrt::unit::radian);
  if (joint.limits && joint.limits->lower) facets.at_least(*joint.limits->lower);
  if (joint.limits && joint.limits->upper) facets.at_most(*joint.limits->upper);
  robot_.position(index).on_write([this, variable](double target) {
    variables_[variable].target = target;
    variables_[variable].move = {};  // a running move gets another target now: it fails
  });
  robot_.joint(index)
      .action("move",
              [this, variable](double target, lrt::Responder done) {
                Variable& v = variables_[variable];
                v.target = target;
                v.start = positions_[variable];
                done.on_cancel([this, variable] { variables_[variable].target = positions_[variable]; });
                v.move = std::move(done);
              })
      .consumes(facets)
      .effect(robot_.position(index), lrt::from_input)
      .policy(lrt::ActionPolicy::preempt());
}

void MovingRobot::follow_commands() noexcept {
  for (std::size_t i = 0; i < variables_.size(); ++i) {
    Variable& v = variables_[i];
    if (stopped_) v.target = positions_[i];
    const double most = v.velocity * step_period_s, way = std::clamp(v.target - positions_[i], -most, most);
    positions_[i] += way;
    velocities_[i] = way / step_period_s;
    if (std::abs(v.target - positions_[i]) < 1e-12) positions_[i] = v.target;
  }
}

void MovingRobot::report(Variable& v, double position) noexcept {
  if (v.move.cancelled()) v.move = {};
  else if (position == v.target) v.move.succeed();
  else v.move.progress((position - v.start) / (v.target - v.start));
}

void MovingRobot::step() noexcept {
  if (trajectory_) trajectory_->at(static_cast<double>(steps_++) * step_period_s, positions_, velocities_, efforts_);
  else follow_commands();
  robot_.publish(positions_, velocities_, efforts_);
  for (std::size_t i = 0; i < variables_.size(); ++i)  // after the position is published, which the effect of `move` names
    if (variables_[i].move) report(variables_[i], positions_[i]);
}

}  // namespace ex_urdf_robot

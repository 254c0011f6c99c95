// SPDX-License-Identifier: Apache-2.0
#include "examples/baxter/right_arm.hpp"

#include <algorithm>
#include <cmath>

namespace baxter {
namespace {

constexpr double friction_share = 0.9;  // share of the drive's torque that friction may take at the maximum speed

constexpr const char* names[joint_count] = {"right_s0", "right_s1", "right_e0", "right_e1", "right_w0", "right_w1", "right_w2"};
// Inertia of everything that a joint carries, about its axis [kg m^2]. Estimated, taken as constant.
constexpr double inertias[joint_count] = {12.5, 25, 10, 10, 1.5, 1.5, 1};

}  // namespace

RightArm::RightArm(const std::array<JointParameters, joint_count>& parameters) noexcept : parameters_(parameters) {
  for (std::size_t i = 0; i < joint_count; ++i) set_friction(i, parameters[i].friction_nms_rad);
}

const char* RightArm::name(std::size_t joint) noexcept { return names[joint]; }

double RightArm::greatest_friction(std::size_t joint) const noexcept {
  return friction_share * parameters_[joint].effort_nm / parameters_[joint].velocity_rad_s;
}

double RightArm::acceleration(std::size_t joint) const noexcept {
  const JointParameters& p = parameters_[joint];
  return (p.effort_nm - joints_[joint].friction * p.velocity_rad_s) / inertias[joint];
}

double RightArm::deceleration(std::size_t joint) const noexcept { return parameters_[joint].effort_nm / inertias[joint]; }

double RightArm::set_friction(std::size_t joint, double friction_nms_rad) noexcept {
  double& friction = joints_[joint].friction;
  if (!std::isnan(friction_nms_rad)) friction = std::clamp(friction_nms_rad, 0.0, greatest_friction(joint));
  return friction;
}

double RightArm::progress(std::size_t joint) const noexcept {
  const Joint& j = joints_[joint];
  return moving(joint) ? static_cast<double>(j.step) / static_cast<double>(j.last_step) : 1.0;
}

MoveResult RightArm::move_to(std::size_t joint, double target_rad) noexcept {
  if (std::isnan(target_rad)) return MoveResult::not_a_number;
  if (target_rad < parameters_[joint].lower_rad) return MoveResult::below_lower_limit;
  if (target_rad > parameters_[joint].upper_rad) return MoveResult::above_upper_limit;
  start(joint, target_rad, false);
  return MoveResult::accepted;
}

void RightArm::stop(std::size_t joint) noexcept {
  if (moving(joint)) start(joint, 0, true);
}

void RightArm::start(std::size_t joint, double target, bool only_brake) noexcept {
  Joint& j = joints_[joint];
  const JointParameters& limit = parameters_[joint];
  Profile p;
  p.acceleration = acceleration(joint);
  p.deceleration = deceleration(joint);

  // The joint must come to rest first if it moves in the wrong direction or too fast.
  const double speed = std::abs(j.velocity);
  const double direction = j.velocity < 0 ? -1 : 1;
  const double braking_distance = speed * speed / (2 * p.deceleration);
  p.turn = j.position;
  p.turn_velocity = speed;
  p.sign = direction;
  if (speed > 0 && (only_brake || direction * (target - j.position) < braking_distance)) {
    p.start_braking = -direction * p.deceleration;
    p.t_turn = speed / p.deceleration;
    // Every move ends within the limits, so braking from any of its points does too, except for rounding.
    p.turn = std::clamp(j.position + direction * braking_distance, limit.lower_rad, limit.upper_rad);
    p.turn_velocity = 0;
  }
  if (only_brake) target = p.turn;
  if (p.turn_velocity == 0) p.sign = target < p.turn ? -1 : 1;

  // Accelerate to the peak and brake from there: both distances together must not exceed the whole distance.
  const double way = std::abs(target - p.turn);
  const double v = p.turn_velocity;
  p.peak = std::sqrt((way + v * v / (2 * p.acceleration)) / (1 / (2 * p.acceleration) + 1 / (2 * p.deceleration)));
  p.peak = std::max(v, std::min(p.peak, limit.velocity_rad_s));
  const double way_cruising = way - (p.peak * p.peak - v * v) / (2 * p.acceleration) - p.peak * p.peak / (2 * p.deceleration);
  p.t_accelerated = p.t_turn + (p.peak - v) / p.acceleration;
  p.t_brake = p.t_accelerated + (way_cruising > 0 ? way_cruising / p.peak : 0);
  p.duration = p.t_brake + p.peak / p.deceleration;

  j.profile = p;
  j.target = target;
  j.step = 0;
  // Whole periods; up to one millionth of a period is rounding.
  j.last_step = static_cast<std::uint32_t>(std::ceil(p.duration / step_period_s - 1e-6));
  if (j.last_step == 0) {
    j.position = target;
    j.velocity = 0;
  }
}

void RightArm::step() noexcept {
  ++steps_;
  for (std::size_t i = 0; i < joint_count; ++i) {
    Joint& j = joints_[i];
    if (j.step >= j.last_step) continue;
    const Profile& p = j.profile;
    const double t = static_cast<double>(++j.step) * step_period_s;
    if (j.step == j.last_step) {
      j.position = j.target;
      j.velocity = 0;
    } else if (t < p.t_turn) {
      const double left = p.t_turn - t;  // counted from the end, so that the end is exact
      j.position = p.turn + p.start_braking * left * left / 2;
      j.velocity = -p.start_braking * left;
    } else if (t < p.t_accelerated) {
      const double gone = t - p.t_turn;
      j.position = p.turn + p.sign * (p.turn_velocity + p.acceleration * gone / 2) * gone;
      j.velocity = p.sign * (p.turn_velocity + p.acceleration * gone);
    } else if (t < p.t_brake) {
      j.position = j.target - p.sign * (p.peak * p.peak / (2 * p.deceleration) + p.peak * (p.t_brake - t));
      j.velocity = p.sign * p.peak;
    } else {
      const double left = std::max(0.0, p.duration - t);
      j.position = j.target - p.sign * p.deceleration * left * left / 2;
      j.velocity = p.sign * p.deceleration * left;
    }
  }
}

}  // namespace baxter

// SPDX-License-Identifier: Apache-2.0
#pragma once

// The right arm of a Rethink Robotics Baxter: seven revolute joints, each with its own drive.
//
// Units: angles rad, velocities rad/s, accelerations rad/s^2, torques N m, times s.

#include <array>
#include <cstddef>
#include <cstdint>

namespace baxter {

constexpr std::size_t joint_count = 7;
constexpr double step_period_s = 0.001;

/// Index of a joint, from the shoulder to the wrist.
enum JointIndex : std::size_t { right_s0, right_s1, right_e0, right_e1, right_w0, right_w1, right_w2 };

/// The data of a joint that its drive needs.
struct JointParameters {
  double lower_rad;         ///< minimum position
  double upper_rad;         ///< maximum position
  double velocity_rad_s;    ///< maximum speed, both directions
  double effort_nm;         ///< maximum torque of the drive
  double friction_nms_rad;  ///< viscous friction of a new joint
};

enum class MoveResult : std::uint8_t {
  accepted,
  below_lower_limit,
  above_upper_limit,
  not_a_number,
};

/// Seven independent position drives with trapezoidal velocity profiles.
///
/// Not thread-safe: the control thread owns it. Nothing here allocates, locks or throws, and equal calls give equal numbers.
/// Every `joint` argument must be less than joint_count.
class RightArm {
 public:
  /// At rest, every joint at 0 rad, which its limits must include.
  explicit RightArm(const std::array<JointParameters, joint_count>& parameters) noexcept;

  /// "right_s1"
  static const char* name(std::size_t joint) noexcept;
  const JointParameters& parameters(std::size_t joint) const noexcept { return parameters_[joint]; }

  /// Moves one control period of step_period_s on.
  void step() noexcept;
  /// Time since construction [s], a multiple of step_period_s.
  double time() const noexcept { return static_cast<double>(steps_) * step_period_s; }

  /// Starts a move from the present position and velocity. It replaces the present move. If it is refused, nothing changes.
  MoveResult move_to(std::size_t joint, double target_rad) noexcept;
  /// Brakes as hard as the drive can. Braking becomes the present move.
  void stop(std::size_t joint) noexcept;

  double position(std::size_t joint) const noexcept { return joints_[joint].position; }  ///< [rad]
  double velocity(std::size_t joint) const noexcept { return joints_[joint].velocity; }  ///< [rad/s]
  bool moving(std::size_t joint) const noexcept { return joints_[joint].step < joints_[joint].last_step; }
  /// The end of the present move [rad]; the position when at rest.
  double target(std::size_t joint) const noexcept { return joints_[joint].target; }
  /// Part of the present move's duration that has passed, 0..1; 1 when at rest.
  double progress(std::size_t joint) const noexcept;
  /// The duration of the present move [s]; 0 before the first move.
  double duration(std::size_t joint) const noexcept { return joints_[joint].profile.duration; }

  /// Viscous friction of the joint [N m s/rad].
  ///
  /// A move accelerates at (effort - friction * maximum speed) / inertia. It brakes at effort / inertia, independent of the friction.
  double friction(std::size_t joint) const noexcept { return joints_[joint].friction; }
  /// The maximum friction of the model [N m s/rad]; the minimum is 0.
  double greatest_friction(std::size_t joint) const noexcept;
  /// Has an effect from the next move on. Clamped to 0..greatest_friction(joint); NaN changes nothing.
  /// @return the coefficient now in effect
  double set_friction(std::size_t joint, double friction_nms_rad) noexcept;

  /// The acceleration of a move that starts now [rad/s^2].
  double acceleration(std::size_t joint) const noexcept;
  /// The deceleration of braking [rad/s^2].
  double deceleration(std::size_t joint) const noexcept;

 private:
  // One move in up to four phases: brake to rest (if the direction changes), accelerate, cruise, brake at the target.
  // Times since its start [s]; `sign` is the direction of the last three.
  struct Profile {
    double start_braking = 0;            // acceleration in the first phase, against the motion
    double turn = 0, turn_velocity = 0;  // position and speed where the second phase starts
    double sign = 1, peak = 0;           // speed of the third phase
    double acceleration = 0, deceleration = 0;
    double t_turn = 0, t_accelerated = 0, t_brake = 0, duration = 0;
  };
  struct Joint {
    double position = 0, velocity = 0, target = 0, friction = 0;
    Profile profile;
    std::uint32_t step = 0, last_step = 0;
  };

  void start(std::size_t joint, double target, bool only_brake) noexcept;

  std::array<JointParameters, joint_count> parameters_;
  std::array<Joint, joint_count> joints_;
  std::uint64_t steps_ = 0;
};

}  // namespace baxter

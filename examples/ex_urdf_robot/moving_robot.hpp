// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <optional>
#include <vector>

#include <lrt/lrt.hpp>
#include <lrt/urdf.hpp>

#include "examples/ex_urdf_robot/trajectory.hpp"

namespace ex_urdf_robot {

constexpr double step_period_s = 0.001;

/// A robot that follows a recording. Without a recording it follows its clients: each position can be written, and each joint has an action
/// `move`; it moves at the joint's maximum velocity. Everything runs on the thread that steps it and polls the server.
class MovingRobot {
 public:
  explicit MovingRobot(lrt::urdf::Robot robot, std::optional<Trajectory> trajectory = {});
  MovingRobot(const MovingRobot&) = delete;
  MovingRobot& operator=(const MovingRobot&) = delete;

  template <class Host>
  lrt::Result<void> add_to(Host& host) {
    return robot_.add_to(host);
  }
  /// Moves for one period and publishes.
  void step() noexcept;
  const lrt::urdf::Robot& robot() const noexcept { return robot_; }

 private:
  struct Variable {
    double target = 0, start = 0, velocity = 1;  ///< [rad, m, /s]
    lrt::Responder move;                         ///< the running move, or empty
  };
  void command(std::size_t variable);
  void add_stop();
  void follow_commands() noexcept;
  static void report(Variable& v, double position) noexcept;

  lrt::urdf::Robot robot_;
  std::optional<Trajectory> trajectory_;
  std::vector<Variable> variables_;
  std::vector<double> positions_, velocities_, efforts_;
  std::size_t steps_ = 0;
  std::atomic<bool> stopped_{false};  ///< set on the thread of the server
};

}  // namespace ex_urdf_robot

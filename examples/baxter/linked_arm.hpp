// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <string>

#include <lrt/lrt.hpp>
#include <lrt/urdf.hpp>

#include "examples/baxter/right_arm.hpp"

namespace baxter {

/// The input of `moveTo`: for each joint an angle as `rotate` takes it. The bounds are those of the description.
struct JointAngles {
  std::array<float, joint_count> degrees{};
};

/// Makes a RightArm a tree of Linked Robotic Things below /baxter. lrt::urdf adds the joints and links of its description, as in Figures 2b and
/// 3 of the paper. This class adds the actions: `rotate` of each joint, as in Figure 5, and `moveTo` of the robot, which is composed of
/// them. Everything runs on the thread that steps the arm and polls the server.
class LinkedArm {
 public:
  /// @param description  the robot of this arm
  LinkedArm(RightArm& arm, lrt::urdf::Robot description);
  LinkedArm(const LinkedArm&) = delete;  // its lambdas hold its address
  LinkedArm& operator=(const LinkedArm&) = delete;

  /// The data of the arm's joints in a description.
  /// @par Errors  expected_value: the description does not have the arm's seven joints in their order, each with limits around 0 rad
  static lrt::Result<std::array<JointParameters, joint_count>> parameters(const lrt::urdf::Model& description);

  /// Registers all Things.
  lrt::Result<void> add_to(lrt::Server& server);
  /// Publishes positions and velocities and ends the moves that have reached their targets. Call it after each RightArm::step.
  void publish() noexcept;

 private:
  void add_stop();
  double target_rad(std::size_t index, double target_deg) const noexcept;
  void rotate(std::size_t index, double target_deg, lrt::Responder done);
  void move_to(const JointAngles& target, const lrt::Responder& done);
  /// The joint gets another target: the command that moves it fails.
  void take_over(std::size_t index);

  RightArm& arm_;
  lrt::urdf::Robot robot_;
  std::atomic<bool> stopped_{false};               ///< set on the thread of the server
  std::array<lrt::Responder, joint_count> moves_;  ///< of each joint: its running `rotate` or its part of a running `moveTo`, or empty
};

}  // namespace baxter

template <>
struct lrt::rdf::traits<baxter::JointAngles> : lrt::rdf::Record<baxter::JointAngles> {
  static void describe(Record& r);
};

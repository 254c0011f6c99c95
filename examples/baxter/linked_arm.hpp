#pragma once

#include <array>
#include <cstddef>
#include <string>

#include <lrt/lrt.hpp>
#include <lrt/urdf.hpp>

#include "examples/baxter/right_arm.hpp"

namespace baxter {

/// Makes a RightArm a tree of Linked Robotic Things below /baxter: what its description says of joints and links is there by lrt::urdf, as in
/// Figures 2b and 3 of the paper; what the arm can do is added here, as in Figure 5. Everything runs on the thread that steps the arm and
/// polls the server.
class LinkedArm {
 public:
  /// @param description  the robot of this arm
  LinkedArm(RightArm& arm, lrt::urdf::Robot description);
  LinkedArm(const LinkedArm&) = delete;  // its Things hold its address
  LinkedArm& operator=(const LinkedArm&) = delete;

  /// What a description says of the arm's joints.
  /// @par Errors  expected_value: it has not the arm's seven joints in their order, each with limits and 0 rad between them
  static lrt::Result<std::array<JointParameters, joint_count>> parameters(const lrt::urdf::Model& description);

  /// Registers all Things.
  lrt::Result<void> add_to(lrt::Server& server);
  /// Hands positions and velocities over and ends the moves that have arrived; call it after each RightArm::step.
  void publish() noexcept;

 private:
  void rotate(std::size_t index, double target_deg, lrt::Responder done);

  RightArm& arm_;
  lrt::urdf::Robot robot_;
  std::array<lrt::Responder, joint_count> moves_;  ///< of each joint: of the `rotate` that is under way, if one is
};

}  // namespace baxter

#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>

#include <lrt/lrt.hpp>

#include "examples/baxter/right_arm.hpp"

namespace baxter {

/// Makes a RightArm a tree of Linked Robotic Things below /baxter: seven joints as in Figures 2b, 3 and 5 of the paper, and the links
/// around them. Everything runs on the thread that steps the arm and polls the server.
class LinkedArm {
 public:
  explicit LinkedArm(RightArm& arm) : arm_(arm) {}

  /// Registers all Things.
  lrt::Result<void> add_to(lrt::Server& server);
  /// Hands the positions over and ends the moves that have arrived; call it after each RightArm::step.
  void publish() noexcept;

 private:
  /// Figure 3: a rotation as spatial:AxisAngle.
  struct AxisAngle {
    struct Axis {
      float x = 0, y = 0, z = 1;
    };
    float angle_rad = 0;
    Axis axis;
  };
  struct Vector {
    double x = 0, y = 0, z = 0;
  };
  /// Where the joint sits in the frame of the link before it; angles about the fixed axes x, y, z in this order.
  struct Frame {
    Vector origin_m, roll_pitch_yaw_rad;
    std::string parent_link;
  };
  struct Joint {
    std::optional<lrt::Property<AxisAngle>> rotation;
    lrt::Responder move;  ///< of the `rotate` that is under way, if one is
  };
  friend struct lrt::rdf::traits<AxisAngle>;
  friend struct lrt::rdf::traits<AxisAngle::Axis>;
  friend struct lrt::rdf::traits<Vector>;
  friend struct lrt::rdf::traits<Frame>;

  lrt::Thing make_joint(std::size_t index);
  void rotate(std::size_t index, double target_deg, lrt::Responder done);

  RightArm& arm_;
  std::array<Joint, joint_count> joints_;
};

}  // namespace baxter

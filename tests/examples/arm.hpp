#pragma once

#include <array>
#include <string>

#include "examples/baxter/linked_arm.hpp"

namespace lrt::test {

inline const std::string arm_file = LRT_SOURCE_DIR "/examples/baxter/right_arm.urdf";

/// What that file says; read once.
inline const std::array<baxter::JointParameters, baxter::joint_count>& arm_parameters() {
  static const auto parameters = baxter::LinkedArm::parameters(urdf::load(arm_file).value().model()).value();
  return parameters;
}

}  // namespace lrt::test

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "examples/baxter/linked_arm.hpp"
#include "tests/urdf/documents.hpp"

namespace lrt::test {

/// What the arm's description says; read once.
inline const std::array<baxter::JointParameters, baxter::joint_count>& arm_parameters() {
  static const auto parameters = baxter::LinkedArm::parameters(urdf::load(arm_file).value().model()).value();
  return parameters;
}

}  // namespace lrt::test

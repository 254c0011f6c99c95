// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

/// A message schema of ten records, as a generator writes it. It knows nothing of lrt.
namespace cell {

enum class Mode : std::uint8_t { idle, manual, automatic, fault };
enum class Blend : std::uint8_t { none, corner, parabolic };

struct Vector3 {
  double x = 0, y = 0, z = 0;
};
struct Quaternion {
  double x = 0, y = 0, z = 0, w = 1;
};
struct Pose {
  Vector3 position;
  Quaternion orientation;
};
struct MoveJ {
  std::array<double, 6> joints{};
  double speed = 0.5;
};
struct MoveL {
  Pose target;
  double speed = 0.1;
  Blend blend = Blend::none;
};
struct Wait {
  double seconds = 0;
};
struct Step {
  std::string name;
  std::variant<MoveJ, MoveL, Wait> what;
};
struct Tool {
  std::string name;
  double mass = 0;
  Pose flange;
};
struct Program {
  std::string name;
  std::vector<Step> steps;
  std::optional<Tool> tool;
};
struct Status {
  Mode mode = Mode::idle;
  std::uint32_t step = 0;
  Pose now;
  std::vector<std::string> warnings;
};

}  // namespace cell

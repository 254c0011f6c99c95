// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace lrt::test {

inline const std::string picker_file = LRT_SOURCE_DIR "/examples/ex_urdf_robot/picker.urdf";
inline const std::string arm_file = LRT_SOURCE_DIR "/examples/baxter/right_arm.urdf";
/// Descriptions of real robots. They are read from a directory beside the checkout and are not part of it.
inline const std::string real_robots = LRT_SHARED_DIR "/robots/urdf/";

struct RealRobot {
  const char* file;
  std::size_t links, joints, variables;  ///< as counted by other readers
};
inline constexpr RealRobot all_real_robots[] = {
    {"baxter.urdf", 49, 48, 15}, {"panda.urdf", 13, 12, 8}, {"pr2.urdf", 82, 81, 20}, {"turtlebot3_burger.urdf", 7, 6, 2}};

/// Two links and a joint between them; `more` stands in the joint, `links` and `joints` beside it.
inline std::string two_links(const std::string& type = "fixed", const std::string& more = {}, const std::string& beside = {}) {
  return "<robot name=\"r\">\n<link name=\"a\"/>\n<link name=\"b\"/>\n<joint name=\"j\" type=\"" + type +
         "\">\n<parent link=\"a\"/><child link=\"b\"/>" + more + "</joint>\n" + beside + "</robot>";
}

}  // namespace lrt::test

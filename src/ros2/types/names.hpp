// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace lrt::ros2 {

/// Whether it is a full name of a node, topic, service or action: "/arm/joint_states". Names of DDS that ROS cannot have
/// are none, and neither is anything longer than 255 bytes.
bool is_full_name(std::string_view name) noexcept;
/// Whether it is the name of a type: "PACKAGE/msg/NAME", "PACKAGE/srv/NAME", "PACKAGE/action/NAME", with any suffix "_Request" and the like.
bool is_type_name(std::string_view type) noexcept;
/// "sensor_msgs::msg::dds_::JointState_" of "sensor_msgs/msg/JointState". @pre is_type_name()
std::string dds_type_of(std::string_view ros_type);
/// The reverse; empty: it is not a type of ROS 2.
std::string ros_type_of(std::string_view dds_type);
/// "sensor_msgs.JointState" of "sensor_msgs/msg/JointState", "demo.Grasp_Request" of "demo/srv/Grasp_Request": the default name of a record.
std::string record_name_of(std::string_view ros_type);
/// Whether a name fits a pattern: `*` matches any characters but '/' and ':', `**` any characters.
/// @par Time  At most pattern times name, without recursion.
bool fits(std::string_view pattern, std::string_view name) noexcept;

}  // namespace lrt::ros2

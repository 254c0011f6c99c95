// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/ros2/definitions.hpp>

#include "src/ros2/bridge/core.hpp"

namespace lrt::ros2 {

/// Takes samples of sensor_msgs/msg/JointState for the joints of a robot.
/// @par Threads  Any, one sample at a time.
class JointSink {
 public:
  virtual ~JointSink() = default;
  /// @par Time  No allocation.
  virtual void take(std::string_view payload, std::chrono::system_clock::time_point at) noexcept = 0;
};
/// That of the robot of a namespace; null: no description has come.
std::shared_ptr<JointSink> joints_of(Core& core, const std::string& ns);
/// Nobody writes its joint states now: the joints have no positions until somebody does.
void lose_joints(Core& core, const std::string& ns);
/// Whether a message is a JointState as JointSink reads it.
bool is_joint_state(const Message& message) noexcept;

/// Takes samples of tf2_msgs/msg/TFMessage: each frame becomes a Thing with its pose in its parent.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  /// @param writer  the topic, "/tf_static": its frames are gone when it is
  virtual void take(const Bytes& payload, std::string_view topic) noexcept = 0;
  /// Nobody writes the topic now.
  virtual void lose(std::string_view topic, const std::string& reason) = 0;
};
std::shared_ptr<FrameSink> frames_of(Core& core, const std::string& ns);
bool is_tf_message(const Message& message) noexcept;

/// The Thing of a link or a frame with this name; empty: there is none.
std::string thing_of_frame(Core& core, const std::string& ns, const std::string& frame);

}  // namespace lrt::ros2

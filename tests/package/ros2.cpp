// SPDX-License-Identifier: Apache-2.0
// A host of lrt::ros2 that reads and makes messages. No network is needed.
#include <lrt/lrt.hpp>
#include <lrt/ros2.hpp>
#include <lrt/ros2/message_type.hpp>

int main() {
  const lrt::ros2::Definitions known;
  const auto type = lrt::ros2::MessageType::of(known.message("sensor_msgs/msg/JointState").value()).value();
  const lrt::rdf::Value value = type.decode(type.initial()).value();
  return type.encode(value).value() == type.initial() ? 0 : 1;
}

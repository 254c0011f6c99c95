// SPDX-License-Identifier: Apache-2.0
#include "src/ros2/types/names.hpp"

#include <string>

#include "tests/support/catch.hpp"

using namespace lrt::ros2;

TEST_CASE("a type has one name in ROS and one in DDS", "[ros2]") {
  CHECK(dds_type_of("sensor_msgs/msg/JointState") == "sensor_msgs::msg::dds_::JointState_");
  CHECK(ros_type_of("sensor_msgs::msg::dds_::JointState_") == "sensor_msgs/msg/JointState");
  CHECK(ros_type_of("example_interfaces::srv::dds_::AddTwoInts_Request_") == "example_interfaces/srv/AddTwoInts_Request");
  CHECK(record_name_of("example_interfaces/srv/AddTwoInts_Request") == "example_interfaces.AddTwoInts_Request");
  for (const char* other : {"", "_", "JointState", "::dds_::_", "a::msg::dds_::", "a::msg::dds_::_", "a::b::dds_::C_", "a::msg::dds_::C",
                            "a::msg::C_", "a::msg::x::dds_::C_", "a::msg::dds_::C::D_", "a b::msg::dds_::C_"}) {
    CAPTURE(other);
    CHECK(ros_type_of(other).empty());
  }
  CHECK_FALSE(is_type_name("a/msg/" + std::string(255, 'B')));
}

TEST_CASE("names of nodes and topics are those that ROS can have", "[ros2]") {
  for (const char* name : {"/a", "/arm/joint_states", "/_hidden", "/a1/b2"}) {
    CAPTURE(name);
    CHECK(is_full_name(name));
  }
  for (const char* name : {"", "/", "a", "/a/", "//a", "/a//b", "/1a", "/a b", "/a.b", "/\xc3\xa4", "/a\n"}) {
    CAPTURE(name);
    CHECK_FALSE(is_full_name(name));
  }
  CHECK(is_full_name("/" + std::string(254, 'a')));
  CHECK_FALSE(is_full_name("/" + std::string(255, 'a')));
}

TEST_CASE("patterns of names have one and two stars", "[ros2]") {
  CHECK(fits("/cmd_vel", "/cmd_vel"));
  CHECK_FALSE(fits("/cmd_vel", "/cmd_vel2"));
  CHECK(fits("/*", "/cmd_vel"));
  CHECK_FALSE(fits("/*", "/arm/cmd_vel"));
  CHECK(fits("/**", "/arm/cmd_vel"));
  CHECK(fits("**", ""));
  CHECK(fits("/*/cmd_*", "/arm/cmd_vel"));
  CHECK(fits("/**/cmd_vel", "/a/b/c/cmd_vel"));
  CHECK(fits("/**/b*/c", "/a/b1/x/b2/c"));
  CHECK_FALSE(fits("/**/b*/c", "/a/b1/x/b2/d"));
  CHECK(fits("/arm/**:max_*", "/arm/x/driver:max_speed"));
  CHECK_FALSE(fits("/arm/*", "/arm/driver:max_speed"));
  CHECK(fits("/**:*", "/a:b.c"));
  CHECK_FALSE(fits("", "/a"));
  CHECK_FALSE(fits(std::string(200, '*') + "b", std::string(20'000, 'a')));
}

// SPDX-License-Identifier: Apache-2.0
// What robots are made of: joints and links of a robot description, frames of tf, scans, images, grids, clouds.
#include <lrt/ros2.hpp>

#include <cstring>
#include <future>
#include <string>

#include "tests/ros2/bridge_host.hpp"
#include "tests/support/catch.hpp"

namespace {

using namespace lrt;
using namespace lrt::test;
using ros2::Listed;

const std::string urdf = R"(<robot name="mover"><link name="base"/><link name="upper"/><link name="hand"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
    <limit lower="-1.5" upper="1.5" effort="10" velocity="2"/></joint>
  <joint name="slide" type="prismatic"><parent link="upper"/><child link="hand"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.4" effort="10" velocity="2"/></joint></robot>)";

std::string joint_state(std::uint32_t seconds, const std::vector<std::string>& names, const std::vector<double>& positions,
                        const std::vector<double>& velocities = {}, const std::vector<double>& efforts = {}, bool little = true) {
  Cdr cdr(little);
  cdr.header(seconds, 0, "");
  cdr.u32(static_cast<std::uint32_t>(names.size()));
  for (const std::string& n : names) cdr.text(n);
  return cdr.f64s(positions).f64s(velocities).f64s(efforts).take();
}
std::string transform(std::string_view parent, std::string_view child, double x) {
  Cdr cdr;
  cdr.u32(1).header(1'700'000'000, 0, parent).text(child);
  for (const double d : {x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0}) cdr.f64(d);
  return cdr.take();
}

TEST_CASE("a robot description is a Thing for each joint and link, and JointState moves them", "[ros2][bridge]") {
  BridgeHost host;
  host.graph->write("/robot_description", "std_msgs/msg/String", "/robot_state_publisher");
  host.graph->write("/joint_states", "sensor_msgs/msg/JointState", "/driver");
  host.graph->announce();
  REQUIRE(comes_true([&] { return host.graph->subscriptions("/robot_description") == 1 && host.graph->subscriptions("/joint_states") == 1; }));
  host.graph->publish("/robot_description", Cdr().text(urdf).take());
  REQUIRE(comes_true([&] { return host.ask("GET /robot/shoulder\nAccept: application/json").status == 200; }));
  REQUIRE(host.core->wait_until_settled(std::chrono::seconds(30)));
  const bool little = GENERATE(true, false);
  REQUIRE(comes_true([&] {
    host.graph->publish("/joint_states", joint_state(1'700'000'000, {"slide", "nobody", "shoulder"}, {0.25, 7, 1.25}, {}, {1, 2, 3}, little));
    return host.json("/robot/shoulder/position").find("1.25") != std::string::npos;
  }));
  CHECK(host.json("/robot/slide/position").find("0.25") != std::string::npos);
  CHECK(host.json("/robot/shoulder/effort").find('3') != std::string::npos);
  CHECK(host.json("/robot/shoulder/limits").find("1.5") != std::string::npos);
  CHECK(host.ask("GET /robot/slide/position\nAccept: text/turtle").says("2023-11-14T22:13:20"));
  CHECK(host.json("/robot/hand/pose").find("0.2") != std::string::npos);
  // What is broken, or of a joint that is not there, changes nothing.
  std::string broken = joint_state(1'700'000'001, {"shoulder"}, {0.5});
  for (std::size_t size = 0; size < broken.size(); ++size) host.graph->publish("/joint_states", broken.substr(0, size));
  CHECK(host.json("/robot/shoulder/position").find("1.25") != std::string::npos);
  CHECK(host.listed("/robot_description", Listed::What::topic).has_value());
  // Positions of a driver that is gone are none.
  host.graph->leave("/driver");
  host.settle();
  CHECK(host.json("/robot/shoulder/position").find("1.25") == std::string::npos);
  CHECK(host.ask("GET /robot/shoulder/limits\nAccept: application/json").status == 200);
  host.graph->write("/joint_states", "sensor_msgs/msg/JointState", "/driver");
  host.settle();
  REQUIRE(comes_true([&] {
    host.graph->publish("/joint_states", joint_state(1'700'000'002, {"shoulder"}, {0.75}));
    return host.json("/robot/shoulder/position").find("0.75") != std::string::npos;
  }));
}

TEST_CASE("a frame of tf is a Thing with its pose in its parent, and is gone with its writer", "[ros2][bridge]") {
  BridgeHost host;
  host.graph->write("/tf", "tf2_msgs/msg/TFMessage", "/localization");
  host.settle();
  host.graph->publish("/tf", transform("odom", "base_link", 1.5));
  REQUIRE(host.comes("/frames/base_link/pose", "1.5"));
  const Answer turtle = host.ask("GET /frames/base_link/pose\nAccept: text/turtle");
  CHECK(turtle.says("\"odom\""));
  CHECK(turtle.says("2023-11-14T22:13:20"));
  host.graph->publish("/tf", transform("odom", "base_link", 2.5));
  CHECK(host.json("/frames/base_link/pose").find("2.5") != std::string::npos);
  host.graph->publish("/tf", transform("map", "base_link", 3.5));
  REQUIRE(comes_true([&] { return host.ask("GET /frames/base_link/pose\nAccept: text/turtle").says("\"map\""); }));
  CHECK(host.json("/frames/base_link/pose").find("3.5") != std::string::npos);
  host.graph->leave("/localization");
  host.settle();
  CHECK(host.ask("GET /frames/base_link/pose\nAccept: application/json").says("no node writes it now"));
}

TEST_CASE("frames that are too many are left out", "[ros2][bridge]") {
  BridgeHost host;
  host.graph->write("/tf", "tf2_msgs/msg/TFMessage", "/x");
  host.settle();
  for (int i = 0; i < 1'200; ++i) host.graph->publish("/tf", transform("map", "f" + std::to_string(i), 1));
  host.graph->publish("/tf", transform("map", std::string(300, 'x'), 1));
  host.graph->publish("/tf", transform("map", "", 1));
  REQUIRE(comes_true([&] { return host.core->counters().things >= 1'025; }));
  host.settle();
  CHECK(host.core->counters().things == 1'025);  // and the topic itself
}

TEST_CASE("a frame that changes its parent all the time leaves one job", "[ros2][bridge]") {
  BridgeHost host;
  host.graph->write("/tf", "tf2_msgs/msg/TFMessage", "/x");
  host.settle();
  std::promise<void> held, released;
  host.core->shared()->put([&] {
    held.set_value();
    released.get_future().wait();
  });
  held.get_future().wait();
  for (int i = 0; i < 1'000; ++i) host.graph->publish("/tf", transform(i % 2 == 0 ? "map" : "odom", "base_link", 1));
  {
    const std::lock_guard lock(host.core->shared()->mutex);
    CHECK(host.core->shared()->jobs.size() == 1);
  }
  released.set_value();
  CHECK(comes_true([&] { return host.ask("GET /frames/base_link/pose\nAccept: text/turtle").says("\"odom\""); }));
}

TEST_CASE("a scan has its ranges as octets", "[ros2][bridge]") {
  BridgeHost host;
  host.graph->write("/scan", "sensor_msgs/msg/LaserScan", "/lidar");
  host.graph->announce();
  REQUIRE(comes_true([&] { return host.graph->subscriptions("/scan") == 1; }));
  Cdr cdr;
  cdr.header(1'700'000'000, 0, "laser");
  for (const float f : {-1.0F, 1.0F, 0.5F, 0.0F, 0.1F, 0.2F, 10.0F}) cdr.f32(f);
  cdr.u32(3).f32(1).f32(2).f32(4).u32(0);
  host.graph->publish("/scan", cdr.take());
  host.settle();
  const float numbers[] = {1, 2, 4};
  const Answer octets = host.ask("GET /scan/ranges\nAccept: application/octet-stream");
  CHECK(octets.status == 200);
  CHECK(octets.body == std::string(reinterpret_cast<const char*>(numbers), 12));
  CHECK(host.json("/scan/ranges").find("[1,2,4]") != std::string::npos);
  CHECK(host.json("/scan/value").find("\"range_max\":10") != std::string::npos);
}

TEST_CASE("an image is described as a value, and made as PNG when it is requested", "[ros2][bridge]") {
  BridgeHost host;
  host.graph->write("/image", "sensor_msgs/msg/Image", "/camera");
  host.graph->announce();
  REQUIRE(comes_true([&] { return host.graph->subscriptions("/image") == 1; }));
  const auto image = [](const std::string& pixels) {
    Cdr cdr;
    cdr.header(1'700'000'000, 0, "camera").u32(2).u32(1).text("rgb8").u8(0).u32(3).bytes(pixels);
    return cdr.take();
  };
  host.graph->publish("/image", image("abcdef"));
  host.settle();
  CHECK(host.json("/image/value").find("\"encoding\":\"rgb8\"") != std::string::npos);
  CHECK(host.json("/image/value").find("data") == std::string::npos);
  const Answer png = host.ask("GET /image/image\nAccept: image/*");
  CHECK(png.status == 200);
  CHECK(png.field("Content-Type") == "image/png");
  CHECK(png.body.substr(1, 3) == "PNG");
  CHECK(host.ask("GET /image/image").field("Content-Type") == "image/png");  // as a browser
  CHECK(host.ask("GET /image/image\nAccept: application/octet-stream").body == "abcdef");
  host.graph->publish("/image", image("ghijkl"));
  CHECK(host.ask("GET /image/image\nAccept: application/octet-stream").body == "ghijkl");
  host.graph->publish("/image", image("gh"));
  CHECK(host.ask("GET /image/image\nAccept: image/png").status == 406);
}

TEST_CASE("a grid is a PNG and its cells, a cloud its coordinates and its bytes", "[ros2][bridge]") {
  ros2::Options options;
  options.limits.max_representation_bytes = 100;
  BridgeHost host(options);
  host.graph->write("/map", "nav_msgs/msg/OccupancyGrid", "/map_server");
  host.graph->write("/points", "sensor_msgs/msg/PointCloud2", "/lidar");
  host.graph->announce();
  REQUIRE(comes_true([&] { return host.graph->subscriptions("/map") == 1 && host.graph->subscriptions("/points") == 1; }));
  Cdr grid;
  grid.header(1, 0, "map").u32(0).u32(0).f32(0.05F).u32(2).u32(2);
  for (const double d : {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0}) grid.f64(d);
  host.graph->publish("/map", grid.bytes(std::string("\0\x64\xFF\x32", 4)).take());
  const auto cloud = [](std::uint32_t points) {
    Cdr cdr;
    cdr.header(1, 0, "lidar").u32(1).u32(points).u32(3);
    std::uint32_t offset = 0;
    for (const char* name : {"x", "y", "z"}) cdr.text(name).u32(offset).u8(7).u32(1), offset += 4;
    cdr.u8(0).u32(12).u32(12 * points).bytes(std::string(12 * points, 'p')).u8(1);
    return cdr.take();
  };
  host.graph->publish("/points", cloud(2));
  host.settle();
  CHECK(host.ask("GET /map/image\nAccept: image/png").body.substr(1, 3) == "PNG");
  CHECK(host.ask("GET /map/image\nAccept: application/octet-stream").body == std::string("\0\x64\xFF\x32", 4));
  CHECK(host.json("/map/value").find("\"resolution\":0.05") != std::string::npos);
  CHECK(host.ask("GET /points/points\nAccept: application/octet-stream").body == std::string(24, 'p'));
  CHECK(host.ask("GET /points/data\nAccept: application/octet-stream").body == std::string(24, 'p'));
  CHECK(host.json("/points/value").find("\"point_step\":12") != std::string::npos);
  host.graph->publish("/points", cloud(20));  // beyond the limit
  CHECK(host.ask("GET /points/points\nAccept: application/octet-stream").status >= 400);
  CHECK(host.ask("GET /points/value\nAccept: application/json").status == 200);
}

}  // namespace

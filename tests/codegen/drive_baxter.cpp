// SPDX-License-Identifier: Apache-2.0
// A client of examples/baxter by the header that was generated of it.

#include "tests/codegen/baxter.hpp"

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>

namespace {

void expect(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "expected: %s\n", what);
  std::exit(1);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  lrt::Client client = lrt::Client::create().value();
  const lrt::client::Robot robot = client.open(argv[1]).value();

  const std::vector<baxter::RevoluteJoint> joints = baxter::RevoluteJoint::all(robot);
  expect(joints.size() == 7, "seven joints");
  expect(baxter::Link::all(robot).size() == 8, "eight links");
  expect(baxter::Robot::all(robot).size() == 1, "one arm");

  const baxter::RevoluteJoint joint = baxter::RevoluteJoint::of(robot.thing("right_s1").value()).value();
  const auto link = baxter::Link::of(joint.thing);
  expect(!link && link.error().message.find("ros:Link") != std::string::npos, "a joint that is no link");

  expect(std::isfinite(joint.position.read().value()), "a position");
  expect(joint.limits.read().value().lowerLimit == -2.147, "the lower limit of the joint");
  expect(joint.axis.read().value().z == 1, "an axis");
  expect(joint.effort.unit() == lrt::unit::newton_metre, "the unit of an effort");
  expect(!joint.effort.read(), "no effort, because the arm does not measure it");
  joint.friction.write(12.5).value();
  expect(joint.friction.read().value() == 12.5, "the friction that was written");
  expect(!joint.friction.write(1e6), "a friction beyond its bounds to be refused");
  joint.friction.write(0).value();

  // Watched with its type: each value has the time and the number that the robot gave it.
  std::atomic<int> watched{0};
  const auto watch = joint.position
                         .watch({},
                                [&](const lrt::Result<double>& value, const lrt::client::Change& change) {
                                  if (value && std::isfinite(*value) && change.at && change.sequence && change.left_out) ++watched;
                                })
                         .value();
  while (watched == 0) client.poll();
  auto latest = joint.position.latest().value();
  double newest = NAN;
  while (!latest.take(newest)) std::this_thread::yield();
  expect(std::isfinite(newest) && latest.source_time(), "the newest position with its time");

  const auto run = joint.rotate(1.0F).value();
  const auto ended = run.wait(std::chrono::seconds(20)).value();
  expect(ended.status == lrt::client::Invocation::Status::succeeded, "a rotation that succeeds");
  const double angle = joint.rotation.read().value().rotationAngle, pi = std::acos(-1.0);
  expect(std::abs(std::abs(angle) - pi / 180) < 0.01, "the joint at one degree");
  expect(!joint.rotate(400.0F), "an angle beyond its bounds to be refused");

  const baxter::Robot arm = baxter::Robot::all(robot).front();
  expect(arm.positions.read().value().size() == 7, "seven positions");
  baxter::JointAngles angles;
  angles.right_s1 = 2;
  const auto moved = arm.moveTo(angles).value();
  expect(moved.wait(std::chrono::seconds(20)).value().status == lrt::client::Invocation::Status::succeeded, "a motion that succeeds");
  std::puts("the arm has moved");
}

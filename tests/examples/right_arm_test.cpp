// SPDX-License-Identifier: Apache-2.0
#include "examples/baxter/linked_arm.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <utility>

#include "tests/examples/arm.hpp"
#include "tests/support/catch.hpp"

using namespace baxter;
using lrt::test::arm_parameters;

namespace {

// Steps until the joint rests; the number of steps. Checks what must hold after each.
int run_to_rest(RightArm& arm, std::size_t joint) {
  const JointParameters& limits = arm.parameters(joint);
  const double hardest = std::max(arm.acceleration(joint), arm.deceleration(joint));
  int steps = 0;
  while (arm.moving(joint)) {
    const double position = arm.position(joint), velocity = arm.velocity(joint), progress = arm.progress(joint);
    arm.step();
    ++steps;
    if (arm.position(joint) < limits.lower_rad || arm.position(joint) > limits.upper_rad) FAIL("position " << arm.position(joint));
    if (std::abs(arm.velocity(joint)) > limits.velocity_rad_s) FAIL("velocity " << arm.velocity(joint));
    if (std::abs(arm.velocity(joint) - velocity) > hardest * step_period_s + 1e-9) FAIL("jump in velocity at step " << steps);
    // The way of one period lies between those at the two velocities, or, where it peaks between, just beside.
    const double way = arm.position(joint) - position, mean = (velocity + arm.velocity(joint)) / 2 * step_period_s;
    if (std::abs(way - mean) > hardest * step_period_s * step_period_s + 1e-9) FAIL("jump in position at step " << steps);
    if (arm.progress(joint) <= progress || arm.progress(joint) > 1) FAIL("progress " << arm.progress(joint));
    if (steps > 60000) FAIL("never ends");
  }
  return steps;
}

// From rest to rest, by the textbook.
double expected_duration(const RightArm& arm, std::size_t joint, double way) {
  const double a = arm.acceleration(joint), d = arm.deceleration(joint), v = arm.parameters(joint).velocity_rad_s;
  const double way_of_ramps = v * v / (2 * a) + v * v / (2 * d);
  if (way >= way_of_ramps) return v / a + v / d + (way - way_of_ramps) / v;
  const double peak = std::sqrt(2 * way * a * d / (a + d));
  return peak / a + peak / d;
}

}  // namespace

TEST_CASE("the arm's description is of its seven joints, one after the other", "[examples]") {
  const lrt::urdf::Model model = lrt::urdf::load(lrt::test::arm_file).value().model();
  CHECK(model.joints.size() == joint_count);
  CHECK(model.warnings.empty());
  for (std::size_t j = 0; j < joint_count; ++j) {
    CHECK(model.joints[j].name == RightArm::name(j));
    if (j > 0) CHECK(model.joints[j].parent == model.joints[j - 1].child);
  }
  CHECK(std::string(RightArm::name(right_s1)) == "right_s1");
  CHECK(std::string(RightArm::name(right_w2)) == "right_w2");
}

TEST_CASE("a description of another robot is refused", "[examples]") {
  const auto refusal = [](auto change) {
    lrt::urdf::Model model = lrt::urdf::load(lrt::test::arm_file).value().model();
    change(model);
    const auto parameters = LinkedArm::parameters(model);
    return parameters ? std::string() : parameters.error().message;
  };
  CHECK(refusal([](auto&) {}).empty());
  CHECK(refusal([](auto& m) { m.variables.pop_back(); }) == "expected 7 joints that move, found 6");
  CHECK(refusal([](auto& m) { m.joints[1].name = "left_s1"; }) == "expected joint right_s1, found left_s1");
  CHECK(refusal([](auto& m) { m.joints[2].limits.reset(); }) ==
        "expected limits with 0 rad between them, a velocity and an effort, in joint right_e0");
  CHECK(refusal([](auto& m) { m.joints[2].limits->lower = 0.1; }) != "");
  CHECK(refusal([](auto& m) { m.joints[2].limits->velocity = 0; }) != "");
  CHECK(refusal([](auto& m) { m.joints[2].limits->effort.reset(); }) != "");
}

TEST_CASE("a new arm rests at zero", "[examples]") {
  RightArm arm(arm_parameters());
  for (std::size_t j = 0; j < joint_count; ++j) {
    CHECK_FALSE(arm.moving(j));
    CHECK(arm.position(j) == 0);
    CHECK(arm.velocity(j) == 0);
    CHECK(arm.progress(j) == 1);
    CHECK(arm.friction(j) == 0.7);
    arm.step();
    CHECK(arm.position(j) == 0);
  }
  CHECK(arm.time() == Approx(0.007));
}

TEST_CASE("a move reaches its target exactly and in the time that the profile needs", "[examples]") {
  for (std::size_t j = 0; j < joint_count; ++j) {
    const JointParameters limits = arm_parameters()[j];
    for (double target : {limits.upper_rad, limits.lower_rad, 0.0, 0.01, 1e-7, -1e-9, limits.upper_rad / 3}) {
      RightArm arm(arm_parameters());
      CAPTURE(RightArm::name(j), target);
      const double expected = expected_duration(arm, j, std::abs(target));
      REQUIRE(arm.move_to(j, target) == MoveResult::accepted);
      CHECK(arm.target(j) == target);
      CHECK(arm.duration(j) == Approx(expected).margin(1e-12));
      const int steps = run_to_rest(arm, j);
      CHECK(steps * step_period_s >= expected - 1e-8);
      CHECK(steps * step_period_s < expected + step_period_s);
      CHECK(arm.position(j) == target);
      CHECK(arm.velocity(j) == 0);
      CHECK(arm.progress(j) == 1);
    }
  }
}

TEST_CASE("a long move cruises at the velocity limit", "[examples]") {
  RightArm arm(arm_parameters());
  arm.move_to(right_e0, 3);
  double fastest = 0;
  while (arm.moving(right_e0)) {
    arm.step();
    fastest = std::max(fastest, arm.velocity(right_e0));
  }
  CHECK(fastest == 1.5);
}

TEST_CASE("a target outside the limits is refused and changes nothing", "[examples]") {
  RightArm arm(arm_parameters());
  REQUIRE(arm.move_to(right_s1, 0.5) == MoveResult::accepted);
  for (int i = 0; i < 100; ++i) arm.step();
  const double position = arm.position(right_s1), velocity = arm.velocity(right_s1), progress = arm.progress(right_s1);
  const double infinity = std::numeric_limits<double>::infinity();
  CHECK(arm.move_to(right_s1, 1.0471) == MoveResult::above_upper_limit);
  CHECK(arm.move_to(right_s1, -2.1471) == MoveResult::below_lower_limit);
  CHECK(arm.move_to(right_s1, infinity) == MoveResult::above_upper_limit);
  CHECK(arm.move_to(right_s1, -infinity) == MoveResult::below_lower_limit);
  CHECK(arm.move_to(right_s1, std::nan("")) == MoveResult::not_a_number);
  CHECK(arm.position(right_s1) == position);
  CHECK(arm.velocity(right_s1) == velocity);
  CHECK(arm.progress(right_s1) == progress);
  CHECK(arm.target(right_s1) == 0.5);
  CHECK(arm.move_to(right_s1, 1.047) == MoveResult::accepted);
}

TEST_CASE("stop brakes to rest over the braking distance", "[examples]") {
  RightArm arm(arm_parameters());
  arm.move_to(right_e0, 3);
  for (int i = 0; i < 800; ++i) arm.step();
  const double position = arm.position(right_e0), velocity = arm.velocity(right_e0), braking = arm.deceleration(right_e0);
  REQUIRE(velocity == 1.5);
  arm.stop(right_e0);
  CHECK(arm.moving(right_e0));
  CHECK(arm.progress(right_e0) == 0);
  const int steps = run_to_rest(arm, right_e0);
  CHECK(steps == static_cast<int>(std::ceil(velocity / braking / step_period_s - 1e-6)));
  CHECK(arm.position(right_e0) == Approx(position + velocity * velocity / (2 * braking)));
  CHECK(arm.velocity(right_e0) == 0);

  const double rest = arm.position(right_e0);
  arm.stop(right_e0);
  arm.step();
  CHECK(arm.position(right_e0) == rest);
}

TEST_CASE("a move the other way turns round", "[examples]") {
  RightArm arm(arm_parameters());
  arm.move_to(right_w2, 3.059);
  for (int i = 0; i < 700; ++i) arm.step();
  REQUIRE(arm.velocity(right_w2) > 1);
  const double position = arm.position(right_w2);
  arm.move_to(right_w2, position + 1e-3);  // too near to brake in front of it
  run_to_rest(arm, right_w2);
  CHECK(arm.position(right_w2) == position + 1e-3);
  arm.move_to(right_w2, -3.059);
  run_to_rest(arm, right_w2);
  CHECK(arm.position(right_w2) == -3.059);
}

TEST_CASE("joints move independently of each other", "[examples]") {
  RightArm together(arm_parameters()), alone(arm_parameters());
  together.move_to(right_s0, 1);
  together.move_to(right_w1, -1);
  alone.move_to(right_s0, 1);
  for (int i = 0; i < 300; ++i) {
    together.step();
    alone.step();
    if (together.position(right_s0) != alone.position(right_s0)) FAIL("step " << i);
  }
  CHECK(alone.position(right_w1) == 0);
}

TEST_CASE("friction is clamped and slows a move down", "[examples]") {
  RightArm arm(arm_parameters());
  const double most = arm.greatest_friction(right_w0);
  CHECK(arm.set_friction(right_w0, -1) == 0);
  CHECK(arm.acceleration(right_w0) == arm.deceleration(right_w0));
  const double without = expected_duration(arm, right_w0, 1);
  CHECK(arm.set_friction(right_w0, 1e300) == most);
  CHECK(arm.friction(right_w0) == most);
  CHECK(arm.set_friction(right_w0, std::nan("")) == most);
  CHECK(arm.acceleration(right_w0) > 0);
  CHECK(arm.friction(right_w1) == 0.7);
  arm.move_to(right_w0, 1);
  const int steps = run_to_rest(arm, right_w0);
  CHECK(arm.position(right_w0) == 1);
  CHECK(steps * step_period_s > 1.2 * without);
}

TEST_CASE("limits hold whatever is asked, and equal calls give equal motions", "[examples]") {
  auto play = [](unsigned seed) {
    RightArm arm(arm_parameters());
    std::mt19937 random(seed);
    auto upto = [&](unsigned n) { return static_cast<unsigned>(random() % n); };
    double sum = 0;
    for (int i = 0; i < 200000; ++i) {
      const std::size_t j = upto(joint_count);
      const JointParameters& limits = arm.parameters(j);
      const double share = upto(1001) / 1000.0;
      switch (upto(60)) {
        case 0: arm.stop(j); break;
        case 1: arm.set_friction(j, share * arm.greatest_friction(j)); break;
        case 2: arm.move_to(j, limits.lower_rad); break;
        case 3: arm.move_to(j, limits.upper_rad); break;
        case 4: arm.move_to(j, limits.lower_rad + share * (limits.upper_rad - limits.lower_rad)); break;
        case 5: arm.move_to(j, arm.position(j) + (share - 0.5) / 10); break;
        default: break;
      }
      std::array<double, joint_count> velocity;
      for (std::size_t k = 0; k < joint_count; ++k) velocity[k] = arm.velocity(k);
      arm.step();
      for (std::size_t k = 0; k < joint_count; ++k) {
        const JointParameters& l = arm.parameters(k);
        if (arm.position(k) < l.lower_rad || arm.position(k) > l.upper_rad) FAIL("position of joint " << k << " at step " << i);
        if (std::abs(arm.velocity(k)) > l.velocity_rad_s) FAIL("velocity of joint " << k << " at step " << i);
        if (std::abs(arm.velocity(k) - velocity[k]) > arm.deceleration(k) * step_period_s + 1e-9)
          FAIL("jump in velocity of joint " << k << " at step " << i);
        sum += arm.position(k);
      }
    }
    return sum;
  };
  for (unsigned seed : {1u, 2u, 3u}) CHECK(play(seed) == play(seed));
}

static_assert(noexcept(std::declval<RightArm&>().step()), "the control loop cannot catch");

// SPDX-License-Identifier: Apache-2.0
// expect: an action expects a callable with explicit parameter types
#include <lrt/thing.hpp>

#include <functional>

struct Robot {
  void turn(double) {}
} robot;

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.action("turn", std::bind(&Robot::turn, &robot, std::placeholders::_1));
#else
  thing.action("turn", [](double degrees) { robot.turn(degrees); });
#endif
}

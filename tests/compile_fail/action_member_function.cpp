// SPDX-License-Identifier: Apache-2.0
// expect: an action expects a callable. for a member function write a lambda
#include <lrt/thing.hpp>

struct Robot {
  void turn(double) {}
} robot;

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.action("turn", &Robot::turn);
#else
  thing.action("turn", [](double degrees) { robot.turn(degrees); });
#endif
}

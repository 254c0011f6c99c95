// SPDX-License-Identifier: Apache-2.0
// expect: property expects a callable without parameters
#include <lrt/thing.hpp>

#include <functional>

struct Robot {
  double angle(int) const { return 1; }
} robot;

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.property("angle", std::bind(&Robot::angle, &robot, std::placeholders::_1));
#else
  thing.property("angle", std::bind(&Robot::angle, &robot, 1));
#endif
}

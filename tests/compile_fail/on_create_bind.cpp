// SPDX-License-Identifier: Apache-2.0
// expect: on_create cannot see whether this callable takes
#include <lrt/thing.hpp>

#include <functional>

struct Robot {
  void keep(std::string) {}
} robot;

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.collection<std::string>("names").on_create(std::bind(&Robot::keep, &robot, std::placeholders::_1)).max_members(5);
#else
  thing.collection<std::string>("names").on_create([](const std::string& name) { robot.keep(name); }).max_members(5);
#endif
}

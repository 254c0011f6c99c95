// SPDX-License-Identifier: Apache-2.0
// expect: on_write expects a callable void\(T\)
#include <lrt/thing.hpp>

#include <functional>

void turn(double) {}
void set_name(int, const std::string&) {}

void describe(lrt::Thing& thing) {
#ifdef LRT_MUST_FAIL
  thing.property<std::string>("name").on_write(std::bind(&turn, std::placeholders::_1));
#else
  thing.property<std::string>("name").on_write(std::bind(&set_name, 1, std::placeholders::_1));
#endif
}

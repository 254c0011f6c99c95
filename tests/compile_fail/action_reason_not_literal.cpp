// SPDX-License-Identifier: Apache-2.0
// expect: the reason of available\(\) is stored as an address
#include <lrt/thing.hpp>

#include <string>

void empty(lrt::Action& grip, const std::string& who) {
#ifdef LRT_MUST_FAIL
  grip.available(false, (who + " has emptied the gripper").c_str());
#else
  (void)who;
  grip.available(false, "the gripper is empty");
#endif
}

// SPDX-License-Identifier: Apache-2.0
// expect: stop expects what says whether the robot is stopped
#include <string>

#include <lrt/thing.hpp>

void describe(lrt::Thing& thing) {
  lrt::Action stop = thing.action("stop", [] {});
#ifdef LRT_MUST_FAIL
  stop.stop([] { return std::string("stopped"); });
#else
  stop.stop([] { return true; });
#endif
}

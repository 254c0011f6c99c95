// SPDX-License-Identifier: Apache-2.0
// expect: expires expects a callable without parameters
#include <chrono>

#include <lrt/thing.hpp>

void describe(lrt::Thing& thing, double& wheels) {
  auto drive = thing.property("drive", [&] { return wheels; }).on_write([&](double wanted) { wheels = wanted; });
#ifdef LRT_MUST_FAIL
  drive.expires(std::chrono::milliseconds(200), [&](double stopped) { wheels = stopped; });
#else
  drive.expires(std::chrono::milliseconds(200), [&] { wheels = 0; });
#endif
}

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <string>

namespace lrt::test {

/// Prints why a test case, or a part of it, does not run here. tests/run.sh counts these lines.
inline void print_skip(const std::string& reason) {
  std::printf("skipped: %s\n", reason.c_str());
  std::fflush(stdout);
}

}  // namespace lrt::test

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>
#include <system_error>

namespace lrt::test {

/// The open descriptors and what each is, "socket:[4711]"; without those that a child would not inherit, if so requested.
inline std::map<int, std::string> descriptors(bool inherited) {
  std::map<int, std::string> result;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    const int number = std::atoi(entry.path().filename().c_str());
    const int flags = ::fcntl(number, F_GETFD);
    std::error_code gone;  // the directory's own
    const std::string what = std::filesystem::read_symlink(entry.path(), gone).string();
    if (flags >= 0 && !gone && (!inherited || (flags & FD_CLOEXEC) == 0)) result.emplace(number, what);
  }
  return result;
}

}  // namespace lrt::test

#pragma once

#include <filesystem>
#include <fstream>
#include <string>

namespace bench {

/// Time on a CPU so far, of all threads.
inline double cpu_microseconds(int pid) {
  double total = 0;
  for (const auto& task : std::filesystem::directory_iterator("/proc/" + std::to_string(pid) + "/task")) {
    std::ifstream file(task.path() / "schedstat");
    double nanoseconds = 0;
    if (file >> nanoseconds) total += nanoseconds / 1e3;
  }
  return total;
}

}  // namespace bench

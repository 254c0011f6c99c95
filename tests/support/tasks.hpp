// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sched.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace lrt::test {

/// A thread of this process, as /proc/self/task shows it.
struct Task {
  pid_t id = 0;
  std::string name;
  std::uint64_t blocked = 0;  ///< bit n - 1: signal n
  std::string cpus;           ///< "0-3,7"
  int policy = -1;            ///< SCHED_OTHER ...
  int priority = 0;

  bool blocks(int signal) const { return (blocked >> (signal - 1) & 1U) != 0; }
};

inline Task task(pid_t id) {
  Task result;
  result.id = id;
  const std::string folder = "/proc/self/task/" + std::to_string(id);
  std::getline(std::ifstream(folder + "/comm"), result.name);
  std::ifstream status(folder + "/status");
  for (std::string line; std::getline(status, line);) {
    const auto value = [&](const char* field) { return line.rfind(field, 0) == 0 ? line.substr(line.find('\t') + 1) : std::string(); };
    if (const std::string mask = value("SigBlk:"); !mask.empty()) result.blocked = std::strtoull(mask.c_str(), nullptr, 16);
    if (const std::string list = value("Cpus_allowed_list:"); !list.empty()) result.cpus = list;
  }
  sched_param parameter{};
  result.policy = ::sched_getscheduler(id);
  if (::sched_getparam(id, &parameter) == 0) result.priority = parameter.sched_priority;
  return result;
}

inline Task this_task() { return task(::gettid()); }

/// All threads, in order of their ids.
inline std::vector<Task> tasks() {
  std::vector<Task> result;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) {
    Task found = task(std::atoi(entry.path().filename().c_str()));
    if (!found.name.empty()) result.push_back(std::move(found));
  }
  return result;
}

}  // namespace lrt::test

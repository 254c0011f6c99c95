// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace lrt::attack {

/// Durations of one kind.
class Sample {
 public:
  void add(std::chrono::nanoseconds time) { values_.push_back(std::chrono::duration<double, std::micro>(time).count()); }
  /// Microseconds, as members of a JSON object.
  /// @param name  "late"
  std::string json(const std::string& name) {
    std::sort(values_.begin(), values_.end());
    std::string text;
    for (const auto& [label, part] : {std::pair{"p50", 0.5}, {"p99", 0.99}, {"p999", 0.999}, {"max", 1.0}}) {
      const std::size_t at = std::min(values_.size() - 1, static_cast<std::size_t>(static_cast<double>(values_.size()) * part));
      text += ", \"" + name + "_" + label + "\": " + (values_.empty() ? "null" : std::to_string(std::lround(values_[at])));
    }
    return text;
  }
  std::size_t size() const { return values_.size(); }

 private:
  std::vector<double> values_;
};

/// Of a control loop.
struct Measured {
  Sample late;  ///< the beginning of a step after its time
  Sample poll;  ///< the duration of what serves clients, as Server::poll
  Sample cpu;   ///< the processor time of that: without programs that ran instead

  std::string json() { return "{\"steps\": " + std::to_string(late.size()) + late.json("late") + poll.json("poll") + cpu.json("cpu") + "}"; }
};

/// The processor time of the calling thread.
inline std::chrono::nanoseconds thread_time() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace lrt::attack

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>

#include <lrt/base/clock.hpp>
#include <lrt/base/ids.hpp>

namespace lrt::test {

/// A clock that stands still until it is moved by hand. 2026-11-21T10:38:39Z.
class FakeClock final : public Clock {
 public:
  TimePoint now() const noexcept override {
    const std::chrono::microseconds since(since_.fetch_add(step_.load()));
    return {std::chrono::steady_clock::time_point(std::chrono::hours(1)) + since,
            std::chrono::system_clock::time_point(std::chrono::seconds(1795257519)) + since};
  }
  void advance(std::chrono::microseconds by) { since_ += by.count(); }
  /// Each call of now() takes that long from now on.
  void run_slowly(std::chrono::microseconds step) { step_ = step.count(); }

 private:
  mutable std::atomic<std::int64_t> since_{0};
  std::atomic<std::int64_t> step_{0};
};

/// "i1", "i2", ...
class FixedIds final : public IdSource {
 public:
  std::string next() override { return "i" + std::to_string(++last_); }

 private:
  int last_ = 0;
};

}  // namespace lrt::test

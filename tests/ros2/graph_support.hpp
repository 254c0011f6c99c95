// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <lrt/ros2/graph.hpp>

#include <atomic>
#include <mutex>
#include <string>
#include <vector>

#include "src/ros2/graph/cdr.hpp"
#include "tests/ros2/peer.hpp"
#include "tests/support/catch.hpp"

namespace lrt::test {

/// A graph on loopback.
inline ros2::Graph join(const Domain& domain, ros2::GraphOptions options = {}) {
  options.domain = domain.number();
  options.interfaces = {"127.0.0.1"};
  options.settle = std::chrono::milliseconds(50);
  return ros2::Graph::join(std::move(options)).value();
}

/// [ms] A peer that is killed is missed after its lease. Cyclone asserts it every 4/5 of that, so a shorter one ends where a machine is busy.
constexpr int short_lease = 4'000, long_lease = 10'000;

inline Peer cyclone(const Domain& domain, int lease_ms = long_lease, const std::string& user_data = "enclave=/;") {
  return Peer({LRT_CYCLONE_PEER, std::to_string(domain.number()), std::to_string(lease_ms), user_data});
}

/// std_msgs/msg/String.
inline std::string text_payload(std::string_view text) { return ros2::CdrWriter().text(text).payload(); }
inline std::string text_of(std::string_view payload) { return std::string(ros2::CdrReader(payload).text()); }

/// Texts that a sink has got.
class ReceivedTexts {
 public:
  ros2::Sink sink() {
    return [this](ros2::Sample&& sample) {
      const std::lock_guard<std::mutex> lock(mutex_);
      texts_.push_back(text_of(*sample.payload));
      last_ = std::move(sample);
    };
  }
  std::vector<std::string> all() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return texts_;
  }
  bool has(const std::string& text) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const std::string& one : texts_)
      if (one == text) return true;
    return false;
  }
  ros2::Sample last() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return last_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> texts_;
  ros2::Sample last_;
};

/// What a call responds, waited for.
template <class T>
class Answer {
 public:
  auto take() {
    return [this](Result<T> result) {
      const std::lock_guard<std::mutex> lock(mutex_);
      result_ = std::make_unique<Result<T>>(std::move(result));
      ++times_;
    };
  }
  Result<T>& get() {
    if (!eventually([this] { return is_there(); })) throw std::runtime_error("no response");
    if (!*result_) UNSCOPED_INFO(result_->error().message);
    return *result_;
  }
  bool is_there() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return result_ != nullptr;
  }
  int times() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return times_;
  }

 private:
  mutable std::mutex mutex_;
  std::unique_ptr<Result<T>> result_;
  int times_ = 0;
};

}  // namespace lrt::test

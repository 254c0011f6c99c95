// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <utility>

namespace lrt::query {

/// The bytes that all queries of an endpoint hold together: their copies of the robot's graphs, solutions, and answers that are not sent yet.
///
/// @par Threads  Any.
class Memory {
 public:
  explicit Memory(std::size_t max) noexcept : max_(max) {}
  bool take(std::size_t bytes) noexcept {
    std::size_t used = used_.load(std::memory_order_relaxed);
    do {
      if (bytes > max_ - used) return false;
    } while (!used_.compare_exchange_weak(used, used + bytes, std::memory_order_relaxed));
    return true;
  }
  void give(std::size_t bytes) noexcept { used_.fetch_sub(bytes, std::memory_order_relaxed); }
  std::size_t used() const noexcept { return used_.load(std::memory_order_relaxed); }
  std::size_t max() const noexcept { return max_; }

 private:
  const std::size_t max_;
  std::atomic<std::size_t> used_{0};  ///< at most max_
};

/// What one query or one copy of the graphs has of it, given back at the end.
///
/// @par Threads  One at a time.
class MemoryShare {
 public:
  explicit MemoryShare(std::shared_ptr<Memory> memory = nullptr) noexcept : memory_(std::move(memory)) {}
  MemoryShare(MemoryShare&& other) noexcept : memory_(std::move(other.memory_)), bytes_(std::exchange(other.bytes_, 0)) {}
  MemoryShare(const MemoryShare&) = delete;
  MemoryShare& operator=(const MemoryShare&) = delete;
  ~MemoryShare() { set(0); }

  /// Makes it that many bytes. False: all together would have too many, and it stays as it is.
  bool set(std::size_t bytes) noexcept {
    if (!memory_) return true;
    if (bytes > bytes_ && !memory_->take(bytes - bytes_)) return false;
    if (bytes < bytes_) memory_->give(bytes_ - bytes);
    bytes_ = bytes;
    return true;
  }
  std::size_t bytes() const noexcept { return bytes_; }
  std::size_t max() const noexcept { return memory_ ? memory_->max() : 0; }

 private:
  std::shared_ptr<Memory> memory_;
  std::size_t bytes_ = 0;
};

}  // namespace lrt::query

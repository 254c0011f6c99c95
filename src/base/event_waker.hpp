// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdint>

#include <lrt/base/waker.hpp>

namespace lrt {

/// A Waker on an eventfd. It owns the descriptor, so it may outlive the object that waits on it.
class EventWaker final : public Waker {
 public:
  EventWaker() : descriptor_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)), error_(descriptor_ < 0 ? errno : 0) {}
  ~EventWaker() override {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  EventWaker(const EventWaker&) = delete;
  EventWaker& operator=(const EventWaker&) = delete;

  void wake() noexcept override {
    if (awake_.exchange(true, std::memory_order_acq_rel)) return;  // the descriptor is readable already
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = ::write(descriptor_, &one, sizeof one);
  }

  /// Readable after wake(). -1: the system could not create an eventfd.
  int descriptor() const noexcept { return descriptor_; }
  /// Why it could not, as errno.
  int error() const noexcept { return error_; }

  /// wake() was called after the last clear().
  bool is_awake() const noexcept { return awake_.load(std::memory_order_acquire); }

  /// Makes the descriptor unreadable. Call it before reading the data that the wakers have written.
  void clear() noexcept {
    std::uint64_t count = 0;
    [[maybe_unused]] const auto got = ::read(descriptor_, &count, sizeof count);
    awake_.exchange(false, std::memory_order_acq_rel);  // after the read: the caller then finds the data of a wake() in between
  }

  /// Waits for wake() for at most `time`, bounded to 0 ... 1 h, then clears it.
  void wait(std::chrono::milliseconds time) noexcept {
    pollfd item{descriptor_, POLLIN, 0};
    const auto bounded = std::clamp(time, std::chrono::milliseconds(0), std::chrono::milliseconds(std::chrono::hours(1)));
    if (::poll(&item, 1, static_cast<int>(bounded.count())) > 0) clear();
  }

 private:
  const int descriptor_;
  const int error_;
  std::atomic<bool> awake_{false};
};

}  // namespace lrt

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/timerfd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdint>

#include "src/transport/http/readiness.hpp"

namespace lrt::transport {

/// Makes a Readiness ready at an instant, which waits of whole milliseconds would miss. One timerfd: setting it is one system call.
class Alarm final : public Watched {
 public:
  using Instant = std::chrono::steady_clock::time_point;

  /// False: errno says why not.
  bool open(Readiness& readiness) {
    if (timer_.is_open()) return true;
    timer_ = Socket(::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC));
    if (timer_.is_open() && readiness.watch(timer_, *this, EPOLLIN)) return true;
    const int error = errno;
    timer_ = Socket();
    return errno = error, false;
  }

  /// Expires at `due`, or earlier if it is set to an earlier instant: that costs less than setting it whenever the instant moves away.
  /// @param due  by the clock that `now` belongs to; the difference is used as a time of the machine
  void set(Instant due, Instant now) noexcept {
    if (!expired_ && due_ > now && due_ <= due) return;
    const auto left = std::clamp<std::chrono::nanoseconds>(due - now, std::chrono::nanoseconds(1), std::chrono::hours(1));
    write(left);
    due_ = due;
  }
  /// Cancels the alarm: makes the descriptor unreadable.
  void clear() noexcept {
    if (!expired_) return;
    write(std::chrono::nanoseconds(0));
    due_ = never;
  }

  /// set() and clear() make it unreadable again, in the system call that they need anyway.
  void on_ready(std::uint32_t) override { expired_ = true; }

 private:
  static constexpr Instant never = Instant::max();

  void write(std::chrono::nanoseconds left) noexcept {
    itimerspec time{};
    time.it_value.tv_sec = static_cast<time_t>(left.count() / 1'000'000'000);
    time.it_value.tv_nsec = static_cast<long>(left.count() % 1'000'000'000);
    ::timerfd_settime(timer_.descriptor(), 0, &time, nullptr);
    expired_ = false;
  }

  Socket timer_;
  Instant due_ = never;  ///< the instant that the timer is set to
  bool expired_ = false;
};

}  // namespace lrt::transport

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <unistd.h>

#include <cstdint>
#include <utility>

namespace lrt::transport {

class Watched;

/// A descriptor, of a socket or something else that can be waited for, and what a Readiness knows of it.
class Socket {
 public:
  explicit Socket(int descriptor = -1) noexcept : descriptor_(descriptor) {}
  Socket(Socket&& other) noexcept
      : descriptor_(std::exchange(other.descriptor_, -1)),
        watched_by_(std::exchange(other.watched_by_, nullptr)),
        events_(std::exchange(other.events_, 0U)) {}
  Socket& operator=(Socket&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    std::swap(watched_by_, other.watched_by_);
    std::swap(events_, other.events_);
    return *this;
  }
  ~Socket() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }

  int descriptor() const noexcept { return descriptor_; }
  bool is_open() const noexcept { return descriptor_ >= 0; }

 private:
  friend class Readiness;
  int descriptor_;
  Watched* watched_by_ = nullptr;
  std::uint32_t events_ = 0;
};

}  // namespace lrt::transport

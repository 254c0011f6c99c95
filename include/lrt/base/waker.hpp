#pragma once

namespace lrt {

/// Ends a wait somewhere else, such as a transport's poll(). Outlives what it wakes; then waking does nothing.
class Waker {
 public:
  virtual ~Waker() = default;
  /// From any thread; no lock, no allocation, at most one system call.
  virtual void wake() noexcept = 0;
};

}  // namespace lrt

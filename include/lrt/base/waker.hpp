// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <lrt/base/language.hpp>

namespace lrt {

/// Ends the wait of another thread, such as a transport's poll(). It may outlive the object that waits; then wake() has no effect.
class Waker {
 public:
  virtual ~Waker() = default;
  /// @par Threads  Any.
  /// @par Time     No lock, no allocation, at most one system call.
  virtual void wake() noexcept = 0;
};

}  // namespace lrt

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <lrt/base/abi.hpp>
#include <lrt/base/language.hpp>

namespace lrt {
inline namespace v0 {

/// Ends the wait of another thread, such as a transport's poll(). It may outlive the object that waits; then wake() has
/// no effect.
/// @par Threads  Any.
class LRT_API Waker {
 public:
  virtual ~Waker() = default;
  /// @par Threads  Any.
  /// @par Time     No lock, no allocation, at most one system call.
  virtual void wake() noexcept = 0;
};

}  // namespace v0
}  // namespace lrt

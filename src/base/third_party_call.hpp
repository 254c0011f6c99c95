// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <lrt/base/abi.hpp>
#include <lrt/base/waker.hpp>

namespace lrt {
inline namespace v0 {

/// A call of a third party that frees at the end of the process what all its users share: OpenSSL in a handler of atexit(), libxml2 in a destructor.
/// Threads of lrt run until the process has ended. So exit() waits until no call is under way, at most a second, and no call begins after that.
///
/// @par Threads  Any. Calls may be nested.
/// @par Time     Two atomic operations.
class LRT_INTERNAL_API ThirdPartyCall {
 public:
  ThirdPartyCall() noexcept;
  ~ThirdPartyCall();
  ThirdPartyCall(const ThirdPartyCall&) = delete;
  ThirdPartyCall& operator=(const ThirdPartyCall&) = delete;

  /// False: the process ends. The third party must not be called, not even to free an object.
  explicit operator bool() const noexcept { return entered_; }

  /// Registers what waits in exit(). To be called once for each third party, after it has been initialised: handlers run in the opposite order.
  static bool close_at_exit() noexcept;
  /// Something that interrupts a call that waits, so that exit() does not have to.
  static void wake_at_exit(std::weak_ptr<Waker> waker);

 private:
  bool entered_;
};

}  // namespace v0
}  // namespace lrt

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <lrt/base/abi.hpp>

namespace lrt {

/// A call of a third party that frees its global state at exit: OpenSSL in a handler of atexit(), libxml2 in a destructor.
/// Threads of lrt run until the process has ended. Therefore exit() waits at most a second until no call is running, and no call begins after that.
///
/// @par Threads  Any. Calls may be nested.
/// @par Time     Two atomic operations.
class LRT_INTERNAL_API ThirdPartyCall {
 public:
  ThirdPartyCall() noexcept;
  ~ThirdPartyCall();
  ThirdPartyCall(const ThirdPartyCall&) = delete;
  ThirdPartyCall& operator=(const ThirdPartyCall&) = delete;

  /// False: the process is exiting. The third party must not be called, not even to free an object.
  explicit operator bool() const noexcept { return entered_; }

  /// Registers the handler that waits in exit(). Must be called once for each third party, after its initialisation: handlers run in reverse order.
  static bool close_at_exit() noexcept;

 private:
  bool entered_;
};

}  // namespace lrt

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <lrt/base/abi.hpp>

namespace lrt {

/// Stores the process that created it. So an object in the child of fork() can detect that its threads do not exist.
/// Process creation that skips pthread_atfork(3), as vfork and _Fork do, is not noticed: such a child must call exec or _exit.
class LRT_INTERNAL_API OwnProcess {
 public:
  OwnProcess() noexcept : generation_(generation()) {}
  /// @par Time  One load.
  bool is_current() const noexcept { return generation_ == generation(); }

 private:
  /// Counts the forks that led to this process, since lrt was loaded.
  static std::uint32_t generation() noexcept;
  const std::uint32_t generation_;
};

}  // namespace lrt

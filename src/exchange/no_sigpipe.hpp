// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <signal.h>

namespace lrt::exchange {

/// Blocks SIGPIPE while OpenSSL writes, because it does not use MSG_NOSIGNAL. A SIGPIPE caused in that time is discarded.
/// @par Time  Two or three system calls; none if it is not needed.
class NoSigpipe {
 public:
  explicit NoSigpipe(bool needed) noexcept : needed_(needed) {
    if (!needed_) return;
    ::sigemptyset(&pipe_);
    ::sigaddset(&pipe_, SIGPIPE);
    sigset_t pending;
    ::sigpending(&pending);
    was_pending_ = ::sigismember(&pending, SIGPIPE) == 1;
    ::pthread_sigmask(SIG_BLOCK, &pipe_, &before_);
  }
  ~NoSigpipe() {
    if (!needed_) return;
    const timespec now{};
    if (!was_pending_) ::sigtimedwait(&pipe_, nullptr, &now);
    ::pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  NoSigpipe(const NoSigpipe&) = delete;
  NoSigpipe& operator=(const NoSigpipe&) = delete;

 private:
  const bool needed_;
  bool was_pending_ = false;
  sigset_t pipe_, before_;
};

}  // namespace lrt::exchange

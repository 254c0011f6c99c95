#pragma once

#include <pthread.h>
#include <signal.h>

namespace lrt::delivery {

/// While it lives, threads are born with all signals blocked that come from outside: the host's handlers run on the host's threads. What
/// OpenSSL and the disk raise on a thread of ours (SIGPIPE, SIGXFSZ) stays there for ever, and the call fails instead.
class BlockedSignals {
 public:
  BlockedSignals() noexcept {
    sigset_t all;
    ::sigfillset(&all);
    // Faults are a thread's own and not to be held back.
    for (const int fault : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGABRT, SIGSYS}) ::sigdelset(&all, fault);
    ::pthread_sigmask(SIG_BLOCK, &all, &before_);
  }
  ~BlockedSignals() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  BlockedSignals(const BlockedSignals&) = delete;
  BlockedSignals& operator=(const BlockedSignals&) = delete;

 private:
  sigset_t before_;
};

}  // namespace lrt::delivery

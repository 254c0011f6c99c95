// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pthread.h>

#include <utility>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/thread_options.hpp>
#include <lrt/base/unique_function.hpp>

namespace lrt {

/// A handle of a thread that start_thread() has started. It differs from std::thread in its destructor, which joins.
class LRT_INTERNAL_API Thread {
 public:
  Thread() noexcept = default;
  Thread(Thread&& other) noexcept { swap(other); }
  Thread& operator=(Thread&& other) noexcept {
    Thread(std::move(other)).swap(*this);
    return *this;
  }
  /// Must not run on the thread itself.
  ~Thread() { join(); }

  bool joinable() const noexcept { return joinable_; }
  bool is_current() const noexcept { return joinable_ && ::pthread_equal(id_, ::pthread_self()) != 0; }
  void join() noexcept;
  void detach() noexcept;

 private:
  friend Result<Thread> start_thread(const char* name, const ThreadOptions& options, UniqueFunction<void()> run);
  void swap(Thread& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(joinable_, other.joinable_);
  }
  pthread_t id_{};
  bool joinable_ = false;
};

/// Starts a thread. All threads of lrt are started here.
///
/// Policy, priority, CPUs and stack are those of the options; a negative nice value of the caller is not inherited. All signals but faults are
/// blocked, so handlers of the host run on threads of the host only. SIGPIPE and SIGXFSZ then stay pending, and the system call that caused one
/// returns an error. The calling thread is as before. From the first thread on, dlclose() does not unload the shared object that contains lrt.
///
/// @param name  shown by ps -L, top -H and debuggers; at most 15 bytes
/// @param run   an exception that leaves it ends the process
/// @par Errors  invalid_option: the system refuses the options; io_error: it has no further thread
LRT_INTERNAL_API Result<Thread> start_thread(const char* name, const ThreadOptions& options, UniqueFunction<void()> run);

}  // namespace lrt

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>

#include <lrt/base/abi.hpp>
#include <lrt/base/clock.hpp>
#include <lrt/base/thread_options.hpp>
#include <lrt/base/unique_function.hpp>

namespace lrt::client {

/// Threads for work that may block, and for work that is due later. A thread is started when all others are busy, and ends when it has had
/// nothing to do for some seconds.
/// @par Threads  Any.
class LRT_INTERNAL_API Tasks {
 public:
  using Task = UniqueFunction<void()>;  ///< an exception that leaves it is dropped

  /// @param clock  decides when a task is due. If it is moved by hand, check() must follow
  Tasks(const ThreadOptions& threads, std::size_t max_threads, const Clock& clock);
  /// Calls stop().
  ~Tasks();
  Tasks(const Tasks&) = delete;
  Tasks& operator=(const Tasks&) = delete;

  /// Runs a task soon; after stop() never. If the system provides no further thread, it waits for a running one.
  /// @return  false: it does not run, because there is no thread at all or stop() was called
  bool run(Task task);
  bool run_at(std::chrono::steady_clock::time_point due, Task task);
  void check() noexcept;
  /// Drops the tasks that have not begun, and waits for the others. In a task of its own it does not wait for that one.
  void stop() noexcept;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace lrt::client

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>
#include <utility>

#include <lrt/model/detail/wake_signal.hpp>

namespace lrt::model {

/// Whether an action can be invoked now, and the reason if not. Many threads set it, the engine reads it. State and
/// reason are one pointer, so a reader always sees the reason that belongs to the state.
class Availability {
 public:
  /// @param reason  nullptr: it is available; else a text that lives as long as the process
  /// @par Threads  Any.
  /// @par Time     Wait-free, no allocation. One system call if the state changes and the engine sleeps.
  void set(const char* reason) noexcept {
    if (reason_.exchange(reason, std::memory_order_seq_cst) == reason) return;
    if (ChangeSignal* changes = changes_.load(std::memory_order_seq_cst)) changes->changed();
  }
  /// nullptr: it is available.
  const char* reason() const noexcept { return reason_.load(std::memory_order_seq_cst); }

  /// For the engine, once: `changes` is signalled from now on.
  void attach(std::shared_ptr<ChangeSignal> changes) {
    attached_ = std::move(changes);
    changes_.store(attached_.get(), std::memory_order_seq_cst);
  }

 private:
  std::atomic<const char*> reason_{nullptr};
  std::shared_ptr<ChangeSignal> attached_;
  std::atomic<ChangeSignal*> changes_{nullptr};
};

}  // namespace lrt::model

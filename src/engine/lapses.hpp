// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <memory>

#include <lrt/base/clock.hpp>

#include "src/base/mailbox.hpp"
#include "src/model/spec.hpp"

namespace lrt::engine {
inline namespace v0 {

/// Written values that have a life (model::ValueLife), until it is over. One thread at a time uses a queue; it takes no lock and allocates nothing.
class LapseQueue {
 public:
  using Instant = std::chrono::steady_clock::time_point;

  LapseQueue() = default;
  LapseQueue(const LapseQueue&) = delete;
  LapseQueue& operator=(const LapseQueue&) = delete;
  ~LapseQueue();

  /// The value of a property has a life now.
  void add(const std::shared_ptr<model::PropertySpec>& property) noexcept;
  /// The next property whose life is over, which leaves the queue; null: there is none.
  std::shared_ptr<model::PropertySpec> take_due(Instant now) noexcept;
  /// No life is over before this time; Instant::max(): there is none.
  /// @par Threads  Any.
  Instant next() const noexcept { return Instant(Instant::duration(next_.load(std::memory_order_acquire))); }
  bool is_due(Instant now) const noexcept { return next() <= now; }

 private:
  void set_next(Instant next) noexcept { next_.store(next.time_since_epoch().count(), std::memory_order_release); }

  model::PropertySpec* first_ = nullptr;  // a list by ValueLife::next
  std::atomic<Instant::rep> next_{Instant::max().time_since_epoch().count()};
};

/// The written values of a server that have a life. Shared: it may outlive the engine.
class Lapses {
 public:
  using Instant = LapseQueue::Instant;

  /// A write has ended, on the thread that ran it.
  /// @param where    that thread, not Dispatch::as_server
  /// @param written  when on_write was called
  /// @param known    it has succeeded; false: it threw, and may have changed something
  void written(const std::shared_ptr<model::PropertySpec>& property, Dispatch where, Instant written, bool known);

  LapseQueue host;  ///< of lambdas that run in poll(); used by the thread in poll()
  LapseQueue io;    ///< of the others; used by the thread that does I/O
  /// Takes over what other threads have written into `io`.
  void collect();

 private:
  Mailbox<std::shared_ptr<model::PropertySpec>> arrived_;  // from an executor, for `io`
};

}  // namespace v0
}  // namespace lrt::engine

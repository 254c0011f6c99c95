// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <deque>
#include <optional>

#include <lrt/base/unique_function.hpp>

#include "src/base/mailbox.hpp"
#include "src/server/service.hpp"

namespace lrt {

/// Passes user code to the thread or the executor that its Dispatch names.
class UserJobs final : public Service, public TurnWork {
 public:
  static constexpr char key = 0;
  const char* identity() const noexcept override { return &key; }
  TurnWork* turn_work() noexcept override { return this; }

  explicit UserJobs(SharedEngine& server) : server_(server) {}

  /// Without a lock, because user code may call the server.
  void pass_on(engine::Outputs& outputs) override;
  /// Runs the jobs for the thread that does I/O.
  void turn(TimePoint now) override;
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const override;

  /// Runs the next job for the host. False: there is none.
  /// @par Threads  the host's
  bool run_next();
  bool empty() const noexcept { return due_.empty() && arrived_.empty(); }

 private:
  void run_io_jobs();
  void run_stop_jobs();

  SharedEngine& server_;
  Mailbox<UniqueFunction<void()>> arrived_;    ///< for the host
  Mailbox<UniqueFunction<void()>> io_jobs_;    ///< for the thread that does I/O
  Mailbox<UniqueFunction<void()>> stop_jobs_;  ///< the same, of Action::stop(): before the others
  bool runs_io_jobs_ = false;                  ///< that thread's
  std::deque<UniqueFunction<void()>> due_;     ///< taken, not yet run: the host's thread only
};

}  // namespace lrt

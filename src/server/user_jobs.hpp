// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <deque>
#include <limits>
#include <optional>
#include <thread>

#include <lrt/base/unique_function.hpp>

#include "src/base/mailbox.hpp"
#include "src/server/service.hpp"

namespace lrt::engine {
inline namespace v0 {
class Lapses;
}  // namespace v0
}  // namespace lrt::engine

namespace lrt {

/// Passes user code to the thread or the executor that its Dispatch names.
class UserJobs final : public Service, public TurnWork {
 public:
  static constexpr char key = 0;
  const char* identity() const noexcept override { return &key; }
  TurnWork* turn_work() noexcept override { return this; }

  explicit UserJobs(SharedEngine& server);

  /// Without a lock, because user code may call the server.
  void pass_on(engine::Outputs& outputs) override;
  /// Runs the jobs for the thread that does I/O.
  void turn(TimePoint now) override;
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const override;

  /// Runs the next job for the host: a written value that has lapsed, or else user code. False: there is none.
  /// @param stopping  the server stops: every written value has lapsed, and no other code runs
  /// @par Threads  the host's
  bool run_next(bool stopping);
  bool empty() const noexcept { return due_.empty() && arrived_.empty(); }
  /// How long the host may wait for the next lapse; zero: there is one.
  std::chrono::milliseconds until_lapse() const noexcept;
  /// The server has stopped: runs the lapses of lambdas for the host, if the calling thread is the one that ran them, and is not running one now.
  void end_lapses_of_host() noexcept;
  /// The same of lambdas for the thread that does I/O, or for an executor.
  /// @par Threads  that thread's
  void end_lapses_of_io() noexcept;

 private:
  bool run_lapse(bool stopping) noexcept;
  void run_lapses_of_io(std::chrono::steady_clock::time_point now);
  void run_io_jobs();
  void run_stop_jobs();

  SharedEngine& server_;
  engine::Lapses& lapses_;
  Mailbox<UniqueFunction<void()>> arrived_;    ///< for the host
  Mailbox<UniqueFunction<void()>> io_jobs_;    ///< for the thread that does I/O
  Mailbox<UniqueFunction<void()>> stop_jobs_;  ///< the same, of Action::stop(): before the others
  bool runs_io_jobs_ = false;                  ///< that thread's
  std::deque<UniqueFunction<void()>> due_;     ///< taken, not yet run: the host's thread only
  std::atomic<std::thread::id> host_{};        ///< the thread that ran the last job for the host
  bool runs_host_job_ = false;                 ///< that thread's
  std::atomic<std::chrono::steady_clock::rep> woken_for_{std::numeric_limits<std::chrono::steady_clock::rep>::min()};  ///< lapse of the host
};

}  // namespace lrt

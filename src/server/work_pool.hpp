// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <lrt/base/thread_options.hpp>
#include <lrt/engine/engine.hpp>

#include "src/base/thread.hpp"
#include "src/base/turns.hpp"

namespace lrt {

/// Threads that validate bodies or evaluate queries, in turns: a number of jobs runs at a time, and each client (BodyJob::client) gets the same share of
/// that, however many jobs it has and however long they are. Of one client the smallest job comes first.
///
/// A job that has run for a slice pauses (Turns::rest()) if another client has a job and has had less time. It keeps its thread, so that there may be more
/// threads than jobs that run; of one client no more have begun than run at a time. Threads start when they are needed, and stay.
///
/// @par Threads  put(), stop(): any
class WorkPool {
 public:
  using Instant = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::steady_clock::duration;
  using Now = Instant (*)() noexcept;

  /// @param name     of the threads
  /// @param running  jobs at a time; at least 1
  WorkPool(const char* name, std::size_t running, ThreadOptions options, Now now = &std::chrono::steady_clock::now)
      : name_(name), max_running_(running), options_(std::move(options)), now_(now) {}
  ~WorkPool() { stop(); }
  WorkPool(const WorkPool&) = delete;
  WorkPool& operator=(const WorkPool&) = delete;

  /// A job for which there is no memory is destroyed.
  void put(std::vector<engine::BodyJob> jobs) noexcept;
  /// Waits for the jobs that have begun, and destroys the others. Those that are paused go on at once.
  void stop() noexcept;

  static constexpr Duration slice = std::chrono::milliseconds(5);
  /// Threads beyond `running`, for jobs that are paused.
  static constexpr std::size_t max_paused = 32;

 private:
  class Worker;
  struct Client;
  struct Entry {
    engine::BodyJob job;
    Client* client;
  };
  using Jobs = std::multimap<std::size_t, Entry>;  ///< by size
  struct Client {
    Duration used{0};              ///< its time, as in start-time fair queueing: one that returns begins with what the others have now
    std::deque<Worker*> paused{};  ///< they precede its jobs
    Jobs jobs{};                   ///< not begun
    std::size_t begun = 0;         ///< that have not ended
    std::size_t outside = 0;       ///< of these: Turns::leave(). Meanwhile no further job of the client begins: it could wait for the same
    bool is_waiting() const noexcept { return !paused.empty() || (!jobs.empty() && outside == 0); }
  };
  using Clients = std::map<std::string, Client, std::less<>>;

  void work();
  void charge() noexcept;
  Client* next(bool only_paused) noexcept;
  void hand_out() noexcept;
  bool has_thread() noexcept;

  const char* const name_;
  const std::size_t max_running_;
  const ThreadOptions options_;
  const Now now_;
  std::mutex mutex_;  ///< guards all below
  std::condition_variable changed_;
  Clients clients_;  ///< with jobs, or ahead of used_
  Jobs begins_;      ///< each has a place and waits for its thread, which exists
  std::vector<Thread> threads_;
  std::vector<Worker*> workers_;  ///< of the threads, in any order
  std::size_t running_ = 0;       ///< places that are taken
  std::size_t idle_ = 0;          ///< threads without a job, those that begin included
  Duration used_{0};              ///< the least that a client with jobs has used
  bool stopping_ = false;
  std::atomic<std::size_t> waiting_{0};  ///< jobs that wait for a place; changed with the mutex
};

}  // namespace lrt

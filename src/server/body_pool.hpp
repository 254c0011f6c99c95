// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include <lrt/base/thread_options.hpp>
#include <lrt/engine/engine.hpp>

#include "src/base/thread.hpp"

namespace lrt {

/// The queue of bodies to be validated: each client gets the same share of the work, by BodyJob::bytes, and of one client the smallest
/// comes first. A client that sends many large bodies delays only its own requests.
class BodyQueue {
 public:
  void put(engine::BodyJob job);
  /// nullopt: there is none.
  std::optional<engine::BodyJob> take();
  bool empty() const noexcept { return size_ == 0; }

 private:
  /// Start-time fair queueing: `work` is the client's virtual time, the sum of BodyJob::bytes that were executed for it.
  struct Client {
    std::uint64_t work = 0;
    std::multimap<std::size_t, engine::BodyJob> jobs{};  ///< by size
  };

  std::unordered_map<std::string, Client> clients_;  ///< with jobs, or ahead of now_
  std::size_t size_ = 0;
  std::uint64_t now_ = 0;  ///< virtual time at which the last job was taken; new and returning clients start here
};

/// Threads that validate bodies or evaluate queries. They start with the first job.
///
/// @par Threads  put(), stop(): any
class BodyPool {
 public:
  /// @param name     of the threads
  /// @param threads  at least 1
  BodyPool(const char* name, std::size_t threads, ThreadOptions options) : name_(name), max_threads_(threads), options_(std::move(options)) {}
  ~BodyPool() { stop(); }
  BodyPool(const BodyPool&) = delete;
  BodyPool& operator=(const BodyPool&) = delete;

  void put(std::vector<engine::BodyJob> jobs);
  /// Waits for the running validations and drops the others.
  void stop() noexcept;

 private:
  void work();

  const char* const name_;
  const std::size_t max_threads_;
  const ThreadOptions options_;
  std::mutex mutex_;  ///< guards all below
  std::condition_variable changed_;
  BodyQueue queue_;
  std::vector<Thread> threads_;
  std::size_t idle_ = 0;
  bool stopping_ = false;
};

}  // namespace lrt

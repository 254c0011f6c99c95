// SPDX-License-Identifier: Apache-2.0
#include "src/server/user_jobs.hpp"

#include <memory>
#include <string>
#include <utility>

#include "src/server/shared_engine.hpp"

namespace lrt {

void UserJobs::pass_on(engine::Outputs& outputs) {
  bool for_host = false, for_io = false;
  for (engine::Job& job : outputs.jobs) try {
      switch (job.where) {
        case Dispatch::io_thread:
          (job.is_stop ? stop_jobs_ : io_jobs_).put(std::move(job.run));
          for_io = true;
          break;
        case Dispatch::executor:
          if (const auto& executor = server_.options().threads.executor) {
            auto shared = std::make_shared<UniqueFunction<void()>>(std::move(job.run));
            executor([shared] { (*shared)(); });
            break;
          }
          [[fallthrough]];
        default: arrived_.put(std::move(job.run)); for_host = true;
      }
    } catch (const std::exception& e) { server_.log(LogLevel::error, std::string("the executor threw: ") + e.what()); }
  if (for_host) server_.loop().wake_host();
  if (!for_io) return;
  if (server_.loop().is_serving()) run_io_jobs();
  else server_.loop().wake_io();
}

void UserJobs::turn(TimePoint) { run_io_jobs(); }

std::optional<std::chrono::steady_clock::time_point> UserJobs::next_deadline() const {
  if (io_jobs_.empty() && stop_jobs_.empty()) return std::nullopt;
  return std::chrono::steady_clock::time_point{};
}

bool UserJobs::run_next() {
  if (due_.empty()) arrived_.take_all([&](UniqueFunction<void()> job) { due_.push_back(std::move(job)); });
  if (due_.empty()) return false;
  UniqueFunction<void()> job = std::move(due_.front());
  due_.pop_front();
  job();
  return true;
}

/// Jobs run one after the other, never nested, because they may use the same mutex of the user.
void UserJobs::run_io_jobs() {
  if (runs_io_jobs_) return;
  runs_io_jobs_ = true;
  do {
    run_stop_jobs();
    io_jobs_.take_all([this](UniqueFunction<void()> job) {
      job();
      run_stop_jobs();
    });
  } while (!io_jobs_.empty() || !stop_jobs_.empty());
  runs_io_jobs_ = false;
}

void UserJobs::run_stop_jobs() {
  while (!stop_jobs_.empty()) stop_jobs_.take_all([](UniqueFunction<void()> job) { job(); });
}

std::unique_ptr<Service> make_user_jobs(SharedEngine& server) { return std::make_unique<UserJobs>(server); }

}  // namespace lrt

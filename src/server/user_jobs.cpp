// SPDX-License-Identifier: Apache-2.0
#include "src/server/user_jobs.hpp"

#include <algorithm>
#include <memory>
#include <new>
#include <string>
#include <utility>

#include "src/engine/host_calls.hpp"
#include "src/engine/lapses.hpp"
#include "src/server/shared_engine.hpp"

namespace lrt {

namespace {

using Instant = engine::LapseQueue::Instant;

/// All lives are over then.
constexpr Instant end_of_time = Instant::max() - std::chrono::nanoseconds(1);

/// Calls the lambda of a value if its life is over at that time.
/// @return  what went wrong; empty: nothing
std::string lapse(model::PropertySpec& property, Instant now) noexcept {
  if (!property.life->take(now)) return {};
  const Result<void> done = engine::guarded<void>([&]() -> Result<void> {
    property.life->lapse();
    return {};
  });
  if (done) return {};
  try {
    return "the lambda of expires() of property \"" + property.location() + "\" failed: " + done.error().message;
  } catch (...) { return "out of memory"; }
}

void report(const std::string& fault, const LogCallback& log) noexcept {
  if (fault.empty() || !log) return;
  try {
    log(LogLevel::error, fault);
  } catch (...) {}
}

}  // namespace

UserJobs::UserJobs(SharedEngine& server) : server_(server), lapses_(server.engine().lapses()) {}

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
    } catch (const std::exception& e) { server_.log(LogLevel::error, "the executor threw", e); }
  if (for_host) server_.loop().wake_host();
  if (!for_io) return;
  if (server_.loop().is_serving()) run_io_jobs();
  else server_.loop().wake_io();
}

void UserJobs::turn(TimePoint now) {
  // The thread of the host may wait without a time of its own, as on Server::descriptor(). It is woken once for each lapse.
  if (const Instant next = lapses_.host.next(); next <= now.steady && woken_for_ != next.time_since_epoch().count()) {
    woken_for_ = next.time_since_epoch().count();
    server_.loop().wake_host();
  }
  run_stop_jobs();
  try {
    run_lapses_of_io(now.steady);
  } catch (const std::exception& e) { server_.log(LogLevel::error, "the executor threw", e); }
  run_io_jobs();
}

std::optional<std::chrono::steady_clock::time_point> UserJobs::next_deadline() const {
  if (!io_jobs_.empty() || !stop_jobs_.empty()) return Instant{};
  lapses_.collect();
  Instant next = lapses_.io.next();
  if (const Instant of_host = lapses_.host.next(); woken_for_ != of_host.time_since_epoch().count()) next = std::min(next, of_host);
  return next == Instant::max() ? std::nullopt : std::optional(next);
}

bool UserJobs::run_next(bool stopping) {
  struct Running {
    bool& flag;
    const bool before;
    ~Running() { flag = before; }
  } const running{runs_host_job_, std::exchange(runs_host_job_, true)};
  host_.store(std::this_thread::get_id(), std::memory_order_relaxed);
  if (run_lapse(stopping)) return true;
  if (stopping) return false;
  if (due_.empty())
    arrived_.take_all([&](UniqueFunction<void()> job) noexcept {
      try {
        due_.push_back(std::move(job));
      } catch (const std::bad_alloc&) {}  // it is not run, and says so when it is destroyed
    });
  if (due_.empty()) return false;
  UniqueFunction<void()> job = std::move(due_.front());
  due_.pop_front();
  job();
  return true;
}

// ---------------------------------------------------------------------------------------------------------------- lapses

std::chrono::milliseconds UserJobs::until_lapse() const noexcept {
  const Instant next = lapses_.host.next();
  if (next == Instant::max()) return std::chrono::milliseconds::max();
  return std::max(std::chrono::milliseconds(0), std::chrono::ceil<std::chrono::milliseconds>(next - server_.clock().now().steady));
}

/// Runs one lambda of a value that has lapsed. A lapse precedes jobs: a write that came too late is carried out after it.
bool UserJobs::run_lapse(bool stopping) noexcept {
  if (lapses_.host.next() == Instant::max()) return false;
  const Instant now = stopping ? end_of_time : server_.clock().now().steady;
  const auto property = lapses_.host.take_due(now);
  if (!property) return false;
  if (const std::string fault = lapse(*property, now); !fault.empty()) report(fault, server_.waking_log());
  return true;
}

void UserJobs::run_lapses_of_io(Instant now) {
  lapses_.collect();
  while (const auto property = lapses_.io.take_due(now)) {
    if (property->life->on_executor) {
      engine::Outputs outputs;
      outputs.jobs.push_back({Dispatch::executor, [property, now, log = server_.options().log] {  // it may outlive the server
                                report(lapse(*property, now), log);
                              }});
      pass_on(outputs);
    } else {
      report(lapse(*property, now), server_.log_sink());
    }
  }
}

void UserJobs::end_lapses_of_host() noexcept {
  if (host_.load(std::memory_order_relaxed) != std::this_thread::get_id() || runs_host_job_) return;
  while (run_lapse(true)) {}
}

void UserJobs::end_lapses_of_io() noexcept {
  try {
    run_lapses_of_io(end_of_time);
  } catch (const std::exception& e) { server_.log(LogLevel::error, "the executor threw", e); } catch (...) {
  }
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

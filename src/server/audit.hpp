// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/security.hpp>

#include "src/base/event_waker.hpp"
#include "src/base/mailbox.hpp"
#include "src/base/thread.hpp"
#include "src/server/service.hpp"

namespace lrt {

/// Passes lines to the audit sink on a separate thread. Writers neither lock nor wait.
///
/// @par Threads  any; run(): its own
class AuditWriter {
 public:
  AuditWriter(const security::Audit& options, LogCallback log) : sink_(options.sink), max_lines_(options.max_waiting_lines), log_(std::move(log)) {}

  /// Calls the sink until stop() has been called and all lines are written.
  void run() noexcept;
  void stop() noexcept;

  void write(std::string line) noexcept;
  /// Counts a line that could not be created.
  void drop() noexcept;
  /// All lines that were dropped.
  std::uint64_t dropped() const noexcept { return all_dropped_.load(std::memory_order_relaxed); }
  std::size_t waiting() const noexcept { return waiting_.load(std::memory_order_relaxed); }

 private:
  void give(std::string line) noexcept;
  void say_once(const char* why) noexcept;

  const std::function<void(std::string_view)> sink_;
  const std::size_t max_lines_;
  const LogCallback log_;
  EventWaker waker_;
  Mailbox<std::string> lines_;
  std::atomic<std::size_t> waiting_{0};
  std::atomic<std::uint64_t> dropped_{0};  ///< since the last line
  std::atomic<std::uint64_t> all_dropped_{0};
  std::atomic<bool> stopping_{false};
  bool sink_fails_ = false;  ///< the last call threw; used by the sink's thread
};

/// Writes the principal, method, resource and outcome as lines of JSON: for requests that change or command something, refusals and subscriptions. No
/// line has a query, a header field or a body.
///
/// @par Threads  As Service and RequestObserver say.
class Audit final : public Service, public RequestObserver {
 public:
  RequestObserver* observer() noexcept override { return this; }

  /// @param query_path  of the endpoint of queries, where a POST changes nothing; empty: there is none
  Audit(const security::Audit& options, const ThreadOptions& threads, const Clock& clock, LogCallback log, std::string query_path = {})
      : options_(options), threads_(threads), clock_(clock), query_path_(std::move(query_path)), writer_(options, std::move(log)) {}

  /// @par Errors  invalid_option
  static Result<void> check(const security::Audit& options);
  /// Starts the thread that calls the sink.
  /// @par Errors  those of check()
  Result<void> prepare() override;
  void take(engine::Outputs& outputs) override;
  void handled(const http::Request& request, const Result<engine::Caller>& caller, const engine::Outcome& outcome, TimePoint now) override;
  void refused(const http::Request& request, const Result<engine::Caller>& caller, const http::Response& response, TimePoint now) override;
  void replied(const engine::Reply& reply) override;
  void abandoned(engine::Ticket ticket) override;
  void dropped() noexcept override { writer_.drop(); }
  /// The first caller joins the thread, without a lock: the sink may be stopping the server, too.
  void join() noexcept override;
  bool is_current_thread() noexcept override;
  void count(ServerCounters& all) const override;

 private:
  struct Sender {
    std::shared_ptr<const security::Principal> principal;
    std::string address;
  };
  struct Record {
    std::chrono::system_clock::time_point time;
    Sender sender;
    std::string method, path;
  };
  struct Subscription {
    std::string resource;
    std::string_view protocol;
    Sender sender;
  };
  static Record record_of(const http::Request& request, const Result<engine::Caller>& caller, TimePoint now);
  void finished(const Record& record, const http::Response& response);
  bool is_wanted(const Record& record, int status, http::Denial denial, bool subscribes) const;

  void changed(const engine::SubscriptionEvent& event, TimePoint now);

  const security::Audit& options_;
  const ThreadOptions& threads_;
  const Clock& clock_;
  const std::string query_path_;
  std::unordered_map<std::uint64_t, Record> deferred_;           ///< by ticket
  std::unordered_map<std::string, Subscription> subscriptions_;  ///< by path; those that exist
  std::vector<std::string> made_;                                ///< whose request is still pending
  AuditWriter writer_;
  std::mutex mutex_;  ///< guards thread_, not its end
  Thread thread_;
};

}  // namespace lrt

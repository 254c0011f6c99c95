// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
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
#include "src/server/audit_output.hpp"
#include "src/server/service.hpp"

namespace lrt {

class SharedEngine;

/// Passes lines to the audit sink on a separate thread. Writers neither lock nor wait.
class AuditWriter final : public AuditOutput {
 public:
  AuditWriter(const security::Audit& options, LogCallback log)
      : sink_(options.sink), max_lines_(options.max_waiting_lines), max_bytes_(options.max_waiting_bytes), log_(std::move(log)) {}

  void run() noexcept override;
  void stop() noexcept override;
  std::uint64_t write(std::string line) noexcept override;
  void drop() noexcept override;
  void count(ServerCounters& all) const override;

 private:
  void give(std::string line) noexcept;
  void say_once(const char* why) noexcept;

  const std::function<void(std::string_view)> sink_;
  const std::size_t max_lines_, max_bytes_;
  const LogCallback log_;
  EventWaker waker_;
  Mailbox<std::string> lines_;
  std::uint64_t number_ = 0;  ///< of the newest line
  std::atomic<std::size_t> waiting_{0}, waiting_bytes_{0};
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

  TurnWork* turn_work() noexcept override { return hold_; }

  explicit Audit(SharedEngine& server);

  /// @par Errors  invalid_option
  static Result<void> check(const security::Audit& options);
  /// Starts the thread that calls the sink.
  /// @par Errors  those of check()
  Result<void> prepare() override;
  void take(engine::Outputs& outputs) override;
  void handled(const http::Request& request, const Result<engine::Caller>& caller, engine::Outcome& outcome, TimePoint now) override;
  void refused(const http::Request& request, const Result<engine::Caller>& caller, const http::Response& response, TimePoint now) override;
  bool replied(engine::Reply& reply) override;
  void end_waits(TimePoint now) override;
  void abandoned(engine::Ticket ticket) override;
  void dropped() noexcept override { output_->drop(); }
  void wake_all() noexcept override;
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
    bool waits = false;  ///< its response is sent when its line is saved
  };
  struct Subscription {
    std::string resource;
    std::string_view protocol;
    Sender sender;
  };
  Record record_of(const http::Request& request, const Result<engine::Caller>& caller, TimePoint now) const;
  /// @return  the number of its line; 0: it was dropped; nullopt: there is none
  std::optional<std::uint64_t> finished(const Record& record, const http::Response& response);
  bool must_wait(const Record& record, const http::Response& response) const noexcept;
  bool is_wanted(const Record& record, int status, http::Denial denial, bool subscribes) const;

  void changed(const engine::SubscriptionEvent& event, TimePoint now);

  SharedEngine& server_;
  const security::Audit& options_;
  const std::string query_path_;
  std::unordered_map<std::uint64_t, Record> deferred_;           ///< by ticket
  std::unordered_map<std::string, Subscription> subscriptions_;  ///< by path; those that exist
  std::vector<std::string> made_;                                ///< whose request is still pending
  const std::unique_ptr<AuditOutput> output_;
  AuditHold* const hold_;  ///< nullptr: responses do not wait
  std::mutex mutex_;       ///< guards thread_, not its end
  Thread thread_;
};

}  // namespace lrt

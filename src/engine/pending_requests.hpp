// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <unordered_map>
#include <utility>

#include <lrt/base/unique_function.hpp>
#include <lrt/engine/handler.hpp>

#include "src/engine/context.hpp"
#include "src/engine/cors.hpp"
#include "src/engine/host_calls.hpp"
#include "src/engine/registry.hpp"

namespace lrt::engine {
inline namespace v0 {

/// Requests whose response comes later: each with its context, its deadline, and what happens if it passes.
class PendingRequests {
 public:
  using Instant = std::chrono::steady_clock::time_point;
  /// Called at the deadline, with the request still pending. It must respond.
  /// @param runs  the call that the request waits for has begun, and continues; false: it will not run
  using Timeout = UniqueFunction<void(Ticket, Context&, bool runs)>;

  PendingRequests(const Registry& registry, const HostCalls& calls, const Cors& cors, std::size_t max_pending)
      : registry_(registry), calls_(calls), cors_(cors), max_pending_(max_pending) {}

  /// Keeps a request for at most that time. One that is kept already (Context::ticket) keeps its ticket, and waits for something else now.
  /// @param where  its call runs. Requests for the I/O thread have a limit of their own, so that a stop can be invoked while a thousand
  ///               others wait for the host.
  /// @return nullopt: too many requests or calls into the host wait already (503)
  std::optional<Ticket> defer(const Context& context, std::chrono::milliseconds max_time, Timeout on_timeout, Dispatch where = Dispatch::in_poll);
  /// Keeps a request that stops the robot. There is no limit but the transport's: each has its connection.
  Ticket defer_stop(const Context& context, std::chrono::milliseconds max_time, Timeout on_timeout);
  /// Keeps a request that waits for the disk. These have a limit of their own, too.
  std::optional<Ticket> defer_for_disk(const Context& context, std::chrono::milliseconds max_time, Timeout on_timeout);
  /// The call that the request waits for. It is cancelled when the client goes or the time is over.
  void waits_for(Ticket ticket, std::shared_ptr<CancelToken> token);
  /// Sets `ended` when the request has its response, or its client has gone or sends nothing more: what is being computed for it is given up.
  void tell_end(Ticket ticket, std::shared_ptr<std::atomic<bool>> ended);
  bool is_pending(Ticket ticket) const { return pending_.count(static_cast<std::uint64_t>(ticket)) != 0; }
  /// Goes on with a request: its context at that time, with the resource if it is still there. nullptr: the request is not pending any more.
  Context* resume(Ticket ticket, TimePoint now);

  void respond(Ticket ticket, http::Response response, std::optional<Channel> channel = {});
  /// The same of what a step has come to. Deferred: the request goes on waiting.
  void respond(Ticket ticket, Outcome outcome);
  /// The client is gone. A call that has not begun is cancelled; one that runs goes on.
  void abandon(Ticket ticket) noexcept;
  /// The client sends nothing more. What tell_end() was called for ends; the request remains.
  void input_ended(Ticket ticket) noexcept;
  /// The next that defer() gives.
  Ticket next_ticket() const noexcept { return Ticket{next_ticket_}; }
  /// Forgets this and later ones: a request failed after it was deferred.
  void abandon_from(Ticket first) noexcept;
  /// Runs the timeouts that are due.
  void expire(TimePoint now);
  std::size_t size() const noexcept { return pending_.size(); }
  std::optional<Instant> next_deadline() const;
  std::optional<Reply> take_reply();
  /// Responds to every request now, with its call cancelled.
  void end_all(const std::function<http::Response(Context&)>& respond_with, TimePoint now);

 private:
  enum class WaitsFor : std::uint8_t { host, io_thread, disk, stop };
  struct Pending {
    Context context;
    Timeout on_timeout;
    std::shared_ptr<CancelToken> token;
    std::shared_ptr<std::atomic<bool>> ended;
    std::multimap<Instant, Ticket>::iterator deadline;
    WaitsFor waits_for;
  };
  using Requests = std::unordered_map<std::uint64_t, Pending>;

  std::optional<Ticket> keep(const Context& context, std::chrono::milliseconds max_time, Timeout on_timeout, WaitsFor what);
  void remove(Requests::iterator request);

  const Registry& registry_;
  const HostCalls& calls_;
  const Cors& cors_;
  const std::size_t max_pending_;
  std::uint64_t next_ticket_ = 1;
  Requests pending_;
  std::array<std::size_t, 4> waiting_{};  ///< by WaitsFor
  std::multimap<Instant, Ticket> deadlines_;
  std::deque<Reply> replies_;
};

}  // namespace v0
}  // namespace lrt::engine

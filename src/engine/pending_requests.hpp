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

/// Requests whose response comes later: each with its context, its deadline, and what happens if it passes.
class PendingRequests {
 public:
  using Instant = std::chrono::steady_clock::time_point;
  /// Called at the deadline, with the request still pending. It must respond.
  /// @param runs  the call that the request waits for has begun, and continues; false: it will not run
  using Timeout = UniqueFunction<void(Ticket, Context&, bool runs)>;

  PendingRequests(const Registry& registry, const HostCalls& calls, const Cors& cors, std::size_t max_pending)
      : registry_(registry), calls_(calls), cors_(cors), max_pending_(max_pending) {}

  /// Keeps a request for at most that time. A request that is already kept (Context::ticket) keeps its ticket and waits for the new event.
  /// @param where  its call runs. Requests for the I/O thread have a limit of their own, so that a stop can be invoked while a thousand
  ///               others wait for the host.
  /// @return nullopt: too many requests or calls into the host wait already (503)
  std::optional<Ticket> defer(const Context& context, std::chrono::milliseconds max_time, Timeout on_timeout, Dispatch where = Dispatch::in_poll);
  /// Keeps a request that stops the robot. Only the transport's number of connections limits these.
  Ticket defer_stop(const Context& context, std::chrono::milliseconds max_time, Timeout on_timeout);
  /// Keeps a request that waits for the disk. These requests have a separate limit.
  std::optional<Ticket> defer_for_disk(const Context& context, std::chrono::milliseconds max_time, Timeout on_timeout);
  /// Sets the call that the request waits for. It is cancelled when the client disconnects or the time is over.
  void waits_for(Ticket ticket, std::shared_ptr<CancelToken> token);
  /// Its deadline is not later than that.
  void answer_by(Ticket ticket, Instant time);
  /// Sets `ended` when the request has its response or its client has closed the connection, so that the computation can stop.
  void tell_end(Ticket ticket, std::shared_ptr<std::atomic<bool>> ended);
  bool is_pending(Ticket ticket) const { return pending_.count(static_cast<std::uint64_t>(ticket)) != 0; }
  /// Continues a request: its context, with the resource if that still exists. nullptr: the request is no longer pending.
  Context* resume(Ticket ticket, TimePoint now);

  void respond(Ticket ticket, http::Response response, std::optional<Channel> channel = {});
  /// The same for the outcome of a step. Deferred: the request continues to wait.
  void respond(Ticket ticket, Outcome outcome);
  /// The client has disconnected. A call that has not started is cancelled; a running call continues.
  void abandon(Ticket ticket) noexcept;
  /// The client has closed its sending side. The flag of tell_end() is set; the request remains pending.
  void input_ended(Ticket ticket) noexcept;
  /// The next ticket that defer() returns.
  Ticket next_ticket() const noexcept { return Ticket{next_ticket_}; }
  /// Removes this ticket and later ones, after a request failed that was already deferred.
  void abandon_from(Ticket first) noexcept;
  /// Runs the timeouts that are due.
  void expire(TimePoint now);
  std::size_t size() const noexcept { return pending_.size(); }
  std::optional<Instant> next_deadline() const;
  std::optional<Reply> take_reply();
  /// Responds to every request now, with its call cancelled.
  void end_all(const std::function<http::Response(Context&)>& respond_with, TimePoint now);

 private:
  void respond_bare(Ticket ticket);
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

}  // namespace lrt::engine

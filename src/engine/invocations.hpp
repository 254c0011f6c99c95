// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <lrt/engine/engine.hpp>

#include "src/engine/bodies.hpp"
#include "src/engine/change_scanner.hpp"
#include "src/engine/client_counts.hpp"
#include "src/engine/command_rules.hpp"
#include "src/engine/context.hpp"
#include "src/engine/deadline_queue.hpp"
#include "src/engine/host_calls.hpp"
#include "src/engine/pending_requests.hpp"
#include "src/engine/registry.hpp"
#include "src/engine/representations.hpp"
#include "src/engine/resources/action.hpp"
#include "src/engine/stop_states.hpp"

namespace lrt::engine {

/// The life cycle of invocations: created by POST according to the Action's policy, started on the host, finished, cancelled, removed.
class Invocations {
 public:
  Invocations(const EngineOptions& options, Registry& registry, HostCalls& calls, PendingRequests& pending, const Responses& responses,
              const CommandRules& rules, Representations& representations, Bodies& bodies, ChangeScanner& scanner,
              const std::unique_ptr<StopStates>& stops)
      : options_(options),
        registry_(registry),
        calls_(calls),
        pending_(pending),
        responses_(responses),
        rules_(rules),
        representations_(representations),
        bodies_(bodies),
        scanner_(scanner),
        stops_(stops) {}

  /// POST to an Action.
  Outcome invoke(ActionResource& action, Context& context);
  /// DELETE of an invocation.
  Outcome remove(InvocationResource& invocation, Context& context);
  /// The Action is removed. Requests that wait for its invocations get 404.
  void removed(ActionResource& action, TimePoint now);
  /// A stop ends those of an Action that wait or run: they fail.
  void end_by_stop(ActionResource& action, TimePoint now);
  /// An invocation of a release has ended the stop, or not.
  void conclude_release(InvocationResource& release, bool ends, TimePoint now);
  /// The engine stops: invocations that the host has not started never start.
  void stop();

  /// Fails the invocations that the host has not started in time: a robot must not execute outdated commands.
  void expire(TimePoint now);
  std::optional<DeadlineQueue<ResourceId>::Instant> next_deadline() const { return start_deadlines_.next(); }

 private:
  void cancel_oldest(ActionResource& action, TimePoint now);
  /// The response if the policy excludes another invocation now.
  std::optional<http::Response> refused_by_policy(const ActionResource& action, const Context& context) const;
  void wait_in_queue(InvocationResource& invocation);
  void launch_or_end(InvocationResource& invocation, TimePoint now);
  void launch(InvocationResource& invocation, TimePoint now);
  void started(InvocationResource& invocation, TimePoint now);
  void start_returned(InvocationResource& invocation, TimePoint now);
  void finished(InvocationResource& invocation, Result<rdf::Value> result, TimePoint now);
  void cancel_on_host(InvocationResource& invocation);
  void cancel(InvocationResource& invocation, TimePoint now);
  void end_by_stop(InvocationResource& invocation, TimePoint now);
  void conclude(InvocationResource& invocation, TimePoint now);
  void never_begun(InvocationResource& invocation, Refusal why, TimePoint now);
  void set_start_deadline(InvocationResource& invocation);
  bool accept(InvocationResource& invocation);
  void ended(InvocationResource& invocation, TimePoint now);
  void wait_is_over(Ticket ticket, Context& context, ResourceId invocation, bool may_take_long);
  template <class MakeResponse>
  void respond_to(const std::vector<WaitingRequest>& requests, TimePoint now, MakeResponse make);
  void launch_next(ActionResource& action, TimePoint now);
  void prune(ActionResource& action);
  static void leave_queue(InvocationResource& invocation);
  /// The response after the robot accepted the invocation: its result, its error, or a link to the invocation.
  http::Response response_for(const Context& context, const InvocationResource& invocation) const;
  /// 429 if the client has as many invocations as it may have.
  std::optional<http::Response> refused_client(const ActionResource& action, const Context& context) const;
  /// 202: the invocation continues, and its resource shows its status.
  http::Response accepted(const Context& context, const InvocationResource& invocation) const;

  const EngineOptions& options_;
  Registry& registry_;
  HostCalls& calls_;
  PendingRequests& pending_;
  const Responses& responses_;
  const CommandRules& rules_;
  Representations& representations_;
  Bodies& bodies_;
  ChangeScanner& scanner_;
  const std::unique_ptr<StopStates>& stops_;
  DeadlineQueue<ResourceId> start_deadlines_;  ///< the time by which an invocation must start
  ClientCounts clients_;                       ///< clients with unfinished invocations
};

}  // namespace lrt::engine

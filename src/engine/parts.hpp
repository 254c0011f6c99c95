// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/engine/engine.hpp>

#include "src/engine/access.hpp"
#include "src/engine/bases.hpp"
#include "src/engine/bodies.hpp"
#include "src/engine/callback_rules.hpp"
#include "src/engine/change_scanner.hpp"
#include "src/engine/command_rules.hpp"
#include "src/engine/cors.hpp"
#include "src/engine/description.hpp"
#include "src/engine/host_calls.hpp"
#include "src/engine/invocations.hpp"
#include "src/engine/lapses.hpp"
#include "src/engine/message_schedule.hpp"
#include "src/engine/pending_requests.hpp"
#include "src/engine/pending_saves.hpp"
#include "src/engine/property_values.hpp"
#include "src/engine/queries.hpp"
#include "src/engine/receivers/receiver.hpp"
#include "src/engine/registry.hpp"
#include "src/engine/representation_cache.hpp"
#include "src/engine/representations.hpp"
#include "src/engine/resources/dataset.hpp"
#include "src/engine/resources/documents.hpp"
#include "src/engine/resources/kind.hpp"
#include "src/engine/resources/session.hpp"
#include "src/engine/resources/structure.hpp"
#include "src/engine/resources/tree.hpp"
#include "src/engine/responses.hpp"
#include "src/engine/rights_changes.hpp"
#include "src/engine/saved_subscriptions.hpp"
#include "src/engine/stop_states.hpp"
#include "src/engine/subscribers.hpp"
#include "src/engine/subscription_requests.hpp"
#include "src/engine/subscriptions.hpp"
#include "src/engine/vocabulary.hpp"

namespace lrt::engine {
inline namespace v0 {

/// The parts of an engine. Each has its own state and depends only on the parts declared before it.
struct Parts {
  explicit Parts(EngineOptions given);
  ~Parts();

  /// Registers a Thing completely, or not at all.
  Result<void> add(Thing thing);
  void remove(ThingNode& thing);
  /// Keeps objects with user lambdas until they can be destroyed without a lock.
  template <class T>
  void discard(std::unique_ptr<T> object) {
    if (object) discarded.push_back(std::shared_ptr<const void>(std::move(object)));
  }
  /// Adds what the parts hand out. False: nothing.
  bool take(Outputs& outputs);
  /// All resources that can be observed, except subscriptions.
  std::vector<ObservableResource> observable_resources() const;
  /// Responds 404 to a waiting request whose resource was removed.
  void respond_gone(Ticket ticket);
  /// The response when the host has not executed a change in time: 202 if its lambda is running, else the call is cancelled, and
  /// the response is 412 if the command is late, and 503 if the host is.
  PendingRequests::Timeout timed_out();
  /// Keeps a command until the host has executed it, with that timeout. nullopt: too many requests wait (503).
  std::optional<Ticket> defer_command(const Context& command, Dispatch where);

  const EngineOptions options;
  const Clock& clock;
  const RunTime run_time;                                             ///< by which commands expire
  StampedFields stamped_fields;                                       ///< with the time of each response
  Bases bases;                                                        ///< hosts and base IRIs
  const Cors cors;                                                    ///< pages of other origins
  RepresentationCache cache;                                          ///< representations that are kept
  Registry registry;                                                  ///< paths, and the tree of Things
  Kinds kinds;                                                        ///< Blueprints of equal Things
  Vocabulary vocabulary;                                              ///< terms that are made of C++ types
  HostCalls calls;                                                    ///< into user code and back
  const std::shared_ptr<Lapses> lapses = std::make_shared<Lapses>();  ///< written values that have a life
  PendingRequests pending;                                            ///< requests that wait
  const std::string context_text;                                     ///< of the JSON-LD context; empty: this build has no JSON-LD
  Responses responses;                                                ///< errors, and responses that are no representation
  const CommandRules rules;                                           ///< which commands are carried out now
  PendingSaves saves;                                                 ///< requests that wait until callbacks are saved
  PropertyValues values;                                              ///< reading properties
  const EngineView view;                                              ///< what descriptions read
  Representations representations;                                    ///< GET, HEAD, OPTIONS, conditions
  Bodies bodies;                                                      ///< bytes to values
  DeadlineQueue<ResourceId> leases;                                   ///< when control of Things ends
  ChangeScanner scanner;                                              ///< finding changes of observed resources
  CallbackRules callback_rules;                                       ///< which receivers callbacks may reach
  RightsChanges rights;                                               ///< since requests were judged
  Subscribers subscribers;                                            ///< the present subscriptions
  MessageSchedule schedule;                                           ///< which of them have a message, and when it may be sent
  const ReceiverParts receiver_parts;
  SubscriptionRequests subscription_requests;  ///< requests for subscriptions
  Subscriptions subscriptions;                 ///< subscriptions that begin, take messages and end
  const AccessControl access;                  ///< who may send a request
  SavedSubscriptions saved;                    ///< callbacks over a restart
  std::unique_ptr<StopStates> stops;           ///< which Things are stopped; nullptr: none says it
  Invocations invocations;                     ///< the life of commands
  TreeResource tree;                           ///< all Things as one document
  StructureResource structure;                 ///< the same without values
  RootResource root;
  TermsResource terms;
  ContextResource context;
  VocabularyResource own_terms;
  DatasetResource dataset;
  std::unique_ptr<Queries> queries;        ///< SPARQL; nullptr: there is none
  std::optional<SessionResource> session;  ///< nullopt: nobody can log in
  std::optional<TicketResource> tickets;
  const std::shared_ptr<model::HandleLog> handle_log;  ///< of messages about the use of handles
  std::uint64_t taken_structure = 0;                   ///< of the last Outputs::structure
  std::vector<std::shared_ptr<const void>> discarded;  ///< Outputs::discarded
};

}  // namespace v0
}  // namespace lrt::engine

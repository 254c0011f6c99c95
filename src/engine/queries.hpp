// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <variant>
#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/engine/query_service.hpp>

#include "src/engine/change_scanner.hpp"
#include "src/engine/context.hpp"
#include "src/engine/host_calls.hpp"
#include "src/engine/pending_requests.hpp"
#include "src/engine/property_values.hpp"
#include "src/engine/representations.hpp"
#include "src/engine/resources/query.hpp"
#include "src/engine/responses.hpp"
#include "src/engine/snapshots.hpp"
#include "src/engine/subscriptions.hpp"

namespace lrt::engine {

class ReadSet;

/// Queries of clients, evaluated once or standing. The engine reads the request, updates the values and the graphs, and queues a job that
/// evaluates the query without the engine's lock.
///
/// The engine calls virtual functions only: QueryService::Extension says why.
class Queries {
 public:
  using Instant = std::chrono::steady_clock::time_point;

  /// @param shared  resources with graphs that belong to no Thing
  Queries(const EngineOptions& options, const QueryService& service, const Clock& clock, Registry& registry, HostCalls& calls,
          PendingRequests& pending, const Responses& responses, Representations& representations, PropertyValues& values, ChangeScanner& scanner,
          const Subscribers& subscribers, Subscriptions& subscriptions, std::function<std::vector<Resource*>()> shared);
  virtual ~Queries();

  /// @par Errors  invalid_option
  virtual Result<void> check_options() const;

  // Requests.
  /// nullopt: a GET without a query, which requests the service description.
  std::optional<Outcome> get(Context& context);
  Outcome post(Context& context);
  Outcome subscribe(Context& context, Protocol protocol);

  /// Starts the due evaluations of standing queries.
  virtual void advance(TimePoint now);
  virtual std::optional<Instant> next_deadline() const;
  virtual std::vector<BodyJob> take_jobs() { return std::exchange(jobs_, {}); }
  /// Cancels running evaluations.
  virtual void stop();
  /// Adds the numbers of queries.
  virtual void count(EngineCounts& all) const;

  // Standing queries.
  /// The last observer has left.
  void unobserved(StandingQuery& query) noexcept;
  /// While a change of the resource is reported: whether it may change the result.
  bool is_change_for(const StandingQuery& query, const Resource& resource) const;
  void unwatch(StandingQuery& query, StandingQuery::Watch& watch);

 private:
  /// The query of a request and its parameters.
  struct Asked {
    std::optional<std::string> text;  ///< nullopt: there is no query
    std::vector<std::string> default_graphs, named_graphs;
    bool changes = false;  ///< of a standing query: the added and removed rows
  };
  /// A query in progress.
  struct Evaluation {
    std::shared_ptr<const PreparedQuery> query;
    std::shared_ptr<Snapshot> snapshot;
    Snapshots::Needs needs{};
    std::shared_ptr<std::atomic<bool>> cancelled = std::make_shared<std::atomic<bool>>(false);
    std::string client{};     ///< who has its share of the time used
    bool is_counted = false;  ///< for that client, until done() is called
    std::optional<std::size_t> max_rows{};
    std::function<void()> graphs_are_current{};                        ///< called just before it starts; may be empty
    UniqueFunction<void(std::shared_ptr<const QueryAnswer>)> write{};  ///< run by the job, without the engine's lock
    UniqueFunction<void(Result<std::shared_ptr<const QueryAnswer>>, TimePoint)> done{};
  };

  std::variant<Asked, http::Response> asked_in(const Context& context, std::string_view form, bool is_body) const;
  std::variant<std::shared_ptr<const PreparedQuery>, http::Response> parse(const Context& context, const Asked& asked) const;
  Outcome ask(Context& context, const Asked& asked);
  void start(const std::shared_ptr<Evaluation>& evaluation) noexcept;
  void snapshot_for(std::shared_ptr<Evaluation> evaluation);
  void begin(std::shared_ptr<Evaluation> evaluation);
  http::Response response_to(Context& context, const PreparedQuery& query, std::size_t type, Result<std::string> text) const;
  ReadSet read_set(const QueryDependencies& needs, const std::vector<std::uint32_t>& predicates, const Snapshot& snapshot) const;
  std::size_t running_of(const std::string& client) const;
  bool is_full_for(const std::string& client) const;
  void count_up(Evaluation& evaluation);
  http::Response refused(http::Response response);
  void count_down(Evaluation& evaluation) noexcept;
  std::optional<Ticket> defer(const Context& context);
  http::Response failed(const Context& context, const Error& error) const;
  http::Response too_many(const Context& context, const char* what) const;
  http::Response too_many_of_client(const Context& context, http::Denial denial, const std::string& what) const;

  std::variant<StandingQuery*, http::Response> standing_for(Context& context, const Asked& asked);
  std::string_view payer_of(const StandingQuery& query) const;
  bool may_start(const StandingQuery& query) const;
  void evaluate(StandingQuery& query, TimePoint now);
  void evaluated(ResourceId id, Result<StandingQuery::Answer> answer, TimePoint now);
  void serve_waiters(StandingQuery& query, TimePoint now);
  void drop_ended_waiters(TimePoint now);
  void remove_unused();
  void watch(StandingQuery& query);
  bool may_count(const QueryDependencies& needs, const std::vector<std::uint32_t>& predicates, const Snapshot& snapshot, const Snapshot::Entry& entry,
                 const Resource& resource) const;
  StandingQuery* find(ResourceId id) const;
  void remove(StandingQuery& query);

  const EngineOptions& options_;
  const Clock& clock_;
  const QueryService& service_;
  Registry& registry_;
  HostCalls& calls_;
  PendingRequests& pending_;
  const Responses& responses_;
  Representations& representations_;
  PropertyValues& values_;
  ChangeScanner& scanner_;
  Subscriptions& subscriptions_;
  Snapshots snapshots_;
  std::unique_ptr<QueryResource> endpoint_;
  std::list<std::unique_ptr<StandingQuery>> standing_;
  std::uint64_t next_standing_ = 1;
  std::uint64_t seen_structure_ = 0;
  std::size_t running_ = 0;                                  ///< queries under way, without standing queries
  std::unordered_map<std::string, std::size_t> running_of_;  ///< the same of each client that has one: Context::share_key()
  std::uint64_t begun_ = 0, failed_ = 0, refused_ = 0;       ///< see EngineCounts
  std::chrono::steady_clock::duration time_used_{};          ///< EngineCounts::query_seconds
  std::vector<BodyJob> jobs_;
  std::vector<std::weak_ptr<std::atomic<bool>>> cancels_;  ///< flag of running evaluations
};

/// What the engine does for a QueryService.
class QueryExtension : public QueryService::Extension {
 public:
  /// @pre  it is an object of this class, as all are that QueryService's constructor names
  static const QueryExtension& of(const QueryService& service) noexcept { return static_cast<const QueryExtension&>(service.extension()); }

  virtual std::unique_ptr<Queries> make_queries(const QueryService& service, Parts& parts) const = 0;

 protected:
  ~QueryExtension() = default;
};

}  // namespace lrt::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include <lrt/engine/query_service.hpp>

#include "src/engine/resource.hpp"
#include "src/engine/resources/subscription.hpp"
#include "src/engine/snapshots.hpp"

namespace lrt::engine {

class Queries;
class StandingQuery;

/// The media types of queries in the body of a POST (SPARQL 1.1 Protocol 2.1).
inline constexpr std::string_view query_form_type = "application/x-www-form-urlencoded", query_type = "application/sparql-query";

/// The endpoint of queries (SPARQL 1.1 Protocol). Without a query it describes itself (SPARQL 1.1 Service Description).
class QueryResource final : public Resource, public OwnProtocol {
 public:
  explicit QueryResource(const QueryService& service);

  Methods methods() const noexcept override;
  OwnProtocol* own_protocol() noexcept override { return this; }
  Input input(const EngineOptions& options) const override;
  std::string_view posted_types() const noexcept override;
  std::optional<Outcome> get(Context& context, Parts& parts) override;
  Outcome post(Context& context, Parts& parts) override;
  Outcome subscribe(Context& context, Parts& parts, Protocol protocol) override;

  void describe(const Description& d) const override;
  void describe_types(About& about, const Description& d) const override;
  const Variants& variants() const override { return graph_variants(); }
  const ResourceKind& kind() const noexcept override {
    static constexpr Observable observable{};
    static constexpr ResourceKind kind{"query", Trait::query, &observable, security::Right::read};
    return kind;
  }
  std::string up() const override { return "/"; }
  /// How many named graphs its description lists.
  static constexpr std::size_t max_named_graphs = 1'000;
  SubscriptionsResource* subscriptions() const noexcept override { return &subscriptions_; }

 private:
  void describe_named_graphs(const std::string& dataset, const Description& d) const;

  const QueryService& service_;
  mutable SubscriptionsResource subscriptions_;
};

/// A standing query: it is evaluated again when one of its dependencies has changed. Its representations are its result.
class StandingQuery final : public Resource, public OwnRepresentation {
 public:
  StandingQuery(std::string its_path, const QueryResource& endpoint, Queries& owner, std::shared_ptr<const PreparedQuery> query,
                std::shared_ptr<Snapshot> of, Snapshots::Needs its_needs);
  ~StandingQuery() override;

  void describe(const Description&) const override {}
  void describe_types(About&, const Description&) const override {}
  const Variants& variants() const override { return variants_; }
  const ResourceKind& kind() const noexcept override {
    static constexpr Observable by_results{}, by_changes{{}, Observable::Order::each};
    static constexpr ResourceKind with_results{"query", Trait::no_rdf_source, &by_results}, with_changes{"query", Trait::no_rdf_source, &by_changes};
    return tells_changes ? with_changes : with_results;
  }
  const OwnRepresentation* own_representation() const noexcept override { return this; }
  std::uint64_t state(std::uint64_t) const noexcept override { return revision; }
  std::string up() const override { return endpoint_.path; }
  bool is_shown_to(const Audience& audience) const override;
  /// The latest result. With `tells_changes`, from the second result on: the differences from the previous result.
  Result<Bytes> answer(std::size_t type) const override;
  std::string entity_tag(std::string_view media_type, const std::string& base, const Audience& audience, bool for_write) const override;
  bool has_representation() const noexcept override { return latest.answer != nullptr; }
  SubscriptionsResource* subscriptions() const noexcept override { return endpoint_.subscriptions(); }
  void set_observed(bool observed, ChangeScanner& scanner) override;

  /// It is to be evaluated again.
  void mark_dirty() noexcept { is_dirty = true; }

  /// Observes one resource whose graph may be relevant.
  class Watch final : public Observer {
   public:
    Watch(StandingQuery& owner, Resource& its_resource) : resource(its_resource), owner_(owner) {}
    Variant variant() const noexcept override { return Variant(rdf::Plain::json); }  // no encoder of the user's is run for it
    void resource_changed(SeenBy seen) override;
    void resource_changes(SeenBy) override {}
    void values_missed(std::uint64_t, SeenBy) override {}
    void resource_removed() override;
    bool queues() const noexcept override { return false; }
    void readability_changed() override { owner_.mark_dirty(); }

    Resource& resource;

   private:
    StandingQuery& owner_;
  };
  /// The resource has changed.
  void changed(const Watch& watch);
  /// The resource is removed.
  void unwatch(Watch& watch);

  /// A request that subscribes when there is a result.
  struct Waiter {
    Ticket ticket;
    Protocol protocol;
    std::size_t type;                          ///< of its notifications
    std::shared_ptr<std::atomic<bool>> ended;  ///< its client has gone
    std::string client;                        ///< Context::share_key()
  };
  /// A result in one media type, written by the job that made it.
  struct Document {
    Result<Bytes> text = Bytes();
    std::string tag;
  };
  /// A result with its documents. With `tells_changes`, from the second result on: the documents are the differences.
  struct Answer {
    std::shared_ptr<const QueryAnswer> answer;
    std::map<std::size_t, Document> documents;  ///< by type
  };
  /// The types that its observers and waiting requests receive.
  std::vector<std::size_t> wanted_types() const;
  /// Writes one. Takes as long as the result is large.
  /// @param before  the previous result, for the differences; nullptr: the whole result
  static Document write(const PreparedQuery& query, const QueryAnswer& answer, const QueryAnswer* before, std::uint64_t sequence, std::size_t type);

  const std::shared_ptr<const PreparedQuery> query;
  const std::shared_ptr<Snapshot> snapshot;
  const Snapshots::Needs needs;
  std::string key;     ///< by which equal queries share it; empty: it is for one subscriber alone
  std::string client;  ///< that has started it; empty: none that has limits
  std::string payer;   ///< who has its share of the time used for the present evaluation
  bool tells_changes = false;
  std::chrono::milliseconds interval{0};  ///< between two evaluations
  std::vector<Waiter> waiters;
  std::unordered_map<std::uint64_t, std::unique_ptr<Watch>> watches;  ///< by ResourceId
  std::vector<std::uint32_t> predicates;                              ///< of its dependencies, hashed
  std::uint64_t seen_version = 0;                                     ///< of the snapshot: resources described later may have to be observed
  bool may_be_unused = false;                                         ///< the last observer has left, or none came
  bool is_dirty = true;
  bool is_running = false;                       ///< its first values are read, or it is evaluated
  bool has_read = false;                         ///< its first values were read
  std::shared_ptr<std::atomic<bool>> cancelled;  ///< of the evaluation that runs; nullptr: none
  std::chrono::steady_clock::time_point last_start{};
  Answer latest;
  std::shared_ptr<const QueryAnswer> previous;
  std::uint64_t sequence = 0;  ///< of `latest`, from 1

 private:
  const QueryResource& endpoint_;
  Queries& owner_;
  Variants variants_;
};

}  // namespace lrt::engine

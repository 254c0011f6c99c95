// SPDX-License-Identifier: Apache-2.0
#pragma once

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
#include <unordered_set>
#include <utility>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/engine/query_service.hpp>

#include "src/base/function_ref.hpp"
#include "src/engine/audience.hpp"
#include "src/engine/change_log.hpp"
#include "src/engine/registry.hpp"
#include "src/engine/representations.hpp"
#include "src/engine/resource.hpp"
#include "src/engine/subscribers.hpp"

namespace lrt::engine {

/// The graphs of all resources for one base and one audience: the dataset of queries. Only changed resources are described again.
struct Snapshot {
  struct Entry {
    std::string path;
    std::uint64_t state = 0;
    std::uint64_t round = 0;                ///< Snapshot::round when it was found last
    std::uint64_t described = 0;            ///< Snapshot::version when it got its present predicates
    std::vector<std::uint32_t> predicates;  ///< of its graph: Snapshots::hash_of()
    bool is_empty = true;                   ///< has no graph
    bool is_failing = false;                ///< a property that could not be read; it has no graph
  };
  std::size_t base = 0;
  std::shared_ptr<const void> base_hold{};  ///< Bases::hold()
  Audience audience;
  std::shared_ptr<QueryData> data;
  std::unordered_map<std::uint64_t, Entry> entries;  ///< by ResourceId
  std::string next;                                  ///< the Thing at which the first, incomplete round continues; empty: there is none
  bool filled = false;                               ///< each resource was described once
  std::uint64_t round = 0;
  std::uint64_t version = 1;  ///< of the last change of predicates
  bool has_new_predicates = false;
  ChangeLog::Place seen_changes = 0;
  std::uint64_t seen_structure = 0;                 ///< Registry::structure() of the last round
  std::unordered_set<std::uint64_t> invocations{};  ///< that may progress; by ResourceId
  std::chrono::steady_clock::time_point last_use{};
  enum class Part : std::uint8_t { none, some, all };
  Part subscriptions = Part::none;        ///< which are in `data`, with their containers: those that no query has needed are not
  std::optional<std::string> subscriber;  ///< the principal for whom they are; nullopt: they are those of all, or there are none
  bool is_standing = false;               ///< for standing queries: counters are those of the time when a subscription began or ended
  std::string next_container;             ///< the Thing at which their first round continues
  std::uint64_t seen_subscribers = 0;     ///< Subscribers::version() when the counters were read last
  /// What its audience sees. Valid while `seen_structure` is that of the registry.
  std::vector<PropertyResource*> properties{};  ///< of Things, without files
  std::vector<const ThingNode*> worlds{};
};

/// Keeps snapshots up to date for queries. A snapshot that no query has used for a minute is removed.
class Snapshots {
 public:
  /// What a query needs besides the graphs that are always kept up to date.
  struct Needs {
    bool subscriptions = false;  ///< their graphs, and those of their containers
    bool counters = false;       ///< with what they count
    bool is_standing = false;
  };

  /// @param shared  resources that belong to no Thing
  Snapshots(const QueryService& service, const Clock& clock, const Registry& registry, const Representations& representations,
            const Subscribers& subscribers, std::function<std::vector<Resource*>()> shared);

  Needs needs_of(const QueryDependencies& query, std::size_t base, bool is_standing) const;
  /// The snapshot of a base and an audience, perhaps a new one. Audiences with the same rights share it, unless the query needs subscriptions, which
  /// depend on the principal. Standing queries that need counters have snapshots of their own.
  std::shared_ptr<Snapshot> of(std::size_t base, const Audience& audience, Needs needs);
  /// Whether the snapshot is one that of() may return.
  static bool suits(const Snapshot& snapshot, std::size_t base, const Audience& audience, Needs needs);
  /// Applies the changes. A new snapshot is filled in several steps, so that ten thousand Things do not delay other requests.
  /// @return  false: not complete, call it again. true: all graphs that the query needs show the current state.
  bool update(Snapshot& snapshot, Needs needs);
  /// Calls functions with each property whose value is in the graphs, and with what stores of the host have there.
  void for_each_read(const Snapshot& snapshot, FunctionRef<void(PropertyResource&)> visit, FunctionRef<void(HostContent&)> visit_content) const;
  /// Removes the snapshots that were not used for a minute. The caller destroys them, which may take long.
  std::vector<std::shared_ptr<const Snapshot>> take_unused(TimePoint now);
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const;

  /// Calls a function with each resource of a Thing that has a graph and stays as long as the structure does, and each graph of a World.
  static void for_each_lasting(const ThingNode& thing, FunctionRef<void(Resource&)> visit);
  /// The predicates and classes that the graphs of subscriptions and their containers have, without those of feeds.
  static const std::vector<std::string_view>& subscription_terms();

  /// Stands for a predicate in Snapshot::Entry. Two predicates may have the same.
  static std::uint32_t hash_of(std::string_view predicate) noexcept;
  static std::vector<std::uint32_t> hashes_of(const std::vector<std::string>& predicates);

 private:
  using Instant = std::chrono::steady_clock::time_point;

  /// Names without a graph come first, because another resource may have got the path.
  struct Changes {
    std::vector<NamedGraph> removed, made;
    bool reads_counters = false;
  };

  void visit(Snapshot& snapshot, const ThingNode& thing, Changes& changes);
  void visit(Snapshot& snapshot, Resource& resource, Changes& changes);
  void visit_subscriptions(Snapshot& snapshot, SubscriptionsResource& container, Changes& changes);
  void visit_shared(Snapshot& snapshot, Changes& changes);
  bool fill(Snapshot& snapshot, Changes& changes);
  bool fill_subscriptions(Snapshot& snapshot, Changes& changes);
  void read_counters(Snapshot& snapshot, Changes& changes);
  bool is_of_feed(std::string_view predicate) const;
  void renew_all(Snapshot& snapshot, Changes& changes);
  void renew(Snapshot& snapshot, const std::vector<ResourceId>& changed, Changes& changes);
  void refresh(Snapshot& snapshot) const;
  void forget(const Snapshot& snapshot, const Snapshot::Entry& entry, Changes& changes) const;

  const QueryService& service_;
  const Clock& clock_;
  const Registry& registry_;
  const Representations& representations_;
  const Subscribers& subscribers_;
  const std::function<std::vector<Resource*>()> shared_;
  mutable std::unordered_set<std::string> of_feeds_;  ///< the predicates that feeds add to the graphs of their subscriptions
  mutable std::uint64_t seen_feeds_ = 0;              ///< Subscribers::version() when they were found
  std::list<std::shared_ptr<Snapshot>> kept_;         ///< the one that was used last comes first
};

}  // namespace lrt::engine

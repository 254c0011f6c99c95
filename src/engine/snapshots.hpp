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
  /// What its audience sees. Valid while `seen_structure` is that of the registry.
  std::vector<PropertyResource*> properties{};  ///< of Things, without files
  std::vector<const ThingNode*> worlds{};
};

/// Keeps snapshots up to date for queries. A snapshot that no query has used for a minute is removed.
class Snapshots {
 public:
  /// @param shared  resources that belong to no Thing
  Snapshots(const QueryService& service, const Clock& clock, const Registry& registry, const Representations& representations,
            std::function<std::vector<Resource*>()> shared)
      : service_(service), clock_(clock), registry_(registry), representations_(representations), shared_(std::move(shared)) {}

  /// The snapshot of a base and an audience, perhaps a new one. Audiences with the same rights share it.
  std::shared_ptr<Snapshot> of(std::size_t base, const Audience& audience);
  /// Applies the changes. A new snapshot is filled in several steps, so that ten thousand Things do not delay other requests.
  /// @return  false: not complete, call it again. true: all graphs show the current state.
  bool update(Snapshot& snapshot);
  /// Calls a function with each property whose value is in the graphs.
  void for_each_property(const Snapshot& snapshot, FunctionRef<void(PropertyResource&)> visit) const;
  /// Removes the snapshots that were not used for a minute. The caller destroys them, which may take long.
  std::vector<std::shared_ptr<const Snapshot>> take_unused(TimePoint now);
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const;

  /// Stands for a predicate in Snapshot::Entry. Two predicates may have the same.
  static std::uint32_t hash_of(std::string_view predicate) noexcept;
  static std::vector<std::uint32_t> hashes_of(const std::vector<std::string>& predicates);

 private:
  using Instant = std::chrono::steady_clock::time_point;

  /// Names without a graph come first, because another resource may have got the path.
  struct Changes {
    std::vector<NamedGraph> removed, made;
  };

  void visit(Snapshot& snapshot, const ThingNode& thing, Changes& changes);
  void visit(Snapshot& snapshot, Resource& resource, Changes& changes);
  bool fill(Snapshot& snapshot, Changes& changes);
  void renew_all(Snapshot& snapshot, Changes& changes);
  void renew(Snapshot& snapshot, const std::vector<ResourceId>& changed, Changes& changes);
  void refresh(Snapshot& snapshot) const;
  void forget(const Snapshot& snapshot, const Snapshot::Entry& entry, Changes& changes) const;

  const QueryService& service_;
  const Clock& clock_;
  const Registry& registry_;
  const Representations& representations_;
  const std::function<std::vector<Resource*>()> shared_;
  std::list<std::shared_ptr<Snapshot>> kept_;  ///< the one that was used last comes first
};

}  // namespace lrt::engine

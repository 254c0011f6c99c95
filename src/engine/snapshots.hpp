// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/engine/query_service.hpp>

#include "src/engine/audience.hpp"
#include "src/engine/registry.hpp"
#include "src/engine/representations.hpp"
#include "src/engine/resource.hpp"

namespace lrt::engine {
inline namespace v0 {

/// The graphs of all resources for one base and one audience: the dataset of queries. Only changed resources are described again.
struct Snapshot {
  struct Entry {
    ResourceId id{};
    std::uint64_t state = 0;
    std::uint64_t round = 0;                ///< Snapshot::round when it was found last
    std::uint64_t described = 0;            ///< Snapshot::version when its graph changed last
    std::vector<std::uint32_t> predicates;  ///< of its graph: Snapshots::hash_of()
    bool is_empty = true;                   ///< has no graph
    bool is_failing = false;                ///< a property that could not be read; it has no graph
  };
  std::size_t base = 0;
  Audience audience;
  std::shared_ptr<QueryData> data;
  std::unordered_map<std::string, Entry> entries;  ///< by path
  std::string next;                                ///< the Thing at which the first, incomplete round continues; empty: there is none
  bool filled = false;                             ///< each resource was described once
  std::uint64_t round = 0;
  std::uint64_t version = 1;  ///< of the last change
};

/// Keeps snapshots up to date while queries use them, and removes them otherwise.
class Snapshots {
 public:
  /// @param shared  resources that belong to no Thing
  Snapshots(const QueryService* service, const Clock& clock, const Registry& registry, const Representations& representations,
            std::function<std::vector<Resource*>()> shared)
      : service_(service), clock_(clock), registry_(registry), representations_(representations), shared_(std::move(shared)) {}

  /// The snapshot of a base and an audience, perhaps a new one. It lives as long as it is used.
  std::shared_ptr<Snapshot> of(std::size_t base, const Audience& audience);
  /// Applies the changes. A new snapshot is filled in several steps, so that ten thousand Things do not delay other requests.
  /// @return  false: not complete, call it again. true: all graphs show the current state.
  bool update(Snapshot& snapshot);

  /// Stands for a predicate in Snapshot::Entry. Two predicates may have the same.
  static std::uint32_t hash_of(std::string_view predicate) noexcept;

 private:
  using Instant = std::chrono::steady_clock::time_point;

  void visit(Snapshot& snapshot, const ThingNode& thing, std::vector<NamedGraph>& changes);
  void visit(Snapshot& snapshot, Resource& resource, std::vector<NamedGraph>& changes);
  bool fill(Snapshot& snapshot, std::vector<NamedGraph>& changes);
  void renew(Snapshot& snapshot, std::vector<NamedGraph>& changes);

  const QueryService* const service_;
  const Clock& clock_;
  const Registry& registry_;
  const Representations& representations_;
  const std::function<std::vector<Resource*>()> shared_;
  std::list<std::shared_ptr<Snapshot>> kept_;  ///< the one that was used last comes first
};

}  // namespace v0
}  // namespace lrt::engine

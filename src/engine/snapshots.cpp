// SPDX-License-Identifier: Apache-2.0
#include "src/engine/snapshots.hpp"

#include <algorithm>
#include <utility>

#include "src/engine/bases.hpp"
#include "src/engine/resources/action.hpp"
#include "src/engine/resources/collection.hpp"
#include "src/engine/resources/kind.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/engine/resources/world.hpp"
#include "src/rdf/hash.hpp"

namespace lrt::engine {
inline namespace v0 {

namespace {

/// The time limit of one step that fills a snapshot.
constexpr std::chrono::microseconds fill_budget{500};

}  // namespace

std::shared_ptr<Snapshot> Snapshots::of(std::size_t base, const Audience& audience) {
  const auto found =
      std::find_if(kept_.begin(), kept_.end(), [&](const auto& one) { return one->base == base && one->audience.view == audience.view; });
  if (found != kept_.end()) {
    kept_.splice(kept_.begin(), kept_, found);
    return kept_.front();
  }
  auto made = std::make_shared<Snapshot>();
  made->base = base;
  made->audience = audience;
  made->data = service_->make_data();
  kept_.push_front(made);
  if (kept_.size() > std::max<std::size_t>(1, service_->limits().max_views)) kept_.pop_back();
  return made;
}

bool Snapshots::update(Snapshot& snapshot) {
  std::vector<NamedGraph> changes;
  const bool filled = snapshot.filled || fill(snapshot, changes);
  if (filled) renew(snapshot, changes);
  if (!changes.empty()) snapshot.data->change(std::move(changes));
  return filled;
}

/// Continues the first round. Later changes of resources that were already described are found by the next round.
bool Snapshots::fill(Snapshot& snapshot, std::vector<NamedGraph>& changes) {
  const Instant end = clock_.now().steady + fill_budget;
  const auto& things = registry_.things();
  for (auto at = things.lower_bound(snapshot.next); at != things.end();) {
    visit(snapshot, *at->second, changes);
    if (++at == things.end() || clock_.now().steady < end) continue;  // at least one Thing, so that each step makes progress
    snapshot.next = at->first;
    return false;
  }
  snapshot.filled = true;
  return true;
}

/// One whole round, so that all graphs are of one moment.
void Snapshots::renew(Snapshot& snapshot, std::vector<NamedGraph>& changes) {
  ++snapshot.round;
  for (const auto& [path, thing] : registry_.things()) visit(snapshot, *thing, changes);
  for (Resource* resource : shared_()) visit(snapshot, *resource, changes);
  const std::string& base = representations_.base(snapshot.base);
  for (auto at = snapshot.entries.begin(); at != snapshot.entries.end();) {
    if (at->second.round == snapshot.round) {
      ++at;
      continue;
    }
    if (!at->second.is_empty) changes.push_back({base + at->first, nullptr});
    at = snapshot.entries.erase(at);
  }
  if (!changes.empty()) ++snapshot.version;
}

void Snapshots::visit(Snapshot& snapshot, const ThingNode& thing, std::vector<NamedGraph>& changes) {
  const auto visit_one = [&](Resource& resource) { visit(snapshot, resource, changes); };
  visit_one(thing.self);
  for (const auto& p : thing.properties) visit_one(*p);
  for (const auto& a : thing.actions) {
    visit_one(*a);
    for (const auto& invocation : a->invocations) visit_one(*invocation);
  }
  for (const auto& c : thing.collections) {
    visit_one(*c);
    for (Resource* member : c->members()) visit_one(*member);
  }
  if (thing.world)  // a value published in a graph is part of that graph; a second copy would duplicate its blank nodes
    for (const auto& graph : thing.world->graphs()) visit_one(*graph);
  if (thing.kind && !thing.kind->things.empty() && thing.kind->things.front() == &thing) visit_one(*thing.kind);
  if (thing.adds_shapes()) visit_one(const_cast<BlueprintResource&>(thing.blueprint));
}

void Snapshots::visit(Snapshot& snapshot, Resource& resource, std::vector<NamedGraph>& changes) {
  if (!snapshot.audience.sees(resource)) return;
  resource.refresh();
  Snapshot::Entry& entry = snapshot.entries[resource.path];
  entry.round = snapshot.round;
  const std::uint64_t state = resource.state(registry_.structure());
  const bool is_failing = resource.kind() == "property" && static_cast<const PropertyResource&>(resource).is_failing();
  if (entry.id == resource.id && entry.state == state && entry.is_failing == is_failing) return;
  entry.id = resource.id;
  entry.state = state;
  entry.is_failing = is_failing;
  entry.described = snapshot.version + 1;
  const std::string& base = representations_.base(snapshot.base);
  std::shared_ptr<const rdf::Graph> graph;
  if (!snapshot.audience.is_restricted()) graph = resource.kept_graph(representations_.view());
  const bool is_kept = graph != nullptr;
  if (!is_kept && !is_failing && resource.fits_rdf(service_->limits().max_value_members))
    graph = std::make_shared<const rdf::Graph>(representations_.describe(resource, snapshot.base, snapshot.audience));
  entry.predicates.clear();
  if (graph) {
    std::vector<bool> seen(graph->term_count());  // a client chooses the number of predicates in a graph of a World
    for (const rdf::Triple& t : graph->triples()) {
      const auto number = static_cast<std::size_t>(t.predicate);
      if (!seen[number]) entry.predicates.push_back(hash_of(graph->term(t.predicate).text));
      seen[number] = true;
    }
  }
  if (is_kept) changes.push_back({base + resource.path, graph, std::string(placeholder_base), base});
  else if (graph || !entry.is_empty) changes.push_back({base + resource.path, graph});
  entry.is_empty = graph == nullptr;
}

std::uint32_t Snapshots::hash_of(std::string_view predicate) noexcept { return rdf::to_32_bits(rdf::hash_bytes(predicate, rdf::hash_seeds().bytes)); }

}  // namespace v0
}  // namespace lrt::engine

// SPDX-License-Identifier: Apache-2.0
#include "src/engine/snapshots.hpp"

#include <algorithm>
#include <iterator>
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

namespace {

/// The time limit of one step that fills a snapshot.
constexpr std::chrono::microseconds fill_budget{500};
/// How long a snapshot is kept after its last use.
constexpr std::chrono::seconds keep_time{60};

/// @pre  it is a World
const WorldResource* world_of(const ThingNode& thing) { return static_cast<const WorldResource*>(&thing.self); }

/// It is made and removed without a change of the structure.
bool comes_and_goes(const Resource& resource) { return resource.kind().name == "invocation" || resource.kind().name == "member"; }

}  // namespace

std::shared_ptr<Snapshot> Snapshots::of(std::size_t base, const Audience& audience) {
  const auto find = [&](auto has_rights) {
    return std::find_if(kept_.begin(), kept_.end(), [&](const auto& one) { return one->base == base && has_rights(one->audience); });
  };
  auto found = find([&](const Audience& other) { return other.view == audience.view; });
  if (found == kept_.end()) found = find([&](const Audience& other) { return other.has_rights_of(audience); });
  if (found != kept_.end()) {
    kept_.splice(kept_.begin(), kept_, found);
    Snapshot& known = *kept_.front();
    known.audience = audience;
    known.last_use = clock_.now().steady;
    return kept_.front();
  }
  auto made = std::make_shared<Snapshot>();
  made->base = base;
  made->audience = audience;
  made->data = service_.make_data();
  made->last_use = clock_.now().steady;
  kept_.push_front(made);
  if (kept_.size() > std::max<std::size_t>(1, service_.limits().max_views)) kept_.pop_back();
  return made;
}

std::vector<std::shared_ptr<const Snapshot>> Snapshots::take_unused(TimePoint now) {
  std::vector<std::shared_ptr<const Snapshot>> unused;
  for (auto at = kept_.begin(); at != kept_.end();) {
    if (at->use_count() > 1 || now.steady < (*at)->last_use + keep_time) {
      ++at;
      continue;
    }
    unused.push_back(std::move(*at));
    at = kept_.erase(at);
  }
  if (!unused.empty() && kept_.empty()) registry_.changes().stop();
  return unused;
}

std::optional<Snapshots::Instant> Snapshots::next_deadline() const {
  std::optional<Instant> first;
  for (const auto& one : kept_)
    if (one.use_count() == 1 && (!first || one->last_use + keep_time < *first)) first = one->last_use + keep_time;
  return first;
}

bool Snapshots::update(Snapshot& snapshot) {
  snapshot.last_use = clock_.now().steady;
  Changes changes;
  const bool filled = snapshot.filled || fill(snapshot, changes);
  if (filled) {
    refresh(snapshot);
    const auto changed = registry_.changes().read(snapshot.seen_changes);
    if (changed && snapshot.seen_structure == registry_.structure()) renew(snapshot, *changed, changes);
    else renew_all(snapshot, changes);
    if (std::exchange(snapshot.has_new_predicates, false)) ++snapshot.version;
  }
  changes.removed.insert(changes.removed.end(), std::make_move_iterator(changes.made.begin()), std::make_move_iterator(changes.made.end()));
  if (!changes.removed.empty()) snapshot.data->change(std::move(changes.removed));
  return filled;
}

/// Continues the first round. Later changes of resources that were already described are known to the log.
bool Snapshots::fill(Snapshot& snapshot, Changes& changes) {
  if (snapshot.next.empty()) {
    (void)registry_.changes().read(snapshot.seen_changes);
    snapshot.seen_structure = registry_.structure();
    snapshot.properties.clear();
    snapshot.worlds.clear();
  }
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

/// One whole round, after a change of the structure.
void Snapshots::renew_all(Snapshot& snapshot, Changes& changes) {
  ++snapshot.round;
  snapshot.seen_structure = registry_.structure();
  snapshot.properties.clear();
  snapshot.worlds.clear();
  for (const auto& [path, thing] : registry_.things()) visit(snapshot, *thing, changes);
  for (Resource* resource : shared_()) visit(snapshot, *resource, changes);
  for (auto at = snapshot.entries.begin(); at != snapshot.entries.end();) {
    if (at->second.round == snapshot.round) {
      ++at;
      continue;
    }
    forget(snapshot, at->second, changes);
    at = snapshot.entries.erase(at);
  }
}

/// Of changes that leave the structure as it is. All in one turn, so that all graphs are of one moment.
void Snapshots::renew(Snapshot& snapshot, const std::vector<ResourceId>& changed, Changes& changes) {
  for (const ResourceId id : changed) {
    const auto known = snapshot.entries.find(static_cast<std::uint64_t>(id));
    if (Resource* const resource = registry_.find(id)) {
      if (known != snapshot.entries.end() || comes_and_goes(*resource)) visit(snapshot, *resource, changes);
    } else if (known != snapshot.entries.end()) {
      forget(snapshot, known->second, changes);
      snapshot.entries.erase(known);
    }
  }
  for (Resource* resource : shared_()) visit(snapshot, *resource, changes);
}

/// What no change is reported of: the progress of invocations, and the age of published values.
void Snapshots::refresh(Snapshot& snapshot) const {
  for (auto at = snapshot.invocations.begin(); at != snapshot.invocations.end();) {
    auto* const invocation = static_cast<InvocationResource*>(registry_.find(ResourceId{*at}));
    if (invocation && !invocation->finished()) {
      invocation->refresh();
      ++at;
    } else {
      at = snapshot.invocations.erase(at);
    }
  }
  if (snapshot.seen_structure != registry_.structure()) return;  // a whole round follows
  for (const ThingNode* world : snapshot.worlds)
    for (const auto& graph : world_of(*world)->graphs()) graph->refresh();
}

void Snapshots::forget(const Snapshot& snapshot, const Snapshot::Entry& entry, Changes& changes) const {
  if (!entry.is_empty) changes.removed.push_back({representations_.base(snapshot.base) + entry.path, nullptr});
}

void Snapshots::for_each_property(const Snapshot& snapshot, FunctionRef<void(PropertyResource&)> visit) const {
  const auto visit_world = [&](const ThingNode& thing) {
    for (const auto& graph : world_of(thing)->graphs())
      if (snapshot.audience.sees(*graph)) graph->for_each_property(visit);
  };
  if (snapshot.filled && snapshot.seen_structure == registry_.structure()) {
    for (PropertyResource* property : snapshot.properties) visit(*property);
    for (const ThingNode* world : snapshot.worlds) visit_world(*world);
    return;
  }
  for (const auto& [path, thing] : registry_.things()) {
    for (const auto& p : thing->properties)
      if (!p->spec->file && snapshot.audience.sees(*p)) visit(*p);
    if (thing->spec->world) visit_world(*thing);
  }
}

void Snapshots::visit(Snapshot& snapshot, const ThingNode& thing, Changes& changes) {
  const auto visit_one = [&](Resource& resource) { visit(snapshot, resource, changes); };
  visit_one(thing.self);
  for (const auto& p : thing.properties) {
    visit_one(*p);
    if (!p->spec->file && snapshot.audience.sees(*p)) snapshot.properties.push_back(p.get());
  }
  for (const auto& a : thing.actions) {
    visit_one(*a);
    for (const auto& invocation : a->invocations) visit_one(*invocation);
  }
  for (const auto& c : thing.collections) {
    visit_one(*c);
    for (Resource* member : c->members()) visit_one(*member);
  }
  if (thing.spec->world) {  // a value published in a graph is part of that graph; a second copy would duplicate its blank nodes
    for (const auto& graph : world_of(thing)->graphs()) visit_one(*graph);
    snapshot.worlds.push_back(&thing);
  }
  if (thing.kind && !thing.kind->things.empty() && thing.kind->things.front() == &thing) visit_one(*thing.kind);
  if (thing.adds_shapes()) visit_one(const_cast<BlueprintResource&>(thing.blueprint));
}

void Snapshots::visit(Snapshot& snapshot, Resource& resource, Changes& changes) {
  if (!snapshot.audience.sees(resource)) return;
  ValueResource* const values = resource.values();
  if (values) values->refresh();
  const auto [found, is_new] = snapshot.entries.try_emplace(static_cast<std::uint64_t>(resource.id));
  Snapshot::Entry& entry = found->second;
  entry.round = snapshot.round;
  if (is_new && resource.kind().name == "invocation") snapshot.invocations.insert(found->first);
  const bool has_moved = !is_new && entry.path != resource.path;
  if (has_moved) forget(snapshot, entry, changes);
  if (has_moved || is_new) entry.path = resource.path;
  const std::uint64_t state = resource.state(registry_.structure());
  const bool is_failing = resource.kind().name == "property" && static_cast<const PropertyResource&>(resource).is_failing();
  if (!is_new && !has_moved && entry.state == state && entry.is_failing == is_failing) return;
  entry.state = state;
  entry.is_failing = is_failing;
  const std::string& base = representations_.base(snapshot.base);
  std::shared_ptr<const rdf::Graph> graph;
  if (const OwnRepresentation* const own = resource.own_representation(); own && !snapshot.audience.is_restricted())
    graph = own->kept_graph(representations_.view());
  const bool is_kept = graph != nullptr;
  if (!is_kept && !is_failing && (!values || values->fits_rdf(service_.limits().max_value_members)))
    graph = std::make_shared<const rdf::Graph>(representations_.describe(resource, snapshot.base, snapshot.audience));
  std::vector<std::uint32_t> predicates;
  if (graph) {
    std::vector<bool> seen(graph->term_count());  // a client chooses the number of predicates in a graph of a World
    for (const rdf::Triple& t : graph->triples()) {
      const auto number = static_cast<std::size_t>(t.predicate);
      if (!seen[number]) predicates.push_back(hash_of(graph->term(t.predicate).text));
      seen[number] = true;
    }
  }
  if (is_new || entry.is_empty != (graph == nullptr) || predicates != entry.predicates) {
    entry.predicates = std::move(predicates);
    entry.described = snapshot.version + 1;
    snapshot.has_new_predicates = true;
  }
  if (is_kept) changes.made.push_back({base + resource.path, graph, std::string(placeholder_base), base});
  else if (graph) changes.made.push_back({base + resource.path, graph});
  else if (!is_new && !has_moved) forget(snapshot, entry, changes);
  entry.is_empty = graph == nullptr;
}

std::vector<std::uint32_t> Snapshots::hashes_of(const std::vector<std::string>& predicates) {
  std::vector<std::uint32_t> hashes;
  hashes.reserve(predicates.size());
  for (const std::string& predicate : predicates) hashes.push_back(hash_of(predicate));
  return hashes;
}

std::uint32_t Snapshots::hash_of(std::string_view predicate) noexcept { return rdf::to_32_bits(rdf::hash_bytes(predicate, rdf::hash_seeds().bytes)); }

}  // namespace lrt::engine

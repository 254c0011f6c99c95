// SPDX-License-Identifier: Apache-2.0
#include "src/engine/snapshots.hpp"

#include <algorithm>
#include <cassert>
#include <iterator>
#include <utility>

#include <lrt/base/immortal.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/engine/bases.hpp"
#include "src/engine/description.hpp"
#include "src/engine/receivers/protocols.hpp"
#include "src/engine/receivers/receiver.hpp"
#include "src/engine/resources/action.hpp"
#include "src/engine/resources/collection.hpp"
#include "src/engine/resources/kind.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/subscription.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/engine/resources/world.hpp"
#include "src/rdf/hash.hpp"
#include "src/rdf/shared_graph.hpp"

namespace lrt::engine {

namespace {

/// The time limit of one step that fills a snapshot.
constexpr std::chrono::microseconds fill_budget{500};
/// How long a snapshot is kept after its last use.
constexpr std::chrono::seconds keep_time{60};

/// @pre  it is a World
const WorldResource* world_of(const ThingNode& thing) { return static_cast<const WorldResource*>(&thing.self); }

bool is_subscription(const Resource& resource) { return resource.kind().name == "subscription"; }

/// It is made and removed without a change of the structure.
bool comes_and_goes(const Snapshot& snapshot, const Resource& resource) {
  const std::string_view kind = resource.kind().name;
  if (kind == "subscription" || kind == "subscriptions") return snapshot.subscriptions != Snapshot::Part::none;
  return kind == "invocation" || kind == "member" || (kind == "property" && static_cast<const PropertyResource&>(resource).in_graph);
}

/// What changes with each message. No query is evaluated for it.
constexpr Iri counters[] = {vocab::lrt_::delivered, vocab::lrt_::dropped, vocab::lrt_::lastError, vocab::lrt_::suspended, vocab::lrt_::confirmed};

/// A name of the principal to whom subscriptions are shown. No principal has the empty one.
std::optional<std::string> subscriber_of(const Audience& audience, Snapshots::Needs needs) {
  if (!needs.subscriptions || !audience.is_restricted()) return std::nullopt;
  return audience.principal ? "=" + audience.principal->name : std::string();
}

}  // namespace

Snapshots::Snapshots(const QueryService& service, const Clock& clock, const Registry& registry, const Representations& representations,
                     const Subscribers& subscribers, std::function<std::vector<Resource*>()> shared)
    : service_(service),
      clock_(clock),
      registry_(registry),
      representations_(representations),
      subscribers_(subscribers),
      shared_(std::move(shared)) {}

const std::vector<std::string_view>& Snapshots::subscription_terms() {
  static const Immortal<std::vector<std::string_view>> all([] {
    std::vector<std::string_view> terms;
    for (const Iri term :
         {vocab::hybrit::onResource,   vocab::hybrit::callbackURL, vocab::hybrit::mediaType,   vocab::dcterms::identifier,   vocab::dcterms::created,
          vocab::lrt_::owner,          vocab::lrt_::delivery,      vocab::lrt_::queueLength,   vocab::lrt_::minimumInterval, vocab::ldp::contains,
          vocab::rdfs::seeAlso,        vocab::hybrit::binding,     vocab::http_core::mthd,     vocab::http_core::requestURI, vocab::http_core::body,
          vocab::dcterms::conformsTo,  vocab::http_core::Request,  vocab::ldp::BasicContainer, vocab::ldp::Container,        vocab::ldp::RDFSource,
          vocab::hybrit::Subscription, vocab::hybrit::WebCallback})
      terms.push_back(term.text);
    for (const Iri counter : counters) terms.push_back(counter.text);
    for (std::size_t i = 0; i < protocol_count; ++i) terms.push_back(entry_of(static_cast<Protocol>(i)).type.text);
    return terms;
  }());
  return *all;
}

/// Whether the subscription of a feed has such a triple.
bool Snapshots::is_of_feed(std::string_view predicate) const {
  if (subscribers_.count(Protocol::feed) == 0) return false;
  if (std::exchange(seen_feeds_, subscribers_.version()) != subscribers_.version()) {
    of_feeds_.clear();
    subscribers_.for_each([&](const SubscriptionResource& s) {
      if (!s.receiver->feed()) return;
      rdf::Graph graph;
      About about(graph, "urn:feed");
      s.receiver->describe(about, {});
      for (const rdf::Triple& t : graph.triples()) of_feeds_.emplace(graph.term(t.predicate).text);
    });
  }
  return of_feeds_.count(std::string(predicate)) != 0;
}

Snapshots::Needs Snapshots::needs_of(const QueryDependencies& query, std::size_t base, bool is_standing) const {
  const auto is_term = [](std::string_view name) {
    const auto& terms = subscription_terms();
    return std::find(terms.begin(), terms.end(), name) != terms.end();
  };
  const auto may_have = [&](const std::string& predicate) {
    if (predicate == vocab::rdf_::type.text) return query.types.empty() || std::any_of(query.types.begin(), query.types.end(), is_term);
    return is_term(predicate) || is_of_feed(predicate);
  };
  const auto may_be = [&](const std::string& name) {
    const std::string& prefix = representations_.base(base);
    if (name.compare(0, prefix.size(), prefix) != 0) return false;
    const Resource* const resource = registry_.find(std::string_view(name).substr(prefix.size()));
    return !resource || is_subscription(*resource) || resource->kind().name == "subscriptions";
  };
  Needs needs;
  needs.subscriptions = (query.everything || std::any_of(query.predicates.begin(), query.predicates.end(), may_have)) &&
                        (query.graphs.empty() || std::any_of(query.graphs.begin(), query.graphs.end(), may_be));
  needs.counters =
      needs.subscriptions && (query.everything || std::any_of(std::begin(counters), std::end(counters), [&](Iri counter) {
                                return std::find(query.predicates.begin(), query.predicates.end(), counter.text) != query.predicates.end();
                              }));
  needs.is_standing = is_standing;
  return needs;
}

bool Snapshots::suits(const Snapshot& snapshot, std::size_t base, const Audience& audience, Needs needs) {
  return snapshot.base == base && snapshot.subscriber == subscriber_of(audience, needs) &&
         snapshot.is_standing == (needs.is_standing && needs.counters) && snapshot.audience.has_rights_of(audience);
}

std::shared_ptr<Snapshot> Snapshots::of(std::size_t base, const Audience& audience, Needs needs) {
  const auto find = [&](auto has_rights) {
    return std::find_if(kept_.begin(), kept_.end(), [&](const auto& one) { return has_rights(one->audience) && suits(*one, base, audience, needs); });
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
  made->base_hold = representations_.hold_base(base);
  made->audience = audience;
  made->subscriber = subscriber_of(audience, needs);
  made->is_standing = needs.is_standing && needs.counters;
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

bool Snapshots::update(Snapshot& snapshot, Needs needs) {
  snapshot.last_use = clock_.now().steady;
  Changes changes;
  bool filled = snapshot.filled || fill(snapshot, changes);
  assert(!needs.subscriptions || snapshot.subscriber || !snapshot.audience.is_restricted());
  if (filled && needs.subscriptions && snapshot.subscriptions != Snapshot::Part::all) filled = fill_subscriptions(snapshot, changes);
  if (filled) {
    refresh(snapshot);
    const auto changed = registry_.changes().read(snapshot.seen_changes);
    if (changed && snapshot.seen_structure == registry_.structure()) renew(snapshot, *changed, changes);
    else renew_all(snapshot, changes);
    if (needs.counters) read_counters(snapshot, changes);
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

/// The same for the containers of subscriptions, when the first query needs them. Most are empty, and there is one for each Thing.
bool Snapshots::fill_subscriptions(Snapshot& snapshot, Changes& changes) {
  snapshot.subscriptions = Snapshot::Part::some;
  const Instant end = clock_.now().steady + fill_budget;
  const auto& things = registry_.things();
  for (auto at = things.lower_bound(snapshot.next_container); at != things.end();) {
    visit_subscriptions(snapshot, at->second->subscriptions, changes);
    if (++at == things.end() || clock_.now().steady < end) continue;
    snapshot.next_container = at->first;
    return false;
  }
  snapshot.subscriptions = Snapshot::Part::all;
  return true;
}

/// No change is reported of them. What standing queries see changes only with the subscriptions themselves.
void Snapshots::read_counters(Snapshot& snapshot, Changes& changes) {
  if (std::exchange(snapshot.seen_subscribers, subscribers_.version()) == subscribers_.version() && snapshot.is_standing) return;
  changes.reads_counters = true;
  subscribers_.for_each([&](SubscriptionResource& s) { visit(snapshot, s, changes); });
}

/// One whole round, after a change of the structure.
void Snapshots::renew_all(Snapshot& snapshot, Changes& changes) {
  ++snapshot.round;
  snapshot.seen_structure = registry_.structure();
  snapshot.properties.clear();
  snapshot.worlds.clear();
  for (const auto& [path, thing] : registry_.things()) visit(snapshot, *thing, changes);
  visit_shared(snapshot, changes);
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
      if (known != snapshot.entries.end() || comes_and_goes(snapshot, *resource)) visit(snapshot, *resource, changes);
    } else if (known != snapshot.entries.end()) {
      forget(snapshot, known->second, changes);
      snapshot.entries.erase(known);
    }
  }
  visit_shared(snapshot, changes);
}

void Snapshots::visit_shared(Snapshot& snapshot, Changes& changes) {
  for (Resource* resource : shared_()) {
    visit(snapshot, *resource, changes);
    SubscriptionsResource* const container = resource->subscriptions();
    if (container && snapshot.subscriptions != Snapshot::Part::none) visit_subscriptions(snapshot, *container, changes);
  }
}

void Snapshots::visit_subscriptions(Snapshot& snapshot, SubscriptionsResource& container, Changes& changes) {
  visit(snapshot, container, changes);
  for (const auto& s : container.subscriptions) visit(snapshot, *s, changes);
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

void Snapshots::for_each_read(const Snapshot& snapshot, FunctionRef<void(PropertyResource&)> visit,
                              FunctionRef<void(HostContent&)> visit_content) const {
  const auto visit_seen = [&](PropertyResource& p) {
    if (snapshot.audience.sees(p)) visit(p);
  };
  const auto visit_world = [&](const ThingNode& thing) {
    for (const auto& graph : world_of(thing)->graphs())
      if (snapshot.audience.sees(*graph)) graph->for_each_property(visit_seen), graph->for_each_host_content(visit_content);
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

void Snapshots::for_each_lasting(const ThingNode& thing, FunctionRef<void(Resource&)> visit) {
  visit(thing.self);
  for (const auto& p : thing.properties) visit(*p);
  for (const auto& a : thing.actions) visit(*a);
  for (const auto& c : thing.collections) visit(*c);
  if (thing.spec->world)
    for (const auto& graph : world_of(thing)->graphs()) visit(*graph);
  const auto is_first = [&](const auto* blueprint) { return blueprint && !blueprint->things.empty() && blueprint->things.front() == &thing; };
  if (is_first(thing.kind)) visit(*thing.kind);
  if (is_first(thing.bounds)) visit(*thing.bounds);
  if (thing.adds_shapes()) visit(const_cast<BlueprintResource&>(thing.blueprint));
}

void Snapshots::visit(Snapshot& snapshot, const ThingNode& thing, Changes& changes) {
  for_each_lasting(thing, [&](Resource& resource) { visit(snapshot, resource, changes); });
  for (const auto& p : thing.properties)
    if (!p->spec->file && snapshot.audience.sees(*p)) snapshot.properties.push_back(p.get());
  for (const auto& a : thing.actions)
    for (const auto& invocation : a->invocations) visit(snapshot, *invocation, changes);
  for (const auto& c : thing.collections)
    for (Resource* member : c->members()) visit(snapshot, *member, changes);
  if (thing.spec->world) {  // a value published in a graph is part of that graph, and a resource of its own; its nodes have IRIs
    for (const auto& graph : world_of(thing)->graphs()) graph->for_each_property([&](PropertyResource& p) { visit(snapshot, p, changes); });
    snapshot.worlds.push_back(&thing);
  }
  if (snapshot.subscriptions != Snapshot::Part::none) visit_subscriptions(snapshot, const_cast<SubscriptionsResource&>(thing.subscriptions), changes);
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
  if (!is_new && !has_moved && !changes.reads_counters && is_subscription(resource)) return;  // the rest of it does not change
  const std::uint64_t state = resource.state(registry_.structure());
  const bool is_failing = resource.kind().name == "property" && static_cast<const PropertyResource&>(resource).is_failing();
  if (!is_new && !has_moved && entry.state == state && entry.is_failing == is_failing) return;
  entry.state = state;
  entry.is_failing = is_failing;
  const std::string& base = representations_.base(snapshot.base);
  std::shared_ptr<const rdf::Graph> graph;
  if (const OwnRepresentation* const own = resource.own_representation(); own && (!snapshot.audience.is_restricted() || own->is_of_users()))
    graph = own->kept_graph(representations_.view());
  const bool is_kept = graph != nullptr;
  if (!is_kept && !is_failing && (!values || values->fits_rdf(service_.limits().max_value_members)))
    graph = std::make_shared<const rdf::Graph>(representations_.describe(resource, snapshot.base, snapshot.audience));
  std::vector<std::uint32_t> predicates;
  if (const rdf::SharedGraph* const shared = graph ? rdf::SharedGraph::in(*graph) : nullptr) {
    for (const rdf::TermId id : shared->predicates()) predicates.push_back(hash_of(graph->term(id).text));
  } else if (graph) {
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

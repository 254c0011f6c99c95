// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resource.hpp"

#include <algorithm>
#include <map>
#include <stdexcept>

#include "src/engine/bases.hpp"
#include "src/engine/body_size.hpp"
#include "src/engine/change_log.hpp"
#include "src/engine/description.hpp"
#include "src/engine/parts.hpp"
#include "src/engine/resources/kind.hpp"
#include "src/engine/resources/thing.hpp"

namespace lrt::engine {
inline namespace v0 {

namespace {

/// The engine checks methods() first, so this is a kind of resource that allows a method it does not have.
[[noreturn]] void announced_only(const Resource& resource, const char* method) {
  throw std::logic_error(resource.path + " allows " + method + " and does not implement it");
}

}  // namespace

std::string Methods::text() const {
  std::string text = "GET, HEAD, OPTIONS";
  if (put) text += ", PUT";
  if (post) text += ", POST";
  if (remove) text += ", DELETE";
  if (patch) text += ", PATCH";
  return text;
}

Input Resource::input(const EngineOptions& options) const { return {nullptr, false, options.max_scalar_body_bytes}; }

Input input_of(const model::ResourceSpec& spec, const rdf::Type& type, const rdf::Facets& facets, const EngineOptions& options) {
  Input input;
  input.type = &type;
  input.may_be_empty = type.kind == rdf::Type::Kind::optional;
  const std::optional<std::size_t> size = spec.max_body_bytes ? spec.max_body_bytes : body_size(type, facets, options.max_scalar_body_bytes);
  if (size) input.max_bytes = *size;
  return input;
}

Outcome Resource::put(Context&, Parts&) { announced_only(*this, "PUT"); }
Outcome Resource::post(Context&, Parts&) { announced_only(*this, "POST"); }
Outcome Resource::remove(Context&, Parts&) { announced_only(*this, "DELETE"); }
Outcome Resource::patch(Context&, Parts&) { announced_only(*this, "PATCH"); }

void Resource::describe_controls(About& about, const Description& d) const {
  if (!observable() || !d.audience.may(security::Right::subscribe, *this)) return;
  if (!thing || this != &thing->self) about.link(vocab::hybrit::subscriptions, d.base + subscriptions()->path);
  if (d.engine.bases.upgrades(d.base).websocket)  // "http://robot" to "ws://robot", "https://robot" to "wss://robot"
    about.add(vocab::hybrit::websocketUrl, rdf::literal("ws" + d.base.substr(4) + path, vocab::xsd::anyURI));
  for (const Observer* observer : observers) observer->describe_controls(about, d);
}

void Resource::describe_topics(const Description& d) const {
  if (observers.empty() || !observable() || !d.audience.may(security::Right::subscribe, *this)) return;
  About about(d.graph, d.base + path);
  for (const Observer* observer : observers) observer->describe_controls(about, d);
}

std::size_t Resource::usual_size() const noexcept { return path.size() - times_aside * name_aside.size(); }

std::string Resource::path_aside(std::size_t n) const {
  std::string other = path;
  other.erase(lrt_name_end, times_aside * name_aside.size());
  for (; n > 0; --n) other.insert(lrt_name_end, name_aside);
  return other;
}

void Resource::link_related(http::LinkWriter&, const std::string&) const {}

SubscriptionsResource* Resource::subscriptions() const noexcept { return thing ? &thing->subscriptions : nullptr; }

std::string Resource::up() const { return thing ? thing->self.path : std::string(); }

std::string Resource::up(const Audience& audience) const {
  if (!audience.is_restricted() || !thing || this != &thing->self) return up();
  const ThingNode* const above = thing->parent_seen_by(audience);
  return above ? above->self.path : "/";
}

std::string Resource::described_by(const std::string& base) const { return thing ? thing->blueprint_iris(base, {}).front() : std::string(); }

void Resource::mark_changed() { mark_changed(seen_by_all); }
void Resource::notify_observers() { notify_observers(seen_by_all); }

void Resource::mark_changed(SeenBy seen) {
  ++revision;
  count_change(seen);
  record_change();
  notify_observers(seen);
}

void Resource::record_change() noexcept {
  if (thing && thing->kind) thing->kind->changes.add(id);  // a Thing without a kind is not in the tree: the structure changes later
}

void Resource::notify_observers(SeenBy seen) {
  for (std::size_t i = 0; i < observers.size(); ++i) observers[i]->resource_changed(seen);
}

void Resource::add_observer(Observer& observer, ChangeScanner& scanner) {
  observers.push_back(&observer);
  if (observers.size() == 1) set_observed(true, scanner);
}

void Resource::remove_observer(Observer& observer, ChangeScanner& scanner) {
  observers.remove(&observer);
  if (observers.empty()) set_observed(false, scanner);
}

void add_placed(rdf::Graph& graph, const rdf::Graph& kept, const std::string& base) {
  std::map<rdf::TermId, rdf::TermId> blanks;
  const auto placed = [&](rdf::TermId id) {
    const rdf::TermView term = kept.term(id);
    if (term.is_blank()) {
      const auto known = blanks.find(id);
      return known != blanks.end() ? known->second : blanks.emplace(id, graph.fresh_blank()).first->second;
    }
    if (!term.is_iri() || term.text.substr(0, placeholder_base.size()) != placeholder_base) return graph.intern(term);
    return graph.intern(rdf::iri(base + std::string(term.text.substr(placeholder_base.size()))));
  };
  for (const rdf::Triple& t : kept.match(std::nullopt, std::nullopt, std::nullopt)) {
    const rdf::TermId s = placed(t.subject), p = placed(t.predicate), o = placed(t.object);
    graph.add(s, p, o);
  }
}

rdf::Graph unplaced(const rdf::Graph& graph, const std::string& base) {
  rdf::Graph kept;
  std::vector<std::optional<rdf::TermId>> known(graph.term_count());
  const auto same = [&](rdf::TermId id) {
    std::optional<rdf::TermId>& mine = known[static_cast<std::size_t>(id)];
    if (mine) return *mine;
    const rdf::TermView term = graph.term(id);
    const std::string_view rest = term.text.substr(std::min(base.size(), term.text.size()));
    const bool is_ours =
        term.is_iri() && term.text.substr(0, base.size()) == base && (rest.empty() || rest[0] == '/' || rest[0] == '?' || rest[0] == '#');
    mine = is_ours ? kept.intern(rdf::iri(std::string(placeholder_base).append(rest))) : kept.intern(term);
    return *mine;
  };
  for (const rdf::Triple& t : graph.triples()) {
    const rdf::TermId s = same(t.subject), p = same(t.predicate), o = same(t.object);
    kept.add(s, p, o);
  }
  return kept;
}

bool fits(const rdf::Value& value, std::size_t& left) {
  if (const rdf::Value::Sequence* members = value.sequence(); members && !members->empty())
    return std::all_of(members->begin(), members->end(), [&](const rdf::Value& member) { return fits(member, left); });
  if (left == 0) return false;
  --left;
  return true;
}

}  // namespace v0
}  // namespace lrt::engine

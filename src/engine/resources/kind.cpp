// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/kind.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/shacl/derive.hpp>

#include "src/engine/contract.hpp"
#include "src/engine/description.hpp"
#include "src/engine/overview.hpp"
#include "src/engine/registry.hpp"
#include "src/engine/resources/action.hpp"
#include "src/engine/resources/blueprint.hpp"
#include "src/engine/resources/collection.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/subscription.hpp"
#include "src/engine/resources/thing.hpp"
#include "src/engine/vocabulary.hpp"
#include "src/model/plain_name.hpp"

namespace lrt::engine {
inline namespace v0 {

namespace {

using rdf::TermId;

/// The last segment of an IRI or path.
std::string local_name(std::string_view iri) { return std::string(iri.substr(iri.find_last_of("#/") + 1)); }

/// Adds the property shapes of a node shape.
class Structure {
 public:
  Structure(rdf::Graph& graph, TermId shape) : graph_(graph), shape_(shape) {}
  /// @param max  0: any number
  About path(const std::string& predicate, std::size_t min, std::size_t max = 0, std::string_view of = {}) {
    const TermId p = graph_.fresh_blank();
    About(graph_, shape_).add(vocab::sh::property, p);
    About constraint(graph_, p);
    constraint.link(vocab::sh::path, predicate);
    if (min > 0) constraint.add(vocab::sh::minCount, count(min));
    if (max > 0) constraint.add(vocab::sh::maxCount, count(max));
    if (!of.empty()) constraint.add(vocab::sh::class_, rdf::iri(of));
    return constraint;
  }
  About path(Iri predicate, std::size_t min, std::size_t max = 0, Iri of = {}) { return path(std::string(predicate.text), min, max, of.text); }

 private:
  TermId count(std::size_t n) { return graph_.intern(rdf::literal(std::to_string(n), vocab::xsd::integer)); }
  rdf::Graph& graph_;
  TermId shape_;
};

/// Which value shapes the audience sees at one of the Things or more.
std::vector<bool> shown_shapes(const std::vector<const ThingNode*>& things, std::size_t count, const Audience& audience) {
  if (!audience.is_restricted()) return std::vector<bool>(count, true);
  std::vector<bool> shown(count);
  for (const ThingNode* t : things) {
    const std::vector<ValueShape> theirs = value_shapes(*t);
    for (std::size_t i = 0; i < count; ++i)
      if (audience.sees(*theirs[i].resource)) shown[i] = true;
  }
  return shown;
}

/// The predicates from a Thing to this property alone, of those that the audience sees.
std::vector<std::string> own_predicates(const PropertyResource& property, const std::string& vocabulary, const Audience& audience) {
  std::vector<std::string> own = property.spec->predicates;
  if (own.empty()) return {rdf::term_iri(link_term(property.spec->path), vocabulary)};
  for (const auto& other : property.thing->properties) {
    if (other.get() == &property || !audience.sees(*other)) continue;
    const std::vector<std::string>& theirs = other->spec->predicates;
    own.erase(
        std::remove_if(own.begin(), own.end(), [&](const std::string& p) { return std::find(theirs.begin(), theirs.end(), p) != theirs.end(); }),
        own.end());
  }
  return own;
}

}  // namespace

rdf::TermId ValueOrError::absence(const PropertyResource& property) {
  const TermId absent = graph_.fresh_blank();
  shacl::derive_absence(graph_, absent, *property.spec->type, vocabulary_);
  return absent;
}

void ValueOrError::conforms(const About& constraint, const PropertyResource& property, const std::string& shape) {
  const TermId absent = absence(property);
  if (property.promises_value) {
    if (!with_error_) {
      with_error_ = graph_.fresh_blank();
      Structure(graph_, *with_error_).path(vocab::lrt_::error, 1);
    }
    About(graph_, absent).add(vocab::sh::node, *with_error_);
  }
  graph_.add(constraint.subject(), graph_.intern(vocab::sh::or_), graph_.add_list({absent, graph_.intern(rdf::iri(shape))}));
}

void ValueOrError::has_no_error(const About& constraint, const PropertyResource& property, bool is_timed) {
  std::optional<TermId>& present = is_timed ? timed_without_error_ : without_error_;
  if (!present) {
    present = graph_.fresh_blank();
    Structure structure(graph_, *present);
    structure.path(vocab::lrt_::error, 0).add(vocab::sh::maxCount, rdf::literal("0", vocab::xsd::integer));
    if (is_timed) structure.path(vocab::dcterms::modified, 1, 1).add(vocab::sh::datatype, rdf::TermView(vocab::xsd::dateTime));
  }
  const TermId either = graph_.fresh_blank();  // not each SHACL engine judges by two sh:or of one shape
  graph_.add(either, graph_.intern(vocab::sh::or_), graph_.add_list({*present, absence(property)}));
  graph_.add(constraint.subject(), graph_.intern(vocab::sh::node), either);
}

// ------------------------------------------------------------------------------------------------------------------ kind

namespace {

/// A path that no resource has. Another one with this hash is not expected, but possible.
std::string free_path(const std::string& path, const Registry& registry) {
  std::string free = path;
  for (unsigned number = 2; registry.find_usual(free, {}) != nullptr; ++number) free = path + "-" + std::to_string(number);
  return free;
}

}  // namespace

KindResource::KindResource(std::string its_path, std::string its_name, std::string its_signature, std::optional<std::string> its_rules,
                           ChangeLog& its_changes)
    : SharedBlueprint(std::move(its_path)),
      name(std::move(its_name)),
      signature(std::move(its_signature)),
      rules(std::move(its_rules)),
      changes(its_changes) {}
KindResource::~KindResource() = default;

void KindResource::join(ThingNode& member, Registry& registry) {
  if (std::string text = rules ? bounds_of(member) : std::string(); !text.empty()) {
    auto at = bounds_.find(text);
    if (at == bounds_.end()) {
      std::string its_path = free_path(path + "-" + short_hash(text), registry);
      auto made = std::make_unique<BoundsResource>(std::move(its_path), std::move(text), *this);
      registry.add(*made);
      at = bounds_.emplace(made->bounds, std::move(made)).first;
    }
    BoundsResource* const bounds = at->second.get();
    bounds->things.push_back(&member);
    member.bounds = bounds;
  }
  things.push_back(&member);
  member.kind = this;
}

void KindResource::leave(ThingNode& member, Registry& registry) {
  const auto forget = [&](std::vector<ThingNode*>& all) { all.erase(std::find(all.begin(), all.end(), &member)); };
  if (things.front() == &member) state_type_ = nullptr;
  forget(things);
  member.kind = nullptr;
  BoundsResource* const bounds = std::exchange(member.bounds, nullptr);
  if (!bounds) return;
  forget(bounds->things);
  if (!bounds->things.empty()) return;
  registry.remove(*bounds);
  bounds_.erase(bounds_.find(bounds->bounds));
}

const rdf::Type& KindResource::state_type() const {
  if (!state_type_) {
    auto record = std::make_unique<rdf::Type>();
    record->kind = rdf::Type::Kind::record;
    for (const auto& p : things.front()->spec->properties)
      if (!p->file) record->fields.push_back({model::plain_name(p->path), "#" + p->path, p->type, p->facets});
    state_type_ = std::move(record);
  }
  return *state_type_;
}

std::vector<rdf::FieldType> KindResource::state_fields(const ThingNode& member, const Audience& audience) const {
  const std::vector<rdf::FieldType>& all = state_type().fields;
  if (!audience.is_restricted()) return all;
  std::vector<rdf::FieldType> fields;
  std::size_t i = 0;
  for (const PropertyResource* p : member.in_state()) {
    if (audience.sees(*p)) fields.push_back(all[i]);
    ++i;
  }
  return fields;
}

bool SharedBlueprint::shows_fragment(std::string_view fragment, const Audience& audience) const {
  const auto shows = [&](const ThingNode* t) { return audience.sees(t->self) && shows_shape(*t, fragment, audience); };
  return std::any_of(things.begin(), things.end(), shows);
}

bool SharedBlueprint::is_shown_to(const Audience& audience) const {
  return std::any_of(things.begin(), things.end(), [&](const ThingNode* t) { return audience.sees(t->self); });
}

std::vector<const ThingNode*> SharedBlueprint::members_seen_by(const Audience& audience) const {
  if (!audience.is_restricted()) return {things.front()};  // what was registered is the same for all
  std::vector<const ThingNode*> seen;
  std::copy_if(things.begin(), things.end(), std::back_inserter(seen), [&](const ThingNode* t) { return audience.sees(t->self); });
  return seen;
}

void KindResource::describe(const Description& d) const { describe_kind(d, d.base + path, name, members_seen_by(d.audience)); }

void describe_kind(const Description& d, const std::string& self, const std::string& name, const std::vector<const ThingNode*>& members) {
  rdf::Graph& graph = d.graph;
  const ThingNode& first = *members.front();
  // The smallest count that any member has. They differ by what the audience sees.
  const auto least = [&](auto count) {
    std::size_t n = std::numeric_limits<std::size_t>::max();
    for (const ThingNode* t : members) n = std::min(n, static_cast<std::size_t>(count(*t)));
    return n;
  };
  const auto seen = [&](const auto& resources) {
    return std::count_if(resources.begin(), resources.end(), [&](const auto& r) { return d.audience.sees(*r); });
  };
  const auto is_seen_somewhere = [&](auto has) { return std::any_of(members.begin(), members.end(), [&](const ThingNode* t) { return has(*t); }); };
  const model::ThingSpec& spec = *first.spec;
  const std::string vocabulary = d.engine.vocabulary(d.base);
  // The Things say that they are its instances: it targets these and no others (SHACL 2.1.3.3).
  About about(graph, self);
  about.a(vocab::sh::NodeShape).a(vocab::rdfs::Class).add(vocab::rdfs::label, rdf::literal(name));
  about.add(vocab::sh::class_, rdf::TermView(vocab::hybrit::RoboticThing));
  for (const std::string& c : spec.classes) about.link(vocab::sh::class_, c);

  // What can go away has no least count: the Things around this one, and actions while they are not available.
  Structure structure(graph, about.subject());
  structure.path(vocab::dcterms::title, 1);
  structure.path(vocab::hybrit::blueprint, 1);
  if (least([&](const ThingNode& t) { return d.audience.sees(t.subscriptions); }) > 0) structure.path(vocab::hybrit::subscriptions, 1, 1);
  if (least([&](const ThingNode& t) { return d.audience.sees(t.state); }) > 0) structure.path(vocab::lrt_::state, 1, 1);
  if (spec.control && least([&](const ThingNode& t) { return d.audience.sees(*t.control); }) > 0)
    structure.path(vocab::lrt_::control, 1, 1, vocab::lrt_::Control);
  if (spec.path.find('/') != std::string::npos) structure.path(vocab::dcterms::isPartOf, 0, 1, vocab::hybrit::RoboticThing);
  if (is_seen_somewhere([&](const ThingNode& t) { return seen(t.actions) > 0; })) structure.path(vocab::hybrit::action, 0, 0, vocab::hybrit::Action);
  const auto has_stop = [&](const ThingNode& t) {
    return std::any_of(t.actions.begin(), t.actions.end(), [&](const auto& a) { return a->spec->stop && d.audience.sees(*a); });
  };
  if (is_seen_somewhere(has_stop)) structure.path(vocab::lrt_::stop, 0, 0, vocab::lrt_::StopAction);
  const std::size_t collections = least([&](const ThingNode& t) { return seen(t.collections); });
  if (collections > 0) structure.path(vocab::lrt_::collection, collections, 0, vocab::ldp::BasicContainer);
  const std::size_t properties = least([&](const ThingNode& t) { return seen(t.properties); });
  if (properties > 0) structure.path(vocab::hybrit::property, properties, 0, vocab::hybrit::Property);

  // The links that the user has given. What they lead to may have been removed: it has no class here.
  std::map<std::string, Links> links = links_of(first, d.engine.registry, d.audience);
  if (d.audience.is_restricted())
    for (const ThingNode* t : members) {
      const std::map<std::string, Links> seen_links = links_of(*t, d.engine.registry, d.audience);
      for (auto it = links.begin(); it != links.end();) {
        const auto seen_link = seen_links.find(it->first);
        if (seen_link == seen_links.end()) {
          it = links.erase(it);
          continue;
        }
        Links& l = (it++)->second;
        l.count = std::max(l.count, seen_link->second.count);
        l.iris = l.iris && seen_link->second.iris;
        l.literals = l.literals && seen_link->second.literals;
      }
    }
  for (const auto& [predicate, l] : links) {
    About constraint = structure.path(predicate, 1, l.count == 1 ? 1 : 0);
    if (l.iris || l.literals) constraint.add(vocab::sh::nodeKind, rdf::TermView(l.iris ? vocab::sh::IRI : vocab::sh::Literal));
  }

  // Properties by their predicates, with the shapes of their values.
  const TermId any = graph.fresh_blank();  // the shape of each property
  ValueOrError value_or_error(graph, vocabulary);
  std::map<std::string, std::vector<std::size_t>> by_predicate;
  for (std::size_t i = 0; i < first.properties.size(); ++i) {
    if (!is_seen_somewhere([&](const ThingNode& t) { return d.audience.sees(*t.properties[i]); })) continue;
    const model::PropertySpec& p = *first.properties[i]->spec;
    if (p.predicates.empty()) by_predicate[rdf::term_iri(link_term(p.path), vocabulary)].push_back(i);
    for (const std::string& predicate : p.predicates) by_predicate[predicate].push_back(i);
  }
  for (const auto& [predicate, indices] : by_predicate) {
    const std::size_t at_each = least([&, all = &indices](const ThingNode& t) {
      return std::count_if(all->begin(), all->end(), [&](std::size_t i) { return d.audience.sees(*t.properties[i]); });
    });
    About constraint = structure.path(predicate, at_each, indices.size(), vocab::hybrit::Property.text);
    if (indices.size() > 1) continue;  // the predicate does not distinguish their values
    const PropertyResource& property = *first.properties[indices.front()];
    const model::PropertySpec& p = *property.spec;
    constraint.texts(vocab::sh::name, model::texts_of(p.statements, vocab::dcterms::title));
    constraint.texts(vocab::sh::description, model::texts_of(p.statements, vocab::dcterms::description));
    for (const std::string& c : p.classes) constraint.link(vocab::sh::class_, c);
    if (p.file) continue;  // not in the state
    const bool promised = property.promises_value, has_shape = !has_user_shape(first, p.path);
    if (has_shape) value_or_error.conforms(constraint, property, self + "#" + p.path);
    value_or_error.has_no_error(constraint, property, promised && p.type->kind != rdf::Type::Kind::optional);
    if (const std::string of = rdf::target_class(*p.type, vocabulary); !promised && !of.empty()) constraint.link(vocab::sh::class_, of);
    constraint.add(vocab::sh::node, any);
    Structure more(graph, constraint.subject());
    if (p.frame) more.path(frame_predicate(*p.type), 1, 1);
    if (p.life)  // clients learn from it how often they have to write
      more.path(vocab::lrt_::expiresAfter, 1, 1).add(vocab::sh::hasValue, rdf::literal(seconds(p.life->life()), vocab::xsd::double_));
    // The triples of the Property about its values, where their shape has none.
    const Quantity quantity = quantity_of(*p.type, p.facets);
    const bool has_unit_in_shape = has_shape && promised && (p.type->is_number() || p.type->has_fields());
    const auto require = [&](Iri what, Iri object) { more.path(what, 0).add(vocab::sh::hasValue, rdf::TermView(object)); };
    if (!quantity.unit.empty() && !has_unit_in_shape) {
      if (quantity.unit.vom.empty()) require(vocab::qudt::hasUnit, quantity.unit.qudt);
      else require(vocab::vom::unit, quantity.unit.vom);
    }
    if (!quantity.datatype.empty() && !(has_shape && promised)) require(quantity.datatype_predicate, quantity.datatype);
    std::set<std::string> stated;
    for (const Statement& s : p.statements) stated.insert(s.predicate);
    for (const std::string& of : stated) more.path(of, 1);
  }
  if (!graph.match(std::nullopt, std::nullopt, any).empty()) {
    About(graph, any).a(vocab::sh::NodeShape);
    Structure(graph, any).path(vocab::rdfs::seeAlso, 1, 0, vocab::hybrit::RoboticThing);
    Structure(graph, any).path(vocab::lrt_::error, 0, 1).add(vocab::sh::datatype, rdf::TermView(vocab::xsd::string));
  }
  const std::vector<ValueShape> shapes = value_shapes(first);
  const std::vector<bool> shown = shown_shapes(members, shapes.size(), d.audience);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    if (!shown[i] || has_user_shape(first, shapes[i].name)) continue;
    rdf::Facets facets = *shapes[i].facets;
    if (shapes[i].has_bounds() && !(first.kind && !first.kind->rules)) facets.without_bounds();
    describe_generated(d, self + "#" + shapes[i].name, shapes[i], facets);
  }
  const std::string subscriptions = first.subscriptions.input_shape();
  if (d.engine.makes_callbacks && !has_user_shape(first, subscriptions) &&
      least([&](const ThingNode& t) { return d.audience.sees(t.subscriptions); }) > 0)
    describe_subscription_shape(graph, self + "#" + subscriptions, d.engine.options.subscriptions);
}

void BoundsResource::describe(const Description& d) const {
  const std::string self = d.base + path, vocabulary = d.engine.vocabulary(d.base);
  About about(d.graph, self);
  about.a(vocab::sh::NodeShape).a(vocab::rdfs::Class).add(vocab::rdfs::label, rdf::literal(of.name)).link(vocab::sh::node, d.base + of.path);
  const std::vector<const ThingNode*> members = members_seen_by(d.audience);
  const ThingNode& first = *members.front();
  const std::vector<ValueShape> shapes = value_shapes(first);
  const std::vector<bool> shown = shown_shapes(members, shapes.size(), d.audience);
  ValueOrError value_or_error(d.graph, vocabulary);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const ValueShape& values = shapes[i];
    if (!shown[i] || !values.has_bounds() || has_user_shape(first, values.name)) continue;
    const std::string shape = self + "#" + values.name;
    describe_generated(d, shape, values, *values.facets);
    if (!values.property || values.property->spec->file) continue;
    for (const std::string& predicate : own_predicates(*values.property, vocabulary, d.audience)) {
      About constraint = Structure(d.graph, about.subject()).path(predicate, 0);
      value_or_error.conforms(constraint, *values.property, shape);
    }
  }
}

void SharedBlueprint::overview(Overview& o) const {
  o.begin_array("things");
  for (const ThingNode* t : things) o.link({}, t->self);
  o.end_array();
}

void SharedBlueprint::for_each_property(FunctionRef<void(PropertyResource&)> visit) const {
  for (const ThingNode* t : things) t->state.for_each_property(visit);
}

void SharedBlueprint::path_changed() {
  compiled_shapes.clear();
  for (ThingNode* t : things) t->shapes_moved();
}

// ----------------------------------------------------------------------------------------------------------------- kinds

namespace {

/// What the Blueprint of a Thing's kind says, as a text.
std::string text_of_kind(const ThingNode& thing, const EngineView& engine) {
  rdf::Graph graph;
  const Audience everybody;
  const std::string base(placeholder_base);
  describe_kind({graph, base, 1, engine, everybody}, base, {}, {&thing});
  return rdf::write(graph, rdf::Syntax::n_triples).value_or(std::string());
}

}  // namespace

void Kinds::join(ThingNode& thing, const EngineView& engine) {
  const auto& rules_around = engine.options.rules_around;
  std::optional<std::string> rules = rules_around ? rules_around(thing.self.path) : std::string();
  std::string signature = rules ? signature_of(thing, registry_) + "\n" + *rules : "\n" + thing.self.path;
  std::unique_ptr<KindResource>& kind = kinds_[signature];
  if (!kind) {
    const std::string name = local_name(thing.spec->classes.empty() ? thing.spec->path : thing.spec->classes.back());
    std::string hashed = rules ? text_of_kind(thing, engine) : thing.self.path;
    if (rules && rules->size() > 1) hashed += "\n" + *rules;
    const std::string path = std::string(SharedBlueprint::folder) + "/" + iri::encode_segment(name) + "-" + short_hash(hashed);
    kind = std::make_unique<KindResource>(free_path(path, registry_), name, std::move(signature), std::move(rules), registry_.changes());
    registry_.add(*kind);
  }
  kind->join(thing, registry_);
}

void Kinds::renew(const EngineView& engine) {
  const auto& rules_around = engine.options.rules_around;
  if (!rules_around) return;
  std::vector<ThingNode*> moved;
  for (const auto& [path, thing] : registry_.things()) {
    const KindResource& kind = *thing->kind;
    if (rules_around(path) == kind.rules) continue;
    // Others do not keep a Blueprint that is named after it.
    const bool names_others = kind.things.size() > 1 && kind.name == local_name(thing->spec->path);
    if (names_others) moved.insert(moved.end(), kind.things.begin(), kind.things.end());
    else moved.push_back(thing.get());
  }
  if (moved.empty()) return;
  std::sort(moved.begin(), moved.end(), [](const ThingNode* a, const ThingNode* b) { return a->self.id < b->self.id; });
  moved.erase(std::unique(moved.begin(), moved.end()), moved.end());
  for (ThingNode* thing : moved) leave(*thing);
  for (ThingNode* thing : moved) join(*thing, engine);
  for (ThingNode* thing : moved) thing->shapes_moved();
  registry_.structure_changed();
}

void Kinds::leave(ThingNode& thing) {
  KindResource& kind = *thing.kind;
  kind.leave(thing, registry_);
  if (!kind.things.empty()) return;
  registry_.remove(kind);
  kinds_.erase(kinds_.find(kind.signature));
}

}  // namespace v0
}  // namespace lrt::engine

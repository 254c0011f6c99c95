// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/kind.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/shacl/derive.hpp>

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

namespace lrt::engine {
inline namespace v0 {

namespace {

using rdf::TermId;

bool has_own_bounds(const rdf::Type& type) { return type.kind == rdf::Type::Kind::optional ? has_own_bounds(*type.element) : type.is_number(); }

bool has_equal_bounds(const rdf::Facets& a, const rdf::Facets& b) {
  return std::tuple(a.min(), a.max(), a.min_exclusive(), a.max_exclusive()) == std::tuple(b.min(), b.max(), b.min_exclusive(), b.max_exclusive());
}

/// The facets of the value shapes of a Thing, in the order of value_shapes().
std::vector<const rdf::Facets*> all_facets(const ThingNode& thing) {
  std::vector<const rdf::Facets*> all;
  for (const auto& p : thing.properties) all.push_back(&p->spec->facets);
  for (const auto& a : thing.actions) {
    if (a->spec->input) all.push_back(&a->spec->facets);
    if (a->spec->output) all.push_back(&a->spec->output_facets);
  }
  for (const auto& c : thing.collections) all.push_back(&c->spec->facets);
  return all;
}

/// Marks the value shapes whose bounds differ between two Things of a kind.
void compare_bounds(const ThingNode& one, const ThingNode& other, std::vector<bool>& shared) {
  const std::vector<const rdf::Facets*> a = all_facets(one), b = all_facets(other);
  for (std::size_t i = 0; i < shared.size(); ++i)
    if (!has_equal_bounds(*a[i], *b[i])) shared[i] = false;
}

/// Writes what the description of a Thing of this kind depends on, except for bounds of numbers.
class Signature {
 public:
  Signature& text(std::string_view s) {
    out_ += std::to_string(s.size());
    out_ += ':';
    out_ += s;
    return *this;
  }
  Signature& number(std::size_t n) { return text(std::to_string(n)); }
  Signature& texts(const std::vector<std::string>& all) {
    number(all.size());
    for (const std::string& s : all) text(s);
    return *this;
  }
  Signature& value(const rdf::Type* type, const rdf::Facets& f) {
    number(reinterpret_cast<std::uintptr_t>(type)).text(f.unit().qudt.text).text(f.unit().vom.text);
    number(f.allows_non_finite()).number(f.min_length()).number(f.max_length());
    if (type && !has_own_bounds(*type))
      number(f.min_exclusive()).number(f.max_exclusive()).text(f.min() ? std::to_string(*f.min()) : "").text(f.max() ? std::to_string(*f.max()) : "");
    return *this;
  }
  std::string take() { return std::move(out_); }

 private:
  std::string out_;
};

/// The objects of the user's triples about a Thing, by predicate.
struct Links {
  std::size_t count = 0;
  std::set<std::string> classes;  ///< of linked resources; empty texts for others
};
/// @param audience  links to what it does not see are left out
std::map<std::string, Links> links_of(const ThingNode& thing, const Registry& registry, const Audience& audience = {}) {
  std::map<std::string, Links> links;
  const auto add = [&](std::string_view predicate, const Resource* to) {
    if (predicate == vocab::rdf_::type.text || (to && !audience.sees(*to))) return;
    Links& l = links[std::string(predicate)];
    ++l.count;
    const bool is_thing = to && to->thing && to == &to->thing->self;
    if (!is_thing) l.classes.emplace();
    else l.classes.insert(to->thing->spec->classes.empty() ? std::string(vocab::hybrit::RoboticThing.text) : to->thing->spec->classes.back());
  };
  for (const Statement& s : thing.spec->statements) {
    const Resource* to = nullptr;
    if (s.object.kind() == Object::Kind::resource)
      if (const Result<std::string> path = model::encode_path_from_root(s.object.text())) to = registry.find("/" + *path);
    add(s.predicate, to);
  }
  const rdf::Graph& graph = thing.statements();
  const std::string base(placeholder_base);
  if (const auto self = graph.find(rdf::iri(base + "/" + thing.spec->path)))
    for (const rdf::Triple& t : graph.match(*self, std::nullopt, std::nullopt)) {
      const rdf::TermView object = graph.term(t.object);
      const bool is_ours = object.is_iri() && object.text.substr(0, base.size()) == base;
      add(graph.term(t.predicate).text, is_ours ? registry.find(object.text.substr(base.size())) : nullptr);
    }
  return links;
}

std::string signature_of(const ThingNode& thing, const Registry& registry) {
  Signature s;
  const model::ThingSpec& spec = *thing.spec;
  s.texts(spec.classes).texts(spec.shapes).text(spec.blueprint);
  s.number(spec.properties.size());
  for (const auto& p : spec.properties)
    s.text(p->path).texts(p->predicates).texts(p->classes).number(p->file).number(static_cast<bool>(p->write)).value(p->type, p->facets);
  s.number(spec.actions.size());
  for (const auto& a : spec.actions)
    s.text(a->path).texts(a->predicates).texts(a->classes).number(a->stop).value(a->input, a->facets).value(a->output, a->output_facets);
  s.number(spec.collections.size());
  for (const auto& c : spec.collections) s.text(c->path).texts(c->predicates).value(c->type, c->facets);
  for (const auto& [predicate, links] : links_of(thing, registry)) s.text(predicate);
  return s.take();
}

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

}  // namespace

std::vector<ValueShape> value_shapes(const ThingNode& thing) {
  std::vector<ValueShape> all;
  for (const auto& p : thing.properties) all.push_back({p->spec->path, p->spec->type, &p->spec->facets, static_cast<bool>(p->spec->write)});
  for (const auto& a : thing.actions) {
    if (a->spec->input) all.push_back({a->input_shape(), a->spec->input, &a->spec->facets, true});
    if (a->spec->output) all.push_back({a->output_shape(), a->spec->output, &a->spec->output_facets, false});
  }
  for (const auto& c : thing.collections) all.push_back({c->spec->path, c->spec->type, &c->spec->facets, true});
  return all;
}

const Resource* shaped_resource(const ThingNode& thing, std::size_t value_shape) {
  std::size_t i = 0;
  for (const auto& p : thing.properties)
    if (i++ == value_shape) return p.get();
  for (const auto& a : thing.actions) {
    if (a->spec->input && i++ == value_shape) return a.get();
    if (a->spec->output && i++ == value_shape) return a.get();
  }
  for (const auto& c : thing.collections)
    if (i++ == value_shape) return c.get();
  return nullptr;
}

// ------------------------------------------------------------------------------------------------------------------ kind

std::string KindResource::usual_path(const std::string& name, unsigned number) {
  return std::string(folder) + "/" + name + (number == 1 ? std::string() : "-" + std::to_string(number));
}

void KindResource::join(ThingNode& member) {
  std::vector<bool> shared = things.empty() ? std::vector<bool>(all_facets(member).size(), true) : shared_;
  if (!things.empty()) compare_bounds(*things.front(), member, shared);
  things.push_back(&member);
  member.kind = this;
  set_shared(std::move(shared));
}

void KindResource::leave(ThingNode& member) {
  const bool is_first = things.front() == &member;
  things.erase(std::find(things.begin(), things.end(), &member));
  member.kind = nullptr;
  if (is_first) state_type_ = nullptr;
  if (things.empty() || shares_all_bounds()) return;
  std::vector<bool> shared(shared_.size(), true);
  for (const ThingNode* t : things) compare_bounds(*things.front(), *t, shared);
  set_shared(std::move(shared));
}

void KindResource::set_shared(std::vector<bool> shared) {
  if (shared == shared_) return;
  shared_ = std::move(shared);
  compiled_shapes.clear();
  for (ThingNode* t : things) t->compiled_shapes.clear();
}

const rdf::Type& KindResource::state_type() const {
  if (!state_type_) {
    auto record = std::make_unique<rdf::Type>();
    record->kind = rdf::Type::Kind::record;
    for (const auto& p : things.front()->spec->properties)
      if (!p->file) record->fields.push_back({p->path, "#" + p->path, p->type, p->facets});
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

bool KindResource::is_shown_to(const Audience& audience) const {
  return std::any_of(things.begin(), things.end(), [&](const ThingNode* t) { return audience.sees(t->self); });
}

void KindResource::describe(const Description& d) const { describe(d, true); }

std::vector<ThingNode*> KindResource::members_seen_by(const Audience& audience) const {
  std::vector<ThingNode*> seen = things;
  if (audience.is_restricted())
    seen.erase(std::remove_if(seen.begin(), seen.end(), [&](const ThingNode* t) { return !audience.sees(t->self); }), seen.end());
  return seen;
}

void KindResource::describe(const Description& d, bool with_targets) const {
  rdf::Graph& graph = d.graph;
  const std::vector<ThingNode*> members = members_seen_by(d.audience);
  const ThingNode& first = *members.front();
  // The smallest count that any member has.
  const auto least = [&](auto count) {
    std::size_t n = std::numeric_limits<std::size_t>::max();
    for (const ThingNode* t : members) n = std::min(n, static_cast<std::size_t>(count(*t)));
    return n;
  };
  const auto seen = [&](const auto& resources) {
    return std::count_if(resources.begin(), resources.end(), [&](const auto& r) { return d.audience.sees(*r); });
  };
  const auto is_seen_somewhere = [&](std::size_t property) {
    return std::any_of(members.begin(), members.end(), [&](const ThingNode* t) { return d.audience.sees(*t->properties[property]); });
  };
  const model::ThingSpec& spec = *first.spec;
  const std::string self = d.base + path, vocabulary = d.engine.vocabulary(d.base);
  About about(graph, self);
  about.a(vocab::sh::NodeShape).add(vocab::sh::name, rdf::literal(local_name(path)));

  // The class, if it says which Things these are.
  if (with_targets) {
    const auto is_other = [&](const auto& entry) {
      const ThingNode& other = *entry.second;
      if (!d.audience.sees(other.self)) return false;
      const auto& classes = other.spec->classes;
      return other.kind != this && std::find(classes.begin(), classes.end(), spec.classes.back()) != classes.end();
    };
    const auto& all = d.engine.registry.things();
    if (!spec.classes.empty() && std::none_of(all.begin(), all.end(), is_other)) about.link(vocab::sh::targetClass, spec.classes.back());
    else
      for (const ThingNode* t : members) about.link(vocab::sh::targetNode, d.base + t->self.path);
  }

  about.add(vocab::sh::class_, rdf::TermView(vocab::hybrit::RoboticThing));
  for (const std::string& c : spec.classes) about.link(vocab::sh::class_, c);
  Structure structure(graph, about.subject());
  structure.path(vocab::dcterms::title, 1);
  structure.path(vocab::hybrit::blueprint, 1);
  if (least([&](const ThingNode& t) { return d.audience.sees(t.subscriptions); }) > 0) structure.path(vocab::hybrit::subscriptions, 1, 1);
  if (least([&](const ThingNode& t) { return d.audience.sees(t.state); }) > 0) structure.path(vocab::lrt_::state, 1, 1);
  if (std::all_of(members.begin(), members.end(), [&](const ThingNode* t) { return t->parent && d.audience.sees(t->parent->self); }))
    structure.path(vocab::dcterms::isPartOf, 1, 1, vocab::hybrit::RoboticThing);
  const std::size_t children = least([&](const ThingNode& t) {
    return std::count_if(t.children.begin(), t.children.end(), [&](const ThingNode* child) { return d.audience.sees(child->self); });
  });
  if (children > 0) structure.path(vocab::dcterms::hasPart, children, 0, vocab::hybrit::RoboticThing);
  if (children > 0) structure.path(vocab::lrt_::all, 1, 1);
  const std::size_t actions = least([&](const ThingNode& t) { return seen(t.available_actions()); });
  if (seen(first.actions) > 0 || actions > 0) structure.path(vocab::hybrit::action, actions, 0, vocab::hybrit::Action);
  const std::size_t stops = least([&](const ThingNode& t) {
    const auto offered = t.available_actions();
    return std::count_if(offered.begin(), offered.end(), [&](const auto& a) { return a->spec->stop && d.audience.sees(*a); });
  });
  if (stops > 0) structure.path(vocab::lrt_::stop, stops, 0, vocab::lrt_::StopAction);
  const std::size_t collections = least([&](const ThingNode& t) { return seen(t.collections); });
  if (collections > 0) structure.path(vocab::lrt_::collection, collections, 0, vocab::ldp::BasicContainer);
  const std::size_t properties = least([&](const ThingNode& t) { return seen(t.properties); });
  if (properties > 0) structure.path(vocab::hybrit::property, properties, 0, vocab::hybrit::Property);

  // The links that the user has given.
  std::map<std::string, Links> links = links_of(first, d.engine.registry, d.audience);
  std::map<std::string, std::size_t> most;
  for (const auto& [predicate, l] : links) most[predicate] = l.count;
  for (const ThingNode* t : members)
    for (const auto& [predicate, l] : links_of(*t, d.engine.registry, d.audience)) {
      Links& joint = links[predicate];
      joint.count = std::min(joint.count, l.count);
      joint.classes.insert(l.classes.begin(), l.classes.end());
      most[predicate] = std::max(most[predicate], l.count);
    }
  for (const auto& [predicate, l] : links) {
    const bool things_only = l.classes.find({}) == l.classes.end();
    const std::string of = l.classes.size() == 1 ? *l.classes.begin() : things_only ? std::string(vocab::hybrit::RoboticThing.text) : std::string();
    structure.path(predicate, l.count, most[predicate], of);
  }

  // Properties by their predicates, with the shapes of their values.
  const auto is_promised = [&](std::size_t i) {
    return std::all_of(members.begin(), members.end(), [i](const ThingNode* t) { return t->properties[i]->promises_triples(); });
  };
  const TermId any = graph.fresh_blank(), with_value = graph.fresh_blank();  // shapes of each property, and of each that has a value
  std::map<std::string, std::vector<std::size_t>> by_predicate;
  for (std::size_t i = 0; i < first.properties.size(); ++i) {
    if (!is_seen_somewhere(i)) continue;
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
    const std::size_t i = indices.front();
    const model::PropertySpec& p = *first.properties[i]->spec;
    for (const std::string& c : p.classes) constraint.link(vocab::sh::class_, c);
    if (p.file) continue;  // not in the state
    const bool promised = is_promised(i), has_shape = promised && !has_user_shape(first, p.path);
    if (has_shape) constraint.link(vocab::sh::node, self + "#" + p.path);
    if (const std::string of = rdf::target_class(*p.type, vocabulary); !promised && !of.empty()) constraint.link(vocab::sh::class_, of);
    constraint.add(vocab::sh::node, promised && p.type->kind != rdf::Type::Kind::optional ? with_value : any);
    Structure more(graph, constraint.subject());
    const auto all_have = [&](auto has) {
      return std::all_of(members.begin(), members.end(), [&](const ThingNode* t) { return has(*t->properties[i]->spec); });
    };
    if (all_have([](const model::PropertySpec& s) { return s.frame != nullptr; })) more.path(frame_predicate(*p.type), 1, 1);
    // The triples of the Property about its values, where their shape has none.
    const Quantity quantity = quantity_of(*p.type, p.facets);
    const bool has_unit_in_shape = has_shape && (p.type->is_number() || p.type->kind == rdf::Type::Kind::record);
    const auto require = [&](Iri what, Iri object) { more.path(what, 0).add(vocab::sh::hasValue, rdf::TermView(object)); };
    if (!quantity.unit.empty() && !has_unit_in_shape) {
      if (quantity.unit.vom.empty()) require(vocab::qudt::hasUnit, quantity.unit.qudt);
      else require(vocab::vom::unit, quantity.unit.vom);
    }
    if (!quantity.datatype.empty() && !has_shape) require(quantity.datatype_predicate, quantity.datatype);
    std::set<std::string> stated;
    for (const Statement& s : p.statements) stated.insert(s.predicate);
    for (const std::string& of : stated)
      if (all_have([&](const model::PropertySpec& s) {
            return std::any_of(s.statements.begin(), s.statements.end(), [&](const Statement& statement) { return statement.predicate == of; });
          }))
        more.path(of, 1);
  }
  if (!by_predicate.empty()) {
    About(graph, any).a(vocab::sh::NodeShape);
    Structure(graph, any).path(vocab::rdfs::seeAlso, 1, 0, vocab::hybrit::RoboticThing);
    About(graph, with_value).a(vocab::sh::NodeShape).add(vocab::sh::node, any);
    Structure(graph, with_value).path(vocab::dcterms::modified, 1, 1).add(vocab::sh::datatype, rdf::TermView(vocab::xsd::dateTime));
  }
  const std::vector<ValueShape> shapes = value_shapes(first);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    if (has_user_shape(first, shapes[i].name)) continue;
    if (std::none_of(members.begin(), members.end(), [&](const ThingNode* t) { return d.audience.sees(*shaped_resource(*t, i)); })) continue;
    const TermId shape = graph.intern(rdf::iri(self + "#" + shapes[i].name));
    About(graph, shape).a(vocab::sh::NodeShape).add(vocab::sh::name, rdf::literal(shapes[i].name));
    rdf::Facets facets = *shapes[i].facets;
    if (!shares_bounds(i)) facets.without_bounds();
    shacl::derive(graph, shape, *shapes[i].type, facets, vocabulary, {true, shapes[i].input});
  }
  const std::string subscriptions = first.subscriptions.input_shape();
  if (d.engine.makes_callbacks && !has_user_shape(first, subscriptions) &&
      least([&](const ThingNode& t) { return d.audience.sees(t.subscriptions); }) > 0)
    describe_subscription_shape(graph, self + "#" + subscriptions, d.engine.options.subscriptions);
}

void KindResource::overview(Overview& o) const {
  o.begin_array("things");
  for (const ThingNode* t : things) o.link({}, t->self);
  o.end_array();
}

void KindResource::for_each_property(FunctionRef<void(PropertyResource&)> visit) const {
  for (const ThingNode* t : things) t->state.for_each_property(visit);
}

void KindResource::path_changed() {
  compiled_shapes.clear();
  for (ThingNode* t : things) t->shapes_moved();
}

// ----------------------------------------------------------------------------------------------------------------- kinds

void Kinds::join(ThingNode& thing) {
  std::string signature = signature_of(thing, registry_);
  std::unique_ptr<KindResource>& kind = kinds_[signature];
  if (!kind) {
    const std::string name = thing.spec->classes.empty() ? local_name(thing.spec->path) : iri::encode_segment(local_name(thing.spec->classes.back()));
    const auto known = first_free_.find(name);
    unsigned number = known == first_free_.end() ? 1 : known->second;
    while (registry_.find_usual(KindResource::usual_path(name, number), {}) != nullptr) ++number;
    kind = std::make_unique<KindResource>(name, number, std::move(signature), registry_.changes());
    registry_.add(*kind);
    first_free_[name] = number + 1;
  }
  kind->join(thing);
}

void Kinds::leave(ThingNode& thing) {
  KindResource& kind = *thing.kind;
  kind.leave(thing);
  if (!kind.things.empty()) return;
  registry_.remove(kind);
  if (const auto free = first_free_.find(kind.name); free != first_free_.end()) {
    free->second = std::min(free->second, kind.number);
    if (free->second == 1) first_free_.erase(free);
  }
  kinds_.erase(kinds_.find(kind.signature));
}

}  // namespace v0
}  // namespace lrt::engine

// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/thing.hpp"

#include <algorithm>
#include <list>
#include <memory>

#include <lrt/base/immortal.hpp>
#include <lrt/engine/engine.hpp>
#include <lrt/rdf/value_codec.hpp>

#include "src/engine/change_scanner.hpp"
#include "src/engine/contract.hpp"
#include "src/engine/control_extension.hpp"
#include "src/engine/description.hpp"
#include "src/engine/overview.hpp"
#include "src/engine/registry.hpp"
#include "src/engine/resources/action.hpp"
#include "src/engine/resources/collection.hpp"
#include "src/engine/resources/kind.hpp"
#include "src/engine/resources/plain_state.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/stop_state.hpp"
#include "src/engine/vocabulary.hpp"
#include "src/engine/world_extension.hpp"

namespace lrt::engine {

// ------------------------------------------------------------------------------------------------------------- the Thing

std::string_view ThingResource::cache_control() const noexcept {
  return thing->spec->cache_control ? *thing->spec->cache_control : Resource::cache_control();
}
std::string_view StateResource::cache_control() const noexcept {
  return thing->spec->cache_control ? *thing->spec->cache_control : Resource::cache_control();
}

void ThingResource::describe(const Description& d) const {
  const ThingNode& node = *thing;
  const model::ThingSpec& spec = *node.spec;
  const std::vector<ActionResource*> actions = node.available_actions();
  About about(d.graph, d.base + path);
  describe_types(about, d);
  about.texts(vocab::dcterms::title, model::titles_of(spec));
  if (spec.words) about.texts(vocab::dcterms::description, spec.words->descriptions);
  // It is an instance of what judges it.
  about.link(vocab::rdf_::type, d.base + node.kind->path);
  if (node.bounds) about.link(vocab::rdf_::type, d.base + node.bounds->path);
  for (const std::string& iri : node.blueprint_iris(d.base, d.audience)) about.link(vocab::hybrit::blueprint, iri);
  about.link(vocab::hybrit::subscriptions, d.base + node.subscriptions.path);  // R1.8
  about.link(vocab::lrt_::state, d.base + node.state.path);
  if (!node.children.empty()) about.link(vocab::lrt_::all, d.base + node.tree.path);
  if (node.control) about.link(vocab::lrt_::control, d.base + node.control->path);
  const ThingNode* const parent = node.parent_seen_by(d.audience);
  if (parent) about.link(vocab::dcterms::isPartOf, d.base + parent->self.path);
  for (const ActionResource* a : actions) about.link(vocab::hybrit::action, d.base + a->path);  // R1.10
  for (const ActionResource* a : actions)
    if (a->spec->stop) about.link(vocab::lrt_::stop, d.base + a->path);
  for (const auto& p : node.properties) about.link(vocab::hybrit::property, d.base + p->path);  // R1.9
  for (const auto& c : node.collections) about.link(vocab::lrt_::collection, d.base + c->path);
  const std::vector<ThingNode*> children = seen_things(node.children, d.audience);
  for (const ThingNode* child : children) about.link(vocab::dcterms::hasPart, d.base + child->self.path);
  const auto domain_links = [&](const auto& resources) {
    for (const auto& r : resources)
      for (const std::string& predicate : r->spec->predicates) about.link(Iri(std::string_view(predicate)), d.base + r->path);
  };
  domain_links(actions);
  domain_links(node.properties);
  const std::string vocabulary = d.engine.vocabulary(d.base);
  for (const auto& p : node.properties)
    if (p->spec->predicates.empty()) about.link(Iri(std::string_view(rdf::term_iri(link_term(p->spec->path), vocabulary))), d.base + p->path);
  domain_links(node.collections);
  about.statements(spec.statements, d.base);
  add_placed(d.graph, node.statements(), d.base);

  // The types of what it links to.
  for (const ActionResource* a : actions) describe_types_of(*a, d);
  for (const auto& p : node.properties) describe_types_of(*p, d);
  for (const auto& c : node.collections) describe_types_of(*c, d);
  for (const ThingNode* child : children) describe_types_of(child->self, d);
  if (node.control) describe_types_of(*node.control, d);
  if (parent) describe_types_of(parent->self, d);
  for (const Statement& s : spec.statements) {
    if (s.object.kind() != Object::Kind::resource) continue;
    const Result<std::string> linked_path = model::encode_path_from_root(s.object.text());
    if (const Resource* linked = linked_path ? d.engine.registry.find("/" + *linked_path) : nullptr) describe_types_of(*linked, d);
  }
}

void ThingResource::describe_types(About& about, const Description&) const { about.a(vocab::hybrit::RoboticThing).a(thing->spec->classes); }

void ThingResource::summarize(Overview& o) const {
  const model::ThingSpec& spec = *thing->spec;
  if (spec.words) o.words({model::titles_of(spec), spec.words->descriptions});
  else o.text("title", spec.title);
  o.texts("types", thing->spec->classes);
}

void ThingResource::overview(Overview& o) const {
  const ThingNode& node = *thing;
  o.link("state", node.state);
  if (!node.children.empty()) o.link("all", node.tree);
  if (node.control) o.link("control", *node.control);
  if (!node.spec->blueprint) o.link("blueprint", *node.kind);
  else o.link("blueprint", *node.spec->blueprint, node.blueprint.kind().name);
  if (node.bounds) o.link("boundsBlueprint", *node.bounds);
  if (node.adds_shapes(o.audience())) o.link("ownBlueprint", node.blueprint);
  o.link("subscriptions", node.subscriptions);
  write_stop_states(o, stop_states_of(node));
  o.links("properties", node.properties);
  o.links("actions", node.available_actions());
  o.links("collections", node.collections);
  o.begin_array("things");
  for (const ThingNode* child : seen_things(node.children, o.audience())) o.link({}, child->self);
  o.end_array();
}

namespace {

/// Things below in place of one that is left out.
void add_children(http::LinkWriter& links, const ThingNode& node, const std::string& base) {
  for (const ThingNode* child : node.children) {
    const std::string iri = base + child->self.path;
    if (links.leaves_out(iri)) add_children(links, *child, base);
    else links.add(iri, "related");
  }
}

}  // namespace

void ThingResource::link_related(http::LinkWriter& links, const std::string& base) const {
  const ThingNode& node = *thing;
  links.add(base + node.state.path, "related");
  links.add(base + node.kind->path, "related");
  if (node.bounds) links.add(base + node.bounds->path, "related");
  if (node.adds_shapes()) links.add(base + node.blueprint.path, "related");
  links.add(base + node.subscriptions.path, "related");
  if (!node.children.empty()) {
    links.add(base + node.tree.path, "related");
    links.add(base + node.tree.path, vocab::lrt_::all.text);
  }
  if (node.control) {
    links.add(base + node.control->path, "related");
    links.add(base + node.control->path, vocab::lrt_::control.text);
  }
  for (const ActionResource* a : node.available_actions()) links.add(base + a->path, "related");
  for (const auto& p : node.properties) links.add(base + p->path, "related");
  for (const auto& c : node.collections) links.add(base + c->path, "related");
  add_children(links, node, base);
}

std::string ThingResource::up() const { return thing->parent ? thing->parent->self.path : "/"; }

void ThingResource::set_observed(bool observed, ChangeScanner& scanner) {
  if (observed) scanner.watch_availability();
  else scanner.unwatch_availability();
}

// ------------------------------------------------------------------------------------------------------------- its state

void StateResource::describe(const Description& d) const {
  About(d.graph, d.base + path).a(vocab::ldp::RDFSource);
  thing->self.describe(d);
  std::size_t left = d.engine.options.max_value_members;
  for (PropertyResource* p : thing->in_state())
    if (d.audience.sees(*p)) p->describe_in_state(d, left);
}

void describe_in_whole(const Resource& part, const Description& d, std::size_t& left) {
  if (part.kind().name == "property") static_cast<const PropertyResource&>(part).describe_in_state(d, left);
  else part.describe(d);
  part.describe_topics(d);
}

std::vector<const Resource*> StateResource::described_resources(const Audience&) const {
  std::vector<const Resource*> parts = {&thing->self};
  for (const PropertyResource* p : thing->in_state()) parts.push_back(p);
  return parts;
}

std::optional<PlainValue> StateResource::plain_value(const Audience& audience) const {
  static const rdf::Facets no_facets;
  const StateProperties properties = thing->in_state();
  const auto fails = [](const PropertyResource* p) { return p->is_failing(); };
  if (!audience.is_restricted() && std::none_of(properties.begin(), properties.end(), fails)) {
    rdf::Value::Sequence values;
    for (PropertyResource* p : properties) values.push_back(p->value);
    return PlainValue{&thing->kind->state_type(), &no_facets, nullptr, rdf::Value(std::move(values))};
  }
  const auto types = std::make_shared<std::list<rdf::Type>>(1);
  PlainState state;
  state.add(*thing, audience);
  state.add_failures(*types);
  rdf::Type& record = types->front();
  record.kind = rdf::Type::Kind::record;
  record.fields = std::move(state.fields);
  return PlainValue{&record, &no_facets, nullptr, rdf::Value(std::move(state.values)), {types, &record}};
}

std::uint64_t StateResource::state(std::uint64_t structure) const noexcept {
  std::uint64_t sum = structure;
  for (PropertyResource* p : thing->in_state()) sum += p->revision + p->failure_changes();
  return sum;
}

std::optional<Utc> StateResource::value_time() const noexcept {
  std::optional<Utc> newest;
  for (const PropertyResource* p : thing->in_state())
    if (!p->value.is_null() && !p->is_failing() && (!newest || *newest < p->modified)) newest = p->modified;
  return newest;
}

void StateResource::link_related(http::LinkWriter& links, const std::string& base) const {
  for (PropertyResource* p : thing->in_state()) links.add(base + p->path, "related");
}

void StateResource::for_each_property(FunctionRef<void(PropertyResource&)> visit) const {
  for (PropertyResource* p : thing->in_state()) visit(*p);
}

void StateResource::set_observed(bool observed, ChangeScanner& scanner) {
  thing->self.set_observed(observed, scanner);
  for (PropertyResource* p : thing->in_state()) p->set_watched(observed, scanner);
}

// ------------------------------------------------------------------------------------------------------------- both

namespace {

/// The texts of a Thing without Turtle.
const ThingTexts& no_texts() {
  static const Immortal<ThingTexts> none;
  return *none;
}

std::unique_ptr<ThingResource> make_self(const model::ThingSpec& spec, ThingNode* thing) {
  if (spec.world) return WorldExtension::of(*spec.world).make_resource("/" + spec.path, thing, *spec.world);
  return std::make_unique<ThingResource>("/" + spec.path, thing);
}

std::unique_ptr<ControlBase> make_control(const model::ThingSpec& spec, ThingNode* thing) {
  if (!spec.control) return nullptr;
  return ControlExtension::of(*spec.control).make_resource("/" + spec.path + "/control", thing, spec.control->options);
}

}  // namespace

ThingNode::ThingNode(std::unique_ptr<model::ThingSpec> s)
    : spec(std::move(s)),
      own_self(make_self(*spec, this)),
      self(*own_self),
      state(self.path + "/state", this, (self.path + "/state").size()),
      blueprint(self.path + "/blueprint", this, (self.path + "/blueprint").size()),
      subscriptions(self.path + "/subscriptions", this, (self.path + "/subscriptions").size()),
      tree(self.path + "/all", this),
      control(make_control(*spec, this)) {
  for (const auto& p : spec->properties) properties.push_back(std::make_unique<PropertyResource>(self.path + "/" + p->path, this, p));
  for (const auto& a : spec->actions) actions.push_back(std::make_unique<ActionResource>(self.path + "/actions/" + a->path, this, a));
  for (const auto& c : spec->collections) collections.push_back(std::make_unique<CollectionResource>(self.path + "/" + c->path, this, c));
}

ThingNode::~ThingNode() = default;

void StateProperties::iterator::skip_files() {
  while (at_ != end_ && (*at_)->spec->file) ++at_;
}

bool ThingNode::adds_shapes() const { return !user_shapes().empty(); }

const rdf::Graph& ThingNode::statements() const noexcept { return (texts ? *texts : no_texts()).statements; }
const rdf::Graph& ThingNode::user_shapes() const noexcept { return (texts ? *texts : no_texts()).shapes; }

bool ThingNode::adds_shapes(const Audience& audience) const {
  return adds_shapes() && (!audience.is_restricted() || !seen_shapes(*this, audience).empty());
}

const ThingNode* ThingNode::parent_seen_by(const Audience& audience) const {
  const ThingNode* above = parent;
  while (above && !audience.sees(above->self)) above = above->parent;
  return above;
}

namespace {

/// @return  false: Things below took the place of one
bool add_seen(const ThinVector<ThingNode*>& things, const Audience& audience, std::vector<ThingNode*>& seen) {
  bool all = true;
  for (ThingNode* thing : things) {
    if (audience.sees(thing->self)) seen.push_back(thing);
    else all = add_seen(thing->children, audience, seen) && thing->children.empty() && all;
  }
  return all;
}

}  // namespace

inline namespace v0 {

std::vector<ThingNode*> seen_things(const ThinVector<ThingNode*>& things, const Audience& audience) {
  if (!audience.is_restricted()) return {things.begin(), things.end()};
  std::vector<ThingNode*> seen;
  if (!add_seen(things, audience, seen))  // in the order of registration
    std::sort(seen.begin(), seen.end(), [](const ThingNode* a, const ThingNode* b) { return a->self.id < b->self.id; });
  return seen;
}

}  // namespace v0

std::vector<std::string> ThingNode::blueprint_iris(const std::string& base, const Audience& audience) const {
  std::vector<std::string> iris = {spec->blueprint ? *spec->blueprint : base + (kind ? kind->path : blueprint.path)};
  if (bounds) iris.push_back(base + bounds->path);
  if (kind && adds_shapes(audience)) iris.push_back(names_base(base));
  return iris;
}

std::string ThingNode::shapes_of(const std::string& base, const std::string& name) const {
  if (!kind || (!name.empty() && has_user_shape(*this, name))) return names_base(base);
  return base + (bounds && !name.empty() && has_bounds(*this, name) ? bounds->path : kind->path);
}

void ThingNode::shapes_moved() {
  compiled_shapes.clear();
  for (Resource* r : resources()) r->mark_changed();
}

std::string ThingNode::shape_name(std::string name, std::string_view rest) const {
  const auto is_users = [&](const auto& r) { return r->path.size() == name.size() + rest.size() && r->path == name + std::string(rest); };
  while (std::any_of(spec->properties.begin(), spec->properties.end(), is_users) ||
         std::any_of(spec->collections.begin(), spec->collections.end(), is_users))
    name += name_aside;
  return name.append(rest);
}

std::vector<ActionResource*> ThingNode::available_actions() const {
  std::vector<ActionResource*> available;
  for (const auto& a : actions)
    if (a->unavailable.empty()) available.push_back(a.get());
  return available;
}

std::vector<Resource*> ThingNode::resources() {
  std::vector<Resource*> all = {&self, &state, &blueprint, &subscriptions, &tree};
  for (const auto& p : properties) all.push_back(p.get());
  for (const auto& a : actions) all.push_back(a.get());
  for (const auto& c : collections) all.push_back(c.get());
  if (control) all.push_back(control.get());
  for (Resource* r : self.more_resources()) all.push_back(r);
  return all;
}

}  // namespace lrt::engine

#include "src/engine/resources/blueprint.hpp"

#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/shacl/derive.hpp>

#include "src/engine/bases.hpp"
#include "src/engine/description.hpp"
#include "src/engine/overview.hpp"
#include "src/engine/registration.hpp"
#include "src/engine/resources/action.hpp"
#include "src/engine/resources/collection.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"

namespace lrt::engine {

namespace {

using rdf::Graph;
using rdf::TermId;

/// The shape of that name among the user's, which replaces the generated one.
std::optional<TermId> user_shape(const ThingNode& thing, const std::string& name) {
  const std::string iri = std::string(placeholder_base) + thing.blueprint.path + (name.empty() ? "" : "#" + name);
  const auto id = thing.user_shapes.find(rdf::iri(iri));
  return id && !thing.user_shapes.match(*id, std::nullopt, std::nullopt).empty() ? id : std::nullopt;
}

/// The triples about a node and about the blank nodes that it leads to.
void copy_described(Graph& to, const Graph& from, TermId node) {
  std::vector<TermId> open = {node};
  std::vector<bool> seen(from.term_count());
  while (!open.empty()) {
    const TermId next = open.back();
    open.pop_back();
    if (seen[static_cast<std::size_t>(next)]) continue;
    seen[static_cast<std::size_t>(next)] = true;
    for (const rdf::Triple& t : from.match(next, std::nullopt, std::nullopt)) {
      to.add(from.term(t.subject), from.term(t.predicate), from.term(t.object));
      if (from.term(t.object).is_blank()) open.push_back(t.object);
    }
  }
}

/// A property shape with one value that must be there.
void must_have(Graph& graph, TermId shape, Iri path, const std::string& value, Iri type = {}) {
  const TermId p = graph.fresh_blank();
  About(graph, shape).add(vocab::sh::property, p);
  About constraint(graph, p);
  constraint.add(vocab::sh::path, rdf::TermView(path)).link(vocab::sh::hasValue, value);
  if (!type.empty()) constraint.add(vocab::sh::class_, rdf::TermView(type));
}

/// The shape of the Thing itself.
void describe_structure(const ThingNode& thing, const Description& d) {
  Graph& graph = d.graph;
  const TermId shape = graph.intern(rdf::iri(thing.names_base(d.base)));
  About(graph, shape)
      .a(vocab::sh::NodeShape)
      .add(vocab::sh::name, rdf::literal(thing.spec->title))
      .link(vocab::sh::targetNode, d.base + thing.self.path);
  must_have(graph, shape, vocab::rdf_::type, std::string(vocab::hybrit::RoboticThing.text));
  for (const std::string& c : thing.spec->classes) must_have(graph, shape, vocab::rdf_::type, c);
  must_have(graph, shape, vocab::hybrit::subscriptions, d.base + thing.subscriptions.path);
  const auto links = [&](const auto& resources, Iri predicate, Iri type) {
    for (const auto& r : resources) {
      must_have(graph, shape, predicate, d.base + r->path, type);
      for (const std::string& p : r->spec->predicates) must_have(graph, shape, Iri(std::string_view(p)), d.base + r->path);
    }
  };
  links(thing.available_actions(), vocab::hybrit::action, vocab::hybrit::Action);
  links(thing.properties, vocab::hybrit::property, vocab::hybrit::Property);
  links(thing.collections, vocab::lrt_::collection, vocab::ldp::BasicContainer);
  for (const ThingNode* child : thing.children)
    must_have(graph, shape, vocab::dcterms::hasPart, d.base + child->self.path, vocab::hybrit::RoboticThing);
}

}  // namespace

void describe_shape(Graph& graph, const ThingNode& thing, const std::string& base, const std::string& name, const rdf::Type& type,
                    const rdf::Facets& facets) {
  if (const auto users = user_shape(thing, name)) {
    Graph described;
    copy_described(described, thing.user_shapes, *users);
    return add_placed(graph, described, base);
  }
  const std::string names = thing.names_base(base);
  const TermId shape = graph.intern(rdf::iri(names + "#" + name));
  About(graph, shape).a(vocab::sh::NodeShape).add(vocab::sh::name, rdf::literal(name));
  shacl::derive(graph, shape, type, facets, names);
}

void BlueprintResource::describe(const Description& d) const {
  const ThingNode& node = *thing;
  const std::string self = node.names_base(d.base);
  if (!user_shape(node, {})) describe_structure(node, d);
  const auto generate = [&](const std::string& name, const rdf::Type* type, const rdf::Facets& facets) {
    if (type && !user_shape(node, name)) describe_shape(d.graph, node, d.base, name, *type, facets);
  };
  for (const auto& p : node.properties) {
    generate(p->spec->path, p->spec->type, p->spec->facets);
    if (p->promises_triples()) About(d.graph, self + "#" + p->spec->path).link(vocab::sh::targetNode, d.base + p->path);
  }
  for (const auto& a : node.actions) {
    generate(a->input_shape(), a->spec->input, a->spec->facets);
    generate(a->output_shape(), a->spec->output, a->spec->output_facets);
  }
  for (const auto& c : node.collections) generate(c->spec->path, c->spec->type, c->spec->facets);
  const std::string subscriptions = node.subscriptions.input_shape();
  if (d.engine.makes_callbacks && !user_shape(node, subscriptions))
    describe_subscription_shape(d.graph, self + "#" + subscriptions, d.engine.options.subscriptions);
  add_placed(d.graph, node.user_shapes, d.base);
}

void BlueprintResource::overview(Overview& o) const {
  o.links("properties", thing->properties);
  o.links("actions", thing->actions);
  o.links("collections", thing->collections);
}

void BlueprintResource::for_each_property(FunctionRef<void(PropertyResource&)> visit) const {
  thing->state.for_each_property(visit);
}

/// Names and shapes are resolved against its path, so what was made with them is made again.
void BlueprintResource::path_changed() {
  thing->compiled_shapes.clear();
  if (Result<rdf::Graph> shapes = read_shapes(*thing->spec, path))
    thing->user_shapes = *std::move(shapes);  // the texts were judged before
  for (Resource* r : thing->resources()) r->mark_changed();
}

Result<const shacl::Shapes*> compiled_shapes(ThingNode& thing, std::size_t base, const EngineView& engine) {
  if (const auto known = thing.compiled_shapes.find(base); known != thing.compiled_shapes.end()) return &known->second;
  Graph graph;
  thing.blueprint.describe({graph, engine.bases[base], 1, engine});
  Result<shacl::Shapes> compiled = shacl::Shapes::compile(std::move(graph));
  if (!compiled) return Unexpected{std::move(compiled).error()};
  return &thing.compiled_shapes.emplace(base, *std::move(compiled)).first->second;
}

}  // namespace lrt::engine

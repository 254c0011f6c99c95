// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/blueprint.hpp"

#include <algorithm>
#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/shacl/derive.hpp>

#include "src/engine/bases.hpp"
#include "src/engine/description.hpp"
#include "src/engine/overview.hpp"
#include "src/engine/registration.hpp"
#include "src/engine/resources/action.hpp"
#include "src/engine/resources/collection.hpp"
#include "src/engine/resources/kind.hpp"
#include "src/engine/resources/property.hpp"
#include "src/engine/resources/thing.hpp"

namespace lrt::engine {

namespace {

using rdf::Graph;
using rdf::TermId;

/// The shape of that name among the user's, which replaces the generated one.
std::optional<TermId> user_shape(const ThingNode& thing, const std::string& name) {
  const Graph& shapes = thing.user_shapes();
  if (shapes.empty()) return std::nullopt;
  const std::string iri = std::string(placeholder_base) + thing.blueprint.path + (name.empty() ? "" : "#" + name);
  const auto id = shapes.find(rdf::iri(iri));
  return id && !shapes.match(*id, std::nullopt, std::nullopt).empty() ? id : std::nullopt;
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

/// The generated shape of values.
void describe_generated(const Description& d, const std::string& iri, const ValueShape& values) {
  const TermId shape = d.graph.intern(rdf::iri(iri));
  About(d.graph, shape).a(vocab::sh::NodeShape).add(vocab::sh::name, rdf::literal(values.name));
  shacl::derive(d.graph, shape, *values.type, *values.facets, d.engine.vocabulary(d.base), {true, values.input});
}

}  // namespace

bool has_user_shape(const ThingNode& thing, const std::string& name) { return user_shape(thing, name).has_value(); }

bool has_own_shape(const ThingNode& thing, const std::string& name) {
  if (!thing.kind || has_user_shape(thing, name)) return true;
  const std::vector<ValueShape> shapes = value_shapes(thing);
  const auto it = std::find_if(shapes.begin(), shapes.end(), [&](const ValueShape& s) { return s.name == name; });
  return it != shapes.end() && !thing.kind->shares_bounds(static_cast<std::size_t>(it - shapes.begin()));
}

void describe_value_shape(const Description& d, const ThingNode& thing, const std::string& name) {
  const std::vector<ValueShape> shapes = value_shapes(thing);
  const ValueShape& values = *std::find_if(shapes.begin(), shapes.end(), [&](const ValueShape& s) { return s.name == name; });
  const std::string iri = thing.shape_iri(d.base, name);
  if (const auto users = user_shape(thing, name)) {
    Graph described;
    copy_described(described, thing.user_shapes(), *users);
    add_placed(d.graph, described, d.base);
  } else {
    describe_generated(d, iri, values);
  }
  const std::string of = rdf::target_class(*values.type, d.engine.vocabulary(d.base));
  if (!of.empty()) About(d.graph, iri).link(vocab::sh::targetClass, of);
}

namespace {

/// The shapes that the user gave, but for those of values that the audience does not see.
Graph seen_shapes(const ThingNode& thing, const Audience& audience) {
  const Graph& all = thing.user_shapes();
  if (!audience.is_restricted()) return all;
  std::vector<std::string> hidden;
  const std::vector<ValueShape> shapes = value_shapes(thing);
  for (std::size_t i = 0; i < shapes.size(); ++i)
    if (!audience.sees(*shaped_resource(thing, i))) hidden.push_back(std::string(placeholder_base) + thing.blueprint.path + "#" + shapes[i].name);
  return visible_part(all, [&](std::string_view iri) { return std::find(hidden.begin(), hidden.end(), iri) == hidden.end(); });
}

}  // namespace

void BlueprintResource::describe(const Description& d) const {
  const ThingNode& node = *thing;
  const std::string self = node.names_base(d.base);
  if (!user_shape(node, {}))
    About(d.graph, self).a(vocab::sh::NodeShape).link(vocab::sh::targetNode, d.base + node.self.path).link(vocab::sh::node, d.base + node.kind->path);
  const std::vector<ValueShape> shapes = value_shapes(node);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    if (!has_own_shape(node, shapes[i].name) || !d.audience.sees(*shaped_resource(node, i))) continue;
    const std::string iri = self + "#" + shapes[i].name;
    if (!user_shape(node, shapes[i].name)) describe_generated(d, iri, shapes[i]);
    // The first shapes are those of the properties.
    if (i < node.properties.size() && node.properties[i]->promises_triples())
      About(d.graph, iri).link(vocab::sh::targetNode, d.base + node.properties[i]->path);
  }
  add_placed(d.graph, seen_shapes(node, d.audience), d.base);
}

void BlueprintResource::overview(Overview& o) const {
  o.link("thing", thing->self);
  o.link("kind", *thing->kind);
}

void BlueprintResource::for_each_property(FunctionRef<void(PropertyResource&)> visit) const { thing->state.for_each_property(visit); }

/// Names and shapes are resolved against its path, so that everything derived from them is computed again.
void BlueprintResource::path_changed() {
  if (Result<rdf::Graph> shapes = read_shapes(*thing->spec, path))
    if (thing->texts) thing->texts->shapes = *std::move(shapes);  // the texts were validated before
  thing->shapes_moved();
}

Result<shacl::Shapes> compiled_shapes(ThingNode& thing, std::size_t base, const EngineView& engine) {
  const bool is_own = thing.adds_shapes();
  ThinVector<CompiledShapes>& known = is_own ? thing.compiled_shapes : thing.kind->compiled_shapes;
  for (const CompiledShapes& compiled : known)
    if (compiled.base == base) return compiled.shapes;
  Graph graph;
  const Audience everybody;  // bodies are validated by the complete shapes
  const Description d{graph, engine.bases[base], 1, engine, everybody};
  thing.kind->describe_shapes(d);
  if (is_own) thing.blueprint.describe(d);
  Result<shacl::Shapes> compiled = shacl::Shapes::compile(std::move(graph));
  if (compiled) known.push_back({base, *compiled});
  return compiled;
}

}  // namespace lrt::engine

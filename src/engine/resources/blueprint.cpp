// SPDX-License-Identifier: Apache-2.0
#include "src/engine/resources/blueprint.hpp"

#include <algorithm>
#include <optional>
#include <string_view>
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

}  // namespace

void describe_generated(const Description& d, const std::string& iri, const ValueShape& values, const rdf::Facets& facets) {
  const TermId shape = d.graph.intern(rdf::iri(iri));
  About(d.graph, shape).a(vocab::sh::NodeShape).add(vocab::rdfs::label, rdf::literal(values.name));
  shacl::DeriveOptions options;
  options.input = values.input;
  options.named = values.repeated;
  shacl::derive(d.graph, shape, *values.type, facets, d.engine.vocabulary(d.base), options);
}

bool has_user_shape(const ThingNode& thing, const std::string& name) { return user_shape(thing, name).has_value(); }

bool has_bounds(const ThingNode& thing, const std::string& name) {
  const std::vector<ValueShape> shapes = value_shapes(thing);
  const auto it = std::find_if(shapes.begin(), shapes.end(), [&](const ValueShape& s) { return s.name == name; });
  return it != shapes.end() && it->has_bounds();
}

void describe_value_shape(const Description& d, const ThingNode& thing, const std::string& name) {
  if (has_user_shape(thing, name)) return;
  const std::vector<ValueShape> shapes = value_shapes(thing);
  const ValueShape& values = *std::find_if(shapes.begin(), shapes.end(), [&](const ValueShape& s) { return s.name == name; });
  if (values.repeated) describe_generated(d, thing.shape_iri(d.base, name), values, *values.facets);
}

bool shows_shape(const ThingNode& thing, std::string_view fragment, const Audience& audience) {
  const Resource* named = nullptr;  // by the longest name that the fragment begins with
  std::size_t length = 0;
  for (const ValueShape& values : value_shapes(thing)) {
    const std::string& name = values.name;
    const bool is_it =
        fragment.substr(0, name.size()) == name && (fragment.size() == name.size() || fragment[name.size()] == '.' || fragment[name.size()] == '/');
    if (is_it && name.size() >= length) named = values.resource, length = name.size();
  }
  return !named || audience.sees(*named);
}

Graph seen_shapes(const ThingNode& thing, const Audience& audience) {
  if (!audience.is_restricted() || thing.user_shapes().empty()) return thing.user_shapes();
  const std::optional<std::vector<std::string>> texts = thing.self.shapes_seen_by(audience);
  const Result<Graph> of_texts = texts ? read_shapes(*thing.spec, *texts, thing.blueprint.path) : Graph();
  const Graph& all = texts && of_texts ? *of_texts : thing.user_shapes();
  const std::string prefix = std::string(placeholder_base) + thing.blueprint.path + "#";
  return visible_part(
      all, [&](std::string_view iri) { return iri.substr(0, prefix.size()) != prefix || shows_shape(thing, iri.substr(prefix.size()), audience); });
}

bool BlueprintResource::shows_fragment(std::string_view fragment, const Audience& audience) const {
  const std::string iri = std::string(placeholder_base) + path + "#" + std::string(fragment);
  const rdf::TermView shape = rdf::iri(iri);
  return shows_shape(*thing, fragment, audience) && (!thing->user_shapes().find(shape) || seen_shapes(*thing, audience).find(shape));
}

void BlueprintResource::describe(const Description& d) const {
  const ThingNode& node = *thing;
  About(d.graph, d.base + path).a(vocab::ldp::RDFSource);
  ValueOrError value_or_error(d.graph, d.engine.vocabulary(d.base));
  for (const auto& p : node.properties) {
    if (p->spec->file || !d.audience.sees(*p) || !has_user_shape(node, p->spec->path)) continue;
    const std::string shape = node.shape_iri(d.base, p->spec->path);
    About judge(d.graph, d.graph.fresh_blank());
    judge.a(vocab::sh::NodeShape).link(vocab::sh::targetNode, d.base + p->path);
    value_or_error.conforms(judge, *p, shape);
  }
  add_placed(d.graph, seen_shapes(node, d.audience), d.base);
}

void BlueprintResource::overview(Overview& o) const {
  o.link("thing", thing->self);
  o.link("kind", *thing->kind);
  if (thing->bounds) o.link("bounds", *thing->bounds);
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
  ThinVector<CompiledShapes>& known = is_own ? thing.compiled_shapes : thing.bounds ? thing.bounds->compiled_shapes : thing.kind->compiled_shapes;
  for (const CompiledShapes& compiled : known)
    if (compiled.base == base) return compiled.shapes;
  Graph graph;
  const Audience everybody;  // bodies are validated by the complete shapes
  const Description d{graph, engine.bases[base], 1, engine, everybody};
  thing.kind->describe(d);
  if (thing.bounds) thing.bounds->describe(d);
  if (is_own) thing.blueprint.describe(d);
  Result<shacl::Shapes> compiled = shacl::Shapes::compile(std::move(graph));
  if (compiled) known.push_back({base, *compiled});
  return compiled;
}

}  // namespace lrt::engine

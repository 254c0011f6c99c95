#include <lrt/shacl/derive.hpp>

#include "src/engine/about.hpp"
#include "src/engine/impl.hpp"

namespace lrt::engine {

using rdf::Graph;
using rdf::TermId;

std::string shape_name(const Resource& resource) {
  switch (resource.kind) {
    case Kind::property: return static_cast<const PropertyResource&>(resource).spec->path;
    case Kind::action: return "actions/" + static_cast<const ActionResource&>(resource).spec->path + "/input";
    case Kind::collection: return static_cast<const CollectionResource&>(resource).spec->path;
    default: return {};
  }
}

namespace {

/// The shape of that name among the user's, which then stands for the generated one.
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

/// A property shape of `shape` with one value that must be there.
void must_have(Graph& graph, TermId shape, Iri path, const std::string& value, Iri type = {}) {
  const TermId p = graph.fresh_blank();
  About(graph, shape).add(vocab::sh::property, p);
  About constraint(graph, p);
  constraint.add(vocab::sh::path, rdf::TermView(path)).link(vocab::sh::hasValue, value);
  if (!type.empty()) constraint.add(vocab::sh::class_, rdf::TermView(type));
}

}  // namespace

/// The shape of values under a name: the user's, taken literally, or the one that the type implies.
void Engine::Impl::describe_shape(Graph& graph, const ThingNode& thing, const std::string& base, const std::string& name,
                                  const rdf::Type& type, const rdf::Facets& facets) {
  if (const auto users = user_shape(thing, name)) {
    Graph described;
    copy_described(described, thing.user_shapes, *users);
    return add_placed(graph, described, base);
  }
  const std::string names = names_base(thing, base);
  const TermId shape = graph.intern(rdf::iri(names + "#" + name));
  About(graph, shape).a(vocab::sh::NodeShape).add(vocab::sh::name, rdf::literal(name));
  shacl::derive(graph, shape, type, facets, names);
}

/// Everything that a thing promises and asks for as shapes (R1.11): its structure, the values of its properties and members, what its
/// actions consume and produce. The state of the thing conforms (SPEC 2).
void Engine::Impl::describe_blueprint(Graph& graph, ThingNode& thing, const std::string& base) {
  const std::string self = base + thing.blueprint.path;
  if (!user_shape(thing, {})) {
    const TermId shape = graph.intern(rdf::iri(self));
    About(graph, shape)
        .a(vocab::sh::NodeShape)
        .add(vocab::sh::name, rdf::literal(thing.spec->title))
        .link(vocab::sh::targetNode, base + thing.self.path);
    must_have(graph, shape, vocab::rdf::type, std::string(vocab::hybrit::RoboticThing.text));
    for (const std::string& c : thing.spec->classes) must_have(graph, shape, vocab::rdf::type, c);
    must_have(graph, shape, vocab::hybrit::subscriptions, base + thing.subscriptions.path);
    const auto links = [&](const auto& resources, Iri predicate, Iri type) {
      for (const auto& r : resources) {
        must_have(graph, shape, predicate, base + r->path, type);
        for (const std::string& p : r->spec->predicates) must_have(graph, shape, Iri(std::string_view(p)), base + r->path);
      }
    };
    links(thing.actions, vocab::hybrit::action, vocab::hybrit::Action);
    links(thing.properties, vocab::hybrit::property, vocab::hybrit::Property);
    links(thing.collections, vocab::lrt::collection, vocab::ldp::BasicContainer);
    for (const ThingNode* child : thing.children)
      must_have(graph, shape, vocab::dcterms::hasPart, base + child->self.path, vocab::hybrit::RoboticThing);
  }
  for (const auto& p : thing.properties) {
    if (!user_shape(thing, p->spec->path)) describe_shape(graph, thing, base, p->spec->path, *p->spec->type, p->spec->facets);
    (void)sync(*p);
    if (p->promises_triples()) About(graph, self + "#" + p->spec->path).link(vocab::sh::targetNode, base + p->path);
  }
  const auto part = [&](const std::string& name, const rdf::Type* type, const rdf::Facets& facets) {
    if (type && !user_shape(thing, name)) describe_shape(graph, thing, base, name, *type, facets);
  };
  for (const auto& a : thing.actions) {
    part("actions/" + a->spec->path + "/input", a->spec->input, a->spec->input_facets);
    part("actions/" + a->spec->path + "/output", a->spec->output, a->spec->output_facets);
  }
  for (const auto& c : thing.collections) part(c->spec->path, c->spec->type, c->spec->facets);
  // Where nobody may be called there is nothing to ask for.
  if (allowed_ && !allowed_->empty() && !user_shape(thing, std::string(subscriptions_shape)))
    describe_subscription_shape(graph, self + "#" + std::string(subscriptions_shape));
  add_placed(graph, thing.user_shapes, base);
}

/// What a POST to the container of subscriptions must say (SPEC 3.5).
void Engine::Impl::describe_subscription_shape(Graph& graph, const std::string& iri) {
  const TermId shape = graph.intern(rdf::iri(iri));
  About(graph, shape).a(vocab::sh::NodeShape).add(vocab::sh::name, rdf::literal("subscriptions"));
  const auto integer = [](std::uint64_t n) { return std::to_string(n); };
  const auto property = [&](Iri path, bool required) {
    const TermId p = graph.fresh_blank();
    About(graph, shape).add(vocab::sh::property, p);
    About about(graph, p);
    about.add(vocab::sh::path, rdf::TermView(path));
    if (required) about.add(vocab::sh::minCount, rdf::literal("1", vocab::xsd::integer));
    about.add(vocab::sh::maxCount, rdf::literal("1", vocab::xsd::integer));
    return about;
  };
  property(vocab::hybrit::onResource, true).add(vocab::sh::nodeKind, rdf::TermView(vocab::sh::IRI));
  property(vocab::hybrit::callbackURL, true);
  property(vocab::hybrit::mediaType, false).add(vocab::sh::datatype, rdf::TermView(vocab::xsd::string));
  property(vocab::lrt::minimumInterval, false)
      .add(vocab::sh::minInclusive, rdf::literal("0", vocab::xsd::integer))
      .add(vocab::sh::maxInclusive, rdf::literal(integer(longest_interval.count()), vocab::xsd::integer));
  property(vocab::lrt::queueLength, false)
      .add(vocab::sh::datatype, rdf::TermView(vocab::xsd::integer))
      .add(vocab::sh::minInclusive, rdf::literal("0", vocab::xsd::integer))
      .add(vocab::sh::maxInclusive, rdf::literal(integer(options_.subscriptions.max_queue_length), vocab::xsd::integer));
  property(vocab::lrt::secret, false)
      .add(vocab::sh::datatype, rdf::TermView(vocab::xsd::string))
      .add(vocab::sh::maxLength, rdf::literal(integer(longest_secret), vocab::xsd::integer));
}

/// What bodies are judged by. Compiled when the first body comes, or at registration when the user gave shapes, which may be ill-formed.
Result<const shacl::Shapes*> Engine::Impl::shapes_of(ThingNode& thing, std::size_t base) {
  if (const auto known = thing.door.find(base); known != thing.door.end()) return &known->second;
  Graph graph;
  describe_blueprint(graph, thing, bases_[base]);
  Result<shacl::Shapes> compiled = shacl::Shapes::compile(std::move(graph));
  if (!compiled) return Unexpected{std::move(compiled).error()};
  return &thing.door.emplace(base, *std::move(compiled)).first->second;
}

}  // namespace lrt::engine

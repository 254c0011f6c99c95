#include <lrt/rdf/lexical.hpp>

#include "src/engine/impl.hpp"

namespace lrt::engine {

namespace {

using rdf::Graph;
using rdf::TermId;
using Kind = rdf::Type::Kind;

/// Writes the shape of values of a type: what rdf::write_value() writes conforms to it.
class ShapeWriter {
 public:
  ShapeWriter(Graph& graph, std::string names_base) : graph_(graph), names_base_(std::move(names_base)) {}

  /// The constraints on a focus node that carries such a value.
  void at(TermId shape, const rdf::Type& type, const rdf::Facets& facets, bool required = true) {
    switch (type.kind) {
      case Kind::optional: return at(shape, *type.element, facets, false);
      case Kind::record:
        for (const rdf::FieldType& field : type.fields) {
          const TermId p = property(shape, graph_.intern(rdf::iri(predicate_of(field))));
          add(p, vocab::sh::name, rdf::literal(field.name));
          object(p, *field.type, field.facets, field.type->kind != Kind::optional);
        }
        return;
      case Kind::integer:
      case Kind::real:
        object(property(shape, graph_.intern(vocab::vom::numericalValue)), type, rdf::Facets(facets).unit(unit::none), required);
        units(shape, facets.unit());
        return;
      default: object(property(shape, graph_.intern(vocab::rdf::value)), type, facets, required);
    }
  }

  TermId property(TermId shape, TermId path) {
    const TermId p = graph_.fresh_blank();
    graph_.add(shape, graph_.intern(vocab::sh::property), p);
    graph_.add(p, graph_.intern(vocab::sh::path), path);
    return p;
  }
  void add(TermId s, Iri p, const rdf::TermView& o) { graph_.add(s, graph_.intern(p), graph_.intern(o)); }
  void count(TermId p, Iri which, std::size_t n) { add(p, which, rdf::literal(std::to_string(n), vocab::xsd::integer)); }

 private:
  std::string predicate_of(const rdf::FieldType& field) const {
    return field.predicate.empty() || field.predicate.front() != '#' ? field.predicate : names_base_ + field.predicate;
  }

  void units(TermId shape, const Unit& unit) {
    if (unit.empty()) return;
    const auto allow = [&](Iri predicate, Iri wanted) {
      if (wanted.empty()) return;
      const TermId p = property(shape, graph_.intern(predicate));
      const TermId cell = graph_.fresh_blank();
      graph_.add(p, graph_.intern(vocab::sh::in_), cell);
      graph_.add(cell, graph_.intern(vocab::rdf::first), graph_.intern(wanted));
      graph_.add(cell, graph_.intern(vocab::rdf::rest), graph_.intern(vocab::rdf::nil));
    };
    allow(vocab::vom::unit, unit.vom);
    allow(vocab::qudt::unit, unit.qudt);
  }

  /// The constraints on the values of a property shape.
  void object(TermId p, const rdf::Type& type, const rdf::Facets& facets, bool required) {
    if (type.kind == Kind::optional) return object(p, *type.element, facets, false);
    if (required) count(p, vocab::sh::minCount, 1);
    count(p, vocab::sh::maxCount, 1);
    switch (type.kind) {
      case Kind::record: {
        const TermId node = graph_.fresh_blank();
        graph_.add(p, graph_.intern(vocab::sh::node), node);
        at(node, type, facets);
        return;
      }
      case Kind::list: return;
      case Kind::integer:
      case Kind::real:
        if (!facets.unit().empty()) {
          const TermId node = graph_.fresh_blank();
          graph_.add(p, graph_.intern(vocab::sh::node), node);
          at(node, type, facets);
          return;
        }
        [[fallthrough]];
      default: break;
    }
    add(p, vocab::sh::datatype, type.datatype);
    const auto number = [&](double v) { return rdf::lexical::format(v); };
    if (facets.min())
      add(p, facets.min_exclusive() ? vocab::sh::minExclusive : vocab::sh::minInclusive, rdf::literal(number(*facets.min()), vocab::xsd::double_));
    if (facets.max())
      add(p, facets.max_exclusive() ? vocab::sh::maxExclusive : vocab::sh::maxInclusive, rdf::literal(number(*facets.max()), vocab::xsd::double_));
    if (type.kind == Kind::enumeration) {
      std::vector<TermId> cells;
      for (std::size_t i = 0; i < type.names.size(); ++i) cells.push_back(graph_.fresh_blank());
      for (std::size_t i = 0; i < cells.size(); ++i) {
        add(cells[i], vocab::rdf::first, rdf::literal(type.names[i]));
        graph_.add(cells[i], graph_.intern(vocab::rdf::rest), i + 1 < cells.size() ? cells[i + 1] : graph_.intern(vocab::rdf::nil));
      }
      if (!cells.empty()) graph_.add(p, graph_.intern(vocab::sh::in_), cells.front());
    }
  }

  Graph& graph_;
  std::string names_base_;
};

}  // namespace

/// Types, units and bounds of a thing as shapes (R1.11).
void Engine::Impl::describe_blueprint(Graph& graph, ThingNode& thing, const std::string& base) {
  const std::string self = base + thing.blueprint.path;
  ShapeWriter shapes(graph, names_base(thing, base));
  const TermId shape = graph.intern(rdf::iri(self));
  shapes.add(shape, vocab::rdf::type, vocab::sh::NodeShape);
  shapes.add(shape, vocab::sh::targetNode, rdf::iri(base + thing.self.path));
  for (const auto& p : thing.properties) {
    for (const std::string& predicate : p->spec->predicates) {
      const TermId link = shapes.property(shape, graph.intern(rdf::iri(predicate)));
      shapes.count(link, vocab::sh::minCount, 1);
      shapes.count(link, vocab::sh::maxCount, 1);
      shapes.add(link, vocab::sh::class_, vocab::hybrit::Property);
    }
  }
  const auto value_shape = [&](const std::string& name, const std::string& title) {
    const TermId id = graph.intern(rdf::iri(self + "#" + name));
    shapes.add(id, vocab::rdf::type, vocab::sh::NodeShape);
    shapes.add(id, vocab::sh::name, rdf::literal(title));
    return id;
  };
  for (const auto& p : thing.properties) {
    const TermId id = value_shape(p->spec->path, p->spec->path);
    shapes.add(id, vocab::sh::targetNode, rdf::iri(base + p->path));
    shapes.at(id, *p->spec->type, p->spec->facets, !p->spec->slot);
  }
  for (const auto& a : thing.actions) {
    if (a->spec->input) shapes.at(value_shape("actions/" + a->spec->path + "/input", a->spec->path + ": input"), *a->spec->input, a->spec->input_facets);
    if (a->spec->output)
      shapes.at(value_shape("actions/" + a->spec->path + "/output", a->spec->path + ": output"), *a->spec->output, a->spec->output_facets);
  }
  for (const auto& c : thing.collections) shapes.at(value_shape(c->spec->path, c->spec->path + ": member"), *c->spec->type, c->spec->facets);
}

}  // namespace lrt::engine

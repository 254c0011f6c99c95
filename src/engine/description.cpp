// SPDX-License-Identifier: Apache-2.0
#include "src/engine/description.hpp"

#include <lrt/engine/engine.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/value_codec.hpp>

#include "src/engine/resources/thing.hpp"
#include "src/engine/vocabulary.hpp"
#include "src/model/spec.hpp"

namespace lrt::engine {
inline namespace v0 {

About& About::statements(const std::vector<Statement>& statements, const std::string& base) {
  for (const Statement& s : statements) {
    const rdf::TermId predicate = graph_.intern(rdf::iri(s.predicate)), object = object_term(graph_, s.object, base);
    graph_.add(subject_, predicate, object);
  }
  return *this;
}

About& About::texts(Iri predicate, const rdf::Texts& texts) {
  for (const rdf::Text& t : texts) add(predicate, t.language.empty() ? rdf::literal(t.text) : rdf::tagged_literal(t.text, t.language));
  return *this;
}

rdf::TermId object_term(rdf::Graph& graph, const Object& o, const std::string& base) {
  switch (o.kind()) {
    case Object::Kind::iri: return graph.intern(rdf::iri(o.text()));
    case Object::Kind::resource: return graph.intern(rdf::iri(base + "/" + model::encode_path_from_root(o.text()).value_or(std::string())));
    case Object::Kind::literal: break;
  }
  if (!o.language().empty()) return graph.intern(rdf::tagged_literal(o.text(), o.language()));
  return graph.intern(o.datatype().empty() ? rdf::literal(o.text()) : rdf::literal(o.text(), Iri(std::string_view(o.datatype()))));
}

void describe_types_of(const Resource& linked, const Description& d) {
  About about(d.graph, d.base + linked.path);
  linked.describe_types(about, d);
}

void describe_value_types(About& about, const rdf::Type& type, const std::string& vocabulary) {
  if (type.kind == rdf::Type::Kind::optional) return describe_value_types(about, *type.element, vocabulary);
  if (type.is_number()) about.a(vocab::maths::Scalar);
  if (type.has_fields())
    for (const std::string& c : type.classes) about.a(Iri(std::string_view(rdf::term_iri(c, vocabulary))));
}

std::string EngineView::vocabulary(const std::string& base) const {
  return options.vocabulary.empty() ? base + VocabularyResource::location + "#" : options.vocabulary;
}

void describe_unit(About& about, const Unit& unit) {
  if (!unit.vom.empty()) about.add(vocab::vom::unit, rdf::TermView(unit.vom));
  if (!unit.qudt.empty()) about.add(vocab::qudt::hasUnit, rdf::TermView(unit.qudt));
}

void describe_binding(About& about, const Description& d, const Resource& resource, Iri method, const std::vector<std::string>& body_classes) {
  const rdf::TermId binding = d.graph.fresh_blank(), body = d.graph.fresh_blank();
  about.add(vocab::hybrit::binding, binding);
  About(d.graph, binding)
      .a(vocab::http_core::Request)
      .add(vocab::http_core::mthd, rdf::TermView(method))
      .link(vocab::http_core::requestURI, d.base + resource.path)
      .add(vocab::http_core::body, body);
  for (const std::string& of : body_classes)
    if (!of.empty()) About(d.graph, body).a(Iri(std::string_view(of)));
  About(d.graph, body).link(vocab::dcterms::conformsTo, resource.thing->shape_iri(d.base, resource.input_shape()));
}

std::string seconds(std::chrono::milliseconds time) { return rdf::lexical::format(std::chrono::duration<double>(time).count()); }

Quantity quantity_of(const rdf::Type& type, const rdf::Facets& facets) {
  using Kind = rdf::Type::Kind;
  const rdf::Type* value = &type;
  bool is_list = false;
  while (value->kind == Kind::optional || value->kind == Kind::list) {
    is_list = is_list || value->kind == Kind::list;
    value = value->element;
  }
  return {value->has_fields() ? rdf::node_unit(*value, facets) : facets.unit(), value->datatype,
          is_list ? vocab::lrt_::elementType : vocab::lrt_::datatype};
}

void describe_quantity(About& about, const rdf::Type& type, const rdf::Facets& facets) {
  const Quantity quantity = quantity_of(type, facets);
  if (!quantity.datatype.empty()) about.add(quantity.datatype_predicate, rdf::TermView(quantity.datatype));
  describe_unit(about, quantity.unit);
  if (!quantity.unit.quantity_kind.empty()) about.add(vocab::qudt::hasQuantityKind, rdf::TermView(quantity.unit.quantity_kind));
}

Iri frame_predicate(const rdf::Type& type) noexcept {
  if (type.kind == rdf::Type::Kind::optional) return frame_predicate(*type.element);
  for (const std::string& c : type.classes)
    if (c == vocab::spatial::SpatialRelationship.text) return vocab::spatial::sourceCoordinateSystem;
  return vocab::lrt_::frame;
}

}  // namespace v0
}  // namespace lrt::engine

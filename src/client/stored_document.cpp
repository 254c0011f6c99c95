// SPDX-License-Identifier: Apache-2.0
#include "src/client/stored_document.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <lrt/rdf/vocab.hpp>

#include "src/client/binding.hpp"
#include "src/client/representation.hpp"

namespace lrt::client {

using rdf::Graph;
using rdf::TermId;
using rdf::TermView;
using rdf::Triple;

namespace {

/// Whether a predicate leads from a node to the literal that is its value, by its local name: the paper names vom:numericalValue without the IRI of its
/// vocabulary.
bool is_value_predicate(std::string_view predicate) {
  const std::string_view name = local_name(predicate);
  return name == "numericalValue" || name == "numericValue" || name == "value" || name == "hasSimpleResult";
}

/// The only triple with the literal that is a node's value; nullptr: there is none, or there are several.
const Triple* value_triple(const Graph& graph, TermId node) {
  const Triple* found = nullptr;
  for (const Triple& t : graph.match(node, std::nullopt, std::nullopt)) {
    if (!is_value_predicate(graph.term(t.predicate).text)) continue;
    if (!graph.term(t.object).is_literal() || found) return nullptr;
    found = &t;
  }
  return found;
}

/// The blank nodes below an object that nothing else refers to.
void collect_orphans(const Graph& graph, TermId object, std::set<TermId>& orphans) {
  if (!graph.term(object).is_blank() || orphans.count(object) != 0) return;
  std::size_t references = 0;
  for (const Triple& t : graph.match(std::nullopt, std::nullopt, object)) references += orphans.count(t.subject) == 0 ? 1 : 0;
  if (references > 1) return;
  orphans.insert(object);
  for (const Triple& t : graph.match(object, std::nullopt, std::nullopt)) collect_orphans(graph, t.object, orphans);
}

}  // namespace

Graph with_value(const Graph& present, TermId node, const Graph& value, TermId focus) {
  const Triple* const old = value_triple(present, node);
  const Triple* const simple = value_triple(value, focus);
  const auto is_replaced = [&](const Triple& t) {
    if (t.subject != node) return false;
    if (old && simple) return &t == old || t == *old;
    const std::optional<TermId> predicate = value.find(present.term(t.predicate));
    const bool is_type = present.term(t.predicate).text == vocab::rdf_::type.text;
    return predicate && !is_type && !value.match(focus, predicate, std::nullopt).empty();
  };
  std::set<TermId> orphans;
  for (const Triple& t : present.triples())
    if (is_replaced(t)) collect_orphans(present, t.object, orphans);
  Graph result;
  const auto copy = [&](TermId id) { return result.intern(present.term(id)); };
  for (const Triple& t : present.triples()) {
    if (!is_replaced(t)) {
      if (orphans.count(t.subject) == 0) result.add(copy(t.subject), copy(t.predicate), copy(t.object));
      continue;
    }
    if (!old || !simple) continue;
    const TermView before = present.term(t.object), now = value.term(simple->object);
    const std::string same_datatype = before.datatype == now.datatype ? std::string(now.text) : number_as(now, before.datatype);
    rdf::Term literal(now);
    if (!same_datatype.empty()) literal = rdf::Term(rdf::literal(same_datatype, Iri(before.datatype)));
    result.add(copy(t.subject), copy(t.predicate), result.intern(literal.view()));
  }
  if (old && simple) return result;
  std::map<TermId, TermId> ids{{focus, result.intern(present.term(node))}};
  const auto add = [&](TermId id) {
    const auto [at, is_new] = ids.emplace(id, id);
    if (is_new) at->second = value.term(id).is_blank() ? result.fresh_blank() : result.intern(value.term(id));
    return at->second;
  };
  for (const Triple& t : value.triples()) result.add(add(t.subject), add(t.predicate), add(t.object));
  return result;
}

bool says_more(const Graph& present, TermId node) {
  const Triple* const value = value_triple(present, node);
  return std::any_of(present.triples().begin(), present.triples().end(), [&](const Triple& t) {
    const std::string_view predicate = present.term(t.predicate).text;
    const bool is_known = predicate == vocab::rdf_::type.text || predicate == vocab::vom::unit.text || predicate == vocab::qudt::hasUnit.text ||
                          predicate == vocab::qudt::unit.text;
    return t.subject != node || !(is_known || (value && t == *value));
  });
}

std::optional<Shape> present_shape(const Graph& present, TermId node) {
  const Triple* const triple = value_triple(present, node);
  if (!triple) return std::nullopt;
  const TermView literal = present.term(triple->object);
  Shape shape;
  Graph& graph = shape.graph;
  const TermId self = graph.fresh_blank();
  const bool is_number = !number_as(literal, vocab::xsd::double_.text).empty();
  const auto property = [&](Iri path, Iri constraint, const TermView& value) {
    const TermId made = graph.fresh_blank(), one = graph.intern(rdf::literal("1", vocab::xsd::integer));
    graph.add(self, graph.intern(vocab::sh::property), made);
    graph.add(made, graph.intern(vocab::sh::path), graph.intern(path));
    graph.add(made, graph.intern(constraint), graph.intern(value));
    graph.add(made, graph.intern(vocab::sh::minCount), one);
    graph.add(made, graph.intern(vocab::sh::maxCount), one);
  };
  graph.add(self, graph.intern(vocab::rdf_::type), graph.intern(vocab::sh::NodeShape));
  property(is_number ? vocab::vom::numericalValue : vocab::rdf_::value, vocab::sh::datatype, rdf::iri(literal.datatype));
  if (const std::optional<lrt::Unit> unit = stated_unit(present, node)) {
    if (!unit->qudt.empty()) property(vocab::qudt::hasUnit, vocab::sh::hasValue, rdf::iri(unit->qudt.text));
    if (!unit->vom.empty()) property(vocab::vom::unit, vocab::sh::hasValue, rdf::iri(unit->vom.text));
  }
  shape.node = rdf::Term(graph.term(self));
  return shape;
}

}  // namespace lrt::client

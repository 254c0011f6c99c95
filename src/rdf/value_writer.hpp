#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::rdf {

/// The triples that values are made of, whatever they were before (lrt/rdf/value_codec.hpp).
class ValueWriter {
 public:
  ValueWriter(Graph& graph, std::string_view names_base) : graph_(graph), names_base_(names_base) {}

  void number(TermId node, TermId literal, const Unit& unit);
  /// The object of a number in a field or list: the literal, or a node if there is a unit.
  TermId number(TermId literal, const Unit& unit);
  /// What else a focus node carries: rdf:value.
  void value(TermId focus, TermId object);
  void classes(TermId node, const Type& record);
  void field(TermId node, const FieldType& field, TermId object);
  void unit(TermId node, const Unit& unit);

 private:
  void add(TermId subject, Iri predicate, TermId object) { graph_.add(subject, graph_.intern(predicate), object); }

  Graph& graph_;
  std::string_view names_base_;
};

/// Of a scalar. In a text U+FFFD stands for U+0000 and for what is no UTF-8.
std::string lexical_form(const Type& type, const Value& value);

}  // namespace lrt::rdf

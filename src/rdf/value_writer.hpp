// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::rdf {
inline namespace v0 {

/// Writes the triples of values for all formats (lrt/rdf/value_codec.hpp).
class ValueWriter {
 public:
  ValueWriter(Graph& graph, std::string_view vocabulary) : graph_(graph), vocabulary_(vocabulary) {}

  void number(TermId node, TermId literal, const Unit& unit);
  /// The object of a number in a field or list: the literal, or a node if there is a unit.
  TermId number(TermId literal, const Unit& unit);
  /// The triple of other values at a focus node: rdf:value.
  void value(TermId focus, TermId object);
  /// The classes and the kind of quantity of a record.
  void classes(TermId node, const Type& record);
  /// The node that has the fields of a record: its own, or the one that Type::value_predicate leads to.
  TermId value_node(TermId node, const Type& record);
  void field(TermId node, const FieldType& field, TermId object);
  void unit(TermId node, const Unit& unit);
  /// The node of a map's member.
  TermId map_member(std::string_view name, TermId object);
  /// Says that an optional record is present although none of its fields is: `a rdfs:Resource`.
  void present(TermId focus);

 private:
  void add(TermId subject, Iri predicate, TermId object) { graph_.add(subject, graph_.intern(predicate), object); }

  Graph& graph_;
  std::string_view vocabulary_;
};

/// The lexical form of a scalar. In a text, invalid UTF-8 and U+0000 are replaced by U+FFFD.
std::string lexical_form(const Type& type, const Value& value);

}  // namespace v0
}  // namespace lrt::rdf

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::rdf {
inline namespace v0 {

/// The step to the value of a focus node or of a member of a map.
inline constexpr std::string_view value_step = "value";

/// Writes the triples of values for all formats (lrt/rdf/value_codec.hpp).
///
/// The nodes inside a value of a resource have names, because one value stands in several documents (SPEC 3.19): fragments of the focus node, such
/// as `limits#lower`, `path#points-2` for a cell of a list, and `path#points.2.x` in a member of it. In a value without a resource they are blank.
class ValueWriter {
 public:
  ValueWriter(Graph& graph, std::string_view vocabulary) : graph_(graph), vocabulary_(vocabulary) {}
  /// Names the nodes of a value at the focus node, if that has an IRI.
  ValueWriter(Graph& graph, std::string_view vocabulary, TermId focus);

  /// The writer is at a field, member or cell of the value while this exists.
  class Step {
   public:
    Step(ValueWriter& writer, std::string_view field);
    Step(ValueWriter& writer, std::size_t member) : Step(writer, std::string_view(std::to_string(member))) {}
    ~Step() { writer_.name_.resize(before_); }
    Step(const Step&) = delete;
    Step& operator=(const Step&) = delete;

   private:
    ValueWriter& writer_;
    std::size_t before_;
  };

  /// The node at the present step.
  TermId node() { return name_.empty() ? graph_.fresh_blank() : graph_.intern(iri(name_)); }
  /// The list at the present step.
  TermId list(const std::vector<TermId>& members);
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
  std::string name_;  ///< of the present node; empty: nodes are blank
};

/// Adds the triples of a value as the object of a field, a default for example, and returns that object.
/// @param name  of its node if it has one, and the beginning of the names of nodes inside; empty: they are blank
TermId write_object(Graph& graph, std::string_view name, const Type& type, const Facets& facets, const Value& value, std::string_view vocabulary);

/// The lexical form of a scalar. In a text, invalid UTF-8 and U+0000 are replaced by U+FFFD.
std::string lexical_form(const Type& type, const Value& value);

}  // namespace v0
}  // namespace lrt::rdf

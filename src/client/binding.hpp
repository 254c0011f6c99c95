// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/client/things.hpp>

namespace lrt::client {

/// The request that an Action, a writable Property or a container describes (paper 5.4, HTTP in RDF).
struct Binding {
  std::string method{};
  std::string url{};
  std::vector<std::pair<std::string, std::string>> fields{};  ///< without those that the connection sets
  std::optional<rdf::Term> shape{};                           ///< of the body
  std::vector<std::string> classes{};                         ///< of the body, at most 100
};

/// The bindings of the focus node, at most 100. What is ill-formed is left out.
LRT_INTERNAL_API std::vector<Binding> bindings_of(const Representation& representation);

/// Objects of a node that stand for a shape: IRIs, and blank nodes with triples.
std::vector<rdf::Term> shapes_of(const Representation& representation, Iri predicate);
/// The classes of the values that a shape describes: sh:class, and sh:targetClass.
std::vector<std::string> classes_of(const Shape& shape);
/// The classes that a value must have: sh:class of a shape and of its parts.
std::vector<std::string> required_classes(const Shape& shape);
/// Whether a shape is about links and times, which every Property has, and not about a value.
bool is_about_resources(const rdf::Graph& graph, rdf::TermId shape);
/// Whether a shape only says that a value is absent: its properties have sh:maxCount 0.
bool is_absence(const rdf::Graph& graph, rdf::TermId shape);
/// The unit that a shape requires; nullopt: none, or several.
std::optional<lrt::Unit> required_unit(const Shape& shape);
/// The unit with these IRIs: one of lrt's, or one that is kept for the life of the process. Servers cannot make that grow without end.
std::optional<lrt::Unit> unit_of(std::string_view qudt, std::string_view vom);
/// The unit that a node states; nullopt: none.
std::optional<lrt::Unit> stated_unit(const rdf::Graph& graph, rdf::TermId node);

/// The namespace of the terms that a type leaves to the server, "http://robot/ns/vocabulary": it is found by a term that the graph uses. Empty: the
/// graph uses none, or the type has none.
std::string vocabulary_of(const rdf::Type& type, const rdf::Graph& graph);

/// The value of a type at a node. Numbers may also be objects of rdf:value, qudt:numericValue, schema:value or sosa:hasSimpleResult.
Result<rdf::Value> value_at(const rdf::Graph& graph, rdf::TermId node, const rdf::Type& type, const lrt::Unit& unit);

/// The lexical form of a number in another datatype; empty: it is no number there, or another one.
std::string number_as(const rdf::TermView& literal, std::string_view datatype);

/// The graph with numbers of the datatype that the shape wants where another numeric datatype has the same value: 30 for a shape with xsd:double.
rdf::Graph with_datatypes_of(const Shape& shape, const rdf::Graph& graph);

/// Validates a graph against a shape. @par Errors  expected_value, with the report in one line
Result<void> conforms(const rdf::Graph& graph, rdf::TermId focus, const Shape& shape);

}  // namespace lrt::client

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::rdf {
inline namespace v0 {

/// Conversion between values and graphs.
///
/// At a focus node:
/// - a number is `a maths:Scalar; vom:numericalValue n` with its unit as vom:unit and qudt:hasUnit,
/// - another scalar or a list is the object of rdf:value,
/// - a record is its classes and fields, with one unit for all of them, or for the field that takes it.
///
/// As the object of a field a scalar is a literal (with a unit: a node as above), a list an rdf:List, a record a blank
/// node, a map an rdf:List of nodes `a schema:PropertyValue; schema:name "left"; schema:value 1`. An absent optional
/// has no triple. An optional record that is present without any field is `a rdfs:Resource` at the focus node.

/// Adds the triples of `value` to `graph` at `focus`.
/// @param vocabulary  namespace of the server's own terms, "http://robot/ns/vocabulary#"
/// @pre `value` is of that type
/// @par Threads  Any, one at a time for each graph.
/// @par Time     Linear in the value. Allocates.
LRT_API void write_value(Graph& graph, TermId focus, const Type& type, const Facets& facets, const Value& value, std::string_view vocabulary);

/// The IRI of a term: an absolute IRI itself, "#Type" and "#Type/name" in the vocabulary.
/// @par Threads  Any.
LRT_API std::string term_iri(std::string_view term, std::string_view vocabulary);

/// A difference between a graph and a type.
struct Mismatch {
  std::string path;     ///< property path from the focus node in Turtle, "vom:numericalValue"
  std::string message;  ///< "expected a number of at least 0 and below 360, found \"360\"^^xsd:float"
};

/// Reads the value at `focus`. Triples outside the type are ignored. A floating-point value may be given as xsd:float,
/// double, decimal or an integer. Bounds, datatypes, missing and repeated values and units are checked (SPEC 3.3).
/// @param mismatches  receives at most 16 mismatches
/// @return the value, if there is no mismatch
/// @par Errors   expected_value, out_of_range: the first mismatch as a sentence
/// @par Threads  Any, also many at once with one graph.
/// @par Time     Allocates.
LRT_API Result<Value> read_value(const Graph& graph, TermId focus, const Type& type, const Facets& facets, std::string_view vocabulary,
                                 std::vector<Mismatch>& mismatches);

/// Completes the graph of a body: adds what a client may leave out or write in another form, so that the graph conforms
/// to the derived shape if its values fit (SPEC 3.3):
/// - the node of a value that has no rdf:type, or one of the value's classes, has all of them;
/// - a number of another numeric datatype has the datatype of the C++ type, if that can hold it;
/// - a unit that is stated in one vocabulary is stated in the other one, too.
/// @return  the completed graph; nullopt: nothing is missing
/// @par Threads  Any, also many at once with one graph.
/// @par Time     Allocates.
LRT_API std::optional<Graph> completed(const Graph& graph, TermId focus, const Type& type, const Facets& facets, std::string_view vocabulary);

/// Whether a value that was not read from RDF (a C++ value, JSON) is within the facets.
/// @par Threads  Any.
/// @par Time     Linear in the value.
LRT_API bool within(const Type& type, const Facets& facets, const Value& value) noexcept;

/// The class of nodes with such a value: maths:Scalar for numbers, the first class of a record, otherwise empty.
/// @par Threads  Any.
LRT_API std::string target_class(const Type& type, std::string_view vocabulary);

/// An IRI with a default prefix, "vom:numericalValue", or else "<iri>".
/// @par Threads  Any.
/// @par Time     Linear in the number of default prefixes.
LRT_API std::string abbreviate(std::string_view iri);

}  // namespace v0
}  // namespace lrt::rdf

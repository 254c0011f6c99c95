#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>

namespace lrt::rdf {

/// Where values and graphs meet.
///
/// At a focus node a number is `a maths:Scalar; vom:numericalValue n` with its unit as vom:unit and qudt:unit; other scalars and lists
/// are the object of rdf:value; a record is its classes and fields, and its unit said once for all of them. As the object of a field, a scalar is a literal (or, with a unit,
/// a node as above), a list an rdf:List, a record a blank node, an absent optional no triple.

/// Adds the triples of `value` to `graph` at `focus`.
/// @param names_base  absolute IRI that "#name" predicates are resolved against
/// @pre `value` is of that type
void write_value(Graph& graph, TermId focus, const Type& type, const Facets& facets, const Value& value, std::string_view names_base);

/// The predicate of a field: its own, or "#name" resolved against the Blueprint that documents it.
std::string predicate_iri(const FieldType& field, std::string_view names_base);

/// One way in which a graph is not what a type asks for.
struct Mismatch {
  std::string path;     ///< the property path from the focus node in Turtle, "vom:numericalValue"
  std::string message;  ///< "expected a number of at least 0 and below 360, found \"360\"^^xsd:float"
};

/// Reads the value at `focus`. Triples that the type does not cover are ignored. Floating-point input may be xsd:float, double,
/// decimal or an integer, by value; bounds, datatypes, missing and repeated values, and units are checked (SPEC 3.3).
/// @param mismatches  receives what was found, at most 16
/// @return the value if there was none
/// @par Errors  expected_value, out_of_range: the first mismatch as a sentence
Result<Value> read_value(const Graph& graph, TermId focus, const Type& type, const Facets& facets, std::string_view names_base,
                         std::vector<Mismatch>& mismatches);

/// Checks a value that did not come as RDF (a C++ value, JSON) against facets.
bool within(const Type& type, const Facets& facets, const Value& value) noexcept;

/// The class that says a node carries such a value: maths:Scalar for numbers, the first class of a record, else empty.
Iri target_class(const Type& type) noexcept;

/// "vom:numericalValue" if a default prefix fits, else "<iri>".
std::string abbreviate(std::string_view iri);

}  // namespace lrt::rdf

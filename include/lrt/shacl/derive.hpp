#pragma once

#include <string_view>

#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>

namespace lrt::shacl {

/// Adds to a shape in `graph` the constraints that a node must satisfy to carry a value of a type: what rdf::write_value()
/// writes at a focus node conforms, and what rdf::read_value() refuses there does not (SPEC 3.3: Numbers, Units).
///
/// Numbers are judged by value: a floating-point type takes xsd:float, double, decimal and the integer types, an integer type
/// all integer types; both within what the C++ type holds, finite unless the facets say otherwise. A unit is said by vom:unit
/// or qudt:unit, at least one, and both only as declared. Lists are well-formed RDF lists of the right length. Bounds are
/// written as decimals where that is short, so that `below(360)` reads `sh:maxExclusive 360`.
///
/// At two edges the two differ. Durations are not bounded to what 64 bits of nanoseconds hold. Where a bound is no float (0.1)
/// the shape compares an xsd:float as a float, as XPath does, and read_value() as a double.
///
/// @param shape       an IRI or blank node of `graph`, which becomes a shape by this; rdf:type and targets are the caller's
/// @param names_base  absolute IRI that "#name" predicates are resolved against
/// @param required    false: the value may be missing, as with std::optional
///
/// @par Time        Allocates. Numbers of one graph share the list of datatypes that they may have.
/// @par Implements  R1.11
void derive(rdf::Graph& graph, rdf::TermId shape, const rdf::Type& type, const rdf::Facets& facets, std::string_view names_base,
            bool required = true);

}  // namespace lrt::shacl

#pragma once

#include <string_view>

#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>

namespace lrt::shacl {

/// Adds constraints for a value of a type to a shape in `graph`. A focus node written by rdf::write_value() conforms to the shape. A focus
/// node that rdf::read_value() refuses does not (SPEC 3.3: Numbers, Units).
///
/// Numbers are validated by value. A floating-point type accepts xsd:float, double, decimal and the integer types; an integer type accepts
/// all integer types. The value must be in the range of the C++ type and, by default, finite. A unit is given by vom:unit or qudt:hasUnit, at
/// least one, and each must be the declared unit. Lists must be well-formed RDF lists of the right length. Bounds are written as decimals
/// if these are short: `below(360)` becomes `sh:maxExclusive 360`.
///
/// The shape and read_value() differ in two cases. The shape does not limit durations to 64 bits of nanoseconds. If a bound is not
/// representable as float (0.1), the shape compares an xsd:float as float, as XPath does, and read_value() compares it as double.
///
/// @param shape       an IRI or blank node of `graph`; the caller adds rdf:type and targets
/// @param names_base  absolute IRI, the base of "#name" predicates
/// @param required    false: the value may be missing, as for std::optional
///
/// @par Time        Allocates. All numbers of a graph share one list of allowed datatypes.
/// @par Implements  R1.11
void derive(rdf::Graph& graph, rdf::TermId shape, const rdf::Type& type, const rdf::Facets& facets, std::string_view names_base,
            bool required = true);

}  // namespace lrt::shacl

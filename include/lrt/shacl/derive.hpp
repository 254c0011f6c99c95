// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>

namespace lrt::shacl {
inline namespace v0 {

/// The purpose of a derived shape.
struct DeriveOptions {
  bool required = true;  ///< false: the value may be missing, as for std::optional
  bool input = true;     ///< false: only the robot gives such values; the shape has no constraints that only clients could violate
  /// The shape is an IRI and stands in several documents: nodes inside have IRIs too, `<shape>.1`, so that the documents can be merged. Else they are
  /// blank.
  bool named = false;
};

/// Adds constraints for a value of a type to a shape in `graph`. A focus node written by rdf::write_value() conforms to
/// the shape. A focus node that rdf::read_value() refuses does not, if rdf::completed() has completed it (SPEC 3.3:
/// Numbers, Units).
///
/// A number has the datatype of its C++ type; rdf::completed() converts numbers of other datatypes to it, and
/// sh:datatype checks its range. It has the bounds of the facets, as decimals if these are short: `below(360)` becomes
/// `sh:maxExclusive 360`. An input without two bounds has a pattern that excludes NaN and infinities, unless these are
/// allowed. Nodes have their classes, and the unit in the first vocabulary that has it. Lists must be well-formed RDF
/// lists of the right length.
///
/// The shape and read_value() differ in three cases. The shape does not limit durations to 64 bits of nanoseconds. A
/// number whose text is beyond its datatype (1e400) conforms, and read_value() refuses it. If a bound cannot be
/// represented as float (0.1), the shape compares an xsd:float as float, as XPath does, and read_value() compares it as
/// double.
///
/// @param shape       an IRI or blank node of `graph`; the caller adds rdf:type and targets
/// @param vocabulary  namespace of the server's own terms, "http://robot/ns/vocabulary#"
///
/// @par Threads     Any, one at a time for each graph.
/// @par Time        Allocates.
/// @par Implements  R1.11
LRT_API void derive(rdf::Graph& graph, rdf::TermId shape, const rdf::Type& type, const rdf::Facets& facets, std::string_view vocabulary,
                    const DeriveOptions& options = {});

/// Adds constraints to a shape: the focus node has no value of the type. What else is said of it does not matter.
///
/// @par Threads  Any, one at a time for each graph.
/// @par Time     Allocates.
LRT_API void derive_absence(rdf::Graph& graph, rdf::TermId shape, const rdf::Type& type, std::string_view vocabulary);

}  // namespace v0
}  // namespace lrt::shacl

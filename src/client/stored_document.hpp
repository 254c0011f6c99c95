// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <lrt/client/representation.hpp>
#include <lrt/client/things.hpp>
#include <lrt/rdf/graph.hpp>

namespace lrt::client {

/// A server that publishes neither a binding nor a shape for a resource may store whatever a PUT brings, as Solid servers do. Then the present document
/// with the new value in it is sent, so that the other statements stay.
///
/// A number or a text replaces the literal that the node has for its value, in the datatype that this one has, whatever its predicate is (vom:numericalValue,
/// rdf:value, qudt:numericValue, schema:value, sosa:hasSimpleResult, or one of such a local name in another vocabulary). Anything else replaces the statements with the predicates of the new value, with
/// the blank nodes that only they used.
/// @param present  the document
/// @param node     of the value in it
/// @param value    the new value, at `focus`
rdf::Graph with_value(const rdf::Graph& present, rdf::TermId node, const rdf::Graph& value, rdf::TermId focus);

/// Whether a document says more than the value of a node, its unit and its types.
bool says_more(const rdf::Graph& present, rdf::TermId node);

/// The shape that the present value of a node has: one literal of its datatype, with its unit. nullopt: it has no simple value.
std::optional<Shape> present_shape(const rdf::Graph& present, rdf::TermId node);

}  // namespace lrt::client

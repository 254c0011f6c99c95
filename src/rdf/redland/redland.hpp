// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <lrt/rdf/codec.hpp>

/// RDF/XML by Redland's Raptor. Only redland.cpp includes its headers, and a build may leave this directory out (LRT_REDLAND).
namespace lrt::rdf::redland {

/// Loads Raptor and opens a world, so that the first document does not wait for that.
void prepare() noexcept;

/// Parses RDF/XML in a Raptor world of its own.
/// @pre         `text` has passed scan_rdf_xml()
/// @par Errors  expected_rdf, with the line if Raptor reports one; limit_exceeded.
Result<Graph> parse_rdf_xml(std::string_view text, const ReadOptions& options);

/// Serialises to RDF/XML with exactly the prefixes given. The caller judges the graph before and the text after.
/// @param nested  blank nodes inside their triples and types as elements, recursively; else one element for each triple.
Result<std::string> serialize_rdf_xml(const Graph& graph, const Prefixes& prefixes, bool nested);

}  // namespace lrt::rdf::redland

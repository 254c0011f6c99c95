#pragma once

#include <lrt/rdf/codec.hpp>

/// What Redland's Raptor does for lrt. Only redland.cpp includes its headers.
namespace lrt::rdf::redland {

/// Parses with a world of its own. `text` has passed the scanner of its syntax.
/// @par Errors  expected_rdf with the line if Raptor tells one; limit_exceeded.
Result<Graph> parse(std::string_view text, Syntax syntax, const ReadOptions& options);

/// Serialises to RDF/XML with exactly the prefixes given. The caller judges the graph before and the text after.
/// @param nested  blank nodes inside their triples and types as elements, recursively; else one element for each triple.
Result<std::string> serialize_rdf_xml(const Graph& graph, const Prefixes& prefixes, bool nested);

}  // namespace lrt::rdf::redland

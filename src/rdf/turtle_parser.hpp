// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string_view>

#include <lrt/base/result.hpp>
#include <lrt/rdf/codec.hpp>

namespace lrt::rdf {

/// Brackets and parentheses nested deeper than this are refused. This parser does not recurse, but many readers of the graph do.
inline constexpr std::size_t max_brackets = 1000;

/// More prefix and base directives in a Turtle document are refused: each of a few bytes may stand for an IRI of max_iri bytes
/// that has to be stored and parsed.
inline constexpr std::size_t max_directives = 1000;

/// Parses a Turtle document into a graph, in one pass, without recursion.
///
/// Triples come in the order of the document; the triple that leads to a node in brackets or to a list comes before the triples
/// about it. Blank nodes are named b0, b1, ... in order of appearance. Literals may have U+0000, as the grammar says.
///
/// @param options   base: an absolute IRI, or empty: then relative IRIs are refused.
/// @par Errors      expected_rdf and limit_exceeded, with offset, line and column.
/// @par Implements  RDF 1.1 Turtle 6 and 7; RFC 3986 5.2
Result<Graph> read_turtle(std::string_view text, const ReadOptions& options);

/// Parses an N-Triples document: one triple a line, absolute IRIs only.
/// @par Errors      expected_rdf and limit_exceeded, with offset, line and column.
/// @par Implements  RDF 1.1 N-Triples 7
Result<Graph> read_n_triples(std::string_view text, const ReadOptions& options);

/// Parse documents with named graphs. The parsers are those of Turtle and N-Triples.
/// @par Errors      as theirs; expected_rdf: a graph whose name is a blank node
/// @par Implements  RDF 1.1 TriG 3 to 5; RDF 1.1 N-Quads 6
Result<Dataset> read_trig(std::string_view text, const ReadOptions& options);
Result<Dataset> read_n_quads(std::string_view text, const ReadOptions& options);

/// read_n_triples() for a document that lrt wrote, maybe in an earlier release. These could have literals of rdf:langString without a language, which
/// are no literals of RDF: they are read as strings.
Result<Graph> read_kept_n_triples(std::string_view text, const ReadOptions& options);

}  // namespace lrt::rdf

#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <lrt/base/result.hpp>
#include <lrt/rdf/codec.hpp>

namespace lrt::rdf {

/// Brackets and parentheses nested deeper than this are refused.
inline constexpr std::size_t max_brackets = 1000;

/// Longer language tags are refused: Raptor 2.0.15 keeps the length in a byte, and reads beyond the tag when it does not fit.
inline constexpr std::size_t max_language_tag = 255;

/// Longer IRIs are refused, relative ones when they are resolved, prefixed ones when they are expanded; in RDF/XML also
/// namespace names and bases. Time and memory of a document would else grow with its square.
inline constexpr std::size_t max_iri = 8192;

/// An IRI that is resolved against a base of more bytes counts five times to ReadOptions::max_bytes, or more.
inline constexpr std::size_t long_base = 256;

/// More prefix and base directives in a Turtle document are refused: Raptor looks a prefix up in a list of them all.
inline constexpr std::size_t max_directives = 1000;

/// Stands before a '.' that begins a path segment of an IRI in scanned text: Raptor takes dot segments out of absolute IRIs
/// too, where Turtle 6.3 resolves only relative ones. U+F8FF is for private use, which no IRI has (RFC 3987 2.2), so it can be
/// removed again from what Raptor reports.
inline constexpr std::string_view dot_guard = "\xEF\xA3\xBF";

/// Judges a Turtle document: UTF-8, U+0000, escapes, characters of IRIs, undeclared prefixes, nesting, and the grammar, because
/// Raptor leaks what it has of a statement when it finds an error, and says the line at most. Makes every IRI absolute.
///
/// @param options   base: an absolute IRI, or empty: then relative IRIs are refused. The limits are judged here.
/// @param storage   receives the text if it had to be changed; lines stay where they are.
/// @return          the text to give to Raptor: `text` itself or a view of `storage`.
///
/// @par Errors      expected_rdf and limit_exceeded, with offset, line and column.
/// @par Implements  RDF 1.1 Turtle 6.3, 6.4, 6.5; RFC 3986 5.2
Result<std::string_view> scan_turtle(std::string_view text, const ReadOptions& options, std::string& storage);

/// Judges an N-Triples document completely (RDF 1.1 N-Triples 7).
/// @par Errors  expected_rdf, or limit_exceeded for an IRI, with offset, line and column.
Result<void> scan_n_triples(std::string_view text);

/// The error of a place in a text: counts line and column and puts them before the sentence.
Unexpected misread(std::string_view text, std::size_t offset, const std::string& sentence, Errc code = Errc::expected_rdf);

}  // namespace lrt::rdf

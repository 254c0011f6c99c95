#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <lrt/base/result.hpp>

namespace lrt::rdf {

/// Brackets and parentheses nested deeper than this are refused.
inline constexpr std::size_t max_brackets = 1000;

/// Longer language tags are refused: Raptor 2.0.15 keeps the length in a byte, and reads beyond the tag when it does not fit.
inline constexpr std::size_t max_language_tag = 255;

/// Stands before a '.' that begins a path segment of an IRI in scanned text: Raptor takes dot segments out of absolute IRIs
/// too, where Turtle 6.3 resolves only relative ones. U+F8FF is for private use, which no IRI has (RFC 3987 2.2), so it can be
/// removed again from what Raptor reports.
inline constexpr std::string_view dot_guard = "\xEF\xA3\xBF";

/// Judges a Turtle document: UTF-8, U+0000, escapes, characters of IRIs, undeclared prefixes, nesting, and the grammar, because
/// Raptor leaks what it has of a statement when it finds an error, and says the line at most. Makes every IRI absolute.
///
/// @param base      an absolute IRI, or empty: then relative IRIs are refused.
/// @param storage   receives the text if it had to be changed; lines stay where they are.
/// @return          the text to give to Raptor: `text` itself or a view of `storage`.
///
/// @par Errors      expected_rdf with offset, line and column.
/// @par Implements  RDF 1.1 Turtle 6.3, 6.4, 6.5; RFC 3986 5.2
Result<std::string_view> scan_turtle(std::string_view text, std::string_view base, std::string& storage);

/// Judges an N-Triples document completely (RDF 1.1 N-Triples 7).
/// @par Errors  expected_rdf with offset, line and column.
Result<void> scan_n_triples(std::string_view text);

/// The error of a place in a text: counts line and column and puts them before the sentence.
Unexpected misread(std::string_view text, std::size_t offset, const std::string& sentence);

}  // namespace lrt::rdf

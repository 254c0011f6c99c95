// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>

/// The fixed limits that the readers of several syntaxes share, and how a reader reports a place.
namespace lrt::rdf {

/// Longer IRIs are refused, relative ones after they are resolved, prefixed ones after they are expanded; in RDF/XML also
/// namespace names and bases. Otherwise time and memory of a document could grow with the square of its size.
inline constexpr std::size_t max_iri = 8192;

/// Longer language tags are refused in every syntax: Raptor 2.0.15 keeps the length in one byte, and what was read in one syntax
/// must be writable in the others.
inline constexpr std::size_t max_language_tag = 255;

/// Resolving against a base of more bytes counts more than its result to ReadOptions::max_bytes where it takes more time.
inline constexpr std::size_t long_base = 256;

/// The error of a place in a text: counts line and column and puts them before the sentence.
LRT_INTERNAL_API Unexpected misread(std::string_view text, std::size_t offset, const std::string& sentence, Errc code = Errc::expected_rdf);

}  // namespace lrt::rdf

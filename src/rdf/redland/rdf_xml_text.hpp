// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <lrt/base/result.hpp>
#include <lrt/rdf/codec.hpp>

namespace lrt::rdf {

/// More declarations of entities are refused.
inline constexpr std::size_t max_entities = 1000;
/// References to entities in entities deeper than this are refused.
inline constexpr std::size_t max_entity_depth = 32;
/// With its entities written out, a document has at most this number of bytes and ten times those that it had, and at most
/// ReadOptions::max_bytes. Each reference counts as 32 bytes, too, so that empty entities end.
inline constexpr std::size_t entity_bytes = 128 * 1024, entity_growth = 10, reference_bytes = 32;

/// An RDF/XML document in UTF-8, without a document type declaration and with its own entities written out.
///
/// The encoding is UTF-8, UTF-16 with a byte order mark or with "<" as its first character, or US-ASCII or ISO-8859-1 if the XML declaration says
/// so. Of the document type, general entities with their text are read; element types and notations are left out, and so is a document type
/// from elsewhere: nothing is ever loaded. Refused are entities from elsewhere, parameter entities and default values of attributes. Lines stay
/// where they are, unless the text of an entity has several.
/// @param storage  holds the result if that is not `text` itself
/// @par Errors     expected_rdf and limit_exceeded, with offset, line and column
Result<std::string_view> plain_rdf_xml(std::string_view text, const ReadOptions& options, std::string& storage);

}  // namespace lrt::rdf

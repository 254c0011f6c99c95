// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include <lrt/base/result.hpp>
#include <lrt/rdf/codec.hpp>

namespace lrt::rdf {

/// Elements nested deeper than this are refused: Raptor walks up all of them for each.
inline constexpr std::size_t max_elements_deep = 256;
/// More attributes on one element are refused, namespace declarations among them: libxml2 compares each with each.
inline constexpr std::size_t max_attributes = 256;
/// More namespace declarations in a document are refused.
inline constexpr std::size_t max_namespaces = 1000;
/// The number of elements allowed per triple of the limit: elements of an XML literal yield no triple, but take the same time.
inline constexpr std::size_t elements_per_triple = 3;
/// A base (xml:base) with more "." and ".." segments is refused: Raptor resolves them anew for each IRI.
inline constexpr std::size_t max_base_dots = 32;

/// Checks what plain_rdf_xml() has made of an RDF/XML document before libxml2 and Raptor read it: UTF-8 only, no document type declaration (so no entities, of
/// its own or from elsewhere), no language tag that Raptor reads beyond its end, tags well-formed, and the limits above. Those
/// of IRIs and of bytes hold here for namespace names, for the attributes base, about, resource and datatype, and for names:
/// what a namespace of more than 256 bytes adds to a name counts to ReadOptions::max_bytes.
/// @par Errors  expected_rdf and limit_exceeded, with offset, line and column.
Result<void> scan_rdf_xml(std::string_view text, const ReadOptions& options);

}  // namespace lrt::rdf

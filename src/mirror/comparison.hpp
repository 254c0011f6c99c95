// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <lrt/base/result.hpp>
#include <lrt/rdf/graph.hpp>

namespace lrt::mirror {

/// A SHA-256 of a graph that depends neither on the order of its triples nor on the labels of its blank nodes. Equal graphs have equal ones; different
/// graphs have different ones, unless they differ only in how blank nodes that all look alike are connected.
/// @par Errors  failed: no SHA-256
/// @par Time    n log n in the triples; at most 32 times the triples with blank nodes
Result<std::string> fingerprint(const rdf::Graph& graph);

/// The same without the values of literals: what a store keeps that writes "0" as "0.0".
Result<std::string> outline_of(const rdf::Graph& graph);

/// What a store responds for a graph.
struct Echo {
  std::string fingerprint{};          ///< never empty. Of a text that lrt does not read as RDF: of its lines
  std::optional<rdf::Graph> graph{};  ///< nullopt: it is not RDF that lrt reads
};
/// @param media_type  without parameters
/// @param base        URL of the request
/// @par Errors  failed
Result<Echo> echo_of(std::string_view text, std::string_view media_type, const std::string& base);

}  // namespace lrt::mirror

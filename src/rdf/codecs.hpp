// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <lrt/rdf/codec.hpp>

/// The codecs of rdf::read and rdf::write.
namespace lrt::rdf {
inline namespace v0 {

Result<std::string> write_turtle(const Graph& graph, const Prefixes& prefixes);
Result<std::string> write_n_triples(const Graph& graph);
Result<std::string> write_trig(const Dataset& dataset, const Prefixes& prefixes);
Result<std::string> write_n_quads(const Dataset& dataset);

/// Whether this build has JSON-LD: json_ld/ defines these functions, json_ld_context() and Contexts::add(), or else without_json_ld/.
bool has_json_ld() noexcept;
Result<std::string> write_json_ld(const Graph& graph, const Prefixes& prefixes, std::string_view context);
Result<Graph> read_json_ld(std::string_view text, const ReadOptions& options);
Result<Dataset> read_json_ld_dataset(std::string_view text, const ReadOptions& options);

/// Whether this build has RDF/XML: redland/ defines these four functions, or else without_redland/.
bool has_rdf_xml() noexcept;
/// Loads the library for RDF/XML in advance, so that the first document need not wait for it.
void prepare_rdf_xml() noexcept;
Result<Graph> read_rdf_xml(std::string_view text, const ReadOptions& options);
/// @par Errors  unsupported_syntax also when what Raptor wrote does not read back as the same graph.
Result<std::string> write_rdf_xml(const Graph& graph, const Prefixes& prefixes);

/// "cannot write <the term>: expected ...".
Unexpected unwritable(const TermView& term, std::string_view why);

}  // namespace v0
}  // namespace lrt::rdf

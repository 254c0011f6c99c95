// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/client/options.hpp>
#include <lrt/client/representation.hpp>

namespace lrt::client {
inline namespace v0 {

/// Reads the representation of a response. A number, a text, true or false in JSON or text/plain becomes the rdf:value of the resource, for a server that
/// has no RDF.
Result<RepresentationPtr> read_representation(const Response& response, const Options& options);
/// The header fields of a response alone: the links of a resource whose representation is no RDF. The graph is empty, and the resource is its focus.
RepresentationPtr outline_of(const Response& response);
/// A graph with one literal as the value of `focus`, in JSON or text/plain. nullopt: it is another value, or another media type.
std::optional<std::string> plain_text_of(const rdf::Graph& graph, rdf::TermId focus, std::string_view media_type);

/// Adds the triples of `other`, whose blank nodes stay apart, but not those of subjects that `skip` names. It is asked before the first is added.
LRT_INTERNAL_API void add_apart(rdf::Graph& graph, const rdf::Graph& other, const std::function<bool(const rdf::TermView& subject)>& skip);

/// Whether two URLs have scheme, host and port in common.
LRT_INTERNAL_API bool same_origin(std::string_view a, std::string_view b);
/// The IRI without its fragment.
LRT_INTERNAL_API std::string_view document_of(std::string_view iri) noexcept;
/// The text after the last '#' or '/'. A slash at the end of a path is ignored.
std::string_view local_name(std::string_view iri) noexcept;

}  // namespace v0
}  // namespace lrt::client

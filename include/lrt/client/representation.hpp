// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/iri.hpp>
#include <lrt/client/http.hpp>
#include <lrt/rdf/graph.hpp>

namespace lrt::client {
inline namespace v0 {

/// The response of a server for a resource: its graph and its header fields. Immutable.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
struct LRT_API Representation {
  std::string url{};                   ///< URL of the resource, after redirects
  std::string media_type{};            ///< without parameters
  std::string entity_tag{};            ///< with its quotes; empty: none
  std::vector<std::string> methods{};  ///< of Allow; empty: not stated
  std::vector<Link> links{};           ///< of the Link fields
  rdf::Graph graph{};                  ///< the parsed body
  std::optional<rdf::TermId> focus{};  ///< the node in the graph that the representation is about, see find_focus()

  bool allows(std::string_view method) const noexcept;  ///< whether Allow contains the method
  /// Targets of the links with a relation.
  std::vector<std::string> targets(std::string_view relation) const;
  /// IRIs that are objects of the focus node for a predicate.
  std::vector<std::string> objects(Iri predicate) const;
  /// The types of the focus node.
  std::vector<std::string> types() const;
};
/// A shared, immutable representation.
using RepresentationPtr = std::shared_ptr<const Representation>;

/// Finds the node that a representation of `url` is about: the IRI itself; else the only IRI that differs from it only
/// in the fragment; else the only subject that is not an object. nullopt: none or several.
/// @par Threads  Any.
LRT_API std::optional<rdf::TermId> find_focus(const rdf::Graph& graph, std::string_view url);

}  // namespace v0
}  // namespace lrt::client

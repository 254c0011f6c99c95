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

/// What a server has responded about a resource: its graph, and what the header section says. Immutable.
struct LRT_API Representation {
  std::string url{};  ///< after redirects
  std::string media_type{};
  std::string entity_tag{};            ///< with its quotes; empty: the server gives none
  std::vector<std::string> methods{};  ///< of Allow; empty: not stated
  std::vector<Link> links{};
  rdf::Graph graph{};
  std::optional<rdf::TermId> focus{};  ///< the node in the graph that the representation is about, see find_focus()

  bool allows(std::string_view method) const noexcept;
  /// Targets of the links with a relation.
  std::vector<std::string> targets(std::string_view relation) const;
  /// IRIs that are objects of the focus node.
  std::vector<std::string> objects(Iri predicate) const;
  /// The types of the focus node.
  std::vector<std::string> types() const;
};
using RepresentationPtr = std::shared_ptr<const Representation>;

/// Finds the node that the representation of `url` is about: the IRI itself; else the only IRI with the same URL before its fragment; else the only
/// subject that is no object. nullopt: none or several.
LRT_API std::optional<rdf::TermId> find_focus(const rdf::Graph& graph, std::string_view url);

}  // namespace v0
}  // namespace lrt::client

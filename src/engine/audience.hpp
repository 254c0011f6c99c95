// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <lrt/rdf/graph.hpp>
#include <lrt/security.hpp>

#include "src/base/function_ref.hpp"
#include "src/security/policy.hpp"

namespace lrt::engine {
inline namespace v0 {

class Registry;
class Resource;
struct Methods;

/// The reader of a representation or response, with its rights. The default has all rights.
struct Audience {
  std::shared_ptr<const security::View> view{};            ///< nullptr: everything
  std::shared_ptr<const security::Principal> principal{};  ///< nullptr: no specific principal

  bool is_restricted() const noexcept { return view != nullptr; }
  /// There may be a resource that it may not read.
  bool hides_something() const noexcept { return view && !view->reads_everything(); }
  /// Its rights at a resource. The server's own documents, such as the list of Things and the Blueprints, may be read by all who may read anything;
  /// what the reader may not see is left out of them.
  security::Rights rights(const Resource& resource) const;
  bool sees(const Resource& resource) const { return !view || rights(resource).has(security::Right::read); }
  bool may(security::Right right, const Resource& resource) const { return !view || rights(resource).has(right); }
  /// Whether both have the same rights at each path. The policy may have been loaded again since one of them was made.
  bool has_rights_of(const Audience& other) const noexcept {
    return view == other.view || (view && other.view && view->grants_the_same_as(*other.view));
  }
  /// It may read at least one resource.
  bool sees_something() const noexcept { return !view || view->anywhere().has(security::Right::read); }
  /// The methods of a resource that it may use.
  Methods methods(const Resource& resource) const;
  /// Whether the audience may see an IRI: a resource that it may read, with or without query and fragment, or an IRI of another server.
  bool sees_iri(std::string_view iri, const std::string& base, const Registry& registry) const;
  /// The name of the principal if a representation of the resource depends on it, else empty.
  std::string_view name_in(const Resource& resource) const noexcept;
};

/// Keeps the triples whose IRIs are all visible. Blank nodes, also those with names (named_blank.hpp), to which only hidden triples lead are removed, and what follows from them.
rdf::Graph visible_part(const rdf::Graph& all, FunctionRef<bool(std::string_view iri)> is_shown);
/// Whether visible_part() leaves something out.
bool has_hidden_part(const rdf::Graph& all, FunctionRef<bool(std::string_view iri)> is_shown);

}  // namespace v0
}  // namespace lrt::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

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
  /// Whether the audience may see an IRI: a resource that it may read, with or without query, or an IRI of another server. A fragment that stands for
  /// another resource, such as the shape of its values, is judged as that one.
  bool sees_iri(std::string_view iri, const std::string& base, const Registry& registry) const;
  /// The rule for names that clients choose (0077): whether it may make a resource at a path. It needs the right to write there, and to read there and at
  /// each path between. Where it may not read, each name gets the response of a path without a resource, whether something is there or not.
  /// @param below  the path of the resource below which the name is chosen: "/world"
  bool may_choose_name(std::string_view path, std::string_view below) const;
  /// The name of the principal if a representation of the resource depends on it, else empty.
  std::string_view name_in(const Resource& resource) const noexcept;
};

/// Ranges of the triples of a graph that are the words of a user: the content of a graph, a value. Who may read the resource reads them all, whatever
/// they name, so that nobody finds out by writing an IRI and reading it again whether something hidden has it.
using UserWords = std::vector<std::pair<std::size_t, std::size_t>>;

/// Keeps the triples whose IRIs are all visible, and the words of users. Blank nodes, also those with names (named_blank.hpp), to which only hidden triples
/// lead are removed, and what follows from them.
rdf::Graph visible_part(const rdf::Graph& all, FunctionRef<bool(std::string_view iri)> is_shown, const UserWords& words = {});

}  // namespace v0
}  // namespace lrt::engine

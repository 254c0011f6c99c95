// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <redland.h>

#include <lrt/rdf/term.hpp>

namespace lrt::redland {

/// @{
/// Owners of what librdf has made.
struct Free {
  void operator()(librdf_node* node) const noexcept { librdf_free_node(node); }
  void operator()(librdf_statement* statement) const noexcept { librdf_free_statement(statement); }
  void operator()(librdf_stream* stream) const noexcept { librdf_free_stream(stream); }
  void operator()(librdf_uri* uri) const noexcept { librdf_free_uri(uri); }
};
using NodePointer = std::unique_ptr<librdf_node, Free>;
using StatementPointer = std::unique_ptr<librdf_statement, Free>;
using StreamPointer = std::unique_ptr<librdf_stream, Free>;
using UriPointer = std::unique_ptr<librdf_uri, Free>;
/// @}

/// A term of a node as views of it, valid while nobody changes the node. A language tag that is not in lower case is in `text`.
/// @param fault  gets why RDF 1.1 does not have it, if it does not
std::optional<rdf::TermView> view_of(librdf_node* node, std::string& text, std::string& fault);

/// Blank nodes of a model and their labels in a graph. Identifiers that are labels stay as they are, except those that begin as the labels that are made
/// here: so none of these is that of another blank node, whichever comes first.
class Labels {
 public:
  /// The label of an identifier. The view is valid until the next call.
  std::string_view label_of(std::string_view id);
  /// The identifier of a label.
  std::string_view id_of(std::string_view label) const {
    const auto known = by_label_.find(std::string(label));
    return known == by_label_.end() ? label : std::string_view(known->second);
  }
  /// Nothing is shown any more.
  void clear() noexcept {
    by_id_.clear();
    by_label_.clear();
  }
  /// A blank node has this label from now on. One that had it before has none any more.
  std::string_view bind(std::string id, std::string label);
  /// Forgets labels.
  /// @param is_used  callable of a label
  template <class IsUsed>
  void keep(IsUsed is_used) {
    for (auto at = by_label_.begin(); at != by_label_.end();) {
      if (is_used(at->first)) {
        ++at;
        continue;
      }
      by_id_.erase(at->second);
      at = by_label_.erase(at);
    }
  }
  std::size_t size() const noexcept { return by_label_.size(); }

 private:
  std::unordered_map<std::string, std::string> by_id_, by_label_;  // to the other
  std::uint64_t next_ = 0;
};

/// An identifier that the world gives to no other blank node.
std::string new_identifier(librdf_world* world);

}  // namespace lrt::redland

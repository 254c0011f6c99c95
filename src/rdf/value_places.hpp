// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/type.hpp>
#include <lrt/rdf/value.hpp>
#include <lrt/rdf/value_codec.hpp>

namespace lrt::rdf {

/// One step of a reader from a node to what belongs to it.
struct ValueStep {
  static constexpr std::size_t none = static_cast<std::size_t>(-1);

  TermId subject;                         ///< the head of a list for its members
  std::string_view predicate{};           ///< a term of term_iri(); empty: the member of a list
  std::optional<TermId> object{};         ///< nullopt: it is missing
  const Type* record = nullptr;           ///< whose field it is
  std::size_t member = none;              ///< of the record or list
  std::optional<std::string_view> key{};  ///< of a map's member
  std::size_t outer = none;               ///< the step before
  bool is_mismatch = false;               ///< what was found does not fit the type
};

/// Where the nodes of a graph would be in the JSON of its value: JSON Pointers (RFC 6901) for what a shape says about nodes and predicates.
///
/// @par Threads  Distinct objects: any thread. One object: any number of reading threads.
class ValuePlaces {
 public:
  /// Reads the whole graph at `focus`, also what does not fit the type. Graph, type and vocabulary outlive this object.
  ValuePlaces(const Graph& graph, TermId focus, const Type& type, const Facets& facets, std::string_view vocabulary);

  /// The place of the value of `predicate` at `node`, or of the member `value` of the list `node`, else of the node itself. "": it is the whole
  /// value, or no part of it. A node that two fields share has the place where it does not fit, else the first.
  std::string pointer(const TermView& node, const std::optional<TermView>& predicate, const std::optional<TermView>& value) const;

 private:
  const Graph& graph_;
  std::string_view vocabulary_;
  std::vector<ValueStep> steps_;
};

/// As the public read_value(), with the JSON Pointer of each mismatch.
struct PlacedMismatch {
  Mismatch mismatch;
  std::string pointer;
};
Result<Value> read_value(const Graph& graph, TermId focus, const Type& type, const Facets& facets, std::string_view vocabulary,
                         std::vector<PlacedMismatch>& mismatches);

}  // namespace lrt::rdf

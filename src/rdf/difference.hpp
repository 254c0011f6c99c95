// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/rdf/graph.hpp>

namespace lrt::rdf {
inline namespace v0 {

/// The triples by which two graphs differ.
struct Difference {
  std::vector<Triple> removed;  ///< of the graph before, by its numbers, in its order
  std::vector<Triple> added;    ///< of the graph after, by its numbers, in its order
  bool empty() const noexcept { return removed.empty() && added.empty(); }
};

/// The difference of two versions of a large graph of a World that share their structure; nullopt: they share none. Terms are equal by value, blank nodes
/// by label.
/// @par Time  Proportional to what was changed between them.
LRT_INTERNAL_API std::optional<Difference> shared_difference(const Graph& before, const Graph& after);

/// The difference of two graphs, blank nodes by label.
/// @par Time  As shared_difference(), or proportional to both graphs.
LRT_INTERNAL_API Difference difference(const Graph& before, const Graph& after);

}  // namespace v0
}  // namespace lrt::rdf

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <lrt/rdf/graph.hpp>

namespace lrt::mirror {

/// What a mirror itself keeps in a store, in the graph `<ROBOT#mirror>`. It is in the store so that it is lost, copied and restored with the graphs that it
/// lists: a mirror without a state file, and one to a store that was restored from an older copy, find by it what the robot no longer has.
///
///     <ROBOT#mirror> dcterms:hasPart <ROBOT/arm>, <ROBOT/arm/angle> .
///     <ROBOT> lrt:unreachableSince "2026-11-29T04:28:42Z"^^xsd:dateTime .
struct Mark {
  std::vector<std::string> graphs{};  ///< names of graphs, sorted
  std::string since{};                ///< xsd:dateTime since when the robot cannot be read; empty: it can be

  /// @param robot  its URL
  /// @param name   of the graph
  rdf::Graph graph(const std::string& robot, const std::string& name) const;
};

/// The mark that a graph is. Names on other origins than the robot's are left out: whoever can write to the store could have added them.
/// @param max_graphs  names beyond are left out
Mark mark_of(const rdf::Graph& graph, const std::string& robot, const std::string& name, std::size_t max_graphs);

}  // namespace lrt::mirror

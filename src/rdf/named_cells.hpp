// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <lrt/rdf/graph.hpp>

namespace lrt::rdf {

/// The cells of a list that stands in several documents, `name-0`, `name-1` ... (SPEC 3.19), for Graph::add_list().
inline std::vector<TermId> named_cells(Graph& graph, std::string name, std::size_t count) {
  name += '-';
  const std::size_t stem = name.size();
  std::vector<TermId> cells;
  for (std::size_t i = 0; i < count; ++i) {
    name.resize(stem);
    name += std::to_string(i);
    cells.push_back(graph.intern(iri(name)));
  }
  return cells;
}

}  // namespace lrt::rdf

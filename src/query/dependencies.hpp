// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "src/query/algebra.hpp"

namespace lrt::query {

/// The changes that can change the answer to a query. A changed triple does so only if `everything` is set or its predicate is listed, and if
/// its graph is listed or no graph is.
struct Dependencies {
  bool everything = false;              ///< any predicate: a variable as predicate, a negated path, DESCRIBE; and added or removed graphs
  std::vector<std::string> predicates;  ///< each once, sorted
  std::vector<std::string> graphs;      ///< each once, sorted; empty: any graph
  std::vector<std::string> types;       ///< of triples with rdf:type: only these classes, each once, sorted; empty: any class
  bool uses_now_or_random = false;      ///< the answer can differ without a change: NOW, RAND, UUID, STRUUID
};

Dependencies dependencies_of(const Query& query);

}  // namespace lrt::query

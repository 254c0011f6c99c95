#pragma once

#include <string>
#include <vector>

#include "src/query/algebra.hpp"

namespace lrt::query {

/// What the answer to a query depends on.
struct Dependencies {
  bool everything = false;              ///< any triple may count: a variable predicate, a path that excludes, DESCRIBE, GRAPH without a triple
  std::vector<std::string> predicates;  ///< without `everything`: triples with other predicates do not count. Each once
  bool uses_now_or_random = false;      ///< the answer may change although no graph does
};

Dependencies dependencies_of(const Query& query);

}  // namespace lrt::query

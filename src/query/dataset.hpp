#pragma once

#include <cstddef>
#include <memory>
#include <string_view>

#include <lrt/rdf/graph.hpp>

namespace lrt::query {

/// Named graphs with indexes over all of them. The default graph is their union.
///
/// A term has one number in all graphs. Blank nodes belong to their graph: equal labels in two graphs are two nodes.
///
/// @par Threads  Distinct objects: any. One object: one thread at a time, or any number of reading threads.
class Dataset {
 public:
  /// Adds a graph, or replaces the one of that name. Only the triples that differ are touched.
  void put(std::string_view name, const rdf::Graph& graph);
  /// Removes a graph, if there is one of that name.
  void remove(std::string_view name);
};

}  // namespace lrt::query

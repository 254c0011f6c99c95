// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "src/engine/body_task.hpp"
#include "src/model/graph_state.hpp"

namespace lrt::engine {

/// A request of a client that changes a graph of a World: bytes to triples, and then the write, judged by the graph's shapes. As with BodyTask any
/// thread may carry it out.
struct GraphTask {
  BodyTask body;
  bool is_update = false;  ///< the body is in SPARQL 1.1 Update
  std::string base{};      ///< IRI of the server in the body
  std::shared_ptr<model::GraphState> state{};
  model::GraphWrite write{};
  bool creates = false;  ///< the graph is not registered yet

  /// The body was parsed before: this is its graph.
  void set_graph(rdf::Graph graph) {
    write.graph = std::move(graph);
    is_parsed_ = true;
  }
  /// @param waits  for a running write
  /// @return nullopt: another write is running
  std::optional<JudgedBody> carry_out(bool waits);

 private:
  std::optional<BodyFault> parse();
  BodyFault fault_of(model::GraphRefusal refusal) const;
  bool is_parsed_ = false;
};

}  // namespace lrt::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/rdf/codec.hpp>

#include "src/engine/body_task.hpp"
#include "src/engine/command_rules.hpp"
#include "src/model/graph_state.hpp"

namespace lrt::engine {

/// A request of a client that changes a graph of a World: bytes to triples, and then the write, judged by the graph's shapes. As with BodyTask any
/// thread may carry it out.
struct GraphTask {
  BodyTask body;
  bool is_update = false;  ///< the body is in SPARQL 1.1 Update
  std::string base{};      ///< IRI of the server in the body
  bool shows = false;      ///< the client may read the graph, and so how large it is
  std::shared_ptr<model::GraphState> state{};
  model::GraphWrite write{};
  bool creates = false;  ///< the graph is not registered yet
  SharedCheck check{};   ///< asked just before the write

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

/// A request of a client that changes several graphs of a World: all of them, or none.
///
/// 1. Its body is read on any thread: `graphs`.
/// 2. The World finds the graphs and judges the rights: `parts`.
/// 3. prepare() makes each graph as it would be and judges it, on any thread.
/// 4. The World commits them together, on the engine's thread, if none has changed since. Otherwise it begins again with 3.
struct DatasetChange {
  struct Part {
    std::shared_ptr<model::GraphState> state;
    model::GraphWrite write;
    model::PreparedWrite prepared{};
    bool creates = false;  ///< the graph is not registered yet
    bool shows = false;    ///< the client may read the graph, and so the report about it, and how large it is
  };
  rdf::Dataset graphs{};
  std::string base{};      ///< IRI of the server in the body
  std::string one_path{};  ///< of a new graph, if the body has a default graph only
  std::vector<Part> parts{};
  int times_prepared = 0;

  /// @param waits  for running writes; false: nullopt if there is one
  std::optional<BodyFault> prepare(bool waits);
  /// The sentence about a graph that refuses.
  BodyFault fault_of(const Part& part, model::GraphRefusal refusal) const;
};

}  // namespace lrt::engine

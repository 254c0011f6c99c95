// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <variant>

#include <lrt/base/result.hpp>
#include <lrt/base/unique_function.hpp>

#include "src/base/function_ref.hpp"
#include "src/model/graph_state.hpp"

namespace lrt::model {
inline namespace v0 {

/// A store of the host that has the content of a graph, of which the graph shows what was last read: GraphState::show(). A write of a client goes to the
/// store first. docs/decisions/0087-models-of-redland.md
///
/// @par Threads  Any. write() waits for the thread that owns the store; the others do not.
class HostStore {
 public:
  virtual ~HostStore() = default;

  /// Makes a client's change on what is shown, and judges it. The version before: the change has no effect.
  using Made = std::variant<GraphState::Version, GraphRefusal>;
  using Make = FunctionRef<Made(const GraphState::Version& before)>;
  /// Brings a change to the store, and shows it. A store that the host has changed meanwhile is read first, and the change made again.
  /// @param make  called on this thread, or on the one that owns the store
  virtual std::optional<GraphRefusal> write(Make make) = 0;

  /// The host wants the store to be read for each reader.
  virtual bool is_read_each_time() const noexcept = 0;
  using Done = UniqueFunction<void(const Result<void>&)>;
  /// Reads the store, if the host has changed it or may have, and shows that.
  /// @param done  called once, on any thread. unavailable: why it cannot be read
  virtual void read(Done done) = 0;

  /// Runs a job in the host's Server::poll(). It is destroyed without having run if the server stops.
  using RunInPoll = std::function<void(UniqueFunction<void()>)>;
  /// The graph is served from here on; nullptr: not any more.
  virtual void set_poll(RunInPoll run) = 0;
  /// Nobody waits any more: write() returns GraphRefusal::Kind::stopped.
  virtual void stop() noexcept = 0;
};

/// What a leaf reaches of a graph.
struct GraphAccess {
  /// nullptr: the handle is empty
  static const std::shared_ptr<GraphState>& state_of(const WorldGraph& graph) noexcept { return graph.state_; }
  static WorldGraph handle_of(std::shared_ptr<GraphState> state) noexcept { return WorldGraph(std::move(state)); }
};

}  // namespace v0
}  // namespace lrt::model

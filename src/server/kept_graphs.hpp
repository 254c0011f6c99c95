// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <lrt/base/log.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/thread_options.hpp>

#include "src/model/graph_state.hpp"
#include "src/server/service.hpp"

namespace lrt {

/// A graph of a World that code has made, from opening it until the World is removed. One with a file (GraphOptions::file) is a class of its own, which a
/// linker leaves out of a robot without Worlds.
class KeptGraph {
 public:
  /// The graphs of a World. Restores those that have a file. Their changes are saved from here on, for as long as the result lives.
  /// @par Errors  as SavedFile::prepare() and open_journal(); expected_value, limit_exceeded: the kept graph does not conform to the shapes, or exceeds
  ///              the limits
  static Result<std::vector<std::unique_ptr<KeptGraph>>> open(const model::WorldSpec& world, const LogCallback& log, const ThreadOptions& threads);

  explicit KeptGraph(std::shared_ptr<model::GraphState> state) : state_(std::move(state)) {}
  virtual ~KeptGraph() { stop(); }
  KeptGraph(const KeptGraph&) = delete;
  KeptGraph& operator=(const KeptGraph&) = delete;
  const model::GraphState& state() const noexcept { return *state_; }
  void stop() noexcept { state_->end_waiting_writes(); }

 private:
  const std::shared_ptr<model::GraphState> state_;
};

/// The graphs of Worlds that code has made, while the server has them.
/// @par Threads  Any.
class KeptGraphs final : public Service, public ThingKeeper {
 public:
  ThingKeeper* keeper() noexcept override { return this; }

  using Opened = std::vector<std::unique_ptr<KeptGraph>>;

  explicit KeptGraphs(SharedEngine& server) : server_(server) {}
  ~KeptGraphs() override;

  Result<UniqueFunction<void()>> adding(const std::vector<Thing>& things) override;
  /// The last changes are written.
  void removed(const std::string& path) override;
  /// Writes of clients that wait for an update end, because the update may be waiting for the server to stop.
  void stop() noexcept override;
  void count(ServerCounters& all) const override;

 private:
  void add(Opened opened);

  SharedEngine& server_;
  mutable std::mutex mutex_;  // guards all of them
  Opened all_;
  bool stopped_ = false;
  std::uint64_t errors_of_removed_ = 0;
};

}  // namespace lrt

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/redland.hpp>

#include "src/model/host_store.hpp"
#include "src/rdf/difference.hpp"
#include "src/redland/terms.hpp"
#include "src/redland/world_use.hpp"

namespace lrt::redland {
inline namespace v0 {

/// A model that is attached: the store of its graph. All that uses librdf happens in steps on the owner's thread, one after another: a piece of a read, or
/// one write. So what a step has read or written is not changed by the host before the step ends.
///
/// A read counts only if the host has not changed the model since it began (`changes_`). A write is made and judged elsewhere, on the version that is
/// shown, and carried out only while that is what the model has.
class LRT_LOCAL Model::Impl final : public lrt::model::HostStore, public std::enable_shared_from_this<Impl> {
 public:
  using GraphState = lrt::model::GraphState;
  using GraphRefusal = lrt::model::GraphRefusal;
  using Clock = std::chrono::steady_clock;

  Impl(std::shared_ptr<WorldUse> use, librdf_model* model, Options options, GraphOptions graph_options);
  ~Impl() override;

  /// @pre  once, before anything else
  void serve(const WorldGraph& graph);
  Result<void> read_first();
  /// Ends without a graph.
  void give_up() noexcept;

  // For the host.
  void changed() noexcept;
  Result<void> call(const std::function<void(librdf_model*)>& work);
  void detach() noexcept;
  WorldGraph graph() const { return lrt::model::GraphAccess::handle_of(state_.lock()); }
  Result<void> state() const;
  Counters counters() const;

  // For the graph.
  std::optional<GraphRefusal> write(Make make) override;
  bool is_read_each_time() const noexcept override { return options_.reading == Reading::each_time; }
  void read(Done done) override;
  void set_poll(RunInPoll run) override;
  void stop() noexcept override;

 private:
  /// A write that waits for the owner. It is on the stack of a thread that waits, and is taken out of the queue by whoever comes first.
  struct Write {
    GraphState::Version before, made;
    Make*
        make;  ///< to make it again, if the model is another one: a host that changes it all the time would never let it pass; nullptr: it is given back
    enum class State : std::uint8_t { queued, running, done } state = State::queued;
    std::optional<GraphRefusal> outcome{};
    rdf::Difference difference{};  ///< of the two versions
  };
  /// A snapshot that is being made.
  struct Pass {
    std::uint64_t changes;  ///< changes_ when it began
    GraphState::Version before;
    bool anew;  ///< not on the version before, of which much is unused
    lrt::model::GraphEdit edit;
    StreamPointer stream;
    std::vector<bool> seen{};  ///< by place in the version before
    std::size_t rows = 0, known = 0, left_out = 0;
    std::string example{};  ///< of what was left out
    bool storage_fails = false;
    bool compares = false;  ///< the stream is over: what was not seen is removed
    std::optional<rdf::Graph::Matches> all{};
    rdf::Graph::Matches::iterator at{};  ///< of `all`
  };
  class Job;

  template <class F>
  void on_owner(F work);
  void schedule() noexcept;
  void step() noexcept;
  bool work(Clock::time_point until);
  void begin_read(std::uint64_t changes);
  bool advance(GraphState& state, Clock::time_point until);
  std::string take(Pass& pass, librdf_statement* statement);
  std::string finish(GraphState& state, Pass& pass);
  void read_ended(GraphState& state, const std::string& fault);
  void drop_read() noexcept;

  /// Takes a reader that waits until the owner's thread has read. False: it need not wait.
  bool waits(Done& done);
  void carry_out(GraphState& state, Write& write);
  std::optional<GraphRefusal> make_change(Write& write) const;
  std::optional<GraphRefusal> try_write(GraphState& state, Write& write);
  struct Change;
  std::optional<GraphRefusal> prepare(const Write& write, Change& change);
  std::optional<GraphRefusal> apply(const Change& change, WorldUse::Listening& listening);
  std::optional<GraphRefusal> remove(librdf_statement* statement, WorldUse::Listening& listening);
  std::optional<GraphRefusal> add(librdf_statement* statement, WorldUse::Listening& listening);
  std::vector<StatementPointer> alike(librdf_statement* wanted) const;
  std::string iri_in_model(std::string_view iri, std::string& fault) const;
  StatementPointer statement_of(const rdf::Graph& graph, const rdf::Triple& triple, const Change& change, std::string& fault) const;

  void settle(Write& write, std::optional<GraphRefusal> outcome) noexcept;
  void release() noexcept;
  bool is_current() const noexcept { return shown_changes_ == changes_.load(std::memory_order_acquire); }

  const Options options_;
  const GraphOptions graph_options_;
  const std::string own_base_;  ///< World::base
  std::shared_ptr<WorldUse> use_;
  std::weak_ptr<GraphState> state_;  ///< which owns this
  std::atomic<std::uint64_t> changes_{1};
  std::atomic<bool> may_recover_{false};  ///< the storage has failed, and nobody may say when it can be read again

  // The owner's.
  librdf_model* model_;
  NodePointer context_;
  Labels labels_;
  std::unique_ptr<Pass> pass_;
  int interruptions_ = 0;
  std::string last_fault_, last_example_;

  mutable std::mutex mutex_;  // guards the rest, for moments
  std::condition_variable settled_;
  std::uint64_t shown_changes_ = 0;  ///< changes_ of what is shown
  std::deque<Write*> writes_;
  std::vector<Done> readers_, readers_of_pass_;
  RunInPoll run_;
  bool is_stopped_ = false, is_detached_ = false;
  Counters counters_;
  std::atomic<bool> is_scheduled_{false};  ///< set with mutex_ held
};

}  // namespace v0
}  // namespace lrt::redland

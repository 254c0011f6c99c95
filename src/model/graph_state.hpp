// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/base/unique_function.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/shacl/report.hpp>
#include <lrt/shacl/shapes.hpp>
#include <lrt/world.hpp>

#include "src/base/function_ref.hpp"
#include "src/model/graph_changes.hpp"
#include "src/model/spec.hpp"
#include "src/rdf/update_data.hpp"

namespace lrt::model {
inline namespace v0 {

/// Changes to a copy of a graph, in the order in which they are made. A large graph shares its structure with the copy.
class GraphEdit {
 public:
  /// @param bytes   of the graph, as GraphState::Version has it
  /// @param base    IRI of the graph
  /// @param limits  also of a document that is read for it
  LRT_INTERNAL_API GraphEdit(const rdf::Graph& before, std::size_t bytes, std::string base, const GraphOptions& limits);
  /// Much of the memory of a large graph is unused: who may take long writes it anew.
  LRT_INTERNAL_API static bool has_much_unused(const rdf::Graph& graph);
  /// take() leaves what is not used any more where it is.
  void leave_unused() noexcept { compacts_ = false; }
  using Graphs = std::vector<std::shared_ptr<const rdf::Graph>>;
  /// From now on the changes are also kept as text: take_changes().
  /// @param repeated_on  other graphs on which they will be repeated. Then what has no effect here is kept, too, and new blank nodes are new there
  void keep_changes(Graphs repeated_on = {}) {
    changes_.emplace();
    repeated_on_ = std::move(repeated_on);
  }
  /// The changes since keep_changes(), as they can be repeated on another graph.
  std::string take_changes() { return changes_ ? changes_->take() : std::string(); }

  LRT_INTERNAL_API void add(const rdf::TermView& subject, const rdf::TermView& predicate, const rdf::TermView& object);
  /// Adds a Turtle document.
  void add_turtle(std::string_view text);
  /// Adds all triples with new blank nodes.
  void merge(const rdf::Graph& graph);
  LRT_INTERNAL_API void remove(const rdf::TermView* subject, const rdf::TermView* predicate, const rdf::TermView* object);
  void remove_node(const rdf::TermView& subject);
  void clear();
  /// The graph with the changes up to now.
  LRT_INTERNAL_API const rdf::Graph& graph();
  /// The same, at the end.
  LRT_INTERNAL_API rdf::Graph take();
  /// Of graph(): the bytes of its IRIs and literals, written in full at each occurrence.
  std::size_t bytes() const noexcept { return bytes_; }
  std::size_t size() const noexcept { return graph_.size() - removed_count_; }
  /// The triples differ from those at the beginning, or may do so on the other graphs of keep_changes().
  bool has_changed() const noexcept {
    return size() != before_ || removed_before_ != 0 || lost_ != 0 || (!repeated_on_.empty() && !changes_->text().empty());
  }

  /// An IRI that may be relative to the graph. Sets the error if it is invalid.
  std::string resolved(std::string_view iri);
  rdf::Term term_of(const Object& object);
  void fail(Error error) {
    if (!error_) error_ = std::move(error);
  }
  const std::optional<Error>& error() const noexcept { return error_; }

 private:
  bool is_removed(std::size_t at) const noexcept { return at < removed_.size() && removed_[at]; }
  void mark(std::uint32_t at);
  void add(rdf::TermId subject, rdf::TermId predicate, rdf::TermId object);
  rdf::TermId interned(const rdf::TermView& term);
  rdf::TermId fresh_blank();
  void keep_removed(const rdf::Graph& graph, const rdf::Triple& triple);
  void remove_removed();
  void forget_removed() noexcept;
  bool take_over(const rdf::Graph& other);
  void check(const rdf::TermView& term);
  void keep(bool added, const rdf::Triple& triple);

  std::size_t before_;  ///< triples of the graph at the beginning
  const std::string base_;
  const GraphOptions& limits_;
  rdf::Graph graph_;
  std::uint32_t first_new_;            ///< the place in graph_ of the first triple that was not there at the beginning
  std::size_t bytes_;                  ///< of graph_, with what is removed
  std::vector<bool> removed_;          ///< by place in graph_; the rest: not removed
  std::vector<std::uint32_t> marked_;  ///< the places in removed_, and some that were added again
  bool is_cleared_ = false;            ///< marked_ is not complete
  std::size_t removed_count_ = 0;
  std::size_t removed_before_ = 0;  ///< of those that were there at the beginning
  std::size_t lost_ = 0;            ///< those that are not in graph_ any more
  bool compacts_ = true;
  std::optional<GraphChanges> changes_;
  Graphs repeated_on_;
  std::optional<Error> error_;
};

/// A change that a client requests. IRIs of this server stand below World::base.
struct GraphWrite {
  enum class Kind : std::uint8_t { replace, merge, edit };
  Kind kind = Kind::replace;
  rdf::Graph graph{};                       ///< to replace the present one, or to be added
  std::vector<rdf::DataUpdate> updates{};   ///< Kind::edit
  std::optional<std::uint64_t> expected{};  ///< executed only at this revision
};

/// The reason for refusing a write. The graph is unchanged.
struct GraphRefusal {
  enum class Kind : std::uint8_t {
    changed,  ///< the revision is another one than expected
    too_large,
    violation,  ///< the shapes refuse the graph: `report`
    failed,     ///< validation did not complete
    busy,       ///< another write is running, and this one must not wait
    stopped,    ///< the server has stopped, or the World was removed, while this one waited
    unsaved,    ///< too many bytes wait for the disk
    // Of a graph in a store of the host:
    unsupported,   ///< the store cannot do it in one step
    late,          ///< the host's program has not done it in time, and will not
    store_failed,  ///< the store has refused it, and is as it was
    store_full,    ///< the same, because it has no room
  };
  Kind kind;
  std::string message{};
  std::optional<shacl::Report> report{};
  std::string limit{};  ///< instead of `message`, for those who may not know how large the graph is; empty: `message` does not say it
};

/// A graph as a write would make it, judged but not shown yet.
struct PreparedWrite {
  std::shared_ptr<const rdf::Graph> graph{};  ///< nullptr: the write changes nothing
  std::size_t bytes = 0;
  std::uint64_t revision = 0;  ///< of the graph that it was made from
  std::string changes{};       ///< of a graph with a file
};

/// What became of a change that a client waits for. The worst one of several counts.
enum class SaveOutcome : std::uint8_t {
  saved,    ///< the disk has it
  refused,  ///< the disk has refused it, and it was taken back
  full,     ///< the same, because the disk or a quota has no room
};

/// Changes of a client that are shown when the disk has them.
///
/// @par Threads  Any.
class Saving {
 public:
  using Call = UniqueFunction<void(SaveOutcome)>;
  /// @param parts  calls of settle() until all is settled
  explicit Saving(std::size_t parts = 1) noexcept : parts_(parts) {}
  void settle(SaveOutcome outcome) noexcept;
  /// Calls when all is settled: at once, or on the thread that settles. `call` must not throw.
  void then(Call call);

 private:
  std::mutex mutex_;  // guards all of them
  std::size_t parts_;
  SaveOutcome worst_ = SaveOutcome::saved;
  Call call_;
};

/// What keeps the changes of a graph on the disk.
///
/// @par Threads  Any.
class ChangeJournal {
 public:
  /// Whether a change that a client waits for may be appended.
  virtual bool has_room(std::size_t bytes) noexcept = 0;
  /// Queues a change. Returns at once.
  /// @param changes    as GraphChanges
  /// @param number     larger than that of the change before
  /// @param is_waited  a client waits for it: drop_waited() drops it
  /// @return  another one that a client waits for is queued before it, and will be saved together with it
  virtual bool append(const std::string& changes, std::uint64_t number, bool is_waited) = 0;
  /// Changes that clients wait for and that are queued are not written any more.
  virtual void drop_waited() noexcept = 0;

 protected:
  ~ChangeJournal() = default;
};

/// A value that the control loop publishes into a graph.
struct PublishedSpec {
  std::shared_ptr<PropertySpec> property;
  std::string predicate;
  std::string object;  ///< the fragment that names it, "#cup"
  std::chrono::milliseconds expires_after;
};

/// Limits the bytes of several graphs together.
///
/// @par Threads  Any.
class GraphBudget {
 public:
  explicit GraphBudget(std::size_t max_bytes) noexcept : max_(max_bytes) {}
  std::size_t max() const noexcept { return max_; }
  /// The bytes of one of the graphs change. False: there would be too many, and nothing has changed.
  bool change(std::size_t before, std::size_t after) noexcept;

 private:
  const std::size_t max_;
  std::atomic<std::size_t> used_{0};
};

class HostStore;

/// A graph with its shapes and limits. The user's handles and the engine share it.
///
/// A graph with a file has two versions while clients wait for the disk: the newest one, on which all writes work, and the one that is shown, without
/// the changes of these clients. When the disk has them, the newest one is shown; when it refuses them, they are taken back. A change by code is made on
/// each version that may come to be shown, and on the one that is: it is there at once and stays, whatever becomes of the others.
///
/// @par Threads  Any. Writers are serialised; readers never wait for writers.
class GraphState {
 public:
  struct Version {
    std::shared_ptr<const rdf::Graph> graph;
    std::uint64_t revision;
    std::size_t bytes = 0;  ///< of its IRIs and literals, written in full at each occurrence
  };

  /// @param path  of the graph below the root, percent-encoded, with a leading '/'
  /// @par Errors  expected_rdf, expected_value, limit_exceeded: of the shapes and of the first content
  static Result<std::shared_ptr<GraphState>> create(std::string path, GraphOptions options, const std::string& shapes_base,
                                                    std::shared_ptr<HandleContext> thing);
  LRT_INTERNAL_API ~GraphState();
  GraphState(const GraphState&) = delete;
  GraphState& operator=(const GraphState&) = delete;
  /// A graph without content and with the rules and the budget of another graph.
  static std::shared_ptr<GraphState> like(const GraphState& other, std::string path);

  const std::string& path() const noexcept { return path_; }
  const GraphOptions& options() const noexcept { return options_; }
  /// Its IRI below World::base.
  std::string iri() const { return std::string(World::base) + path_; }
  /// The one that is shown.
  LRT_INTERNAL_API Version version() const;
  /// What a write works on.
  Version newest() const;

  /// A change by code.
  /// @par Errors  refused: called within an update, also of another graph, or before open()
  Result<void> update(FunctionRef<void(GraphEdit&)> change);
  /// @param waits   for a running write; false: GraphRefusal::Kind::busy
  /// @param saving  set if the change is shown later, and the client is to wait for that
  std::optional<GraphRefusal> write(const GraphWrite& write, bool waits, std::shared_ptr<Saving>* saving = nullptr);
  /// Returns when no write is running, or when nobody may wait any more.
  void wait_for_writes();
  /// Makes and judges what write() would make of the present graph, and changes nothing.
  std::variant<PreparedWrite, GraphRefusal> prepare(const GraphWrite& wanted) const;
  /// A write of several graphs, in any order, each once.
  struct Prepared {
    GraphState* state;
    const PreparedWrite* write;
  };
  /// Makes all of the changes or none. Does not wait.
  /// @param saving  as of write(), of all of them
  /// @return  GraphRefusal::Kind::busy, changed: a graph has another writer, or another revision than was prepared; too_large: of their budget; unsaved
  static std::optional<GraphRefusal> commit_all(std::vector<Prepared> all, std::shared_ptr<Saving>* saving = nullptr);
  /// Shares a limit with other graphs.
  /// @pre the graph is empty, and only one thread uses it
  void set_budget(std::shared_ptr<GraphBudget> budget) noexcept { budget_ = std::move(budget); }
  /// From now on write() does not wait. Those that wait return GraphRefusal::Kind::stopped.
  void end_waiting_writes() noexcept;
  /// Replaces the graph by the content of a file.
  /// @param fill  makes it, in an empty graph
  Result<void> restore(FunctionRef<void(GraphEdit&)> fill);
  /// A graph with a file is updated from here on: the file was read, and there is a saver.
  void open() noexcept { is_open_ = true; }

  /// The content is in a store of the host. update() is refused.
  /// @pre nobody uses the graph yet
  void set_store(std::shared_ptr<HostStore> store) noexcept { store_ = std::move(store); }
  HostStore* store() const noexcept { return store_.get(); }
  /// Called by the store, by one thread at a time: what it has now.
  /// @return  with its revision
  LRT_INTERNAL_API Version show(std::shared_ptr<const rdf::Graph> graph, std::size_t bytes);
  /// Called by the store: nothing is shown, and readers get this sentence instead.
  LRT_INTERNAL_API void show_fault(std::string fault);
  /// Empty: there is none.
  LRT_INTERNAL_API std::string fault() const;

  /// A value to be published; false: another one has its path.
  bool add_published(PublishedSpec spec);
  void remove_published(const PropertySpec& property) noexcept;
  std::vector<PublishedSpec> published() const;
  /// A fault of set-up for the server's log. Those that nobody takes are dropped beyond 64.
  LRT_INTERNAL_API void report(std::string fault);
  std::vector<std::string> take_reports();
  std::shared_ptr<HandleContext> thing() const noexcept { return thing_; }

  /// Called after each change of the graph or of what is published, on the thread that made it, and not after it was set to nullptr.
  void set_listener(std::function<void()> listener);
  /// Gets each change from now on, in order; nullptr: none. Afterwards the journal before it is not called any more.
  void set_journal(ChangeJournal* journal);
  /// Called by the journal: the changes up to that number are on the disk, and so are all before. Those of clients are shown.
  void saved(std::uint64_t number) noexcept;
  /// Called by the journal: the disk has refused changes. Those of clients are taken back, all that are not shown yet.
  void take_back(ChangeJournal& journal, SaveOutcome outcome) noexcept;
  /// Called by the journal: how many changes are not on the disk.
  void set_unsaved(std::size_t count) noexcept { unsaved_.store(count, std::memory_order_relaxed); }
  std::size_t unsaved() const noexcept { return unsaved_.load(std::memory_order_relaxed); }
  /// Called by the journal: the disk has refused to write changes.
  void add_file_error() noexcept { file_errors_.fetch_add(1, std::memory_order_relaxed); }
  std::uint64_t file_errors() const noexcept { return file_errors_.load(std::memory_order_relaxed); }

 private:
  GraphState(std::string path, GraphOptions options, std::shared_ptr<HandleContext> thing)
      : path_(std::move(path)), options_(std::move(options)), thing_(std::move(thing)), is_open_(options_.file.empty()) {}
  class Turn;
  Result<void> make(FunctionRef<void(GraphEdit&)> change);
  std::optional<GraphRefusal> change(GraphEdit& edit, const GraphWrite& wanted) const;
  std::optional<GraphRefusal> write_to_store(const GraphWrite& wanted);
  /// A change that a client waits for, and that is not shown yet.
  struct Pending {
    std::uint64_t number;
    Version version;  ///< what is shown when it is saved; without its graph if a later change is saved together with this one
    std::shared_ptr<Saving> saving;
  };
  Version newest(GraphEdit::Graphs& others) const;
  /// @param before  what the change was made of
  /// @param saving  nullptr: by code
  /// @return  GraphRefusal::Kind::changed: `before` was taken back meanwhile, and a client's change has to be made anew
  std::optional<GraphRefusal> commit(GraphEdit& edit, const Version& before, std::shared_ptr<Saving>* saving);
  std::optional<GraphRefusal> put_by_code(Version made, const std::string& changes, const Version& before, std::vector<Version>& gone);
  void put(Version made, const std::string& changes, std::shared_ptr<Saving> saving, std::vector<Version>& gone);
  bool waits_for_disk() const noexcept { return journal_ && options_.respond_when_saved; }
  bool has_unsaved() const noexcept { return !pending_.empty() || unsaved() != 0; }
  GraphRefusal unsaved_refusal() const;
  Version with_changes(const Version& before, const std::string& changes) const;
  std::optional<GraphRefusal> judge(const rdf::Graph& graph, std::size_t bytes) const;
  void merge(GraphEdit& edit, const rdf::Graph& graph) const;
  void notify() noexcept;

  const std::string path_;
  const GraphOptions options_;
  const std::shared_ptr<HandleContext> thing_;
  std::optional<shacl::Shapes> shapes_;
  std::shared_ptr<GraphBudget> budget_;  ///< nullptr: none
  std::shared_ptr<HostStore> store_;     ///< nullptr: the content is here
  std::atomic<bool> is_open_;
  std::mutex turn_mutex_;  // guards both of them, for moments
  std::condition_variable turn_changed_;
  bool is_writing_ = false;                                   // a Turn exists, with the user's lambda
  bool stopped_ = false;                                      // no write() waits any more
  mutable std::mutex mutex_;                                  // guards the rest, for moments
  Version current_{std::make_shared<const rdf::Graph>(), 1};  // shown
  Version newest_{current_};                                  // the same, unless pending_ has changes of clients
  std::list<Pending> pending_;                                // ends with the version newest_
  std::uint64_t last_revision_ = 1, last_number_ = 0;         // given to a version; to a change
  std::vector<PublishedSpec> published_;
  std::vector<std::string> reports_;
  std::string fault_;
  std::mutex listener_mutex_;  // guards them, and is held while they run
  std::function<void()> listener_;
  ChangeJournal* journal_ = nullptr;
  std::mutex show_mutex_;  // held while a change by code is made on all versions; before mutex_
  std::atomic<std::size_t> unsaved_{0};
  std::atomic<std::uint64_t> file_errors_{0};
};

struct ThingSpec;

/// What modules above this one do for a World. They derive theirs from it, and only World's constructor, which is defined above them, names that: a
/// linker leaves out of a program without a World what only Worlds need.
class WorldExtension {
 protected:
  ~WorldExtension() = default;
};

/// The part of a Thing that is a World.
struct WorldSpec {
  const WorldExtension& extension;
  WorldOptions options;
  std::vector<std::shared_ptr<GraphState>> graphs;
  std::shared_ptr<GraphState> created;  ///< the rules of graphs that clients create; nullptr: they may not
};

/// Makes a Thing a World.
/// @par Errors  as GraphState::create(), for the rules of graphs that clients create
Result<void> set_up_world(ThingSpec& thing, WorldOptions options, const WorldExtension& extension);

}  // namespace v0
}  // namespace lrt::model

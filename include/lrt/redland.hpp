// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include <redland.h>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/term.hpp>
#include <lrt/world.hpp>

/// A librdf_model of the host as a graph of a World, and conversions between the terms of Redland and those of lrt. In the
/// library lrt::librdf. Not part of lrt.hpp.
///
///     lrt::World world("world");
///     auto tasks = lrt::redland::Model::attach(world, "tasks", model).value();
///     server->add(std::move(world)).value();
///     while (is_running) {
///       if (work_on(model)) tasks.changed();  // the host goes on to use librdf
///       server->poll();                       // reads and writes the model, too
///     }
///
/// What clients are shown is a snapshot, which lrt makes of the model when the host has said that it has changed it. What
/// they write reaches the model by its own storage, in one transaction, and is shown when the storage has it.
///
/// | what Redland has | in the graph |
/// |---|---|
/// | an absolute URI, a blank node, a literal of well-formed UTF-8 | the same |
/// | a plain literal; one of xsd:string | the same literal of xsd:string: RDF 1.1 knows one |
/// | `"x"@en-US`; `"x"@en-us` | the same literal of `en-us` |
/// | a relative URI; a language that is no tag; ill-formed UTF-8; an IRI of more than 8,192 bytes | left out and counted, see Options |
/// | a literal as subject, a blank node or literal as predicate | the same; the storages of Redland refuse them |
/// | the contexts of a model | the union of all, each statement once; or one of them, see Options::context |
///
/// Identifiers of blank nodes in the model become labels, and a node keeps its label while it is shown. Blank nodes that
/// clients write get new identifiers, which the model has nowhere else.
namespace lrt::redland {
inline namespace v0 {

/// Which thread uses the librdf_world of a model. librdf has no locks: there is one for each world, also for several
/// models of it.
enum class Owner : std::uint8_t {
  host,    ///< the host's: the one that calls Server::poll() or run(), where lrt does its steps. Not with Server::start()
  thread,  ///< one that lrt starts. The host uses the world in Model::call() only, from attach() until detach()
};

/// When lrt reads the model.
enum class Reading : std::uint8_t {
  when_changed,  ///< after Model::changed(). In steps, between which the host goes on
  each_time,  ///< for each GET, query and write, for a host that cannot tell when it has changed something. In one step, however large the model is.
              ///< Subscribers and standing queries are told of what some other read finds
};

/// How a model is attached.
struct Options {
  Owner owner = Owner::host;                ///< all models of one librdf_world have the same
  Reading reading = Reading::when_changed;  ///< when lrt reads the model
  /// The beginning of IRIs of this server in the model, "https://robot.example". They are shown with the base of each
  /// request, and `<#task>` of a client is written with this one. Empty: such IRIs of the model are shown as they are,
  /// and a client cannot write IRIs of this server (422).
  std::string base{};
  /// IRI of the context that is shown and written; a storage with contexts. Empty: all of them, and what clients add is in
  /// none. What only a context has, SQLite removes, and other storages do not (501).
  std::string context{};
  /// A model with statements that RDF 1.1 does not have is not shown at all (503); false: these are left out and counted.
  bool refuses_foreign_terms = false;
  /// Also writes of several statements to a storage without transactions: memory, hashes, trees. If the storage fails
  /// between two of them, or the process ends there, half of the write is in the model. false: such a write gets 501.
  bool allows_partial_writes = false;
  /// How long lrt uses the owner's thread at a time, when it reads.
  std::chrono::microseconds max_step{1'000};
  /// Statements that one write may add and remove, all in one step of the owner's thread: 3 us each in hashes and trees, 0.6 ms in SQLite
  /// and memory with 10,000 statements. More: 413.
  std::size_t max_write = 200;
  /// How long a client's write waits for the owner's thread. Then 503, and nothing has changed. Less than
  /// Limits::host_timeout, after which clients do not know.
  std::chrono::milliseconds write_timeout{1'500};
  /// What the host has passed to librdf_world_set_logger(), which librdf does not tell. While models of the world are
  /// attached, lrt has that place, because only there librdf says why a storage has failed; it passes on what is not
  /// about a call of lrt, and gives the place back at the end. nullptr: the default of librdf, which writes to stderr.
  librdf_log_func logger = nullptr;
  void* logger_data = nullptr;  ///< the first argument of `logger`
};

/// What has happened with a model since it was attached.
struct Counters {
  std::uint64_t reads = 0;                    ///< complete snapshots
  std::uint64_t interrupted_reads = 0;        ///< the host has changed the model before the last step
  std::uint64_t whole_reads = 0;              ///< made in one step: Reading::each_time, or after three that were interrupted
  std::uint64_t failed_reads = 0;             ///< see Model::state()
  std::uint64_t writes = 0;                   ///< of clients, that the storage has
  std::uint64_t failed_writes = 0;            ///< that the storage has refused
  std::uint64_t left_out = 0;                 ///< statements of the last snapshot that RDF 1.1 does not have
  std::uint64_t statements = 0;               ///< that the model had at the last snapshot
  std::chrono::microseconds longest_step{0};  ///< on the owner's thread
};

/// A librdf_model that is a graph of a World. A handle: the model is the host's.
///
/// A model is attached once. It may be one of several of its librdf_world, in one World or several.
///
/// detach(), or the destructor, comes before librdf_free_world(). If the host frees the model or its storage earlier, they
/// live on until then: lrt holds a reference. (librdf 1.0.17 has the function for that; with a librdf without it, detach()
/// comes before librdf_free_model(), too.)
///
/// @par Threads  changed(), graph(), state(), counters(): any. The rest: Owner::host: the one that polls the server;
///               Owner::thread: any, one at a time.
class LRT_API Model {
 public:
  /// Makes a model a graph of a World, and reads it.
  ///
  /// @param world    not yet added to a server
  /// @param path     of the graph below the World, "tasks"
  /// @param graph    what clients may do, their limits, the shapes that judge their writes; what the host writes is shown
  ///                 as it is. `file`, `turtle` and what is about the disk: empty
  /// @par Errors  invalid_option: graph.file or graph.turtle is set, an option is out of range, Options::context with a
  ///              storage without contexts, another Owner than other models of the librdf_world have; or World::graph()
  ///              refuses the path or the options, and Server::add() returns why; duplicate_path: the model is attached
  ///              already; io_error: no thread; failed: the storage does not return its statements; limit_exceeded: GraphOptions::max_triples, max_bytes; expected_rdf:
  ///              Options::refuses_foreign_terms. After one of reading, the World has the graph, which is 503.
  /// @par Time    Proportional to the model: 1 to 3 us for each statement.
  static Result<Model> attach(World& world, std::string_view path, librdf_model* model, Options options = {}, GraphOptions graph = {});

  Model(Model&&) noexcept;             ///< the other one becomes inert
  Model& operator=(Model&&) noexcept;  ///< detaches the present one
  ~Model();                            ///< as detach()

  /// The host has changed the model: lrt reads it again, soon. With Owner::host, call it after a change and before the next
  /// Server::poll(), with no transaction open; a snapshot then has all of the change or nothing of it. One call for
  /// many changes is enough. Costs one read of the whole model, 0.3 to 2.5 us for each statement, in steps.
  /// @par Threads  Any. Does not block; does not allocate when a read is due already.
  void changed() noexcept;

  /// Runs a function with the model on the thread that owns it, and waits for it. The only way to the model with
  /// Owner::thread. It calls changed() if it changes the model.
  /// @par Errors  failed: it threw; closed: detached
  Result<void> call(const std::function<void(librdf_model*)>& work);

  /// The graph: snapshot(), revision(), published(). update() is refused: the model is changed by librdf.
  WorldGraph graph() const;
  /// Why clients get 503 instead of the graph: the last read has failed, or the model is detached. Later reads may succeed.
  Result<void> state() const;
  Counters counters() const;  ///< what has happened since attach()

  /// Ends the use of the model. Clients that GET or write the graph get 503 then, and queries see it empty. Waits for a
  /// step that is running. state() says so afterwards, and changed() does nothing.
  void detach() noexcept;

 private:
  class Impl;
  explicit Model(std::shared_ptr<Impl> impl) noexcept;
  std::shared_ptr<Impl> impl_;
};

// ----------------------------------------------------------------------------------------------------------- conversions
//
// Terms as in the table above, IRIs as they are.

/// A term of lrt.
/// @par Errors  expected_rdf: what RDF 1.1 does not have, with the reason
/// @par Threads  The one that owns the librdf_world.
LRT_API Result<rdf::Term> to_term(librdf_node* node);
/// A node of Redland, to be freed by librdf_free_node(). Its blank nodes have the label as identifier.
/// @return  nullptr: librdf refuses it, or would make another one of it (a literal that begins with a NUL), or has no memory
/// @par Threads  The one that owns the librdf_world.
LRT_API librdf_node* to_node(librdf_world* world, const rdf::TermView& term);
/// A statement of Redland, to be freed by librdf_free_statement().
/// @return  as to_node()
/// @par Threads  The one that owns the librdf_world.
LRT_API librdf_statement* to_statement(librdf_world* world, const rdf::TermView& subject, const rdf::TermView& predicate,
                                       const rdf::TermView& object);

/// Limits of to_graph().
struct GraphLimits {
  std::size_t max_triples = 1'000'000;  ///< of the graph
  bool refuses_foreign_terms = false;   ///< false: they are left out
};
/// A graph of lrt.
struct Converted {
  rdf::Graph graph;          ///< blank nodes with identifiers that are no labels get new labels
  std::size_t left_out = 0;  ///< statements that RDF 1.1 does not have
};
/// Reads what is left of a stream, which the caller frees.
/// @par Errors  limit_exceeded; expected_rdf: GraphLimits::refuses_foreign_terms; failed: the stream has no statement where it should
/// @par Threads  The one that owns the librdf_world.
LRT_API Result<Converted> to_graph(librdf_stream* stream, const GraphLimits& limits = {});
/// Reads a whole model.
/// @par Errors  the same; failed: the storage returns fewer statements than it has
/// @par Threads  The one that owns the librdf_world.
LRT_API Result<Converted> to_graph(librdf_model* model, const GraphLimits& limits = {});
/// A stream of the triples, one at a time, to be freed by librdf_free_stream() before the world. Blank nodes have new
/// identifiers of that world.
/// @return  nullptr: a literal that to_node() refuses, or no memory
/// @par Threads  The one that owns the librdf_world.
LRT_API librdf_stream* to_stream(librdf_world* world, std::shared_ptr<const rdf::Graph> graph);
/// Adds the triples to a model, in one transaction if its storage has transactions and none is open. Blank nodes get new
/// identifiers.
/// @return      how many were added or there already
/// @par Errors  failed: the storage refuses one; without a transaction those before it stay
/// @par Threads  The one that owns the librdf_world.
LRT_API Result<std::size_t> add(librdf_model* model, const rdf::Graph& graph);

}  // namespace v0
}  // namespace lrt::redland

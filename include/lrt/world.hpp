// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include <lrt/base/abi.hpp>
#include <lrt/base/misuse.hpp>
#include <lrt/base/result.hpp>
#include <lrt/model/detail/slot.hpp>
#include <lrt/model/statement.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/thing.hpp>

namespace lrt::model {
inline namespace v0 {
struct GraphAccess;
class GraphEdit;
class GraphState;
}  // namespace v0
}  // namespace lrt::model

namespace lrt {
inline namespace v0 {

/// Options of one graph of a World.
struct GraphOptions {
  rdf::Texts title;  ///< dcterms:title, in one language or several; empty: the last name of its path
  /// SHACL shapes in Turtle. A write, by code or by a client, is refused unless the resulting graph conforms to the
  /// shapes that have targets. What is published() is not checked. Their base is the World's own Blueprint, where
  /// clients read them.
  std::string shapes;
  bool clients_may_write = false;     ///< by PUT, POST, PATCH and DELETE; the client also needs the right to write
  std::size_t max_triples = 100'000;  ///< of the resulting graph; a write beyond it is refused (413)
  /// Of its IRIs and literals, written in full at each occurrence; also of a request body (413). A body must also be
  /// within transport::Limits::max_body_bytes; a larger graph takes several POSTs.
  std::size_t max_bytes = 32 * 1024 * 1024;
  /// File that stores the graph across restarts, without what is published(): a journal to which each change is
  /// appended, as much as it weighs, and which a thread of lrt compacts beside its use (docs/journal.md). update() does
  /// not wait for the disk; unsaved_changes() counts what is not there yet. When the World is removed and when the server
  /// is destroyed, all is written. What a crash has left half-written at its end is cut off. Server::add() refuses a file
  /// that was damaged before its end (io_error, with the place), one of another program or a newer lrt (invalid_option),
  /// and one that another graph, server or process writes. Files of earlier releases, N-Triples, are read and replaced.
  /// Empty: the graph is not stored.
  std::string file;
  std::string turtle;      ///< first content, unless there is a stored file. Its base is the graph's IRI
  rdf::Texts description;  ///< dcterms:description
  /// With a `file`: a client's change is shown, and acknowledged, when it is on the disk. Changes that arrive together are
  /// written together. If the disk refuses, the response is 507 (it is full) or 503, and nothing has changed. Changes by
  /// update() are shown at once and written when the disk takes them again. false: no response waits, and a crash loses
  /// what was not written yet.
  bool respond_when_saved = true;
  std::chrono::milliseconds save_timeout{10'000};  ///< how long a request waits for the disk; then 503, and the change may still come
  /// Of changes that wait for the disk, each with 512 bytes more. A client's write beyond it is refused (503). Beyond it,
  /// changes by update() are written as one: the whole graph.
  std::size_t max_unsaved_bytes = 64 * 1024 * 1024;
};

/// What clients may do with a World besides writing its graphs.
struct WorldOptions {
  /// New graphs, by PUT or POST below the World, or by the World's own URI for several graphs at once; the client also
  /// needs the right to write the World.
  bool clients_may_create = false;
  std::size_t max_created = 100;  ///< graphs of clients at a time; more: 409
  /// Options of each graph that a client creates. Clients may write and delete it, whatever clients_may_write says;
  /// `file`, `title`, `description` and `turtle` are ignored.
  GraphOptions created{};
  std::size_t max_created_bytes = 64 * 1024 * 1024;  ///< of graphs of clients together, as GraphOptions::max_bytes; more: 413
};

/// Options of a published value of an object.
struct PublishedOptions {
  /// Only a unit.
  PublishedOptions(const Unit& its_unit = unit::none) : unit(its_unit) {}  // NOLINT: most have a unit only
  Unit unit;                                                               ///< of the numbers, which are not converted
  std::optional<Object> frame{};                                           ///< of the numbers, see model::PropertyHandle::frame()
  /// If publish() is not called for this time, the value leaves the graph until the next publish(). Each publish() then
  /// counts as a change, also of the same value. Zero: never.
  std::chrono::milliseconds expires_after{0};
};

/// Changes to a graph, inside WorldGraph::update(). They take effect together, or not at all. update() returns the
/// first error.
///
/// A subject is an IRI. A relative one is resolved against the graph's IRI: `#cup` in the graph "map" of the World
/// "world" is `</world/map#cup>`. IRIs of this server's own resources begin with World::base.
///
/// @par Errors   update() returns expected_iri (a subject), expected_rdf (a document, or a term that no syntax can write:
///               a literal of invalid UTF-8, a language that is no language tag, a datatype that is no absolute IRI),
///               limit_exceeded (also an IRI of more than 8,192 bytes, with World::base)
/// @par Threads  The thread that calls `change`; only during the call.
class LRT_API GraphUpdate {
 public:
  /// Adds a triple.
  GraphUpdate& add(std::string_view subject, Iri predicate, const Object& object);
  /// Adds a triple of terms. Relative IRIs are resolved, too. Blank nodes are those of the graph, see graph().
  GraphUpdate& add(const rdf::TermView& subject, const rdf::TermView& predicate, const rdf::TermView& object);
  /// Adds a Turtle document of at most GraphOptions::max_triples triples. Its base is the graph's IRI. Its blank nodes
  /// become new ones.
  GraphUpdate& add_turtle(std::string_view text);
  /// Adds all triples of a graph, whose IRIs are absolute. Its blank nodes become new ones.
  GraphUpdate& add(const rdf::Graph& graph);

  /// @{
  /// Removes a triple, if the graph has it.
  GraphUpdate& remove(std::string_view subject, Iri predicate, const Object& object);
  GraphUpdate& remove(const rdf::TermView& subject, const rdf::TermView& predicate, const rdf::TermView& object);
  /// @}
  /// Removes all triples with these terms; nullptr: any term.
  GraphUpdate& remove_matching(const rdf::TermView* subject, const rdf::TermView* predicate, const rdf::TermView* object);
  /// Removes an object: the triples about it, those about blank nodes that only these triples refer to, and those that
  /// refer to it.
  GraphUpdate& remove_node(std::string_view subject);
  /// Replaces all objects of that subject and predicate by one.
  GraphUpdate& set(std::string_view subject, Iri predicate, const Object& object);
  /// Removes all triples.
  GraphUpdate& clear();

  /// The graph with the changes so far. Valid until the next change.
  const rdf::Graph& graph();
  /// The number of its triples.
  std::size_t size() const noexcept;

 private:
  friend class WorldGraph;
  explicit GraphUpdate(model::GraphEdit& edit) noexcept : edit_(edit) {}
  model::GraphEdit& edit_;
};

/// A value of an object in a graph that the control loop publishes, for example its pose. Copies are handles to the
/// same value.
template <class T>
class PublishedObject {
 public:
  /// An empty handle, to be assigned later.
  PublishedObject() noexcept = default;

  /// Passes the present value to the engine.
  /// @par Threads  Any one thread at a time.
  /// @par Time     As PushedProperty::publish(): no lock, and no allocation if T is trivially destructible.
  void publish(const T& value) noexcept {
    if (!begin_write()) return;
    slot_->publish(value);
    end_write();
  }
  /// The same with the time of the value, see PushedProperty::publish().
  /// @param at  when the value became what it is, UTC
  void publish(const T& value, std::chrono::system_clock::time_point at) noexcept {
    if (!begin_write()) return;
    slot_->publish(value, at);
    end_write();
  }
  /// Removes the value from the graph. publish() then has no effect.
  /// @par Threads  Any but the control loop's, because it locks.
  void remove() noexcept {
    if (removes_) removes_();
  }
  explicit operator bool() const noexcept { return slot_ != nullptr; }  ///< false for an empty handle

 private:
  friend class WorldGraph;
  PublishedObject(std::shared_ptr<model::Slot<T>> slot, std::function<void()> removes) : slot_(std::move(slot)), removes_(std::move(removes)) {}
  /// As model::PushedSetup::begin_write().
  bool begin_write() const noexcept {
    if constexpr (detail::checks) {
      if (slot_ && slot_->begin_write()) return true;
      detail::misuse(slot_ ? "publish() of an object in a World by two threads at the same time: one thread publishes an object"
                           : "publish() on an empty handle: assign what WorldGraph::published() returns");
      return false;
    } else {
      return slot_ != nullptr;
    }
  }
  void end_write() const noexcept {
    if constexpr (detail::checks) slot_->end_write();
  }

  std::shared_ptr<model::Slot<T>> slot_;
  std::function<void()> removes_;
};

/// Handle to a named graph of a World: what the robot knows about its surroundings, its tasks or its calibration. The
/// graph is a resource with a URI, in every RDF syntax, observable, and writable by clients if GraphOptions allow it.
/// Copies are handles to the same graph. A handle works before and after Server::add(), and also after the World is
/// removed; then nobody sees the changes. A graph with a file is updated after Server::add() only, which reads the file.
///
/// @par Threads  Any, also concurrently, but not the control loop: all functions lock. publish() of what published()
///               returns does not lock.
/// @par Implements  paper D4
class LRT_API WorldGraph {
 public:
  /// An empty handle, to be assigned later.
  WorldGraph() noexcept = default;
  /// False for an empty handle.
  explicit operator bool() const noexcept { return state_ != nullptr; }

  /// Changes the graph in one step: readers see all of the changes or none. Updates of several threads, and writes of
  /// clients, run one after another.
  ///
  /// @param change  callable of GraphUpdate&. It runs on the calling thread. If it throws, or returns a Result with an
  ///                error, nothing changes, and update() returns that error. It may call the server, also stop():
  ///                writes of clients that wait for this update then get 503. stop() waits for running functions of
  ///                other threads, so these must not wait for this update.
  /// @par Errors  expected_iri, expected_rdf: a change; limit_exceeded: GraphOptions::max_triples, max_bytes;
  ///              expected_value: the graph would not conform to its shapes, with the report as text; failed: `change`
  ///              threw; refused: called within the `change` of an update, of this graph or another one, or before
  ///              Server::add() if the graph has a file. After an error nothing has changed. While clients wait for the
  ///              disk, the limits and shapes hold for the graph with their changes and for the one without them.
  /// @par Time     Proportional to the change, with 0.1 ms for a graph of a million triples; plus the validation, which is
  ///               proportional to the graph if it has shapes. Of each eighth of a large graph that was removed, one update
  ///               writes the rest anew: 5 us for each triple that was removed since.
  template <class F>
  Result<void> update(F change) {
    if constexpr (!std::is_invocable_v<F&, GraphUpdate&>) {
      static_assert(rdf::detail::always_false<F>,
                    "lrt: update expects a callable of lrt::GraphUpdate&; write [&](lrt::GraphUpdate& u) { u.add(...); }");
      return {};
    } else {
      return apply([&change](GraphUpdate& u) {
        using R = std::invoke_result_t<F&, GraphUpdate&>;
        if constexpr (rdf::detail::is_result<std::decay_t<R>>) (void)change(u).value();  // BadResult ends the update
        else (void)change(u);
      });
    }
  }

  /// The present graph without what is published(). The returned graph never changes; update() makes a new one. IRIs of
  /// this server's own resources begin with World::base.
  std::shared_ptr<const rdf::Graph> snapshot() const;
  /// A number that grows with each change.
  std::uint64_t revision() const;
  /// How many changes are not on the disk yet. 0 without GraphOptions::file.
  std::size_t unsaved_changes() const;

  /// Adds a value of an object that the control loop publishes, for example its pose. The value is a pushed Property of
  /// its own, at `path` below the graph. Its triples, with the time, are also in the graph: `<#cup> predicate
  /// </world/map/cup>` and the value of `</world/map/cup>`. Before the first publish() neither exists. Clients cannot
  /// write it: the server ignores these triples in a body. Stored triples may refer to the value.
  ///
  /// @param path       "cup", or "cup/pose" if the object has several values. The object is `<#cup>`: the first name.
  /// @param predicate  from the object to the value
  /// @return           an empty handle if the path is not valid or not free, or `predicate` is not absolute. The server's
  ///                   log says so, once the World is added
  template <class T>
  PublishedObject<T> published(std::string_view path, Iri predicate, const PublishedOptions& options = {}) {
    if constexpr (!std::is_default_constructible_v<T> || !std::is_copy_constructible_v<T> || !std::is_copy_assignable_v<T>) {
      static_assert(rdf::detail::always_false<T>, "lrt: values that are published need a default constructor and copies");
      return {};
    } else {
      auto [slot, remove] = add_published(std::make_unique<model::Slot<T>>(), rdf::traits<T>::type(), path, predicate, options);
      if (!slot) return {};
      return PublishedObject<T>(std::static_pointer_cast<model::Slot<T>>(std::move(slot)), std::move(remove));
    }
  }

 private:
  friend class World;
  friend struct model::GraphAccess;
  explicit WorldGraph(std::shared_ptr<model::GraphState> state) noexcept : state_(std::move(state)) {}
  Result<void> apply(const std::function<void(GraphUpdate&)>& change);
  /// @return  the slot, and what removes it again; empty: it is not added
  std::pair<std::shared_ptr<model::SlotBase>, std::function<void()>> add_published(std::unique_ptr<model::SlotBase> slot, const rdf::Type& type,
                                                                                   std::string_view path, Iri predicate,
                                                                                   const PublishedOptions& options);
  std::shared_ptr<model::GraphState> state_;
};

/// A Thing that holds named graphs: the world model of the robot. It is a Thing, a container of its graphs (LDP), and a
/// graph store (SPARQL 1.1 Graph Store HTTP Protocol) at its own URI, with the parameters `graph` and `default`.
///
///     lrt::World world("world");
///     lrt::WorldGraph map = world.graph("map", {});
///     server->add(std::move(world)).value();
///     map.update([](lrt::GraphUpdate& u) { u.add("#cup", lrt::vocab::rdfs::label, "the red cup"); }).value();
///
/// @par Threads  Set-up only, one thread at a time.
/// @par Implements  paper D4; SPARQL 1.1 Graph Store HTTP Protocol; of SPARQL 1.1 Update: INSERT DATA and DELETE DATA
class LRT_API World final : public Thing {
 public:
  /// Replaces the server's base in the IRIs of graphs that code reads and writes. Representations have the base of
  /// their request instead.
  static constexpr std::string_view base = "http://lrt.invalid";

  /// @param path     its path below the server's root, see Thing
  /// @param options  what clients may do
  explicit World(std::string_view path, WorldOptions options = {});

  /// Adds a named graph at `path` below the World.
  /// @par Errors  expected_iri, duplicate_path, expected_rdf, expected_value (an ill-formed shape, or a first content
  ///              that does not conform), limit_exceeded, io_error and invalid_option (its file, two titles in one
  ///              language): from Server::add()
  WorldGraph graph(std::string_view path, GraphOptions options = {});
};

}  // namespace v0
}  // namespace lrt

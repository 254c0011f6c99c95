// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cassert>
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
#include <lrt/base/result.hpp>
#include <lrt/model/detail/slot.hpp>
#include <lrt/model/detail/spec.hpp>
#include <lrt/model/statement.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/traits.hpp>
#include <lrt/thing.hpp>

namespace lrt::model {
inline namespace v0 {
class GraphEdit;
class GraphState;
}  // namespace v0
}  // namespace lrt::model

namespace lrt {
inline namespace v0 {

/// What one graph of a World is like.
struct GraphOptions {
  std::string title;  ///< dcterms:title; empty: the last name of its path
  /// SHACL shapes in Turtle. The whole graph that a write would leave must conform to those that have targets, whether code or a client
  /// writes. What is published() is not judged. Their base is the World's own Blueprint, where clients read them.
  std::string shapes;
  bool clients_may_write = false;            ///< PUT, POST, PATCH and DELETE; the right to write is needed as well
  std::size_t max_triples = 100'000;         ///< a write that would leave more is refused (413)
  std::size_t max_bytes = 32 * 1024 * 1024;  ///< the same of its IRIs and literals, written out each time they occur; also of a request body
  /// Where the graph is kept over a restart: N-Triples with a first line of lrt. The file is replaced whole after each change, by a thread of
  /// its own, so that it always has one state of the graph; what is published() is not in it. A file that was changed or cut off is kept beside as
  /// FILE.damaged-1, the log says so, and the graph begins with `turtle`. One process writes a file at a time. Empty: nowhere.
  std::string file;
  std::string turtle;  ///< what the graph has at first, unless a file was written. Its base is the graph's IRI
};

/// What clients may do with a World besides its graphs.
struct WorldOptions {
  bool clients_may_create = false;  ///< new graphs, by PUT or POST below the World; the right to write the World is needed as well
  std::size_t max_created = 100;    ///< graphs of clients at once; more: 409
  /// Of each graph that a client creates. Clients may write and delete it, whatever clients_may_write says; `file`, `title` and `turtle` have
  /// no meaning.
  GraphOptions created{};
};

/// What a published value of an object is like.
struct PublishedOptions {
  PublishedOptions(const Unit& its_unit = unit::none) : unit(its_unit) {}  // NOLINT: most have a unit only
  Unit unit;
  std::optional<Object> frame{};  ///< of the numbers, as PropertyHandle::frame()
  /// The object has gone if publish() was not called for so long: its value leaves the graph until the next publish(). Each publish() counts as a
  /// change then, also of the same value. Zero: never.
  std::chrono::milliseconds expires_after{0};
};

/// Changes to a graph, inside WorldGraph::update(). They take effect together, or not at all. The first error stays, and is what update() returns.
///
/// A subject is an IRI. A relative one is resolved against the graph's IRI: "#cup" in the graph "map" of the World "world" is
/// </world/map#cup>. IRIs of this server's own resources stand below World::base.
class LRT_API GraphUpdate {
 public:
  GraphUpdate& add(std::string_view subject, Iri predicate, const Object& object);
  /// Terms as they are; relative IRIs are resolved, too. Blank nodes are those of the graph, see graph().
  GraphUpdate& add(const rdf::TermView& subject, const rdf::TermView& predicate, const rdf::TermView& object);
  /// Adds a document. Its base is the graph's IRI. Its blank nodes become new ones.
  GraphUpdate& add_turtle(std::string_view text);
  /// Adds all triples. The blank nodes become new ones.
  GraphUpdate& add(const rdf::Graph& graph);

  GraphUpdate& remove(std::string_view subject, Iri predicate, const Object& object);
  GraphUpdate& remove(const rdf::TermView& subject, const rdf::TermView& predicate, const rdf::TermView& object);
  /// Removes the triples with these terms; nullptr: any.
  GraphUpdate& remove_matching(const rdf::TermView* subject, const rdf::TermView* predicate, const rdf::TermView* object);
  /// Removes what the graph says of an object: its triples, those of blank nodes that only they lead to, and those that lead to it.
  GraphUpdate& remove_node(std::string_view subject);
  /// The object becomes the only one of that subject and predicate.
  GraphUpdate& set(std::string_view subject, Iri predicate, const Object& object);
  GraphUpdate& clear();

  /// The graph with the changes up to now. Valid until the next change.
  const rdf::Graph& graph();
  /// How many triples it has now.
  std::size_t size() const noexcept;

 private:
  friend class WorldGraph;
  explicit GraphUpdate(model::GraphEdit& edit) noexcept : edit_(edit) {}
  model::GraphEdit& edit_;
};

/// A value of an object in a graph that the control loop publishes, such as its pose. Copies are handles to the same value.
template <class T>
class PublishedObject {
 public:
  PublishedObject() noexcept = default;

  /// Passes the present value to the engine.
  /// @par Threads  Any one thread at a time.
  /// @par Time     As PushedProperty::publish(): no lock, and no allocation if T is trivially destructible.
  void publish(const T& value) noexcept {
    assert(slot_ && "lrt: the handle is empty; assign what WorldGraph::published returns");
    if (slot_) slot_->publish(value);
  }
  /// The object is gone: its value leaves the graph. publish() has no effect any more.
  /// @par Threads  Any but the control loop's: it locks.
  void remove() noexcept {
    if (removes_) removes_();
  }
  explicit operator bool() const noexcept { return slot_ != nullptr; }

 private:
  friend class WorldGraph;
  PublishedObject(std::shared_ptr<model::Slot<T>> slot, std::function<void()> removes) : slot_(std::move(slot)), removes_(std::move(removes)) {}
  std::shared_ptr<model::Slot<T>> slot_;
  std::function<void()> removes_;
};

/// Handle to a named graph of a World: what the robot knows of its surroundings, of its tasks, of its calibration. It is a resource with a URI, in
/// every RDF syntax, observable, and writable by clients if GraphOptions say so. Copies are handles to the same graph. It works before and after
/// Server::add(), and goes on working, unseen, when the World is removed.
///
/// @par Threads  Any, also several at once, but not the control loop: all functions lock. publish() of what published() returns does not.
class LRT_API WorldGraph {
 public:
  /// An empty handle, to be assigned later.
  WorldGraph() noexcept = default;
  explicit operator bool() const noexcept { return state_ != nullptr; }

  /// Changes the graph in one step: readers see all of the changes or none. Updates of several threads, and writes of clients, follow one another.
  ///
  /// @param change  callable of GraphUpdate&. It runs on the calling thread. It may throw: then nothing changes.
  /// @par Errors  those of the changes: expected_iri, expected_rdf; limit_exceeded: GraphOptions::max_triples, max_bytes; expected_value: the graph
  ///              would not conform to its shapes, with the report as text; failed: `change` threw; refused: called within `change` of the same
  ///              graph. Nothing has changed then.
  /// @par Time     In proportion to the graph, which is copied: for 100,000 triples about 25 ms, 50 if some are removed; and the validation.
  template <class F>
  Result<void> update(F change) {
    if constexpr (!std::is_invocable_v<F&, GraphUpdate&>) {
      static_assert(rdf::detail::always_false<F>,
                    "lrt: update expects a callable of lrt::GraphUpdate&; write [&](lrt::GraphUpdate& u) { u.add(...); }");
      return {};
    } else {
      return apply([&change](GraphUpdate& u) { (void)change(u); });
    }
  }

  /// The present graph without what is published(). It never changes; the next update() makes another one. IRIs of this server's own resources
  /// stand below World::base.
  std::shared_ptr<const rdf::Graph> snapshot() const;
  /// Moves with each change.
  std::uint64_t revision() const;

  /// Makes a value of an object that the control loop publishes, such as its pose. The value is a pushed Property of its own, at `path` below the
  /// graph, and its triples, with the time, are also in the graph: `<#cup> predicate </world/map/cup>` and the value of </world/map/cup>. Before
  /// the first publish() neither is there. Clients cannot write it: what a body says of it is left out.
  ///
  /// @param path  "cup", or "cup/pose" if the object has several values. The object is `<#cup>`: the first name.
  /// @return      an empty handle if the path is not valid or taken; the server's log says so when the World is added
  template <class T>
  PublishedObject<T> published(std::string_view path, Iri predicate, const PublishedOptions& options = {}) {
    if constexpr (!std::is_default_constructible_v<T> || !std::is_copy_constructible_v<T> || !std::is_copy_assignable_v<T>) {
      static_assert(rdf::detail::always_false<T>, "lrt: values that are published need a default constructor and copies");
      return {};
    } else {
      auto spec = std::make_shared<model::PropertySpec>();
      spec->type = &rdf::traits<T>::type();
      spec->facets.unit(options.unit);
      if (options.frame) spec->frame = std::make_unique<const Object>(*options.frame);
      auto slot = std::make_shared<model::Slot<T>>();
      if (options.expires_after.count() > 0) slot->set_every_sample();
      spec->slot = slot;
      if (!add_published(spec, path, predicate, options.expires_after)) return {};
      return PublishedObject<T>(std::move(slot), remover(std::move(spec)));
    }
  }

 private:
  friend class World;
  explicit WorldGraph(std::shared_ptr<model::GraphState> state) noexcept : state_(std::move(state)) {}
  Result<void> apply(const std::function<void(GraphUpdate&)>& change);
  bool add_published(std::shared_ptr<model::PropertySpec> spec, std::string_view path, Iri predicate, std::chrono::milliseconds expires_after);
  std::function<void()> remover(std::shared_ptr<model::PropertySpec> spec) const;
  std::shared_ptr<model::GraphState> state_;
};

/// A Thing that holds named graphs: the world model of the robot (the paper's D4). It has all that a Thing has, and is a container of its graphs (LDP)
/// and a graph store (SPARQL 1.1 Graph Store HTTP Protocol), at its own URI and by the parameters `graph` and `default`.
///
///     lrt::World world("world");
///     lrt::WorldGraph map = world.graph("map", {});
///     server->add(std::move(world));
///     map.update([](lrt::GraphUpdate& u) { u.add("#cup", lrt::vocab::rdfs::label, "the red cup"); });
///
/// @par Threads  Set-up only, one thread at a time.
/// @par Implements  SPARQL 1.1 Graph Store HTTP Protocol; of SPARQL 1.1 Update INSERT DATA and DELETE DATA
class LRT_API World final : public Thing {
 public:
  /// Stands for the server in IRIs of graphs that code reads and writes: representations have the base of their request instead.
  static constexpr std::string_view base = "http://lrt.invalid";

  explicit World(std::string_view path, WorldOptions options = {});

  /// Adds a named graph at `path` below the World.
  /// @par Errors  expected_iri, duplicate_path, expected_rdf, expected_value (an ill-formed shape, or a first content that does not conform),
  ///              limit_exceeded, io_error and invalid_option (its file): by add()
  WorldGraph graph(std::string_view path, GraphOptions options = {});
};

}  // namespace v0
}  // namespace lrt

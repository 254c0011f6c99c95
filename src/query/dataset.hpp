// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/rdf/detail/hash_index.hpp>
#include <lrt/rdf/graph.hpp>

#include "src/query/reading.hpp"

namespace lrt::query {

/// The number of a term in one Dataset, and in one evaluation on it. A number of a term that is no longer used is given to another.
using TermNumber = std::uint32_t;
using GraphNumber = std::uint32_t;
/// No term, no graph, not bound, any.
inline constexpr std::uint32_t nothing = 0xFFFFFFFF;

struct NumberedTriple {
  TermNumber subject, predicate, object;
  friend bool operator==(const NumberedTriple& a, const NumberedTriple& b) noexcept {
    return a.subject == b.subject && a.predicate == b.predicate && a.object == b.object;
  }
};

/// Some graphs of a dataset.
class GraphSet {
 public:
  GraphSet() = default;
  void insert(GraphNumber graph) {
    if (graph >= has_.size()) has_.resize(graph + 1);
    if (!has_[graph]) members_.push_back(graph);
    has_[graph] = true;
  }
  bool contains(GraphNumber graph) const noexcept { return graph < has_.size() && has_[graph]; }
  const std::vector<GraphNumber>& members() const noexcept { return members_; }

 private:
  std::vector<bool> has_;
  std::vector<GraphNumber> members_;
};

/// The graphs that a pattern is matched in: all as one, one, or some as one.
struct Scope {
  GraphNumber graph = nothing;     ///< one
  const GraphSet* some = nullptr;  ///< some
  static Scope all() noexcept { return {}; }
  static Scope one(GraphNumber graph) noexcept { return {graph, nullptr}; }
  static Scope of(const GraphSet& graphs) noexcept { return {nothing, &graphs}; }
};

/// Named graphs with indexes over all of them. The default graph is their union.
///
/// A term has one number in all graphs. Blank nodes belong to their graph: equal labels in two graphs are two nodes. A triple of several
/// graphs is kept once, with the graphs that have it.
///
/// @par Threads  Distinct objects: any. One object: one thread at a time, or any number of reading threads.
/// @par Time     put: 0.1 us for each triple of the graph and 1 us for each that differs. A copy: some arrays, about 0.1 us for each triple.
class Dataset {
 public:
  class Matches;

  /// Adds a graph, or replaces the one of that name. Only the triples that differ are touched.
  void put(std::string_view name, const rdf::Graph& graph);
  /// A triple of a graph, for change().
  struct Change {
    rdf::TermView subject, predicate, object;
  };
  /// The graph of that name gets and loses some triples. None of those that it loses is one that it gets.
  /// @par Time  1 us for each of these triples.
  void change(std::string_view name, const std::vector<Change>& removed, const std::vector<Change>& added);
  /// Removes a graph, if there is one of that name.
  void remove(std::string_view name);

  std::size_t graph_count() const noexcept { return graphs_.size() - free_graphs_.size(); }
  /// Triples of the union.
  std::size_t triple_count() const noexcept { return triples_.size() - free_triples_.size(); }
  /// Memory in use, also what is reserved.
  std::size_t bytes() const noexcept;

  /// The number of an IRI or literal; nothing: no triple has it, and no graph its name.
  TermNumber find(const rdf::TermView& term) const noexcept;
  /// Valid until the dataset is changed or destroyed.
  rdf::TermView term(TermNumber number) const noexcept;
  const Reading& value(TermNumber number) const noexcept { return readings_[number]; }
  /// All numbers are below.
  TermNumber term_limit() const noexcept { return static_cast<TermNumber>(terms_.size()); }

  /// The graph that is named so, or nothing.
  GraphNumber graph_named(TermNumber name) const noexcept { return name < terms_.size() ? terms_[name].graph : nothing; }
  TermNumber name_of(GraphNumber graph) const noexcept { return graphs_[graph].name; }
  std::size_t size_of(GraphNumber graph) const noexcept { return graphs_[graph].count; }
  /// All numbers of graphs are below. Some may be free: their name is nothing.
  GraphNumber graph_limit() const noexcept { return static_cast<GraphNumber>(graphs_.size()); }

  bool contains(const NumberedTriple& triple, const Scope& scope) const noexcept;
  /// The triples with the given terms; nothing: any.
  Matches match(TermNumber subject, TermNumber predicate, TermNumber object, const Scope& scope) const noexcept;
  /// The triples of the union with the given terms. Exact except for a subject and an object: then an upper bound.
  std::size_t count(TermNumber subject, TermNumber predicate, TermNumber object) const noexcept;

  /// Statistics for the order of joins.
  struct Spread {
    std::size_t triples = 0, subjects = 0, objects = 0;
  };
  /// The triples with this predicate, and their different subjects and objects.
  Spread spread(TermNumber predicate) const noexcept;
  /// The same for all triples.
  Spread spread() const noexcept { return {triple_count(), subjects_, objects_}; }
  std::size_t predicate_count() const noexcept { return predicates_.size() - free_predicates_.size(); }
  /// Whether a triple of the union has the term as its subject or object.
  bool is_node(TermNumber number) const noexcept { return terms_[number].subjects != nothing || terms_[number].objects != nothing; }

 private:
  friend class Matches;
  struct TermEntry {
    std::uint32_t offset = 0, length = 0;  // in text_; the language follows
    std::uint32_t language_length = 0;
    std::uint32_t datatype = nothing;
    std::uint32_t hash = 0;
    std::uint32_t uses = 0;                               // triples for each position, literals of this datatype, the graph of this name
    std::uint32_t scope = nothing;                        // of a blank node: its graph
    std::uint32_t graph = nothing;                        // named by this term
    std::uint32_t subjects = nothing, subject_count = 0;  // the first of its subject groups; triples
    std::uint32_t objects = nothing, object_count = 0;
    std::uint32_t predicate = nothing;  // in predicates_
    rdf::TermKind kind = rdf::TermKind::iri;
  };
  /// The triples with two terms in common, linked through Entry; the groups of one term are linked too.
  struct SubjectGroup {  // subject and predicate
    std::uint32_t subject, predicate, first = nothing, count = 0;
    std::uint32_t next = nothing, previous = nothing;  // of the subject
  };
  struct ObjectGroup {  // predicate and object
    std::uint32_t predicate, object, first = nothing, count = 0;
    std::uint32_t next = nothing, previous = nothing;  // of the object
    std::uint32_t next_of_predicate = nothing, previous_of_predicate = nothing;
  };
  struct PredicateEntry {
    std::uint32_t groups = nothing, triples = 0, subjects = 0, objects = 0;
  };
  struct TripleEntry {
    NumberedTriple triple;
    std::uint32_t subject_group, object_group;
    std::uint32_t next[2], previous[2];  // in the two groups
    std::uint32_t quads = nothing;       // the first of those with this triple
  };
  struct Quad {
    std::uint32_t triple, graph, mark;
    std::uint32_t next_of_graph, previous_of_graph, next_of_triple, previous_of_triple;
  };
  struct GraphEntry {
    std::uint32_t name = nothing, first = nothing, count = 0;
  };

  TermNumber find(const rdf::TermView& term, GraphNumber scope, std::uint32_t hash) const noexcept;
  TermNumber intern(const rdf::TermView& term, GraphNumber scope);
  void use(TermNumber number) noexcept { ++terms_[number].uses; }
  void release(TermNumber number) noexcept;
  GraphNumber graph_for(std::string_view name);
  std::uint32_t find_triple(const NumberedTriple& triple) const noexcept;
  std::uint32_t find_subject_group(TermNumber subject, TermNumber predicate) const noexcept;
  std::uint32_t find_object_group(TermNumber predicate, TermNumber object) const noexcept;
  std::uint32_t find_quad(std::uint32_t triple, GraphNumber graph) const noexcept;
  std::uint32_t add_triple(const NumberedTriple& triple);
  void remove_triple(std::uint32_t at) noexcept;
  std::uint32_t add_quad(std::uint32_t triple, GraphNumber graph);
  void remove_quad(std::uint32_t at) noexcept;
  void compact();
  void rebuild();

  std::string text_;
  std::size_t dead_text_ = 0;
  std::vector<TermEntry> terms_;
  std::vector<Reading> readings_;
  std::vector<SubjectGroup> subject_groups_;
  std::vector<ObjectGroup> object_groups_;
  std::vector<PredicateEntry> predicates_;
  std::vector<TripleEntry> triples_;
  std::vector<Quad> quads_;
  std::vector<GraphEntry> graphs_;
  std::vector<std::uint32_t> free_terms_, free_subject_groups_, free_object_groups_, free_predicates_, free_triples_, free_quads_, free_graphs_;
  lrt::detail::HashIndex term_index_, subject_index_, object_index_, triple_index_, quad_index_;
  std::size_t subjects_ = 0, objects_ = 0;
  std::uint32_t mark_ = 0;
};

/// The triples of a look-up, one after the other. Valid until the dataset is changed or destroyed.
class Dataset::Matches {
 public:
  /// Looks at the next triple that the indexes offer.
  /// @return  nullptr: there are no more
  /// @param fits  whether it has the terms and is in the scope. So a caller can count its steps
  const NumberedTriple* next(bool& fits) noexcept;
  /// The next triple that fits; nullptr: there are no more.
  const NumberedTriple* next() noexcept {
    bool fits = false;
    while (const NumberedTriple* triple = next(fits)) {
      if (fits) return triple;
    }
    return nullptr;
  }
  /// The graphs that have the triple that next() has given last.
  template <class Visit>
  void graphs(Visit visit) const {
    for (std::uint32_t q = data_->triples_[last_].quads; q != nothing; q = data_->quads_[q].next_of_triple) visit(data_->quads_[q].graph);
  }

 private:
  friend class Dataset;
  enum class Way : std::uint8_t { none, one, subject_group, object_group, subject, object, predicate, graph, all };
  bool fits(std::uint32_t triple, bool in_graph) const noexcept;
  void descend() noexcept;

  const Dataset* data_ = nullptr;
  NumberedTriple wanted_{nothing, nothing, nothing};
  Scope scope_;
  Way way_ = Way::none;
  std::uint32_t at_ = nothing, group_ = nothing, last_ = nothing;
};

}  // namespace lrt::query

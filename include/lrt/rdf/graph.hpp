// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/rdf/detail/hash_index.hpp>
#include <lrt/rdf/detail/shared_graph.hpp>
#include <lrt/rdf/term.hpp>

namespace lrt::rdf {
inline namespace v0 {

/// The number of a term in one Graph: small and dense, in order of first use. Not valid in another graph.
enum class TermId : std::uint32_t {};

/// A triple of a Graph, by the numbers of its terms.
struct Triple {
  /// @{
  /// A term of the same graph.
  TermId subject, predicate, object;
  /// @}
  friend bool operator==(const Triple& a, const Triple& b) noexcept {
    return a.subject == b.subject && a.predicate == b.predicate && a.object == b.object;
  }
};

/// An RDF graph (RDF 1.1 Concepts 3): a set of triples over interned terms, with look-up by any position. It has value
/// semantics.
///
/// Triples keep the order in which they were added, so the output of a writer is reproducible. Equal graphs may number
/// their terms differently. Blank node labels are local to a graph: merging two graphs identifies blank nodes with
/// equal labels.
///
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
/// @par Time     add, contains, find: constant on average. match: proportional to the rarest bound term's triples.
class LRT_API Graph {
 public:
  class Matches;

  Graph() = default;

  /// @{
  /// Adds a triple. The subject is an IRI or blank node, the predicate an IRI.
  /// @return  false: the graph has it already
  bool add(const TermView& subject, const TermView& predicate, const TermView& object);
  bool add(TermId subject, TermId predicate, TermId object);
  /// @}
  /// Adds every triple of `other`. Blank nodes with equal labels become one.
  void merge(const Graph& other);

  std::size_t size() const noexcept { return shared_ ? shared_->size() : triples_.size(); }  ///< number of triples
  bool empty() const noexcept { return size() == 0; }                                        ///< whether there are no triples
  /// All triples, in the order in which they were added. A large graph of a World makes this list with the first call, from
  /// any thread, and keeps it until it is changed or destroyed; match() needs no list.
  const std::vector<Triple>& triples() const { return shared_ ? shared_->triples() : triples_; }

  /// The number of a term. The term is added if the graph does not have it.
  TermId intern(const TermView& term);
  /// The number of a term; nullopt: the graph does not have it.
  std::optional<TermId> find(const TermView& term) const noexcept;
  /// The term of a number. Its views are valid until the graph is changed or destroyed.
  TermView term(TermId id) const noexcept;
  std::size_t term_count() const noexcept { return shared_ ? shared_->term_count() : terms_.size(); }  ///< numbers of terms are below this
  /// A new blank node with a label that is unique in this graph.
  TermId fresh_blank();

  /// @{
  /// Whether the graph has the triple.
  bool contains(TermId subject, TermId predicate, TermId object) const noexcept;
  bool contains(const TermView& subject, const TermView& predicate, const TermView& object) const noexcept;
  /// @}

  /// The triples with the given terms, in the order they were added. Valid until the graph is changed or destroyed.
  Matches match(std::optional<TermId> subject, std::optional<TermId> predicate, std::optional<TermId> object) const noexcept;
  /// As above, with terms by value. A term that the graph does not have matches no triple.
  Matches match(const TermView* subject, const TermView* predicate, const TermView* object) const noexcept;

  /// @{
  /// The object of the first triple with this subject and predicate; nullopt: there is none.
  std::optional<TermView> object(const TermView& subject, const TermView& predicate) const noexcept;
  std::optional<TermId> object(TermId subject, TermId predicate) const noexcept;
  /// @}
  /// All objects of a subject and predicate, in order.
  std::vector<TermView> objects(const TermView& subject, const TermView& predicate) const;
  /// All subjects of a predicate and object, in order.
  std::vector<TermView> subjects(const TermView& predicate, const TermView& object) const;

  /// The members of the RDF list whose first node is `head`; nullopt: the list is ill-formed or infinite.
  std::optional<std::vector<TermId>> list(TermId head) const;
  /// Adds an RDF list of the members. Returns its first node: rdf:nil for no members.
  /// @param cells  nodes for the first cells; for further cells new blank nodes are made
  TermId add_list(const std::vector<TermId>& members, std::vector<TermId> cells = {});

  /// @cond internal
  /// The triple at Matches::iterator::place().
  const Triple& at(std::uint32_t place) const noexcept { return shared_ ? shared_->at(place) : triples_[place]; }
  /// @endcond

 private:
  friend class SharedGraph;
  static constexpr std::uint32_t none = lrt::detail::HashIndex::none;
  struct Chain {  // the triples with a term in one position, linked in order
    std::uint32_t first = none, last = none, count = 0;
  };
  struct Entry {
    std::uint32_t offset, length;   // in text_
    std::uint32_t language_length;  // the tag follows the lexical form
    std::uint32_t datatype;         // TermId of the datatype IRI, or none
    TermKind kind;
    Chain chain[3];
  };
  struct Links {
    std::uint32_t next[3];
  };

  std::uint32_t find_hashed(const TermView& term, std::uint32_t hash) const noexcept;
  std::uint32_t find_fresh(const TermView& term) const noexcept;
  std::uint32_t find(const Triple& triple) const noexcept;
  bool equals(const Entry& entry, const TermView& term) const noexcept;
  std::uint32_t append(const TermView& term, std::uint32_t datatype);

  std::string text_;  // all lexical forms and language tags, concatenated
  std::vector<Entry> terms_;
  lrt::detail::HashIndex term_index_;  // of terms that are not in fresh_
  std::vector<std::uint32_t> fresh_;   // blank nodes b0, b1, ... of fresh_blank()
  bool has_given_labels_ = false;      // some blank nodes are not from fresh_blank()
  std::vector<Triple> triples_;
  std::vector<Links> links_;
  lrt::detail::HashIndex triple_index_;  // of triples that are beyond the first few in all three chains
  SharedGraphPointer shared_;            // has everything instead, if it is there: a large graph of a World
};

/// A range of triples: `for (const Triple& t : graph.match(...))`. Valid until the graph is changed or destroyed.
class Graph::Matches {
 public:
  /// A forward iterator.
  class iterator {
   public:
    /// @cond internal
    using iterator_category = std::forward_iterator_tag;
    using value_type = Triple;
    using difference_type = std::ptrdiff_t;
    using pointer = const Triple*;
    using reference = const Triple&;

    iterator() = default;
    reference operator*() const noexcept { return range_->graph_->at(at_); }
    std::uint32_t place() const noexcept { return at_; }
    pointer operator->() const noexcept { return &**this; }
    iterator& operator++() noexcept {
      at_ = range_->next(at_);
      return *this;
    }
    iterator operator++(int) noexcept {
      iterator before = *this;
      ++*this;
      return before;
    }
    friend bool operator==(const iterator& a, const iterator& b) noexcept { return a.at_ == b.at_; }
    friend bool operator!=(const iterator& a, const iterator& b) noexcept { return !(a == b); }
    /// @endcond

   private:
    friend class Matches;
    iterator(const Matches* range, std::uint32_t at) noexcept : range_(range), at_(at) {}
    const Matches* range_ = nullptr;
    std::uint32_t at_ = Graph::none;
  };

  iterator begin() const noexcept { return {this, first_}; }     ///< the first triple
  iterator end() const noexcept { return {this, Graph::none}; }  ///< the end
  bool empty() const noexcept { return first_ == Graph::none; }  ///< whether no triple matches

 private:
  friend class Graph;
  explicit Matches(const Graph* graph) noexcept : graph_(graph) {}
  bool fits(std::uint32_t at) const noexcept;
  std::uint32_t next(std::uint32_t at) const noexcept;

  const Graph* graph_;
  std::uint32_t wanted_[3] = {Graph::none, Graph::none, Graph::none};
  int position_ = 3;  // the chain that is followed; 3: all triples
  std::uint32_t first_ = Graph::none;
};

/// Whether the graphs are equal except for the labels of their blank nodes (RDF 1.1 Concepts 3.6).
/// @par Threads  Any.
/// @par Time     Exponential in the worst case (graphs with many interchangeable blank nodes); for tests and small graphs.
LRT_API bool isomorphic(const Graph& a, const Graph& b);

}  // namespace v0
}  // namespace lrt::rdf

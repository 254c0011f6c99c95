// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/graph.hpp>

namespace lrt::rdf {

/// Whether a local name is in the part of Turtle's PN_LOCAL that needs no escapes and that all readers accept.
bool is_local_name(std::string_view name) noexcept;

/// The usable prefixes of a caller, for shortening IRIs. Usable are those whose name Turtle allows and whose IRI is absolute; of several with
/// one name, the first. This is checked only for prefixes that an IRI needs, because a document uses few of them.
class PrefixTable {
 public:
  struct Prefix {
    std::string_view name, iri;
    std::uint64_t tail;  // the last eight bytes of `iri`: compared first, because most namespaces begin alike
    std::optional<bool> usable;
    bool used = false;
  };

  /// @param prefixes  must outlive the table
  explicit PrefixTable(const Prefixes& prefixes);

  /// The prefix with the longest namespace that leaves a local name of the IRI, or nullptr.
  Prefix* best_for(std::string_view iri) noexcept;
  /// The usable prefix of that name, or nullptr.
  Prefix* find(std::string_view name) noexcept;
  template <class Condition>
  void remove_if(Condition condition) {
    table_.erase(std::remove_if(table_.begin(), table_.end(), [&](const Prefix& p) { return condition(p.name); }), table_.end());
  }
  const std::vector<Prefix>& all() const noexcept { return table_; }

 private:
  bool is_usable(Prefix& prefix) noexcept;

  std::vector<Prefix> table_;
};

/// The common analysis for the writers of Turtle and JSON-LD: which blank nodes can be nested in the only triple that refers to them, which
/// of these are lists, and in which order a subject's triples are written.
class GraphWriter {
 protected:
  static constexpr int max_nesting = 24;  // deeper blank nodes and lists get a label and are written separately

  explicit GraphWriter(const Graph& graph);

  enum class ListState : std::uint8_t { unknown, yes, no };
  struct Text {
    std::uint32_t at = 0, length = 0;
  };
  struct Node {
    std::uint32_t uses = 0;                 // as object
    std::uint32_t parent = 0;               // subject of the last use
    Text iri, name;                         // positions of the term in out_, as an IRI and as a name if they differ
    std::uint32_t rank = 0, ranked_by = 0;  // of a predicate among those of a subject
    std::uint32_t label = 0;                // of a renamed blank node, from 1
    bool subject = false, nested = false, done = false, seen = false;
    ListState list = ListState::unknown;
  };

  static std::uint32_t number(TermId id) noexcept { return static_cast<std::uint32_t>(id); }
  Node& node(TermId id) noexcept { return nodes_[number(id)]; }

  /// Marks the blank nodes that can be nested in the only triple that refers to them: those that are not on a cycle.
  void find_nested();
  /// True if a cell starts a well-formed list without other triples and without other references to its cells. Checks all its cells at once.
  bool is_list(TermId head);
  /// Pushes the subject's triples on keys_, grouped by predicate, rdf:type first with rank 0. The caller removes them.
  void push_triples(TermId subject);
  static std::uint64_t rank_of(std::uint64_t key) noexcept { return key >> 32; }
  const Triple& triple_of(std::uint64_t key) const noexcept { return graph_.at(static_cast<std::uint32_t>(key)); }

  /// Appends a text that occurs in out_ already. False: it does not.
  bool repeat(Text text);
  Text since(std::size_t at) const noexcept { return {static_cast<std::uint32_t>(at), static_cast<std::uint32_t>(out_.size() - at)}; }
  /// Appends `_:` and the node's label, or a new label if Turtle does not allow the old one.
  void label(TermId id, std::string_view text);

  const Graph& graph_;
  const std::optional<TermId> type_, first_, rest_, nil_;
  std::vector<Node> nodes_;
  std::vector<std::uint64_t> keys_;  // a stack: rank and index of the triples of the subjects being written
  std::vector<TermId> cells_, postponed_;
  std::string out_;
  std::optional<TermId> fault_;
  std::uint32_t labels_ = 0;
};

}  // namespace lrt::rdf

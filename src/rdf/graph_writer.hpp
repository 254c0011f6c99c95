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

/// The part of Turtle's PN_LOCAL that needs no escapes and that every reader agrees on.
bool is_local_name(std::string_view name) noexcept;

/// A caller's prefixes that can be used, to shorten IRIs with.
class PrefixTable {
 public:
  struct Prefix {
    std::string_view name, iri;
    std::uint64_t tail;  // the last eight bytes of `iri`: compared first, because most namespaces begin alike
    bool used = false;
  };

  /// @param prefixes  outlives the table. Of two lines with one name the first counts.
  explicit PrefixTable(const Prefixes& prefixes);

  /// The prefix with the longest namespace that leaves a local name of the IRI, or nullptr.
  Prefix* best_for(std::string_view iri) noexcept;
  Prefix* find(std::string_view name) noexcept;
  template <class Condition>
  void remove_if(Condition condition) {
    table_.erase(std::remove_if(table_.begin(), table_.end(), [&](const Prefix& p) { return condition(p.name); }), table_.end());
  }
  const std::vector<Prefix>& all() const noexcept { return table_; }

 private:
  std::vector<Prefix> table_;
};

/// What the writers of Turtle and JSON-LD know of a graph: which blank nodes can stand inside the only triple that mentions them,
/// which of those are lists, and in which order a subject's triples are written.
class GraphWriter {
 protected:
  static constexpr int max_nesting = 24;  // deeper blank nodes and lists get a label and a block of their own

  explicit GraphWriter(const Graph& graph);

  enum class ListState : std::uint8_t { unknown, yes, no };
  struct Text {
    std::uint32_t at = 0, length = 0;
  };
  struct Node {
    std::uint32_t uses = 0;                 // as object
    std::uint32_t parent = 0;               // subject of the last use
    Text iri, name;                         // where out_ has the term already, as an IRI, and as a name where the two differ
    std::uint32_t rank = 0, ranked_by = 0;  // of a predicate among those of a subject
    std::uint32_t label = 0;                // of a renamed blank node, from 1
    bool subject = false, nested = false, done = false, seen = false;
    ListState list = ListState::unknown;
  };

  static std::uint32_t number(TermId id) noexcept { return static_cast<std::uint32_t>(id); }
  Node& node(TermId id) noexcept { return nodes_[number(id)]; }

  /// Marks the blank nodes that can stand inside the only triple that mentions them: those that are not on a cycle.
  void find_nested();
  /// True if the cell heads a list that nothing else refers to and that says nothing else. Judges all its cells at once.
  bool is_list(TermId head);
  /// Puts the subject's triples on keys_, those of one predicate together, rdf:type first with rank 0; the caller takes them off.
  void push_triples(TermId subject);
  static std::uint64_t rank_of(std::uint64_t key) noexcept { return key >> 32; }
  const Triple& triple_of(std::uint64_t key) const noexcept { return graph_.triples()[key & 0xFFFFFFFF]; }

  /// Appends a text that out_ has already; false if it has not.
  bool repeat(Text text);
  Text since(std::size_t at) const noexcept { return {static_cast<std::uint32_t>(at), static_cast<std::uint32_t>(out_.size() - at)}; }
  /// Appends `_:` and the node's label, or another one where Turtle could not carry it.
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

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string_view>
#include <vector>

#include <lrt/rdf/graph.hpp>

#include "src/base/function_ref.hpp"
#include "src/base/shared_array.hpp"

namespace lrt::rdf {
inline namespace v0 {

/// Texts, each in one piece, in blocks that copies share.
///
/// @par Threads  As SharedArray. Two copies may add texts at the same time.
class SharedText {
 public:
  struct Place {
    std::uint32_t block = 0, offset = 0;
  };
  SharedText() noexcept = default;
  SharedText(const SharedText& other);
  SharedText& operator=(const SharedText&) = delete;
  ~SharedText();

  /// Adds bytes that `write` writes to the given place.
  Place add(std::size_t size, lrt::FunctionRef<void(char*)> write);
  const char* at(Place place) const noexcept { return bytes_of(blocks_[place.block]) + place.offset; }

 private:
  struct Block {
    std::atomic<std::uint32_t> owners{1};
    std::atomic<std::uint32_t> claimed{0};  // bytes that a copy has
    std::uint32_t size = 0;
  };
  static const char* bytes_of(const Block* block) noexcept { return reinterpret_cast<const char*>(block + 1); }
  static Block* make(std::size_t size);
  static void release(Block* block) noexcept;
  bool claim(std::uint32_t size) noexcept;

  std::vector<Block*> blocks_;
  std::size_t last_ = 0;    // the block to which texts are added; those after it have one text each
  std::uint32_t used_ = 0;  // of the last one
  /// What this copy has claimed in the block that was the last one when it was made, given back if no other copy has it.
  std::size_t first_ = 0;
  std::uint32_t first_before_ = 0, first_used_ = 0;
  mutable std::atomic<bool> was_copied_{false};
};

/// What Graph calls of SharedGraph. The first SharedGraph of a process sets it, so that a linker leaves SharedGraph out of a program without Worlds.
struct SharedGraphCalls {
  std::uint32_t (*find)(const SharedGraph&, const TermView&) noexcept;
  std::uint32_t (*find_triple)(const SharedGraph&, const Triple&) noexcept;
  TermView (*term)(const SharedGraph&, std::uint32_t) noexcept;
  std::uint32_t (*intern)(SharedGraph&, const TermView&);
  std::uint32_t (*fresh_blank)(SharedGraph&);
  bool (*add)(SharedGraph&, const Triple&);
  const std::vector<Triple>& (*triples)(const SharedGraph&);
  std::uint32_t (*used_from)(const SharedGraph&, std::uint32_t) noexcept;
  SharedGraph* (*copy)(const SharedGraph&);
  void (*destroy)(SharedGraph*) noexcept;
};
extern std::atomic<const SharedGraphCalls*> shared_graph_calls;

/// The content of a large Graph whose versions share their structure. A copy costs about 0.05 ms for a million triples; a change copies the blocks that it
/// touches. A removed triple keeps its place until compact().
///
/// @par Threads  As SharedArray.
/// @par Errors   If there is no memory, a function throws and has changed nothing but the terms.
class SharedGraph {
 public:
  static constexpr std::uint32_t none = 0xFFFFFFFF;
  /// Graphs with fewer triples have their own copies of everything.
  static constexpr std::size_t least_size = 4'096;

  /// @{
  /// Gives a graph this form, if it has not got it. Its triples keep their order, its terms their numbers. Costs less than to add the triples.
  static SharedGraph& of(Graph& graph);
  static const SharedGraph* in(const Graph& graph) noexcept { return graph.shared_ ? &*graph.shared_ : nullptr; }
  static SharedGraph* in(Graph& graph) noexcept { return graph.shared_ ? &*graph.shared_ : nullptr; }
  /// @}
  /// A graph of this form with the triples of another one and new blank nodes. Costs less than to add the triples.
  /// @pre  the other one has not got this form
  static Graph with_new_blanks(const Graph& graph);
  /// More than an eighth of its places are unused, or it is small now.
  static bool has_much_unused(const Graph& graph);
  /// Writes such a graph anew, and a small one without this form. Costs as much as the graph is large.
  static void compact(Graph& graph);

  SharedGraph();
  SharedGraph(const SharedGraph& other);
  SharedGraph& operator=(const SharedGraph&) = delete;
  ~SharedGraph() = default;

  std::uint32_t size() const noexcept { return live_; }
  std::uint32_t term_count() const noexcept { return terms_.size(); }
  /// Places of triples are below. Some are unused.
  std::uint32_t place_limit() const noexcept { return slots_.size(); }
  bool is_used(std::uint32_t place) const noexcept { return static_cast<std::uint32_t>(slots_[place].triple.subject) != none; }
  const Triple& at(std::uint32_t place) const noexcept { return slots_[place].triple; }
  const std::vector<Triple>& triples() const;

  std::uint32_t find(const TermView& term) const noexcept;
  std::uint32_t find(const Triple& triple) const noexcept;
  TermView term(std::uint32_t id) const noexcept;
  TermKind kind(std::uint32_t id) const noexcept { return terms_[id].kind; }
  std::uint32_t intern(const TermView& term);
  std::uint32_t fresh_blank();
  bool add(const Triple& triple);
  bool remove(const Triple& triple);

  struct Chain {
    std::uint32_t first = none, last = none, count = 0;
  };
  /// The triples with a term as subject (0), predicate (1) or object (2), in order.
  const Chain& chain(std::uint32_t id, int position) const noexcept { return terms_[id].chain[position]; }
  std::uint32_t next(std::uint32_t place, int position) const noexcept { return slots_[place].next[position]; }
  /// The next used place from here on.
  std::uint32_t used_from(std::uint32_t place) const noexcept;
  /// The terms that are predicates of triples.
  std::vector<TermId> predicates() const;

  /// Whether the difference of two versions costs what the change between them has cost.
  bool is_related(const SharedGraph& other) const noexcept { return origin_ == other.origin_; }
  /// Calls a function with each place whose triple may be another one in `after`.
  static void for_each_changed_place(const SharedGraph& before, const SharedGraph& after, lrt::FunctionRef<void(std::uint32_t)> visit);

 private:
  struct TermEntry {
    SharedText::Place text;
    std::uint32_t length = 0, language_length = 0;  // the tag follows the lexical form
    std::uint32_t datatype = none, hash = 0, next_same = none;
    TermKind kind = TermKind::iri;
    bool was_predicate = false;  // is in predicates_
    bool is_dead = false;        // its last triple was removed
    Chain chain[3];
  };
  struct Slot {
    Triple triple{TermId{none}, TermId{none}, TermId{none}};
    std::uint32_t next[3] = {none, none, none}, previous[3] = {none, none, none}, next_same = none;
  };
  using Heads = lrt::detail::SharedArray<std::uint32_t, 9>;
  using Terms = lrt::detail::SharedArray<TermEntry, 6>;
  using Slots = lrt::detail::SharedArray<Slot, 6>;

  SharedGraph(const Graph& plain, bool with_new_blanks);
  static std::uint32_t bucket_of(std::uint32_t hash, std::uint32_t buckets) noexcept;
  bool equals(const TermEntry& entry, const TermView& term) const noexcept;
  std::uint32_t find_hashed(const TermView& term, std::uint32_t hash) const noexcept;
  template <class Items, class Hash>
  static void grow(Heads& heads, Items& items, Hash hash_at, std::size_t wanted);
  std::uint32_t append(const TermView& term, std::uint32_t hash, std::uint32_t datatype);

  SharedText text_;
  Terms terms_;
  Slots slots_;
  Heads term_heads_, slot_heads_;
  lrt::detail::SharedArray<std::uint32_t, 6> predicates_;
  std::uint32_t live_ = 0, next_fresh_ = 0, far_ = 0;  // far_: triples in the table
  std::size_t dead_bytes_ = 0, bytes_ = 0;             // of texts of terms that no triple has; of all
  std::uint64_t origin_;                               // the same for all copies
  /// triples(), made at the first call.
  mutable std::mutex list_mutex_;
  mutable std::vector<Triple> list_;
  mutable std::atomic<bool> has_list_{false};
};

}  // namespace v0
}  // namespace lrt::rdf

// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/shared_graph.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <cstring>
#include <memory>
#include <new>
#include <utility>

#include "src/base/turns.hpp"
#include "src/rdf/term_hash.hpp"

namespace lrt::rdf {
inline namespace v0 {
namespace {

constexpr std::size_t text_block = 64 * 1024, long_text = 4 * 1024;
constexpr std::uint32_t first_buckets = 1'024;
constexpr std::uint32_t few = 8;  // a triple is searched in its chains up to this place, then in the table
/// Places and bytes that may be unused beyond the share that compact() allows.
constexpr std::size_t few_places = 1'024, few_bytes = 256 * 1024;
constexpr std::size_t max_unused_share = 8;  // one part of so many

std::uint32_t number(TermId id) noexcept { return static_cast<std::uint32_t>(id); }

std::uint64_t next_origin() noexcept {
  static std::atomic<std::uint64_t> last{0};
  return last.fetch_add(1, std::memory_order_relaxed) + 1;
}

}  // namespace

// ------------------------------------------------------------------------------------------------------------------ text

SharedText::Block* SharedText::make(std::size_t size) {
  auto* const block = new (::operator new(sizeof(Block) + size)) Block;
  block->size = static_cast<std::uint32_t>(size);
  return block;
}

void SharedText::release(Block* block) noexcept {
  if (block->owners.fetch_sub(1, std::memory_order_acq_rel) != 1) return;
  block->~Block();
  ::operator delete(block);
}

SharedText::SharedText(const SharedText& other)
    : blocks_(other.blocks_), last_(other.last_), used_(other.used_), first_(last_), first_before_(used_), first_used_(used_) {
  for (Block* block : blocks_) block->owners.fetch_add(1, std::memory_order_relaxed);
  other.was_copied_.store(true, std::memory_order_relaxed);
}

SharedText::~SharedText() {
  if (first_used_ != first_before_ && !was_copied_.load(std::memory_order_acquire)) {
    std::uint32_t claimed = first_used_;
    blocks_[first_]->claimed.compare_exchange_strong(claimed, first_before_, std::memory_order_acq_rel);
  }
  for (Block* block : blocks_) release(block);
}

/// Takes the next bytes of the last block, unless there are too few or another copy has taken them.
bool SharedText::claim(std::uint32_t size) noexcept {
  if (blocks_.empty()) return false;
  Block& block = *blocks_[last_];
  if (block.size - used_ < size) return false;
  std::uint32_t claimed = used_;
  return block.claimed.compare_exchange_strong(claimed, used_ + size, std::memory_order_acq_rel);
}

SharedText::Place SharedText::add(std::size_t size, lrt::FunctionRef<void(char*)> write) {
  const bool is_long = size > long_text;
  if (is_long || !claim(static_cast<std::uint32_t>(size))) {
    blocks_.reserve(blocks_.size() + 1 + (blocks_.size() == blocks_.capacity() ? blocks_.size() / 2 : 0));
    blocks_.push_back(make(is_long ? size : text_block));
    blocks_.back()->claimed.store(static_cast<std::uint32_t>(size), std::memory_order_relaxed);
    if (!is_long) last_ = blocks_.size() - 1, used_ = 0;
  }
  Place place{static_cast<std::uint32_t>(blocks_.size() - 1), 0};
  if (!is_long) {
    place = {static_cast<std::uint32_t>(last_), used_};
    used_ += static_cast<std::uint32_t>(size);
    if (last_ == first_) first_used_ = used_;
  }
  write(const_cast<char*>(at(place)));
  return place;
}

// ----------------------------------------------------------------------------------------------------------------- graph

SharedGraph::SharedGraph() : origin_(next_origin()) {
  static constexpr SharedGraphCalls calls{
      [](const SharedGraph& g, const TermView& term) noexcept { return g.find(term); },
      [](const SharedGraph& g, const Triple& triple) noexcept { return g.find(triple); },
      [](const SharedGraph& g, std::uint32_t id) noexcept { return g.term(id); },
      [](SharedGraph& g, const TermView& term) { return g.intern(term); },
      [](SharedGraph& g) { return g.fresh_blank(); },
      [](SharedGraph& g, const Triple& triple) { return g.add(triple); },
      [](const SharedGraph& g) -> const std::vector<Triple>& { return g.triples(); },
      [](const SharedGraph& g, std::uint32_t place) noexcept { return g.used_from(place); },
      [](const SharedGraph& g) { return new SharedGraph(g); },
      [](SharedGraph* g) noexcept { delete g; },
  };
  shared_graph_calls.store(&calls, std::memory_order_release);
  for (std::uint32_t i = 0; i < first_buckets; ++i) {
    term_heads_.push_back(none);
    slot_heads_.push_back(none);
  }
}

SharedGraph::SharedGraph(const SharedGraph& other)
    : text_(other.text_),
      terms_(other.terms_),
      slots_(other.slots_),
      term_heads_(other.term_heads_),
      slot_heads_(other.slot_heads_),
      predicates_(other.predicates_),
      live_(other.live_),
      next_fresh_(other.next_fresh_),
      far_(other.far_),
      dead_bytes_(other.dead_bytes_),
      bytes_(other.bytes_),
      origin_(other.origin_) {}

/// Terms and triples keep their numbers and places, so that nothing is looked up.
SharedGraph::SharedGraph(const Graph& plain, bool with_new_blanks) : SharedGraph() {
  assert(!plain.shared_);
  const auto count = static_cast<std::uint32_t>(plain.terms_.size());
  while (term_heads_.size() < count) term_heads_.push_back(none);
  next_fresh_ = with_new_blanks ? 0 : static_cast<std::uint32_t>(plain.fresh_.size());
  std::vector<bool> is_datatype(count);
  for (std::uint32_t id = 0; id < count; ++id) {
    if (id % Turns::units_between_rests == 0) Turns::rest_now();
    const Graph::Entry& from = plain.terms_[id];
    if (with_new_blanks && from.kind == TermKind::blank) {
      (void)fresh_blank();
    } else {
      const TermView term = plain.term(TermId{id});
      append(term, hash_of(term), from.datatype);
      if (from.datatype != none) is_datatype[from.datatype] = true;
    }
    TermEntry& entry = terms_.edit(id);
    for (int i = 0; i < 3; ++i) entry.chain[i] = {from.chain[i].first, from.chain[i].last, from.chain[i].count};
    entry.was_predicate = from.chain[1].count != 0;
    if (entry.was_predicate) predicates_.push_back(id);
  }
  for (std::uint32_t id = 0; id < count; ++id) {
    const TermEntry& entry = terms_[id];
    if (entry.chain[0].count + entry.chain[1].count + entry.chain[2].count != 0 || is_datatype[id]) continue;
    terms_.edit(id).is_dead = true;
    dead_bytes_ += entry.length + entry.language_length;
  }
  struct End {
    std::uint32_t last = none, count = 0;
  };
  std::vector<std::array<End, 3>> ends(count);  // of the chains up to a triple
  std::vector<std::uint32_t> far;
  for (std::uint32_t at = 0; at < plain.triples_.size(); ++at) {
    if (at % Turns::units_between_rests == 0) Turns::rest_now();
    Slot slot;
    slot.triple = plain.triples_[at];
    const std::uint32_t ids[3] = {number(slot.triple.subject), number(slot.triple.predicate), number(slot.triple.object)};
    bool is_far = true;
    for (int i = 0; i < 3; ++i) {
      End& end = ends[ids[i]][static_cast<std::size_t>(i)];
      slot.next[i] = plain.links_[at].next[i];
      slot.previous[i] = std::exchange(end.last, at);
      if (end.count++ < few) is_far = false;
    }
    if (is_far) far.push_back(at);
    slots_.push_back(slot);
  }
  live_ = slots_.size();
  far_ = static_cast<std::uint32_t>(far.size());
  while (slot_heads_.size() < far_) slot_heads_.push_back(none);
  for (std::size_t i = 0; i < far.size(); ++i) {
    if (i % Turns::units_between_rests == 0) Turns::rest_now();
    std::uint32_t& head = slot_heads_.edit(bucket_of(hash_of(slots_[far[i]].triple), slot_heads_.size()));
    slots_.edit(far[i]).next_same = std::exchange(head, far[i]);
  }
}

SharedGraph& SharedGraph::of(Graph& graph) {
  if (!graph.shared_) {
    Graph large;
    large.shared_ = SharedGraphPointer(new SharedGraph(graph, false));
    graph = std::move(large);
  }
  return *graph.shared_;
}

Graph SharedGraph::with_new_blanks(const Graph& graph) {
  Graph large;
  large.shared_ = SharedGraphPointer(new SharedGraph(graph, true));
  return large;
}

bool SharedGraph::has_much_unused(const Graph& graph) {
  if (!graph.shared_) return false;
  const SharedGraph& large = *graph.shared_;
  const std::size_t unused = large.slots_.size() - large.live_;
  return large.live_ < least_size / 2 || unused > large.live_ / max_unused_share + few_places ||
         large.dead_bytes_ > (large.bytes_ - large.dead_bytes_) / max_unused_share + few_bytes;
}

void SharedGraph::compact(Graph& graph) {
  if (!has_much_unused(graph)) return;
  const SharedGraph& large = *graph.shared_;
  const bool is_small = large.live_ < least_size / 2;
  Graph fresh;
  std::vector<std::uint32_t> numbers(large.term_count(), none);
  const auto same = [&](TermId id) {
    std::uint32_t& known = numbers[number(id)];
    if (known == none) known = number(fresh.intern(large.term(number(id))));
    return TermId{known};
  };
  for (std::uint32_t at = large.used_from(0); at != none; at = large.used_from(at + 1)) {
    const Triple& t = large.at(at);
    const TermId s = same(t.subject), p = same(t.predicate);
    fresh.add(s, p, same(t.object));
  }
  if (!is_small) of(fresh).next_fresh_ = large.next_fresh_;
  graph = std::move(fresh);
}

const std::vector<Triple>& SharedGraph::triples() const {
  if (!has_list_.load(std::memory_order_acquire)) {
    const std::lock_guard lock(list_mutex_);
    if (!has_list_.load(std::memory_order_relaxed)) {
      std::vector<Triple> all;
      all.reserve(live_);
      for (std::uint32_t at = used_from(0); at != none; at = used_from(at + 1)) all.push_back(slots_[at].triple);
      list_ = std::move(all);
      has_list_.store(true, std::memory_order_release);
    }
  }
  return list_;
}

std::uint32_t SharedGraph::used_from(std::uint32_t place) const noexcept {
  while (place < slots_.size() && !is_used(place)) ++place;
  return place < slots_.size() ? place : none;
}

std::vector<TermId> SharedGraph::predicates() const {
  std::vector<TermId> all;
  for (std::uint32_t i = 0; i < predicates_.size(); ++i)
    if (terms_[predicates_[i]].chain[1].count != 0) all.push_back(TermId{predicates_[i]});
  return all;
}

// Terms.

/// A hash table that grows by one bucket at a time (linear hashing), so that no change pays for all items.
std::uint32_t SharedGraph::bucket_of(std::uint32_t hash, std::uint32_t buckets) noexcept {
  std::uint32_t mask = buckets - 1;
  for (unsigned shift = 1; shift < 32; shift *= 2) mask |= mask >> shift;
  const std::uint32_t bucket = hash & mask;
  return bucket < buckets ? bucket : hash & (mask >> 1);
}

/// Splits buckets until there are as many as items.
template <class Items, class Hash>
void SharedGraph::grow(Heads& heads, Items& items, Hash hash_at, std::size_t wanted) {
  while (heads.size() < wanted) {
    const std::uint32_t made = heads.size();
    // The bucket that had the items of the new one: those whose hash has the new bit are moved.
    std::uint32_t bit = 1;
    while (bit <= made / 2) bit *= 2;
    const std::uint32_t split = made - bit;
    // Whatever can fail comes first.
    for (std::uint32_t at = heads[split]; at != none; at = items[at].next_same) (void)items.edit(at);
    (void)heads.edit(split);
    heads.push_back(none);
    std::uint32_t ends[2] = {none, none};
    std::uint32_t at = heads[split];
    heads.edit(split) = none;
    while (at != none) {
      const std::uint32_t next = items[at].next_same;
      const int side = bucket_of(hash_at(at), made + 1) == made;
      if (ends[side] == none) heads.edit(side ? made : split) = at;
      else items.edit(ends[side]).next_same = at;
      items.edit(at).next_same = none;
      ends[side] = at;
      at = next;
    }
  }
}

bool SharedGraph::equals(const TermEntry& entry, const TermView& term) const noexcept {
  if (entry.kind != term.kind || entry.length != term.text.size()) return false;
  const char* const bytes = text_.at(entry.text);
  if (entry.length != 0 && std::memcmp(bytes, term.text.data(), entry.length) != 0) return false;
  if (!term.is_literal()) return true;
  const TermEntry& datatype = terms_[entry.datatype];
  return std::string_view(text_.at(datatype.text), datatype.length) == datatype_of(term) &&
         equals_lower({bytes + entry.length, entry.language_length}, term.language);
}

std::uint32_t SharedGraph::find_hashed(const TermView& term, std::uint32_t hash) const noexcept {
  std::uint32_t at = term_heads_[bucket_of(hash, term_heads_.size())];
  while (at != none) {
    const TermEntry& entry = terms_[at];
    if (entry.hash == hash && equals(entry, term)) return at;
    at = entry.next_same;
  }
  return none;
}

std::uint32_t SharedGraph::find(const TermView& term) const noexcept { return find_hashed(term, hash_of(term)); }

TermView SharedGraph::term(std::uint32_t id) const noexcept {
  const TermEntry& entry = terms_[id];
  const char* const bytes = text_.at(entry.text);
  TermView view(entry.kind, std::string_view(bytes, entry.length));
  if (entry.datatype != none) {
    const TermEntry& datatype = terms_[entry.datatype];
    view.datatype = std::string_view(text_.at(datatype.text), datatype.length);
    view.language = std::string_view(bytes + entry.length, entry.language_length);
  }
  return view;
}

std::uint32_t SharedGraph::append(const TermView& term, std::uint32_t hash, std::uint32_t datatype) {
  const auto id = terms_.size();
  TermEntry entry;
  entry.length = static_cast<std::uint32_t>(term.text.size());
  entry.language_length = static_cast<std::uint32_t>(term.language.size());
  entry.datatype = datatype;
  entry.hash = hash;
  entry.kind = term.kind;
  entry.text = text_.add(term.text.size() + term.language.size(), [&](char* to) {
    if (!term.text.empty()) std::memcpy(to, term.text.data(), term.text.size());
    to += term.text.size();
    for (const char c : term.language) *to++ = lrt::detail::lower(c);
  });
  grow(
      term_heads_, terms_, [this](std::uint32_t at) { return terms_[at].hash; }, std::size_t{id} + 1);
  std::uint32_t& head = term_heads_.edit(bucket_of(hash, term_heads_.size()));
  entry.next_same = head;
  terms_.push_back(entry);
  head = id;
  bytes_ += entry.length + entry.language_length;
  return id;
}

/// Texts never move, so that the views may be of this graph.
std::uint32_t SharedGraph::intern(const TermView& term) {
  const std::uint32_t hash = hash_of(term);
  if (const std::uint32_t id = find_hashed(term, hash); id != none) return id;
  const std::uint32_t datatype = term.is_literal() ? intern(iri(datatype_of(term))) : none;
  return append(term, hash, datatype);
}

std::uint32_t SharedGraph::fresh_blank() {
  for (;;) {
    char label[12] = {'b'};
    const auto end = std::to_chars(label + 1, label + sizeof label, next_fresh_).ptr;
    ++next_fresh_;
    const TermView term = blank({label, static_cast<std::size_t>(end - label)});
    const std::uint32_t hash = hash_of(term);
    if (find_hashed(term, hash) == none) return append(term, hash, none);
  }
}

// Triples.

/// A triple is among the first few of one of its chains, or it is in the table. Most chains are shorter.
std::uint32_t SharedGraph::find(const Triple& triple) const noexcept {
  const std::uint32_t ids[3] = {number(triple.subject), number(triple.predicate), number(triple.object)};
  const Chain* chains[3];
  for (int i = 0; i < 3; ++i) chains[i] = &terms_[ids[i]].chain[i];
  const auto search = [&](int i) {
    std::uint32_t at = chains[i]->first;
    for (std::uint32_t n = 0; at != none && n < few; ++n, at = slots_[at].next[i])
      if (slots_[at].triple == triple) return at;
    return none;
  };
  int shortest = chains[0]->count <= chains[2]->count ? 0 : 2;
  if (chains[1]->count < chains[shortest]->count) shortest = 1;
  if (chains[shortest]->count <= few) return search(shortest);
  for (int i = 0; i < 3; ++i)
    if (const std::uint32_t at = search(i); at != none) return at;
  std::uint32_t at = slot_heads_[bucket_of(hash_of(triple), slot_heads_.size())];
  while (at != none && !(slots_[at].triple == triple)) at = slots_[at].next_same;
  return at;
}

bool SharedGraph::add(const Triple& triple) {
  if (find(triple) != none) return false;
  const std::uint32_t at = slots_.size();
  const std::uint32_t ids[3] = {number(triple.subject), number(triple.predicate), number(triple.object)};
  // Whatever can fail comes first; then each block belongs to this copy.
  bool is_far = true;
  for (int i = 0; i < 3; ++i) is_far = is_far && terms_[ids[i]].chain[i].count >= few;
  if (is_far) {
    const auto hash_at = [this](std::uint32_t i) { return hash_of(slots_[i].triple); };
    grow(slot_heads_, slots_, hash_at, std::size_t{far_} + 1);
  }
  Slot slot;
  slot.triple = triple;
  for (int i = 0; i < 3; ++i) {
    slot.previous[i] = terms_.edit(ids[i]).chain[i].last;
    if (slot.previous[i] != none) (void)slots_.edit(slot.previous[i]);
  }
  std::uint32_t* const head = is_far ? &slot_heads_.edit(bucket_of(hash_of(triple), slot_heads_.size())) : nullptr;
  if (head) slot.next_same = *head;
  if (!terms_[ids[1]].was_predicate) predicates_.push_back(ids[1]), terms_.edit(ids[1]).was_predicate = true;
  slots_.push_back(slot);
  if (head) *head = at, ++far_;
  for (int i = 0; i < 3; ++i) {
    TermEntry& entry = terms_.edit(ids[i]);
    if (entry.chain[0].count + entry.chain[1].count + entry.chain[2].count == 0 && entry.is_dead) {
      entry.is_dead = false;
      dead_bytes_ -= entry.length + entry.language_length;
    }
    Chain& chain = entry.chain[i];
    if (chain.last == none) chain.first = at;
    else slots_.edit(chain.last).next[i] = at;
    chain.last = at;
    ++chain.count;
  }
  ++live_;
  has_list_.store(false, std::memory_order_relaxed);
  return true;
}

bool SharedGraph::remove(const Triple& triple) {
  const std::uint32_t at = find(triple);
  if (at == none) return false;
  const std::uint32_t ids[3] = {number(triple.subject), number(triple.predicate), number(triple.object)};
  const std::uint32_t bucket = bucket_of(hash_of(triple), slot_heads_.size());
  std::uint32_t before = none, same = slot_heads_[bucket];
  for (; same != none && same != at; same = slots_[same].next_same) before = same;
  const bool is_far = same == at;
  // Whatever can fail comes first; then each block belongs to this copy.
  if (is_far) (void)slot_heads_.edit(bucket);
  if (is_far && before != none) (void)slots_.edit(before);
  (void)slots_.edit(at);
  for (int i = 0; i < 3; ++i) {
    (void)terms_.edit(ids[i]);
    for (const std::uint32_t beside : {slots_[at].previous[i], slots_[at].next[i]})
      if (beside != none) (void)slots_.edit(beside);
  }
  Slot& slot = slots_.edit(at);
  if (is_far) (before == none ? slot_heads_.edit(bucket) : slots_.edit(before).next_same) = slot.next_same, --far_;
  for (int i = 0; i < 3; ++i) {
    TermEntry& entry = terms_.edit(ids[i]);
    Chain& chain = entry.chain[i];
    (slot.previous[i] == none ? chain.first : slots_.edit(slot.previous[i]).next[i]) = slot.next[i];
    (slot.next[i] == none ? chain.last : slots_.edit(slot.next[i]).previous[i]) = slot.previous[i];
    --chain.count;
    if (entry.chain[0].count + entry.chain[1].count + entry.chain[2].count == 0 && !entry.is_dead) {
      entry.is_dead = true;
      dead_bytes_ += entry.length + entry.language_length;
    }
  }
  slot = Slot{};
  --live_;
  has_list_.store(false, std::memory_order_relaxed);
  return true;
}

void SharedGraph::for_each_changed_place(const SharedGraph& before, const SharedGraph& after, lrt::FunctionRef<void(std::uint32_t)> visit) {
  Slots::for_each_difference(before.slots_, after.slots_, [&](std::uint32_t from, std::uint32_t end) {
    for (; from < end; ++from) visit(from);
  });
}

}  // namespace v0
}  // namespace lrt::rdf

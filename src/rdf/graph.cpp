// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/graph.hpp>

#include <cassert>
#include <charconv>
#include <functional>

#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/rdf/shared_graph.hpp"
#include "src/rdf/term_hash.hpp"

namespace lrt::rdf {
namespace {

// Enough for the graph of a typical property.
constexpr std::size_t first_terms = 32, first_triples = 16, first_bytes = 1024;
constexpr std::uint32_t few = 8;  // a triple is searched in its chains up to this place, then by its hash

std::uint32_t number(TermId id) noexcept { return static_cast<std::uint32_t>(id); }

bool points_into(std::string_view text, const std::string& pool) noexcept {
  const std::less<const char*> before;
  return !text.empty() && !before(text.data(), pool.data()) && before(text.data(), pool.data() + pool.size());
}

bool points_into(const TermView& term, const std::string& pool) noexcept {
  return points_into(term.text, pool) || points_into(term.datatype, pool) || points_into(term.language, pool);
}

const SharedGraphCalls& calls() noexcept { return *shared_graph_calls.load(std::memory_order_acquire); }

}  // namespace

inline namespace v0 {
std::atomic<const SharedGraphCalls*> shared_graph_calls{nullptr};

std::size_t SharedGraphPointer::size() const noexcept { return graph_->size(); }
std::size_t SharedGraphPointer::term_count() const noexcept { return graph_->term_count(); }
const Triple& SharedGraphPointer::at(std::uint32_t place) const noexcept { return graph_->at(place); }
const std::vector<Triple>& SharedGraphPointer::triples() const { return calls().triples(*graph_); }
SharedGraph* SharedGraphPointer::copy_of(const SharedGraph& graph) { return calls().copy(graph); }
void SharedGraphPointer::destroy(SharedGraph* graph) noexcept { calls().destroy(graph); }
}  // namespace v0

bool Graph::equals(const Entry& entry, const TermView& term) const noexcept {
  const std::string_view pool = text_;
  if (entry.kind != term.kind || pool.substr(entry.offset, entry.length) != term.text) return false;
  if (!term.is_literal()) return true;
  const Entry& datatype = terms_[entry.datatype];
  return pool.substr(datatype.offset, datatype.length) == datatype_of(term) &&
         equals_lower(pool.substr(entry.offset + entry.length, entry.language_length), term.language);
}

std::uint32_t Graph::find_hashed(const TermView& term, std::uint32_t hash) const noexcept {
  return term_index_.find(hash, [&](std::uint32_t at) { return equals(terms_[at], term); });
}

/// The blank node of fresh_blank() with this label, or none.
std::uint32_t Graph::find_fresh(const TermView& term) const noexcept {
  if (!term.is_blank() || fresh_.empty() || term.text.size() < 2 || term.text.size() > 10 || term.text[0] != 'b') return none;
  if (term.text[1] == '0' && term.text.size() > 2) return none;
  std::size_t n = 0;
  for (const char c : term.text.substr(1)) {
    if (!lrt::detail::is_digit(c)) return none;
    n = n * 10 + static_cast<std::size_t>(c - '0');
  }
  return n < fresh_.size() ? fresh_[n] : none;
}

/// Adds a new term without adding it to the index.
std::uint32_t Graph::append(const TermView& term, std::uint32_t datatype) {
  const auto id = static_cast<std::uint32_t>(terms_.size());
  if (terms_.empty()) {
    terms_.reserve(first_terms);
    text_.reserve(first_bytes);
  }
  const auto offset = static_cast<std::uint32_t>(text_.size());
  text_.append(term.text);
  for (const char c : term.language) text_.push_back(lrt::detail::lower(c));
  assert(text_.size() < none && "a graph holds less than 4 GiB of text");
  terms_.push_back({offset, static_cast<std::uint32_t>(term.text.size()), static_cast<std::uint32_t>(term.language.size()), datatype, term.kind, {}});
  return id;
}

TermId Graph::intern(const TermView& term) {
  if (shared_) return TermId{calls().intern(*shared_, term)};
  if (const std::uint32_t id = find_fresh(term); id != none) return TermId{id};
  const std::uint32_t hash = hash_of(term);
  if (const std::uint32_t id = find_hashed(term, hash); id != none) return TermId{id};
  if (points_into(term, text_)) {  // its views point into text_, which may be reallocated
    const Term copy(term);
    return intern(copy.view());
  }
  const std::uint32_t datatype = term.is_literal() ? number(intern(iri(datatype_of(term)))) : none;
  const std::uint32_t id = append(term, datatype);
  term_index_.insert(hash, id);
  if (term.is_blank()) has_given_labels_ = true;
  return TermId{id};
}

std::optional<TermId> Graph::find(const TermView& term) const noexcept {
  if (shared_) {
    const std::uint32_t known = calls().find(*shared_, term);
    return known == none ? std::nullopt : std::optional<TermId>(TermId{known});
  }
  if (terms_.empty()) return std::nullopt;
  std::uint32_t id = find_fresh(term);
  if (id == none) id = find_hashed(term, hash_of(term));
  return id == none ? std::nullopt : std::optional<TermId>(TermId{id});
}

TermView Graph::term(TermId id) const noexcept {
  if (shared_) return calls().term(*shared_, number(id));
  assert(number(id) < terms_.size());
  const std::string_view pool = text_;
  const Entry& entry = terms_[number(id)];
  TermView view(entry.kind, pool.substr(entry.offset, entry.length));
  if (entry.datatype != none) {
    const Entry& datatype = terms_[entry.datatype];
    view.datatype = pool.substr(datatype.offset, datatype.length);
    view.language = pool.substr(entry.offset + entry.length, entry.language_length);
  }
  return view;
}

TermId Graph::fresh_blank() {
  if (shared_) return TermId{calls().fresh_blank(*shared_)};
  for (;;) {
    char label[12] = {'b'};
    const auto end = std::to_chars(label + 1, label + sizeof label, fresh_.size()).ptr;
    const TermView term = blank({label, static_cast<std::size_t>(end - label)});
    const std::uint32_t given = has_given_labels_ ? find_hashed(term, hash_of(term)) : none;
    fresh_.push_back(given != none ? given : append(term, none));
    if (given == none) return TermId{fresh_.back()};
  }
}

bool Graph::add(const TermView& subject, const TermView& predicate, const TermView& object) {
  if (points_into(predicate, text_) || points_into(object, text_)) {
    // Interning the first term may reallocate the text that the other views point to.
    const Term p(predicate), o(object);
    const TermId s = intern(subject);
    const TermId p_id = intern(p);
    return add(s, p_id, intern(o));
  }
  const TermId s = intern(subject);
  const TermId p = intern(predicate);
  return add(s, p, intern(object));
}

bool Graph::add(TermId subject, TermId predicate, TermId object) {
  if (shared_) return calls().add(*shared_, {subject, predicate, object});
  assert(number(subject) < terms_.size() && terms_[number(subject)].kind != TermKind::literal);
  assert(number(predicate) < terms_.size() && terms_[number(predicate)].kind == TermKind::iri);
  assert(number(object) < terms_.size());
  const Triple triple{subject, predicate, object};
  if (find(triple) != none) return false;
  if (triples_.empty()) {
    triples_.reserve(first_triples);
    links_.reserve(first_triples);
  }
  const auto at = static_cast<std::uint32_t>(triples_.size());
  triples_.push_back(triple);
  links_.push_back({{none, none, none}});
  bool is_far = true;
  const TermId ids[3] = {subject, predicate, object};
  for (int i = 0; i < 3; ++i) {
    Chain& chain = terms_[number(ids[i])].chain[i];
    if (chain.last == none) {
      chain.first = at;
    } else {
      links_[chain.last].next[i] = at;
    }
    chain.last = at;
    if (chain.count++ < few) is_far = false;
  }
  if (is_far) triple_index_.insert(hash_of(triple), at);
  return true;
}

/// A triple is among the first few of one of its chains, or it is in triple_index_. Most chains are shorter.
std::uint32_t Graph::find(const Triple& triple) const noexcept {
  const TermId ids[3] = {triple.subject, triple.predicate, triple.object};
  const Chain* chains[3];
  for (int i = 0; i < 3; ++i) chains[i] = &terms_[number(ids[i])].chain[i];
  const auto search = [&](int i) {
    std::uint32_t at = chains[i]->first;
    for (std::uint32_t n = 0; at != none && n < few; ++n, at = links_[at].next[i]) {
      if (triples_[at] == triple) return at;
    }
    return none;
  };
  int shortest = chains[0]->count <= chains[2]->count ? 0 : 2;
  if (chains[1]->count < chains[shortest]->count) shortest = 1;
  if (chains[shortest]->count <= few) return search(shortest);
  for (int i = 0; i < 3; ++i) {
    if (const std::uint32_t at = search(i); at != none) return at;
  }
  return triple_index_.find(hash_of(triple), [&](std::uint32_t at) { return triples_[at] == triple; });
}

void Graph::merge(const Graph& other) {
  if (this == &other) return;
  std::vector<std::uint32_t> ids(other.term_count(), none);
  const auto translate = [&](TermId id) {
    std::uint32_t& mine = ids[number(id)];
    if (mine == none) mine = number(intern(other.term(id)));
    return TermId{mine};
  };
  const auto take = [&](const Triple& t) {
    const TermId s = translate(t.subject);
    const TermId p = translate(t.predicate);
    add(s, p, translate(t.object));
  };
  for (const Triple& t : other.triples_) take(t);
  if (other.shared_)
    for (const Triple& t : other.match(std::nullopt, std::nullopt, std::nullopt)) take(t);
}

bool Graph::contains(TermId subject, TermId predicate, TermId object) const noexcept { return !match(subject, predicate, object).empty(); }

bool Graph::contains(const TermView& subject, const TermView& predicate, const TermView& object) const noexcept {
  return !match(&subject, &predicate, &object).empty();
}

Graph::Matches Graph::match(std::optional<TermId> subject, std::optional<TermId> predicate, std::optional<TermId> object) const noexcept {
  Matches matches(this);
  if (empty()) return matches;
  const std::optional<TermId> bound[3] = {subject, predicate, object};
  if (subject && predicate && object) {
    matches.position_ = 4;  // one triple, no chain
    const Triple wanted{*subject, *predicate, *object};
    matches.first_ = shared_ ? calls().find_triple(*shared_, wanted) : find(wanted);
    return matches;
  }
  std::uint32_t shortest = none;
  for (int i = 0; i < 3; ++i) {
    if (!bound[i]) continue;
    assert(number(*bound[i]) < term_count());
    matches.wanted_[i] = number(*bound[i]);
    const auto choose = [&](std::uint32_t first, std::uint32_t count) {
      if (count >= shortest) return;
      shortest = count;
      matches.position_ = i;
      matches.first_ = first;
    };
    if (shared_) {
      const SharedGraph::Chain& chain = (*shared_).chain(number(*bound[i]), i);
      choose(chain.first, chain.count);
    } else {
      const Chain& chain = terms_[number(*bound[i])].chain[i];
      choose(chain.first, chain.count);
    }
  }
  if (matches.position_ == 3) {
    matches.first_ = shared_ ? calls().used_from(*shared_, 0) : 0;
  } else if (matches.first_ != none && !matches.fits(matches.first_)) {
    matches.first_ = matches.next(matches.first_);
  }
  return matches;
}

Graph::Matches Graph::match(const TermView* subject, const TermView* predicate, const TermView* object) const noexcept {
  const TermView* terms[3] = {subject, predicate, object};
  std::optional<TermId> ids[3];
  for (int i = 0; i < 3; ++i) {
    if (terms[i] == nullptr) continue;
    ids[i] = find(*terms[i]);
    if (!ids[i]) return Matches(this);
  }
  return match(ids[0], ids[1], ids[2]);
}

bool Graph::Matches::fits(std::uint32_t at) const noexcept {
  const Triple& t = graph_->at(at);
  return (wanted_[0] == none || wanted_[0] == number(t.subject)) && (wanted_[1] == none || wanted_[1] == number(t.predicate)) &&
         (wanted_[2] == none || wanted_[2] == number(t.object));
}

std::uint32_t Graph::Matches::next(std::uint32_t at) const noexcept {
  if (position_ == 4) return none;
  if (graph_->shared_) {
    const SharedGraph& shared = *graph_->shared_;
    if (position_ == 3) return calls().used_from(shared, at + 1);
    do { at = shared.next(at, position_); } while (at != none && !fits(at));
    return at;
  }
  if (position_ == 3) return at + 1 < graph_->triples_.size() ? at + 1 : none;
  do { at = graph_->links_[at].next[position_]; } while (at != none && !fits(at));
  return at;
}

std::optional<TermId> Graph::object(TermId subject, TermId predicate) const noexcept {
  const Matches matches = match(subject, predicate, std::nullopt);
  if (matches.empty()) return std::nullopt;
  return matches.begin()->object;
}

std::optional<TermView> Graph::object(const TermView& subject, const TermView& predicate) const noexcept {
  const Matches matches = match(&subject, &predicate, nullptr);
  if (matches.empty()) return std::nullopt;
  return term(matches.begin()->object);
}

std::vector<TermView> Graph::objects(const TermView& subject, const TermView& predicate) const {
  std::vector<TermView> found;
  for (const Triple& t : match(&subject, &predicate, nullptr)) found.push_back(term(t.object));
  return found;
}

std::vector<TermView> Graph::subjects(const TermView& predicate, const TermView& object) const {
  std::vector<TermView> found;
  for (const Triple& t : match(nullptr, &predicate, &object)) found.push_back(term(t.subject));
  return found;
}

TermId Graph::add_list(const std::vector<TermId>& members, std::vector<TermId> cells) {
  const TermId nil = intern(vocab::rdf_::nil);
  if (members.empty()) return nil;
  cells.reserve(members.size());
  while (cells.size() < members.size()) cells.push_back(fresh_blank());
  for (std::size_t i = 0; i < members.size(); ++i) {
    const TermId first = intern(vocab::rdf_::first), rest = intern(vocab::rdf_::rest);
    add(cells[i], first, members[i]);
    add(cells[i], rest, i + 1 < members.size() ? cells[i + 1] : nil);
  }
  return cells.front();
}

std::optional<std::vector<TermId>> Graph::list(TermId head) const {
  std::vector<TermId> members;
  const auto first = find(vocab::rdf_::first), rest = find(vocab::rdf_::rest), nil = find(vocab::rdf_::nil);
  if (nil && head == *nil) return members;
  if (!first || !rest || !nil) return std::nullopt;
  const auto only = [this](TermId subject, TermId predicate) -> std::optional<TermId> {
    const Matches matches = match(subject, predicate, std::nullopt);
    if (matches.empty()) return std::nullopt;
    auto it = matches.begin();
    const TermId object = it->object;
    return ++it == matches.end() ? std::optional<TermId>(object) : std::nullopt;
  };
  for (TermId cell = head; cell != *nil;) {
    const auto member = only(cell, *first), next = only(cell, *rest);
    if (!member || !next || members.size() >= size()) return std::nullopt;  // more cells than triples: a cycle
    members.push_back(*member);
    cell = *next;
  }
  return members;
}

}  // namespace lrt::rdf

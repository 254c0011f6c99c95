#include <lrt/rdf/graph.hpp>

#include <cassert>
#include <functional>

#include <lrt/rdf/vocab.hpp>

#include "src/rdf/hash.hpp"

namespace lrt::rdf {
namespace {

constexpr std::size_t first_term_slots = 64;  // at most half full; enough for the graph of a typical property
constexpr std::size_t first_triple_slots = 32;

std::uint32_t number(TermId id) noexcept { return static_cast<std::uint32_t>(id); }

char lower(char c) noexcept { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; }

bool equals_lower(std::string_view lowered, std::string_view text) noexcept {
  if (lowered.size() != text.size()) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (lowered[i] != lower(text[i])) return false;
  }
  return true;
}

/// Sets the datatype of a literal if the caller left it empty.
std::string_view datatype_of(const TermView& term) noexcept {
  if (!term.language.empty()) return vocab::rdf_::langString.text;
  return term.datatype.empty() ? vocab::xsd::string.text : term.datatype;
}

std::uint64_t hash_triple(TermId s, TermId p, TermId o) noexcept { return rdf::hash_triple(number(s), number(p), number(o)); }

bool points_into(std::string_view text, const std::string& pool) noexcept {
  const std::less<const char*> before;
  return !text.empty() && !before(text.data(), pool.data()) && before(text.data(), pool.data() + pool.size());
}

bool points_into(const TermView& term, const std::string& pool) noexcept {
  return points_into(term.text, pool) || points_into(term.datatype, pool) || points_into(term.language, pool);
}

}  // namespace

std::uint32_t Graph::hash_of(const TermView& term) const noexcept {
  std::uint64_t h = hash_bytes(term.text, hash_seeds().bytes + static_cast<std::uint64_t>(term.kind));
  if (term.is_literal()) {
    h = hash_bytes(datatype_of(term), h);
    for (const char c : term.language) h = fold_multiply(h ^ static_cast<unsigned char>(lower(c)), 0xE7037ED1A0B428DBu);
  }
  return static_cast<std::uint32_t>(h ^ (h >> 32));
}

bool Graph::equals(const Entry& entry, const TermView& term) const noexcept {
  const std::string_view pool = text_;
  if (entry.kind != term.kind || pool.substr(entry.offset, entry.length) != term.text) return false;
  if (!term.is_literal()) return true;
  const Entry& datatype = terms_[entry.datatype];
  return pool.substr(datatype.offset, datatype.length) == datatype_of(term) &&
         equals_lower(pool.substr(entry.language_offset, entry.language_length), term.language);
}

void Graph::grow_terms() {
  const std::size_t size = term_slots_.empty() ? first_term_slots : term_slots_.size() * 2;
  if (term_slots_.empty()) {
    terms_.reserve(size / 2);
    text_.reserve(1024);
  }
  term_slots_.assign(size, none);
  for (std::uint32_t i = 0; i < terms_.size(); ++i) {
    std::size_t slot = terms_[i].hash & (size - 1);
    while (term_slots_[slot] != none) slot = (slot + 1) & (size - 1);
    term_slots_[slot] = i;
  }
}

void Graph::grow_triples() {
  const std::size_t size = triple_slots_.empty() ? first_triple_slots : triple_slots_.size() * 2;
  if (triple_slots_.empty()) {
    triples_.reserve(size / 2);
    links_.reserve(size / 2);
  }
  triple_slots_.assign(size, none);
  for (std::uint32_t i = 0; i < triples_.size(); ++i) {
    const Triple& t = triples_[i];
    std::size_t slot = hash_triple(t.subject, t.predicate, t.object) & (size - 1);
    while (triple_slots_[slot] != none) slot = (slot + 1) & (size - 1);
    triple_slots_[slot] = i;
  }
}

TermId Graph::intern(const TermView& term) {
  if ((terms_.size() + 2) * 2 > term_slots_.size()) grow_terms();  // 2: the term and its datatype
  const std::uint32_t hash = hash_of(term);
  const std::size_t mask = term_slots_.size() - 1;
  for (std::size_t slot = hash & mask; term_slots_[slot] != none; slot = (slot + 1) & mask) {
    const Entry& entry = terms_[term_slots_[slot]];
    if (entry.hash == hash && equals(entry, term)) return TermId{term_slots_[slot]};
  }
  if (points_into(term, text_)) {  // its views point into text_, which may be reallocated
    const Term copy(term);
    return intern(copy.view());
  }
  std::uint32_t datatype = none;
  if (term.is_literal()) datatype = number(intern(iri(datatype_of(term))));

  Entry entry{
      term.kind, static_cast<std::uint32_t>(text_.size()), static_cast<std::uint32_t>(term.text.size()), datatype, 0, 0, hash,
      {}};
  text_.append(term.text);
  if (!term.language.empty()) {
    entry.language_offset = static_cast<std::uint32_t>(text_.size());
    entry.language_length = static_cast<std::uint32_t>(term.language.size());
    for (const char c : term.language) text_.push_back(lower(c));
  }
  assert(text_.size() < none && "a graph holds less than 4 GiB of text");
  const auto id = static_cast<std::uint32_t>(terms_.size());
  terms_.push_back(entry);
  std::size_t slot = hash & mask;
  while (term_slots_[slot] != none) slot = (slot + 1) & mask;
  term_slots_[slot] = id;
  return TermId{id};
}

std::optional<TermId> Graph::find(const TermView& term) const noexcept {
  if (term_slots_.empty()) return std::nullopt;
  const std::uint32_t hash = hash_of(term);
  const std::size_t mask = term_slots_.size() - 1;
  for (std::size_t slot = hash & mask; term_slots_[slot] != none; slot = (slot + 1) & mask) {
    const Entry& entry = terms_[term_slots_[slot]];
    if (entry.hash == hash && equals(entry, term)) return TermId{term_slots_[slot]};
  }
  return std::nullopt;
}

TermView Graph::term(TermId id) const noexcept {
  assert(number(id) < terms_.size());
  const std::string_view pool = text_;
  const Entry& entry = terms_[number(id)];
  TermView view(entry.kind, pool.substr(entry.offset, entry.length));
  if (entry.datatype != none) {
    const Entry& datatype = terms_[entry.datatype];
    view.datatype = pool.substr(datatype.offset, datatype.length);
    view.language = pool.substr(entry.language_offset, entry.language_length);
  }
  return view;
}

TermId Graph::fresh_blank() {
  std::string label;
  do { label = "b" + std::to_string(next_blank_++); } while (find(blank(label)));
  return intern(blank(label));
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
  assert(number(subject) < terms_.size() && terms_[number(subject)].kind != TermKind::literal);
  assert(number(predicate) < terms_.size() && terms_[number(predicate)].kind == TermKind::iri);
  assert(number(object) < terms_.size());
  if ((triples_.size() + 1) * 2 > triple_slots_.size()) grow_triples();
  const Triple triple{subject, predicate, object};
  const std::size_t mask = triple_slots_.size() - 1;
  std::size_t slot = hash_triple(subject, predicate, object) & mask;
  for (; triple_slots_[slot] != none; slot = (slot + 1) & mask) {
    if (triples_[triple_slots_[slot]] == triple) return false;
  }
  const auto at = static_cast<std::uint32_t>(triples_.size());
  triples_.push_back(triple);
  links_.push_back({{none, none, none}});
  triple_slots_[slot] = at;
  const TermId ids[3] = {subject, predicate, object};
  for (int i = 0; i < 3; ++i) {
    Chain& chain = terms_[number(ids[i])].chain[i];
    if (chain.last == none) {
      chain.first = at;
    } else {
      links_[chain.last].next[i] = at;
    }
    chain.last = at;
    ++chain.count;
  }
  return true;
}

void Graph::merge(const Graph& other) {
  if (this == &other) return;
  std::vector<std::uint32_t> ids(other.terms_.size(), none);
  const auto translate = [&](TermId id) {
    std::uint32_t& mine = ids[number(id)];
    if (mine == none) mine = number(intern(other.term(id)));
    return TermId{mine};
  };
  for (const Triple& t : other.triples_) {
    const TermId s = translate(t.subject);
    const TermId p = translate(t.predicate);
    add(s, p, translate(t.object));
  }
}

bool Graph::contains(TermId subject, TermId predicate, TermId object) const noexcept {
  return !match(subject, predicate, object).empty();
}

bool Graph::contains(const TermView& subject, const TermView& predicate, const TermView& object) const noexcept {
  return !match(&subject, &predicate, &object).empty();
}

Graph::Matches Graph::match(std::optional<TermId> subject, std::optional<TermId> predicate,
                            std::optional<TermId> object) const noexcept {
  Matches matches(this);
  if (triples_.empty()) return matches;
  const std::optional<TermId> bound[3] = {subject, predicate, object};
  if (subject && predicate && object) {
    matches.position_ = 4;  // one triple, no chain
    const std::size_t mask = triple_slots_.size() - 1;
    std::size_t slot = hash_triple(*subject, *predicate, *object) & mask;
    for (; triple_slots_[slot] != none; slot = (slot + 1) & mask) {
      if (triples_[triple_slots_[slot]] == Triple{*subject, *predicate, *object}) matches.first_ = triple_slots_[slot];
    }
    return matches;
  }
  std::uint32_t shortest = none;
  for (int i = 0; i < 3; ++i) {
    if (!bound[i]) continue;
    assert(number(*bound[i]) < terms_.size());
    matches.wanted_[i] = number(*bound[i]);
    const Chain& chain = terms_[number(*bound[i])].chain[i];
    if (chain.count < shortest) {
      shortest = chain.count;
      matches.position_ = i;
      matches.first_ = chain.first;
    }
  }
  if (matches.position_ == 3) {
    matches.first_ = 0;
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
  const Triple& t = graph_->triples_[at];
  return (wanted_[0] == none || wanted_[0] == number(t.subject)) && (wanted_[1] == none || wanted_[1] == number(t.predicate)) &&
         (wanted_[2] == none || wanted_[2] == number(t.object));
}

std::uint32_t Graph::Matches::next(std::uint32_t at) const noexcept {
  if (position_ == 4) return none;
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
    add(cells[i], rest, i + 1 < cells.size() ? cells[i + 1] : nil);
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
    if (!member || !next || members.size() >= triples_.size()) return std::nullopt;  // more cells than triples: a cycle
    members.push_back(*member);
    cell = *next;
  }
  return members;
}

}  // namespace lrt::rdf

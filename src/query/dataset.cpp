// SPDX-License-Identifier: Apache-2.0
#include "src/query/dataset.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include "src/rdf/hash.hpp"

namespace lrt::query {
namespace {

// Below these sizes the memory is not compacted.
constexpr std::size_t few_bytes = 64 * 1024, few_entries = 4'096;

std::uint32_t hash_of(const rdf::TermView& term, GraphNumber scope) noexcept {
  std::uint64_t h = rdf::hash_bytes(term.text, rdf::hash_seeds().bytes + static_cast<std::uint64_t>(term.kind));
  if (term.is_literal()) {
    h = rdf::hash_bytes(term.language.empty() ? term.datatype : term.language, h);
  } else if (term.is_blank()) {
    h = rdf::fold_multiply(h ^ scope, 0xE7037ED1A0B428DBu);
  }
  return rdf::to_32_bits(h);
}
std::uint32_t hash_of(const NumberedTriple& t) noexcept { return rdf::to_32_bits(rdf::hash_triple(t.subject, t.predicate, t.object)); }
std::uint32_t hash_of(std::uint32_t a, std::uint32_t b) noexcept { return rdf::to_32_bits(rdf::hash_triple(a, 0, b)); }

template <class T>
std::uint32_t take(std::vector<T>& entries, std::vector<std::uint32_t>& free, const T& value) {
  if (!free.empty()) {
    const std::uint32_t at = free.back();
    free.pop_back();
    entries[at] = value;
    return at;
  }
  entries.push_back(value);
  free.reserve(entries.capacity());  // so that releasing memory cannot fail
  return static_cast<std::uint32_t>(entries.size() - 1);
}

template <class T>
std::size_t bytes_of(const std::vector<T>& v) noexcept {
  return v.capacity() * sizeof(T);
}

}  // namespace

std::size_t Dataset::bytes() const noexcept {
  std::size_t free = 0;
  for (const auto* list : {&free_terms_, &free_subject_groups_, &free_object_groups_, &free_predicates_, &free_triples_, &free_quads_, &free_graphs_})
    free += bytes_of(*list);
  return text_.capacity() + bytes_of(terms_) + bytes_of(readings_) + bytes_of(subject_groups_) + bytes_of(object_groups_) + bytes_of(predicates_) +
         bytes_of(triples_) + bytes_of(quads_) + bytes_of(graphs_) + free + term_index_.bytes() + subject_index_.bytes() + object_index_.bytes() +
         triple_index_.bytes() + quad_index_.bytes();
}

rdf::TermView Dataset::term(TermNumber number) const noexcept {
  assert(number < terms_.size());
  const std::string_view pool = text_;
  const TermEntry& entry = terms_[number];
  rdf::TermView view(entry.kind, pool.substr(entry.offset, entry.length));
  if (entry.datatype != nothing) {
    const TermEntry& datatype = terms_[entry.datatype];
    view.datatype = pool.substr(datatype.offset, datatype.length);
    view.language = pool.substr(entry.offset + entry.length, entry.language_length);
  }
  return view;
}

TermNumber Dataset::find(const rdf::TermView& term, GraphNumber scope, std::uint32_t hash) const noexcept {
  return term_index_.find(hash, [&](std::uint32_t at) {
    return terms_[at].length == term.text.size() && (terms_[at].kind != rdf::TermKind::blank || terms_[at].scope == scope) && this->term(at) == term;
  });
}

TermNumber Dataset::find(const rdf::TermView& term) const noexcept { return term.is_blank() ? nothing : find(term, nothing, hash_of(term, nothing)); }

/// A term that is new has no uses yet.
TermNumber Dataset::intern(const rdf::TermView& term, GraphNumber scope) {
  if (!term.is_blank()) scope = nothing;
  const std::uint32_t hash = hash_of(term, scope);
  if (const TermNumber known = find(term, scope, hash); known != nothing) return known;
  TermEntry entry;
  if (term.is_literal()) {
    entry.datatype = intern(rdf::iri(term.datatype), nothing);
    use(entry.datatype);
  }
  entry.offset = static_cast<std::uint32_t>(text_.size());
  entry.length = static_cast<std::uint32_t>(term.text.size());
  entry.language_length = static_cast<std::uint32_t>(term.language.size());
  entry.hash = hash;
  entry.scope = scope;
  entry.kind = term.kind;
  text_.append(term.text).append(term.language);
  assert(text_.size() < nothing && "a dataset holds less than 4 GiB of text");
  const TermNumber number = take(terms_, free_terms_, entry);
  if (readings_.size() < terms_.size()) readings_.resize(terms_.size());
  readings_[number] = read_value(term);
  term_index_.insert(hash, number);
  return number;
}

void Dataset::release(TermNumber number) noexcept {
  while (number != nothing && --terms_[number].uses == 0) {  // a literal, then its datatype
    TermEntry& entry = terms_[number];
    term_index_.erase(entry.hash, number);
    dead_text_ += entry.length + entry.language_length;
    const TermNumber datatype = entry.datatype;
    entry = TermEntry{};
    free_terms_.push_back(number);
    number = datatype;
  }
}

GraphNumber Dataset::graph_for(std::string_view name) {
  const TermNumber term = intern(rdf::iri(name), nothing);
  if (terms_[term].graph == nothing) {
    use(term);
    GraphEntry entry;
    entry.name = term;
    terms_[term].graph = take(graphs_, free_graphs_, entry);
  }
  return terms_[term].graph;
}

std::uint32_t Dataset::find_triple(const NumberedTriple& triple) const noexcept {
  return triple_index_.find(hash_of(triple), [&](std::uint32_t at) { return triples_[at].triple == triple; });
}
std::uint32_t Dataset::find_subject_group(TermNumber subject, TermNumber predicate) const noexcept {
  return subject_index_.find(hash_of(subject, predicate),
                             [&](std::uint32_t at) { return subject_groups_[at].subject == subject && subject_groups_[at].predicate == predicate; });
}
std::uint32_t Dataset::find_object_group(TermNumber predicate, TermNumber object) const noexcept {
  return object_index_.find(hash_of(predicate, object),
                            [&](std::uint32_t at) { return object_groups_[at].predicate == predicate && object_groups_[at].object == object; });
}
std::uint32_t Dataset::find_quad(std::uint32_t triple, GraphNumber graph) const noexcept {
  std::uint32_t q = triples_[triple].quads;
  for (int n = 0; n < 4; ++n, q = quads_[q].next_of_triple) {  // most triples have one graph
    if (q == nothing || quads_[q].graph == graph) return q;
  }
  return quad_index_.find(hash_of(triple, graph), [&](std::uint32_t at) { return quads_[at].triple == triple && quads_[at].graph == graph; });
}

std::uint32_t Dataset::add_triple(const NumberedTriple& t) {
  TripleEntry entry{t, nothing, nothing, {nothing, nothing}, {nothing, nothing}, nothing};
  entry.subject_group = find_subject_group(t.subject, t.predicate);
  entry.object_group = find_object_group(t.predicate, t.object);
  TermEntry& predicate = terms_[t.predicate];
  if (predicate.predicate == nothing) predicate.predicate = take(predicates_, free_predicates_, PredicateEntry{});
  PredicateEntry& of_predicate = predicates_[predicate.predicate];

  if (entry.subject_group == nothing) {
    TermEntry& subject = terms_[t.subject];
    SubjectGroup group{t.subject, t.predicate};
    group.next = subject.subjects;
    entry.subject_group = take(subject_groups_, free_subject_groups_, group);
    if (group.next != nothing) subject_groups_[group.next].previous = entry.subject_group;
    else ++subjects_;
    subject.subjects = entry.subject_group;
    subject_index_.insert(hash_of(t.subject, t.predicate), entry.subject_group);
    ++of_predicate.subjects;
  }
  if (entry.object_group == nothing) {
    TermEntry& object = terms_[t.object];
    ObjectGroup group{t.predicate, t.object};
    group.next = object.objects;
    group.next_of_predicate = of_predicate.groups;
    entry.object_group = take(object_groups_, free_object_groups_, group);
    if (group.next != nothing) object_groups_[group.next].previous = entry.object_group;
    else ++objects_;
    if (group.next_of_predicate != nothing) object_groups_[group.next_of_predicate].previous_of_predicate = entry.object_group;
    object.objects = of_predicate.groups = entry.object_group;
    object_index_.insert(hash_of(t.predicate, t.object), entry.object_group);
    ++of_predicate.objects;
  }
  entry.next[0] = subject_groups_[entry.subject_group].first;
  entry.next[1] = object_groups_[entry.object_group].first;
  const std::uint32_t at = take(triples_, free_triples_, entry);
  for (int i = 0; i < 2; ++i) {
    if (entry.next[i] != nothing) triples_[entry.next[i]].previous[i] = at;
  }
  subject_groups_[entry.subject_group].first = object_groups_[entry.object_group].first = at;
  ++subject_groups_[entry.subject_group].count;
  ++object_groups_[entry.object_group].count;
  ++terms_[t.subject].subject_count;
  ++terms_[t.object].object_count;
  ++of_predicate.triples;
  triple_index_.insert(hash_of(t), at);
  use(t.subject);
  use(t.predicate);
  use(t.object);
  return at;
}

void Dataset::remove_triple(std::uint32_t at) noexcept {
  const TripleEntry entry = triples_[at];
  const NumberedTriple& t = entry.triple;
  triple_index_.erase(hash_of(t), at);
  for (int i = 0; i < 2; ++i) {
    std::uint32_t& first = i == 0 ? subject_groups_[entry.subject_group].first : object_groups_[entry.object_group].first;
    (entry.previous[i] == nothing ? first : triples_[entry.previous[i]].next[i]) = entry.next[i];
    if (entry.next[i] != nothing) triples_[entry.next[i]].previous[i] = entry.previous[i];
  }
  PredicateEntry& of_predicate = predicates_[terms_[t.predicate].predicate];
  if (SubjectGroup& group = subject_groups_[entry.subject_group]; --group.count == 0) {
    subject_index_.erase(hash_of(t.subject, t.predicate), entry.subject_group);
    (group.previous == nothing ? terms_[t.subject].subjects : subject_groups_[group.previous].next) = group.next;
    if (group.next != nothing) subject_groups_[group.next].previous = group.previous;
    if (terms_[t.subject].subjects == nothing) --subjects_;
    free_subject_groups_.push_back(entry.subject_group);
    --of_predicate.subjects;
  }
  if (ObjectGroup& group = object_groups_[entry.object_group]; --group.count == 0) {
    object_index_.erase(hash_of(t.predicate, t.object), entry.object_group);
    (group.previous == nothing ? terms_[t.object].objects : object_groups_[group.previous].next) = group.next;
    if (group.next != nothing) object_groups_[group.next].previous = group.previous;
    (group.previous_of_predicate == nothing ? of_predicate.groups : object_groups_[group.previous_of_predicate].next_of_predicate) =
        group.next_of_predicate;
    if (group.next_of_predicate != nothing) object_groups_[group.next_of_predicate].previous_of_predicate = group.previous_of_predicate;
    if (terms_[t.object].objects == nothing) --objects_;
    free_object_groups_.push_back(entry.object_group);
    --of_predicate.objects;
  }
  --terms_[t.subject].subject_count;
  --terms_[t.object].object_count;
  if (--of_predicate.triples == 0) {
    free_predicates_.push_back(terms_[t.predicate].predicate);
    terms_[t.predicate].predicate = nothing;
  }
  triples_[at].triple.subject = nothing;  // free
  free_triples_.push_back(at);
  release(t.subject);
  release(t.predicate);
  release(t.object);
}

std::uint32_t Dataset::add_quad(std::uint32_t triple, GraphNumber graph) {
  const Quad quad{triple, graph, 0, graphs_[graph].first, nothing, triples_[triple].quads, nothing};
  const std::uint32_t at = take(quads_, free_quads_, quad);
  if (quad.next_of_graph != nothing) quads_[quad.next_of_graph].previous_of_graph = at;
  if (quad.next_of_triple != nothing) quads_[quad.next_of_triple].previous_of_triple = at;
  graphs_[graph].first = triples_[triple].quads = at;
  ++graphs_[graph].count;
  quad_index_.insert(hash_of(triple, graph), at);
  return at;
}

void Dataset::remove_quad(std::uint32_t at) noexcept {
  const Quad quad = quads_[at];
  quad_index_.erase(hash_of(quad.triple, quad.graph), at);
  (quad.previous_of_graph == nothing ? graphs_[quad.graph].first : quads_[quad.previous_of_graph].next_of_graph) = quad.next_of_graph;
  if (quad.next_of_graph != nothing) quads_[quad.next_of_graph].previous_of_graph = quad.previous_of_graph;
  (quad.previous_of_triple == nothing ? triples_[quad.triple].quads : quads_[quad.previous_of_triple].next_of_triple) = quad.next_of_triple;
  if (quad.next_of_triple != nothing) quads_[quad.next_of_triple].previous_of_triple = quad.previous_of_triple;
  --graphs_[quad.graph].count;
  free_quads_.push_back(at);
  if (triples_[quad.triple].quads == nothing) remove_triple(quad.triple);
}

void Dataset::put(std::string_view name, const rdf::Graph& graph) {
  const GraphNumber g = graph_for(name);
  if (++mark_ == 0) {
    for (Quad& quad : quads_) quad.mark = 0;
    mark_ = 1;
  }
  std::vector<TermNumber> numbers(graph.term_count(), nothing);
  const auto number = [&](rdf::TermId id) {
    TermNumber& known = numbers[static_cast<std::uint32_t>(id)];
    if (known == nothing) known = intern(graph.term(id), g);
    return known;
  };
  const std::size_t before = graphs_[g].count;
  std::size_t kept = 0;
  for (const rdf::Triple& t : graph.match(std::nullopt, std::nullopt, std::nullopt)) {
    const TermNumber subject = number(t.subject), predicate = number(t.predicate), object = number(t.object);
    const NumberedTriple triple{subject, predicate, object};
    std::uint32_t at = find_triple(triple), quad = nothing;
    if (at == nothing) at = add_triple(triple);
    else quad = find_quad(at, g);
    if (quad == nothing) quad = add_quad(at, g);
    else ++kept;
    quads_[quad].mark = mark_;
  }
  if (kept == before) return;
  for (std::uint32_t q = graphs_[g].first; q != nothing;) {
    const std::uint32_t next = quads_[q].next_of_graph;
    if (quads_[q].mark != mark_) remove_quad(q);
    q = next;
  }
  compact();
}

void Dataset::change(std::string_view name, const std::vector<Change>& removed, const std::vector<Change>& added) {
  const GraphNumber g = graph_for(name);
  const auto known = [&](const rdf::TermView& term) {
    const GraphNumber scope = term.is_blank() ? g : nothing;
    return find(term, scope, hash_of(term, scope));
  };
  for (const Change& t : removed) {
    const NumberedTriple triple{known(t.subject), known(t.predicate), known(t.object)};
    if (triple.subject == nothing || triple.predicate == nothing || triple.object == nothing) continue;
    const std::uint32_t at = find_triple(triple);
    const std::uint32_t quad = at == nothing ? nothing : find_quad(at, g);
    if (quad != nothing) remove_quad(quad);
  }
  for (const Change& t : added) {
    const TermNumber subject = intern(t.subject, g), predicate = intern(t.predicate, g), object = intern(t.object, g);
    const NumberedTriple triple{subject, predicate, object};
    std::uint32_t at = find_triple(triple);
    if (at == nothing) at = add_triple(triple);
    if (find_quad(at, g) == nothing) add_quad(at, g);
  }
  compact();
}

void Dataset::remove(std::string_view name) {
  const GraphNumber g = graph_named(find(rdf::iri(name)));
  if (g == nothing) return;
  while (graphs_[g].first != nothing) remove_quad(graphs_[g].first);
  const TermNumber term = graphs_[g].name;
  terms_[term].graph = nothing;
  graphs_[g] = GraphEntry{};
  free_graphs_.push_back(g);
  release(term);
  compact();
}

/// Unused memory is reused. If more than half is unused, it is compacted.
void Dataset::compact() {
  if ((triples_.size() > few_entries && free_triples_.size() > triples_.size() / 2) ||
      (terms_.size() > few_entries && free_terms_.size() > terms_.size() / 2) ||
      (quads_.size() > few_entries && free_quads_.size() > quads_.size() / 2)) {
    rebuild();
  } else if (text_.size() > few_bytes && dead_text_ > text_.size() / 2) {
    std::string text;
    text.reserve(text_.size() - dead_text_);
    for (TermEntry& entry : terms_) {
      if (entry.uses == 0) continue;
      const std::size_t offset = text.size();
      text.append(text_, entry.offset, entry.length + entry.language_length);
      entry.offset = static_cast<std::uint32_t>(offset);
    }
    text_.swap(text);
    dead_text_ = 0;
  }
}

void Dataset::rebuild() {
  Dataset fresh;
  std::vector<TermNumber> numbers(terms_.size(), nothing);
  for (const GraphEntry& graph : graphs_) {
    if (graph.name == nothing) continue;
    const GraphNumber g = fresh.graph_for(term(graph.name).text);
    const auto number = [&](TermNumber old) {
      if (numbers[old] == nothing) numbers[old] = fresh.intern(term(old), g);
      return numbers[old];
    };
    for (std::uint32_t q = graph.first; q != nothing; q = quads_[q].next_of_graph) {
      const NumberedTriple& old = triples_[quads_[q].triple].triple;
      const TermNumber subject = number(old.subject), predicate = number(old.predicate), object = number(old.object);
      const NumberedTriple triple{subject, predicate, object};
      std::uint32_t at = fresh.find_triple(triple);
      if (at == nothing) at = fresh.add_triple(triple);
      fresh.add_quad(at, g);
    }
  }
  std::string().swap(text_);  // to move a short text keeps the memory of the long one
  *this = std::move(fresh);
}

Dataset::Spread Dataset::spread(TermNumber predicate) const noexcept {
  if (predicate >= terms_.size() || terms_[predicate].predicate == nothing) return {};
  const PredicateEntry& entry = predicates_[terms_[predicate].predicate];
  return {entry.triples, entry.subjects, entry.objects};
}

std::size_t Dataset::count(TermNumber subject, TermNumber predicate, TermNumber object) const noexcept {
  for (const TermNumber term : {subject, predicate, object}) {
    if (term != nothing && term >= terms_.size()) return 0;
  }
  if (subject != nothing && predicate != nothing && object != nothing) return find_triple({subject, predicate, object}) != nothing;
  if (subject != nothing && predicate != nothing) {
    const std::uint32_t group = find_subject_group(subject, predicate);
    return group == nothing ? 0 : subject_groups_[group].count;
  }
  if (predicate != nothing && object != nothing) {
    const std::uint32_t group = find_object_group(predicate, object);
    return group == nothing ? 0 : object_groups_[group].count;
  }
  if (subject != nothing && object != nothing) return std::min(terms_[subject].subject_count, terms_[object].object_count);
  if (subject != nothing) return terms_[subject].subject_count;
  if (object != nothing) return terms_[object].object_count;
  if (predicate != nothing) return spread(predicate).triples;
  return triple_count();
}

bool Dataset::contains(const NumberedTriple& triple, const Scope& scope) const noexcept {
  const std::uint32_t at = find_triple(triple);
  if (at == nothing) return false;
  if (scope.graph != nothing) return find_quad(at, scope.graph) != nothing;
  if (!scope.some) return true;
  for (std::uint32_t q = triples_[at].quads; q != nothing; q = quads_[q].next_of_triple) {
    if (scope.some->contains(quads_[q].graph)) return true;
  }
  return false;
}

Dataset::Matches Dataset::match(TermNumber subject, TermNumber predicate, TermNumber object, const Scope& scope) const noexcept {
  using Way = Matches::Way;
  Matches matches;
  matches.data_ = this;
  matches.wanted_ = {subject, predicate, object};
  matches.scope_ = scope;
  const auto known = [&](TermNumber term) { return term == nothing || term < terms_.size(); };
  if (!known(subject) || !known(predicate) || !known(object)) return matches;  // a term that only the query has
  std::size_t candidates = 0;
  if (subject != nothing && predicate != nothing && object != nothing) {
    matches.way_ = Way::one;
    matches.at_ = find_triple({subject, predicate, object});
    return matches;
  }
  if (subject != nothing && predicate != nothing) {
    const std::uint32_t group = find_subject_group(subject, predicate);
    if (group == nothing) return matches;
    matches.way_ = Way::subject_group;
    matches.at_ = subject_groups_[group].first;
    candidates = subject_groups_[group].count;
  } else if (predicate != nothing && object != nothing) {
    const std::uint32_t group = find_object_group(predicate, object);
    if (group == nothing) return matches;
    matches.way_ = Way::object_group;
    matches.at_ = object_groups_[group].first;
    candidates = object_groups_[group].count;
  } else if (subject != nothing && (object == nothing || terms_[subject].subject_count <= terms_[object].object_count)) {
    matches.way_ = Way::subject;
    matches.group_ = terms_[subject].subjects;
    candidates = terms_[subject].subject_count;
  } else if (object != nothing) {
    matches.way_ = Way::object;
    matches.group_ = terms_[object].objects;
    candidates = terms_[object].object_count;
  } else if (predicate != nothing) {
    const std::uint32_t entry = terms_[predicate].predicate;
    if (entry == nothing) return matches;
    matches.way_ = Way::predicate;
    matches.group_ = predicates_[entry].groups;
    candidates = predicates_[entry].triples;
  } else {
    matches.way_ = Way::all;
    matches.at_ = 0;
    candidates = triples_.size();
  }
  if (scope.graph != nothing && graphs_[scope.graph].count < candidates) {
    matches.way_ = Way::graph;
    matches.at_ = graphs_[scope.graph].first;
    return matches;
  }
  matches.descend();
  return matches;
}

/// The first triple of the current group.
void Dataset::Matches::descend() noexcept {
  if (group_ == nothing) return;
  at_ = way_ == Way::subject ? data_->subject_groups_[group_].first : data_->object_groups_[group_].first;
}

bool Dataset::Matches::fits(std::uint32_t triple, bool in_graph) const noexcept {
  const NumberedTriple& t = data_->triples_[triple].triple;
  if ((wanted_.subject != nothing && wanted_.subject != t.subject) || (wanted_.predicate != nothing && wanted_.predicate != t.predicate) ||
      (wanted_.object != nothing && wanted_.object != t.object))
    return false;
  if (in_graph) return true;
  if (scope_.graph != nothing) return data_->find_quad(triple, scope_.graph) != nothing;
  if (!scope_.some) return true;
  for (std::uint32_t q = data_->triples_[triple].quads; q != nothing; q = data_->quads_[q].next_of_triple) {
    if (scope_.some->contains(data_->quads_[q].graph)) return true;
  }
  return false;
}

const NumberedTriple* Dataset::Matches::next(bool& fit) noexcept {
  const Dataset& d = *data_;
  std::uint32_t triple = at_;
  switch (way_) {
    case Way::none: return nullptr;
    case Way::one:
      if (at_ == nothing) return nullptr;
      at_ = nothing;
      break;
    case Way::subject_group:
      if (at_ == nothing) return nullptr;
      at_ = d.triples_[at_].next[0];
      break;
    case Way::object_group:
      if (at_ == nothing) return nullptr;
      at_ = d.triples_[at_].next[1];
      break;
    case Way::subject:
    case Way::object:
    case Way::predicate:
      if (at_ == nothing) return nullptr;
      at_ = d.triples_[at_].next[way_ == Way::subject ? 0 : 1];
      if (at_ == nothing) {
        group_ = way_ == Way::subject  ? d.subject_groups_[group_].next
                 : way_ == Way::object ? d.object_groups_[group_].next
                                       : d.object_groups_[group_].next_of_predicate;
        descend();
      }
      break;
    case Way::graph: {
      if (at_ == nothing) return nullptr;
      triple = d.quads_[at_].triple;
      at_ = d.quads_[at_].next_of_graph;
      last_ = triple;
      fit = fits(triple, true);
      return &d.triples_[triple].triple;
    }
    case Way::all:
      while (at_ < d.triples_.size() && d.triples_[at_].triple.subject == nothing) ++at_;
      if (at_ >= d.triples_.size()) return nullptr;
      triple = at_++;
      break;
  }
  last_ = triple;
  fit = fits(triple, false);
  return &d.triples_[triple].triple;
}

}  // namespace lrt::query

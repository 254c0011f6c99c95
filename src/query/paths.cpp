// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "src/query/stages.hpp"
#include "src/rdf/hash.hpp"

/// Property paths (SPARQL 9 and 18.4). Sequences, alternatives and links outside of repetitions are triples and unions of the plan.
namespace lrt::query {

bool PathStage::NodeSet::insert(TermNumber node) {
  if ((nodes.size() + 1) * 2 > slots.size()) {
    slots.assign(std::max<std::size_t>(slots.size() * 2, 16), 0);
    for (std::uint32_t i = 0; i < nodes.size(); ++i) {
      std::size_t at = rdf::fold_multiply(nodes[i] ^ rdf::hash_seeds().first, rdf::hash_seeds().second | 1) & (slots.size() - 1);
      while (slots[at] != 0) at = (at + 1) & (slots.size() - 1);
      slots[at] = i + 1;
    }
  }
  std::size_t at = rdf::fold_multiply(node ^ rdf::hash_seeds().first, rdf::hash_seeds().second | 1) & (slots.size() - 1);
  for (; slots[at] != 0; at = (at + 1) & (slots.size() - 1)) {
    if (nodes[slots[at] - 1] == node) return false;
  }
  nodes.push_back(node);
  slots[at] = static_cast<std::uint32_t>(nodes.size());
  return true;
}

void PathStage::charge() {
  constexpr std::size_t bytes = 4 * sizeof(TermNumber);  // in a set
  run_.budget.take(bytes);
  taken_ += bytes;
}

void PathStage::release(std::size_t before) noexcept {
  run_.budget.give(taken_ - before);
  taken_ = before;
}

void PathStage::keep(std::vector<TermNumber>& out, TermNumber node) {
  charge();
  out.push_back(node);
}

/// The other ends of the triples with one end.
void PathStage::step(TermNumber subject, TermNumber predicate, TermNumber object, std::vector<TermNumber>& out) {
  Dataset::Matches matches = run_.data.match(subject, predicate, object, scope_);
  bool fits = false;
  while (const NumberedTriple* triple = matches.next(fits)) {
    run_.budget.step();
    if (fits) keep(out, object == nothing ? triple->object : triple->subject);
  }
}

void PathStage::excluding(const std::vector<Constant>& excluded, TermNumber node, bool forward, std::vector<TermNumber>& out) {
  Dataset::Matches matches = run_.data.match(forward ? node : nothing, nothing, forward ? nothing : node, scope_);
  bool fits = false;
  while (const NumberedTriple* triple = matches.next(fits)) {
    run_.budget.step(1 + excluded.size() / 8);
    const auto is_excluded = [&](Constant c) { return run_.constants[static_cast<std::uint32_t>(c)] == triple->predicate; };
    if (fits && std::none_of(excluded.begin(), excluded.end(), is_excluded)) keep(out, forward ? triple->object : triple->subject);
  }
}

/// Adds the nodes at the other end of the path. Duplicates occur only for links and negated sets.
void PathStage::reach(const Path& path, TermNumber node, bool forward, std::vector<TermNumber>& out) {
  run_.budget.step();
  switch (path.kind) {
    case Path::Kind::link: {
      const TermNumber predicate = run_.constants[static_cast<std::uint32_t>(path.predicate)];
      step(forward ? node : nothing, predicate, forward ? nothing : node, out);
      return;
    }
    case Path::Kind::inverse: return reach(path.parts[0], node, !forward, out);
    case Path::Kind::negated:
      // !(a|b) has forward triples only, !(^a) backward ones only.
      if (!path.excluded.empty() || path.excluded_inverse.empty()) excluding(path.excluded, node, forward, out);
      if (!path.excluded_inverse.empty()) excluding(path.excluded_inverse, node, !forward, out);
      return;
    case Path::Kind::alternative: {
      for (const Path& part : path.parts) reach(part, node, forward, out);
      return;
    }
    case Path::Kind::sequence: {
      std::vector<TermNumber> here{node}, next;
      const std::size_t before = taken_;
      for (std::size_t i = 0; i < path.parts.size(); ++i) {
        const Path& part = path.parts[forward ? i : path.parts.size() - 1 - i];
        NodeSet after;
        for (const TermNumber at : here) {
          next.clear();
          const std::size_t before_step = taken_;
          reach(part, at, forward, next);
          release(before_step);
          for (const TermNumber reached : next) {
            if (after.insert(reached)) charge();
          }
        }
        here.swap(after.nodes);
      }
      release(before);
      for (const TermNumber reached : here) keep(out, reached);
      return;
    }
    case Path::Kind::zero_or_one:
    case Path::Kind::zero_or_more:
    case Path::Kind::one_or_more: break;
  }
  // (x*)+ is x*, so that repetitions in each other cost no more than one.
  const Path* repeated = &path;
  bool none = false, many = false;
  for (; repeated->kind == Path::Kind::zero_or_one || repeated->kind == Path::Kind::zero_or_more || repeated->kind == Path::Kind::one_or_more;
       repeated = &repeated->parts[0]) {
    none = none || repeated->kind != Path::Kind::one_or_more;
    many = many || repeated->kind != Path::Kind::zero_or_one;
  }
  NodeSet seen;
  if (none) seen.insert(node);
  std::vector<TermNumber> next;
  const std::size_t before = taken_;
  reach(*repeated, node, forward, next);
  for (const TermNumber reached : next) seen.insert(reached);
  // `seen` grows while it is walked. If the start is reached again, it adds nothing.
  for (std::size_t i = 0; many && i < seen.nodes.size(); ++i) {
    if (seen.nodes[i] == node) continue;
    if (&path == &path_ && target_ != nothing && seen.nodes[i] == target_) break;
    next.clear();
    const std::size_t before_step = taken_;
    reach(*repeated, seen.nodes[i], forward, next);
    release(before_step);
    for (const TermNumber reached : next) {
      run_.budget.step();
      if (seen.insert(reached)) charge();
    }
  }
  release(before);
  for (const TermNumber reached : seen.nodes) keep(out, reached);
}

/// Whether the active graph has the term as a subject or object.
bool PathStage::is_node(TermNumber term) {
  if (term >= run_.data.term_limit()) return false;
  if (scope_.graph == nothing && !scope_.some) return run_.data.is_node(term);
  const auto is_in = [&](Dataset::Matches matches) {
    bool fits = false;
    while (matches.next(fits)) {
      run_.budget.step();
      if (fits) return true;
    }
    return false;
  };
  return is_in(run_.data.match(term, nothing, nothing, scope_)) || is_in(run_.data.match(nothing, nothing, term, scope_));
}

/// The subjects and objects of the active graph.
void PathStage::all_nodes() {
  if (scope_.graph == nothing && !scope_.some) {
    for (TermNumber term = 0; term < run_.data.term_limit(); ++term) {
      run_.budget.step();
      if (run_.data.is_node(term)) keep(starts_, term);
    }
    return;
  }
  NodeSet nodes;
  Dataset::Matches matches = run_.data.match(nothing, nothing, nothing, scope_);
  bool fits = false;
  while (const NumberedTriple* triple = matches.next(fits)) {
    run_.budget.step();
    if (!fits) continue;
    nodes.insert(triple->subject);
    nodes.insert(triple->object);
  }
  for (const TermNumber node : nodes.nodes) keep(starts_, node);
}

void PathStage::from(TermNumber start) {
  start_ = start;
  release(taken_of_starts_);
  found_.clear();
  next_found_ = 0;
  reach(path_, start, forward_, found_);
}

void PathStage::open() {
  release(0);
  starts_.clear();
  found_.clear();
  next_start_ = next_found_ = 0;
  scope_ = scope_of(graph_, run_, frame_);
  const TermNumber subject = subject_.in(frame_), object = object_.in(frame_);
  forward_ = subject != nothing || object == nothing;
  target_ = forward_ ? object : nothing;
  if (const TermNumber start = forward_ ? subject : object; start == nothing) all_nodes();
  else if (subject_.is_term(frame_) || object_.is_term(frame_) || is_node(start)) starts_.push_back(start);
  taken_of_starts_ = taken_;
}

bool PathStage::next() {
  bindings_.undo();
  for (;;) {
    while (next_found_ < found_.size()) {
      run_.budget.step();
      const TermNumber end = found_[next_found_++];
      if (target_ != nothing && end != target_) continue;
      if (bindings_.bind((forward_ ? subject_ : object_).slot, start_) && bindings_.bind((forward_ ? object_ : subject_).slot, end)) return true;
      bindings_.undo();
    }
    if (next_start_ == starts_.size()) return false;
    from(starts_[next_start_++]);
  }
}

}  // namespace lrt::query

// SPDX-License-Identifier: Apache-2.0
#include "src/query/stages.hpp"

#include <algorithm>

#include "src/rdf/hash.hpp"

namespace lrt::query {
namespace {

/// Chains of rows with equal hashes of their keys.
/// @return  what was taken of the budget
std::size_t make_chains(Budget& budget, const Rows& rows, const std::vector<std::size_t>& keys, std::vector<std::uint32_t>& heads,
                        std::vector<std::uint32_t>& links, std::vector<TermNumber>& key) {
  std::size_t size = 16;
  while (size < rows.size()) size *= 2;
  const std::size_t bytes = (size + rows.size()) * sizeof(std::uint32_t);
  budget.take(bytes);
  heads.assign(size, nothing);
  links.assign(rows.size(), nothing);
  key.resize(keys.size());
  for (std::size_t i = rows.size(); i-- > 0;) {  // so that chains have the order of the rows
    budget.step();
    const TermNumber* const row = rows.row(i);
    for (std::size_t k = 0; k < keys.size(); ++k) key[k] = row[keys[k]];
    std::uint32_t& head = heads[hash_of_row(key.data(), key.size()) & (size - 1)];
    links[i] = head;
    head = static_cast<std::uint32_t>(i);
  }
  return bytes;
}

}  // namespace

std::uint32_t hash_of_row(const TermNumber* row, std::size_t width) noexcept {
  std::uint64_t h = rdf::hash_seeds().first;
  for (std::size_t i = 0; i < width; ++i) h = rdf::fold_multiply(h ^ row[i], 0xE7037ED1A0B428DBu) + i;
  return rdf::to_32_bits(h);
}

Scope scope_of(const ActiveGraph& active, const Run& run, const Frame& frame) noexcept {
  switch (active.kind) {
    case ActiveGraph::Kind::unnamed: return run.view.default_graph;
    case ActiveGraph::Kind::one: return Scope::one(active.graph);
    case ActiveGraph::Kind::variable: return Scope::one(run.data.graph_named(frame[active.slot]));
  }
  return {};
}

bool Pipeline::next() {
  if (state_ == State::closed) return false;
  if (stages_.empty()) {
    state_ = State::closed;
    return true;
  }
  if (state_ == State::open) {
    state_ = State::running;
    at_ = 0;
    stages_[0]->open();
  }
  for (;;) {
    if (stages_[at_]->next()) {
      if (at_ + 1 == stages_.size()) return true;
      stages_[++at_]->open();
    } else {
      if (at_ == 0) {
        state_ = State::closed;
        return false;
      }
      --at_;
    }
  }
}

void Pipeline::close() noexcept {
  if (state_ == State::running) {
    for (std::size_t i = at_ + 1; i-- > 0;) stages_[i]->close();
  }
  state_ = State::closed;
}

std::pair<std::uint32_t, bool> RowSet::insert(const TermNumber* row) {
  budget_.step();
  const std::uint32_t hash = hash_of_row(row, width_);
  const std::uint32_t known = index_.find(hash, [&](std::uint32_t at) { return std::equal(row, row + width_, this->row(at)); });
  if (known != nothing) return {known, false};
  const std::size_t bytes = width_ * sizeof(TermNumber) + 3 * sizeof(std::uint32_t);
  budget_.take(bytes);
  taken_ += bytes;
  cells_.insert(cells_.end(), row, row + width_);
  index_.insert(hash, size_);
  return {size_++, true};
}

Frame& EvaluatedRows::begin() {
  for (const Slot slot : inherited_) frame[slot] = outer_[slot];
  return frame;
}

const Rows& EvaluatedRows::rows(bool& changed) {
  changed = false;
  bool same = done_;
  for (std::size_t i = 0; same && i < inherited_.size(); ++i) same = last_[i] == outer_[inherited_[i]];
  if (same) return rows_;
  last_.clear();
  for (const Slot slot : inherited_) last_.push_back(outer_[slot]);
  rows_.clear();
  begin();
  evaluate(rows_);
  done_ = changed = true;
  return rows_;
}

void PatternRows::evaluate(Rows& rows) {
  std::vector<TermNumber> row(rows.columns().size());
  pipeline.open();
  while (pipeline.next()) {
    for (std::size_t i = 0; i < row.size(); ++i) row[i] = frame[rows.columns()[i]];
    rows.add(row.data());
  }
}

void TripleStage::open() {
  triple_ = nullptr;
  graphs_.clear();
  Scope scope;
  each_graph_ = graph_.kind == ActiveGraph::Kind::variable && frame_[graph_.slot] == nothing;
  if (!each_graph_) scope = scope_of(graph_, run_, frame_);
  else if (run_.view.named) scope = Scope::of(*run_.view.named);
  matches_ = run_.data.match(subject_.in(frame_), predicate_.in(frame_), object_.in(frame_), scope);
}

bool TripleStage::next() {
  bindings_.undo();
  for (;;) {
    if (graphs_.empty()) {
      bool fits = false;
      do {
        run_.budget.step();
        triple_ = matches_.next(fits);
        if (!triple_) return false;
      } while (!fits);
      if (each_graph_) {
        matches_.graphs([&](GraphNumber graph) {
          run_.budget.step();
          if (run_.view.has(graph)) graphs_.push_back(graph);
        });
        if (graphs_.empty()) continue;
      }
    }
    bool good = bindings_.bind(subject_.slot, triple_->subject) && bindings_.bind(predicate_.slot, triple_->predicate) &&
                bindings_.bind(object_.slot, triple_->object);
    if (each_graph_) {
      run_.budget.step();
      if (good) good = bindings_.bind(graph_.slot, run_.data.name_of(graphs_.back()));
      graphs_.pop_back();
    }
    if (good) return true;
    bindings_.undo();
  }
}

bool GraphStage::next() {
  bindings_.undo();
  if (bound_) {  // only the name of a graph
    bound_ = false;
    at_ = nothing;
    return run_.view.has(run_.data.graph_named(frame_[slot_]));
  }
  while (at_ < run_.data.graph_limit()) {
    run_.budget.step();
    const GraphNumber graph = at_++;
    if (run_.data.name_of(graph) != nothing && run_.view.has(graph)) return bindings_.bind(slot_, run_.data.name_of(graph));
  }
  return false;
}

bool ExtendStage::next() {
  bindings_.undo();
  if (!std::exchange(pending_, false)) return false;
  const TermNumber term = run_.term_of(expression_, frame_);
  return term == nothing || bindings_.bind(slot_, term);
}

void RowsStage::open() {
  bool changed = false;
  rows_ = &source_->rows(changed);
  if (keys_.empty()) {
    at_ = rows_->size() == 0 ? nothing : 0;
    return;
  }
  if (changed || heads_.empty()) {
    run_.budget.give(taken_);
    taken_ = 0;
    taken_ = make_chains(run_.budget, *rows_, keys_, heads_, links_, key_);
  }
  for (std::size_t k = 0; k < keys_.size(); ++k) key_[k] = frame_[rows_->columns()[keys_[k]]];
  at_ = heads_[hash_of_row(key_.data(), key_.size()) & (heads_.size() - 1)];
}

bool RowsStage::next() {
  bindings_.undo();
  while (at_ != nothing) {
    run_.budget.step();
    const TermNumber* const row = rows_->row(at_);
    if (keys_.empty()) at_ = at_ + 1 < rows_->size() ? at_ + 1 : nothing;
    else at_ = links_[at_];
    bool good = true;
    for (std::size_t i = 0; good && i < rows_->columns().size(); ++i) good = row[i] == nothing || bindings_.bind(rows_->columns()[i], row[i]);
    if (good) return true;
    bindings_.undo();
  }
  return false;
}

bool MinusStage::next() {
  if (!std::exchange(pending_, false)) return false;
  bool changed = false;
  const Rows& rows = source_->rows(changed);
  std::uint32_t at = rows.size() == 0 ? nothing : 0;
  if (!keys_.empty()) {
    if (changed || heads_.empty()) {
      run_.budget.give(taken_);
      taken_ = 0;
      taken_ = make_chains(run_.budget, rows, keys_, heads_, links_, key_);
    }
    for (std::size_t k = 0; k < keys_.size(); ++k) key_[k] = frame_[rows.columns()[keys_[k]]];
    at = heads_[hash_of_row(key_.data(), key_.size()) & (heads_.size() - 1)];
  }
  while (at != nothing) {
    run_.budget.step();
    const TermNumber* const row = rows.row(at);
    if (keys_.empty()) at = at + 1 < rows.size() ? at + 1 : nothing;
    else at = links_[at];
    bool shares = false, good = true;
    for (std::size_t i = 0; good && i < rows.columns().size(); ++i) {
      const TermNumber bound = frame_[rows.columns()[i]];
      if (row[i] == nothing || bound == nothing) continue;
      shares = true;
      good = row[i] == bound;
    }
    if (good && shares) return false;
  }
  return true;
}

bool AbsentStage::next() {
  if (!std::exchange(pending_, false)) return false;
  pipeline_.open();
  const bool found = pipeline_.next();
  pipeline_.close();
  return !found;
}

bool OptionalStage::next() {
  if (done_) return false;
  if (pipeline_.next()) return found_ = true;
  done_ = true;
  return !found_;
}

bool UnionStage::next() {
  for (; at_ < parts_.size();) {
    if (parts_[at_].next()) return true;
    run_.budget.step();
    if (++at_ < parts_.size()) parts_[at_].open();
  }
  return false;
}

}  // namespace lrt::query

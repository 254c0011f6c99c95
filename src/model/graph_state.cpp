// SPDX-License-Identifier: Apache-2.0
#include "src/model/graph_state.hpp"

#include <algorithm>
#include <exception>
#include <functional>
#include <iterator>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/shacl/validator.hpp>

#include "src/base/turns.hpp"
#include "src/model/host_store.hpp"
#include "src/rdf/limits.hpp"
#include "src/rdf/n_triples.hpp"
#include "src/rdf/shared_graph.hpp"

namespace lrt::model {

namespace {

/// The triples that are not marked. Terms that none of them has are left out.
rdf::Graph unmarked(const rdf::Graph& graph, const std::vector<bool>& marked) {
  rdf::Graph rest;
  std::vector<std::optional<rdf::TermId>> known(graph.term_count());
  const auto same = [&](rdf::TermId id) {
    std::optional<rdf::TermId>& mine = known[static_cast<std::size_t>(id)];
    if (!mine) mine = rest.intern(graph.term(id));
    return *mine;
  };
  const auto all = graph.match(std::nullopt, std::nullopt, std::nullopt);
  for (auto at = all.begin(); at != all.end(); ++at) {
    if (at.place() < marked.size() && marked[at.place()]) continue;
    const rdf::TermId s = same(at->subject), p = same(at->predicate), o = same(at->object);
    rest.add(s, p, o);
  }
  return rest;
}

/// The bytes of a term when it is written.
std::size_t text_bytes(const rdf::TermView& term) noexcept { return term.text.size() + term.datatype.size() + term.language.size(); }

std::size_t text_bytes(const rdf::Graph& graph, const rdf::Triple& t) {
  return text_bytes(graph.term(t.subject)) + text_bytes(graph.term(t.predicate)) + text_bytes(graph.term(t.object));
}

/// Marks the triples about a node, those that refer to it, and those about blank nodes that only these refer to.
/// @param is_marked  at this place
template <class IsMarked, class Mark>
void mark_node(const rdf::Graph& graph, const rdf::TermView& subject, IsMarked is_marked, Mark mark) {
  const auto first = graph.find(subject);
  if (!first) return;
  const auto referring = graph.match(std::nullopt, std::nullopt, *first);
  for (auto at = referring.begin(); at != referring.end(); ++at)
    if (!is_marked(at.place())) mark(at.place());
  std::vector<rdf::TermId> open = {*first};
  while (!open.empty()) {
    const rdf::TermId node = open.back();
    open.pop_back();
    const auto about = graph.match(node, std::nullopt, std::nullopt);
    for (auto at = about.begin(); at != about.end(); ++at) {
      if (is_marked(at.place())) continue;
      mark(at.place());
      if (!graph.term(at->object).is_blank()) continue;
      const auto leading = graph.match(std::nullopt, std::nullopt, at->object);
      auto other = leading.begin();
      while (other != leading.end() && is_marked(other.place())) ++other;
      if (other == leading.end()) open.push_back(at->object);
    }
  }
}

/// Places of triples are below.
std::uint32_t place_limit(const rdf::Graph& graph) {
  const rdf::SharedGraph* const shared = rdf::SharedGraph::in(graph);
  return shared ? shared->place_limit() : static_cast<std::uint32_t>(graph.size());
}

constexpr std::size_t max_violations = 64;
constexpr std::size_t max_reports = 64;

/// This thread runs the function of an update.
thread_local bool is_updating = false;
struct Updating {
  Updating() noexcept { is_updating = true; }
  ~Updating() { is_updating = false; }
  Updating(const Updating&) = delete;
  Updating& operator=(const Updating&) = delete;
};

}  // namespace

// ------------------------------------------------------------------------------------------------------------------ edit

GraphEdit::GraphEdit(const rdf::Graph& before, std::size_t bytes, std::string base, const GraphOptions& limits)
    : before_(before.size()), base_(std::move(base)), limits_(limits), graph_(before), first_new_(place_limit(before)), bytes_(bytes) {}

bool GraphEdit::has_much_unused(const rdf::Graph& graph) { return rdf::SharedGraph::has_much_unused(graph); }

std::string GraphEdit::resolved(std::string_view iri) {
  if (iri::is_absolute(iri)) return std::string(iri);
  Result<std::string> whole = iri::resolve(base_, iri);
  if (whole && iri::is_absolute(*whole)) return *std::move(whole);
  fail({Errc::expected_iri, "expected an IRI, found \"" + std::string(iri) + "\""});
  return base_;
}

rdf::Term GraphEdit::term_of(const Object& o) {
  switch (o.kind()) {
    case Object::Kind::iri: return rdf::iri(resolved(o.text()));
    case Object::Kind::resource: {
      const Result<std::string> path = encode_path_from_root(o.text());
      if (!path) fail(path.error());
      return rdf::iri(std::string(World::base) + "/" + path.value_or(std::string()));
    }
    case Object::Kind::literal: break;
  }
  if (!o.language().empty()) return rdf::tagged_literal(o.text(), o.language());
  return o.datatype().empty() ? rdf::literal(o.text()) : rdf::literal(o.text(), Iri(std::string_view(o.datatype())));
}

void GraphEdit::add(const rdf::TermView& subject, const rdf::TermView& predicate, const rdf::TermView& object) {
  if (error_) return;
  if (subject.is_literal() || !predicate.is_iri())
    return fail(
        {Errc::expected_rdf, "expected a triple, found " + rdf::to_string(subject) + " " + rdf::to_string(predicate) + " " + rdf::to_string(object)});
  const auto mine = [&](const rdf::TermView& term) { return term.is_iri() ? interned(rdf::iri(resolved(term.text))) : interned(term); };
  // A view may be of this graph, whose text moves when a term is added.
  const rdf::Term s(subject), p(predicate), o(object);
  const rdf::TermId s_id = mine(s), p_id = mine(p);
  add(s_id, p_id, mine(o));
}

/// The term in the graph. Sets the error if it is new, and cannot be written or read again.
rdf::TermId GraphEdit::interned(const rdf::TermView& term) {
  const std::size_t known = graph_.term_count();
  const rdf::TermId id = graph_.intern(term);
  if (graph_.term_count() != known) check(graph_.term(id));
  return id;
}

/// Sets the error if the term cannot be written or read again.
void GraphEdit::check(const rdf::TermView& term) {
  if (std::max(term.is_iri() ? term.text.size() : 0, term.datatype.size()) > rdf::max_iri)
    fail({Errc::limit_exceeded, "IRI of more than " + std::to_string(rdf::max_iri) + " bytes"});
  if (const std::string_view fault = rdf::fault_of(term); !fault.empty())
    fail({Errc::expected_rdf, std::string(fault) + ", found " + rdf::to_string(term)});
}

void GraphEdit::add(rdf::TermId subject, rdf::TermId predicate, rdf::TermId object) {
  if (graph_.add(subject, predicate, object)) {
    bytes_ += text_bytes(graph_, {subject, predicate, object});
    return keep(true, {subject, predicate, object});
  }
  const auto found = graph_.match(subject, predicate, object);
  const std::uint32_t at = found.begin().place();
  if (is_removed(at) || !repeated_on_.empty()) keep(true, {subject, predicate, object});
  if (!is_removed(at)) return;
  removed_[at] = false;
  --removed_count_;
  if (at < first_new_) --removed_before_;
}

void GraphEdit::add_turtle(std::string_view text) {
  rdf::ReadOptions options;
  options.base = base_;
  options.max_triples = limits_.max_triples;
  options.max_bytes = std::max(options.max_bytes, limits_.max_bytes);
  const Result<rdf::Graph> graph = rdf::read(text, rdf::Syntax::turtle, options);
  if (graph) merge(*graph);
  else fail(graph.error());
}

void GraphEdit::merge(const rdf::Graph& other) {
  if (error_) return;
  if (&other == &graph_) return merge(rdf::Graph(other));
  if (removed_count_ == graph_.size() && take_over(other)) return;
  std::vector<std::optional<rdf::TermId>> known(other.term_count());
  const auto mine = [&](rdf::TermId id) {
    std::optional<rdf::TermId>& same = known[static_cast<std::size_t>(id)];
    if (!same) {
      const rdf::TermView term = other.term(id);
      same = term.is_blank() ? fresh_blank() : interned(term);
    }
    return *same;
  };
  std::size_t count = 0;
  for (const rdf::Triple& t : other.match(std::nullopt, std::nullopt, std::nullopt)) {
    if (++count % Turns::units_between_rests == 0) Turns::rest_now();
    const rdf::TermId s = mine(t.subject), p = mine(t.predicate), o = mine(t.object);
    if (error_) return;
    add(s, p, o);
  }
}

/// merge() of a large graph into an empty one, or in the place of one that has little in common with it: terms and triples are not looked up.
/// @return  false: it has to be added triple by triple
bool GraphEdit::take_over(const rdf::Graph& other) {
  if (other.size() < rdf::SharedGraph::least_size || !repeated_on_.empty() || rdf::SharedGraph::in(other)) return false;
  constexpr std::size_t samples = 64;
  std::size_t common = 0;
  for (std::size_t i = 0; i < samples && !graph_.empty(); ++i) {
    const rdf::Triple& t = other.triples()[i * other.size() / samples];
    const rdf::TermView s = other.term(t.subject), p = other.term(t.predicate), o = other.term(t.object);
    if (!s.is_blank() && !o.is_blank() && graph_.contains(s, p, o)) ++common;
  }
  if (common > samples / 8) return false;
  rdf::Graph large = rdf::SharedGraph::with_new_blanks(other);
  const rdf::SharedGraph& shared = *rdf::SharedGraph::in(large);
  std::size_t bytes = 0;
  for (std::uint32_t id = 0; id < shared.term_count(); ++id) {
    if (id % Turns::units_between_rests == 0) Turns::rest_now();
    const rdf::TermView term = shared.term(id);
    std::size_t uses = 0;
    for (int i = 0; i < 3; ++i) uses += shared.chain(id, i).count;
    if (uses == 0) continue;
    check(term);
    bytes += uses * text_bytes(term);
  }
  if (error_) return true;
  graph_ = std::move(large);
  bytes_ = bytes;
  first_new_ = 0;
  forget_removed();
  if (!changes_) return true;
  for (std::uint32_t at = 0; at < shared.place_limit(); ++at) {
    if (at % Turns::units_between_rests == 0) Turns::rest_now();
    keep(true, graph_.at(at));
  }
  return true;
}

rdf::TermId GraphEdit::fresh_blank() {
  while (true) {
    const rdf::TermId id = graph_.fresh_blank();
    const auto has = [&](const std::shared_ptr<const rdf::Graph>& graph) { return graph->find(graph_.term(id)).has_value(); };
    if (std::none_of(repeated_on_.begin(), repeated_on_.end(), has)) return id;
  }
}

/// Keeps the removal of a triple that another graph has. One that this graph has, too, is kept by mark().
void GraphEdit::keep_removed(const rdf::Graph& graph, const rdf::Triple& t) {
  const rdf::TermView s = graph.term(t.subject), p = graph.term(t.predicate), o = graph.term(t.object);
  if (!graph_.contains(s, p, o)) changes_->remove(s, p, o);
}

void GraphEdit::keep(bool added, const rdf::Triple& triple) {
  if (!changes_) return;
  const rdf::TermView s = graph_.term(triple.subject), p = graph_.term(triple.predicate), o = graph_.term(triple.object);
  if (added) changes_->add(s, p, o);
  else changes_->remove(s, p, o);
}

void GraphEdit::mark(std::uint32_t at) {
  if (is_removed(at)) return;
  keep(false, graph_.at(at));
  if (removed_.size() <= at) removed_.resize(place_limit(graph_));
  marked_.push_back(at);
  removed_[at] = true;
  ++removed_count_;
  if (at < first_new_) ++removed_before_;
}

void GraphEdit::remove(const rdf::TermView* subject, const rdf::TermView* predicate, const rdf::TermView* object) {
  if (error_) return;
  std::vector<rdf::Term> terms;  // resolved
  terms.reserve(3);
  rdf::TermView views[3];
  const rdf::TermView* wanted[3] = {subject, predicate, object};
  for (int i = 0; i < 3; ++i) {
    if (!wanted[i]) continue;
    terms.push_back(wanted[i]->is_iri() ? rdf::Term(rdf::iri(resolved(wanted[i]->text))) : rdf::Term(*wanted[i]));
    views[i] = terms.back().view();
    wanted[i] = &views[i];
  }
  const auto found = graph_.match(wanted[0], wanted[1], wanted[2]);
  for (auto at = found.begin(); at != found.end(); ++at) mark(at.place());
  for (const auto& graph : repeated_on_)
    for (const rdf::Triple& t : graph->match(wanted[0], wanted[1], wanted[2])) keep_removed(*graph, t);
}

void GraphEdit::remove_node(const rdf::TermView& subject) {
  if (error_) return;
  mark_node(
      graph_, subject, [this](std::uint32_t at) { return is_removed(at); }, [this](std::uint32_t at) { mark(at); });
  for (const auto& graph : repeated_on_) {
    std::vector<bool> marked(place_limit(*graph));
    mark_node(
        *graph, subject, [&](std::uint32_t at) { return marked[at]; },
        [&](std::uint32_t at) {
          marked[at] = true;
          keep_removed(*graph, graph->at(at));
        });
  }
}

void GraphEdit::clear() {
  if (error_) return;
  if (changes_) changes_->clear();
  removed_.assign(place_limit(graph_), true);
  is_cleared_ = true;
  removed_count_ = graph_.size();
  removed_before_ = before_;
}

const rdf::Graph& GraphEdit::graph() {
  if (removed_count_ != 0) remove_removed();
  return graph_;
}

rdf::Graph GraphEdit::take() {
  graph();
  // Not before: a graph that is not shared takes new triples faster.
  if (graph_.size() >= rdf::SharedGraph::least_size) rdf::SharedGraph::of(graph_);
  if (compacts_) rdf::SharedGraph::compact(graph_);
  return std::move(graph_);
}

/// Positions change here. Only the number of removed original triples is kept.
void GraphEdit::remove_removed() {
  // Most of a large graph stays as it is.
  const bool stays = removed_count_ <= graph_.size() / 2;
  if (stays && graph_.size() >= rdf::SharedGraph::least_size) rdf::SharedGraph::of(graph_);
  rdf::SharedGraph* const shared = rdf::SharedGraph::in(graph_);
  if (shared && stays && !is_cleared_) {
    for (const std::uint32_t at : marked_) {
      if (!is_removed(at)) continue;
      removed_[at] = false;  // it may be there twice
      const rdf::Triple gone = graph_.at(at);
      bytes_ -= text_bytes(graph_, gone);
      shared->remove(gone);
    }
  } else if (shared && stays) {
    for (std::uint32_t at = shared->used_from(0); at != rdf::SharedGraph::none; at = shared->used_from(at + 1)) {
      if (!is_removed(at)) continue;
      const rdf::Triple gone = graph_.at(at);
      bytes_ -= text_bytes(graph_, gone);
      shared->remove(gone);
    }
  } else {
    const auto all = graph_.match(std::nullopt, std::nullopt, std::nullopt);
    for (auto at = all.begin(); at != all.end(); ++at)
      if (is_removed(at.place())) bytes_ -= text_bytes(graph_, *at);
    const auto left = static_cast<std::uint32_t>(before_ - removed_before_);
    graph_ = unmarked(graph_, removed_);
    first_new_ = left;
  }
  forget_removed();
}

void GraphEdit::forget_removed() noexcept {
  removed_.clear();
  marked_.clear();
  is_cleared_ = false;
  removed_count_ = 0;
  // A triple that is removed, and then added again, counts as a change from here on.
  lost_ += removed_before_;
  before_ -= removed_before_;
  removed_before_ = 0;
}

// ----------------------------------------------------------------------------------------------------------------- state

bool GraphBudget::change(std::size_t before, std::size_t after) noexcept {
  std::size_t used = used_.load();
  do {
    if (after > before && after - before > max_ - used) return false;
  } while (!used_.compare_exchange_weak(used, used - before + after));
  return true;
}

Result<std::shared_ptr<GraphState>> GraphState::create(std::string path, GraphOptions options, const std::string& shapes_base,
                                                       std::shared_ptr<HandleContext> thing) {
  std::shared_ptr<GraphState> state(new GraphState(std::move(path), std::move(options), std::move(thing)));
  const auto named = [&](Error error) {
    error.message = "graph \"" + state->path_.substr(1) + "\": " + error.message;
    return Unexpected{std::move(error)};
  };
  rdf::ReadOptions reading;
  reading.base = shapes_base;
  if (!state->options_.shapes.empty()) {
    Result<rdf::Graph> shapes = rdf::read(state->options_.shapes, rdf::Syntax::turtle, reading);
    if (!shapes) return named(shapes.error());
    Result<shacl::Shapes> compiled = shacl::Shapes::compile(*std::move(shapes));
    if (!compiled) return named(compiled.error());
    state->shapes_ = *std::move(compiled);
  }
  if (!state->options_.turtle.empty()) {
    const Result<void> first = state->make([&](GraphEdit& edit) { edit.add_turtle(state->options_.turtle); });
    if (!first) return named(first.error());
  }
  return state;
}

std::shared_ptr<GraphState> GraphState::like(const GraphState& other, std::string path) {
  std::shared_ptr<GraphState> state(new GraphState(std::move(path), other.options_, other.thing_));
  state->shapes_ = other.shapes_;
  state->budget_ = other.budget_;
  return state;
}

GraphState::~GraphState() {
  if (budget_) budget_->change(newest_.bytes, 0);
}

/// The right to write: one at a time.
class GraphState::Turn {
 public:
  enum class Wait : std::uint8_t { no, until_stopped, always };

  Turn(GraphState& state, Wait wait) : state_(state) {
    std::unique_lock lock(state_.turn_mutex_);
    const auto gives_up = [&] { return wait == Wait::no || (wait == Wait::until_stopped && state_.stopped_); };
    if (state_.is_writing_ && !gives_up()) {
      const Turns::Waiting others_work;
      while (state_.is_writing_ && !gives_up()) state_.turn_changed_.wait(lock);
    }
    is_mine_ = !std::exchange(state_.is_writing_, true);
    if (is_mine_) held_.emplace();
  }
  ~Turn() {
    if (!is_mine_) return;
    const std::lock_guard lock(state_.turn_mutex_);
    state_.is_writing_ = false;
    state_.turn_changed_.notify_all();
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;
  explicit operator bool() const noexcept { return is_mine_; }

 private:
  GraphState& state_;
  bool is_mine_ = false;
  std::optional<Turns::Held> held_;
};

void GraphState::end_waiting_writes() noexcept {
  if (store_) store_->stop();
  const std::lock_guard lock(turn_mutex_);
  stopped_ = true;
  turn_changed_.notify_all();
}

GraphState::Version GraphState::version() const {
  const std::lock_guard lock(mutex_);
  return current_;
}

GraphState::Version GraphState::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

/// @param others  gets the graphs that are, or may come to be, shown before it
GraphState::Version GraphState::newest(GraphEdit::Graphs& others) const {
  const std::lock_guard lock(mutex_);
  if (pending_.empty()) return newest_;
  others.push_back(current_.graph);
  for (auto p = pending_.begin(); p != std::prev(pending_.end()); ++p)
    if (p->version.graph) others.push_back(p->version.graph);
  return newest_;
}

/// Two threads that update two graphs within each other, in opposite orders, would wait for each other.
Result<void> GraphState::update(FunctionRef<void(GraphEdit&)> change) {
  if (is_updating)
    return unexpected(Errc::refused, "graph \"" + path_.substr(1) + "\": update() was called within update(): call it after that has returned");
  if (!is_open_) return unexpected(Errc::refused, "graph \"" + path_.substr(1) + "\": Server::add() reads its file: call update() after that");
  if (store_)
    return unexpected(Errc::refused, "graph \"" + path_.substr(1) + "\": its content is in a store of the host: change it there, and call changed()");
  const Updating updating;
  return make(change);
}

Result<void> GraphState::make(FunctionRef<void(GraphEdit&)> change) {
  const Turn turn(*this, Turn::Wait::always);
  try {
    GraphEdit::Graphs others;
    const Version before = newest(others);
    GraphEdit edit(*before.graph, before.bytes, iri(), options_);
    if (is_open_ && !options_.file.empty()) edit.keep_changes(std::move(others));
    change(edit);
    if (edit.error()) return Unexpected{*edit.error()};
    const std::optional<GraphRefusal> refused = commit(edit, before, nullptr);
    if (!refused) return {};
    const Errc code = refused->kind == GraphRefusal::Kind::violation ? Errc::expected_value : Errc::limit_exceeded;
    return unexpected(code, "graph \"" + path_.substr(1) +
                                "\": " + (refused->report ? "it would not conform to its shapes: " + refused->report->to_text() : refused->message));
  } catch (const BadResult& e) { return Unexpected{e.error()}; } catch (const std::exception& e) {
    return unexpected(Errc::failed, "the update of graph \"" + path_.substr(1) + "\" threw: " + e.what());
  } catch (...) {
    return unexpected(Errc::failed, "the update of graph \"" + path_.substr(1) + "\" threw an exception that is not a std::exception");
  }
}

std::optional<GraphRefusal> GraphState::write(const GraphWrite& wanted, bool waits, std::shared_ptr<Saving>* saving) {
  if (store_) return waits ? write_to_store(wanted) : GraphRefusal{GraphRefusal::Kind::busy};
  // Large graphs take long. Without the Turn the work takes turns with that of other clients, once: if the graph is changed meanwhile, it begins again.
  if (waits && Turns::current()) {
    wait_for_writes();
    auto made = prepare(wanted);
    if (auto* refused = std::get_if<GraphRefusal>(&made)) return std::move(*refused);
    const PreparedWrite& prepared = std::get<PreparedWrite>(made);
    if (wanted.expected && *wanted.expected != prepared.revision) return GraphRefusal{GraphRefusal::Kind::changed};
    auto refused = commit_all({{this, &prepared}}, saving);
    if (!refused || refused->kind == GraphRefusal::Kind::too_large || refused->kind == GraphRefusal::Kind::unsaved) return refused;
  }
  const Turn turn(*this, waits ? Turn::Wait::until_stopped : Turn::Wait::no);
  if (!turn) return GraphRefusal{waits ? GraphRefusal::Kind::stopped : GraphRefusal::Kind::busy};
  while (true) {
    GraphEdit::Graphs others;
    const Version before = saving ? newest() : newest(others);
    if (wanted.expected && *wanted.expected != before.revision) return GraphRefusal{GraphRefusal::Kind::changed};
    if (!waits && GraphEdit::has_much_unused(*before.graph)) return GraphRefusal{GraphRefusal::Kind::busy};  // one that may take long writes it anew
    GraphEdit edit(*before.graph, before.bytes, iri(), options_);
    if (!waits) edit.leave_unused();
    if (!options_.file.empty()) edit.keep_changes(std::move(others));
    if (auto refused = change(edit, wanted)) return refused;
    auto refused = commit(edit, before, saving);
    if (!refused || refused->kind != GraphRefusal::Kind::changed) return refused;
  }
}

/// No Turn is held: the store makes one change after another, each on the version that was shown when it was made.
std::optional<GraphRefusal> GraphState::write_to_store(const GraphWrite& wanted) {
  const auto make = [&](const Version& before) -> HostStore::Made {
    if (wanted.expected && *wanted.expected != before.revision) return GraphRefusal{GraphRefusal::Kind::changed};
    GraphEdit edit(*before.graph, before.bytes, iri(), options_);
    if (auto refused = change(edit, wanted)) return *std::move(refused);
    if (!edit.has_changed()) return before;
    Version made = before;
    made.graph = std::make_shared<const rdf::Graph>(edit.take());
    made.bytes = edit.bytes();
    if (auto refused = judge(*made.graph, made.bytes)) return *std::move(refused);
    return made;
  };
  return store_->write(make);
}

GraphState::Version GraphState::show(std::shared_ptr<const rdf::Graph> graph, std::size_t bytes) {
  Version made{std::move(graph), 0, bytes}, shown;
  {
    const std::lock_guard lock(mutex_);
    made.revision = ++last_revision_;
    shown = made;
    std::swap(newest_, made);
    current_ = newest_;
    fault_.clear();
  }
  notify();
  return shown;  // what was shown before is destroyed without the lock
}

void GraphState::show_fault(std::string fault) {
  Version empty{std::make_shared<const rdf::Graph>(), 0};
  {
    const std::lock_guard lock(mutex_);
    empty.revision = ++last_revision_;
    std::swap(newest_, empty);
    current_ = newest_;
    fault_ = std::move(fault);
  }
  notify();
}

std::string GraphState::fault() const {
  const std::lock_guard lock(mutex_);
  return fault_;
}

/// What the client wants, in the graph that it wants to change.
std::optional<GraphRefusal> GraphState::change(GraphEdit& edit, const GraphWrite& wanted) const {
  switch (wanted.kind) {
    case GraphWrite::Kind::replace: edit.clear(); [[fallthrough]];
    case GraphWrite::Kind::merge: merge(edit, wanted.graph); break;
    case GraphWrite::Kind::edit:
      for (const rdf::DataUpdate& update : wanted.updates) {
        if (update.kind == rdf::DataUpdate::Kind::insert) {
          merge(edit, update.graph);
          continue;
        }
        for (const rdf::Triple& t : update.graph.triples()) {
          Turns::rest_now();
          const rdf::TermView s = update.graph.term(t.subject), p = update.graph.term(t.predicate), o = update.graph.term(t.object);
          edit.remove(&s, &p, &o);
        }
      }
      break;
  }
  if (const std::optional<Error>& error = edit.error())
    return GraphRefusal{error->code == Errc::limit_exceeded ? GraphRefusal::Kind::too_large : GraphRefusal::Kind::failed, error->message};
  return std::nullopt;
}

void GraphState::wait_for_writes() { const Turn turn(*this, Turn::Wait::until_stopped); }

std::variant<PreparedWrite, GraphRefusal> GraphState::prepare(const GraphWrite& wanted) const {
  const Version before = newest();
  GraphEdit edit(*before.graph, before.bytes, iri(), options_);
  if (!options_.file.empty()) edit.keep_changes();
  if (auto refused = change(edit, wanted)) return *std::move(refused);
  PreparedWrite made;
  made.revision = before.revision;
  if (!edit.has_changed()) return made;
  made.changes = edit.take_changes();
  made.graph = std::make_shared<const rdf::Graph>(edit.take());
  made.bytes = edit.bytes();
  if (auto refused = judge(*made.graph, made.bytes)) return *std::move(refused);
  return made;
}

std::optional<GraphRefusal> GraphState::commit_all(std::vector<Prepared> all, std::shared_ptr<Saving>* saving) {
  // All take their locks in one order.
  std::sort(all.begin(), all.end(), [](const Prepared& a, const Prepared& b) { return std::less<>()(a.state, b.state); });
  const Turns::Held held;  // in whatever order those of the Turns end
  std::list<Turn> turns;
  for (const Prepared& one : all)
    if (!turns.emplace_back(*one.state, Turn::Wait::no)) return GraphRefusal{GraphRefusal::Kind::busy};
  std::vector<Version> gone;  // are destroyed without the locks
  gone.reserve(2 * all.size());
  std::list<std::unique_lock<std::mutex>> locks;
  for (const Prepared& one : all) locks.emplace_back(one.state->listener_mutex_);
  for (const Prepared& one : all) locks.emplace_back(one.state->mutex_);
  std::vector<Version> made;
  std::vector<bool> waits;
  for (const Prepared& one : all) {
    GraphState& state = *one.state;
    if (state.newest_.revision != one.write->revision) return GraphRefusal{GraphRefusal::Kind::changed};
    made.push_back({one.write->graph ? one.write->graph : state.newest_.graph, state.newest_.revision, one.write->graph ? one.write->bytes : 0});
    if (!one.write->graph) made.back().bytes = state.newest_.bytes;
    const bool may_wait = saving && state.waits_for_disk();
    if (!may_wait && !state.pending_.empty()) return GraphRefusal{GraphRefusal::Kind::busy};  // it has to be made on all versions: put_by_code()
    waits.push_back(may_wait && (one.write->graph || state.has_unsaved()));
    if (waits.back() && !state.journal_->has_room(one.write->changes.size())) return state.unsaved_refusal();
  }
  const auto waiting = static_cast<std::size_t>(std::count(waits.begin(), waits.end(), true));
  const auto shared = waiting > 0 ? std::make_shared<Saving>(waiting) : nullptr;
  // Graphs that shrink come first, so that what they free is there for those that grow.
  std::vector<std::size_t> order(all.size()), charged;
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto grows = [&](std::size_t i) { return made[i].bytes > all[i].state->newest_.bytes; };
  std::stable_partition(order.begin(), order.end(), [&](std::size_t i) { return !grows(i); });
  for (const std::size_t i : order) {
    GraphState& state = *all[i].state;
    if (!all[i].write->graph || !state.budget_) continue;
    if (state.budget_->change(state.newest_.bytes, made[i].bytes)) {
      charged.push_back(i);
      continue;
    }
    // Back from the last one, so that there is room for what shrank.
    for (; !charged.empty(); charged.pop_back())
      (void)all[charged.back()].state->budget_->change(made[charged.back()].bytes, all[charged.back()].state->newest_.bytes);
    return GraphRefusal{GraphRefusal::Kind::too_large, "the graphs of clients in this World would have more than " +
                                                           std::to_string(state.budget_->max()) +
                                                           " bytes of IRIs and literals, written out; delete some of them"};
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    GraphState& state = *all[i].state;
    const bool has_changed = all[i].write->graph != nullptr;
    if (!has_changed && !waits[i]) continue;
    if (has_changed) made[i].revision = ++state.last_revision_;
    state.put(std::move(made[i]), all[i].write->changes, waits[i] ? shared : nullptr, gone);
  }
  locks.clear();
  if (saving) *saving = shared;
  for (const Prepared& one : all)
    if (one.write->graph) one.state->notify();
  return std::nullopt;
}

Result<void> GraphState::restore(FunctionRef<void(GraphEdit&)> fill) {
  return make([&](GraphEdit& edit) {
    edit.clear();
    fill(edit);
  });
}

GraphRefusal GraphState::unsaved_refusal() const {
  return {GraphRefusal::Kind::unsaved,
          "more than " + std::to_string(options_.max_unsaved_bytes) + " bytes of changes wait for the disk; try again later"};
}

/// @pre the caller has the Turn
std::optional<GraphRefusal> GraphState::commit(GraphEdit& edit, const Version& before, std::shared_ptr<Saving>* saving) {
  const bool has_changed = edit.has_changed();
  if (!has_changed && !saving) return std::nullopt;
  const std::string changes = has_changed ? edit.take_changes() : std::string();
  Version made = before;
  if (has_changed) {
    made.graph = std::make_shared<const rdf::Graph>(edit.take());
    made.bytes = edit.bytes();
    if (auto refused = judge(*made.graph, made.bytes)) return refused;
  }
  std::vector<Version> gone;  // are destroyed without the locks
  gone.reserve(3);
  struct Charge {  // is taken back if the change is not made
    ~Charge() {
      if (budget) (void)budget->change(after, before);
    }
    GraphBudget* budget;
    std::size_t before, after;
  } charge{nullptr, before.bytes, made.bytes};
  {
    const std::lock_guard listening(listener_mutex_);
    if (budget_ && !budget_->change(before.bytes, made.bytes))
      return GraphRefusal{GraphRefusal::Kind::too_large, "the graphs of clients in this World would have more than " +
                                                             std::to_string(budget_->max()) +
                                                             " bytes of IRIs and literals, written out; delete some of them"};
    charge.budget = budget_.get();
    if (saving && waits_for_disk()) {
      auto own = std::make_shared<Saving>();
      const std::lock_guard lock(mutex_);
      if (newest_.revision != before.revision) return GraphRefusal{GraphRefusal::Kind::changed};
      // What a client is told to be there has to be on the disk, whoever has written it.
      if (!has_changed && !has_unsaved()) return std::nullopt;
      if (!journal_->has_room(changes.size())) return unsaved_refusal();
      if (has_changed) made.revision = ++last_revision_;
      put(std::move(made), changes, own, gone);
      charge.budget = nullptr;
      *saving = std::move(own);
      return std::nullopt;  // it is shown later
    }
    if (has_changed)
      if (auto refused = put_by_code(std::move(made), changes, before, gone)) return refused;
    charge.budget = nullptr;
  }
  if (has_changed) notify();
  return std::nullopt;
}

/// Not only by code: also by a client that does not wait for the disk.
/// @param gone  gets the versions before
std::optional<GraphRefusal> GraphState::put_by_code(Version made, const std::string& changes, const Version& before, std::vector<Version>& gone) {
  const std::lock_guard showing(show_mutex_);  // no version comes or goes now
  std::unique_lock lock(mutex_);
  const Version newest = newest_;
  if (!pending_.empty()) gone.push_back(current_);
  for (const Pending& p : pending_)
    if (p.version.graph && &p != &pending_.back()) gone.push_back(p.version);
  lock.unlock();
  const auto make_again = [&](Version& version) {
    version = with_changes(version, changes);
    return judge(*version.graph, version.bytes);
  };
  if (newest.revision != before.revision) {
    made = newest;
    if (auto refused = make_again(made)) return refused;
  }
  for (Version& version : gone)
    if (auto refused = make_again(version)) return refused;
  gone.reserve(gone.size() + 2);
  lock.lock();
  if (pending_.empty()) {
    made.revision = ++last_revision_;
    put(std::move(made), changes, nullptr, gone);
    return std::nullopt;
  }
  if (journal_) {
    journal_->append(changes, last_number_ + 1, false);
    ++last_number_;
  }
  auto other = gone.begin();
  const auto put_other = [&](Version& to) {
    other->revision = ++last_revision_;
    std::swap(to, *other++);
  };
  put_other(current_);
  for (Pending& p : pending_)
    if (p.version.graph && &p != &pending_.back()) put_other(p.version);
  made.revision = ++last_revision_;
  std::swap(newest_, made);
  pending_.back().version = newest_;
  gone.push_back(std::move(made));
  return std::nullopt;
}

/// @pre mutex_ is held, `made` was made from newest_, `gone` has room, and nothing is pending if nobody waits
void GraphState::put(Version made, const std::string& changes, std::shared_ptr<Saving> saving, std::vector<Version>& gone) {
  const bool is_waited = saving != nullptr;
  if (is_waited) pending_.push_back({last_number_ + 1, made, std::move(saving)});
  if (journal_) {
    try {
      const bool joins = journal_->append(changes, last_number_ + 1, is_waited);
      if (joins && pending_.size() > 1) gone.push_back({std::exchange(std::prev(pending_.end(), 2)->version.graph, nullptr), 0});
    } catch (...) {
      if (is_waited) pending_.pop_back();
      throw;
    }
    ++last_number_;
  }
  std::swap(newest_, made);
  gone.push_back(std::move(made));
  if (!is_waited) current_ = newest_;
}

/// With a new revision to come.
GraphState::Version GraphState::with_changes(const Version& before, const std::string& changes) const {
  GraphEdit edit(*before.graph, before.bytes, iri(), options_);
  if (Result<void> made = replay_changes(changes, edit); !made) throw BadResult(std::move(made).error());
  Version result = before;
  result.graph = std::make_shared<const rdf::Graph>(edit.take());
  result.bytes = edit.bytes();
  return result;
}

void GraphState::saved(std::uint64_t number) noexcept {
  std::list<Pending> over;  // are destroyed without the locks
  Version gone;
  {
    const std::lock_guard showing(show_mutex_);
    const std::lock_guard lock(mutex_);
    const auto first_left = std::find_if(pending_.begin(), pending_.end(), [&](const Pending& p) { return p.number > number; });
    if (first_left == pending_.begin()) return;
    over.splice(over.end(), pending_, pending_.begin(), first_left);
    gone = std::exchange(current_, over.back().version);
  }
  notify();
  for (const Pending& p : over) p.saving->settle(SaveOutcome::saved);
}

void GraphState::take_back(ChangeJournal& journal, SaveOutcome outcome) noexcept {
  std::list<Pending> over;
  Version gone;
  {
    const std::lock_guard showing(show_mutex_);
    const std::lock_guard lock(mutex_);
    journal.drop_waited();
    over.swap(pending_);
    gone = std::exchange(newest_, current_);
  }
  for (const Pending& p : over) p.saving->settle(outcome);
}

void Saving::settle(SaveOutcome outcome) noexcept {
  Call call;
  {
    const std::lock_guard lock(mutex_);
    worst_ = std::max(worst_, outcome);
    if (--parts_ == 0) std::swap(call, call_);
    outcome = worst_;
  }
  if (call) call(outcome);
}

void Saving::then(Call call) {
  SaveOutcome outcome{};
  {
    const std::lock_guard lock(mutex_);
    if (parts_ != 0) {
      call_ = std::move(call);
      return;
    }
    outcome = worst_;
  }
  call(outcome);
}

std::optional<GraphRefusal> GraphState::judge(const rdf::Graph& graph, std::size_t bytes) const {
  using Kind = GraphRefusal::Kind;
  const auto too_large = [](std::size_t size, const std::string& unit, std::size_t max) {
    const std::string limit = std::to_string(max);
    return GraphRefusal{Kind::too_large,
                        "it would have " + std::to_string(size) + unit + "; " + limit + " are allowed",
                        {},
                        "it would have more than " + limit + unit};
  };
  if (graph.size() > options_.max_triples) return too_large(graph.size(), " triples", options_.max_triples);
  if (bytes > options_.max_bytes) return too_large(bytes, " bytes of IRIs and literals, written out", options_.max_bytes);
  if (!shapes_) return std::nullopt;
  shacl::ValidateOptions limits;
  limits.max_results = max_violations;
  Result<shacl::Report> report = shacl::validate(*shapes_, graph, limits);
  if (!report) return GraphRefusal{Kind::failed, "it could not be judged: " + report.error().message};
  if (report->conforms()) return std::nullopt;
  return GraphRefusal{Kind::violation, {}, *std::move(report)};
}

/// What a representation states of published values is ignored, because a client may write back what it has read: the triple that leads to a value, and
/// the value's description. Other triples may refer to the value.
void GraphState::merge(GraphEdit& edit, const rdf::Graph& graph) const {
  std::vector<rdf::TermId> open;
  std::vector<bool> reached(graph.term_count()), removed(place_limit(graph));
  for (const PublishedSpec& p : published()) {
    const std::string value = std::string(World::base) + p.property->location();
    const auto id = graph.find(rdf::iri(value));
    if (!id) continue;
    reached[static_cast<std::size_t>(*id)] = true;
    open.push_back(*id);
    const auto object = graph.find(rdf::iri(iri() + p.object)), predicate = graph.find(rdf::iri(p.predicate));
    if (!object || !predicate) continue;
    const auto leading = graph.match(*object, *predicate, *id);
    for (auto at = leading.begin(); at != leading.end(); ++at) removed[at.place()] = true;
  }
  if (open.empty()) return edit.merge(graph);
  while (!open.empty()) {
    const rdf::TermId node = open.back();
    open.pop_back();
    const auto about = graph.match(node, std::nullopt, std::nullopt);
    for (auto at = about.begin(); at != about.end(); ++at) {
      removed[at.place()] = true;
      if (!graph.term(at->object).is_blank() || reached[static_cast<std::size_t>(at->object)]) continue;
      reached[static_cast<std::size_t>(at->object)] = true;
      open.push_back(at->object);
    }
  }
  edit.merge(unmarked(graph, removed));
}

bool GraphState::add_published(PublishedSpec spec) {
  {
    const std::lock_guard lock(mutex_);
    for (const PublishedSpec& p : published_)
      if (p.property->path == spec.property->path) return false;
    published_.push_back(std::move(spec));
  }
  notify();
  return true;
}

void GraphState::remove_published(const PropertySpec& property) noexcept {
  std::optional<PublishedSpec> gone;  // is destroyed without the lock
  {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(published_.begin(), published_.end(), [&](const PublishedSpec& p) { return p.property.get() == &property; });
    if (found == published_.end()) return;
    gone = std::move(*found);
    published_.erase(found);
  }
  notify();
}

std::vector<PublishedSpec> GraphState::published() const {
  const std::lock_guard lock(mutex_);
  return published_;
}

void GraphState::report(std::string fault) {
  {
    const std::lock_guard lock(mutex_);
    if (reports_.size() < max_reports) reports_.push_back(std::move(fault));
  }
  notify();
}

std::vector<std::string> GraphState::take_reports() {
  const std::lock_guard lock(mutex_);
  return std::exchange(reports_, {});
}

void GraphState::set_listener(std::function<void()> listener) {
  const std::lock_guard lock(listener_mutex_);
  listener_ = std::move(listener);
}

void GraphState::set_journal(ChangeJournal* journal) {
  const std::lock_guard lock(listener_mutex_);
  journal_ = journal;
}

void GraphState::notify() noexcept {
  const std::lock_guard lock(listener_mutex_);
  try {
    if (listener_) listener_();
  } catch (...) {  // no memory for the message: the next change sends one
  }
}

}  // namespace lrt::model

// SPDX-License-Identifier: Apache-2.0
#include "src/redland/attachment.hpp"

#include <algorithm>
#include <exception>
#include <utility>

#include "src/base/turns.hpp"

// librdf 1.0.17 exports it and counts by it, but its headers do not declare it.
extern "C" __attribute__((weak)) void librdf_model_add_reference(librdf_model* model);

namespace lrt::redland {
inline namespace v0 {

using lrt::model::GraphEdit;
using lrt::model::GraphState;
using Kind = lrt::model::GraphRefusal::Kind;
using Refusal = std::optional<lrt::model::GraphRefusal>;

namespace {

constexpr std::size_t rows_between_looks = 16;  // at the clock
constexpr int max_interruptions = 3;
constexpr int max_given_back = 2;
constexpr std::size_t max_readers = 4'096;  // that wait for the owner

Refusal refuse(Kind kind, std::string why) { return lrt::model::GraphRefusal{kind, std::move(why)}; }

bool says_full(std::string_view text) {
  for (const std::string_view word : {"disk is full", "No space left", "disk quota", "Disk quota"})
    if (text.find(word) != std::string_view::npos) return true;
  return false;
}

/// What a storage has said, or that it has said nothing.
std::string with_reason(std::string sentence, const std::string& reason) {
  return sentence.append(": ").append(reason.empty() ? "it gives no reason" : reason);
}

Refusal failed(const std::string& sentence, WorldUse::Listening& listening) {
  const std::string why = listening.take();
  return refuse(says_full(why) ? Kind::store_full : Kind::store_failed, with_reason(sentence, why));
}

}  // namespace

/// A step that waits for the owner.
class Model::Impl::Job {
 public:
  explicit Job(std::weak_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
  Job(Job&&) noexcept = default;
  Job(const Job&) = delete;
  ~Job() {  // without having run: the server stops, or there was no memory
    if (const auto impl = impl_.lock()) impl->is_scheduled_ = false;
  }
  void operator()() noexcept {
    if (const auto impl = std::exchange(impl_, {}).lock()) impl->step();
  }

 private:
  std::weak_ptr<Impl> impl_;
};

Model::Impl::Impl(std::shared_ptr<WorldUse> use, librdf_model* model, Options options, GraphOptions graph_options)
    : options_(std::move(options)), graph_options_(std::move(graph_options)), own_base_(World::base), use_(std::move(use)), model_(model) {
  if (librdf_model_add_reference) librdf_model_add_reference(model_);
}

Model::Impl::~Impl() = default;

void Model::Impl::serve(const WorldGraph& graph) {
  const auto& state = lrt::model::GraphAccess::state_of(graph);
  state_ = state;
  state->set_store(shared_from_this());
}

void Model::Impl::give_up() noexcept {
  on_owner([this] { release(); });
  use_.reset();
}

/// Runs on the owner's thread, and waits. With Owner::host that is this one.
template <class F>
void Model::Impl::on_owner(F work) {
  if (use_->owner() == Owner::host || use_->is_owner()) return work();
  struct Wait {
    std::mutex mutex;
    std::condition_variable done;
    bool is_done = false;
  } wait;
  use_->post([&] {
    work();
    const std::lock_guard lock(wait.mutex);
    wait.is_done = true;
    wait.done.notify_all();
  });
  std::unique_lock lock(wait.mutex);
  while (!wait.is_done) wait.done.wait(lock);
}

Result<void> Model::Impl::read_first() {
  Result<void> result;
  on_owner([&] {
    if (!options_.context.empty()) context_.reset(to_node(use_->world(), rdf::iri(options_.context)));
    if (!options_.context.empty() && !context_) {
      result = unexpected(Errc::invalid_option, "Options::context: librdf takes no \"" + options_.context + "\"");
      return;
    }
    const auto state = state_.lock();
    if (!state) return;
    try {
      begin_read(changes_.load(std::memory_order_acquire));
      (void)advance(*state, Clock::time_point::max());
    } catch (const std::exception& e) { result = unexpected(Errc::failed, std::string("it threw: ") + e.what()); }
  });
  if (!result) return result;
  return this->state();
}

Result<void> Model::Impl::state() const {
  const auto state = state_.lock();
  if (!state) return unexpected(Errc::closed, "the World was destroyed");
  std::string fault = state->fault();
  if (fault.empty()) return {};
  Errc code = Errc::failed;
  {
    const std::lock_guard lock(mutex_);
    if (is_detached_) code = Errc::closed;
  }
  return unexpected(code, std::move(fault));
}

Counters Model::Impl::counters() const {
  const std::lock_guard lock(mutex_);
  return counters_;
}

void Model::Impl::changed() noexcept {
  changes_.fetch_add(1, std::memory_order_acq_rel);
  const std::lock_guard lock(mutex_);
  schedule();
}

Result<void> Model::Impl::call(const std::function<void(librdf_model*)>& work) {
  {
    const std::lock_guard lock(mutex_);
    if (is_detached_) return unexpected(Errc::closed, "the model is detached");
  }
  Result<void> result;
  on_owner([&] {
    try {
      work(model_);
    } catch (const BadResult& e) { result = Unexpected{e.error()}; } catch (const std::exception& e) {
      result = unexpected(Errc::failed, std::string("it threw: ") + e.what());
    } catch (...) { result = unexpected(Errc::failed, "it threw an exception that is not a std::exception"); }
  });
  return result;
}

void Model::Impl::detach() noexcept {
  if (!use_) return;
  on_owner([this] { release(); });
  use_.reset();  // on this thread, which may wait for the one of lrt
}

/// On the owner's thread.
void Model::Impl::release() noexcept {
  drop_read();
  std::vector<Done> readers;
  {
    const std::lock_guard lock(mutex_);
    if (is_detached_) return;
    is_detached_ = true;
    for (Write* const write : std::exchange(writes_, {})) {
      write->state = Write::State::done;
      write->outcome = refuse(Kind::late, "the robot's program has closed this model");
    }
    settled_.notify_all();
    readers.swap(readers_);
  }
  const char* const closed = "the robot's program has closed this model";
  if (const auto state = state_.lock()) state->show_fault(closed);
  for (Done& done : readers) done(unexpected(Errc::unavailable, closed));
  context_.reset();
  use_->leave(model_);
  if (librdf_model_add_reference) librdf_free_model(std::exchange(model_, nullptr));
}

// ----------------------------------------------------------------------------------------------------------------- steps

void Model::Impl::set_poll(RunInPoll run) {
  const std::lock_guard lock(mutex_);
  run_ = std::move(run);
  if (run_ && (!is_current() || !writes_.empty() || !readers_.empty())) schedule();
}

void Model::Impl::stop() noexcept {
  std::vector<Done> readers;
  const std::lock_guard lock(mutex_);
  is_stopped_ = true;
  settled_.notify_all();
  readers.swap(readers_);  // their messages are sent when they are destroyed
}

/// @pre mutex_ is held
void Model::Impl::schedule() noexcept {
  if (is_scheduled_ || is_detached_) return;
  try {
    if (use_->owner() == Owner::host && !run_) return;  // set_poll() does it
    is_scheduled_ = true;
    if (use_->owner() == Owner::host) run_(Job(weak_from_this()));
    else use_->post(Job(weak_from_this()));
  } catch (...) { is_scheduled_ = false; }  // no memory: the next request schedules it
}

void Model::Impl::step() noexcept {
  {
    const std::lock_guard lock(mutex_);
    is_scheduled_ = false;
    if (is_detached_) return;
  }
  const Clock::time_point begin = Clock::now(), until = begin + options_.max_step;
  bool more = true;
  try {
    while ((more = work(until)) && Clock::now() < until) {}
  } catch (...) {  // no memory
    drop_read();
    more = false;
  }
  const auto took = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - begin);
  const std::lock_guard lock(mutex_);
  counters_.longest_step = std::max(counters_.longest_step, took);
  if (more) schedule();
}

/// One piece of work. False: there is none.
bool Model::Impl::work(Clock::time_point until) {
  const auto state = state_.lock();
  if (!state) return false;
  const std::uint64_t changes = changes_.load(std::memory_order_acquire);
  if (pass_ && pass_->changes != changes) {
    drop_read();
    ++interruptions_;
    const std::lock_guard lock(mutex_);
    ++counters_.interrupted_reads;
  }
  bool is_due = pass_ != nullptr;
  {
    const std::lock_guard lock(mutex_);
    is_due = is_due || shown_changes_ != changes || !readers_.empty();
  }
  if (is_due) {
    const bool is_whole = options_.reading == Reading::each_time || interruptions_ >= max_interruptions;
    if (!pass_) begin_read(changes);
    if (!advance(*state, is_whole ? Clock::time_point::max() : until)) return true;
    const std::lock_guard lock(mutex_);
    if (is_whole) ++counters_.whole_reads;
  }
  // Also right after a read: a host that changes the model in each turn leaves no other moment.
  Write* next = nullptr;
  {
    const std::lock_guard lock(mutex_);
    if (writes_.empty()) return is_due;
    next = writes_.front();
    writes_.pop_front();
    next->state = Write::State::running;
  }
  carry_out(*state, *next);
  return true;
}

// ------------------------------------------------------------------------------------------------------------------ read

bool Model::Impl::waits(Done& done) {
  std::vector<Done> late;
  {
    const std::lock_guard lock(mutex_);
    if (is_detached_ || is_stopped_ || options_.reading != Reading::each_time) return false;
    // If the host does not poll, most of them have been answered with 503.
    if (readers_.size() >= max_readers) late.swap(readers_);
    readers_.push_back(std::move(done));
    schedule();
  }
  for (Done& one : late) one(unexpected(Errc::unavailable, "the robot's program has not read its model in time"));
  return true;
}

void Model::Impl::read(Done done) {
  if (waits(done)) return;
  std::string fault;
  if (const auto state = state_.lock()) fault = state->fault();
  if (fault.empty()) return done({});
  {
    const std::lock_guard lock(mutex_);
    if (may_recover_ && is_current()) {
      changes_.fetch_add(1, std::memory_order_acq_rel);
      schedule();
    }
  }
  done(unexpected(Errc::unavailable, fault));
}

void Model::Impl::begin_read(std::uint64_t changes) {
  const auto state = state_.lock();
  GraphState::Version before = state->version();
  // A version of which much is unused is written anew in steps, too.
  const bool anew = GraphEdit::has_much_unused(*before.graph);
  GraphEdit edit(anew ? rdf::Graph() : *before.graph, anew ? 0 : before.bytes, state->iri(), graph_options_);
  edit.leave_unused();
  pass_ = std::make_unique<Pass>(Pass{changes, std::move(before), anew, std::move(edit), nullptr});
  {
    const std::lock_guard lock(mutex_);
    readers_of_pass_.swap(readers_);
  }
  WorldUse::Listening listening(*use_);
  pass_->stream.reset(context_ ? librdf_model_context_as_stream(model_, context_.get()) : librdf_model_as_stream(model_));
  pass_->storage_fails = !pass_->stream;
  if (!pass_->stream) read_ended(*state, with_reason("the storage returns no statements", listening.take()));
}

/// @return  the read has ended
bool Model::Impl::advance(GraphState& state, Clock::time_point until) {
  if (!pass_) return true;  // it has ended when it began
  Pass& pass = *pass_;
  WorldUse::Listening listening(*use_);
  if (!pass.compares) {
    std::size_t rows = 0;
    for (; librdf_stream_end(pass.stream.get()) == 0; librdf_stream_next(pass.stream.get())) {
      if (++rows % rows_between_looks == 0 && Clock::now() >= until) return false;
      librdf_statement* const statement = librdf_stream_get_object(pass.stream.get());
      std::string fault = statement ? take(pass, statement) : with_reason("the storage does not return a statement", listening.take());
      pass.storage_fails = !statement;
      if (!fault.empty()) return read_ended(state, fault), true;
      ++pass.rows;
    }
    pass.storage_fails = true;
    pass.stream.reset();
    if (const std::string said = listening.take(); !said.empty()) return read_ended(state, "the storage cannot be read: " + said), true;
    const int size = context_ ? -1 : librdf_model_size(model_);
    if (size > 0 && pass.rows < static_cast<std::size_t>(size))
      return read_ended(state, "the storage has " + std::to_string(size) + " statements and returns " + std::to_string(pass.rows)), true;
    pass.storage_fails = false;
    pass.compares = true;
  }
  if (!pass.anew && pass.known < pass.before.graph->size()) {
    const rdf::Graph& before = *pass.before.graph;
    if (!pass.all) pass.at = pass.all.emplace(before.match(std::nullopt, std::nullopt, std::nullopt)).begin();
    std::size_t rows = 0;
    for (auto& at = pass.at; at != pass.all->end(); ++at) {
      if (++rows % rows_between_looks == 0 && Clock::now() >= until) return false;
      if (at.place() < pass.seen.size() && pass.seen[at.place()]) continue;
      const rdf::TermView s = before.term(at->subject), p = before.term(at->predicate), o = before.term(at->object);
      pass.edit.remove(&s, &p, &o);
    }
  }
  read_ended(state, finish(state, pass));
  return true;
}

/// @return  why the read ends; empty: it does not
std::string Model::Impl::take(Pass& pass, librdf_statement* statement) {
  librdf_node* const nodes[3] = {librdf_statement_get_subject(statement), librdf_statement_get_predicate(statement),
                                 librdf_statement_get_object(statement)};
  std::string texts[3], fault;
  rdf::TermView terms[3];
  for (int i = 0; i < 3 && fault.empty(); ++i)
    if (const auto view = view_of(nodes[i], texts[i], fault)) terms[i] = *view;
  if (fault.empty() && terms[0].is_literal()) fault = "a literal as subject";
  if (fault.empty() && !terms[1].is_iri()) fault = "a predicate that is no IRI";
  if (!fault.empty()) {
    if (options_.refuses_foreign_terms) return "the model has what RDF 1.1 does not have: " + fault;
    if (pass.left_out++ == 0) pass.example = std::move(fault);
    return {};
  }
  const rdf::Graph& before = *pass.before.graph;
  for (int i = 0; i < 3; ++i) {
    if (terms[i].is_blank()) {
      texts[i] = labels_.label_of(terms[i].text);
      terms[i].text = texts[i];
    } else if (terms[i].is_iri() && !options_.base.empty()) {
      const std::string_view iri = terms[i].text, base = options_.base;
      if (iri.substr(0, base.size()) != base || (iri.size() > base.size() && iri[base.size()] != '/')) continue;
      texts[i] = own_base_ + std::string(iri.substr(base.size()));
      terms[i].text = texts[i];
    }
  }
  const auto s = before.find(terms[0]), p = before.find(terms[1]), o = before.find(terms[2]);
  const auto found = s && p && o ? before.match(s, p, o) : before.match(nullptr, nullptr, nullptr);
  const bool is_known = s && p && o && !found.empty();
  if (is_known) {
    const std::uint32_t place = found.begin().place();
    if (pass.seen.size() <= place) pass.seen.resize(std::max<std::size_t>(place + 1, before.size()));
    if (!pass.seen[place]) {
      pass.seen[place] = true;
      ++pass.known;
    }
  }
  if (!is_known || pass.anew) pass.edit.add(terms[0], terms[1], terms[2]);
  if (pass.edit.error()) return pass.edit.error()->message;
  const std::size_t size = pass.anew ? pass.edit.size() : pass.known + pass.edit.size() - before.size();
  if (size > graph_options_.max_triples)
    return "the model has more than " + std::to_string(graph_options_.max_triples) + " statements, which this graph may have";
  return {};
}

/// @return  why nothing is shown
std::string Model::Impl::finish(GraphState& state, Pass& pass) {
  if (pass.edit.error()) return pass.edit.error()->message;
  const bool has_changed = pass.anew ? pass.known != pass.before.graph->size() || pass.edit.size() != pass.known : pass.edit.has_changed();
  if (has_changed || !state.fault().empty()) {
    auto made = std::make_shared<const rdf::Graph>(pass.edit.take());
    const std::size_t bytes = pass.edit.bytes();
    if (bytes > graph_options_.max_bytes)
      return "the model has more than " + std::to_string(graph_options_.max_bytes) + " bytes of IRIs and literals, which this graph may have";
    labels_.keep([&](const std::string& label) { return made->find(rdf::blank(label)).has_value(); });
    (void)state.show(std::move(made), bytes);
  }
  if (pass.left_out > 0 && pass.example != last_example_)
    state.report("graph \"" + state.path().substr(1) + "\": " + std::to_string(pass.left_out) +
                 " statements of the model are left out, which RDF 1.1 does not have; the first has " + pass.example);
  last_example_ = pass.example;
  return {};
}

void Model::Impl::read_ended(GraphState& state, const std::string& fault) {
  const std::unique_ptr<Pass> pass = std::move(pass_);
  interruptions_ = 0;
  may_recover_ = !fault.empty() && (pass->storage_fails || options_.reading == Reading::each_time);
  if (fault.empty()) {
    last_fault_.clear();
  } else if (fault != state.fault()) {
    state.show_fault(fault);
    labels_.clear();
    if (fault != last_fault_) state.report("graph \"" + state.path().substr(1) + "\" is not shown: " + fault);
    last_fault_ = fault;
  }
  std::vector<Done> readers;
  {
    const std::lock_guard lock(mutex_);
    shown_changes_ = pass->changes;
    if (fault.empty()) {
      ++counters_.reads;
      counters_.left_out = pass->left_out;
      counters_.statements = pass->rows;
    } else {
      ++counters_.failed_reads;
    }
    readers.swap(readers_of_pass_);
    settled_.notify_all();
  }
  for (Done& done : readers) done(fault.empty() ? Result<void>() : unexpected(Errc::unavailable, fault));
}

/// Its readers wait for the next one.
void Model::Impl::drop_read() noexcept {
  pass_.reset();
  const std::lock_guard lock(mutex_);
  try {
    for (Done& done : readers_of_pass_) readers_.push_back(std::move(done));
  } catch (...) {}  // no memory: they are told so when they are destroyed
  readers_of_pass_.clear();
}

// ----------------------------------------------------------------------------------------------------------------- write

Refusal Model::Impl::write(Make make) {
  const Clock::time_point deadline = Clock::now() + options_.write_timeout;
  const auto late = [] {
    return refuse(Kind::late,
                  "the robot's program, which has this graph in a model of Redland, has not taken the change in time; nothing has changed");
  };
  const char* const stopping = "the server stops, or the World was removed";
  std::unique_lock lock(mutex_);
  if (may_recover_ && is_current()) changes_.fetch_add(1, std::memory_order_acq_rel);
  const auto wait = [&](auto is_over) {
    if (is_over()) return true;
    const Turns::Waiting others_work;
    return settled_.wait_until(lock, deadline, is_over);
  };
  for (int attempt = 1;; ++attempt) {
    // What the host has changed before this request has to be read. It may have gone on since.
    const std::uint64_t needed = changes_.load(std::memory_order_acquire);
    schedule();
    const bool is_read = wait([&] { return is_stopped_ || is_detached_ || shown_changes_ >= needed; });
    if (is_stopped_) return refuse(Kind::stopped, stopping);
    if (!is_read) return late();
    const auto state = state_.lock();
    if (!state) return refuse(Kind::stopped, stopping);
    if (std::string fault = state->fault(); !fault.empty()) return refuse(Kind::late, std::move(fault));
    Write write{state->version(), {}, &make};
    lock.unlock();
    if (auto refused = make_change(write)) return refused;
    if (attempt < max_given_back) write.make = nullptr;
    lock.lock();
    if (is_stopped_) return refuse(Kind::stopped, stopping);
    if (is_detached_) return refuse(Kind::late, state->fault());
    writes_.push_back(&write);
    schedule();
    const auto is_done = [&] { return write.state == Write::State::done; };
    wait([&] { return is_done() || (is_stopped_ && write.state == Write::State::queued); });
    if (write.state == Write::State::queued) {
      writes_.erase(std::find(writes_.begin(), writes_.end(), &write));
      return is_stopped_ ? refuse(Kind::stopped, stopping) : late();
    }
    while (!is_done()) settled_.wait(lock);  // it is running
    if (!write.outcome || write.outcome->kind != Kind::changed) return std::move(write.outcome);
    if (write.make) return late();  // it was made anew, and the model was another one again
  }
}

void Model::Impl::settle(Write& write, Refusal outcome) noexcept {
  const std::lock_guard lock(mutex_);
  write.outcome = std::move(outcome);
  write.state = Write::State::done;
  settled_.notify_all();
}

/// On the version before.
Refusal Model::Impl::make_change(Write& write) const {
  auto made = (*write.make)(write.before);
  if (auto* const refused = std::get_if<GraphRefusal>(&made)) return std::move(*refused);
  write.made = std::move(std::get<GraphState::Version>(made));
  const rdf::Graph &before = *write.before.graph, &after = *write.made.graph;
  write.difference = &before == &after ? rdf::Difference() : rdf::difference(before, after);
  if (write.difference.removed.size() + write.difference.added.size() > options_.max_write)
    return refuse(Kind::too_large, "this change adds and removes more than " + std::to_string(options_.max_write) +
                                       " statements, which one write may do, because the robot's program waits for it");
  return std::nullopt;
}

void Model::Impl::carry_out(GraphState& state, Write& write) {
  struct Settled {  // also if memory is exhausted
    ~Settled() { self.settle(write, std::move(outcome)); }
    Impl& self;
    Write& write;
    Refusal outcome;
  } settled{*this, write, lrt::model::GraphRefusal{Kind::store_failed}};
  if (options_.reading == Reading::each_time) {  // nobody says whether the model is what is shown
    begin_read(changes_.load(std::memory_order_acquire));
    (void)advance(state, Clock::time_point::max());
  }
  settled.outcome = try_write(state, write);
  const std::lock_guard lock(mutex_);
  if (!settled.outcome) ++counters_.writes;
  else if (settled.outcome->kind != Kind::changed) ++counters_.failed_writes;
}

/// The statements of a change, in the terms of the model.
struct Model::Impl::Change {
  std::vector<StatementPointer> removed, added;
  std::vector<std::pair<std::string, std::string>> labels;  ///< of new blank nodes, with their identifiers
  std::string_view id_of(std::string_view label, const Labels& known) const {
    for (const auto& [own, id] : labels)
      if (own == label) return id;
    return known.id_of(label);
  }
};

Refusal Model::Impl::try_write(GraphState& state, Write& write) {
  const GraphState::Version shown = state.version();
  if (shown.revision != write.before.revision) {
    if (!write.make) return refuse(Kind::changed, {});
    write.before = shown;
    if (auto refused = make_change(write)) return refused;
  }
  if (!state.fault().empty()) return refuse(Kind::late, state.fault());
  Change change;
  if (auto refused = prepare(write, change)) return refused;
  const std::size_t count = change.removed.size() + change.added.size();
  if (count == 0) return std::nullopt;

  WorldUse::Listening listening(*use_);
  const bool is_transaction = librdf_model_transaction_start(model_) == 0;
  const std::string no_transaction = listening.take();
  if (!is_transaction && !no_transaction.empty()) return refuse(Kind::late, "the storage begins no transaction now: " + no_transaction);
  if (!is_transaction && count > 1 && !options_.allows_partial_writes)
    return refuse(
        Kind::unsupported,
        "this change is more than one statement, and the storage of this model begins no transaction (it has none, or the robot's program has "
        "one open, or an error of the disk has ended one, and the program has to open the storage again): it could be left half made. Change "
        "one statement at a time");
  struct Unsure {  // also if memory is exhausted: whatever the storage has then is read, and not assumed
    ~Unsure() {
      if (is_open) librdf_model_transaction_rollback(self.model_);
      if (!is_shown) self.changes_.fetch_add(1, std::memory_order_acq_rel);
    }
    Impl& self;
    bool is_open, is_shown = false;
  } unsure{*this, is_transaction};
  Refusal refused = apply(change, listening);
  if (!refused && is_transaction) {
    if (librdf_model_transaction_commit(model_) != 0) refused = failed("the storage does not commit the change", listening);
    else unsure.is_open = false;
  }
  if (refused) {
    if (!is_transaction && count > 1) refused->message += "; part of the change may be in the model";
    return refused;
  }
  for (auto& [label, id] : change.labels) labels_.bind(std::move(id), std::move(label));
  (void)state.show(write.made.graph, write.made.bytes);
  unsure.is_shown = true;
  return std::nullopt;
}

/// Makes the statements before anything is changed.
Refusal Model::Impl::prepare(const Write& write, Change& change) {
  const rdf::Graph &before = *write.before.graph, &after = *write.made.graph;
  std::string fault;
  for (const rdf::Triple& t : write.difference.removed) {
    change.removed.push_back(statement_of(before, t, change, fault));
    if (!change.removed.back()) return refuse(Kind::failed, fault);
  }
  for (const rdf::Triple& t : write.difference.added) {
    for (const rdf::TermId id : {t.subject, t.object}) {
      const rdf::TermView term = after.term(id);
      if (!term.is_blank() || before.find(term)) continue;
      const auto is_it = [&](const auto& known) { return known.first == term.text; };
      if (std::none_of(change.labels.begin(), change.labels.end(), is_it)) change.labels.emplace_back(term.text, new_identifier(use_->world()));
    }
    change.added.push_back(statement_of(after, t, change, fault));
    if (!change.added.back()) return refuse(Kind::failed, fault);
  }
  return std::nullopt;
}

std::string Model::Impl::iri_in_model(std::string_view iri, std::string& fault) const {
  if (iri.substr(0, own_base_.size()) != own_base_ || (iri.size() > own_base_.size() && iri[own_base_.size()] != '/')) return std::string(iri);
  if (options_.base.empty())
    fault = "IRIs of this server cannot be written to this model, because the robot's program does not say how they are in it";
  return options_.base + std::string(iri.substr(own_base_.size()));
}

StatementPointer Model::Impl::statement_of(const rdf::Graph& graph, const rdf::Triple& triple, const Change& change, std::string& fault) const {
  NodePointer nodes[3];
  const rdf::TermId ids[3] = {triple.subject, triple.predicate, triple.object};
  for (int i = 0; i < 3; ++i) {
    rdf::TermView term = graph.term(ids[i]);
    std::string text;
    if (term.is_iri()) text = iri_in_model(term.text, fault);
    if (term.is_blank()) text = change.id_of(term.text, labels_);
    if (!term.is_literal()) term.text = text;
    if (fault.empty()) nodes[i].reset(to_node(use_->world(), term));
    if (fault.empty() && !nodes[i]) fault = "librdf takes no " + rdf::to_string(term);
    if (!fault.empty()) return nullptr;
  }
  StatementPointer made(librdf_new_statement_from_nodes(use_->world(), nodes[0].release(), nodes[1].release(), nodes[2].release()));
  if (!made) fault = "librdf has no memory for a statement";
  return made;
}

Refusal Model::Impl::apply(const Change& change, WorldUse::Listening& listening) {
  for (const StatementPointer& statement : change.removed)
    if (auto refused = remove(statement.get(), listening)) return refused;
  for (const StatementPointer& statement : change.added)
    if (auto refused = add(statement.get(), listening)) return refused;
  return std::nullopt;
}

namespace {

/// Terms that RDF 1.1 does not tell apart are equal.
bool same_object(librdf_statement* a, librdf_statement* b) {
  std::string texts[2], fault;
  const auto first = view_of(librdf_statement_get_object(a), texts[0], fault), second = view_of(librdf_statement_get_object(b), texts[1], fault);
  return first && second && *first == *second;
}

}  // namespace

/// The statements that are one triple of RDF 1.1: "x" and "x"^^xsd:string, "x"@en and "x"@EN may be several. Found by subject and predicate, because the
/// storage `hashes` looks at all statements for one that is given as a whole.
std::vector<StatementPointer> Model::Impl::alike(librdf_statement* wanted) const {
  std::vector<StatementPointer> found;
  const StatementPointer pattern(librdf_new_statement_from_nodes(use_->world(), librdf_new_node_from_node(librdf_statement_get_subject(wanted)),
                                                                 librdf_new_node_from_node(librdf_statement_get_predicate(wanted)), nullptr));
  if (!pattern) return found;
  const StreamPointer all(context_ ? librdf_model_find_statements_in_context(model_, pattern.get(), context_.get())
                                   : librdf_model_find_statements(model_, pattern.get()));
  for (; all && librdf_stream_end(all.get()) == 0; librdf_stream_next(all.get())) {
    librdf_statement* const one = librdf_stream_get_object(all.get());
    if (!one || !same_object(one, wanted)) continue;
    StatementPointer copy(librdf_new_statement_from_statement(one));
    // One that is in several contexts comes several times.
    if (copy && std::none_of(found.begin(), found.end(), [&](const auto& known) { return librdf_statement_equals(known.get(), copy.get()) != 0; }))
      found.push_back(std::move(copy));
  }
  return found;
}

Refusal Model::Impl::remove(librdf_statement* statement, WorldUse::Listening& listening) {
  const std::vector<StatementPointer> found = alike(statement);
  if (found.empty()) {
    if (const std::string why = listening.take(); !why.empty()) return refuse(Kind::store_failed, "the storage cannot be searched: " + why);
    return refuse(Kind::changed, {});  // the host has removed it, and has not said so
  }
  int result = 0;
  for (const StatementPointer& one : found)
    result |= context_ ? librdf_model_context_remove_statement(model_, context_.get(), one.get()) : librdf_model_remove_statement(model_, one.get());
  const bool is_left = !alike(statement).empty();
  if (is_left && !context_ && librdf_model_supports_contexts(model_) != 0)
    return refuse(Kind::unsupported, "a statement is in a context of the model, from which this graph does not remove");
  if (result != 0 || is_left) return failed("the storage does not remove a statement", listening);
  return std::nullopt;
}

Refusal Model::Impl::add(librdf_statement* statement, WorldUse::Listening& listening) {
  const int result = context_ ? librdf_model_context_add_statement(model_, context_.get(), statement) : librdf_model_add_statement(model_, statement);
  if (result != 0) return failed("the storage does not take a statement", listening);
  if (alike(statement).empty()) return failed("the storage does not return a statement as it was written", listening);
  return std::nullopt;
}

}  // namespace v0
}  // namespace lrt::redland

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <variant>
#include <vector>

#include <lrt/base/immortal.hpp>
#include <lrt/query.hpp>
#include <lrt/query/answer.hpp>
#include <lrt/rdf/codec.hpp>

#include "src/query/budget.hpp"
#include "src/query/dataset.hpp"
#include "src/query/dependencies.hpp"
#include "src/query/evaluate.hpp"
#include "src/query/parser.hpp"
#include "src/rdf/difference.hpp"
#include "src/rdf/hash.hpp"

namespace lrt::query {
inline namespace v0 {

namespace {

using Types = std::vector<std::string_view>;

/// The format of each media type of row_types(), by index.
constexpr ResultFormat row_formats[] = {ResultFormat::json, ResultFormat::xml,  ResultFormat::csv,
                                        ResultFormat::tsv,  ResultFormat::json, ResultFormat::xml};

/// The types of SELECT; those of ASK are fewer. Clients that accept JSON or XML of any kind get it under that name.
const Types& row_types() {
  static const Immortal<Types> all(Types{media_type(ResultFormat::json), media_type(ResultFormat::xml), media_type(ResultFormat::csv),
                                         media_type(ResultFormat::tsv), "application/json", "application/xml"});
  return *all;
}
constexpr ResultFormat ask_formats[] = {ResultFormat::json, ResultFormat::xml, ResultFormat::json, ResultFormat::xml};
const Types& ask_types() {
  static const Immortal<Types> all(Types{media_type(ResultFormat::json), media_type(ResultFormat::xml), "application/json", "application/xml"});
  return *all;
}
const Types& graph_types() {
  static const Immortal<Types> all([] {
    Types types;
    for (const rdf::Syntax syntax : rdf::available_syntaxes()) types.push_back(rdf::media_type(syntax));
    return types;
  }());
  return *all;
}

class Prepared final : public engine::PreparedQuery {
 public:
  Prepared(std::shared_ptr<const Query> parsed, Selection of_request) : query(std::move(parsed)), selection(std::move(of_request)) {
    Dependencies found = dependencies_of(*query);
    dependencies_.everything = found.everything;
    dependencies_.predicates = std::move(found.predicates);
    dependencies_.types = std::move(found.types);
    dependencies_.graphs = selection.default_graphs.empty() && selection.named_graphs.empty() ? std::move(found.graphs) : std::vector<std::string>();
    dependencies_.time = found.uses_now_or_random;
  }
  const Types& types() const override {
    switch (query->form) {
      case Query::Form::select: return row_types();
      case Query::Form::ask: return ask_types();
      default: return graph_types();
    }
  }
  const engine::QueryDependencies& dependencies() const override { return dependencies_; }
  bool has_rows() const noexcept override { return query->form == Query::Form::select; }

  const std::shared_ptr<const Query> query;
  const Selection selection;

 private:
  engine::QueryDependencies dependencies_;
};

/// Blank nodes count as equal: their labels are new in each answer.
std::uint64_t hash_of(const std::optional<rdf::TermView>& term) noexcept {
  if (!term) return 1;
  if (term->is_blank()) return 2;
  const std::uint64_t text = rdf::hash_bytes(term->text, rdf::hash_seeds().bytes + static_cast<std::uint64_t>(term->kind));
  return term->is_literal() ? rdf::hash_bytes(term->language.empty() ? term->datatype : term->language, text) : text;
}

std::uint64_t mix(std::uint64_t a, std::uint64_t b) noexcept { return rdf::fold_multiply(a ^ 0x9E3779B97F4A7C15U, b ^ 0xE7037ED1A0B428DBU); }

std::uint64_t digest_of(const Answer& answer, bool ordered) noexcept {
  if (const auto* yes = std::get_if<bool>(&answer)) return *yes ? 1 : 0;
  std::uint64_t all = 0;
  const auto add = [&](std::uint64_t one) { all = ordered ? mix(all, one) : all + one; };
  if (const auto* table = std::get_if<Table>(&answer)) {
    for (std::size_t row = 0; row < table->rows(); ++row) {
      std::uint64_t one = 3;
      for (std::size_t column = 0; column < table->columns(); ++column) one = mix(one, hash_of(table->at(row, column)));
      add(one);
    }
    return mix(all, table->rows());
  }
  const auto& graph = std::get<rdf::Graph>(answer);
  for (const rdf::Triple& t : graph.triples())
    add(mix(mix(hash_of(graph.term(t.subject)), hash_of(graph.term(t.predicate))), hash_of(graph.term(t.object))));
  return mix(all, graph.size());
}

/// Rows by what is in them, and how often they are there.
using RowCounts = std::unordered_map<std::string, std::size_t>;

std::string text_of(const Table& table, std::size_t row) {
  std::string text;
  for (std::size_t column = 0; column < table.columns(); ++column) {
    if (const auto term = table.at(row, column)) text += rdf::to_string(*term);
    text += '\n';
  }
  return text;
}

/// The rows of a table that another one does not have.
Table rows_without(const Table& table, const Table& others) {
  RowCounts known;
  for (std::size_t row = 0; row < others.rows(); ++row) ++known[text_of(others, row)];
  Table rest(table.variables());
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (const auto found = known.find(text_of(table, row)); found != known.end() && found->second > 0) {
      --found->second;
      continue;
    }
    rest.add_row();
    for (std::size_t column = 0; column < table.columns(); ++column)
      if (const auto term = table.at(row, column)) rest.set(column, *term);
  }
  return rest;
}

/// Those of the query, and of lrt those that it does not use for something else.
rdf::Prefixes prefixes_of(const Query& query) {
  rdf::Prefixes all = query.prefixes;
  for (const auto& one : rdf::default_prefixes()) {
    const bool is_known = std::any_of(query.prefixes.begin(), query.prefixes.end(),
                                      [&](const auto& other) { return other.first == one.first || other.second == one.second; });
    if (!is_known) all.push_back(one);
  }
  return all;
}

/// An answer. Bounds::answer_bytes bounds what its functions do, which nothing can cancel.
class Answered final : public engine::QueryAnswer {
 public:
  /// @param of_standing  its digest is computed now, on the thread of the query. That of another answer is hardly ever wanted
  /// @param share        for the answer
  Answered(std::shared_ptr<const Query> query, Answer answer, bool of_standing, MemoryShare share)
      : query_(std::move(query)), answer_(std::move(answer)), share_(std::move(share)) {
    if (of_standing) digest_ = digest_of(answer_, is_ordered());
  }

  Result<std::string> write(std::size_t type) const override {
    if (const auto* table = std::get_if<Table>(&answer_)) return query::write(*table, row_formats[type]);
    if (const auto* yes = std::get_if<bool>(&answer_)) return query::write(*yes, ask_formats[type]);
    return rdf::write(std::get<rdf::Graph>(answer_), rdf::available_syntaxes()[type], prefixes_of(*query_));
  }
  std::uint64_t digest() const noexcept override { return digest_ ? *digest_ : digest_of(answer_, is_ordered()); }
  Result<std::string> changes_since(const QueryAnswer& before, std::uint64_t sequence) const override {
    const auto& now = std::get<Table>(answer_);
    const auto& then = std::get<Table>(static_cast<const Answered&>(before).answer_);
    Result<std::string> added = query::write(rows_without(now, then), ResultFormat::json);
    const Result<std::string> removed = query::write(rows_without(then, now), ResultFormat::json);
    if (!added || !removed) return added ? removed : added;
    constexpr std::string_view results = "\"results\":";
    const std::size_t at = removed->find(results) + results.size(), end = removed->rfind('}');
    added->resize(added->rfind('}'));
    added->append(",\"removed\":").append(*removed, at, end - at).append(",\"sequence\":" + std::to_string(sequence) + "}");
    return added;
  }

 private:
  bool is_ordered() const noexcept { return !query_->order_by.empty(); }

  const std::shared_ptr<const Query> query_;
  const Answer answer_;
  const MemoryShare share_;
  std::optional<std::uint64_t> digest_;
};

/// The graph with another beginning of IRIs.
rdf::Graph placed(const rdf::Graph& graph, std::string_view placeholder, const std::string& base) {
  rdf::Graph result;
  std::vector<rdf::TermId> terms;
  terms.reserve(graph.term_count());
  std::string text;
  for (std::size_t i = 0; i < graph.term_count(); ++i) {
    rdf::TermView term = graph.term(static_cast<rdf::TermId>(i));
    if (term.is_iri() && term.text.substr(0, placeholder.size()) == placeholder) {
      text = base + std::string(term.text.substr(placeholder.size()));
      term.text = text;
    }
    terms.push_back(result.intern(term));
  }
  const auto of = [&](rdf::TermId id) { return terms[static_cast<std::size_t>(id)]; };
  for (const rdf::Triple& t : graph.match(std::nullopt, std::nullopt, std::nullopt)) result.add(of(t.subject), of(t.predicate), of(t.object));
  return result;
}

/// The triples of a graph whose IRIs get another beginning.
class Placed {
 public:
  explicit Placed(const engine::NamedGraph& graph) : placeholder_(graph.placeholder), base_(graph.base) {}

  /// The triples of a list.
  /// @param unless_in  without those that this graph has, too: under the name that they have here, or the one that they get
  std::vector<Dataset::Change> triples(const std::vector<rdf::Triple>& list, const rdf::Graph& of, const rdf::Graph* unless_in) {
    std::vector<Dataset::Change> all;
    all.reserve(list.size());
    for (const rdf::Triple& t : list) {
      const rdf::TermView terms[3] = {of.term(t.subject), of.term(t.predicate), of.term(t.object)};
      if (unless_in && has(*unless_in, terms)) continue;
      all.push_back({placed(terms[0]), placed(terms[1]), placed(terms[2])});
    }
    return all;
  }

 private:
  static bool begins(std::string_view text, std::string_view with) noexcept { return text.substr(0, with.size()) == with; }
  rdf::TermView placed(rdf::TermView term) {
    if (placeholder_.empty() || !term.is_iri() || !begins(term.text, placeholder_)) return term;
    texts_.push_back(base_ + std::string(term.text.substr(placeholder_.size())));
    term.text = texts_.back();
    return term;
  }
  /// Two terms of the graph may be one when they are placed.
  bool has(const rdf::Graph& graph, const rdf::TermView (&terms)[3]) const {
    if (placeholder_.empty()) return false;
    std::string texts[3];
    rdf::TermView others[3];
    bool any = false;
    for (int i = 0; i < 3; ++i) {
      others[i] = terms[i];
      if (!terms[i].is_iri()) continue;
      if (begins(terms[i].text, placeholder_)) texts[i] = base_ + std::string(terms[i].text.substr(placeholder_.size()));
      else if (begins(terms[i].text, base_)) texts[i] = std::string(placeholder_) + std::string(terms[i].text.substr(base_.size()));
      else continue;
      others[i].text = texts[i];
      any = true;
    }
    for (unsigned choice = 1; any && choice < 8; ++choice)
      if (graph.contains(choice & 1 ? others[0] : terms[0], choice & 2 ? others[1] : terms[1], choice & 4 ? others[2] : terms[2])) return true;
    return false;
  }

  const std::string &placeholder_, &base_;
  std::list<std::string> texts_;
};

/// About what a dataset needs for a new triple, with its terms.
constexpr std::size_t bytes_of_triple = 200;
/// Graphs with fewer triples are compared as a whole.
constexpr std::size_t many_triples = 2'000;

/// The graphs of one audience. An evaluation reads an immutable dataset: if an evaluation still reads it, the next change makes a copy.
class Data final : public engine::QueryData {
 public:
  /// A dataset, and how many evaluations read it.
  struct Version {
    explicit Version(std::shared_ptr<Memory> memory) : share(std::move(memory)) {}
    Dataset dataset;
    MemoryShare share;
    std::atomic<int> readers{0};
  };
  class Reader {
   public:
    explicit Reader(std::shared_ptr<Version> version) : version_(std::move(version)) {}
    Reader(Reader&& other) noexcept = default;
    Reader& operator=(Reader&&) = delete;
    ~Reader() {
      if (version_) version_->readers.fetch_sub(1, std::memory_order_release);
    }
    const Dataset& operator*() const noexcept { return version_->dataset; }

   private:
    std::shared_ptr<Version> version_;
  };

  explicit Data(std::shared_ptr<Memory> memory) : memory_(std::move(memory)) {}

  void change(std::vector<engine::NamedGraph> graphs) override {
    const std::lock_guard lock(waiting_mutex_);
    if (waiting_.empty()) waiting_ = std::move(graphs);
    else waiting_.insert(waiting_.end(), std::make_move_iterator(graphs.begin()), std::make_move_iterator(graphs.end()));
  }

  /// The graphs as they are now. Changes that are not yet applied when an error occurs stay for the next call.
  /// @par Errors  limit_exceeded: max_triples, max_total_bytes; what Budget::check() throws. Both are checked before each graph
  Result<Reader> read(Budget& budget, std::size_t max_triples) {
    const std::lock_guard lock(mutex_);
    budget.check();
    take_changes();
    if (!changes_.empty() && current_->readers.load(std::memory_order_acquire) != 0) {
      auto copy = std::make_shared<Version>(memory_);
      if (!copy->share.set(current_->dataset.bytes())) return too_many_bytes();
      copy->dataset = current_->dataset;
      current_ = std::move(copy);
    }
    Dataset& dataset = current_->dataset;
    const auto too_many = [&] { return dataset.triple_count() > max_triples; };
    for (; !changes_.empty(); changes_.pop_back()) {
      budget.check();
      const engine::NamedGraph& one = changes_.back();
      if (!one.graph) {
        applied_.erase(one.name);
        dataset.remove(one.name);
        continue;
      }
      if (too_many() && one.graph->size() > size_of(one.name)) break;
      if (std::optional<Differing> differing = difference_of(one)) {
        if (!current_->share.set(dataset.bytes() + differing->difference.added.size() * bytes_of_triple)) return too_many_bytes();
        change(dataset, one, *differing);
        continue;
      }
      if (!current_->share.set(dataset.bytes() + one.graph->size() * bytes_of_triple)) return too_many_bytes();
      applied_.erase(one.name);
      dataset.put(one.name, one.placeholder.empty() ? *one.graph : placed(*one.graph, one.placeholder, one.base));
      if (one.graph->size() >= many_triples) applied_[one.name] = one;
    }
    if (!current_->share.set(dataset.bytes())) return too_many_bytes();
    if (too_many()) {
      return unexpected(Errc::limit_exceeded, "this robot has " + std::to_string(dataset.triple_count()) + " triples" +
                                                  (changes_.empty() ? "" : " and more") + "; the maximum for queries is " +
                                                  std::to_string(max_triples));
    }
    current_->readers.fetch_add(1, std::memory_order_relaxed);
    return Reader(current_);
  }

 private:
  struct Differing {
    engine::NamedGraph before;
    rdf::Difference difference;
  };
  /// If a large graph shares its structure with the version that the dataset has, the cost is that of the difference.
  std::optional<Differing> difference_of(const engine::NamedGraph& one) const {
    const auto known = applied_.find(one.name);
    if (known == applied_.end() || known->second.placeholder != one.placeholder || known->second.base != one.base) return std::nullopt;
    auto difference = rdf::shared_difference(*known->second.graph, *one.graph);
    if (!difference || difference->removed.size() + difference->added.size() > one.graph->size() / 4) return std::nullopt;
    return Differing{known->second, *std::move(difference)};
  }
  void change(Dataset& dataset, const engine::NamedGraph& one, const Differing& differing) {
    Placed place(one);
    const rdf::Graph& before = *differing.before.graph;
    const std::vector<Dataset::Change> removed = place.triples(differing.difference.removed, before, one.graph.get());
    const std::vector<Dataset::Change> added = place.triples(differing.difference.added, *one.graph, nullptr);
    applied_.erase(one.name);  // if there is no memory for the rest, the next call compares all triples
    dataset.change(one.name, removed, added);
    applied_[one.name] = one;
  }
  Unexpected too_many_bytes() const {
    return unexpected(Errc::limit_exceeded, "the graphs of this robot and all queries together reached their limit of " +
                                                std::to_string(memory_->max()) + " bytes (max_total_bytes); try again later");
  }
  std::size_t size_of(std::string_view name) const noexcept {
    const Dataset& dataset = current_->dataset;
    const GraphNumber graph = dataset.graph_named(dataset.find(rdf::iri(name)));
    return graph == nothing ? 0 : dataset.size_of(graph);
  }
  /// Takes over what waits: the last change of each graph, in the order in which they came, but those first that make a graph no larger. So the
  /// number of triples is not too large in between if it is not at the end.
  void take_changes() {
    std::vector<engine::NamedGraph> all;
    {
      const std::lock_guard lock(waiting_mutex_);
      if (waiting_.empty()) return;
      all = std::exchange(waiting_, {});
    }
    all.insert(all.begin(), std::make_move_iterator(changes_.rbegin()), std::make_move_iterator(changes_.rend()));
    changes_.clear();
    std::unordered_set<std::string> names;
    std::vector<engine::NamedGraph> grown;  // the last one first
    for (auto one = all.rbegin(); one != all.rend(); ++one) {
      if (!names.insert(one->name).second) continue;
      (one->graph && one->graph->size() > size_of(one->name) ? grown : changes_).push_back(std::move(*one));
    }
    changes_.insert(changes_.begin(), std::make_move_iterator(grown.begin()), std::make_move_iterator(grown.end()));
  }

  std::mutex waiting_mutex_;  ///< guards waiting_: held for moments only
  std::vector<engine::NamedGraph> waiting_;
  std::mutex mutex_;  ///< guards current_ and changes_ while the graphs are updated
  const std::shared_ptr<Memory> memory_;
  std::shared_ptr<Version> current_ = std::make_shared<Version>(memory_);
  std::vector<engine::NamedGraph> changes_;  ///< to be applied to current_, the next one last
  /// Graphs that current_ has exactly so. Only large ones: another version of them may share their structure.
  std::unordered_map<std::string, engine::NamedGraph> applied_;
};

/// The size of the result of a standing query is limited to this for each row that it may have.
constexpr std::size_t bytes_of_row = 4 * 1024;

class Endpoint final : public engine::QueryService {
 public:
  explicit Endpoint(EndpointOptions options) : options_(std::move(options)) {}

  const Limits& limits() const noexcept override { return options_; }

  Result<std::shared_ptr<const engine::PreparedQuery>> parse(std::string_view text, std::string_view base, std::vector<std::string> default_graphs,
                                                             std::vector<std::string> named_graphs) const override {
    ParseOptions parsing;
    parsing.base = base;
    parsing.max_bytes = options_.max_text_bytes;
    parsing.max_depth = options_.max_depth;
    Result<std::shared_ptr<const Query>> parsed = query::parse(text, parsing);
    if (!parsed) return Unexpected{std::move(parsed).error()};
    return std::shared_ptr<const engine::PreparedQuery>(
        std::make_shared<Prepared>(*std::move(parsed), Selection{std::move(default_graphs), std::move(named_graphs)}));
  }

  std::shared_ptr<engine::QueryData> make_data() const override { return std::make_shared<Data>(memory_); }

  Result<std::shared_ptr<const engine::QueryAnswer>> evaluate(const engine::PreparedQuery& prepared, engine::QueryData& data,
                                                              const std::atomic<bool>& cancelled, TimePoint now,
                                                              std::optional<std::size_t> max_rows) const override {
    Bounds bounds;
    bounds.begin = std::chrono::steady_clock::now();
    bounds.time = options_.time;
    bounds.steps = options_.max_steps;
    bounds.rows = max_rows ? std::min(*max_rows, options_.max_rows) : options_.max_rows;
    bounds.bytes = bounds.answer_bytes = options_.max_solution_bytes;
    // The engine writes and compares the results of standing queries on its own thread.
    if (max_rows && bounds.rows < bounds.answer_bytes / bytes_of_row) bounds.answer_bytes = bounds.rows * bytes_of_row;
    MemoryShare share(memory_);
    bounds.share = &share;
    const Result<Data::Reader> reader = read(static_cast<Data&>(data), bounds, cancelled);
    if (!reader) return Unexpected{reader.error()};
    const auto& asked = static_cast<const Prepared&>(prepared);
    Result<Answer> answer = query::evaluate(*asked.query, **reader, bounds, cancelled, now.utc, &asked.selection);
    if (!answer) return Unexpected{std::move(answer).error()};
    return std::shared_ptr<const engine::QueryAnswer>(
        std::make_shared<Answered>(asked.query, *std::move(answer), max_rows.has_value(), std::move(share)));
  }

 private:
  Result<Data::Reader> read(Data& data, const Bounds& bounds, const std::atomic<bool>& cancelled) const {
    try {
      const Turns::Held held;  // the lock of the graphs
      Budget budget(bounds, cancelled);
      return data.read(budget, options_.max_triples);
    } catch (Ended& ended) { return unexpected(std::move(ended.error)); }
  }

  static constexpr std::size_t least_total_bytes = 1024 * 1024;
  const EndpointOptions options_;
  const std::shared_ptr<Memory> memory_ = std::make_shared<Memory>(std::max(options_.max_total_bytes, least_total_bytes));
};

}  // namespace

std::shared_ptr<const engine::QueryService> endpoint(EndpointOptions options) { return std::make_shared<Endpoint>(std::move(options)); }

}  // namespace v0
}  // namespace lrt::query

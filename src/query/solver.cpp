// SPDX-License-Identifier: Apache-2.0
#include "src/query/solver.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace lrt::query {

/// DISTINCT, ORDER BY, OFFSET and LIMIT.
class Solver::Output {
 public:
  Output(Run& run, const Query& query, std::size_t width, Visit visit)
      : run_(run), query_(query), width_(width), keys_(query.order_by.size()), visit_(visit), seen_(run.budget, width), skip_(query.offset) {
    if (query.limit) left_ = *query.limit;
  }
  ~Output() { run_.budget.give(taken_); }
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  bool wants_more() const noexcept { return !stopped_ && left_ > 0; }
  /// @param row  the solution, then the keys of its order
  void add(const TermNumber* row) {
    const std::size_t all = width_ + keys_;
    if (is_unique()) {
      const auto [known, is_new] = seen_.insert(row);
      if (!is_new && keys_ == 0) return;
      if (!is_new) {
        // Of equal rows the first in order stays (18.2.5). Its place is its number in the set.
        TermNumber* const keys = rows_.data() + std::size_t{known} * all + width_;
        if (compare(row + width_, keys) >= 0) return;
        std::copy(row + width_, row + all, keys);
        arrival_[known] = next_arrival_++;
        return;
      }
    }
    if (keys_ == 0) return pass(row);
    auto place = static_cast<std::uint32_t>(order_.size());
    if (is_heap() && order_.size() == most()) {
      // The heap has the last row of those that are kept at its front; equal rows keep the order of their arrival.
      const TermNumber* const last = rows_.data() + std::size_t{order_.front()} * all;
      if (compare(row + width_, last + width_) >= 0) return;
      std::pop_heap(order_.begin(), order_.end(), before());
      place = order_.back();
      std::copy(row, row + all, rows_.begin() + static_cast<std::ptrdiff_t>(place * all));
      arrival_[place] = next_arrival_++;
    } else {
      const std::size_t bytes = all * sizeof(TermNumber) + 3 * sizeof(std::uint64_t);
      run_.budget.take(bytes);
      taken_ += bytes;
      rows_.insert(rows_.end(), row, row + all);
      arrival_.push_back(next_arrival_++);
      order_.push_back(place);
    }
    if (is_heap()) std::push_heap(order_.begin(), order_.end(), before());
  }
  void finish() {
    if (keys_ == 0) return;
    // std::sort requires a strict weak order. Numbers of different types do not always have one.
    if (query_.limit && most() < order_.size()) {
      std::partial_sort(order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(most()), order_.end(), before());
      order_.resize(static_cast<std::size_t>(most()));
    } else {
      std::stable_sort(order_.begin(), order_.end(), before());
    }
    for (const std::uint32_t place : order_) {
      if (stopped_ || left_ == 0) return;
      pass(rows_.data() + std::size_t{place} * (width_ + keys_));
    }
  }

 private:
  bool is_unique() const noexcept { return query_.distinct || query_.reduced; }
  /// Rows beyond the limit are dropped at once. A dropped row could come again with lesser keys, so rows that are unique are kept until the end.
  bool is_heap() const noexcept { return query_.limit && !is_unique(); }
  std::uint64_t most() const noexcept {
    const std::uint64_t limit = *query_.limit;
    return limit + std::min(query_.offset, UINT64_MAX - limit);
  }
  void pass(const TermNumber* row) {
    if (skip_ > 0) {
      --skip_;
      return;
    }
    if (left_ == 0) return;
    --left_;
    if (!visit_(row)) stopped_ = true;
  }
  int compare(const TermNumber* a, const TermNumber* b) const {
    for (std::size_t i = 0; i < keys_; ++i) {
      run_.budget.step();
      const int order = run_.operators.order(a[i], b[i]);
      if (order != 0) return query_.order_by[i].descending ? -order : order;
    }
    return 0;
  }
  struct Before {
    const Output& output;
    bool operator()(std::uint32_t a, std::uint32_t b) const {
      const std::size_t all = output.width_ + output.keys_;
      const TermNumber* const keys = output.rows_.data() + output.width_;
      const int order = output.compare(keys + a * all, keys + b * all);
      return order != 0 ? order < 0 : output.arrival_[a] < output.arrival_[b];
    }
  };
  Before before() const noexcept { return {*this}; }

  Run& run_;
  const Query& query_;
  std::size_t width_, keys_;
  Visit visit_;
  RowSet seen_;
  std::uint64_t skip_, left_ = UINT64_MAX;
  bool stopped_ = false;
  std::vector<TermNumber> rows_;
  std::vector<std::uint64_t> arrival_;
  std::vector<std::uint32_t> order_;  // a heap, until the end, if is_heap()
  std::uint64_t next_arrival_ = 0;
  std::size_t taken_ = 0;
};

Solver::Solver(Run& run, Planner& planner, const Query& query, std::vector<Slot> output, const ActiveGraph& graph, Frame& frame)
    : run_(run), query_(query), frame_(frame), output_(std::move(output)) {
  PlanState state;
  state.graph = graph;
  if (query.values) {  // before the pattern, which they restrict
    VariableSet always;
    std::vector<Slot> columns;
    for (const Variable variable : query.values->variables) columns.push_back(static_cast<Slot>(variable));
    auto rows = planner.rows_of(*query.values, always);
    planner.add_rows(std::move(rows), columns, always, frame, state, where_);
  }
  planner.plan(*query.where, nullptr, frame, state, where_);

  if (query.grouped) {
    PlanState of_group;  // what is bound when a group has ended
    of_group.graph = graph;
    for (const Query::Group& group : query.group_by) {
      keys_.push_back({group.variable ? static_cast<Slot>(*group.variable) : nothing, planner.compile(group.expression, frame, state)});
      // The variable of a key may be used by the aggregates.
      if (group.variable) state.possible.insert(keys_.back().slot), of_group.possible.insert(keys_.back().slot);
    }
    std::vector<Planner::Aggregate> aggregates;
    for (const Query::Column& column : query.columns) {
      if (!column.expression) continue;
      columns_.push_back({static_cast<Slot>(column.variable), planner.compile(*column.expression, frame, of_group, &aggregates)});
      of_group.possible.insert(static_cast<Slot>(column.variable));
    }
    for (const Expression& condition : query.having) having_.push_back(planner.compile(condition, frame, of_group, &aggregates));
    for (const Query::Order& order : query.order_by) order_.push_back(planner.compile(order.expression, frame, of_group, &aggregates));
    for (const Planner::Aggregate& a : aggregates) {
      Aggregate aggregate{a.expression, a.slot, {}};
      for (const Expression& argument : a.expression->arguments) aggregate.argument.push_back(planner.compile(argument, frame, state));
      aggregates_.push_back(std::move(aggregate));
    }
    for (Slot i = 0; i < run.query.variables.size(); ++i) {
      if (!run.query.variables[i].empty()) named_.push_back(i);
    }
  } else {
    for (const Query::Column& column : query.columns) {
      if (!column.expression) continue;
      columns_.push_back({static_cast<Slot>(column.variable), planner.compile(*column.expression, frame, state)});
      state.possible.insert(static_cast<Slot>(column.variable));
    }
    for (const Query::Order& order : query.order_by) order_.push_back(planner.compile(order.expression, frame, state));
  }
}

bool Solver::give(Output& output) {
  for (const Column& column : columns_) frame_[column.slot] = run_.term_of(column.expression, frame_);
  bool wanted = true;
  for (std::size_t i = 0; wanted && i < having_.size(); ++i) wanted = run_.passes(having_[i], frame_);
  if (wanted) {
    std::vector<TermNumber> row;
    row.reserve(output_.size() + order_.size());
    for (const Slot slot : output_) row.push_back(frame_[slot]);
    for (const Expr& key : order_) row.push_back(run_.term_of(key, frame_));
    run_.end_solution();
    output.add(row.data());
  }
  for (const Column& column : columns_) frame_[column.slot] = nothing;
  return output.wants_more();
}

void Solver::solve(Visit visit) {
  Output output(run_, query_, output_.size(), visit);
  if (!output.wants_more()) return;
  if (query_.grouped) {
    solve_groups(output);
  } else {
    where_.open();
    while (where_.next() && give(output)) {}
    where_.close();
  }
  output.finish();
}

void Solver::collect(const Aggregate& aggregate, Collected& collected) {
  const Operator op = aggregate.expression->op;
  run_.budget.step();
  const auto is_new = [&](const TermNumber* row, std::size_t width) {
    if (!aggregate.expression->distinct) return true;
    if (!collected.seen) collected.seen = std::make_unique<RowSet>(run_.budget, width);
    return collected.seen->insert(row).second;
  };
  if (aggregate.argument.empty()) {  // COUNT(*)
    if (aggregate.expression->distinct) {
      std::vector<TermNumber> row;
      for (const Slot slot : named_) row.push_back(frame_[slot]);
      if (!is_new(row.data(), row.size())) return;
    }
    ++collected.count;
    return;
  }
  const Value value = run_.evaluate(aggregate.argument[0], frame_);
  if (value.failed) {
    // SUM, AVG and GROUP_CONCAT of an error are errors; the others count, compare or choose what is no error.
    collected.failed = true;
    return;
  }
  if (aggregate.expression->distinct) {
    const TermNumber term = run_.operators.number_of(value);
    if (!is_new(&term, 1)) return;
  }
  ++collected.count;
  switch (op) {
    case Operator::sum:
    case Operator::avg:
      collected.sum =
          collected.count == 1 ? (value.is_number() ? value : Value()) : run_.operators.compute(Operators::Arithmetic::add, collected.sum, value);
      if (collected.sum.failed) collected.failed = true;
      break;
    case Operator::min:
    case Operator::max: {
      const TermNumber term = run_.operators.number_of(value);
      if (collected.best == nothing) {
        collected.best = term;
        break;
      }
      const int order = run_.operators.order(term, collected.best);
      if (op == Operator::min ? order < 0 : order > 0) collected.best = term;
      break;
    }
    case Operator::sample:
      if (collected.best == nothing) collected.best = run_.operators.number_of(value);
      break;
    case Operator::group_concat: {
      const auto text = run_.operators.text_of(value);
      if (!text) {
        collected.failed = true;
        break;
      }
      if (collected.count > 1) collected.text += aggregate.expression->separator;
      run_.budget.work(text->size());
      run_.budget.take(text->size() + aggregate.expression->separator.size());
      collected.text += *text;
      break;
    }
    default: break;
  }
}

TermNumber Solver::result(const Aggregate& aggregate, const Collected& collected) {
  const auto term = [&](const Value& value) { return value.failed ? nothing : run_.operators.number_of(value); };
  switch (aggregate.expression->op) {
    case Operator::count: return term(Value(static_cast<std::int64_t>(collected.count)));
    case Operator::sum:
    case Operator::avg:
      if (collected.failed) return nothing;
      if (collected.count == 0) return term(Value(std::int64_t{0}));
      if (aggregate.expression->op == Operator::sum) {
        Value sum = collected.sum;
        if (sum.type == Type::integer) sum.term = nothing;  // of a derived type
        return term(sum);
      }
      return term(run_.operators.compute(Operators::Arithmetic::divide, collected.sum, Value(static_cast<std::int64_t>(collected.count))));
    case Operator::group_concat: return collected.failed ? nothing : term(Value(collected.text));
    default: return collected.best;
  }
}

void Solver::solve_groups(Output& output) {
  RowSet keys(run_.budget, keys_.size());
  std::vector<std::vector<Collected>> groups;
  std::size_t taken = 0;
  const auto add_group = [&] {
    const std::size_t bytes = sizeof(std::vector<Collected>) + aggregates_.size() * sizeof(Collected);
    run_.budget.take(bytes);
    taken += bytes;
    groups.emplace_back(aggregates_.size());
  };
  if (keys_.empty()) {
    keys.insert(nullptr);
    add_group();
  }
  std::vector<TermNumber> key(keys_.size());
  where_.open();
  while (where_.next()) {
    for (std::size_t i = 0; i < key.size(); ++i) key[i] = run_.term_of(keys_[i].expression, frame_);
    std::vector<std::pair<Slot, TermNumber>> before;  // (expression AS ?variable), which aggregates may use
    for (std::size_t i = 0; i < key.size(); ++i) {
      if (keys_[i].slot == nothing) continue;
      before.emplace_back(keys_[i].slot, frame_[keys_[i].slot]);
      frame_[keys_[i].slot] = key[i];
    }
    const auto [group, is_new] = keys.insert(key.data());
    if (is_new && !keys_.empty()) add_group();
    for (std::size_t i = 0; i < aggregates_.size(); ++i) collect(aggregates_[i], groups[group][i]);
    for (const auto& [slot, term] : before) frame_[slot] = term;
    run_.end_solution();
  }
  where_.close();
  bool more = true;
  for (std::size_t group = 0; more && group < groups.size(); ++group) {
    run_.budget.step();
    for (std::size_t i = 0; i < keys_.size(); ++i) {
      if (keys_[i].slot != nothing) frame_[keys_[i].slot] = keys.row(group)[i];
    }
    for (std::size_t i = 0; i < aggregates_.size(); ++i) frame_[aggregates_[i].slot] = result(aggregates_[i], groups[group][i]);
    more = give(output);
    for (const Column& k : keys_) {
      if (k.slot != nothing) frame_[k.slot] = nothing;
    }
    for (const Aggregate& aggregate : aggregates_) frame_[aggregate.slot] = nothing;
  }
  run_.budget.give(taken);
}

}  // namespace lrt::query

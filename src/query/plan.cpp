// SPDX-License-Identifier: Apache-2.0
#include "src/query/plan.hpp"

#include <algorithm>
#include <limits>

#include "src/query/solver.hpp"

namespace lrt::query {
namespace {

constexpr double many = 1e12;

/// Whether EXISTS is in the expression.
bool has_pattern(const Expression& expression) noexcept {
  return expression.pattern || std::any_of(expression.arguments.begin(), expression.arguments.end(), has_pattern);
}

/// A query in a query, which has its own variables.
class QueryRows final : public EvaluatedRows {
 public:
  using EvaluatedRows::EvaluatedRows;
  std::unique_ptr<Solver> solver;

 private:
  void evaluate(Rows& rows) override {
    solver->solve([&](const TermNumber* row) {
      rows.add(row);
      return true;
    });
  }
};

}  // namespace

/// A part of a group, in order.
struct Planner::Step {
  enum class Kind : std::uint8_t { triple, values, part, apart, optional, minus, extend, filter };
  Kind kind;
  const TriplePattern* triple = nullptr;
  const Pattern* pattern = nullptr;       // part, apart, values; of the others the whole of which it is a part
  const Expression* condition = nullptr;  // filter
  VariableSet variables;                  // that it may bind
};

Planner::Planner(Run& run) : run_(run), slots_(static_cast<Slot>(run.query.variables.size())) {}

void Planner::finish() {
  for (Frame* frame : frames_) {
    run_.budget.take(slots_ * sizeof(TermNumber));
    frame->slots.assign(slots_, nothing);
  }
}

End Planner::end_of(const Node& node) const noexcept {
  return node.is_variable() ? End{node.index, nothing} : End{nothing, run_.constants[node.index]};
}

void Planner::collect(const Expression& expression, VariableSet& variables) {
  run_.budget.step();
  if (expression.op == Operator::variable) variables.insert(expression.index);
  for (const Expression& argument : expression.arguments) collect(argument, variables);
  if (expression.pattern) variables.insert(facts(*expression.pattern).mentioned);
}

VariableSet Planner::variables_of(const Expression& expression) {
  VariableSet variables;
  collect(expression, variables);
  return variables;
}

VariableSet Planner::variables_of(const TriplePattern& triple) const {
  VariableSet variables;
  if (triple.subject.is_variable()) variables.insert(triple.subject.index);
  if (!triple.path && triple.predicate.is_variable()) variables.insert(triple.predicate.index);
  if (triple.object.is_variable()) variables.insert(triple.object.index);
  return variables;
}

const Planner::Facts& Planner::facts(const Pattern& pattern) {
  if (const auto known = facts_.find(&pattern); known != facts_.end()) return known->second;
  run_.budget.step();
  run_.budget.take(256);
  Facts f;
  std::vector<const Facts*> parts;
  for (const auto& part : pattern.parts) parts.push_back(&facts(*part));
  for (const Facts* part : parts) f.mentioned.insert(part->mentioned);
  if (pattern.condition) collect(*pattern.condition, f.mentioned);
  switch (pattern.kind) {
    case Pattern::Kind::triples:
      for (const TriplePattern& triple : pattern.triples) f.certain.insert(variables_of(triple));
      f.possible = f.certain;
      break;
    case Pattern::Kind::join:
      for (const Facts* part : parts) f.certain.insert(part->certain), f.possible.insert(part->possible);
      break;
    case Pattern::Kind::left_join:
      f.certain = parts[0]->certain;
      f.possible = parts[0]->possible;
      f.possible.insert(parts[1]->possible);
      break;
    case Pattern::Kind::union_:
      f.certain = parts[0]->certain;
      for (const Facts* part : parts) f.certain.keep(part->certain), f.possible.insert(part->possible);
      break;
    case Pattern::Kind::minus:
    case Pattern::Kind::filter:
      f.certain = parts[0]->certain;
      f.possible = parts[0]->possible;
      break;
    case Pattern::Kind::graph:
      f.certain = parts[0]->certain;
      f.possible = parts[0]->possible;
      if (pattern.node.is_variable()) f.certain.insert(pattern.node.index), f.possible.insert(pattern.node.index);
      break;
    case Pattern::Kind::extend:
      f.certain = parts[0]->certain;
      f.possible = parts[0]->possible;
      f.possible.insert(number(pattern.variable));
      break;
    case Pattern::Kind::values:
      for (std::size_t i = 0; i < pattern.values.variables.size(); ++i) {
        f.possible.insert(number(pattern.values.variables[i]));
        if (std::all_of(pattern.values.rows.begin(), pattern.values.rows.end(), [&](const auto& row) { return row[i].has_value(); }))
          f.certain.insert(number(pattern.values.variables[i]));
      }
      break;
    case Pattern::Kind::select: {
      const Query& query = *pattern.query;
      const Facts& where = facts(*query.where);
      VariableSet keys;
      for (const Query::Group& key : query.group_by) {
        if (key.variable && key.expression.op == Operator::variable && where.certain.has(key.expression.index)) keys.insert(number(*key.variable));
      }
      for (const Query::Column& column : query.columns) {
        f.possible.insert(number(column.variable));
        if (!column.expression && (query.grouped ? keys : where.certain).has(number(column.variable))) f.certain.insert(number(column.variable));
      }
      break;
    }
  }
  f.mentioned.insert(f.possible);
  return facts_.emplace(&pattern, std::move(f)).first->second;
}

/// Whether the pattern has the same solutions if these variables, of its siblings, are bound while it is evaluated.
bool Planner::can_be_seeded(const Pattern& pattern, const VariableSet& bound) {
  run_.budget.step();
  switch (pattern.kind) {
    case Pattern::Kind::triples:
    case Pattern::Kind::values:
    case Pattern::Kind::join:  // of each part when it is planned
    case Pattern::Kind::union_:
    case Pattern::Kind::graph:
    case Pattern::Kind::select: return true;
    case Pattern::Kind::filter:
    case Pattern::Kind::extend:
      return variables_of(*pattern.condition).meets_only_in(bound, facts(*pattern.parts[0]).certain) && can_be_seeded(*pattern.parts[0], bound);
    case Pattern::Kind::left_join: {
      const VariableSet& certain = facts(*pattern.parts[0]).certain;
      return facts(*pattern.parts[1]).mentioned.meets_only_in(bound, certain) &&
             (!pattern.condition || variables_of(*pattern.condition).meets_only_in(bound, certain)) && can_be_seeded(*pattern.parts[0], bound);
    }
    case Pattern::Kind::minus: {
      VariableSet shared = facts(*pattern.parts[0]).possible;
      shared.keep(facts(*pattern.parts[1]).possible);
      return shared.meets_only_in(bound, facts(*pattern.parts[0]).certain) && can_be_seeded(*pattern.parts[0], bound);
    }
  }
  return false;
}

/// The parts of a conjunction are filters of their own: it is true if all of them are.
void Planner::split(const Expression& condition, std::vector<Filter>& filters) {
  if (condition.op == Operator::and_) {
    for (const Expression& part : condition.arguments) split(part, filters);
  } else {
    filters.push_back({&condition, variables_of(condition)});
  }
}

/// @param bound  what the steps before may bind
void Planner::flatten(const Pattern& pattern, VariableSet& bound, std::vector<Step>& steps, std::vector<Filter>& filters) {
  run_.budget.step();
  const auto add = [&](Step::Kind kind, VariableSet variables) -> Step& {
    steps.push_back({kind, nullptr, &pattern, nullptr, std::move(variables)});
    bound.insert(steps.back().variables);
    return steps.back();
  };
  switch (pattern.kind) {
    case Pattern::Kind::triples:
      for (const TriplePattern& triple : pattern.triples) add(Step::Kind::triple, variables_of(triple)).triple = &triple;
      return;
    case Pattern::Kind::values: add(Step::Kind::values, facts(pattern).possible); return;
    case Pattern::Kind::join:
      for (const auto& part : pattern.parts) {
        const bool is_simple = part->kind == Pattern::Kind::triples || part->kind == Pattern::Kind::values || part->kind == Pattern::Kind::join;
        const Facts& of_part = facts(*part);
        if (is_simple || (can_be_seeded(*part, bound) && (steps.empty() || of_part.possible.meets(bound)))) {
          flatten(*part, bound, steps, filters);
        } else {
          steps.push_back({Step::Kind::apart, nullptr, part.get(), nullptr, of_part.possible});
          bound.insert(of_part.possible);
        }
      }
      return;
    case Pattern::Kind::filter: {
      flatten(*pattern.parts[0], bound, steps, filters);
      std::vector<Filter> conditions;
      split(*pattern.condition, conditions);
      // A filter of variables that its pattern always binds may become a filter of the whole group. Other filters must not see later bindings.
      for (Filter& filter : conditions) {
        if (filter.variables.meets_only_in(filter.variables, facts(*pattern.parts[0]).certain)) filters.push_back(std::move(filter));
        else add(Step::Kind::filter, {}).condition = filter.expression;
      }
      return;
    }
    case Pattern::Kind::left_join:
      flatten(*pattern.parts[0], bound, steps, filters);
      add(Step::Kind::optional, facts(*pattern.parts[1]).possible);
      return;
    case Pattern::Kind::minus:
      flatten(*pattern.parts[0], bound, steps, filters);
      add(Step::Kind::minus, {});
      return;
    case Pattern::Kind::extend: {
      flatten(*pattern.parts[0], bound, steps, filters);
      VariableSet variable;
      variable.insert(number(pattern.variable));
      add(Step::Kind::extend, std::move(variable));
      return;
    }
    case Pattern::Kind::union_:
    case Pattern::Kind::graph: add(Step::Kind::part, facts(pattern).possible); return;
    case Pattern::Kind::select: add(Step::Kind::apart, facts(pattern).possible); return;
  }
}

/// Estimates the number of solutions of a triple pattern for each solution before it.
double Planner::estimate(const TriplePattern& triple, const PlanState& state) const {
  run_.budget.step();
  const auto is_bound = [&](const Node& node) { return node.is_variable() && (state.certain.has(node.index) || state.seeded.has(node.index)); };
  const auto known = [&](const Node& node) { return node.is_variable() ? nothing : run_.constants[node.index]; };
  const Dataset& data = run_.data;
  if (triple.path) {
    const int ends =
        (!triple.subject.is_variable() || is_bound(triple.subject) ? 1 : 0) + (!triple.object.is_variable() || is_bound(triple.object) ? 1 : 0);
    const auto triples = static_cast<double>(data.triple_count());
    return ends == 2 ? 1 : ends == 1 ? 20 : triples * 20;
  }
  const TermNumber predicate = known(triple.predicate);
  double count = static_cast<double>(data.count(known(triple.subject), predicate, known(triple.object)));
  if (count == 0) return 0;
  const Dataset::Spread spread = predicate != nothing ? data.spread(predicate) : data.spread();
  const auto divide = [&](std::size_t n) { count /= static_cast<double>(std::max<std::size_t>(n, 1)); };
  if (is_bound(triple.subject)) divide(spread.subjects);
  if (is_bound(triple.object)) divide(spread.objects);
  if (is_bound(triple.predicate)) divide(data.predicate_count());
  return count;
}

std::vector<Slot> Planner::inherited(const VariableSet& mentioned, const PlanState& state) const {
  std::vector<Slot> slots;
  if (state.graph.kind == ActiveGraph::Kind::variable) slots.push_back(state.graph.slot);
  state.seeded.each([&](std::uint32_t variable) {
    if (mentioned.has(variable)) slots.push_back(variable);
  });
  return slots;
}

void Planner::add_filter(const Expression& condition, Frame& frame, const PlanState& state, Pipeline& out) {
  out.add(std::make_unique<FilterStage>(run_, frame, compile(condition, frame, state)));
}

void Planner::add_triple(const TriplePattern& triple, Frame& frame, PlanState& state, Pipeline& out) {
  const End subject = end_of(triple.subject), object = end_of(triple.object);
  if (triple.path) add_path(*triple.path, subject, object, frame, state, out);
  else out.add(std::make_unique<TripleStage>(run_, frame, state.graph, subject, end_of(triple.predicate), object));
  const VariableSet variables = variables_of(triple);
  state.certain.insert(variables);
  state.possible.insert(variables);
}

void Planner::add_path(const Path& path, End subject, End object, Frame& frame, PlanState& state, Pipeline& out) {
  run_.budget.step();
  switch (path.kind) {
    case Path::Kind::link:
      out.add(std::make_unique<TripleStage>(run_, frame, state.graph, subject, End{nothing, run_.constants[number(path.predicate)]}, object));
      return;
    case Path::Kind::inverse: return add_path(path.parts[0], object, subject, frame, state, out);
    case Path::Kind::sequence: {
      // The path is followed from an end that is bound.
      const auto is_bound = [&](const End& end) { return end.slot == nothing || state.certain.has(end.slot) || state.seeded.has(end.slot); };
      std::vector<End> ends{subject};
      for (std::size_t i = 1; i < path.parts.size(); ++i) ends.push_back({new_slot(), nothing});
      ends.push_back(object);
      const bool backward = is_bound(object) && !is_bound(subject);
      for (std::size_t n = 0; n < path.parts.size(); ++n) {
        const std::size_t i = backward ? path.parts.size() - 1 - n : n;
        add_path(path.parts[i], ends[i], ends[i + 1], frame, state, out);
      }
      return;
    }
    case Path::Kind::alternative: {
      auto stage = std::make_unique<UnionStage>(run_);
      for (const Path& part : path.parts) {
        Pipeline pipeline;
        add_path(part, subject, object, frame, state, pipeline);
        stage->add(std::move(pipeline));
      }
      out.add(std::move(stage));
      return;
    }
    default: {
      for (End* end : {&subject, &object}) end->is_replaced = end->slot != nothing && state.seeded.has(end->slot);
      out.add(std::make_unique<PathStage>(run_, frame, state.graph, path, subject, object));
    }
  }
}

std::unique_ptr<RowSource> Planner::rows_of(const Values& values, VariableSet& always) {
  std::vector<Slot> columns;
  for (const Variable variable : values.variables) {
    columns.push_back(number(variable));
    always.insert(number(variable));
  }
  auto source = std::make_unique<ConstantRows>(run_.budget, columns);
  std::vector<TermNumber> row(columns.size());
  VariableSet undefined, defined;
  for (const auto& cells : values.rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      row[i] = cells[i] ? run_.constants[number(*cells[i])] : nothing;
      if (!cells[i]) undefined.insert(columns[i]);
    }
    source->add(row.data());
  }
  always.each([&](std::uint32_t variable) {
    if (!undefined.has(variable)) defined.insert(variable);
  });
  always = defined;
  return source;
}

void Planner::add_rows(std::unique_ptr<RowSource> source, const std::vector<Slot>& columns, const VariableSet& always, Frame& frame, PlanState& state,
                       Pipeline& out) {
  std::vector<std::size_t> keys;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (always.has(columns[i]) && state.certain.has(columns[i])) keys.push_back(i);
  }
  out.add(std::make_unique<RowsStage>(run_, frame, std::move(source), std::move(keys)));
  state.certain.insert(always);
  for (const Slot column : columns) state.possible.insert(column);
}

/// A pattern that is evaluated apart, and joined.
void Planner::add_apart(const Pattern& pattern, Frame& frame, PlanState& state, Pipeline& out) {
  const Facts& f = facts(pattern);
  std::vector<Slot> columns;
  if (pattern.kind == Pattern::Kind::select) {
    for (const Query::Column& column : pattern.query->columns) columns.push_back(number(column.variable));
    std::vector<Slot> slots;  // a query does not see what EXISTS has around it
    if (state.graph.kind == ActiveGraph::Kind::variable) slots.push_back(state.graph.slot);
    auto rows = std::make_unique<QueryRows>(run_, frame, columns, std::move(slots));
    add_frame(rows->frame);
    rows->solver = std::make_unique<Solver>(run_, *this, *pattern.query, columns, state.graph, rows->frame);
    add_rows(std::move(rows), columns, f.certain, frame, state, out);
    return;
  }
  f.possible.each([&](std::uint32_t variable) { columns.push_back(variable); });
  auto rows = std::make_unique<PatternRows>(run_, frame, columns, inherited(f.mentioned, state));
  add_frame(rows->frame);
  PlanState inner;
  inner.graph = state.graph;
  inner.seeded = state.seeded;
  state.seeded.each([&](std::uint32_t variable) {
    if (state.certain.has(variable) && f.mentioned.has(variable)) inner.certain.insert(variable);
  });
  plan(pattern, nullptr, rows->frame, inner, rows->pipeline);
  add_rows(std::move(rows), columns, f.certain, frame, state, out);
}

/// Whether the first stage of a pattern is a triple, whatever the order: then it finds the graphs.
bool Planner::begins_with_triple(const Pattern& pattern) const noexcept {
  const Pattern* p = &pattern;
  for (;
       p->kind == Pattern::Kind::filter || p->kind == Pattern::Kind::left_join || p->kind == Pattern::Kind::minus || p->kind == Pattern::Kind::extend;
       p = p->parts[0].get()) {
    if (p->kind == Pattern::Kind::filter && has_pattern(*p->condition)) return false;  // it may stand before the triples
  }
  return p->kind == Pattern::Kind::triples && !p->triples.empty() &&
         std::all_of(p->triples.begin(), p->triples.end(), [](const TriplePattern& t) { return !t.path; });
}

void Planner::add_graph(const Pattern& pattern, Frame& frame, PlanState& state, Pipeline& out) {
  const ActiveGraph around = state.graph;
  if (!pattern.node.is_variable()) {
    const GraphNumber graph = run_.data.graph_named(run_.constants[pattern.node.index]);
    if (!run_.view.has(graph)) {
      out.add(std::make_unique<NoStage>());
      state.certain.insert(facts(pattern).certain);
      state.possible.insert(facts(pattern).possible);
      return;
    }
    state.graph = {ActiveGraph::Kind::one, graph, nothing};
    plan(*pattern.parts[0], nullptr, frame, state, out);
    state.graph = around;
    return;
  }
  // The pattern does not see the variable, but is matched in the graph that the variable has if it is bound already.
  const Slot hidden = new_slot(), variable = pattern.node.index;
  const bool may_be_bound = state.possible.has(variable) || state.seeded.has(variable);
  if (may_be_bound) out.add(std::make_unique<CopyStage>(frame, variable, hidden));
  // Unless a triple finds the graphs: each of them, or the check that the bound one is a graph. Rows of a pattern that is evaluated apart do not
  // have the hidden variable.
  if (may_be_bound || !begins_with_triple(*pattern.parts[0]) || !can_be_seeded(*pattern.parts[0], state.possible))
    out.add(std::make_unique<GraphStage>(run_, frame, hidden));
  state.graph = {ActiveGraph::Kind::variable, nothing, hidden};
  plan(*pattern.parts[0], nullptr, frame, state, out);
  state.graph = around;
  out.add(std::make_unique<CopyStage>(frame, hidden, variable));
  state.certain.insert(variable);
  state.possible.insert(variable);
}

void Planner::add_minus(const Pattern& pattern, Frame& frame, PlanState& state, Pipeline& out) {
  const Facts &left = facts(*pattern.parts[0]), &right = facts(*pattern.parts[1]);
  VariableSet shared = left.possible;
  shared.keep(right.possible);
  if (!shared.meets(shared)) return;  // no solution has a variable in common
  VariableSet both = left.certain;
  both.keep(right.certain);
  const bool all_certain = shared.meets_only_in(shared, both);
  if (all_certain && right.mentioned.meets_only_in(state.possible, both)) {
    Pipeline pipeline;
    PlanState inner = state;
    plan(*pattern.parts[1], nullptr, frame, inner, pipeline);
    out.add(std::make_unique<AbsentStage>(std::move(pipeline)));
    return;
  }
  std::vector<Slot> columns;
  std::vector<std::size_t> keys;
  shared.each([&](std::uint32_t variable) {
    if (both.has(variable) && state.certain.has(variable)) keys.push_back(columns.size());
    columns.push_back(variable);
  });
  auto rows = std::make_unique<PatternRows>(run_, frame, columns, inherited(right.mentioned, state));
  add_frame(rows->frame);
  PlanState inner;
  inner.graph = state.graph;
  inner.seeded = state.seeded;
  plan(*pattern.parts[1], nullptr, rows->frame, inner, rows->pipeline);
  out.add(std::make_unique<MinusStage>(run_, frame, std::move(rows), std::move(keys)));
}

void Planner::plan(const Pattern& pattern, const Expression* condition, Frame& frame, PlanState& state, Pipeline& out) {
  run_.budget.step();
  std::vector<Step> steps;
  std::vector<Filter> filters;
  if (condition) split(*condition, filters);
  VariableSet bound = state.possible;
  if (!can_be_seeded(pattern, bound)) {
    steps.push_back({Step::Kind::apart, nullptr, &pattern, nullptr, facts(pattern).possible});
  } else {
    const Pattern* inner = &pattern;
    for (; inner->kind == Pattern::Kind::filter; inner = inner->parts[0].get()) split(*inner->condition, filters);
    flatten(*inner, bound, steps, filters);
  }

  // A filter is placed as early as possible: when each of its variables is always bound or will not be bound by later steps.
  std::unordered_map<std::uint32_t, std::size_t> left;  // steps that may still bind a variable
  for (const Step& step : steps) step.variables.each([&](std::uint32_t variable) { ++left[variable]; });
  const auto add_filters = [&] {
    for (std::size_t i = 0; i < filters.size();) {
      run_.budget.step();
      bool settled = true;
      filters[i].variables.each([&](std::uint32_t variable) {
        if (state.certain.has(variable)) return;
        const auto found = left.find(variable);
        if (found != left.end() && found->second != 0) settled = false;
      });
      if (!settled) {
        ++i;
        continue;
      }
      add_filter(*filters[i].expression, frame, state, out);
      filters.erase(filters.begin() + static_cast<std::ptrdiff_t>(i));
    }
  };
  const auto done = [&](const Step& step) {
    step.variables.each([&](std::uint32_t variable) { --left[variable]; });
    if (!filters.empty()) add_filters();
  };
  if (!filters.empty()) add_filters();

  for (std::size_t i = 0; i < steps.size();) {
    const auto is_simple = [](const Step& step) { return step.kind == Step::Kind::triple || step.kind == Step::Kind::values; };
    if (is_simple(steps[i])) {
      // Triples and values may be in any order: the one with the fewest solutions first, of those that are connected with what is bound.
      std::size_t end = i;
      while (end < steps.size() && is_simple(steps[end])) ++end;
      std::vector<std::size_t> open;
      for (std::size_t k = i; k < end; ++k) open.push_back(k);
      bool first = true;
      while (!open.empty()) {
        std::size_t best = 0;
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t k = 0; k < open.size(); ++k) {
          const Step& step = steps[open[k]];
          double cost = 0;
          if (step.kind == Step::Kind::triple) cost = estimate(*step.triple, state);
          else cost = static_cast<double>(step.pattern->values.rows.size());
          const bool connected = step.variables.meets(state.possible) || step.variables.meets(state.seeded);
          if (!connected && !first && cost > 1) cost = cost * 1e6 + many;
          if (cost < least) least = cost, best = k;
        }
        const Step& step = steps[open[best]];
        open.erase(open.begin() + static_cast<std::ptrdiff_t>(best));
        if (step.kind == Step::Kind::triple) {
          add_triple(*step.triple, frame, state, out);
        } else {
          VariableSet always;
          std::vector<Slot> columns;
          for (const Variable variable : step.pattern->values.variables) columns.push_back(number(variable));
          auto rows = rows_of(step.pattern->values, always);
          add_rows(std::move(rows), columns, always, frame, state, out);
        }
        first = false;
        done(step);
      }
      i = end;
      continue;
    }
    const Step& step = steps[i++];
    switch (step.kind) {
      case Step::Kind::triple:
      case Step::Kind::values: break;
      case Step::Kind::apart: add_apart(*step.pattern, frame, state, out); break;
      case Step::Kind::filter: add_filter(*step.condition, frame, state, out); break;
      case Step::Kind::minus: add_minus(*step.pattern, frame, state, out); break;
      case Step::Kind::extend:
        out.add(std::make_unique<ExtendStage>(run_, frame, compile(*step.pattern->condition, frame, state), number(step.pattern->variable)));
        state.possible.insert(number(step.pattern->variable));
        break;
      case Step::Kind::optional: {
        const Pattern& right = *step.pattern->parts[1];
        const Expression* const if_true = step.pattern->condition ? &*step.pattern->condition : nullptr;
        Pipeline pipeline;
        PlanState inner = state;
        const Facts& f = facts(right);
        if (f.possible.meets(state.possible) || f.mentioned.meets(state.seeded)) {
          plan(right, if_true, frame, inner, pipeline);
        } else {  // the same for each solution
          add_apart(right, frame, inner, pipeline);
          if (if_true) add_filter(*if_true, frame, inner, pipeline);
        }
        out.add(std::make_unique<OptionalStage>(std::move(pipeline)));
        state.possible.insert(f.possible);
        break;
      }
      case Step::Kind::part: {
        const Pattern& part = *step.pattern;
        if (part.kind == Pattern::Kind::graph) {
          add_graph(part, frame, state, out);
          break;
        }
        auto stage = std::make_unique<UnionStage>(run_);
        for (const auto& alternative : part.parts) {
          Pipeline pipeline;
          PlanState inner = state;
          plan(*alternative, nullptr, frame, inner, pipeline);
          stage->add(std::move(pipeline));
        }
        out.add(std::move(stage));
        state.certain.insert(facts(part).certain);
        state.possible.insert(facts(part).possible);
        break;
      }
    }
    done(step);
  }
  for (const Filter& filter : filters) add_filter(*filter.expression, frame, state, out);
}

Expr Planner::compile(const Expression& expression, Frame& frame, const PlanState& state, std::vector<Aggregate>* aggregates) {
  run_.budget.step();
  Expr e;
  e.op = expression.op;
  if (is_aggregate(expression.op) && aggregates) {
    e.op = Operator::variable;
    e.slot = new_slot();
    aggregates->push_back({&expression, e.slot});
    return e;
  }
  if (expression.op == Operator::variable) e.slot = expression.index;
  if (expression.op == Operator::constant) e.constant = run_.operators.of(run_.constants[expression.index]);
  if (expression.op == Operator::call) e.function = run_.query.constants[expression.index];
  e.arguments.reserve(expression.arguments.size());
  for (const Expression& argument : expression.arguments) e.arguments.push_back(compile(argument, frame, state, aggregates));
  if (expression.pattern) {
    // EXISTS: what is bound replaces the variables of the pattern.
    PlanState inner;
    inner.graph = state.graph;
    inner.certain = state.certain;
    inner.seeded = state.seeded;
    inner.seeded.insert(state.possible);
    e.pattern = std::make_shared<Pipeline>();
    plan(*expression.pattern, nullptr, frame, inner, *e.pattern);
  }
  return e;
}

}  // namespace lrt::query

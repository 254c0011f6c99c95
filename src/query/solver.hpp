// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "src/base/function_ref.hpp"
#include "src/query/plan.hpp"

namespace lrt::query {

/// The solutions of a query: its pattern, then groups, expressions, order, DISTINCT, OFFSET and LIMIT (SPARQL 18.5).
class Solver {
 public:
  using Visit = FunctionRef<bool(const TermNumber*)>;

  /// @param output  the variables of a solution, in order
  /// @param frame   outlives the solver, and is only its own
  Solver(Run& run, Planner& planner, const Query& query, std::vector<Slot> output, const ActiveGraph& graph, Frame& frame);
  /// Gives each solution to the visitor, until it returns false.
  void solve(Visit visit);

 private:
  struct Column {
    Slot slot;
    Expr expression;
  };
  struct Aggregate {
    const Expression* expression;
    Slot slot;
    std::vector<Expr> argument;  // none: COUNT(*)
  };
  /// The state of an aggregate for a group.
  struct Collected {
    std::uint64_t count = 0;
    bool failed = false;
    Value sum;
    TermNumber best = nothing;
    std::string text;
    std::unique_ptr<RowSet> seen;  // DISTINCT
  };
  class Output;

  void collect(const Aggregate& aggregate, Collected& collected);
  TermNumber result(const Aggregate& aggregate, const Collected& collected);
  void solve_groups(Output& output);
  /// Computes the columns of a solution and passes it on. False: no further solutions are needed.
  bool give(Output& output);

  Run& run_;
  const Query& query_;
  Frame& frame_;
  Pipeline where_;
  std::vector<Slot> output_;
  std::vector<Column> keys_, columns_;  // a key without a variable has no slot
  std::vector<Aggregate> aggregates_;
  std::vector<Expr> having_, order_;
  std::vector<Slot> named_;  // the variables of COUNT(DISTINCT *)
};

}  // namespace lrt::query

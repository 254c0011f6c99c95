// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "src/query/algebra.hpp"
#include "src/query/run.hpp"
#include "src/query/stages.hpp"

namespace lrt::query {

/// A set of variables of a query.
class VariableSet {
 public:
  void insert(std::uint32_t variable) {
    if (variable / 64 >= words_.size()) words_.resize(variable / 64 + 1);
    words_[variable / 64] |= std::uint64_t{1} << (variable % 64);
  }
  bool has(std::uint32_t variable) const noexcept { return variable / 64 < words_.size() && (words_[variable / 64] >> (variable % 64) & 1U) != 0; }
  void insert(const VariableSet& other) {
    if (other.words_.size() > words_.size()) words_.resize(other.words_.size());
    for (std::size_t i = 0; i < other.words_.size(); ++i) words_[i] |= other.words_[i];
  }
  void keep(const VariableSet& other) {
    for (std::size_t i = 0; i < words_.size(); ++i) words_[i] &= i < other.words_.size() ? other.words_[i] : 0;
  }
  bool meets(const VariableSet& other) const noexcept {
    for (std::size_t i = 0; i < words_.size() && i < other.words_.size(); ++i) {
      if ((words_[i] & other.words_[i]) != 0) return true;
    }
    return false;
  }
  /// Whether the intersection of both is contained in the third.
  bool meets_only_in(const VariableSet& other, const VariableSet& allowed) const noexcept {
    for (std::size_t i = 0; i < words_.size() && i < other.words_.size(); ++i) {
      if ((words_[i] & other.words_[i] & ~(i < allowed.words_.size() ? allowed.words_[i] : 0)) != 0) return false;
    }
    return true;
  }
  template <class Visit>
  void each(Visit visit) const {
    for (std::size_t i = 0; i < words_.size(); ++i) {
      for (std::uint64_t word = words_[i]; word != 0; word &= word - 1)
        visit(static_cast<std::uint32_t>(i * 64) + static_cast<std::uint32_t>(__builtin_ctzll(word)));
    }
  }

 private:
  std::vector<std::uint64_t> words_;
};

/// The bindings that are known at a place of a pipeline.
struct PlanState {
  VariableSet certain;   ///< bound in every solution
  VariableSet possible;  ///< bound in some, by this pattern
  VariableSet seeded;    ///< in EXISTS: variables that the outer solution may have bound; its values replace them
  ActiveGraph graph;
};

class Solver;

/// Translates patterns into pipelines.
///
/// Patterns are evaluated from left to right; each stage gets the bindings of the stages before it. SPARQL defines an evaluation from the
/// inside out. Both have the same solutions unless a pattern would see a variable of a sibling. Such patterns, and subqueries, are evaluated
/// separately and joined by hash.
class Planner {
 public:
  explicit Planner(Run& run);
  /// Adds the stages of a pattern and the filters after it. `state` becomes the state after the pattern.
  void plan(const Pattern& pattern, const Expression* condition, Frame& frame, PlanState& state, Pipeline& out);
  /// Aggregates of the expression are computed elsewhere: their values are in new slots.
  struct Aggregate {
    const Expression* expression;
    Slot slot;
  };
  Expr compile(const Expression& expression, Frame& frame, const PlanState& state, std::vector<Aggregate>* aggregates = nullptr);
  void add_rows(std::unique_ptr<RowSource> source, const std::vector<Slot>& columns, const VariableSet& always, Frame& frame, PlanState& state,
                Pipeline& out);
  /// The variables of VALUES, and those of them that are always bound.
  std::unique_ptr<RowSource> rows_of(const Values& values, VariableSet& always);
  /// Gives all frames the slots that the plan needs. Must be called when the plan is complete.
  void finish();
  void add_frame(Frame& frame) { frames_.push_back(&frame); }
  const VariableSet& certain(const Pattern& pattern) { return facts(pattern).certain; }

 private:
  /// The effect of a pattern, without its context.
  struct Facts {
    VariableSet certain, possible;
    VariableSet mentioned;  // with those of its expressions
  };
  struct Step;
  struct Filter {
    const Expression* expression;
    VariableSet variables;
  };

  const Facts& facts(const Pattern& pattern);
  void collect(const Expression& expression, VariableSet& variables);
  VariableSet variables_of(const Expression& expression);
  VariableSet variables_of(const TriplePattern& triple) const;
  bool can_be_seeded(const Pattern& pattern, const VariableSet& bound);
  void split(const Expression& condition, std::vector<Filter>& filters);
  void flatten(const Pattern& pattern, VariableSet& bound, std::vector<Step>& steps, std::vector<Filter>& filters);
  double estimate(const TriplePattern& triple, const PlanState& state) const;
  void add_triple(const TriplePattern& triple, Frame& frame, PlanState& state, Pipeline& out);
  void add_path(const Path& path, End subject, End object, Frame& frame, PlanState& state, Pipeline& out);
  void add_apart(const Pattern& pattern, Frame& frame, PlanState& state, Pipeline& out);
  void add_graph(const Pattern& pattern, Frame& frame, PlanState& state, Pipeline& out);
  void add_minus(const Pattern& pattern, Frame& frame, PlanState& state, Pipeline& out);
  void add_filter(const Expression& condition, Frame& frame, const PlanState& state, Pipeline& out);
  bool begins_with_triple(const Pattern& pattern) const noexcept;
  std::vector<Slot> inherited(const VariableSet& mentioned, const PlanState& state) const;
  End end_of(const Node& node) const noexcept;
  Slot new_slot() noexcept { return slots_++; }

  Run& run_;
  Slot slots_;
  std::vector<Frame*> frames_;
  std::unordered_map<const Pattern*, Facts> facts_;
};

}  // namespace lrt::query

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "src/query/algebra.hpp"
#include "src/query/budget.hpp"
#include "src/query/dataset.hpp"
#include "src/query/terms.hpp"
#include "src/query/value.hpp"
#include "src/shacl/regex.hpp"

/// The parts of an evaluation. A query becomes pipelines of stages that work on one frame of variables, and backtrack: a stage binds
/// variables, the following stages continue, and after their last solution it unbinds the variables and looks for the next binding.
namespace lrt::query {

/// A place in a frame: below the number of the query's variables it is that variable, above it is something that the plan needs.
using Slot = std::uint32_t;

/// The bindings of the variables while a pipeline runs. A subquery, or a pattern that is evaluated separately, has its own frame.
struct Frame {
  std::vector<TermNumber> slots;
  TermNumber& operator[](Slot slot) noexcept { return slots[slot]; }
  TermNumber operator[](Slot slot) const noexcept { return slots[slot]; }
};

class Stage {
 public:
  Stage() = default;
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;
  virtual ~Stage() = default;
  /// Restarts with the current bindings.
  virtual void open() = 0;
  /// Unbinds its variables and binds the next solution. False: there is no further solution, and nothing is bound.
  virtual bool next() = 0;
  /// Unbinds its variables.
  virtual void close() noexcept = 0;
};

class Pipeline {
 public:
  void add(std::unique_ptr<Stage> stage) { stages_.push_back(std::move(stage)); }
  bool empty() const noexcept { return stages_.empty(); }
  void open() noexcept { state_ = State::open; }
  /// The next solution. Without stages there is one.
  bool next();
  void close() noexcept;

 private:
  enum class State : std::uint8_t { closed, open, running };
  std::vector<std::unique_ptr<Stage>> stages_;
  std::size_t at_ = 0;
  State state_ = State::closed;
};

/// An expression whose variables have places.
struct Expr {
  Operator op = Operator::constant;
  Slot slot = nothing;  // of a variable
  Value constant;       // of a constant
  std::vector<Expr> arguments;
  std::shared_ptr<Pipeline> pattern;  // of exists and not_exists, on the frame of the expression
  rdf::Term function;                 // of a call: its IRI
  struct Compiled {
    std::string pattern, flags;
    Result<shacl::Regex> regex;
  };
  mutable std::shared_ptr<Compiled> regex;  // the last one
};

/// The graphs of a query: all of the dataset, or what FROM, FROM NAMED or the protocol says.
struct View {
  Scope default_graph;
  const GraphSet* named = nullptr;  ///< nullptr: all
  bool has(GraphNumber graph) const noexcept { return graph != nothing && (!named || named->contains(graph)); }
};

/// One evaluation.
class Run {
 public:
  Run(const Query& query, const Dataset& data, const View& view, Budget& budget, std::chrono::system_clock::time_point now);

  Value evaluate(const Expr& expression, const Frame& frame);
  bool passes(const Expr& condition, const Frame& frame) { return operators.truth(evaluate(condition, frame)).value_or(false); }
  /// The term of an expression's value, or nothing.
  TermNumber term_of(const Expr& expression, const Frame& frame) {
    const Value value = evaluate(expression, frame);
    return value.failed ? nothing : operators.number_of(value);
  }
  /// BNODE(label) is one blank node in one solution.
  void end_solution() noexcept { labels_.clear(); }

  const Query& query;
  const Dataset& data;
  const View& view;
  Budget& budget;
  Terms terms;
  Operators operators;
  std::vector<TermNumber> constants;

 private:
  Value function(const Expr& e, const Frame& frame);
  Value text_function(const Expr& e, const Frame& frame);
  Value number_function(const Expr& e, const Value& argument);
  Value time_function(Operator op, const Value& argument);
  Value cast(std::string_view type, const Value& value);
  Value search(const Expr& e, const Frame& frame);
  Value made(const rdf::TermView& term) { return operators.of(terms.intern(term)); }

  std::chrono::system_clock::time_point now_;
  std::mt19937_64 random_;
  bool seeded_ = false;
  std::unordered_map<std::string, TermNumber> labels_;
  shacl::Regex::Scratch scratch_;
};

}  // namespace lrt::query

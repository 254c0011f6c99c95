// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include <lrt/rdf/detail/hash_index.hpp>

#include "src/query/run.hpp"

namespace lrt::query {

/// An end of a triple pattern or path.
struct End {
  Slot slot = nothing;        ///< a variable, or
  TermNumber term = nothing;  ///< a term
  bool is_replaced = false;   ///< of a path: EXISTS puts a term in the place of the variable if it is bound outside
  TermNumber in(const Frame& frame) const noexcept { return slot == nothing ? term : frame[slot]; }
  /// Whether a term stands in the query, rather than a variable that other patterns may have bound.
  bool is_term(const Frame& frame) const noexcept { return slot == nothing || (is_replaced && frame[slot] != nothing); }
};

/// The graph that a pattern is matched in.
struct ActiveGraph {
  enum class Kind : std::uint8_t { unnamed, one, variable };
  Kind kind = Kind::unnamed;
  GraphNumber graph = nothing;  ///< one
  Slot slot = nothing;          ///< variable: has the name of the graph
};
/// @pre the variable is bound
Scope scope_of(const ActiveGraph& active, const Run& run, const Frame& frame) noexcept;

/// The variables that a stage has bound.
class Bindings {
 public:
  explicit Bindings(Frame& frame) noexcept : frame_(frame) {}
  /// False: the slot has another term.
  bool bind(Slot slot, TermNumber term) {
    if (slot == nothing) return true;
    TermNumber& bound = frame_[slot];
    if (bound == term) return true;
    if (bound != nothing) return false;
    bound = term;
    slots_.push_back(slot);
    return true;
  }
  void undo() noexcept {
    for (const Slot slot : slots_) frame_[slot] = nothing;
    slots_.clear();
  }

 private:
  Frame& frame_;
  std::vector<Slot> slots_;
};

/// Rows of terms in some columns, in memory that is counted.
class Rows {
 public:
  Rows(Budget& budget, std::vector<Slot> columns) : budget_(budget), columns_(std::move(columns)) {}
  ~Rows() { clear(); }
  Rows(const Rows&) = delete;
  Rows& operator=(const Rows&) = delete;

  const std::vector<Slot>& columns() const noexcept { return columns_; }
  std::size_t size() const noexcept { return size_; }
  const TermNumber* row(std::size_t at) const noexcept { return cells_.data() + at * columns_.size(); }
  void add(const TermNumber* cells) {
    budget_.take(columns_.size() * sizeof(TermNumber));
    budget_.step();
    cells_.insert(cells_.end(), cells, cells + columns_.size());
    ++size_;
  }
  void clear() noexcept {
    budget_.give(cells_.size() * sizeof(TermNumber));
    cells_.clear();
    size_ = 0;
  }

 private:
  Budget& budget_;
  std::vector<Slot> columns_;
  std::vector<TermNumber> cells_;
  std::size_t size_ = 0;
};

/// Rows of a number of terms, each once.
class RowSet {
 public:
  RowSet(Budget& budget, std::size_t width) : budget_(budget), width_(width) {}
  ~RowSet() { budget_.give(taken_); }
  RowSet(const RowSet&) = delete;
  RowSet& operator=(const RowSet&) = delete;

  /// The number of the row, and whether it is new.
  std::pair<std::uint32_t, bool> insert(const TermNumber* row);
  std::size_t size() const noexcept { return size_; }
  const TermNumber* row(std::size_t at) const noexcept { return cells_.data() + at * width_; }

 private:
  Budget& budget_;
  std::size_t width_, taken_ = 0;
  std::uint32_t size_ = 0;
  std::vector<TermNumber> cells_;
  lrt::detail::HashIndex index_;
};
std::uint32_t hash_of_row(const TermNumber* row, std::size_t width) noexcept;

/// A source of rows that are joined as a whole.
class RowSource {
 public:
  virtual ~RowSource() = default;
  /// The rows; `changed`: they are not those of the last call.
  virtual const Rows& rows(bool& changed) = 0;
};

/// VALUES.
class ConstantRows final : public RowSource {
 public:
  ConstantRows(Budget& budget, std::vector<Slot> columns) : rows_(budget, std::move(columns)) {}
  void add(const TermNumber* cells) { rows_.add(cells); }
  const Rows& rows(bool& changed) override {
    changed = !used_;
    used_ = true;
    return rows_;
  }

 private:
  Rows rows_;
  bool used_ = false;
};

/// Something that is evaluated apart, once for each combination of what it takes over from outside.
class EvaluatedRows : public RowSource {
 public:
  EvaluatedRows(Run& run, const Frame& outer, std::vector<Slot> columns, std::vector<Slot> inherited)
      : run_(run), outer_(outer), rows_(run.budget, std::move(columns)), inherited_(std::move(inherited)) {}
  const Rows& rows(bool& changed) final;

 protected:
  virtual void evaluate(Rows& rows) = 0;
  Frame& begin();

  Run& run_;

 public:
  Frame frame;  ///< its own

 private:
  const Frame& outer_;
  Rows rows_;
  std::vector<Slot> inherited_;
  std::vector<TermNumber> last_;
  bool done_ = false;
};

class PatternRows final : public EvaluatedRows {
 public:
  using EvaluatedRows::EvaluatedRows;
  Pipeline pipeline;

 private:
  void evaluate(Rows& rows) override;
};

class TripleStage final : public Stage {
 public:
  TripleStage(Run& run, Frame& frame, const ActiveGraph& graph, End subject, End predicate, End object)
      : run_(run), frame_(frame), graph_(graph), subject_(subject), predicate_(predicate), object_(object), bindings_(frame) {}
  void open() override;
  bool next() override;
  void close() noexcept override { bindings_.undo(); }

 private:
  Run& run_;
  Frame& frame_;
  ActiveGraph graph_;
  End subject_, predicate_, object_;
  Bindings bindings_;
  Dataset::Matches matches_;
  bool each_graph_ = false;  // the variable of the graph is not bound
  const NumberedTriple* triple_ = nullptr;
  std::vector<GraphNumber> graphs_;  // of the triple, not yet given
};

class PathStage final : public Stage {
 public:
  PathStage(Run& run, Frame& frame, const ActiveGraph& graph, const Path& path, End subject, End object)
      : run_(run), frame_(frame), graph_(graph), path_(path), subject_(subject), object_(object), bindings_(frame) {}
  ~PathStage() override { run_.budget.give(taken_); }
  void open() override;
  bool next() override;
  void close() noexcept override { bindings_.undo(); }

 private:
  /// Terms, each once, in the order of insertion.
  struct NodeSet {
    std::vector<TermNumber> nodes;
    std::vector<std::uint32_t> slots;  // 1 + the place in nodes; a power of two
    bool insert(TermNumber node);
  };
  void reach(const Path& path, TermNumber node, bool forward, std::vector<TermNumber>& out);
  void step(TermNumber subject, TermNumber predicate, TermNumber object, std::vector<TermNumber>& out);
  void excluding(const std::vector<Constant>& excluded, TermNumber node, bool forward, std::vector<TermNumber>& out);
  void charge();
  void release(std::size_t before) noexcept;
  void keep(std::vector<TermNumber>& out, TermNumber node);
  bool is_node(TermNumber term);
  void all_nodes();
  void from(TermNumber start);

  Run& run_;
  Frame& frame_;
  ActiveGraph graph_;
  const Path& path_;
  End subject_, object_;
  Bindings bindings_;
  Scope scope_;
  bool forward_ = true;
  TermNumber target_ = nothing, start_ = nothing;
  std::vector<TermNumber> starts_, found_;
  std::size_t next_start_ = 0, next_found_ = 0;
  std::size_t taken_ = 0, taken_of_starts_ = 0;
};

/// Binds the variable of a graph to each name, for a pattern that does not begin with a triple.
class GraphStage final : public Stage {
 public:
  GraphStage(Run& run, Frame& frame, Slot slot) : run_(run), frame_(frame), slot_(slot), bindings_(frame) {}
  void open() override {
    at_ = 0;
    bound_ = frame_[slot_] != nothing;
  }
  bool next() override;
  void close() noexcept override { bindings_.undo(); }

 private:
  Run& run_;
  Frame& frame_;
  Slot slot_;
  Bindings bindings_;
  GraphNumber at_ = 0;
  bool bound_ = false;
};

/// Copies one slot to another: for the variable of GRAPH, which its pattern does not see.
class CopyStage final : public Stage {
 public:
  CopyStage(Frame& frame, Slot from, Slot to) : frame_(frame), from_(from), to_(to), bindings_(frame) {}
  void open() override { pending_ = true; }
  bool next() override {
    bindings_.undo();
    if (!std::exchange(pending_, false)) return false;
    return frame_[from_] == nothing || bindings_.bind(to_, frame_[from_]);
  }
  void close() noexcept override { bindings_.undo(); }

 private:
  Frame& frame_;
  Slot from_, to_;
  Bindings bindings_;
  bool pending_ = false;
};

class FilterStage final : public Stage {
 public:
  FilterStage(Run& run, Frame& frame, Expr condition) : run_(run), frame_(frame), condition_(std::move(condition)) {}
  void open() override { pending_ = true; }
  bool next() override { return std::exchange(pending_, false) && run_.passes(condition_, frame_); }
  void close() noexcept override {}

 private:
  Run& run_;
  Frame& frame_;
  Expr condition_;
  bool pending_ = false;
};

class ExtendStage final : public Stage {
 public:
  ExtendStage(Run& run, Frame& frame, Expr expression, Slot slot)
      : run_(run), frame_(frame), expression_(std::move(expression)), slot_(slot), bindings_(frame) {}
  void open() override { pending_ = true; }
  bool next() override;
  void close() noexcept override { bindings_.undo(); }

 private:
  Run& run_;
  Frame& frame_;
  Expr expression_;
  Slot slot_;
  Bindings bindings_;
  bool pending_ = false;
};

/// Joins rows by hash: the columns in `keys` are bound in each row, and in the frame when the stage is opened.
class RowsStage final : public Stage {
 public:
  RowsStage(Run& run, Frame& frame, std::unique_ptr<RowSource> source, std::vector<std::size_t> keys)
      : run_(run), frame_(frame), source_(std::move(source)), keys_(std::move(keys)), bindings_(frame) {}
  ~RowsStage() override { run_.budget.give(taken_); }
  void open() override;
  bool next() override;
  void close() noexcept override { bindings_.undo(); }

 private:
  Run& run_;
  Frame& frame_;
  std::unique_ptr<RowSource> source_;
  std::vector<std::size_t> keys_;
  Bindings bindings_;
  const Rows* rows_ = nullptr;
  std::vector<std::uint32_t> heads_, links_;  // of chains of equal hashes
  std::vector<TermNumber> key_;
  std::uint32_t at_ = nothing;
  std::size_t taken_ = 0;
};

/// MINUS with rows: fails if one is compatible and shares a variable.
class MinusStage final : public Stage {
 public:
  MinusStage(Run& run, Frame& frame, std::unique_ptr<RowSource> source, std::vector<std::size_t> keys)
      : run_(run), frame_(frame), source_(std::move(source)), keys_(std::move(keys)) {}
  ~MinusStage() override { run_.budget.give(taken_); }
  void open() override { pending_ = true; }
  bool next() override;
  void close() noexcept override {}

 private:
  Run& run_;
  Frame& frame_;
  std::unique_ptr<RowSource> source_;
  std::vector<std::size_t> keys_;
  std::vector<std::uint32_t> heads_, links_;
  std::vector<TermNumber> key_;
  std::size_t taken_ = 0;
  bool pending_ = false;
};

/// MINUS with a pattern that is matched with what is bound.
class AbsentStage final : public Stage {
 public:
  explicit AbsentStage(Pipeline pipeline) : pipeline_(std::move(pipeline)) {}
  void open() override { pending_ = true; }
  bool next() override;
  void close() noexcept override { pipeline_.close(); }

 private:
  Pipeline pipeline_;
  bool pending_ = false;
};

class OptionalStage final : public Stage {
 public:
  explicit OptionalStage(Pipeline pipeline) : pipeline_(std::move(pipeline)) {}
  void open() override {
    found_ = done_ = false;
    pipeline_.open();
  }
  bool next() override;
  void close() noexcept override { pipeline_.close(); }

 private:
  Pipeline pipeline_;
  bool found_ = false, done_ = false;
};

class UnionStage final : public Stage {
 public:
  explicit UnionStage(Run& run) : run_(run) {}
  void add(Pipeline pipeline) { parts_.push_back(std::move(pipeline)); }
  void open() override {
    at_ = 0;
    if (!parts_.empty()) parts_[0].open();
  }
  bool next() override;
  void close() noexcept override {
    if (at_ < parts_.size()) parts_[at_].close();
  }

 private:
  Run& run_;
  std::vector<Pipeline> parts_;
  std::size_t at_ = 0;
};

/// No solution.
class NoStage final : public Stage {
 public:
  void open() override {}
  bool next() override { return false; }
  void close() noexcept override {}
};

}  // namespace lrt::query

#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include <lrt/base/result.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/term.hpp>

namespace lrt::shacl {

struct Plan;

struct CompileOptions {
  /// What SHACL Core does not have (sh:sparql, sh:js, sh:target, sh:expression, constraint components of the graph's own,
  /// sh:entailment) is refused, because ignoring a constraint means to accept what it forbids. True: it is ignored.
  bool ignore_unsupported = false;
  std::size_t max_pattern_length = 1000;  ///< bytes of one sh:pattern
  std::size_t max_path_depth = 32;        ///< nesting of one property path
  std::size_t max_path_size = 1000;       ///< parts of one property path
};

/// Shapes, compiled once and then immutable (SHACL 2, 4).
///
/// Compiling checks every syntax rule of SHACL Core for every shape of the graph, used or not, so that nothing ill-formed is
/// met while data are judged. A shape may refer to itself, directly or through others: SHACL leaves the meaning open (3.4.3),
/// here a node that is met again while it is being judged by the same shape is taken to conform, so that lists and trees can be
/// described and nothing is endless. owl:imports is not followed.
///
/// @par Threads  Any: immutable; copies share.
class Shapes {
 public:
  /// @par Errors  expected_value: an ill-formed shape, with the triple. unsupported_syntax: see CompileOptions. limit_exceeded.
  /// @par Time    Linear in the graph. Allocates.
  static Result<Shapes> compile(const rdf::Graph& shapes, const CompileOptions& options = {});
  static Result<Shapes> compile(rdf::Graph&& shapes, const CompileOptions& options = {});

  /// True if the term is a shape of the graph.
  bool contains(const rdf::TermView& shape) const noexcept;
  /// The number of shapes, nested ones included.
  std::size_t size() const noexcept;
  /// The shapes graph.
  const rdf::Graph& graph() const noexcept;

  /// For src/shacl: what the shapes were compiled to.
  const std::shared_ptr<const Plan>& plan() const noexcept { return plan_; }

 private:
  explicit Shapes(std::shared_ptr<const Plan> plan) noexcept : plan_(std::move(plan)) {}
  std::shared_ptr<const Plan> plan_;
};

}  // namespace lrt::shacl

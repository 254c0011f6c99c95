// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <utility>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/term.hpp>

namespace lrt::shacl {
inline namespace v0 {

struct Plan;

/// Options and limits of Shapes::compile().
struct CompileOptions {
  /// Whether features beyond SHACL Core are ignored: sh:sparql, sh:js, sh:target, sh:expression, sh:entailment, custom
  /// constraint components. False: they are refused, because an ignored constraint would accept invalid data.
  bool ignore_unsupported = false;
  std::size_t max_pattern_length = 1000;  ///< bytes of one sh:pattern
  std::size_t max_path_depth = 32;        ///< nesting of one property path
  std::size_t max_path_size = 1000;       ///< parts of one property path
};

/// Compiled, immutable shapes (SHACL 2, 4).
///
/// Compiling checks every syntax rule of SHACL Core for every shape of the graph, used or not, so a validation never
/// finds an ill-formed shape. A shape may refer to itself, directly or through others. SHACL does not define the
/// meaning (3.4.3); here a node conforms to a shape while it is being validated against the same shape. So shapes can
/// describe lists and trees, and validation terminates. owl:imports is ignored.
///
/// @par Threads  Any: immutable. Copies share their data.
class LRT_API Shapes {
 public:
  /// @{
  /// Compiles all shapes of a graph.
  /// @par Errors  expected_value: an ill-formed shape, with the triple. unsupported_syntax: see CompileOptions.
  ///              limit_exceeded.
  /// @par Time    Linear in the graph. Allocates.
  static Result<Shapes> compile(const rdf::Graph& shapes, const CompileOptions& options = {});
  static Result<Shapes> compile(rdf::Graph&& shapes, const CompileOptions& options = {});
  /// @}

  /// Whether the term is a shape of the graph.
  bool contains(const rdf::TermView& shape) const noexcept;
  /// The number of shapes, nested ones included.
  std::size_t size() const noexcept;
  /// The shapes graph.
  const rdf::Graph& graph() const noexcept;

  /// For lrt's own validator: the compiled form.
  const std::shared_ptr<const Plan>& plan() const noexcept { return plan_; }

 private:
  explicit Shapes(std::shared_ptr<const Plan> plan) noexcept : plan_(std::move(plan)) {}
  std::shared_ptr<const Plan> plan_;
};

}  // namespace v0
}  // namespace lrt::shacl

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/base/abi.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/term.hpp>

namespace lrt::shacl {
inline namespace v0 {

struct Plan;

/// The property path of a result (SHACL 2.3.1). It has value semantics and shares ownership of the shapes.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
class LRT_API PropertyPath {
 public:
  PropertyPath() = default;
  /// A path of one predicate.
  explicit PropertyPath(const rdf::TermView& predicate) : predicate_(rdf::Term(predicate)) {}
  /// @cond internal
  PropertyPath(std::shared_ptr<const Plan> plan, std::uint32_t path) : plan_(std::move(plan)), path_(path) {}
  /// @endcond

  /// Whether there is no path: true for the result of a node shape.
  bool empty() const noexcept { return !plan_ && !predicate_; }
  /// As a SPARQL 1.1 property path with the default prefixes: "vom:numericalValue", "^ex:part/(ex:a|ex:b)*".
  std::string to_string() const;
  /// The predicate, if the path is one predicate; nullopt otherwise.
  std::optional<rdf::Term> predicate() const;
  /// Adds the path to a graph in the syntax of SHACL: an IRI, or new blank nodes. @pre !empty()
  rdf::TermId write(rdf::Graph& graph) const;

 private:
  std::shared_ptr<const Plan> plan_;
  std::uint32_t path_ = 0;
  std::optional<rdf::Term> predicate_;
};

/// A violation of a constraint (sh:ValidationResult, SHACL 3.6.2). Owns its terms.
///
/// A blank node in `focus` and `value` has its label of the data graph. A blank node in `source_shape` and `severity`
/// has its label of the shapes graph. Equal labels of the two graphs are different nodes.
struct ValidationResult {
  rdf::Term focus;                          ///< sh:focusNode
  PropertyPath path;                        ///< sh:resultPath
  std::optional<rdf::Term> value;           ///< sh:value
  rdf::Term source_shape;                   ///< sh:sourceShape
  Iri component;                            ///< sh:MinCountConstraintComponent ...
  rdf::Term severity;                       ///< sh:Violation by default
  std::vector<rdf::Term> messages;          ///< sh:resultMessage: the shape's sh:message; else one sentence: what was expected, what was found
  std::vector<ValidationResult> details{};  ///< sh:detail: for sh:node and sh:and, the results of the nested shapes
};

/// The result of a validation (SHACL 3.6). It has value semantics.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
class LRT_API Report {
 public:
  /// Whether there is no result of any severity (SHACL 3.6.1.1).
  bool conforms() const noexcept { return results_.empty(); }
  /// The results, ordered by shapes, focus nodes, constraint components (sections 4.1 to 4.8) and values. The order is
  /// deterministic.
  const std::vector<ValidationResult>& results() const noexcept { return results_; }
  /// Whether all results are in the report. False: ValidateOptions::max_results was reached.
  bool complete() const noexcept { return complete_; }

  /// The report as a graph (SHACL 3.6). Its root is a blank node of type sh:ValidationReport. Blank nodes of the data
  /// keep their labels; blank nodes of the shapes get new labels. An incomplete report has an rdfs:comment that says
  /// so.
  rdf::Graph to_graph() const;
  /// One line for each result: focus node, path, message, component. Empty: the data conform.
  std::string to_text() const;

 private:
  friend class Run;
  std::vector<ValidationResult> results_;
  bool complete_ = true;
};

}  // namespace v0
}  // namespace lrt::shacl

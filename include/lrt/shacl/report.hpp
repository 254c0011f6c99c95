#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/term.hpp>

namespace lrt::shacl {

struct Plan;

/// The property path of a result (SHACL 2.3.1). A value; keeps what it needs of the shapes alive.
class PropertyPath {
 public:
  PropertyPath() = default;
  /// The path that is one predicate.
  explicit PropertyPath(const rdf::TermView& predicate) : predicate_(rdf::Term(predicate)) {}
  PropertyPath(std::shared_ptr<const Plan> plan, std::uint32_t path) : plan_(std::move(plan)), path_(path) {}

  /// True for results of a node shape, which have no path.
  bool empty() const noexcept { return !plan_ && !predicate_; }
  /// As a SPARQL 1.1 property path with the default prefixes: "vom:numericalValue", "^ex:part/(ex:a|ex:b)*".
  std::string to_string() const;
  /// Adds the path to a graph as SHACL writes it: an IRI, or fresh blank nodes. @pre !empty()
  rdf::TermId write(rdf::Graph& graph) const;

 private:
  std::shared_ptr<const Plan> plan_;
  std::uint32_t path_ = 0;
  std::optional<rdf::Term> predicate_;
};

/// One way in which a focus node is not what a shape asks for (sh:ValidationResult, SHACL 3.6.2). Owns its terms.
///
/// A blank node in `focus` and `value` has its label in the data graph, one in `source_shape` and `severity` its label in the
/// shapes graph; equal labels of the two are different nodes.
struct ValidationResult {
  rdf::Term focus;
  PropertyPath path;
  std::optional<rdf::Term> value;
  rdf::Term source_shape;
  Iri component;                            ///< sh:MinCountConstraintComponent ...
  rdf::Term severity;                       ///< sh:Violation unless the shape says otherwise
  std::vector<rdf::Term> messages;          ///< the shape's sh:message, else one sentence: what was expected and what was found
  std::vector<ValidationResult> details{};  ///< sh:detail: of sh:node and sh:and, what the value lacks
};

/// What a validation found (SHACL 3.6). A value.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number that only read.
class Report {
 public:
  /// True if there is no result of any severity (SHACL 3.6.1.1).
  bool conforms() const noexcept { return results_.empty(); }
  /// In the order of shapes, focus nodes, constraint components (sections 4.1 to 4.8), values. The same input, the same order.
  const std::vector<ValidationResult>& results() const noexcept { return results_; }
  /// False if ValidateOptions::max_results was reached: there may be more.
  bool complete() const noexcept { return complete_; }

  /// The report as the graph that SHACL 3.6 describes, its root a blank node of type sh:ValidationReport. A blank node of the
  /// data keeps its label; one of the shapes gets a fresh label, the same everywhere. An incomplete report says so in an
  /// rdfs:comment.
  rdf::Graph to_graph() const;
  /// One line a result: focus node, path, message, component. Empty if the data conform.
  std::string to_text() const;

 private:
  friend class Run;
  std::vector<ValidationResult> results_;
  bool complete_ = true;
};

}  // namespace lrt::shacl

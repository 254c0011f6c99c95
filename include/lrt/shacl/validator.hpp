// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include <lrt/base/abi.hpp>
#include <lrt/base/result.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/term.hpp>
#include <lrt/shacl/report.hpp>
#include <lrt/shacl/shapes.hpp>

/// SHACL Core (W3C Recommendation 20 July 2017): all constraint components, property paths and targets.
///
///     auto shapes = lrt::shacl::Shapes::compile(*lrt::rdf::read(text, lrt::rdf::Syntax::turtle, {}));   // once
///     auto report = lrt::shacl::validate(*shapes, data);                                                // often
///     if (report && !report->conforms()) std::cout << report->to_text();
///
/// Choices that the Recommendation leaves open:
///  - Values are compared by the rules of XPath: integers and decimals exactly at any length, others after conversion
///    to float or double. xsd:date, time, gYear, gYearMonth and durations are compared with values of the same kind.
///    Two values that cannot be compared (a dateTime with a zone and one without, less than 14 hours apart) violate the
///    constraint.
///  - PCRE2 evaluates patterns in the dialect of XPath (`\i`, `\c`, class subtraction; flags i m s x q). If a match
///    exceeds its limit of work, the value violates the constraint, and the message says so.
///  - rdfs:subClassOf is read from the data graph, rdf:type and rdfs:subClassOf of shapes from the shapes graph.
namespace lrt::shacl {
inline namespace v0 {

/// Limits of a validation. If one is exceeded, validate() returns Errc::limit_exceeded with the name of the limit,
/// except for max_results.
struct ValidateOptions {
  std::size_t max_depth = 100;             ///< depth of nested shapes (about 1 KiB of stack each)
  std::size_t max_path_nodes = 1'000'000;  ///< nodes visited by one path from one node
  std::size_t max_steps = 50'000'000;      ///< nodes visited and values checked; takes some seconds
  std::size_t max_results = 1'000;         ///< then the report is incomplete, see Report::complete()
  bool details = true;                     ///< fill ValidationResult::details
};

/// Validates a data graph against all shapes that have targets (SHACL 2.1.3, 3.1).
/// @return  the report. That the data do not conform is not an error
///
/// @par Errors   limit_exceeded
/// @par Threads  Any number of threads may use the same shapes and data.
/// @par Time     Linear in the number of focus nodes. A satisfied constraint does not allocate. Scratch memory grows
///               with the largest set of value nodes.
/// @par Implements  SHACL 3
LRT_API Result<Report> validate(const Shapes& shapes, const rdf::Graph& data, const ValidateOptions& options = {});

/// Validates one focus node against one shape, without regard to targets (SHACL 3.4). The focus node need not occur in
/// the data.
///
/// @par Errors   expected_value: there is no such shape. limit_exceeded.
/// @par Threads  As above.
/// @par Implements  SPEC 3.3
LRT_API Result<Report> validate(const Shapes& shapes, const rdf::Graph& data, const rdf::TermView& focus, const rdf::TermView& shape,
                                const ValidateOptions& options = {});

}  // namespace v0
}  // namespace lrt::shacl

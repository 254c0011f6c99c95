#pragma once

#include <cstddef>

#include <lrt/base/result.hpp>
#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/term.hpp>
#include <lrt/shacl/report.hpp>
#include <lrt/shacl/shapes.hpp>

/// SHACL Core (W3C Recommendation 20 July 2017), complete: all constraint components, property paths and targets.
///
///     auto shapes = lrt::shacl::Shapes::compile(*lrt::rdf::read(text, lrt::rdf::Syntax::turtle, {}));   // once
///     auto report = lrt::shacl::validate(*shapes, data);                                                // often
///     if (report && !report->conforms()) std::cout << report->to_text();
///
/// Beyond the letter of the Recommendation, where it leaves a choice:
///  - Values are compared by XPath's rules: integers and decimals exactly, whatever their length; with a float or double after
///    conversion to that type. xsd:date, time, gYear, gYearMonth and durations are compared too, each with its own kind. What
///    cannot be compared (a dateTime with a zone and one without, less than 14 hours apart) violates the constraint.
///  - Patterns are PCRE2 in the dialect of XPath (\i, \c, class subtraction; flags i m s x q). A pattern that cannot be decided
///    within its limit of work violates the constraint and the message says so.
///  - rdfs:subClassOf is read from the data graph, rdf:type and rdfs:subClassOf of shapes from the shapes graph.
namespace lrt::shacl {

/// Limits. A report that would need more is not given: Errc::limit_exceeded says which limit it was.
struct ValidateOptions {
  std::size_t max_depth = 100;             ///< shapes within shapes (about 1 KiB of stack each)
  std::size_t max_path_nodes = 1'000'000;  ///< nodes visited by one path from one node
  std::size_t max_steps = 50'000'000;      ///< nodes visited and values checked in all; some seconds
  std::size_t max_results = 1'000;         ///< reached: the report is cut and says so, see Report::complete()
  bool details = true;                     ///< fill ValidationResult::details
};

/// Validates a data graph against all shapes that have targets (SHACL 2.1.3, 3.1).
///
/// @par Errors   limit_exceeded: could not be judged.
/// @par Threads  Any number at once on the same shapes and data.
/// @par Time     Linear in the focus nodes. A constraint that holds allocates nothing; scratch memory grows with the largest
///               set of value nodes.
/// @par Implements  SHACL 3
Result<Report> validate(const Shapes& shapes, const rdf::Graph& data, const ValidateOptions& options = {});

/// Validates one focus node against one shape, whatever their targets (SHACL 3.4). The focus node need not occur in the data.
///
/// @par Errors   expected_value: no such shape. limit_exceeded: could not be judged.
/// @par Implements  SPEC 3.3
Result<Report> validate(const Shapes& shapes, const rdf::Graph& data, const rdf::TermView& focus, const rdf::TermView& shape,
                        const ValidateOptions& options = {});

}  // namespace lrt::shacl

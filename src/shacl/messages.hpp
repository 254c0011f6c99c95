// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/term.hpp>

#include "src/rdf/shown.hpp"

namespace lrt::shacl {
inline namespace v0 {

struct Plan;
struct Scene;
class Run;

using rdf::shown;

/// A literal of a numeric datatype whose text is a number.
bool is_number(const rdf::TermView& term) noexcept;

/// A value for a message that also has the expectation: the digits of a number, the text of another XML Schema literal.
std::string shown_value(const rdf::TermView& term);

/// The expectation of a shape for its value nodes, in words: "a number", "one of \"idle\", \"active\"", "a list of 3 values". Empty: it cannot be described.
std::string expectation(const Plan& plan, rdf::TermId shape);

/// "one of a, b, c": the members of a list of the shapes graph.
std::string one_of(const Plan& plan, const std::vector<rdf::TermId>& members);

/// The name of a property shape (sh:name) in a sentence, " for \"speed\"". Empty: it has none.
std::string for_name(const Plan& plan, rdf::TermId shape);

/// A violation of a shape on the cells of an RDF list (path rdf:rest*): what was expected and found. Empty: the shape has another path.
std::string list_violation(const Run& run, const Scene& scene);

/// What a shape is about that says nothing but that a predicate is there: its name in `owner`, the shape that it is part of, or the end of its
/// IRI. Empty: that predicates are not there. nullopt: it says more.
std::optional<std::string> required_predicate(const Plan& plan, rdf::TermId owner, rdf::TermId shape);

/// A shape for a message: its IRI, its name or a description.
std::string shown_shape(const Plan& plan, std::uint32_t shape);

/// "1 value", "2 values".
std::string counted(std::uint64_t n, const char* one, const char* many);

}  // namespace v0
}  // namespace lrt::shacl

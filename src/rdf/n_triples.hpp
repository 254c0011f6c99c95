// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <lrt/base/abi.hpp>
#include <lrt/rdf/term.hpp>

namespace lrt::rdf {

/// Appends `"text"`. Escapes the characters that Turtle, N-Triples and JSON require: quote, backslash, controls. Other bytes are copied.

/// Appends the term in the syntax of N-Triples (RDF 1.1 N-Triples 2). Does not validate it: see fault_of().
LRT_INTERNAL_API void append_n_triples(std::string& out, const TermView& term);

/// True for a tag of Turtle's LANGTAG, at most max_language_tag bytes: letters, then groups of letters and digits after '-'.
LRT_INTERNAL_API bool is_language_tag(std::string_view tag) noexcept;

/// True for an ASCII label of Turtle's BLANK_NODE_LABEL.
LRT_INTERNAL_API bool is_plain_label(std::string_view label) noexcept;

/// The fault of a literal of rdf:langString without a language (RDF 1.1 Concepts 3.3), which readers refuse.
inline constexpr std::string_view no_language = "expected a language tag with a literal of rdf:langString";

/// The reason why no RDF syntax can represent the term, as a sentence; empty: all can.
std::string_view fault_of(const TermView& term) noexcept;

}  // namespace lrt::rdf

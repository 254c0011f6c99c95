#pragma once

#include <string>
#include <string_view>

#include <lrt/rdf/term.hpp>

namespace lrt::rdf {

/// Appends `"text"` with what Turtle, N-Triples and JSON need escaped: quote, backslash, controls. Bytes beyond ASCII stay.
void append_quoted(std::string& out, std::string_view text);

/// Appends the term as N-Triples writes it (RDF 1.1 N-Triples 2). Judges nothing: see fault_of().
void append_n_triples(std::string& out, const TermView& term);

/// True for the tags of Turtle's LANGTAG: letters, then groups of letters and digits after '-'; of at most max_language_tag.
bool is_language_tag(std::string_view tag) noexcept;

/// True for the labels of Turtle's BLANK_NODE_LABEL that are ASCII.
bool is_plain_label(std::string_view label) noexcept;

/// Why no RDF syntax can carry the term, as a sentence, or an empty view.
std::string_view fault_of(const TermView& term) noexcept;

}  // namespace lrt::rdf

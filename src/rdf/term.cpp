// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/term.hpp>

#include <lrt/rdf/vocab.hpp>

#include "src/rdf/n_triples.hpp"

namespace lrt::rdf {
inline namespace v0 {

TermView literal(std::string_view lexical) noexcept { return {TermKind::literal, lexical, vocab::xsd::string.text}; }

TermView tagged_literal(std::string_view lexical, std::string_view language) noexcept {
  return {TermKind::literal, lexical, vocab::rdf_::langString.text, language};
}

std::string to_string(const TermView& term) {
  std::string out;
  append_n_triples(out, term);
  return out;
}

}  // namespace v0
}  // namespace lrt::rdf

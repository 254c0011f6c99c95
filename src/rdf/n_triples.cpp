// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/n_triples.hpp"

#include <optional>

#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/base/quote.hpp"
#include "src/base/utf8.hpp"
#include "src/rdf/limits.hpp"

namespace lrt::rdf {
namespace {

using lrt::detail::is_alpha;
using lrt::detail::is_digit;

}  // namespace

void append_n_triples(std::string& out, const TermView& term) {
  if (term.is_blank()) {
    out.append("_:").append(term.text);
    return;
  }
  if (term.is_iri()) {
    out.append("<").append(term.text).append(">");
    return;
  }
  append_quoted(out, term.text);
  if (!term.language.empty()) {
    out.append("@").append(term.language);
  } else if (!term.datatype.empty() && term.datatype != vocab::xsd::string.text) {
    out.append("^^<").append(term.datatype).append(">");
  }
}

bool is_language_tag(std::string_view tag) noexcept {
  if (tag.size() > max_language_tag) return false;
  bool first = true;
  for (std::size_t i = 0;; ++i) {
    const std::size_t from = i;
    while (i < tag.size() && (is_alpha(tag[i]) || (!first && is_digit(tag[i])))) ++i;
    if (i == from) return false;
    if (i == tag.size()) return true;
    if (tag[i] != '-') return false;
    first = false;
  }
}

bool is_plain_label(std::string_view label) noexcept {
  if (label.empty()) return false;
  const auto inner = [](char c) { return is_alpha(c) || is_digit(c) || c == '_'; };
  if (!inner(label.front()) || label.back() == '.') return false;
  for (const char c : label) {
    if (!inner(c) && c != '-' && c != '.') return false;
  }
  return true;
}

std::string_view fault_of(const TermView& term) noexcept {
  switch (term.kind) {
    case TermKind::blank: return {};
    case TermKind::iri: return iri::is_absolute(term.text) ? std::string_view() : "expected an absolute IRI";
    case TermKind::literal: break;
  }
  if (utf8::find_invalid(term.text)) return "expected a literal of well-formed UTF-8";
  if (!term.language.empty()) return is_language_tag(term.language) ? std::string_view() : "expected a language tag";
  if (term.datatype == vocab::rdf_::langString.text) return no_language;
  return iri::is_absolute(term.datatype) ? std::string_view() : "expected a datatype that is an absolute IRI";
}

}  // namespace lrt::rdf

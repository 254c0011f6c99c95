// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/shown.hpp"

#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/value_codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/quote.hpp"
#include "src/base/utf8.hpp"

namespace lrt::rdf {

bool is_bare(const TermView& term) noexcept {
  if (!term.is_literal() || term.text.size() > 40) return false;
  if (term.datatype == vocab::xsd::integer.text) return lexical::is_integer(term.text);
  if (term.datatype == vocab::xsd::decimal.text)
    return lexical::is_decimal(term.text) && term.text.find('.') != std::string_view::npos && term.text.back() != '.';
  return term.datatype == vocab::xsd::boolean.text && (term.text == "true" || term.text == "false");
}

std::string shown(const TermView& term) {
  if (term.is_iri()) {
    const std::string short_form = abbreviate(term.text);
    return short_form.size() > 2 * longest_shown ? "<" + std::string(utf8::prefix(term.text, longest_shown)) + "> (cut)" : short_form;
  }
  if (is_bare(term)) return std::string(term.text);
  const std::string_view begin = utf8::prefix(term.text, longest_shown);
  std::string text = to_string(TermView(term.kind, begin, vocab::xsd::string.text, {}));
  if (begin.size() < term.text.size()) text += " (cut)";
  if (!term.is_literal()) return text;
  if (!term.language.empty()) return text + "@" + std::string(term.language);
  return term.datatype == vocab::xsd::string.text ? text : text + "^^" + abbreviate(term.datatype);
}

}  // namespace lrt::rdf

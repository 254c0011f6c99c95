// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/n_triples.hpp"

#include <array>
#include <optional>

#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/base/utf8.hpp"
#include "src/rdf/limits.hpp"

namespace lrt::rdf {
inline namespace v0 {
namespace {

constexpr std::array<bool, 256> escaped_bytes() {
  std::array<bool, 256> table{};
  for (std::size_t i = 0; i < 0x20; ++i) table[i] = true;
  table['"'] = table['\\'] = table[0x7F] = true;
  return table;
}
constexpr std::array<bool, 256> escaped = escaped_bytes();

using lrt::detail::is_alpha;
using lrt::detail::is_digit;

}  // namespace

void append_quoted(std::string& out, std::string_view text) {
  out.push_back('"');
  std::size_t from = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (!escaped[c]) continue;
    out.append(text, from, i - from);
    from = i + 1;
    out.push_back('\\');
    switch (c) {
      case '"': out.push_back('"'); break;
      case '\\': out.push_back('\\'); break;
      case '\n': out.push_back('n'); break;
      case '\r': out.push_back('r'); break;
      case '\t': out.push_back('t'); break;
      case '\b': out.push_back('b'); break;
      case '\f': out.push_back('f'); break;
      default:
        out.append("u00");
        out.push_back("0123456789ABCDEF"[c >> 4]);
        out.push_back("0123456789ABCDEF"[c & 15]);
    }
  }
  out.append(text, from);
  out.push_back('"');
}

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
  return iri::is_absolute(term.datatype) ? std::string_view() : "expected a datatype that is an absolute IRI";
}

}  // namespace v0
}  // namespace lrt::rdf

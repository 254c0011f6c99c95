// SPDX-License-Identifier: Apache-2.0
#include "src/model/graph_changes.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "src/base/utf8.hpp"
#include "src/model/graph_state.hpp"
#include "src/rdf/n_triples.hpp"

namespace lrt::model {
inline namespace v0 {
namespace {

/// Labels that are no labels of N-Triples are written in hexadecimal digits behind this.
constexpr std::string_view coded = "lrt_x";

void append_term(std::string& out, const rdf::TermView& term) {
  if (!term.is_blank() || (rdf::is_plain_label(term.text) && term.text.substr(0, coded.size()) != coded)) return rdf::append_n_triples(out, term);
  out.append("_:").append(coded);
  for (const char c : term.text) {
    constexpr std::string_view digits = "0123456789abcdef";
    const auto byte = static_cast<unsigned char>(c);
    out.append({digits[byte >> 4U], digits[byte & 15U]});
  }
}

std::optional<std::uint32_t> hexadecimal(std::string_view text) noexcept {
  std::uint32_t value = 0;
  for (const char c : text) {
    const unsigned digit = c >= '0' && c <= '9'   ? static_cast<unsigned>(c - '0')
                           : c >= 'a' && c <= 'f' ? static_cast<unsigned>(c - 'a' + 10)
                           : c >= 'A' && c <= 'F' ? static_cast<unsigned>(c - 'A' + 10)
                                                  : 16U;
    if (digit > 15) return std::nullopt;
    value = value << 4U | digit;
  }
  return text.empty() ? std::nullopt : std::optional(value);
}

/// A term, whose text may have been written with escapes.
struct ReadTerm {
  rdf::TermView view;
  std::string text;  ///< of `view`, if it differs from what was read
};

/// The lines of GraphChanges, and no other N-Triples.
class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text) {}
  std::size_t offset() const noexcept { return at_; }
  bool end() const noexcept { return at_ == text_.size(); }
  bool take(std::string_view expected) noexcept {
    if (text_.substr(at_, expected.size()) != expected) return false;
    at_ += expected.size();
    return true;
  }
  bool term(ReadTerm& term) {
    if (take("<")) {
      const auto iri = until_bracket();
      if (!iri) return false;
      term.view = rdf::iri(*iri);
      return true;
    }
    if (take("_:")) return label(term);
    return take("\"") && literal(term);
  }

 private:
  /// What stands before '>', which is skipped.
  std::optional<std::string_view> until_bracket() noexcept {
    const std::size_t found = text_.find_first_of(">\n", at_);
    if (found == std::string_view::npos || text_[found] != '>') return std::nullopt;
    const std::string_view before = text_.substr(at_, found - at_);
    at_ = found + 1;
    return before;
  }
  bool label(ReadTerm& term) {
    const std::size_t found = text_.find_first_of(" \n", at_);
    const std::string_view label = text_.substr(at_, found == std::string_view::npos ? found : found - at_);
    if (!rdf::is_plain_label(label)) return false;
    at_ += label.size();
    term.view = rdf::blank(label);
    if (label.substr(0, coded.size()) != coded) return true;
    for (std::size_t i = coded.size(); i < label.size(); i += 2) {
      const auto byte = hexadecimal(label.substr(i, 2));
      if (!byte || i + 2 > label.size()) return false;
      term.text.push_back(static_cast<char>(*byte));
    }
    term.view = rdf::blank(term.text);
    return true;
  }
  bool literal(ReadTerm& term) {
    const std::size_t from = at_;
    bool is_escaped = false;
    while (true) {
      const std::size_t found = text_.find_first_of("\"\\\n", at_);
      if (found == std::string_view::npos || text_[found] == '\n') return false;
      if (is_escaped) term.text.append(text_.substr(at_, found - at_));
      if (text_[found] == '"') {
        at_ = found + 1;
        term.view = rdf::literal(is_escaped ? std::string_view(term.text) : text_.substr(from, found - from));
        break;
      }
      if (!std::exchange(is_escaped, true)) term.text.assign(text_.substr(from, found - from));
      at_ = found + 1;
      if (!escape(term.text)) return false;
    }
    if (take("^^<")) {
      const auto datatype = until_bracket();
      if (!datatype) return false;
      term.view.datatype = *datatype;
    } else if (take("@")) {
      const std::size_t found = text_.find_first_of(" \n", at_);
      const std::string_view tag = text_.substr(at_, found == std::string_view::npos ? found : found - at_);
      if (!rdf::is_language_tag(tag)) return false;
      at_ += tag.size();
      const std::string_view text = term.view.text;
      term.view = rdf::tagged_literal(text, tag);
    }
    return true;
  }
  bool escape(std::string& to) {
    if (end()) return false;
    const char c = text_[at_++];
    constexpr std::string_view letters = "tbnrf\"\\'", meant = "\t\b\n\r\f\"\\'";
    if (const std::size_t known = letters.find(c); known != std::string_view::npos) {
      to.push_back(meant[known]);
      return true;
    }
    const std::size_t digits = c == 'u' ? 4 : c == 'U' ? 8 : 0;
    const std::string_view number = text_.substr(at_, digits);
    const auto code = number.size() == digits ? hexadecimal(number) : std::nullopt;
    if (!code || *code > 0x10FFFF || (*code >= 0xD800 && *code < 0xE000)) return false;
    at_ += digits;
    utf8::append(to, *code);
    return true;
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

}  // namespace

void GraphChanges::line(char sign, const rdf::TermView& subject, const rdf::TermView& predicate, const rdf::TermView& object) {
  const std::size_t before = text_.size();
  try {
    text_.append({sign, ' '});
    append_term(text_, subject);
    text_.push_back(' ');
    append_term(text_, predicate);
    text_.push_back(' ');
    append_term(text_, object);
    text_.push_back('\n');
  } catch (...) {
    text_.resize(before);
    throw;
  }
}

Result<void> replay_changes(std::string_view text, GraphEdit& edit) {
  Lines lines(text);
  while (!lines.end()) {
    const std::size_t line = lines.offset();
    const auto fault = [&] {
      Error error{Errc::expected_rdf, "expected a change of a graph"};
      error.offset = line;
      return Unexpected{std::move(error)};
    };
    if (lines.take("clear\n")) {
      edit.clear();
      continue;
    }
    const bool adds = lines.take("+ ");
    if (!adds && !lines.take("- ")) return fault();
    ReadTerm s, p, o;
    if (!lines.term(s) || !lines.take(" ") || !lines.term(p) || !lines.take(" ") || !lines.term(o) || !lines.take("\n")) return fault();
    if (s.view.is_literal() || !p.view.is_iri()) return fault();
    if (adds) edit.add(s.view, p.view, o.view);
    else edit.remove(&s.view, &p.view, &o.view);
    if (edit.error()) {
      Error error = *edit.error();
      error.offset = line;
      return Unexpected{std::move(error)};
    }
  }
  return {};
}

}  // namespace v0
}  // namespace lrt::model

// SPDX-License-Identifier: Apache-2.0
#include "src/query/lexer.hpp"

#include <algorithm>

namespace lrt::query {
namespace terminal = rdf::terminal;
namespace {

/// The code point of the escape whose backslash is at `at`, and its length. Length 0: there is no escape, or its code point is not a scalar value.
std::pair<char32_t, std::size_t> codepoint_escape(std::string_view text, std::size_t at) noexcept {
  const char kind = at + 1 < text.size() ? text[at + 1] : '\0';
  const std::size_t length = kind == 'u' ? 6 : kind == 'U' ? 10 : 0;
  if (length == 0 || text.size() - at < length) return {0, 0};
  char32_t value = 0;
  for (std::size_t i = at + 2; i < at + length; ++i) {
    if (!detail::is(text[i], detail::hex)) return {0, 0};
    value = value * 16 + detail::hex_value(text[i]);
  }
  return value > 0x10FFFF || (value >= 0xD800 && value <= 0xDFFF) ? std::pair<char32_t, std::size_t>{0, 0} : std::pair{value, length};
}

/// Whether an escape of the character can be replaced wherever it is. In a string or an IRI the character stands for itself, elsewhere it is of a
/// name, a number or punctuation.
bool is_replaced(char32_t c) noexcept {
  if (c < 0x80) return detail::is(static_cast<char>(c), detail::uri) && c != '\'' && c != '#';
  return terminal::within(c, terminal::name_letters) || terminal::within(c, terminal::name_marks);
}

bool is_word_character(char c) noexcept { return detail::is_alpha(c) || detail::is_digit(c) || c == '_'; }

}  // namespace

Source::Source(std::string_view text) : original_(text) {
  std::size_t copied = 0;
  for (std::size_t at = text.find('\\'); at < text.size(); at = text.find('\\', at)) {
    const auto [value, length] = codepoint_escape(text, at);
    if (length == 0 || !is_replaced(value)) {
      at += 2;  // what stands behind a backslash begins no escape
      continue;
    }
    escaped_ = true;
    decoded_.append(text, copied, at - copied);
    utf8::append(decoded_, value);
    copied = at += length;
    shifts_.emplace_back(decoded_.size(), copied);
  }
  if (escaped_) decoded_.append(text, copied);
}

Unexpected Source::error_at(std::size_t offset, const std::string& sentence, Errc code) const {
  const auto behind = std::upper_bound(shifts_.begin(), shifts_.end(), offset, [](std::size_t at, const auto& shift) { return at < shift.first; });
  if (behind != shifts_.begin()) offset = std::prev(behind)->second + (offset - std::prev(behind)->first);
  return rdf::misread(original_, offset, sentence, code);
}

bool Lexer::is_word(std::string_view word) const noexcept { return token_.kind == Token::Kind::word && detail::iequals_ascii(token_.text, word); }

bool Lexer::accept(std::string_view punctuation) {
  if (!is_punctuation(punctuation)) return false;
  advance();
  return true;
}
bool Lexer::accept_word(std::string_view word) {
  if (!is_word(word)) return false;
  advance();
  return true;
}
bool Lexer::require(std::string_view punctuation) { return accept(punctuation) || expected(("'" + std::string(punctuation) + "'").c_str()); }
bool Lexer::require_word(std::string_view word) { return accept_word(word) || expected(std::string(word).c_str()); }

/// Whether the '<' at this place begins an IRIREF: the longest token wins over an operator.
bool Lexer::ends_as_iri() const noexcept {
  for (const char* p = at_ + 1; p != end_; ++p) {
    if (*p == '>') return true;
    const bool escape = *p == '\\' && end_ - p > 1 && (p[1] == 'u' || p[1] == 'U');
    if (!escape && (static_cast<unsigned char>(*p) <= ' ' || detail::contains("<\"{}|^`\\", *p))) return false;
  }
  return false;
}

void Lexer::advance() {
  skip_space();
  token_.kind = Token::Kind::end;
  token_.at = at_;
  token_.text = token_.local = {};
  if (end()) return;
  const char c = *at_;
  switch (c) {
    case '<':
      if (!ends_as_iri()) break;
      token_.kind = Token::Kind::iri;
      if (!iri_reference(token_.text, token_.plain, buffer_)) invalid();
      return;
    case '"':
    case '\'':
      token_.kind = Token::Kind::string;
      if (!string(peek(1) == c && peek(2) == c, token_.text, buffer_)) invalid();
      return;
    case '@':
      token_.kind = Token::Kind::language;
      if (!language_tag(token_.text)) invalid();
      return;
    case '?':
    case '$': return read_variable();
    case '_':
      token_.kind = Token::Kind::blank;
      if (!blank_label(token_.text)) invalid();
      return;
    default: break;
  }
  if (detail::is_digit(c) || (c == '.' && detail::is_digit(peek(1)))) {
    token_.kind = Token::Kind::number;
    unsigned_number(token_.datatype);
    token_.text = since(token_.at);
    return;
  }
  if (c == ':' || terminal::is(c, terminal::name_start) || !terminal::is_ascii(c)) return read_name();
  token_.kind = Token::Kind::punctuation;
  const char next = peek(1);
  const bool two = (c == '&' && next == '&') || (c == '|' && next == '|') || (c == '^' && next == '^') || (next == '=' && detail::contains("!<>", c));
  if (!two && !detail::contains("{}()[].,;*/+-=<>!^|", c)) {
    Terminals::expected("a token of SPARQL", at_);
    return invalid();
  }
  at_ += two ? 2 : 1;
  token_.text = since(token_.at);
}

/// PrefixedName or a keyword.
void Lexer::read_name() {
  if (const char* const colon = prefix_end()) {
    token_.kind = Token::Kind::prefixed;
    token_.text = {at_, static_cast<std::size_t>(colon - at_)};
    at_ = colon + 1;
    buffer_.clear();
    token_.plain = true;
    if (!append_local_name(buffer_, token_.plain)) return invalid();
    token_.local = buffer_;
    return;
  }
  while (!end() && is_word_character(*at_)) ++at_;
  if (at_ == token_.at) {
    Terminals::expected("a token of SPARQL", at_);
    return invalid();
  }
  token_.kind = Token::Kind::word;
  token_.text = since(token_.at);
}

/// VAR1 or VAR2; a '?' alone is an operator of paths.
void Lexer::read_variable() {
  ++at_;
  const char* const from = at_;
  for (;;) {
    while (!end() && is_word_character(*at_)) ++at_;
    const char* const next = wide_name_character(at_, at_ == from);
    if (next == at_) break;
    at_ = next;
  }
  token_.kind = Token::Kind::variable;
  token_.text = since(from);
  if (!token_.text.empty()) return;
  token_.kind = Token::Kind::punctuation;
  token_.text = since(token_.at);
  if (token_.text == "$") {
    Terminals::expected("a variable", token_.at);
    invalid();
  }
}

}  // namespace lrt::query

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>
#include <utility>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/base/utf8.hpp"
#include "src/rdf/limits.hpp"

namespace lrt::rdf {
namespace terminal {

using lrt::detail::is_alpha;
using lrt::detail::is_digit;

/// Classes of ASCII characters in the terminals of Turtle 6.5 and SPARQL 1.1 Query 19.8.
enum : std::uint8_t {
  space = 1,
  name_start = 2,  ///< PN_CHARS_BASE
  name = 4,        ///< PN_CHARS
  plain_iri = 8,   ///< IRIREF, and an IRI has it without further conditions
  in_string = 16,  ///< stands for itself in every string
};
constexpr std::array<std::uint8_t, 256> make_classes() noexcept {
  std::array<std::uint8_t, 256> table{};
  for (unsigned i = 0; i < 256; ++i) {
    const char c = static_cast<char>(i);
    unsigned bits = 0;
    if (c == ' ' || c == '\t' || c == '\n' || c == '\r') bits |= space;
    if (is_alpha(c)) bits |= name_start;
    if (is_alpha(c) || is_digit(c) || c == '_' || c == '-') bits |= name;
    if (lrt::detail::is(c, lrt::detail::uri) && c != '%') bits |= plain_iri;
    if (!lrt::detail::contains("\"'\\\n\r", c)) bits |= in_string;
    table[i] = static_cast<std::uint8_t>(bits);
  }
  return table;
}
inline constexpr std::array<std::uint8_t, 256> classes = make_classes();
constexpr bool is(char c, std::uint8_t mask) noexcept { return (classes[static_cast<unsigned char>(c)] & mask) != 0; }
constexpr bool is_ascii(char c) noexcept { return static_cast<unsigned char>(c) < 0x80; }

struct Range {
  char32_t from, to;
};
/// PN_CHARS_BASE beyond ASCII (Turtle 6.5).
inline constexpr Range name_letters[] = {{0xC0, 0xD6},     {0xD8, 0xF6},     {0xF8, 0x2FF},    {0x370, 0x37D},
                                         {0x37F, 0x1FFF},  {0x200C, 0x200D}, {0x2070, 0x218F}, {0x2C00, 0x2FEF},
                                         {0x3001, 0xD7FF}, {0xF900, 0xFDCF}, {0xFDF0, 0xFFFD}, {0x10000, 0xEFFFF}};
/// The further characters of PN_CHARS.
inline constexpr Range name_marks[] = {{0xB7, 0xB7}, {0x300, 0x36F}, {0x203F, 0x2040}};

template <std::size_t n>
bool within(char32_t c, const Range (&ranges)[n]) noexcept {
  return std::any_of(ranges, ranges + n, [c](const Range& r) { return c >= r.from && c <= r.to; });
}

/// True if an IRI begins with a scheme and ':' (RFC 3986 3.1).
inline bool has_scheme(std::string_view iri) noexcept {
  std::size_t i = 0;
  if (iri.empty() || !is_alpha(iri[0])) return false;
  while (i < iri.size() && lrt::detail::is(iri[i], lrt::detail::scheme)) ++i;
  return i < iri.size() && iri[i] == ':';
}
}  // namespace terminal

/// The terminals that Turtle, N-Triples and SPARQL share, over a text of well-formed UTF-8, which may begin with a byte order mark. A function that returns bool returns false
/// after it has set the error. The first error stays.
class Terminals {
 protected:
  explicit Terminals(std::string_view text) : text_(text), at_(utf8::without_mark(text).data()), end_(text.data() + text.size()) {}

  bool fail(const char* at, std::string sentence, Errc code = Errc::expected_rdf) {
    if (failed()) return false;
    error_at_ = at;
    error_ = std::move(sentence);
    error_code_ = code;
    return false;
  }
  bool exceeds(const char* at, std::string sentence) { return fail(at, std::move(sentence), Errc::limit_exceeded); }
  bool expected(const char* what, const char* at) { return fail(at, std::string("expected ") + what + ", found " + found(at)); }
  bool failed() const noexcept { return !error_.empty(); }
  Unexpected error() const { return misread(text_, static_cast<std::size_t>(error_at_ - text_.data()), error_, error_code_); }

  bool well_formed() {
    const auto at = utf8::find_invalid(text_);
    return !at || fail(text_.data() + *at, utf8::fault_of(text_));
  }

  bool end() const noexcept { return at_ == end_; }
  /// The character ahead, or U+0000 at the end of the text.
  char peek() const noexcept { return at_ != end_ ? *at_ : '\0'; }
  char peek(std::ptrdiff_t ahead) const noexcept { return end_ - at_ > ahead ? at_[ahead] : '\0'; }
  std::string_view since(const char* from) const noexcept { return {from, static_cast<std::size_t>(at_ - from)}; }

  /// White space and comments.
  void skip_space() noexcept {
    for (;;) {
      while (at_ != end_ && terminal::is(*at_, terminal::space)) ++at_;
      if (peek() != '#') return;
      skip_comment();
    }
  }
  void skip_comment() noexcept {
    while (at_ != end_ && *at_ != '\n' && *at_ != '\r') ++at_;
  }

  /// UCHAR at the backslash, appended to `out`.
  bool numeric_escape(std::string& out) {
    const char* const from = at_;
    const std::ptrdiff_t length = peek(1) == 'u' ? 6 : 10;
    char32_t value = 0;
    for (std::ptrdiff_t i = 2; i < length; ++i) {
      if (!lrt::detail::is(peek(i), lrt::detail::hex)) return expected("a hexadecimal digit", from + std::min(i, end_ - from));
      value = value * 16 + lrt::detail::hex_value(peek(i));
    }
    at_ += length;
    if (value > 0x10FFFF || (value >= 0xD800 && value <= 0xDFFF)) {
      return fail(from, "escape of a character that is not allowed: " + std::string(since(from)));
    }
    utf8::append(out, value);
    return true;
  }

  /// IRIREF at the '<'. `content` views the text, or `buffer` if it has escapes.
  /// @param plain  set to whether no character needs a second look by iri::is_absolute() or iri::is_reference()
  bool iri_reference(std::string_view& content, bool& plain, std::string& buffer) {
    const char* const from = ++at_;
    const char* copied = from;
    plain = true;
    for (;;) {
      while (at_ != end_ && terminal::is(*at_, terminal::plain_iri)) ++at_;
      if (end()) return fail(from - 1, "unterminated IRI");
      const char c = *at_;
      if (c == '>') break;
      plain = false;
      if (c == '\\' && (peek(1) == 'u' || peek(1) == 'U')) {
        if (copied == from) buffer.clear();
        buffer.append(copied, at_);
        if (!numeric_escape(buffer)) return false;
        copied = at_;
      } else if (terminal::is_ascii(c) && c != '%') {
        return expected("a character of an IRI", at_);
      } else {
        ++at_;
      }
    }
    content = since(from);
    if (copied != from) content = buffer.append(copied, at_);
    if (content.size() > max_iri) return too_long(from - 1);
    ++at_;
    return true;
  }
  bool too_long(const char* from) { return exceeds(from, "IRI of more than " + std::to_string(max_iri) + " bytes"); }

  /// A string at its opening quote, or at the first of three. `content` views the text, or `buffer` if it has escapes.
  bool string(bool three, std::string_view& content, std::string& buffer) {
    const char quote = *at_;
    const char* const from = at_ += three ? 3 : 1;
    const char* copied = from;
    for (;;) {
      while (at_ != end_ && terminal::is(*at_, terminal::in_string)) ++at_;
      if (end()) return fail(from, "unterminated string");
      const char c = *at_;
      if (c == '\\') {
        if (copied == from) buffer.clear();
        buffer.append(copied, at_);
        if (!string_escape(buffer)) return false;
        copied = at_;
      } else if (c != quote) {
        if (!three && (c == '\n' || c == '\r')) return fail(at_, "line end in a string");
        ++at_;
      } else if (!three || (peek(1) == quote && peek(2) == quote)) {
        break;
      } else {
        ++at_;
      }
    }
    content = since(from);
    if (copied != from) content = buffer.append(copied, at_);
    at_ += three ? 3 : 1;
    return true;
  }

  /// ECHAR or UCHAR at the backslash, appended to `out`.
  bool string_escape(std::string& out) {
    switch (peek(1)) {
      case 'u':
      case 'U': return numeric_escape(out);
      case 't': out += '\t'; break;
      case 'b': out += '\b'; break;
      case 'n': out += '\n'; break;
      case 'r': out += '\r'; break;
      case 'f': out += '\f'; break;
      case '"':
      case '\'':
      case '\\': out += peek(1); break;
      default: return expected("an escape sequence", at_);
    }
    at_ += 2;
    return true;
  }

  /// LANGTAG at the '@'.
  bool language_tag(std::string_view& tag) {
    const char* const from = at_++;
    if (!terminal::is_alpha(peek())) return expected("a language tag", from);
    while (terminal::is_alpha(peek())) ++at_;
    while (peek() == '-') {
      ++at_;
      if (!terminal::is_alpha(peek()) && !terminal::is_digit(peek())) return expected("a language tag", from);
      while (terminal::is_alpha(peek()) || terminal::is_digit(peek())) ++at_;
    }
    tag = since(from + 1);
    return tag.size() <= max_language_tag || fail(from, "language tag of more than " + std::to_string(max_language_tag) + " bytes");
  }

  /// The end of the character at `at` if it is beyond ASCII and in PN_CHARS_BASE (`first`) or PN_CHARS; otherwise `at`.
  const char* wide_name_character(const char* at, bool first) const noexcept {
    if (at == end_ || terminal::is_ascii(*at)) return at;
    std::size_t length = 0;
    const char32_t code = utf8::decode({at, static_cast<std::size_t>(end_ - at)}, length);
    return terminal::within(code, terminal::name_letters) || (!first && terminal::within(code, terminal::name_marks)) ? at + length : at;
  }
  /// The end of the run of PN_CHARS and '.' at `at`.
  const char* name_end(const char* at) const noexcept {
    for (;;) {
      while (at != end_ && (terminal::is(*at, terminal::name) || *at == '.')) ++at;
      const char* const next = wide_name_character(at, false);
      if (next == at) return at;
      at = next;
    }
  }

  /// BLANK_NODE_LABEL at the '_'. `label` is what follows "_:".
  bool blank_label(std::string_view& label) {
    const char* const from = at_;
    const char c = peek(2);
    const bool ascii = terminal::is(c, terminal::name_start) || terminal::is_digit(c) || c == '_';
    const char* const start = peek(1) == ':' ? from + 2 : nullptr;
    const char* const first_end = start == nullptr ? start : ascii ? start + 1 : wide_name_character(start, true);
    if (first_end == start) return expected("a blank node label", from);
    at_ = name_end(first_end);
    while (at_[-1] == '.') --at_;
    label = since(start);
    return true;
  }

  /// The ':' after an optional PN_PREFIX at this place; nullptr: there is none.
  const char* prefix_end() const noexcept {
    const char* p = at_;
    if (p != end_ && *p != ':') {
      p = terminal::is(*p, terminal::name_start) ? p + 1 : wide_name_character(p, true);
      if (p == at_) return nullptr;
      p = name_end(p);
      if (p[-1] == '.') return nullptr;
    }
    return p != end_ && *p == ':' ? p : nullptr;
  }

  /// PN_LOCAL or nothing, without its backslashes.
  bool append_local_name(std::string& out, bool& plain) {
    const char* const from = at_;
    const char* copied = from;  // up to here `out` has the name
    const char* last = from;    // the end of what may end it: no '.'
    for (const char* p = from;;) {
      const char c = p != end_ ? *p : '\0';
      const std::ptrdiff_t left = end_ - p;
      if (c == ':' || (terminal::is(c, terminal::name) && (p != from || c != '-'))) {
        last = ++p;
      } else if (c == '.' && p != from) {
        ++p;
      } else if (c == '%' || (c == '\\' && left > 1 && p[1] == '%')) {
        const char* const digits = c == '%' ? p + 1 : p + 2;
        if (end_ - digits < 2 || !lrt::detail::is(digits[0], lrt::detail::hex) || !lrt::detail::is(digits[1], lrt::detail::hex)) {
          return expected("two hexadecimal digits behind '%'", p);
        }
        if (c == '\\') {
          out.append(copied, p);
          copied = p + 1;
        }
        last = p = digits + (c == '%' ? 2 : 0);
      } else if (c == '\\') {
        if (left < 2 || !lrt::detail::contains("_~.-!$&'()*+,;=/?#@", p[1])) return expected("an escape sequence", p);
        out.append(copied, p);
        copied = p + 1;
        last = p += 2;
      } else {
        const char* const next = wide_name_character(p, p == from);
        if (next == p) break;
        plain = false;
        last = p = next;
      }
    }
    out.append(copied, last);
    at_ = last;
    return true;
  }

  /// INTEGER, DECIMAL or DOUBLE without its sign, the longest one at this place. False without an error: there is no number.
  bool unsigned_number(Iri& datatype) noexcept {
    const auto digits = [this] {
      const char* const first = at_;
      while (terminal::is_digit(peek())) ++at_;
      return at_ != first;
    };
    const auto exponent_at = [this](std::ptrdiff_t ahead) {
      if (peek(ahead) != 'e' && peek(ahead) != 'E') return false;
      const char sign = peek(ahead + 1);
      return terminal::is_digit(sign) || ((sign == '+' || sign == '-') && terminal::is_digit(peek(ahead + 2)));
    };
    datatype = vocab::xsd::integer;
    bool any = digits();
    if (peek() == '.' && (terminal::is_digit(peek(1)) || (any && exponent_at(1)))) {
      ++at_;
      any = digits() || any;
      datatype = vocab::xsd::decimal;
    }
    if (!any) return false;
    if (exponent_at(0)) {
      at_ += 2;
      digits();
      datatype = vocab::xsd::double_;
    }
    return true;
  }

  const std::string_view text_;
  const char* at_;
  const char* const end_;

  std::string error_;
  const char* error_at_ = nullptr;
  Errc error_code_ = Errc::expected_rdf;

 private:
  /// The text at a position, for messages: printable, short, well-formed.
  std::string found(const char* at) const {
    if (at >= end_) return "the end of the text";
    const char* const until = at + std::min<std::ptrdiff_t>(end_ - at, 24);
    const char* p = at;
    while (p != until && *p >= ' ' && *p < 0x7F && !(p != at && *p == ' ')) ++p;
    if (p != at) return "\"" + std::string(at, p) + "\"";
    char byte[8];
    std::snprintf(byte, sizeof byte, "%02X", static_cast<unsigned>(static_cast<unsigned char>(*at)));
    return "byte 0x" + std::string(byte);
  }
};

}  // namespace lrt::rdf

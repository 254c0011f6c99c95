#include "src/rdf/turtle_scan.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include <lrt/base/iri.hpp>
#include <lrt/base/utf8.hpp>

#include "src/base/ascii.hpp"

namespace lrt::rdf {
namespace {

using detail::is_alpha;
using detail::is_digit;
constexpr std::size_t npos = std::string_view::npos;

struct Range {
  char32_t from, to;
};
/// PN_CHARS_BASE beyond ASCII (Turtle 6.5).
constexpr Range name_letters[] = {{0xC0, 0xD6},     {0xD8, 0xF6},     {0xF8, 0x2FF},    {0x370, 0x37D},
                                  {0x37F, 0x1FFF},  {0x200C, 0x200D}, {0x2070, 0x218F}, {0x2C00, 0x2FEF},
                                  {0x3001, 0xD7FF}, {0xF900, 0xFDCF}, {0xFDF0, 0xFFFD}, {0x10000, 0xEFFFF}};
/// What PN_CHARS adds to them.
constexpr Range name_marks[] = {{0xB7, 0xB7}, {0x300, 0x36F}, {0x203F, 0x2040}};

template <std::size_t n>
bool within(char32_t c, const Range (&ranges)[n]) noexcept {
  return std::any_of(ranges, ranges + n, [c](const Range& r) { return c >= r.from && c <= r.to; });
}

constexpr bool is_space(char c) noexcept { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

/// What stands at a place, for messages: printable, short, well-formed.
std::string found(std::string_view text, std::size_t at) {
  if (at >= text.size()) return "the end of the text";
  const std::size_t length = std::min<std::size_t>(text.size() - at, 24);
  std::string out = "\"";
  std::size_t i = at;
  while (i < at + length && text[i] >= ' ' && text[i] < 0x7F && !(i > at && text[i] == ' ')) out += text[i++];
  if (i > at) return out + "\"";
  char byte[8];
  std::snprintf(byte, sizeof byte, "%02X", static_cast<unsigned>(static_cast<unsigned char>(text[at])));
  return "byte 0x" + std::string(byte);
}

/// The terminals that both languages share. A function returns false after it has set the fault.
class Scanner {
 public:
  explicit Scanner(std::string_view text) : text_(text) {}

 protected:
  bool fail(std::size_t at, std::string sentence) {
    fault_at_ = at;
    fault_ = std::move(sentence);
    return false;
  }
  bool exceeds(std::size_t at, std::string sentence) {
    fault_code_ = Errc::limit_exceeded;
    return fail(at, std::move(sentence));
  }
  bool expected(const char* what, std::size_t at) {
    return fail(at, std::string("expected ") + what + ", found " + found(text_, at));
  }
  bool refused() const noexcept { return !fault_.empty(); }
  Unexpected fault() const { return misread(text_, fault_at_, fault_, fault_code_); }

  bool well_formed() {
    if (const auto at = utf8::find_invalid(text_)) return fail(*at, "invalid UTF-8");
    if (const std::size_t at = text_.find('\0'); at != npos) return fail(at, "U+0000 is not accepted");
    return true;
  }

  char peek(std::size_t ahead = 0) const noexcept { return at_ + ahead < text_.size() ? text_[at_ + ahead] : '\0'; }
  bool end() const noexcept { return at_ >= text_.size(); }
  void skip_comment() { at_ = std::min(text_.find_first_of("\n\r", at_), text_.size()); }

  /// `\uXXXX` or `\UXXXXXXXX` at the backslash; a scalar value other than U+0000.
  std::optional<char32_t> numeric_escape() {
    const std::size_t from = at_, digits = peek(1) == 'u' ? 4 : 8;
    char32_t value = 0;
    for (std::size_t i = 2; i < digits + 2; ++i) {
      if (!detail::is(peek(i), detail::hex)) {
        expected("a hexadecimal digit", from + i);
        return std::nullopt;
      }
      value = value * 16 + detail::hex_value(peek(i));
    }
    at_ += digits + 2;
    if (value == 0 || value > 0x10FFFF || (value >= 0xD800 && value <= 0xDFFF)) {
      fail(from, "escape of no acceptable character: " + std::string(text_.substr(from, digits + 2)));
      return std::nullopt;
    }
    return value;
  }

  /// IRIREF. The content is a view of the text, or of `buffer_` when it had escapes.
  bool iri_reference(std::string_view& content) {
    const std::size_t from = ++at_;
    std::size_t copied = from;
    buffer_.clear();
    for (;;) {
      const char c = peek();
      if (c == '>') break;
      if (c == '\\' && (peek(1) == 'u' || peek(1) == 'U')) {
        buffer_.append(text_, copied, at_ - copied);
        const auto value = numeric_escape();
        if (!value) return false;
        utf8::append(buffer_, *value);
        copied = at_;
      } else if (end()) {
        return fail(from - 1, "IRI without an end");
      } else if (static_cast<unsigned char>(c) < 0x80 && !detail::is(c, detail::uri)) {
        return expected("a character of an IRI", at_);
      } else {
        ++at_;
      }
    }
    if (copied == from) {
      content = text_.substr(from, at_ - from);
    } else {
      buffer_.append(text_, copied, at_ - copied);
      content = buffer_;
    }
    if (content.size() > max_iri) return too_long(from - 1);
    ++at_;
    return true;
  }
  bool too_long(std::size_t from) { return exceeds(from, "IRI of more than " + std::to_string(max_iri) + " bytes"); }

  /// A string after its opening quotes, up to and with its closing ones.
  /// @param rewritten  receives the text between the quotes if Raptor must not see it as it is: numeric escapes take it a time
  ///                   that grows with their square, quotes in a long string forty times that of other characters.
  bool string(char quote, bool three, std::string* rewritten = nullptr) {
    const std::size_t from = at_;
    std::size_t copied = from;
    const auto flush = [&](std::size_t until) {
      if (rewritten == nullptr) return;
      rewritten->append(text_, copied, until - copied);
      copied = at_;
    };
    for (;;) {
      const std::size_t next = text_.find_first_of(quote == '"' ? "\"\\\n\r" : "'\\\n\r", at_);
      if (next == npos) return fail(from, "string without an end");
      at_ = next;
      const char c = text_[at_];
      if (c == '\\') {
        const char kind = peek(1);
        if (kind == 'u' || kind == 'U') {
          const std::size_t escape = at_;
          const auto value = numeric_escape();
          if (!value) return false;
          flush(escape);
          if (rewritten != nullptr) append_in_string(*rewritten, *value);
        } else if (kind != '\0' && detail::contains("tbnrf\"'\\", kind)) {
          at_ += 2;
        } else {
          return expected("an escape sequence", at_);
        }
      } else if (c != quote) {
        if (!three) return fail(at_, "line end in a string");
        ++at_;
      } else if (!three || (peek(1) == quote && peek(2) == quote)) {
        if (copied != from) flush(at_);
        at_ += three ? 3 : 1;
        return true;
      } else {
        const std::size_t here = at_++;
        flush(here);
        if (rewritten != nullptr) *rewritten += {'\\', quote};
      }
    }
  }

  /// A character so that it stands for itself between any quotes.
  static void append_in_string(std::string& out, char32_t c) {
    switch (c) {
      case '"': out += "\\\""; break;
      case '\'': out += "\\'"; break;
      case '\\': out += "\\\\"; break;
      case '\n': out += "\\n"; break;
      case '\r': out += "\\r"; break;
      case '\t': out += "\\t"; break;
      case '\b': out += "\\b"; break;
      case '\f': out += "\\f"; break;
      default: utf8::append(out, c);
    }
  }

  /// LANGTAG at the '@'.
  bool language() {
    const std::size_t from = at_++;
    if (!is_alpha(peek())) return expected("a language tag", from);
    while (is_alpha(peek())) ++at_;
    while (peek() == '-') {
      ++at_;
      if (!is_alpha(peek()) && !is_digit(peek())) return expected("a language tag", from);
      while (is_alpha(peek()) || is_digit(peek())) ++at_;
    }
    if (at_ - from - 1 > max_language_tag) {
      return fail(from, "language tag of more than " + std::to_string(max_language_tag) + " bytes");
    }
    return true;
  }

  /// Takes one character of PN_CHARS_U (first) or PN_CHARS and '.' if there is one.
  bool name_character(bool first, bool digits_first) {
    const char c = peek();
    if (static_cast<unsigned char>(c) < 0x80) {
      if (is_alpha(c) || c == '_' || ((digits_first || !first) && is_digit(c)) || (!first && (c == '-' || c == '.'))) {
        ++at_;
        return true;
      }
      return false;
    }
    std::size_t after = at_;
    const char32_t code = utf8::decode(text_, after);
    if (!within(code, name_letters) && (first || !within(code, name_marks))) return false;
    at_ = after;
    return true;
  }

  /// BLANK_NODE_LABEL at the '_'.
  bool blank_label() {
    const std::size_t from = at_;
    at_ += 2;
    if (text_[from + 1 < text_.size() ? from + 1 : from] != ':' || !name_character(true, true)) {
      return expected("a blank node label", from);
    }
    while (name_character(false, true)) {}
    while (text_[at_ - 1] == '.') --at_;
    return true;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::string buffer_;

 private:
  Errc fault_code_ = Errc::expected_rdf;
  std::size_t fault_at_ = 0;
  std::string fault_;
};

/// A base with its parts ready, so that resolving costs no more than the copy of the result.
class Base {
 public:
  explicit Base(std::string_view base) { set(base); }
  bool empty() const noexcept { return whole_.empty(); }

  /// An absolute IRI or nothing.
  void set(std::string_view base) {
    whole_ = base;
    simple_ = false;
    if (whole_.empty()) return;
    const iri::Parts parts = iri::split(whole_);
    simple_ = parts.has_authority;
    if (!simple_) return;
    origin_ = parts.scheme.size() + 3 + parts.authority.size();
    path_ = origin_ + parts.path.size();
    query_ = whole_.find('#') == npos ? whole_.size() : whole_.find('#');
    directory_ = iri::resolve(whole_, "./").value();
  }

  /// iri::resolve (RFC 3986 5.2) for a reference that has no scheme; nothing if it is no reference.
  std::optional<std::string> resolve(std::string_view reference) const {
    if (!iri::is_reference(reference)) return std::nullopt;
    const iri::Parts r = iri::split(reference);
    if (!simple_ || r.has_scheme || r.has_authority) {
      Result<std::string> whole = iri::resolve(whole_, reference);
      if (!whole) return std::nullopt;
      return std::move(*whole);
    }
    const std::string_view whole = whole_;
    std::string out;
    if (r.path.empty()) {
      out = whole.substr(0, r.has_query ? path_ : query_);
    } else {
      const bool from_root = r.path.front() == '/';
      out = from_root ? whole.substr(0, origin_) : std::string_view(directory_);
      if (from_root) out += '/';
      append_segments(out, r.path.substr(from_root ? 1 : 0));
    }
    if (r.has_query) (out += '?') += r.query;
    if (r.has_fragment) (out += '#') += r.fragment;
    return out;
  }

  /// What resolving costs beyond its result, in bytes that count: Raptor must read the whole IRI, where it gets a prefixed name
  /// as it is, and a base without an authority is taken apart each time. Nothing for the bases that occur.
  std::size_t cost() const noexcept { return whole_.size() <= long_base ? 0 : (simple_ ? 4 : 16) * whole_.size(); }

 private:
  /// Appends segments behind a '/', without dots (RFC 3986 5.2.4).
  void append_segments(std::string& out, std::string_view path) const {
    for (;;) {
      const std::size_t slash = path.find('/');
      const std::string_view segment = path.substr(0, slash);
      if (segment == "..") {
        if (out.size() > origin_ + 1) out.resize(out.rfind('/', out.size() - 2) + 1);
      } else if (segment != ".") {
        out += segment;
        if (slash != npos) out += '/';
      }
      if (slash == npos) return;
      path.remove_prefix(slash + 1);
    }
  }

  std::string whole_, directory_;                  // the latter ends in '/', without dots
  std::size_t origin_ = 0, path_ = 0, query_ = 0;  // where these end in `whole_`
  bool simple_ = false;                            // has an authority, so that every path begins with '/'
};

class TurtleScanner : Scanner {
 public:
  TurtleScanner(std::string_view text, const ReadOptions& options, std::string& storage)
      : Scanner(text), base_(options.base), max_triples_(options.max_triples), max_bytes_(options.max_bytes), storage_(storage) {
    storage_.clear();
  }

  Result<std::string_view> scan() {
    if (well_formed()) {
      while (!end() && token()) {}
      if (!refused() && !open_.empty()) {
        const std::size_t at = open_.back().at;
        fail(at, std::string("'") + text_[at] + "' without an end");
      }
      if (!refused() && state_ != State::subject) expected(wanted(), at_);
    }
    if (refused()) return fault();
    if (copied_ == 0) return text_;
    storage_.append(text_, copied_, npos);
    return std::string_view(storage_);
  }

 private:
  /// What the grammar (Turtle 6.5) wants next.
  enum class State : std::uint8_t {
    subject,  // or a directive, or the end
    verb,
    verb_or_close,  // behind '['
    verb_or_dot,    // behind `[ ... ]` as subject
    verb_or_end,    // behind ';'
    object,
    after_object,
    item,  // of a collection, or ')'
    datatype,
    prefix,
    prefix_iri,
    base_iri,
    dot,  // behind @prefix or @base
  };
  struct Open {
    std::size_t at;  // the bracket
    State behind;    // the state behind its partner
  };

  const char* wanted() const noexcept {
    switch (state_) {
      case State::subject: return "a subject or a directive";
      case State::verb: return "a predicate";
      case State::verb_or_close: return "a predicate or ']'";
      case State::verb_or_dot: return "a predicate or '.'";
      case State::verb_or_end: return open_.empty() ? "a predicate, ';' or '.'" : "a predicate, ';' or ']'";
      case State::object: return "an object";
      case State::after_object: return open_.empty() ? "',', ';' or '.'" : "',', ';' or ']'";
      case State::item: return "an object or ')'";
      case State::datatype: return "a datatype IRI";
      case State::prefix: return "a prefix ending in ':'";
      case State::prefix_iri:
      case State::base_iri: return "an IRI in '<' and '>'";
      case State::dot: return "'.'";
    }
    return "";
  }
  bool unexpected_here(std::size_t at) { return expected(wanted(), at); }

  bool wants_verb() const noexcept {
    return state_ == State::verb || state_ == State::verb_or_close || state_ == State::verb_or_dot ||
           state_ == State::verb_or_end;
  }
  /// Counts triples as they are written.
  bool count_triples(std::size_t n, std::size_t from) {
    triples_ += n;
    return triples_ <= max_triples_ || exceeds(from, "more than " + std::to_string(max_triples_) + " triples");
  }
  /// Counts bytes of terms as they are when written out.
  bool count_bytes(std::size_t n, std::size_t from) {
    bytes_ += n;
    return bytes_ <= max_bytes_ ||
           exceeds(from, "IRIs and literals of more than " + std::to_string(max_bytes_) + " bytes when written out");
  }
  bool count_directive(std::size_t from) {
    return ++directives_ <= max_directives ||
           exceeds(from, "more than " + std::to_string(max_directives) + " prefix and base directives");
  }

  enum class Kind : std::uint8_t { iri, blank, literal };
  /// A term of the kind that began at `from`.
  bool take(Kind kind, std::size_t from) {
    if (kind == Kind::iri && state_ == State::datatype) {
      state_ = behind_literal_;
    } else if (kind == Kind::iri && wants_verb()) {
      state_ = State::object;
    } else if (state_ == State::subject && kind != Kind::literal) {
      state_ = State::verb;
    } else if (state_ == State::object) {
      state_ = State::after_object;
      return count_triples(1, from);
    } else if (state_ == State::item) {
      return count_triples(2, from);
    } else {
      return unexpected_here(from);
    }
    return true;
  }

  bool open_bracket(char c) {
    State behind = State::verb;
    if (state_ == State::object) behind = State::after_object;
    else if (state_ == State::item) behind = State::item;
    else if (state_ != State::subject) return unexpected_here(at_);
    if (open_.size() >= max_brackets) return fail(at_, "brackets nested more than " + std::to_string(max_brackets) + " deep");
    const std::size_t triples = state_ == State::object ? 1 : state_ == State::item ? 2 : 0;
    if (!count_triples(triples, at_)) return false;
    open_.push_back({at_++, behind});
    state_ = c == '[' ? State::verb_or_close : State::item;
    return true;
  }
  bool close_bracket(char c) {
    const bool ends = c == ')'
                          ? state_ == State::item
                          : state_ == State::verb_or_close || state_ == State::verb_or_end || state_ == State::after_object;
    if (open_.empty() || text_[open_.back().at] != (c == ']' ? '[' : '(') || !ends) return unexpected_here(at_);
    const bool sentence = c == ']' && state_ != State::verb_or_close;
    state_ = open_.back().behind;
    if (sentence && state_ == State::verb) state_ = State::verb_or_dot;
    open_.pop_back();
    ++at_;
    return true;
  }
  bool punctuation(char c) {
    const bool after_object = state_ == State::after_object;
    if (c == ',' && after_object) state_ = State::object;
    else if (c == ';' && (after_object || state_ == State::verb_or_end)) state_ = State::verb_or_end;
    else if (c == '.' && open_.empty() &&
             (after_object || state_ == State::verb_or_end || state_ == State::verb_or_dot || state_ == State::dot)) {
      state_ = State::subject;
    } else {
      return unexpected_here(at_);
    }
    ++at_;
    return true;
  }

  bool token() {
    const char c = peek();
    if (is_space(c)) {
      ++at_;
      return true;
    }
    if (c == '#') {
      skip_comment();
      return true;
    }
    if (state_ == State::prefix) return prefix_declared();
    if (state_ == State::prefix_iri || state_ == State::base_iri) return c == '<' ? iri_token() : unexpected_here(at_);
    if (std::exchange(after_string_, false)) {
      if (c == '@') return language();
      if (c == '^' && peek(1) == '^') {
        behind_literal_ = std::exchange(state_, State::datatype);
        at_ += 2;
        return true;
      }
    }
    const std::size_t from = at_;
    switch (c) {
      case '<': return iri_token();
      case '"':
      case '\'': return take(Kind::literal, from) && string_token(c);
      case '@': return directive();
      case '_': return take(Kind::blank, from) && blank_label();
      case '[':
      case '(': return open_bracket(c);
      case ']':
      case ')': return close_bracket(c);
      case '.': return is_digit(peek(1)) && state_ != State::after_object ? number() : punctuation(c);
      case ',':
      case ';': return punctuation(c);
      case '+':
      case '-': return number();
      default: return is_digit(c) ? number() : word();
    }
  }

  bool number() {
    const std::size_t from = at_;
    if (!take(Kind::literal, from)) return false;
    if (peek() == '+' || peek() == '-') ++at_;
    std::size_t digits = 0;
    while (is_digit(peek())) ++at_, ++digits;
    const auto exponent = [this](std::size_t ahead) {
      if (peek(ahead) != 'e' && peek(ahead) != 'E') return false;
      return is_digit(peek(ahead + 1)) || ((peek(ahead + 1) == '+' || peek(ahead + 1) == '-') && is_digit(peek(ahead + 2)));
    };
    if (peek() == '.' && (is_digit(peek(1)) || (digits != 0 && exponent(1)))) {
      ++at_;
      while (is_digit(peek())) ++at_, ++digits;
    }
    if (digits == 0) return expected("a number", from);
    if (exponent(0)) {
      at_ += 2;
      while (is_digit(peek())) ++at_;
    }
    return true;
  }

  bool string_token(char quote) {
    const bool three = peek(1) == quote && peek(2) == quote;
    at_ += three ? 3 : 1;
    after_string_ = true;
    const std::size_t from = at_;
    rewritten_.clear();
    if (!string(quote, three, &rewritten_)) return false;
    const std::size_t end = at_ - (three ? 3 : 1);
    if (!rewritten_.empty()) {
      storage_.append(text_, copied_, from - copied_);
      storage_ += rewritten_;
      copied_ = end;
    }
    return count_bytes(rewritten_.empty() ? end - from : rewritten_.size(), from);
  }

  bool directive() {
    const auto starts = [this](std::string_view word) {
      const std::string_view rest = text_.substr(at_ + 1, word.size());
      return rest == word && !is_alpha(peek(1 + word.size()));
    };
    if (state_ != State::subject) return unexpected_here(at_);
    if (!count_directive(at_)) return false;
    if (starts("prefix")) {
      state_ = State::prefix;
      at_ += 7;
    } else if (starts("base")) {
      state_ = State::base_iri;
      at_ += 5;
    } else {
      return expected("@prefix or @base", at_);
    }
    behind_directive_ = State::dot;
    return true;
  }

  /// PNAME_NS in a declaration.
  bool prefix_declared() {
    const std::size_t from = at_;
    if (!prefix_name()) return unexpected_here(from);
    declaring_ = text_.substr(from, at_ - from);
    ++at_;
    if (name_character(true, true) || peek() == ':' || peek() == '%' || peek() == '\\') return unexpected_here(from);
    state_ = State::prefix_iri;
    return true;
  }

  /// PN_PREFIX or nothing, before a ':', which stays.
  bool prefix_name() {
    if (name_character(true, false)) {
      if (text_[at_ - 1] == '_') return false;
      while (name_character(false, false)) {}
      if (text_[at_ - 1] == '.') return false;
    }
    return peek() == ':';
  }

  bool word() {
    const std::size_t from = at_;
    if (!prefix_name()) {
      const std::string_view read = text_.substr(from, at_ - from);
      if (state_ == State::subject && (detail::iequals_ascii(read, "prefix") || detail::iequals_ascii(read, "base"))) {
        state_ = read.size() == 4 ? State::base_iri : State::prefix;
        behind_directive_ = State::subject;
        return count_directive(from);
      }
      if (read == "a" && wants_verb()) {
        state_ = State::object;
        return true;
      }
      for (const std::string_view known : {"true", "false"}) {  // a '.' right behind ends the statement
        if (read.substr(0, known.size()) == known && read.find_first_not_of('.', known.size()) == npos) {
          at_ = from + known.size();
          return take(Kind::literal, from);
        }
      }
      return unexpected_here(from);
    }
    const std::string_view prefix = text_.substr(from, at_ - from);
    const auto declared = prefixes_.find(prefix);
    if (declared == prefixes_.end()) {
      return fail(from, prefix.size() > 64 ? "undeclared prefix" : "undeclared prefix \"" + std::string(prefix) + ":\"");
    }
    ++at_;
    const std::size_t local = at_;
    if (!take(Kind::iri, from) || !local_name()) return false;
    const std::size_t length = declared->second + (at_ - local) - escapes_;
    return length <= max_iri ? count_bytes(length, from) : too_long(from);
  }

  /// PN_LOCAL or nothing.
  bool local_name() {
    std::size_t last = at_;  // behind the last character that may end it
    escapes_ = 0;
    for (bool first = true;; first = false) {
      const char c = peek();
      if (c == '%') {
        if (!detail::is(peek(1), detail::hex) || !detail::is(peek(2), detail::hex))
          return expected("two hexadecimal digits behind '%'", at_);
        at_ += 3;
      } else if (c == '\\') {
        const char escaped = peek(1);
        if (escaped == '\0' || !detail::contains("_~.-!$&'()*+,;=/?#@%", escaped)) return expected("an escape sequence", at_);
        if (escaped == '%' && (!detail::is(peek(2), detail::hex) || !detail::is(peek(3), detail::hex))) {
          return expected("two hexadecimal digits behind '%'", at_);
        }
        at_ += 2;
        ++escapes_;
      } else if (c == ':') {
        ++at_;
      } else if (!name_character(first, true)) {
        break;
      } else if (c == '.') {
        continue;
      }
      last = at_;
    }
    at_ = last;
    return true;
  }

  bool iri_token() {
    const std::size_t from = at_;
    std::string_view reference;
    if (!iri_reference(reference)) return false;
    std::string resolved;
    std::size_t cost = 0;
    if (!iri::is_absolute(reference)) {
      if (base_.empty()) return fail(from, "relative IRI <" + std::string(reference) + "> and no base");
      std::optional<std::string> whole = base_.resolve(reference);
      if (!whole) return fail(from, "expected an IRI, found <" + std::string(reference) + ">");
      resolved = std::move(*whole);
      reference = resolved;
      cost = base_.cost();
      if (reference.size() > max_iri) return too_long(from);
    }
    if (!count_bytes(reference.size() + cost, from)) return false;
    const auto next_dot = [&](std::size_t dot) {  // that begins a segment
      do dot = reference.find('.', dot + 1);
      while (dot != npos && reference[dot - 1] != '/' && reference[dot - 1] != ':');
      return dot;
    };
    const std::size_t first_dot = next_dot(0);
    if (first_dot != npos || reference.data() != text_.data() + from + 1) {
      storage_.append(text_, copied_, from - copied_);
      storage_.push_back('<');
      std::size_t done = 0;
      for (std::size_t dot = first_dot; dot != npos; dot = next_dot(dot)) {
        storage_.append(reference, done, dot - done).append(dot_guard);
        done = dot;
      }
      storage_.append(reference, done, npos).push_back('>');
      copied_ = at_;
    }
    if (state_ != State::prefix_iri && state_ != State::base_iri) return take(Kind::iri, from);
    if (state_ == State::prefix_iri) {
      prefixes_[declaring_] = reference.size();
    } else {
      base_.set(reference);
    }
    state_ = behind_directive_;
    return true;
  }

  Base base_;
  std::size_t max_triples_, max_bytes_;
  std::size_t triples_ = 0, bytes_ = 0, directives_ = 0;
  std::string& storage_;
  std::size_t copied_ = 0;  // up to here `storage_` has the text
  std::string rewritten_;
  std::unordered_map<std::string_view, std::size_t> prefixes_;  // name -> bytes of the IRI
  std::string_view declaring_;
  std::size_t escapes_ = 0;  // backslashes in the last local name
  std::vector<Open> open_;  // '[' and '('
  State state_ = State::subject, behind_directive_ = State::dot, behind_literal_ = State::after_object;
  bool after_string_ = false;  // an '@' now begins a language tag
};

class NTriplesScanner : Scanner {
 public:
  explicit NTriplesScanner(std::string_view text) : Scanner(text) {}

  Result<void> scan() {
    if (well_formed()) {
      while (!end() && line()) {}
    }
    if (refused()) return fault();
    return {};
  }

 private:
  void skip_blanks() {
    while (peek() == ' ' || peek() == '\t') ++at_;
  }

  bool line() {
    skip_blanks();
    if (!end() && peek() != '#' && peek() != '\n' && peek() != '\r') {
      if (!term("a subject", true, false)) return false;
      if (!term("a predicate", false, false)) return false;
      if (!term("an object", true, true)) return false;
      if (peek() != '.') return expected("'.'", at_);
      ++at_;
      skip_blanks();
    }
    if (peek() == '#') skip_comment();
    if (end()) return true;
    if (peek() != '\n' && peek() != '\r') return expected("the end of the line", at_);
    ++at_;
    return true;
  }

  bool term(const char* what, bool blank_allowed, bool literal_allowed) {
    const char c = peek();
    if (c == '<') {
      if (!absolute_iri()) return false;
    } else if (c == '_' && blank_allowed) {
      if (!blank_label()) return false;
    } else if (c == '"' && literal_allowed) {
      ++at_;
      if (!string('"', false)) return false;
      if (peek() == '@') {
        if (!language()) return false;
      } else if (peek() == '^' && peek(1) == '^') {
        at_ += 2;
        if (peek() != '<') return expected("an IRI in '<' and '>'", at_);
        if (!absolute_iri()) return false;
      }
    } else {
      return expected(what, at_);
    }
    skip_blanks();
    return true;
  }

  bool absolute_iri() {
    const std::size_t from = at_;
    std::string_view content;
    if (!iri_reference(content)) return false;
    return iri::is_absolute(content) || fail(from, "expected an absolute IRI, found <" + std::string(content) + ">");
  }
};

}  // namespace

Unexpected misread(std::string_view text, std::size_t offset, const std::string& sentence, Errc code) {
  Error error{code, {}};
  error.offset = offset;
  error.line = 1;
  std::size_t line_start = 0;
  for (std::size_t i = 0; i < offset && i < text.size(); ++i) {
    if (text[i] == '\n') {
      ++error.line;
      line_start = i + 1;
    }
  }
  error.column = static_cast<std::uint32_t>(offset - line_start + 1);
  error.message = "line " + std::to_string(error.line) + ", column " + std::to_string(error.column) + ": " + sentence;
  return unexpected(std::move(error));
}

Result<std::string_view> scan_turtle(std::string_view text, const ReadOptions& options, std::string& storage) {
  return TurtleScanner(text, options, storage).scan();
}

Result<void> scan_n_triples(std::string_view text) { return NTriplesScanner(text).scan(); }

}  // namespace lrt::rdf

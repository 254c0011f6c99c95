#include "src/rdf/turtle_parser.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include <lrt/base/iri.hpp>
#include <lrt/base/utf8.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/rdf/base_iri.hpp"
#include "src/rdf/hash.hpp"
#include "src/rdf/limits.hpp"

namespace lrt::rdf {
namespace {

using detail::is_alpha;
using detail::is_digit;

/// Classes of ASCII characters in the terminals of Turtle 6.5.
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
    if (detail::is(c, detail::uri) && c != '%') bits |= plain_iri;
    if (!detail::contains("\"'\\\n\r", c)) bits |= in_string;
    table[i] = static_cast<std::uint8_t>(bits);
  }
  return table;
}
constexpr std::array<std::uint8_t, 256> classes = make_classes();
constexpr bool is(char c, std::uint8_t mask) noexcept { return (classes[static_cast<unsigned char>(c)] & mask) != 0; }
constexpr bool is_ascii(char c) noexcept { return static_cast<unsigned char>(c) < 0x80; }

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

/// Values by names that are views of the document. Keyed by the process, so that a document cannot choose names that collide.
template <class T>
class Names {
 public:
  T* find(std::string_view name) noexcept {
    if (last_ < entries_.size() && entries_[last_].first == name) return &entries_[last_].second;
    const std::uint32_t at = index_.find(hash(name), [&](std::uint32_t i) { return entries_[i].first == name; });
    if (at == lrt::detail::HashIndex::none) return nullptr;
    last_ = at;
    return &entries_[at].second;
  }
  /// @pre  find(name) is nullptr
  T& add(std::string_view name, T value) {
    index_.insert(hash(name), static_cast<std::uint32_t>(entries_.size()));
    return entries_.emplace_back(name, std::move(value)).second;
  }

 private:
  static std::uint32_t hash(std::string_view name) noexcept { return to_32_bits(hash_bytes(name, hash_seeds().bytes)); }
  std::vector<std::pair<std::string_view, T>> entries_;
  lrt::detail::HashIndex index_;
  std::size_t last_ = 0;  // found
};

/// True if an IRI begins with a scheme and ':' (RFC 3986 3.1).
bool has_scheme(std::string_view iri) noexcept {
  std::size_t i = 0;
  if (iri.empty() || !is_alpha(iri[0])) return false;
  while (i < iri.size() && detail::is(iri[i], detail::scheme)) ++i;
  return i < iri.size() && iri[i] == ':';
}

constexpr TermId none{0xFFFFFFFF};

/// The terminals that Turtle and N-Triples share, over a text of well-formed UTF-8. A function that returns bool returns false
/// after it has set the error.
class Terminals {
 protected:
  explicit Terminals(std::string_view text) : text_(text), at_(text.data()), end_(text.data() + text.size()) {}

  bool fail(const char* at, std::string sentence, Errc code = Errc::expected_rdf) {
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
    return !at || fail(text_.data() + *at, "invalid UTF-8");
  }

  bool end() const noexcept { return at_ == end_; }
  /// The character ahead, or U+0000 at the end of the text.
  char peek() const noexcept { return at_ != end_ ? *at_ : '\0'; }
  char peek(std::ptrdiff_t ahead) const noexcept { return end_ - at_ > ahead ? at_[ahead] : '\0'; }
  std::string_view since(const char* from) const noexcept { return {from, static_cast<std::size_t>(at_ - from)}; }

  /// White space and comments.
  void skip_space() noexcept {
    for (;;) {
      while (at_ != end_ && is(*at_, space)) ++at_;
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
      if (!detail::is(peek(i), detail::hex)) return expected("a hexadecimal digit", from + std::min(i, end_ - from));
      value = value * 16 + detail::hex_value(peek(i));
    }
    at_ += length;
    if (value > 0x10FFFF || (value >= 0xD800 && value <= 0xDFFF)) {
      return fail(from, "escape of no acceptable character: " + std::string(since(from)));
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
      while (at_ != end_ && is(*at_, plain_iri)) ++at_;
      if (end()) return fail(from - 1, "IRI without an end");
      const char c = *at_;
      if (c == '>') break;
      plain = false;
      if (c == '\\' && (peek(1) == 'u' || peek(1) == 'U')) {
        if (copied == from) buffer.clear();
        buffer.append(copied, at_);
        if (!numeric_escape(buffer)) return false;
        copied = at_;
      } else if (is_ascii(c) && c != '%') {
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
      while (at_ != end_ && is(*at_, in_string)) ++at_;
      if (end()) return fail(from, "string without an end");
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
    if (!is_alpha(peek())) return expected("a language tag", from);
    while (is_alpha(peek())) ++at_;
    while (peek() == '-') {
      ++at_;
      if (!is_alpha(peek()) && !is_digit(peek())) return expected("a language tag", from);
      while (is_alpha(peek()) || is_digit(peek())) ++at_;
    }
    tag = since(from + 1);
    return tag.size() <= max_language_tag ||
           fail(from, "language tag of more than " + std::to_string(max_language_tag) + " bytes");
  }

  /// The end of the character at `at` if it is beyond ASCII and in PN_CHARS_BASE (`first`) or PN_CHARS; otherwise `at`.
  const char* wide_name_character(const char* at, bool first) const noexcept {
    if (at == end_ || is_ascii(*at)) return at;
    std::size_t length = 0;
    const char32_t code = utf8::decode({at, static_cast<std::size_t>(end_ - at)}, length);
    return within(code, name_letters) || (!first && within(code, name_marks)) ? at + length : at;
  }
  /// The end of the run of PN_CHARS and '.' at `at`.
  const char* name_end(const char* at) const noexcept {
    for (;;) {
      while (at != end_ && (is(*at, name) || *at == '.')) ++at;
      const char* const next = wide_name_character(at, false);
      if (next == at) return at;
      at = next;
    }
  }

  /// BLANK_NODE_LABEL at the '_'. `label` is what follows "_:".
  bool blank_label(std::string_view& label) {
    const char* const from = at_;
    const char c = peek(2);
    const bool ascii = is(c, name_start) || is_digit(c) || c == '_';
    const char* const start = peek(1) == ':' ? from + 2 : nullptr;
    const char* const first_end = start == nullptr ? start : ascii ? start + 1 : wide_name_character(start, true);
    if (first_end == start) return expected("a blank node label", from);
    at_ = name_end(first_end);
    while (at_[-1] == '.') --at_;
    label = since(start);
    return true;
  }

  const std::string_view text_;
  const char* at_;
  const char* const end_;

 private:
  /// What stands at a place, for messages: printable, short, well-formed.
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

  std::string error_;
  const char* error_at_ = nullptr;
  Errc error_code_ = Errc::expected_rdf;
};

/// Builds the graph of a document, in either language.
class Parser : Terminals {
 public:
  Parser(std::string_view text, const ReadOptions& options)
      : Terminals(text), base_(options.base), max_triples_(options.max_triples), max_bytes_(options.max_bytes) {}

  Result<Graph> turtle() {
    if (well_formed()) {
      for (skip_space(); !end() && token(); skip_space()) {}
      if (!failed() && !open_.empty()) fail(open_.back().at, std::string("'") + *open_.back().at + "' without an end");
      if (!failed() && state_ != State::subject) expected(wanted(), at_);
    }
    return result();
  }

  Result<Graph> n_triples() {
    is_n_triples_ = true;
    if (well_formed()) {
      while (!end() && line()) {}
    }
    return result();
  }

 private:
  /// What the grammar of Turtle wants next.
  enum class State : std::uint8_t {
    subject,  // or a directive, or the end
    verb,
    verb_or_close,  // behind '['
    verb_or_dot,    // behind `[ ... ]` as subject
    verb_or_end,    // behind ';'
    object,
    after_object,
    item,  // of a list, or ')'
  };
  enum class Kind : std::uint8_t { iri, blank, literal };
  /// A '[' or '(' without its partner yet.
  struct Open {
    const char* at;
    State state;                // before it: subject, object or item
    TermId subject, predicate;  // before it; what stands in the brackets becomes the subject if `state` is subject
    TermId cell;                // '(': the last cell of the list, or none
  };

  Result<Graph> result() {
    if (failed()) return error();
    return std::move(graph_);
  }

  // --- limits

  /// Counts triples as they are written.
  bool count_triples(std::size_t n, const char* from) {
    triples_ += n;
    return triples_ <= max_triples_ || exceeds(from, "more than " + std::to_string(max_triples_) + " triples");
  }
  /// Counts bytes of terms as they are when written out.
  bool count_bytes(std::size_t n, const char* from) {
    bytes_ += n;
    return bytes_ <= max_bytes_ ||
           exceeds(from, "IRIs and literals of more than " + std::to_string(max_bytes_) + " bytes when written out");
  }
  bool count_directive(const char* from) {
    return ++directives_ <= max_directives ||
           exceeds(from, "more than " + std::to_string(max_directives) + " prefix and base directives");
  }

  // --- terms of both languages

  TermId labelled_blank(std::string_view label) {
    if (const TermId* const node = labels_.find(label)) return *node;
    return labels_.add(label, graph_.fresh_blank());
  }
  TermId known(TermId& id, Iri iri) {
    if (id == none) id = graph_.intern(iri);
    return id;
  }

  /// IRIREF as an absolute IRI. The view is valid until the next IRI is read.
  bool absolute_iri(std::string_view& iri) {
    const char* const from = at_;
    bool plain = false;
    if (!iri_reference(iri, plain, escaped_iri_)) return false;
    std::size_t cost = 0;
    if (!(plain ? has_scheme(iri) : iri::is_absolute(iri))) {
      if (is_n_triples_) return fail(from, "expected an absolute IRI, found <" + std::string(iri) + ">");
      if (base_.empty()) return fail(from, "relative IRI <" + std::string(iri) + "> and no base");
      if (!base_.resolve(iri, iri_)) return fail(from, "expected an IRI, found <" + std::string(iri) + ">");
      iri = iri_;
      cost = base_.cost();
      if (iri.size() > max_iri) return too_long(from);
    }
    return count_bytes(iri.size() + cost, from);
  }

  // --- N-Triples

  void skip_blanks() noexcept {
    while (peek() == ' ' || peek() == '\t') ++at_;
  }

  bool line() {
    skip_blanks();
    if (!end() && peek() != '#' && peek() != '\n' && peek() != '\r' && !triple()) return false;
    if (peek() == '#') skip_comment();
    if (end()) return true;
    if (peek() != '\n' && peek() != '\r') return expected("the end of the line", at_);
    ++at_;
    return true;
  }

  bool triple() {
    TermId object = none;
    if (!resource("a subject", true, subject_) || !resource("a predicate", false, predicate_)) return false;
    if (!count_triples(1, at_)) return false;
    if (peek() == '"' ? !plain_literal(object) : !resource("an object", true, object)) return false;
    graph_.add(subject_, predicate_, object);
    if (peek() != '.') return expected("'.'", at_);
    ++at_;
    skip_blanks();
    return true;
  }

  bool resource(const char* what, bool blank_allowed, TermId& id) {
    std::string_view text;
    if (peek() == '<') {
      if (!absolute_iri(text)) return false;
      id = graph_.intern(rdf::iri(text));
    } else if (peek() == '_' && blank_allowed) {
      if (!blank_label(text)) return false;
      id = labelled_blank(text);
    } else {
      return expected(what, at_);
    }
    skip_blanks();
    return true;
  }

  bool plain_literal(TermId& id) {
    const char* const from = at_;
    std::string_view text, iri, tag;
    if (!string(false, text, string_) || !count_bytes(text.size(), from)) return false;
    if (peek() == '@') {
      if (!language_tag(tag)) return false;
    } else if (peek() == '^' && peek(1) == '^') {
      at_ += 2;
      if (peek() != '<') return expected("an IRI in '<' and '>'", at_);
      if (!absolute_iri(iri)) return false;
    }
    id = graph_.intern({TermKind::literal, text, iri, tag});
    skip_blanks();
    return true;
  }

  // --- Turtle: statements

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
    }
    return "";
  }
  bool unexpected_here(const char* at) { return expected(wanted(), at); }
  bool wants_verb() const noexcept {
    return state_ == State::verb || state_ == State::verb_or_close || state_ == State::verb_or_dot ||
           state_ == State::verb_or_end;
  }

  bool token() {
    const char c = *at_;
    switch (c) {
      case '<': {
        const char* const from = at_;
        std::string_view iri;
        if (!admit(Kind::iri, from) || !absolute_iri(iri)) return false;
        return place(graph_.intern(rdf::iri(iri)));
      }
      case '"':
      case '\'': return literal();
      case '@': return directive();
      case '_': {
        std::string_view label;
        return admit(Kind::blank, at_) && blank_label(label) && place(labelled_blank(label));
      }
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

  /// Whether a term of the kind may stand here. Counts the triples that it completes, and adds the cell of an item.
  bool admit(Kind kind, const char* from) {
    switch (state_) {
      case State::object: return count_triples(1, from);
      case State::item:
        if (!count_triples(2, from)) return false;
        subject_ = next_cell();
        predicate_ = known(first_, vocab::rdf_::first);
        return true;
      case State::subject: return kind != Kind::literal || unexpected_here(from);
      case State::after_object: return unexpected_here(from);
      default: return kind == Kind::iri || unexpected_here(from);
    }
  }

  /// Puts an admitted term into its place.
  bool place(TermId term) {
    switch (state_) {
      case State::subject:
        subject_ = term;
        state_ = State::verb;
        break;
      case State::object: state_ = State::after_object; [[fallthrough]];
      case State::item: graph_.add(subject_, predicate_, term); break;
      default: predicate_ = term; state_ = State::object;
    }
    return true;
  }

  TermId next_cell() {
    Open& list = open_.back();
    const TermId cell = graph_.fresh_blank();
    if (list.cell != none) {
      graph_.add(list.cell, known(rest_, vocab::rdf_::rest), cell);
    } else if (list.state == State::subject) {
      list.subject = cell;
    } else {
      graph_.add(list.subject, list.predicate, cell);
    }
    return list.cell = cell;
  }

  bool open_bracket(char c) {
    if (!admit(Kind::blank, at_)) return false;
    if (open_.size() >= max_brackets) return fail(at_, "brackets nested more than " + std::to_string(max_brackets) + " deep");
    open_.push_back({at_++, state_, subject_, predicate_, none});
    if (c == '(') {
      state_ = State::item;
      return true;
    }
    const TermId node = graph_.fresh_blank();
    place(node);
    subject_ = node;
    if (open_.back().state == State::subject) open_.back().subject = node;
    state_ = State::verb_or_close;
    return true;
  }

  bool close_bracket(char c) {
    const bool has_triples = state_ == State::verb_or_end || state_ == State::after_object;
    const bool complete = has_triples || state_ == State::verb_or_close || state_ == State::item;
    if (open_.empty() || *open_.back().at != (c == ']' ? '[' : '(') || !complete) return unexpected_here(at_);
    ++at_;
    Open open = open_.back();
    open_.pop_back();
    if (c == ')') {
      const TermId nil = known(nil_, vocab::rdf_::nil);
      if (open.cell != none) graph_.add(open.cell, known(rest_, vocab::rdf_::rest), nil);
      else if (open.state == State::subject) open.subject = nil;
      else graph_.add(open.subject, open.predicate, nil);
    }
    subject_ = open.subject;
    predicate_ = open.predicate;
    state_ = open.state == State::item     ? State::item
             : open.state == State::object ? State::after_object
             : has_triples                 ? State::verb_or_dot
                                           : State::verb;
    return true;
  }

  bool punctuation(char c) {
    const bool after_object = state_ == State::after_object;
    if (c == ',' && after_object) {
      state_ = State::object;
    } else if (c == ';' && (after_object || state_ == State::verb_or_end)) {
      state_ = State::verb_or_end;
    } else if (c == '.' && open_.empty() && (after_object || state_ == State::verb_or_end || state_ == State::verb_or_dot)) {
      state_ = State::subject;
    } else {
      return unexpected_here(at_);
    }
    ++at_;
    return true;
  }

  // --- Turtle: literals

  bool number() {
    const char* const from = at_;
    if (!admit(Kind::literal, from)) return false;
    if (peek() == '+' || peek() == '-') ++at_;
    const auto digits = [this] {
      const char* const first = at_;
      while (is_digit(peek())) ++at_;
      return at_ != first;
    };
    const auto exponent_at = [this](std::ptrdiff_t ahead) {
      if (peek(ahead) != 'e' && peek(ahead) != 'E') return false;
      const char sign = peek(ahead + 1);
      return is_digit(sign) || ((sign == '+' || sign == '-') && is_digit(peek(ahead + 2)));
    };
    Iri datatype = vocab::xsd::integer;
    bool any = digits();
    if (peek() == '.' && (is_digit(peek(1)) || (any && exponent_at(1)))) {
      ++at_;
      any = digits() || any;
      datatype = vocab::xsd::decimal;
    }
    if (!any) return expected("a number", from);
    if (exponent_at(0)) {
      at_ += 2;
      digits();
      datatype = vocab::xsd::double_;
    }
    return place(graph_.intern(rdf::literal(since(from), datatype)));
  }

  /// RDFLiteral at its opening quote.
  bool literal() {
    if (!admit(Kind::literal, at_)) return false;
    const bool three = peek(1) == *at_ && peek(2) == *at_;
    const char* const from = at_ + (three ? 3 : 1);
    std::string_view text, iri, tag;
    if (!string(three, text, string_) || !count_bytes(text.size(), from)) return false;
    skip_space();
    if (peek() == '@') {
      if (!language_tag(tag)) return false;
    } else if (peek() == '^' && peek(1) == '^') {
      at_ += 2;
      skip_space();
      if (!datatype(iri)) return false;
    }
    return place(graph_.intern({TermKind::literal, text, iri, tag}));
  }

  bool datatype(std::string_view& iri) {
    if (peek() == '<') return absolute_iri(iri);
    const char* const from = at_;
    const char* const colon = prefix_end();
    return colon != nullptr ? prefixed_name(colon, iri) : expected("a datatype IRI", from);
  }

  // --- Turtle: directives, names and keywords

  bool directive() {
    const char* const from = at_;
    if (state_ != State::subject) return unexpected_here(from);
    const char* const word_end = name_end(++at_);
    const std::string_view word(at_, static_cast<std::size_t>(word_end - at_));
    if (word != "prefix" && word != "base") return expected("@prefix or @base", from);
    at_ = word_end;
    if (!(word == "prefix" ? declare_prefix(from) : declare_base(from))) return false;
    skip_space();
    if (peek() != '.') return expected("'.'", at_);
    ++at_;
    return true;
  }

  /// PNAME_NS IRIREF
  bool declare_prefix(const char* directive) {
    if (!count_directive(directive)) return false;
    skip_space();
    const char* const from = at_;
    const char* const colon = prefix_end();
    if (colon == nullptr) return expected("a prefix ending in ':'", from);
    const std::string_view prefix(from, static_cast<std::size_t>(colon - from));
    at_ = colon + 1;
    std::string_view iri;
    if (!directive_iri(iri)) return false;
    if (std::string* const declared = prefixes_.find(prefix)) *declared = iri;
    else prefixes_.add(prefix, std::string(iri));
    return true;
  }

  bool declare_base(const char* directive) {
    std::string_view iri;
    if (!count_directive(directive) || !directive_iri(iri)) return false;
    base_.set(iri);
    return true;
  }

  bool directive_iri(std::string_view& iri) {
    skip_space();
    return peek() == '<' ? absolute_iri(iri) : expected("an IRI in '<' and '>'", at_);
  }

  /// The ':' behind PN_PREFIX or nothing at this place; nullptr if there is none.
  const char* prefix_end() const noexcept {
    const char* p = at_;
    if (p != end_ && *p != ':') {
      p = is(*p, name_start) ? p + 1 : wide_name_character(p, true);
      if (p == at_) return nullptr;
      p = name_end(p);
      if (p[-1] == '.') return nullptr;
    }
    return p != end_ && *p == ':' ? p : nullptr;
  }

  bool word() {
    const char* const from = at_;
    std::string_view iri;
    if (const char* const colon = prefix_end()) {
      if (!admit(Kind::iri, from) || !prefixed_name(colon, iri)) return false;
      return place(graph_.intern(rdf::iri(iri)));
    }
    const char* const word_end = name_end(at_);
    const std::string_view read(from, static_cast<std::size_t>(word_end - from));
    if (read == "a" && wants_verb()) {
      at_ = word_end;
      return place(known(type_, vocab::rdf_::type));
    }
    if (state_ == State::subject && detail::iequals_ascii(read, "prefix")) {
      at_ = word_end;
      return declare_prefix(from);
    }
    if (state_ == State::subject && detail::iequals_ascii(read, "base")) {
      at_ = word_end;
      return declare_base(from);
    }
    for (const std::string_view value : {"true", "false"}) {  // a '.' right behind ends the statement
      if (read.substr(0, value.size()) != value || read.find_first_not_of('.', value.size()) != read.npos) continue;
      if (!admit(Kind::literal, from)) return false;
      at_ = from + value.size();
      return place(graph_.intern(rdf::literal(value, vocab::xsd::boolean)));
    }
    return unexpected_here(from);
  }

  /// PrefixedName whose prefix ends at `colon`, expanded. The view is valid until the next IRI is read.
  bool prefixed_name(const char* colon, std::string_view& iri) {
    const char* const from = at_;
    const std::string_view prefix(at_, static_cast<std::size_t>(colon - at_));
    const std::string* const declared = prefixes_.find(prefix);
    if (declared == nullptr) {
      return fail(from, prefix.size() > 64 ? "undeclared prefix" : "undeclared prefix \"" + std::string(prefix) + ":\"");
    }
    iri_ = *declared;
    at_ = colon + 1;
    bool plain = true;
    if (!append_local_name(iri_, plain)) return false;
    if (iri_.size() > max_iri) return too_long(from);
    if (!plain && !iri::is_absolute(iri_)) return fail(from, "expected an IRI, found <" + iri_ + ">");
    iri = iri_;
    return count_bytes(iri.size(), from);
  }

  /// PN_LOCAL or nothing, without its backslashes.
  bool append_local_name(std::string& out, bool& plain) {
    const char* const from = at_;
    const char* copied = from;  // up to here `out` has the name
    const char* last = from;    // the end of what may end it: no '.'
    for (const char* p = from;;) {
      const char c = p != end_ ? *p : '\0';
      const std::ptrdiff_t left = end_ - p;
      if (c == ':' || (is(c, name) && (p != from || c != '-'))) {
        last = ++p;
      } else if (c == '.' && p != from) {
        ++p;
      } else if (c == '%' || (c == '\\' && left > 1 && p[1] == '%')) {
        const char* const digits = c == '%' ? p + 1 : p + 2;
        if (end_ - digits < 2 || !detail::is(digits[0], detail::hex) || !detail::is(digits[1], detail::hex)) {
          return expected("two hexadecimal digits behind '%'", p);
        }
        if (c == '\\') {
          out.append(copied, p);
          copied = p + 1;
        }
        last = p = digits + (c == '%' ? 2 : 0);
      } else if (c == '\\') {
        if (left < 2 || !detail::contains("_~.-!$&'()*+,;=/?#@", p[1])) return expected("an escape sequence", p);
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

  Graph graph_;
  BaseIri base_;
  Names<std::string> prefixes_;
  Names<TermId> labels_;  // of blank nodes
  std::vector<Open> open_;
  State state_ = State::subject;
  bool is_n_triples_ = false;
  TermId subject_ = none, predicate_ = none;
  TermId type_ = none, first_ = none, rest_ = none, nil_ = none;
  std::string iri_, escaped_iri_, string_;  // terms that are not in the text as they are
  const std::size_t max_triples_, max_bytes_;
  std::size_t triples_ = 0, bytes_ = 0, directives_ = 0;
};

}  // namespace

Result<Graph> read_turtle(std::string_view text, const ReadOptions& options) { return Parser(text, options).turtle(); }

Result<Graph> read_n_triples(std::string_view text, const ReadOptions& options) { return Parser(text, options).n_triples(); }

}  // namespace lrt::rdf

// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/turtle_parser.hpp"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <lrt/base/iri.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/base/ascii.hpp"
#include "src/base/turns.hpp"
#include "src/rdf/base_iri.hpp"
#include "src/rdf/limits.hpp"
#include "src/rdf/n_triples.hpp"
#include "src/rdf/names.hpp"
#include "src/rdf/terminals.hpp"

namespace lrt::rdf {
namespace {

using lrt::detail::is_digit;
using terminal::has_scheme;

constexpr TermId no_term{0xFFFFFFFF};

/// Builds the graph of a document, in either language.
class Parser : Terminals {
 public:
  Parser(std::string_view text, const ReadOptions& options)
      : Terminals(text), base_(options.base), max_triples_(options.max_triples), max_bytes_(options.max_bytes) {}

  Result<Graph> turtle() {
    parse_turtle();
    return result();
  }

  Result<Dataset> trig() {
    is_trig_ = true;
    parse_turtle();
    return dataset();
  }

  Result<Dataset> n_quads() {
    is_n_quads_ = true;
    parse_lines();
    return dataset();
  }

  Result<Graph> n_triples(bool is_of_earlier_release = false) {
    is_of_earlier_release_ = is_of_earlier_release;
    parse_lines();
    return result();
  }

 private:
  void parse_turtle() {
    if (well_formed()) {
      for (skip_space(); !end() && token(); skip_space()) {}
      if (!failed() && !open_.empty()) fail(open_.back().at, std::string("'") + *open_.back().at + "' without an end");
      if (!failed() && state_ != State::subject) expected(wanted(), at_);
      if (!failed() && block_ != nullptr) fail(block_, "'{' without an end");
    }
  }

  /// The elements that the grammar of Turtle may expect next.
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
    TermId cell;                // '(': the last cell of the list, or no_term
  };

  Result<Graph> result() {
    if (failed()) return error();
    return std::move(graph_);
  }

  // --- named graphs

  /// The triples of a graph, with terms of graph_.
  struct Named {
    std::string name;
    std::vector<Triple> triples;
  };

  /// The graph into which triples go, by its name.
  void enter_graph(std::string_view name) {
    if (last_ < named_.size() && named_[last_].name == name) {
      current_ = last_;
      return;
    }
    auto known = graphs_.find(name);
    if (known == graphs_.end()) {
      known = graphs_.emplace(std::string(name), named_.size()).first;
      named_.push_back({known->first, {}});
    }
    current_ = last_ = known->second;
  }

  void add(TermId subject, TermId predicate, TermId object) {
    if (current_ == default_graph) graph_.add(subject, predicate, object);
    else named_[current_].triples.push_back({subject, predicate, object});
  }

  static Graph graph_of(const Graph& terms, const std::vector<Triple>& triples) {
    Graph made;
    std::vector<TermId> known(terms.term_count(), no_term);
    const auto mine = [&](TermId id) {
      TermId& same = known[static_cast<std::size_t>(id)];
      if (same == no_term) same = terms.term(id).is_blank() ? made.fresh_blank() : made.intern(terms.term(id));
      return same;
    };
    for (const Triple& t : triples) {
      const TermId s = mine(t.subject), p = mine(t.predicate), o = mine(t.object);
      made.add(s, p, o);
    }
    return made;
  }

  Result<Dataset> dataset() {
    if (failed()) return error();
    Dataset all;
    for (Named& named : named_) {
      all.named.emplace_back(std::move(named.name), graph_of(graph_, named.triples));
      named.triples = {};
    }
    all.default_graph = named_.empty() ? std::move(graph_) : graph_of(graph_, graph_.triples());
    return all;
  }

  /// '{' of TriG, behind the name of the graph, if it has one.
  bool open_block() {
    const bool is_default = state_ == State::subject, is_named = state_ == State::verb && is_label_;
    if (block_ != nullptr || !open_.empty() || !(is_default || is_named)) return unexpected_here(at_);
    if (is_named) {
      const TermView name = graph_.term(subject_);
      if (!name.is_iri()) return fail(at_, "expected an IRI as the name of the graph: a blank node is not supported", Errc::unsupported_syntax);
      enter_graph(std::string(name.text));
    }
    state_ = State::subject;
    block_ = at_++;
    return true;
  }

  bool close_block() {
    const bool is_complete =
        state_ == State::subject || state_ == State::after_object || state_ == State::verb_or_end || state_ == State::verb_or_dot;
    if (block_ == nullptr || !open_.empty() || !is_complete) return unexpected_here(at_);
    ++at_;
    block_ = nullptr;
    current_ = default_graph;
    state_ = State::subject;
    return true;
  }

  /// Behind the keyword GRAPH.
  bool graph_label() {
    skip_space();
    if (end() || (peek() != '<' && peek() != '_' && peek() != '[' && prefix_end() == nullptr)) return expected("the name of a graph", at_);
    if (!token()) return false;
    skip_space();
    if (peek() == ']' && !open_.empty()) {
      if (!token()) return false;
      skip_space();
    }
    return !end() && peek() == '{' ? open_block() : expected("'{'", at_);
  }

  void parse_lines() {
    is_n_triples_ = true;
    if (well_formed()) {
      while (!end() && line()) {}
    }
  }

  // --- limits

  /// Counts triples as they are written.
  bool count_triples(std::size_t n, const char* from) {
    triples_ += n;
    return triples_ <= next_look_ || look(from);
  }
  bool look(const char* from) {
    if (triples_ > max_triples_) return exceeds(from, "more than " + std::to_string(max_triples_) + " triples");
    Turns::rest_now();
    next_look_ = std::min(max_triples_, triples_ + Turns::units_between_rests);
    return true;
  }
  /// Counts bytes of terms as they are when written out.
  bool count_bytes(std::size_t n, const char* from) {
    bytes_ += n;
    return bytes_ <= max_bytes_ || exceeds(from, "IRIs and literals of more than " + std::to_string(max_bytes_) + " bytes when written out");
  }
  bool count_directive(const char* from) {
    return ++directives_ <= max_directives || exceeds(from, "more than " + std::to_string(max_directives) + " prefix and base directives");
  }

  // --- terms of both languages

  TermId labelled_blank(std::string_view label) {
    if (const TermId* const node = labels_.find(label)) return *node;
    return labels_.add(label, graph_.fresh_blank());
  }
  TermId known(TermId& id, Iri iri) {
    if (id == no_term) id = graph_.intern(iri);
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

  /// Whether a literal without a language may have the datatype (RDF 1.1 Concepts 3.3). In a document of an earlier release, which could
  /// have such a literal, the datatype is removed.
  bool is_possible_datatype(std::string_view& iri, const char* from) {
    if (iri != vocab::rdf_::langString.text) return true;
    if (!is_of_earlier_release_) return fail(from, std::string(no_language));
    iri = {};
    return true;
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
    TermId object = no_term;
    if (!resource("a subject", true, subject_) || !resource("a predicate", false, predicate_)) return false;
    if (!count_triples(1, at_)) return false;
    if (peek() == '"' ? !plain_literal(object) : !resource("an object", true, object)) return false;
    if (is_n_quads_ && !graph_name()) return false;
    add(subject_, predicate_, object);
    if (peek() != '.') return expected("'.'", at_);
    ++at_;
    skip_blanks();
    return true;
  }

  /// graphLabel of N-Quads, if there is one.
  bool graph_name() {
    current_ = default_graph;
    if (peek() == '_') return fail(at_, "expected an IRI as the name of the graph: a blank node is not supported", Errc::unsupported_syntax);
    if (peek() != '<') return true;
    std::string_view name;
    if (!absolute_iri(name)) return false;
    enter_graph(name);
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
    skip_blanks();
    if (peek() == '@') {
      if (!language_tag(tag)) return false;
    } else if (peek() == '^' && peek(1) == '^') {
      at_ += 2;
      skip_blanks();
      if (peek() != '<') return expected("an IRI in '<' and '>'", at_);
      const char* const type_at = at_;
      if (!absolute_iri(iri) || !is_possible_datatype(iri, type_at)) return false;
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
    return state_ == State::verb || state_ == State::verb_or_close || state_ == State::verb_or_dot || state_ == State::verb_or_end;
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
      case '{': return is_trig_ ? open_block() : unexpected_here(at_);
      case '}': return is_trig_ ? close_block() : unexpected_here(at_);
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
        is_label_ = true;
        break;
      case State::object: state_ = State::after_object; [[fallthrough]];
      case State::item: add(subject_, predicate_, term); break;
      default: predicate_ = term; state_ = State::object;
    }
    return true;
  }

  TermId next_cell() {
    Open& list = open_.back();
    const TermId cell = graph_.fresh_blank();
    if (list.cell != no_term) {
      add(list.cell, known(rest_, vocab::rdf_::rest), cell);
    } else if (list.state == State::subject) {
      list.subject = cell;
    } else {
      add(list.subject, list.predicate, cell);
    }
    return list.cell = cell;
  }

  bool open_bracket(char c) {
    if (!admit(Kind::blank, at_)) return false;
    if (open_.size() >= max_brackets) return fail(at_, "brackets nested more than " + std::to_string(max_brackets) + " deep");
    open_.push_back({at_++, state_, subject_, predicate_, no_term});
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
      if (open.cell != no_term) add(open.cell, known(rest_, vocab::rdf_::rest), nil);
      else if (open.state == State::subject) open.subject = nil;
      else add(open.subject, open.predicate, nil);
    }
    subject_ = open.subject;
    predicate_ = open.predicate;
    is_label_ = c == ']';  // with triples in it, a predicate or '.' follows
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
    Iri datatype;
    if (!unsigned_number(datatype)) return expected("a number", from);
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
      const char* const type_at = at_;
      if (!datatype(iri) || !is_possible_datatype(iri, type_at)) return false;
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
    if (state_ != State::subject || block_ != nullptr) return unexpected_here(from);
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
    const bool may_direct = state_ == State::subject && block_ == nullptr;
    if (is_trig_ && may_direct && lrt::detail::iequals_ascii(read, "graph")) {
      at_ = word_end;
      return graph_label();
    }
    if (may_direct && lrt::detail::iequals_ascii(read, "prefix")) {
      at_ = word_end;
      return declare_prefix(from);
    }
    if (may_direct && lrt::detail::iequals_ascii(read, "base")) {
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
    if (declared == nullptr) { return fail(from, prefix.size() > 64 ? "undeclared prefix" : "undeclared prefix \"" + std::string(prefix) + ":\""); }
    iri_ = *declared;
    at_ = colon + 1;
    bool plain = true;
    if (!append_local_name(iri_, plain)) return false;
    if (iri_.size() > max_iri) return too_long(from);
    if (!plain && !iri::is_absolute(iri_)) return fail(from, "expected an IRI, found <" + iri_ + ">");
    iri = iri_;
    return count_bytes(iri.size(), from);
  }

  Graph graph_;
  BaseIri base_;
  Names<std::string> prefixes_;
  Names<TermId> labels_;  // of blank nodes
  std::vector<Open> open_;
  State state_ = State::subject;
  bool is_n_triples_ = false, is_of_earlier_release_ = false, is_trig_ = false, is_n_quads_ = false;
  bool is_label_ = false;        // the subject may be the name of a graph
  const char* block_ = nullptr;  // '{' without its partner
  static constexpr std::size_t default_graph = static_cast<std::size_t>(-1);
  std::size_t current_ = default_graph;  // the graph that gets the triples: a place in named_
  std::size_t last_ = default_graph;     // the last one of named_ that got some
  std::vector<Named> named_;
  std::map<std::string, std::size_t, std::less<>> graphs_;  // places in named_
  TermId subject_ = no_term, predicate_ = no_term;
  TermId type_ = no_term, first_ = no_term, rest_ = no_term, nil_ = no_term;
  std::string iri_, escaped_iri_, string_;  // terms that are not in the text as they are
  const std::size_t max_triples_, max_bytes_;
  std::size_t triples_ = 0, bytes_ = 0, directives_ = 0;
  std::size_t next_look_ = std::min(max_triples_, Turns::units_between_rests);
};

}  // namespace

Result<Graph> read_turtle(std::string_view text, const ReadOptions& options) { return Parser(text, options).turtle(); }

Result<Graph> read_n_triples(std::string_view text, const ReadOptions& options) { return Parser(text, options).n_triples(); }

Result<Dataset> read_trig(std::string_view text, const ReadOptions& options) { return Parser(text, options).trig(); }

Result<Dataset> read_n_quads(std::string_view text, const ReadOptions& options) { return Parser(text, options).n_quads(); }

Result<Graph> read_kept_n_triples(std::string_view text, const ReadOptions& options) { return Parser(text, options).n_triples(true); }

}  // namespace lrt::rdf

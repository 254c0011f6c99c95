// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/update_data.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "src/base/ascii.hpp"
#include "src/base/utf8.hpp"
#include "src/rdf/limits.hpp"
#include "src/rdf/turtle_parser.hpp"

namespace lrt::rdf {
namespace {

bool is_space(char c) noexcept { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
bool is_word(char c) noexcept { return lrt::detail::is_alpha(c) || lrt::detail::is_digit(c) || c == '_'; }

std::string upper(std::string_view word) {
  std::string out(word);
  for (char& c : out)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return out;
}

/// Finds operations and their braces. The content of the braces and the prologue are read by the Turtle parser.
class Reader {
 public:
  Reader(std::string_view text, const ReadOptions& options) : text_(text), options_(options) {}

  Result<std::vector<DataUpdate>> run() {
    if (const auto bad = utf8::find_invalid(text_)) return misread(text_, *bad, utf8::fault_of(text_));
    turtle_.assign(text_.size(), ' ');
    at_ = text_.size() - utf8::without_mark(text_).size();
    turtle_.replace(0, at_, text_.substr(0, at_));
    for (std::size_t i = 0; i < text_.size(); ++i)
      if (text_[i] == '\n' || text_[i] == '\r') turtle_[i] = text_[i];  // so that positions are those in the request
    while (true) {
      if (!read_prologue()) return error();
      if (at_ == text_.size()) break;
      if (!read_operation()) return error();
      skip_space();
      if (at_ == text_.size()) break;
      if (text_[at_] != ';') {
        fail(at_, "expected ';' or the end after an operation");
        return error();
      }
      ++at_;
    }
    if (updates_.empty()) {
      fail(at_, "expected INSERT DATA or DELETE DATA, found the end");
      return error();
    }
    return std::move(updates_);
  }

 private:
  bool fail(std::size_t at, const std::string& sentence, Errc code = Errc::expected_rdf) {
    error_ = misread(text_, at, sentence, code).error;
    return false;
  }
  Unexpected error() { return Unexpected{*std::move(error_)}; }

  void skip_space() noexcept {
    while (at_ < text_.size()) {
      if (is_space(text_[at_])) ++at_;
      else if (text_[at_] == '#') skip_comment();
      else return;
    }
  }
  void skip_comment() noexcept {
    while (at_ < text_.size() && text_[at_] != '\n' && text_[at_] != '\r') ++at_;
  }
  /// The word at a place, in upper case.
  std::string word_at(std::size_t from) const {
    std::size_t end = from;
    while (end < text_.size() && end - from < 32 && is_word(text_[end])) ++end;
    return upper(text_.substr(from, end - from));
  }
  std::string take_word() {
    skip_space();
    std::string word = word_at(at_);
    at_ += word.size();
    return word;
  }
  bool skip_iri() {
    const std::size_t from = at_;
    const std::size_t end = text_.find_first_of(">\n\r", at_);
    if (end == std::string_view::npos || text_[end] != '>') return fail(from, "expected '>' at the end of an IRI");
    at_ = end + 1;
    return true;
  }
  bool skip_string() {
    const std::size_t from = at_;
    const char quote = text_[at_];
    const bool is_long = text_.compare(at_, 3, std::string(3, quote)) == 0;
    at_ += is_long ? 3 : 1;
    for (; at_ < text_.size(); ++at_) {
      const char c = text_[at_];
      if (c == '\\') ++at_;
      else if (is_long && text_.compare(at_, 3, std::string(3, quote)) == 0) return at_ += 3, true;
      else if (!is_long && c == quote) return ++at_, true;
      else if (!is_long && (c == '\n' || c == '\r')) break;
    }
    at_ = std::min(at_, text_.size());
    return fail(from, "expected the end of a string that begins here");
  }

  /// PREFIX and BASE are the same in Turtle, and are copied.
  bool read_prologue() {
    while (true) {
      skip_space();
      const std::size_t from = at_;
      const std::string word = word_at(at_);
      if (word != "PREFIX" && word != "BASE") return true;
      if (++directives_ > max_directives)
        return fail(at_, "more than " + std::to_string(max_directives) + " prefixes and bases", Errc::limit_exceeded);
      at_ += word.size();
      while (at_ < text_.size() && text_[at_] != '<') {
        if (text_[at_] == '#') {
          skip_comment();
          continue;
        }
        if (text_[at_] == '{' || text_[at_] == ';') break;
        ++at_;
      }
      if (at_ == text_.size() || text_[at_] != '<') return fail(at_, "expected an IRI in " + word);
      if (!skip_iri()) return false;
      turtle_.replace(from, at_ - from, text_.substr(from, at_ - from));
    }
  }

  bool read_operation() {
    const std::size_t from = at_;
    const std::string word = take_word();
    if (word != "INSERT" && word != "DELETE") {
      if (word.empty()) return fail(from, "expected INSERT DATA or DELETE DATA");
      return fail(from, word + " is not supported, only INSERT DATA and DELETE DATA", Errc::unsupported_syntax);
    }
    skip_space();
    const std::size_t second = at_;
    const std::string data = take_word();
    if (data != "DATA") {
      const std::string form = data.empty() ? word + " with a pattern" : word + " " + data;
      if (data.empty() && (second == text_.size() || text_[second] != '{')) return fail(second, "expected DATA after " + word);
      return fail(data.empty() ? from : second, form + " is not supported, only INSERT DATA and DELETE DATA", Errc::unsupported_syntax);
    }
    skip_space();
    if (at_ == text_.size() || text_[at_] != '{') return fail(at_, "expected '{'");
    if (updates_.size() == max_data_updates) return fail(from, "more than " + std::to_string(max_data_updates) + " operations", Errc::limit_exceeded);
    const std::size_t open = at_++;
    if (!find_end(open)) return false;
    return read_triples(word == "INSERT" ? DataUpdate::Kind::insert : DataUpdate::Kind::remove, open + 1);
  }

  /// Leaves at_ at the closing brace.
  bool find_end(std::size_t open) {
    bool begins = true;         // a statement may begin here
    bool after_string = false;  // a language tag may
    ends_with_dot_ = true;
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (is_space(c)) {
        ++at_;
        continue;
      }
      if (c == '#') {
        skip_comment();
        continue;
      }
      if (c == '}') return true;
      if (begins) {
        const std::string word = word_at(at_);
        const bool is_whole = at_ + word.size() == text_.size() || text_[at_ + word.size()] != ':';
        if (is_whole && word == "GRAPH") return fail(at_, "GRAPH is not supported: the request URI names the graph", Errc::unsupported_syntax);
        if (is_whole && (word == "PREFIX" || word == "BASE")) return fail(at_, word + " stands before the operation, not in its braces");
      }
      if (c == '{') return fail(at_, "expected triples, found '{'");
      if (c == '?' || c == '$') return fail(at_, "expected triples, found a variable");
      if (c == '@' && !after_string) return fail(at_, "a directive is not allowed in the braces");
      const bool separates = c == '.' && (at_ + 1 == text_.size() || is_space(text_[at_ + 1]) || text_[at_ + 1] == '}' || text_[at_ + 1] == '#' ||
                                          text_[at_ + 1] == '<' || text_[at_ + 1] == '[' || text_[at_ + 1] == '(');
      begins = ends_with_dot_ = separates;
      after_string = c == '"' || c == '\'';
      if (c == '<') {
        if (!skip_iri()) return false;
      } else if (after_string) {
        if (!skip_string()) return false;
      } else {
        at_ += c == '\\' && at_ + 1 < text_.size() ? 2 : 1;
      }
    }
    return fail(open, "expected '}' for the '{' that stands here");
  }

  bool read_triples(DataUpdate::Kind kind, std::size_t from) {
    const std::size_t size = at_ - from;
    turtle_.replace(from, size, text_.substr(from, size));
    // SPARQL needs no '.' after the last triple. The brace has its place.
    if (!ends_with_dot_) turtle_[at_] = '.';
    ReadOptions options = options_;
    options.max_triples -= triples_;
    options.max_bytes -= bytes_;
    Result<Graph> graph = read_turtle(std::string_view(turtle_).substr(0, at_ + 1), options);
    if (!graph) {
      error_ = std::move(graph).error();
      return false;
    }
    if (kind == DataUpdate::Kind::remove)
      for (const Triple& t : graph->triples())
        if (graph->term(t.subject).is_blank() || graph->term(t.object).is_blank())
          return fail(from, "DELETE DATA has no blank nodes: they would name no node of the graph");
    triples_ += graph->size();
    for (const Triple& t : graph->triples())
      for (const TermId id : {t.subject, t.predicate, t.object}) bytes_ += graph->term(id).text.size();
    bytes_ = std::min(bytes_, options_.max_bytes);
    updates_.push_back({kind, *std::move(graph)});
    // The next operation has its own triples.
    for (std::size_t i = from; i <= at_; ++i)
      if (turtle_[i] != '\n' && turtle_[i] != '\r') turtle_[i] = ' ';
    ++at_;
    return true;
  }

  const std::string_view text_;
  const ReadOptions& options_;
  std::string turtle_;  ///< what the reader of Turtle gets: the prologue and one operation, the rest is blank
  std::size_t at_ = 0, directives_ = 0, triples_ = 0, bytes_ = 0;
  bool ends_with_dot_ = true;
  std::vector<DataUpdate> updates_;
  std::optional<Error> error_;
};

}  // namespace

Result<std::vector<DataUpdate>> read_data_updates(std::string_view text, const ReadOptions& options) { return Reader(text, options).run(); }

}  // namespace lrt::rdf

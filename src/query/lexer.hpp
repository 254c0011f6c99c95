// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/result.hpp>

#include "src/rdf/terminals.hpp"

namespace lrt::query {

/// The text of a query in which names, numbers and most punctuation have no codepoint escapes (SPARQL 1.1 Query 19.2), and where its characters
/// were.
///
/// An escape of a character that is in IRIs is replaced here, wherever it is. All others stay, and only strings and IRIs may have them, whose
/// terminals decode them: space, and what begins or ends a string, an IRI, a comment or a group. No escape begins after a backslash.
class Source {
 public:
  explicit Source(std::string_view text);
  std::string_view text() const noexcept { return escaped_ ? std::string_view(decoded_) : original_; }
  /// The error of an offset in text(), at its place in the original.
  Unexpected error_at(std::size_t offset, const std::string& sentence, Errc code) const;

 private:
  std::string_view original_;
  bool escaped_ = false;
  std::string decoded_;
  std::vector<std::pair<std::size_t, std::size_t>> shifts_;  // from this offset in decoded_ on, so many bytes were before it
};

struct Token {
  enum class Kind : std::uint8_t {
    end,
    invalid,      ///< the error is set
    iri,          ///< text: what is between '<' and '>', without escapes
    prefixed,     ///< text: the prefix; local: the rest, without backslashes
    blank,        ///< text: the label
    variable,     ///< text: the name
    string,       ///< text: the content, without escapes
    language,     ///< text: the tag
    number,       ///< text: unsigned; datatype
    word,         ///< text: a keyword, maybe
    punctuation,  ///< text: one or two characters
  };
  Kind kind = Kind::end;
  bool plain = true;  ///< iri and prefixed: no character requires a further check
  const char* at = nullptr;
  std::string_view text, local;
  Iri datatype;
};

/// Splits a query into the terminals of SPARQL 1.1 Query 19.8, one at a time.
class Lexer : protected rdf::Terminals {
 protected:
  /// @param source  outlives the lexer
  explicit Lexer(const Source& source) : Terminals(source.text()), source_(source) {}

  /// Reads the next token into `token_`. Its views are valid until the next call.
  void advance();

  bool is(Token::Kind kind) const noexcept { return token_.kind == kind; }
  bool is_punctuation(std::string_view text) const noexcept { return token_.kind == Token::Kind::punctuation && token_.text == text; }
  /// @param word  in capitals
  bool is_word(std::string_view word) const noexcept;
  /// Accepts the token and reads the next one if it matches.
  bool accept(std::string_view punctuation);
  bool accept_word(std::string_view word);
  /// Accepts this token and reads the next one; another token is an error.
  bool require(std::string_view punctuation);
  bool require_word(std::string_view word);

  /// Sets the error "expected ..., found ..." at the token.
  bool expected(const char* what) { return Terminals::expected(what, token_.at); }
  Unexpected error() const { return source_.error_at(static_cast<std::size_t>(error_at_ - text_.data()), error_, error_code_); }

  Token token_;

 private:
  bool ends_as_iri() const noexcept;
  void read_name();
  void read_variable();
  void invalid() noexcept { token_.kind = Token::Kind::invalid; }

  const Source& source_;
  std::string buffer_;
};

}  // namespace lrt::query

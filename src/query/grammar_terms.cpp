// SPDX-License-Identifier: Apache-2.0
#include <lrt/base/iri.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/query/grammar.hpp"
#include "src/rdf/n_triples.hpp"

namespace lrt::query {

bool Grammar::count_bytes(std::size_t bytes) {
  term_bytes_ += bytes;
  return term_bytes_ <= options_.max_term_bytes ||
         exceeds(token_.at, "IRIs and literals of more than " + std::to_string(options_.max_term_bytes) + " bytes when written out");
}

Constant Grammar::constant(const rdf::TermView& term) {
  const auto id = static_cast<std::size_t>(terms_.intern(term));
  if (id >= constants_.size()) constants_.resize(id + 1);
  if (!constants_[id]) {
    constants_[id] = static_cast<Constant>(query_->constants.size());
    query_->constants.emplace_back(terms_.term(static_cast<rdf::TermId>(id)));
  }
  return *constants_[id];
}

Constant Grammar::known(std::optional<Constant>& cache, Iri iri) {
  if (!cache) cache = constant(iri);
  return *cache;
}

bool Grammar::iri_text(std::string_view& text) {
  if (is(Token::Kind::prefixed)) {
    const std::size_t* const prefix = prefixes_.find(token_.text);
    if (prefix == nullptr) {
      return fail(token_.at, token_.text.size() > 64 ? "undeclared prefix" : "undeclared prefix \"" + std::string(token_.text) + ":\"");
    }
    (iri_ = query_->prefixes[*prefix].second) += token_.local;
    if (!token_.plain && !iri::is_absolute(iri_)) return fail(token_.at, "expected an IRI, found <" + iri_ + ">");
  } else if (!is(Token::Kind::iri)) {
    return expected("an IRI");
  } else if (token_.plain ? rdf::terminal::has_scheme(token_.text) : iri::is_absolute(token_.text)) {
    iri_ = token_.text;
  } else {
    if (base_.empty()) return fail(token_.at, "relative IRI <" + std::string(token_.text) + "> and no base");
    if (!count_bytes(base_.cost())) return false;
    if (!base_.resolve(token_.text, iri_)) return fail(token_.at, "expected an IRI, found <" + std::string(token_.text) + ">");
  }
  if (iri_.size() > rdf::max_iri) return too_long(token_.at);
  text = iri_;
  return count_bytes(text.size());
}

bool Grammar::iri(Constant& out) {
  std::string_view text;
  if (!iri_text(text)) return false;
  out = constant(rdf::iri(text));
  advance();
  return true;
}

bool Grammar::type_or_iri(Constant& out) {
  if (!is(Token::Kind::word) || token_.text != "a") return iri(out);
  out = known(type_, vocab::rdf_::type);
  advance();
  return true;
}

bool Grammar::starts_signed_number() const noexcept {
  return (is_punctuation("+") || is_punctuation("-")) && (detail::is_digit(peek()) || (peek() == '.' && detail::is_digit(peek(1))));
}

bool Grammar::starts_literal() const noexcept {
  return is(Token::Kind::string) || is(Token::Kind::number) || is_word("TRUE") || is_word("FALSE") || starts_signed_number();
}

/// RDFLiteral, NumericLiteral or BooleanLiteral.
bool Grammar::literal(Constant& out) {
  if (is(Token::Kind::string)) return string_literal(out);
  string_.clear();
  if (starts_signed_number()) {
    string_ = token_.text;
    advance();
  }
  if (is(Token::Kind::number)) {
    string_ += token_.text;
    if (!count_bytes(string_.size())) return false;
    out = constant(rdf::literal(string_, token_.datatype));
  } else if (is_word("TRUE") || is_word("FALSE")) {
    out = constant(rdf::literal(is_word("TRUE") ? "true" : "false", vocab::xsd::boolean));
  } else {
    return expected("a literal");
  }
  advance();
  return true;
}

bool Grammar::string_literal(Constant& out) {
  if (!count_bytes(token_.text.size())) return false;
  string_ = token_.text;
  advance();
  if (is(Token::Kind::language)) {
    out = constant({rdf::TermKind::literal, string_, {}, token_.text});
    advance();
    return true;
  }
  std::string_view datatype;
  if (accept("^^")) {
    if (!starts_iri()) return expected("a datatype IRI");
    if (!iri_text(datatype)) return false;
    if (datatype == vocab::rdf_::langString.text) return fail(token_.at, std::string(rdf::no_language));
    out = constant({rdf::TermKind::literal, string_, datatype});
    advance();
  } else {
    out = constant(rdf::literal(string_));
  }
  return true;
}

bool Grammar::named_variable(Variable& out) {
  if (!is(Token::Kind::variable)) return expected("a variable");
  if (const Variable* const there = variables_.find(token_.text)) {
    out = *there;
  } else {
    out = static_cast<Variable>(query_->variables.size());
    query_->variables.emplace_back(token_.text);
    variables_.add(token_.text, out);
  }
  advance();
  return true;
}

Variable Grammar::hidden_variable() {
  query_->variables.emplace_back();
  return static_cast<Variable>(query_->variables.size() - 1);
}

}  // namespace lrt::query

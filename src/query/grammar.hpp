// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/rdf/graph.hpp>

#include "src/query/algebra.hpp"
#include "src/query/lexer.hpp"
#include "src/query/parser.hpp"
#include "src/rdf/base_iri.hpp"
#include "src/rdf/names.hpp"

namespace lrt::query {

/// Variables in order of first appearance, each once.
class VisibleVariables {
 public:
  const std::vector<Variable>& variables() const noexcept { return variables_; }
  bool has(Variable variable) const noexcept {
    const auto i = static_cast<std::size_t>(variable);
    return i < has_.size() && has_[i];
  }
  void add(Variable variable);
  void add(const std::vector<Variable>& variables);

 private:
  std::vector<Variable> variables_;
  std::vector<bool> has_;
};

/// The productions of SPARQL 1.1 Query 19.8 and the translation of 18.2, by recursive descent over brackets. A function that returns bool returns
/// false after the error is set.
class Grammar : Lexer {
 public:
  Grammar(const Source& source, const ParseOptions& options) : Lexer(source), options_(options), base_(options.base) {}
  Result<std::shared_ptr<const Query>> run();

 private:
  struct Tree {
    Expression expression{};
    std::size_t height = 1;
  };
  struct Part {
    std::unique_ptr<Pattern> pattern;  // nullptr: nothing yet
    std::size_t height = 1;
    VisibleVariables scope;  // the variables in scope of 18.2.1
  };
  /// A group under construction (18.2.2.6).
  struct Group {
    Part part;                // what stands before, without the filters
    Pattern* open = nullptr;  // the basic graph pattern that further triples belong to
    std::vector<Tree> filters;
  };
  struct Verb {
    Node predicate;
    std::shared_ptr<const Path> path;
  };
  /// The destination of the triples that are read.
  struct Target {
    std::vector<TriplePattern>* triples = nullptr;
    VisibleVariables* scope = nullptr;
    Query* template_of = nullptr;  // its blank nodes are those of a template
    bool paths = true;
  };
  enum class Aggregates : std::uint8_t { refused, allowed, inside };
  /// Counts what is in each other.
  class Nested {
   public:
    explicit Nested(Grammar& grammar) noexcept : grammar_(grammar) { ++grammar_.depth_; }
    Nested(const Nested&) = delete;
    Nested& operator=(const Nested&) = delete;
    ~Nested() { --grammar_.depth_; }
    bool allowed() const { return grammar_.depth_ <= grammar_.options_.max_depth || grammar_.too_deep(); }

   private:
    Grammar& grammar_;
  };
  template <class T>
  class Restored {
   public:
    Restored(T& place, T value) : place_(place), before_(std::exchange(place, std::move(value))) {}
    Restored(const Restored&) = delete;
    Restored& operator=(const Restored&) = delete;
    ~Restored() { place_ = std::move(before_); }

   private:
    T& place_;
    T before_;
  };

  bool too_deep();
  /// Whether the algebra tree may have this height.
  bool fits(std::size_t height);

  // --- queries: grammar.cpp
  bool prologue();
  bool declare_base();
  bool declare_prefix();
  bool query();
  bool select_query(Query& query, Part& visible, bool outermost);
  bool columns(Query& query, std::vector<const char*>& places, bool& all, std::size_t& height);
  bool construct_query(Query& query);
  bool short_construct(Query& query);
  bool describe_query(Query& query);
  bool ask_query(Query& query);
  bool dataset(Query& query);
  /// The WHERE clause, what modifies its solutions, and the VALUES behind it.
  bool where_and_modifiers(Query& query, Part& where);
  bool modifiers(Query& query, Part& where);
  bool group_by(Query& query, Part& where);
  bool order_by(Query& query, Part& where);
  bool limits(Query& query);
  bool number_of_rows(std::uint64_t& rows);
  bool data_block(Values& values);
  bool data_row(Values& values, const char* from);
  bool check_columns(Query& query, const VisibleVariables& scope, const std::vector<const char*>& places);
  std::string name_of(Variable variable) const { return "?" + query_->variables[static_cast<std::size_t>(variable)]; }

  // --- patterns: grammar_patterns.cpp
  bool group_pattern(Part& out);
  bool group(Group& out);
  bool group_elements(Group& out);
  bool sub_select(Part& out);
  bool starts_element() const;
  bool element(Group& group);
  bool group_or_union(Group& group);
  bool optional(Group& group);
  bool minus(Group& group);
  bool graph(Group& group);
  bool bind(Group& group);
  bool inline_data(Group& group);
  void join(Group& group, Part&& part);
  bool combine(Group& group, Pattern::Kind kind, Part&& right, std::optional<Tree> condition);
  static Tree all_of(std::vector<Tree>&& conditions);

  bool triples_in_braces(Target target);
  bool triples_same_subject();
  bool property_list(const Node& subject);
  bool starts_verb() const;
  bool verb(Verb& out);
  bool starts_node() const;
  bool node(Node& out);
  bool collection(Node& out);
  bool blank_node_property_list(Node& out);
  bool term(Node& out);
  bool blank_label_node(Node& out);
  bool emit(const Node& subject, const Verb& verb, const Node& object);
  bool add(TriplePattern&& triple);
  bool path(Path& out, bool inverted);
  bool path_sequence(Path& out, bool inverted);
  bool path_element(Path& out, bool inverted);
  bool path_primary(Path& out, bool inverted);
  bool negated_set(Path& out);
  bool negated_one(Path& out);

  // --- expressions: grammar_expressions.cpp
  bool expression(Tree& out);
  bool unary(Tree& out);
  bool primary(Tree& out);
  bool starts_constraint() const;
  bool constraint(Tree& out);
  bool bracketed(Tree& out);
  bool word_expression(Tree& out);
  bool exists(Tree& out, Operator op);
  bool aggregate(Tree& out, Operator op);
  bool arguments(Tree& out);
  /// Makes `left` the tree of both.
  bool reduce(Operator op, Tree& left, Tree&& right);
  bool argument(Tree& of, Tree&& tree);

  // --- terms: grammar_terms.cpp
  bool starts_iri() const noexcept { return is(Token::Kind::iri) || is(Token::Kind::prefixed); }
  bool starts_literal() const noexcept;
  bool starts_signed_number() const noexcept;
  /// The IRI of the token, absolute. The view is valid until the next IRI.
  bool iri_text(std::string_view& text);
  bool iri(Constant& out);
  bool type_or_iri(Constant& out);
  bool literal(Constant& out);
  bool string_literal(Constant& out);
  bool count_bytes(std::size_t bytes);
  Constant constant(const rdf::TermView& term);
  Constant known(std::optional<Constant>& cache, Iri iri);
  bool named_variable(Variable& out);
  Variable hidden_variable();

  const ParseOptions options_;
  rdf::BaseIri base_;
  std::shared_ptr<Query> query_;
  std::size_t depth_ = 0, triples_ = 0, columns_ = 0, term_bytes_ = 0;

  rdf::Names<std::size_t> prefixes_;  // indexes into query_->prefixes
  rdf::Names<Variable> variables_;
  struct Label {
    Variable variable;
    std::size_t basic_pattern;
  };
  rdf::Names<Label> labels_;  // of blank nodes in patterns
  rdf::Names<Variable> template_labels_;
  std::size_t basic_pattern_ = 0, last_basic_pattern_ = 0;  // the one that triples belong to now; the last number given

  rdf::Graph terms_;                                // the constants, to find those that are there already
  std::vector<std::optional<Constant>> constants_;  // of its terms
  std::optional<Constant> type_, first_, rest_, nil_;

  Target target_;
  Aggregates aggregates_ = Aggregates::refused;
  bool has_aggregate_ = false;  // the query that is read
  std::string iri_, string_;
};

}  // namespace lrt::query

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/term.hpp>

/// A query in the algebra of SPARQL 1.1 Query 18.2. The parser creates it, and the evaluator runs it. It is immutable.
namespace lrt::query {

struct Query;

/// A variable of a query and of all queries in it: an index into Query::variables of the outermost one.
enum class Variable : std::uint32_t {};
/// An IRI or literal that the query writes: an index into Query::constants of the outermost one.
enum class Constant : std::uint32_t {};
constexpr std::uint32_t number(Variable v) noexcept { return static_cast<std::uint32_t>(v); }
constexpr std::uint32_t number(Constant c) noexcept { return static_cast<std::uint32_t>(c); }

/// A position of a pattern or a template.
struct Node {
  enum class Kind : std::uint8_t { variable, constant };
  Kind kind = Kind::variable;
  std::uint32_t index = 0;

  Node() = default;
  Node(Variable v) : kind(Kind::variable), index(static_cast<std::uint32_t>(v)) {}  // NOLINT: a variable is a node
  Node(Constant c) : kind(Kind::constant), index(static_cast<std::uint32_t>(c)) {}  // NOLINT: so is a constant
  bool is_variable() const noexcept { return kind == Kind::variable; }
};

/// A property path (SPARQL 9). `link` is a predicate alone. The parser writes ^ only in front of links.
struct Path {
  enum class Kind : std::uint8_t { link, inverse, sequence, alternative, zero_or_more, one_or_more, zero_or_one, negated };
  Kind kind = Kind::link;
  Constant predicate{};                              ///< of a link
  std::vector<Path> parts;                           ///< inverse and the three with a number: one; sequence, alternative: two or more
  std::vector<Constant> excluded, excluded_inverse;  ///< of negated: !(a | ^b) has one of each
};

/// A triple pattern, or a property path pattern.
struct TriplePattern {
  Node subject, predicate, object;
  /// Instead of `predicate`; nullptr: there is none. Neither a link, an inverse nor a sequence: the parser makes triples of these. One path may be
  /// that of many triples.
  std::shared_ptr<const Path> path{};
};

struct Pattern;

/// The built-in calls of SPARQL 17.4 and the operators of 17.3. `or_`, `and_` and the four of arithmetic take two or more arguments, from the left.
enum class Operator : std::uint8_t {
  variable,
  constant,
  or_,
  and_,
  not_,
  equal,
  not_equal,
  less,
  greater,
  less_equal,
  greater_equal,
  in,
  not_in,
  add,
  subtract,
  multiply,
  divide,
  negate,
  plus,
  exists,
  not_exists,
  bound,
  if_,
  coalesce,
  same_term,
  is_iri,
  is_blank,
  is_literal,
  is_numeric,
  str,
  lang,
  datatype,
  iri,
  bnode,
  strdt,
  strlang,
  uuid,
  struuid,
  strlen,
  substr,
  ucase,
  lcase,
  strstarts,
  strends,
  contains,
  strbefore,
  strafter,
  encode_for_uri,
  concat,
  langmatches,
  regex,
  replace,
  abs,
  round,
  ceil,
  floor,
  rand,
  now,
  year,
  month,
  day,
  hours,
  minutes,
  seconds,
  timezone,
  tz,
  md5,
  sha1,
  sha256,
  sha384,
  sha512,
  call,  ///< of a function by its IRI: the casts of 17.5, others are an error of that expression
  count,
  sum,
  min,
  max,
  avg,
  sample,
  group_concat,
};
constexpr bool is_aggregate(Operator op) noexcept { return op >= Operator::count; }

struct Expression {
  Operator op = Operator::constant;
  std::uint32_t index = 0;                   ///< of the Variable or Constant; of a call: the Constant with its IRI
  bool distinct = false;                     ///< of an aggregate, and of a call
  std::string separator{};                   ///< of group_concat
  std::vector<Expression> arguments{};       ///< count without one: COUNT(*). `in` and `not_in`: the first is looked for in the others
  std::shared_ptr<const Pattern> pattern{};  ///< of exists and not_exists
};

/// Rows of VALUES. nullopt: UNDEF.
struct Values {
  std::vector<Variable> variables;
  std::vector<std::vector<std::optional<Constant>>> rows;  ///< each as long as `variables`
};

/// A graph pattern in the algebra (SPARQL 18.2.2).
struct Pattern {
  enum class Kind : std::uint8_t {
    triples,    ///< a basic graph pattern, also the empty one; `triples` in the order of the query
    join,       ///< parts: two or more, in the order of the query
    left_join,  ///< parts: two; `condition`: what the filters of the OPTIONAL say, or nothing
    union_,     ///< parts: two or more
    minus,      ///< parts: two
    filter,     ///< parts: one; `condition`
    graph,      ///< parts: one; `node`: IRI or variable
    extend,     ///< parts: one; BIND(condition AS variable)
    values,
    select,  ///< a query in this one
  };
  Kind kind = Kind::triples;
  std::vector<TriplePattern> triples{};
  std::vector<std::unique_ptr<Pattern>> parts{};
  std::optional<Expression> condition{};
  Node node{};
  Variable variable{};
  Values values{};
  std::unique_ptr<Query> query{};
};

struct Query {
  enum class Form : std::uint8_t { select, ask, construct, describe };
  Form form = Form::select;

  // SELECT: what a solution has, in order. `SELECT *` is written out: the visible variables in order of first appearance.
  struct Column {
    Variable variable;
    std::optional<Expression> expression;  ///< (expression AS variable)
  };
  std::vector<Column> columns;
  bool distinct = false, reduced = false;

  // CONSTRUCT. The blank nodes of the template are variables of `template_blanks`, which the pattern does not bind: each solution has its own.
  std::vector<TriplePattern> template_triples;
  std::vector<Variable> template_blanks;

  // DESCRIBE: IRIs and variables. `DESCRIBE *` is written out.
  std::vector<Node> described;

  // FROM and FROM NAMED, absolute IRIs.
  std::vector<std::string> from, from_named;

  std::unique_ptr<Pattern> where;  ///< never nullptr; DESCRIBE without WHERE has the empty basic graph pattern

  // 18.2.4, 18.2.5. A query with `grouped` and no `group_by` is one group, even of no solutions.
  struct Group {
    Expression expression;
    std::optional<Variable> variable;  ///< (expression AS variable); that of an expression which is a variable alone
  };
  bool grouped = false;  ///< GROUP BY, or an aggregate somewhere
  std::vector<Group> group_by;
  std::vector<Expression> having;
  struct Order {
    Expression expression;
    bool descending = false;
  };
  std::vector<Order> order_by;
  std::uint64_t offset = 0;
  std::optional<std::uint64_t> limit;
  std::optional<Values> values;  ///< after the query: joined with its solutions before the aggregates

  // Set in the outermost query only.
  std::vector<std::string> variables;  ///< names without ? or $; a blank node of a pattern has an empty one, and no query selects it
  std::vector<rdf::Term> constants;
  rdf::Prefixes prefixes;  ///< those that it declares, for the syntaxes of CONSTRUCT and DESCRIBE
  std::string base;        ///< what IRI() resolves against: that of BASE or of the options; may be empty
};

}  // namespace lrt::query

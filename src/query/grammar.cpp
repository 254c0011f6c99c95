// SPDX-License-Identifier: Apache-2.0
#include "src/query/grammar.hpp"

#include <algorithm>
#include <limits>

#include <lrt/rdf/vocab.hpp>

namespace lrt::query {
namespace {

bool is_variable(const Expression& expression) noexcept { return expression.op == Operator::variable; }
Variable variable_of(const Expression& expression) noexcept { return static_cast<Variable>(expression.index); }

/// A variable outside of aggregates that is not in `known` (18.2.4.1).
const Expression* find_unaggregated(const Expression& expression, const VisibleVariables& known) noexcept {
  if (is_aggregate(expression.op)) return nullptr;
  if (is_variable(expression)) return known.has(variable_of(expression)) ? nullptr : &expression;
  for (const Expression& argument : expression.arguments) {
    if (const Expression* const found = find_unaggregated(argument, known)) return found;
  }
  return nullptr;
}

/// Replaces each by SAMPLE of it. BOUND keeps its variable.
void sample_unaggregated(Expression& expression, const VisibleVariables& known) {
  if (is_aggregate(expression.op) || expression.op == Operator::bound) return;
  if (is_variable(expression) && !known.has(variable_of(expression))) {
    Expression sample;
    sample.op = Operator::sample;
    sample.arguments.push_back(std::move(expression));
    expression = std::move(sample);
    return;
  }
  for (Expression& argument : expression.arguments) sample_unaggregated(argument, known);
}

}  // namespace

void VisibleVariables::add(Variable variable) {
  const auto i = static_cast<std::size_t>(variable);
  if (has(variable)) return;
  if (i >= has_.size()) has_.resize(i + 1);
  has_[i] = true;
  variables_.push_back(variable);
}
void VisibleVariables::add(const std::vector<Variable>& variables) {
  for (const Variable variable : variables) add(variable);
}

bool Grammar::too_deep() {
  return exceeds(token_.at, "groups, brackets, paths and subqueries nested more than " + std::to_string(options_.max_depth) + " deep");
}

bool Grammar::fits(std::size_t height) {
  const std::size_t max_height = options_.max_depth * 4;
  return height <= max_height || exceeds(token_.at, "more than " + std::to_string(max_height) + " nested operations");
}

Result<std::shared_ptr<const Query>> Grammar::run() {
  query_ = std::make_shared<Query>();
  advance();
  const bool read = prologue() && query() && (is(Token::Kind::end) || expected("the end of the query"));
  if (!read) return error();
  return std::shared_ptr<const Query>(std::move(query_));
}

// --- prologue

bool Grammar::prologue() {
  query_->base = options_.base;
  for (;;) {
    if (accept_word("BASE")) {
      if (!declare_base()) return false;
    } else if (accept_word("PREFIX")) {
      if (!declare_prefix()) return false;
    } else {
      return true;
    }
  }
}

bool Grammar::declare_base() {
  std::string_view text;
  if (!is(Token::Kind::iri)) return expected("an IRI in '<' and '>'");
  if (!iri_text(text)) return false;
  query_->base = text;
  base_.set(query_->base);
  advance();
  return true;
}

bool Grammar::declare_prefix() {
  if (!is(Token::Kind::prefixed) || !token_.local.empty()) return expected("a prefix ending in ':'");
  const std::string_view prefix = token_.text;
  advance();
  std::string_view text;
  if (!is(Token::Kind::iri)) return expected("an IRI in '<' and '>'");
  if (!iri_text(text)) return false;
  if (const std::size_t* const there = prefixes_.find(prefix)) {
    query_->prefixes[*there].second = text;
  } else {
    prefixes_.add(prefix, query_->prefixes.size());
    query_->prefixes.emplace_back(prefix, text);
  }
  advance();
  return true;
}

// --- forms

bool Grammar::query() {
  if (is_word("SELECT")) {
    Part visible;
    return select_query(*query_, visible, true);
  }
  if (accept_word("CONSTRUCT")) return construct_query(*query_);
  if (accept_word("DESCRIBE")) return describe_query(*query_);
  if (accept_word("ASK")) return ask_query(*query_);
  for (const std::string_view update : {"INSERT", "DELETE", "LOAD", "CLEAR", "CREATE", "DROP", "COPY", "MOVE", "ADD", "WITH"}) {
    if (is_word(update)) { return fail(token_.at, std::string(update) + " is not supported: this endpoint is read-only", Errc::unsupported_syntax); }
  }
  return expected("SELECT, CONSTRUCT, DESCRIBE or ASK");
}

/// SelectQuery, or SubSelect, with the VALUES behind it. `visible`: the columns.
bool Grammar::select_query(Query& query, Part& visible, bool outermost) {
  query.form = Query::Form::select;
  std::vector<const char*> places;
  bool all = false;
  Part where;
  if (!columns(query, places, all, visible.height) || (outermost && !dataset(query)) || !where_and_modifiers(query, where)) return false;
  if (all) {
    if (query.grouped) return fail(places.front(), "found SELECT * in a query with GROUP BY or an aggregate, expected the columns by name");
    columns_ += where.scope.variables().size();
    if (columns_ > options_.max_triples)
      return exceeds(places.front(), "SELECT * of more than " + std::to_string(options_.max_triples) + " variables");
    for (const Variable variable : where.scope.variables()) query.columns.push_back({variable, std::nullopt});
  } else if (!check_columns(query, where.scope, places)) {
    return false;
  }
  for (const Query::Column& column : query.columns) visible.scope.add(column.variable);
  visible.height = std::max(visible.height, where.height);
  return true;
}

/// SelectClause.
/// @param places  of the columns; of `*` if `all`
bool Grammar::columns(Query& query, std::vector<const char*>& places, bool& all, std::size_t& height) {
  const Restored<Aggregates> aggregates(aggregates_, Aggregates::allowed);
  const char* const from = token_.at;
  advance();
  query.distinct = accept_word("DISTINCT");
  query.reduced = !query.distinct && accept_word("REDUCED");
  if (accept("*")) {
    all = true;
    places.push_back(from);
    return true;
  }
  VisibleVariables named;
  for (;;) {
    const char* const place = token_.at;
    Query::Column column{};
    if (is(Token::Kind::variable)) {
      if (!named_variable(column.variable)) return false;
      if (named.has(column.variable)) continue;
    } else if (accept("(")) {
      Tree tree;
      if (!expression(tree) || !require_word("AS")) return false;
      const char* const name = token_.at;
      if (!named_variable(column.variable) || !require(")")) return false;
      if (named.has(column.variable)) return fail(name, name_of(column.variable) + " is in SELECT already");
      height = std::max(height, tree.height);
      column.expression = std::move(tree.expression);
    } else if (places.empty()) {
      return expected("'*', a variable or '(expression AS ?variable)'");
    } else {
      return true;
    }
    named.add(column.variable);
    query.columns.push_back(std::move(column));
    places.push_back(place);
  }
}

/// Grammar notes on AS, and 11.4: what a query with groups may select.
bool Grammar::check_columns(Query& query, const VisibleVariables& scope, const std::vector<const char*>& places) {
  VisibleVariables known;
  for (const Query::Group& group : query.group_by) {
    if (group.variable) known.add(*group.variable);
  }
  for (std::size_t i = 0; i < query.columns.size(); ++i) {
    const Query::Column& column = query.columns[i];
    if (column.expression) {
      if (scope.has(column.variable)) return fail(places[i], name_of(column.variable) + " is in the pattern already, and cannot be named by AS");
      const Expression* const free = query.grouped ? find_unaggregated(*column.expression, known) : nullptr;
      if (free != nullptr) return fail(places[i], name_of(variable_of(*free)) + " is neither in GROUP BY nor in an aggregate");
      known.add(column.variable);
    } else if (query.grouped && !known.has(column.variable)) {
      return fail(places[i], name_of(column.variable) + " is neither in GROUP BY nor in an aggregate");
    }
  }
  return true;
}

bool Grammar::construct_query(Query& query) {
  query.form = Query::Form::construct;
  if (!is_punctuation("{")) return short_construct(query);
  Part where;
  return triples_in_braces({&query.template_triples, nullptr, &query, false}) && dataset(query) && where_and_modifiers(query, where);
}

/// CONSTRUCT WHERE { triples }: the pattern is the template too, and its blank nodes are those of each solution.
bool Grammar::short_construct(Query& query) {
  Part where;
  where.pattern = std::make_unique<Pattern>();
  auto& triples = where.pattern->triples;
  if (!dataset(query) || !require_word("WHERE") || !triples_in_braces({&triples, &where.scope, nullptr, false})) return false;
  std::vector<std::pair<std::uint32_t, Variable>> blanks;  // those of the pattern and those of the template
  const auto in_template = [&](const Node& node) -> Node {
    if (!node.is_variable() || !query_->variables[node.index].empty()) return node;
    const auto at = std::lower_bound(blanks.begin(), blanks.end(), node.index, [](const auto& pair, std::uint32_t i) { return pair.first < i; });
    if (at != blanks.end() && at->first == node.index) return at->second;
    const Variable variable = hidden_variable();
    query.template_blanks.push_back(variable);
    blanks.insert(at, {node.index, variable});
    return variable;
  };
  for (const TriplePattern& t : triples) query.template_triples.push_back({in_template(t.subject), t.predicate, in_template(t.object)});
  query.where = std::move(where.pattern);
  return modifiers(query, where);
}

bool Grammar::describe_query(Query& query) {
  query.form = Query::Form::describe;
  const bool all = accept("*");
  while (!all) {
    Variable variable{};
    Constant constant{};
    if (is(Token::Kind::variable)) {
      if (!named_variable(variable)) return false;
      query.described.emplace_back(variable);
    } else if (starts_iri()) {
      if (!iri(constant)) return false;
      query.described.emplace_back(constant);
    } else if (query.described.empty()) {
      return expected("'*', a variable or an IRI");
    } else {
      break;
    }
  }
  Part where;
  if (!dataset(query)) return false;
  if (is_word("WHERE") || is_punctuation("{")) {
    if (!where_and_modifiers(query, where)) return false;
  } else {
    query.where = std::make_unique<Pattern>();
    if (!modifiers(query, where)) return false;
  }
  if (all) query.described.assign(where.scope.variables().begin(), where.scope.variables().end());
  return true;
}

bool Grammar::ask_query(Query& query) {
  query.form = Query::Form::ask;
  Part where;
  return dataset(query) && where_and_modifiers(query, where);
}

bool Grammar::dataset(Query& query) {
  while (accept_word("FROM")) {
    auto& graphs = accept_word("NAMED") ? query.from_named : query.from;
    std::string_view text;
    if (!starts_iri()) return expected(&graphs == &query.from ? "an IRI or NAMED" : "an IRI");
    if (!iri_text(text)) return false;
    graphs.emplace_back(text);
    advance();
  }
  return true;
}

// --- solution modifiers

bool Grammar::where_and_modifiers(Query& query, Part& where) {
  if (!accept_word("WHERE") && !is_punctuation("{")) return expected("WHERE or '{'");
  if (!group_pattern(where)) return false;
  query.where = std::move(where.pattern);
  return modifiers(query, where);
}

/// Solution modifiers and VALUES. Adds the variables of VALUES to those of the pattern.
bool Grammar::modifiers(Query& query, Part& where) {
  if (accept_word("GROUP") && !group_by(query, where)) return false;
  {
    const Restored<Aggregates> aggregates(aggregates_, Aggregates::allowed);
    if (accept_word("HAVING")) {
      do {
        Tree tree;
        if (!constraint(tree)) return false;
        where.height = std::max(where.height, tree.height);
        query.having.push_back(std::move(tree.expression));
      } while (starts_constraint());
    }
    if (accept_word("ORDER") && !order_by(query, where)) return false;
  }
  query.grouped = has_aggregate_ || !query.group_by.empty();
  if (query.grouped) {
    VisibleVariables known;
    for (const Query::Group& group : query.group_by) {
      if (group.variable) known.add(*group.variable);
    }
    for (const Query::Column& column : query.columns) {
      if (column.expression) known.add(column.variable);
    }
    for (Expression& expression : query.having) sample_unaggregated(expression, known);
    for (Query::Order& order : query.order_by) sample_unaggregated(order.expression, known);
  }
  if (!limits(query)) return false;
  if (accept_word("VALUES")) {
    if (!data_block(query.values.emplace())) return false;
    where.scope.add(query.values->variables);
  }
  return fits(where.height);
}

bool Grammar::group_by(Query& query, Part& where) {
  if (!require_word("BY")) return false;
  do {
    Query::Group group;
    Tree tree;
    const bool bracket = accept("(");
    if (bracket ? !expression(tree) : is(Token::Kind::variable) ? !primary(tree) : !constraint(tree)) return false;
    const char* place = token_.at;
    if (bracket && accept_word("AS")) {
      place = token_.at;
      if (!named_variable(group.variable.emplace())) return false;
      if (where.scope.has(*group.variable)) return fail(place, name_of(*group.variable) + " is in the pattern already, and cannot be named by AS");
      where.scope.add(*group.variable);
    } else if (is_variable(tree.expression)) {
      group.variable = variable_of(tree.expression);
    }
    if (bracket && !require(")")) return false;
    where.height = std::max(where.height, tree.height);
    group.expression = std::move(tree.expression);
    query.group_by.push_back(std::move(group));
  } while (is(Token::Kind::variable) || starts_constraint());
  return true;
}

bool Grammar::order_by(Query& query, Part& where) {
  if (!require_word("BY")) return false;
  const auto starts = [this] { return is(Token::Kind::variable) || starts_constraint() || is_word("ASC") || is_word("DESC"); };
  do {
    Query::Order order;
    Tree tree;
    order.descending = is_word("DESC");
    if (accept_word("ASC") || accept_word("DESC")) {
      if (!bracketed(tree)) return false;
    } else if (is(Token::Kind::variable) ? !primary(tree) : !constraint(tree)) {
      return false;
    }
    where.height = std::max(where.height, tree.height);
    order.expression = std::move(tree.expression);
    query.order_by.push_back(std::move(order));
  } while (starts());
  return true;
}

/// LIMIT and OFFSET, each once, in either order.
bool Grammar::limits(Query& query) {
  bool has_offset = false;
  for (;;) {
    if (!query.limit && accept_word("LIMIT")) {
      if (!number_of_rows(query.limit.emplace())) return false;
    } else if (!has_offset && accept_word("OFFSET")) {
      has_offset = true;
      if (!number_of_rows(query.offset)) return false;
    } else {
      return true;
    }
  }
}

/// INTEGER. A number that does not fit becomes the largest one that does.
bool Grammar::number_of_rows(std::uint64_t& rows) {
  if (!is(Token::Kind::number) || token_.datatype != vocab::xsd::integer) return expected("an integer");
  rows = 0;
  constexpr std::uint64_t most = std::numeric_limits<std::uint64_t>::max();
  for (const char c : token_.text) {
    const auto digit = static_cast<std::uint64_t>(c - '0');
    rows = rows > (most - digit) / 10 ? most : rows * 10 + digit;
  }
  advance();
  return true;
}

// --- VALUES

bool Grammar::data_block(Values& values) {
  const bool one = is(Token::Kind::variable);
  VisibleVariables named;
  if (!one && !accept("(")) return expected("a variable or '('");
  while (is(Token::Kind::variable)) {
    const char* const place = token_.at;
    Variable variable{};
    if (!named_variable(variable)) return false;
    if (named.has(variable)) return fail(place, name_of(variable) + " is in VALUES twice");
    named.add(variable);
    if (one) break;
  }
  values.variables = named.variables();
  if (!one && !accept(")")) return expected("a variable or ')'");
  if (!require("{")) return false;
  while (!accept("}")) {
    const char* const from = token_.at;
    if (!one && !accept("(")) return expected("'(' or '}'");
    if (!data_row(values, from)) return false;
  }
  return true;
}

/// The values of a row, and the ')' of one in brackets. A row without brackets has one.
bool Grammar::data_row(Values& values, const char* from) {
  auto& row = values.rows.emplace_back();
  const bool one = *from != '(';
  do {
    if (!one && accept(")")) {
      const std::size_t wanted = values.variables.size(), found = row.size();
      return found == wanted || fail(from, "found a row of " + std::to_string(found) + " values, expected " + std::to_string(wanted));
    }
    Constant value{};
    if (accept_word("UNDEF")) {
      row.emplace_back();
    } else {
      if (starts_iri() ? !iri(value) : starts_literal() ? !literal(value) : !expected("an IRI, a literal or UNDEF")) return false;
      row.emplace_back(value);
    }
  } while (!one);
  return true;
}

}  // namespace lrt::query

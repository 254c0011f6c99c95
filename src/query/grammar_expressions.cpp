// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "src/query/grammar.hpp"

namespace lrt::query {
namespace {

constexpr std::size_t any_number = 0xFFFF;

/// A built-in call with expressions as arguments (19.8 BuiltInCall), and the aggregates.
struct BuiltIn {
  std::string_view name;
  Operator op;
  std::size_t least, most;
};
constexpr BuiltIn built_ins[] = {
    {"STR", Operator::str, 1, 1},
    {"LANG", Operator::lang, 1, 1},
    {"LANGMATCHES", Operator::langmatches, 2, 2},
    {"DATATYPE", Operator::datatype, 1, 1},
    {"BOUND", Operator::bound, 1, 1},
    {"IRI", Operator::iri, 1, 1},
    {"URI", Operator::iri, 1, 1},
    {"BNODE", Operator::bnode, 0, 1},
    {"RAND", Operator::rand, 0, 0},
    {"ABS", Operator::abs, 1, 1},
    {"CEIL", Operator::ceil, 1, 1},
    {"FLOOR", Operator::floor, 1, 1},
    {"ROUND", Operator::round, 1, 1},
    {"CONCAT", Operator::concat, 0, any_number},
    {"STRLEN", Operator::strlen, 1, 1},
    {"SUBSTR", Operator::substr, 2, 3},
    {"REPLACE", Operator::replace, 3, 4},
    {"REGEX", Operator::regex, 2, 3},
    {"UCASE", Operator::ucase, 1, 1},
    {"LCASE", Operator::lcase, 1, 1},
    {"ENCODE_FOR_URI", Operator::encode_for_uri, 1, 1},
    {"CONTAINS", Operator::contains, 2, 2},
    {"STRSTARTS", Operator::strstarts, 2, 2},
    {"STRENDS", Operator::strends, 2, 2},
    {"STRBEFORE", Operator::strbefore, 2, 2},
    {"STRAFTER", Operator::strafter, 2, 2},
    {"YEAR", Operator::year, 1, 1},
    {"MONTH", Operator::month, 1, 1},
    {"DAY", Operator::day, 1, 1},
    {"HOURS", Operator::hours, 1, 1},
    {"MINUTES", Operator::minutes, 1, 1},
    {"SECONDS", Operator::seconds, 1, 1},
    {"TIMEZONE", Operator::timezone, 1, 1},
    {"TZ", Operator::tz, 1, 1},
    {"NOW", Operator::now, 0, 0},
    {"UUID", Operator::uuid, 0, 0},
    {"STRUUID", Operator::struuid, 0, 0},
    {"MD5", Operator::md5, 1, 1},
    {"SHA1", Operator::sha1, 1, 1},
    {"SHA256", Operator::sha256, 1, 1},
    {"SHA384", Operator::sha384, 1, 1},
    {"SHA512", Operator::sha512, 1, 1},
    {"COALESCE", Operator::coalesce, 0, any_number},
    {"IF", Operator::if_, 3, 3},
    {"STRLANG", Operator::strlang, 2, 2},
    {"STRDT", Operator::strdt, 2, 2},
    {"SAMETERM", Operator::same_term, 2, 2},
    {"ISIRI", Operator::is_iri, 1, 1},
    {"ISURI", Operator::is_iri, 1, 1},
    {"ISBLANK", Operator::is_blank, 1, 1},
    {"ISLITERAL", Operator::is_literal, 1, 1},
    {"ISNUMERIC", Operator::is_numeric, 1, 1},
    {"COUNT", Operator::count, 1, 1},
    {"SUM", Operator::sum, 1, 1},
    {"MIN", Operator::min, 1, 1},
    {"MAX", Operator::max, 1, 1},
    {"AVG", Operator::avg, 1, 1},
    {"SAMPLE", Operator::sample, 1, 1},
    {"GROUP_CONCAT", Operator::group_concat, 1, 1},
};

const BuiltIn* find_built_in(std::string_view name) noexcept {
  const auto* const at =
      std::find_if(std::begin(built_ins), std::end(built_ins), [&](const BuiltIn& b) { return detail::iequals_ascii(b.name, name); });
  return at == std::end(built_ins) ? nullptr : at;
}

/// A binary operator with its precedence: a greater number binds tighter.
struct Infix {
  std::string_view text;
  Operator op;
  int binds;
};
constexpr int binds_as_and = 2, binds_as_comparison = 3, binds_as_sum = 4;
constexpr Infix infixes[] = {
    {"||", Operator::or_, 1},
    {"&&", Operator::and_, binds_as_and},
    {"=", Operator::equal, binds_as_comparison},
    {"!=", Operator::not_equal, binds_as_comparison},
    {"<", Operator::less, binds_as_comparison},
    {">", Operator::greater, binds_as_comparison},
    {"<=", Operator::less_equal, binds_as_comparison},
    {">=", Operator::greater_equal, binds_as_comparison},
    {"+", Operator::add, binds_as_sum},
    {"-", Operator::subtract, binds_as_sum},
    {"*", Operator::multiply, 5},
    {"/", Operator::divide, 5},
};
constexpr Infix in{"IN", Operator::in, binds_as_comparison};

constexpr bool takes_many(Operator op) noexcept {
  return op == Operator::or_ || op == Operator::and_ || (op >= Operator::add && op <= Operator::divide);
}

}  // namespace

bool Grammar::argument(Tree& of, Tree&& tree) {
  of.height = std::max(of.height, tree.height + 1);
  of.expression.arguments.push_back(std::move(tree.expression));
  return fits(of.height);
}

bool Grammar::reduce(Operator op, Tree& left, Tree&& right) {
  if (left.expression.op == op && takes_many(op)) return argument(left, std::move(right));
  Tree both;
  both.expression.op = op;
  both.expression.arguments.reserve(2);
  const bool fit = argument(both, std::move(left)) && argument(both, std::move(right));
  left = std::move(both);
  return fit;
}

/// Operators are reduced by precedence without recursion: a chain of them is as deep as one.
bool Grammar::expression(Tree& out) {
  const Nested nested(*this);
  if (!nested.allowed()) return false;
  std::vector<Tree> operands;
  std::vector<Infix> waiting;
  bool compared = false;  // `a = b = c` is not an expression
  const auto reduce_from = [&](int binds) {
    while (!waiting.empty() && waiting.back().binds >= binds) {
      Tree right = std::move(operands.back());
      operands.pop_back();
      if (!reduce(waiting.back().op, operands.back(), std::move(right))) return false;
      waiting.pop_back();
    }
    return true;
  };
  for (;;) {
    if (!unary(operands.emplace_back())) return false;
    for (;;) {
      const Infix* infix = nullptr;
      if (is(Token::Kind::punctuation)) {
        const auto* const at = std::find_if(std::begin(infixes), std::end(infixes), [&](const Infix& i) { return i.text == token_.text; });
        if (at != std::end(infixes)) infix = at;
      } else if (is_word("IN") || is_word("NOT")) {
        infix = &in;
      }
      if (infix == nullptr) {
        if (!reduce_from(0)) return false;
        out = std::move(operands.back());
        return true;
      }
      if (infix->binds == binds_as_comparison && compared) return expected("'&&', '||' or the end of the expression");
      compared = infix->binds == binds_as_comparison || (compared && infix->binds > binds_as_and);
      if (!reduce_from(infix->binds)) return false;
      if (infix != &in) {
        waiting.push_back(*infix);
        advance();
        break;
      }
      Tree list;
      list.expression.op = accept_word("NOT") ? Operator::not_in : Operator::in;
      if (!require_word("IN") || !argument(list, std::move(operands.back())) || !arguments(list)) return false;
      operands.back() = std::move(list);
    }
  }
}

/// UnaryExpression: at most one operator.
bool Grammar::unary(Tree& out) {
  if (starts_signed_number()) return primary(out);
  const Operator op = is_punctuation("!")   ? Operator::not_
                      : is_punctuation("-") ? Operator::negate
                      : is_punctuation("+") ? Operator::plus
                                            : Operator::constant;
  if (op == Operator::constant) return primary(out);
  advance();
  Tree operand;
  if (!primary(operand)) return false;
  out.expression.op = op;
  return argument(out, std::move(operand));
}

bool Grammar::primary(Tree& out) {
  if (is_punctuation("(")) return bracketed(out);
  if (is(Token::Kind::variable)) {
    Variable variable{};
    if (!named_variable(variable)) return false;
    out.expression.op = Operator::variable;
    out.expression.index = static_cast<std::uint32_t>(variable);
    return true;
  }
  Constant constant{};
  if (starts_iri()) {
    if (!iri(constant)) return false;
    out.expression.index = static_cast<std::uint32_t>(constant);
    if (!is_punctuation("(")) return true;
    out.expression.op = Operator::call;
    return arguments(out);
  }
  if (starts_literal()) {
    if (!literal(constant)) return false;
    out.expression.index = static_cast<std::uint32_t>(constant);
    return true;
  }
  return is(Token::Kind::word) ? word_expression(out) : expected("an expression");
}

bool Grammar::bracketed(Tree& out) { return require("(") && expression(out) && require(")"); }

bool Grammar::starts_constraint() const {
  return is_punctuation("(") || starts_iri() ||
         (is(Token::Kind::word) && (is_word("EXISTS") || is_word("NOT") || find_built_in(token_.text) != nullptr));
}

bool Grammar::constraint(Tree& out) {
  if (is_punctuation("(")) return bracketed(out);
  if (!starts_constraint()) return expected("a condition in brackets or a call of a function");
  return primary(out) && (out.expression.op != Operator::constant || expected("'(' behind the name of a function"));
}

/// A built-in call, an aggregate or EXISTS.
bool Grammar::word_expression(Tree& out) {
  if (accept_word("EXISTS")) return exists(out, Operator::exists);
  if (accept_word("NOT")) return require_word("EXISTS") && exists(out, Operator::not_exists);
  const BuiltIn* const built_in = find_built_in(token_.text);
  if (built_in == nullptr) return expected("an expression");
  if (is_aggregate(built_in->op)) return aggregate(out, built_in->op);
  const char* const from = token_.at;
  advance();
  out.expression.op = built_in->op;
  if (built_in->op == Operator::bound) {
    Tree variable;
    if (!require("(")) return false;
    if (!is(Token::Kind::variable)) return expected("a variable");
    return primary(variable) && require(")") && argument(out, std::move(variable));
  }
  if (!arguments(out)) return false;
  const std::size_t found = out.expression.arguments.size();
  if (found >= built_in->least && found <= built_in->most) return true;
  return fail(from, std::string(built_in->name) + " takes " + std::to_string(built_in->least) +
                        (built_in->most == built_in->least ? "" : " or " + std::to_string(built_in->most)) + " arguments, found " +
                        std::to_string(found));
}

/// The pattern of [NOT] EXISTS.
bool Grammar::exists(Tree& out, Operator op) {
  Part part;
  if (!group_pattern(part)) return false;
  out.expression.op = op;
  out.expression.pattern = std::move(part.pattern);
  out.height = part.height + 1;
  return fits(out.height);
}

/// `( expression , ... )`, or `()`. DISTINCT stands only in calls by IRI.
bool Grammar::arguments(Tree& out) {
  if (!require("(")) return false;
  if (accept(")")) return true;
  if (out.expression.op == Operator::call) out.expression.distinct = accept_word("DISTINCT");
  do {
    Tree tree;
    if (!expression(tree) || !argument(out, std::move(tree))) return false;
  } while (accept(","));
  return accept(")") || expected("',' or ')'");
}

bool Grammar::aggregate(Tree& out, Operator op) {
  if (aggregates_ == Aggregates::refused) {
    return fail(token_.at, "found the aggregate " + std::string(token_.text) + ", which is only allowed in SELECT, HAVING and ORDER BY");
  }
  if (aggregates_ == Aggregates::inside) return fail(token_.at, "found the aggregate " + std::string(token_.text) + " in an aggregate");
  has_aggregate_ = true;
  const Restored<Aggregates> inside(aggregates_, Aggregates::inside);
  out.expression.op = op;
  advance();
  if (!require("(")) return false;
  out.expression.distinct = accept_word("DISTINCT");
  if (op != Operator::count || !accept("*")) {
    Tree tree;
    if (!expression(tree) || !argument(out, std::move(tree))) return false;
  }
  if (op == Operator::group_concat) {
    out.expression.separator = " ";
    if (accept(";")) {
      if (!require_word("SEPARATOR") || !require("=")) return false;
      if (!is(Token::Kind::string)) return expected("a string");
      out.expression.separator = token_.text;
      if (!count_bytes(token_.text.size())) return false;
      advance();
    }
  }
  return require(")");
}

}  // namespace lrt::query

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <lrt/rdf/term.hpp>

#include "src/query/algebra.hpp"

/// The algebra of a query as a short text, so that a test compares it in one line. <http://e/x> is :x, other IRIs are in <>, hidden variables
/// are _0, _1, ... by their index.
namespace lrt::test {

class AlgebraText {
 public:
  explicit AlgebraText(const query::Query& outermost) : top_(outermost) {}

  std::string node(const query::Node& n) const {
    return n.is_variable() ? variable(static_cast<query::Variable>(n.index)) : constant(static_cast<query::Constant>(n.index));
  }
  std::string variable(query::Variable v) const {
    const std::string& name = top_.variables.at(static_cast<std::size_t>(v));
    return name.empty() ? "_" + std::to_string(static_cast<std::size_t>(v)) : "?" + name;
  }
  std::string constant(query::Constant c) const {
    const rdf::TermView term = top_.constants.at(static_cast<std::size_t>(c));
    const std::string rdf_ns = "http://www.w3.org/1999/02/22-rdf-syntax-ns#", xsd = "http://www.w3.org/2001/XMLSchema#";
    const auto shortened = [&](std::string_view iri) -> std::string {
      if (iri.substr(0, 9) == "http://e/") return ":" + std::string(iri.substr(9));
      if (iri.substr(0, rdf_ns.size()) == rdf_ns) return "rdf:" + std::string(iri.substr(rdf_ns.size()));
      if (iri.substr(0, xsd.size()) == xsd) return "xsd:" + std::string(iri.substr(xsd.size()));
      return "<" + std::string(iri) + ">";
    };
    if (term.is_iri()) return shortened(term.text);
    std::string text = "\"" + std::string(term.text) + "\"";
    if (!term.language.empty()) return text + "@" + std::string(term.language);
    return term.datatype == xsd + "string" ? text : text + "^^" + shortened(term.datatype);
  }
  std::string path(const query::Path& p) const {
    using K = query::Path::Kind;
    const auto all = [&](const char* between) {
      std::string text = "(";
      for (const query::Path& part : p.parts) text += (text.size() > 1 ? between : "") + path(part);
      return text + ")";
    };
    switch (p.kind) {
      case K::link: return constant(p.predicate);
      case K::inverse: return "^" + path(p.parts.at(0));
      case K::sequence: return all("/");
      case K::alternative: return all("|");
      case K::zero_or_more: return path(p.parts.at(0)) + "*";
      case K::one_or_more: return path(p.parts.at(0)) + "+";
      case K::zero_or_one: return path(p.parts.at(0)) + "?";
      case K::negated: break;
    }
    std::string text = "!(";
    for (const auto c : p.excluded) text += (text.size() > 2 ? "|" : "") + constant(c);
    for (const auto c : p.excluded_inverse) text += (text.size() > 2 ? "|^" : "^") + constant(c);
    return text + ")";
  }
  std::string triples(const std::vector<query::TriplePattern>& all) const {
    std::string text = "[";
    for (const auto& t : all) {
      if (text.size() > 1) text += ". ";
      text += node(t.subject) + " " + (t.path ? path(*t.path) : node(t.predicate)) + " " + node(t.object);
    }
    return text + "]";
  }
  /// Operators by their number in the enumeration would say nothing: those that the tests use have names.
  std::string expression(const query::Expression& e) const {
    using O = query::Operator;
    if (e.op == O::variable) return variable(static_cast<query::Variable>(e.index));
    if (e.op == O::constant) return constant(static_cast<query::Constant>(e.index));
    std::string text = "(";
    switch (e.op) {
      case O::or_: text += "||"; break;
      case O::and_: text += "&&"; break;
      case O::not_: text += "!"; break;
      case O::equal: text += "="; break;
      case O::not_equal: text += "!="; break;
      case O::less: text += "<"; break;
      case O::greater: text += ">"; break;
      case O::less_equal: text += "<="; break;
      case O::greater_equal: text += ">="; break;
      case O::in: text += "in"; break;
      case O::not_in: text += "notin"; break;
      case O::add: text += "+"; break;
      case O::subtract: text += "-"; break;
      case O::multiply: text += "*"; break;
      case O::divide: text += "/"; break;
      case O::negate: text += "neg"; break;
      case O::plus: text += "pos"; break;
      case O::exists: text += "exists"; break;
      case O::not_exists: text += "notexists"; break;
      case O::bound: text += "bound"; break;
      case O::if_: text += "if"; break;
      case O::call: text += "call " + constant(static_cast<query::Constant>(e.index)); break;
      case O::count: text += "count"; break;
      case O::sum: text += "sum"; break;
      case O::sample: text += "sample"; break;
      case O::group_concat: text += "concat'" + e.separator + "'"; break;
      default: text += "op" + std::to_string(static_cast<int>(e.op));
    }
    if (e.distinct) text += " distinct";
    for (const auto& a : e.arguments) text += " " + expression(a);
    if (e.pattern) text += " " + pattern(*e.pattern);
    return text + ")";
  }
  std::string values(const query::Values& v) const {
    std::string text = "(values";
    for (const auto x : v.variables) text += " " + variable(x);
    for (const auto& row : v.rows) {
      text += " (";
      for (std::size_t i = 0; i < row.size(); ++i) text += (i != 0 ? " " : "") + (row[i] ? constant(*row[i]) : std::string("UNDEF"));
      text += ")";
    }
    return text + ")";
  }
  std::string pattern(const query::Pattern& p) const {
    using K = query::Pattern::Kind;
    std::string text = "(";
    switch (p.kind) {
      case K::triples: return triples(p.triples);
      case K::values: return values(p.values);
      case K::select: return query(*p.query);
      case K::join: text += "join"; break;
      case K::left_join: text += "leftjoin"; break;
      case K::union_: text += "union"; break;
      case K::minus: text += "minus"; break;
      case K::filter: text += "filter"; break;
      case K::graph: text += "graph " + node(p.node); break;
      case K::extend: text += "extend " + variable(p.variable); break;
    }
    if (p.condition) text += " " + expression(*p.condition);
    for (const auto& part : p.parts) text += " " + pattern(*part);
    return text + ")";
  }
  /// A SELECT, or of another form what it has in common with one.
  std::string query(const query::Query& q) const {
    std::string text = "(select";
    if (q.distinct) text += " distinct";
    if (q.reduced) text += " reduced";
    for (const auto& c : q.columns) text += " " + variable(c.variable) + (c.expression ? "=" + expression(*c.expression) : "");
    text += " " + pattern(*q.where);
    if (q.grouped) text += " group";
    for (const auto& g : q.group_by) text += " by " + expression(g.expression) + (g.variable ? "=" + variable(*g.variable) : "");
    for (const auto& h : q.having) text += " having " + expression(h);
    for (const auto& o : q.order_by) text += (o.descending ? " desc " : " asc ") + expression(o.expression);
    if (q.offset != 0) text += " offset " + std::to_string(q.offset);
    if (q.limit) text += " limit " + std::to_string(*q.limit);
    if (q.values) text += " " + values(*q.values);
    return text + ")";
  }

 private:
  const query::Query& top_;
};

}  // namespace lrt::test

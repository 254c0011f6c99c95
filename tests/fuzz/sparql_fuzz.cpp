// SPDX-License-Identifier: Apache-2.0
#include "src/query/parser.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include <lrt/rdf/codec.hpp>

#include "src/query/dataset.hpp"
#include "src/query/dependencies.hpp"
#include "src/query/evaluate.hpp"
#include "tests/fuzz/round_trip.hpp"

// Bytes -> parse -> an algebra that keeps what algebra.hpp promises. An evaluator may rely on all that is checked here. The query is then
// evaluated within small bounds, and its answer is written.

using lrt::fuzz::broken;
using lrt::query::Expression;
using lrt::query::Node;
using lrt::query::Operator;
using lrt::query::ParseOptions;
using lrt::query::Path;
using lrt::query::Pattern;
using lrt::query::Query;
using lrt::query::TriplePattern;
using lrt::query::Values;
using lrt::query::Variable;

namespace {

/// Walks over a query. Heights are counted on the way.
class Checker {
 public:
  Checker(const Query& outermost, const ParseOptions& options, const std::string& text)
      : top_(outermost), most_(options.max_depth * 4), depth_(options.max_depth), text_(text) {}

  void query(const Query& q, std::size_t height) {
    check(q.where != nullptr, "a query without a pattern");
    check((&q == &top_) || (q.variables.empty() && q.constants.empty()), "variables in an inner query");
    for (const auto& column : q.columns) {
      selected(column.variable);
      if (column.expression) expression(*column.expression, height);
    }
    triples(q.template_triples, height);
    for (const Variable blank : q.template_blanks) check(top_.variables[checked(blank)].empty(), "a blank node with a name");
    for (const Node& n : q.described) node(n);
    for (const auto& group : q.group_by) {
      expression(group.expression, height);
      if (group.variable) selected(*group.variable);
    }
    check(q.grouped || q.group_by.empty(), "GROUP BY without groups");
    for (const Expression& having : q.having) expression(having, height);
    for (const auto& order : q.order_by) expression(order.expression, height);
    if (q.values) values(*q.values);
    pattern(*q.where, height);
  }

 private:
  void check(bool good, const char* what) const {
    if (!good) broken(what, text_);
  }
  std::size_t checked(Variable v) const {
    check(static_cast<std::size_t>(v) < top_.variables.size(), "a variable out of range");
    return static_cast<std::size_t>(v);
  }
  void selected(Variable v) const { check(!top_.variables[checked(v)].empty(), "a hidden variable is selected"); }
  const lrt::rdf::Term& constant(std::uint32_t i) const {
    check(i < top_.constants.size(), "a constant out of range");
    return top_.constants[i];
  }
  void is_iri(lrt::query::Constant c) const { check(constant(static_cast<std::uint32_t>(c)).view().is_iri(), "a name that is no IRI"); }
  void node(const Node& n) const {
    if (n.is_variable()) checked(static_cast<Variable>(n.index));
    else constant(n.index);
  }
  void triples(const std::vector<TriplePattern>& all, std::size_t height) const {
    for (const TriplePattern& t : all) {
      node(t.subject);
      node(t.object);
      if (!t.path) {
        node(t.predicate);
        continue;
      }
      check(t.path->kind > Path::Kind::sequence, "a path that triples can say");
      path(*t.path, height + 1);
    }
  }
  void path(const Path& p, std::size_t height) const {
    check(height <= most_ + 4 * depth_, "a path too high");
    const std::size_t n = p.parts.size();
    switch (p.kind) {
      case Path::Kind::link: is_iri(p.predicate); break;
      case Path::Kind::inverse: check(n == 1 && p.parts[0].kind == Path::Kind::link, "an inverse of no link"); break;
      case Path::Kind::sequence:
      case Path::Kind::alternative: check(n >= 2, "a chain of less than two"); break;
      case Path::Kind::negated: check(n == 0, "a negated set with parts"); break;
      default: check(n == 1, "a repetition of not one"); break;
    }
    for (const auto c : p.excluded) is_iri(c);
    for (const auto c : p.excluded_inverse) is_iri(c);
    for (const Path& part : p.parts) path(part, height + 1);
  }
  void values(const Values& v) const {
    for (const Variable variable : v.variables) selected(variable);
    for (const auto& row : v.rows) {
      check(row.size() == v.variables.size(), "a row of another length");
      for (const auto& value : row) {
        if (value) check(!constant(static_cast<std::uint32_t>(*value)).view().is_blank(), "a blank node in VALUES");
      }
    }
  }
  void expression(const Expression& e, std::size_t height) {
    check(height <= most_ + 2, "an expression too high");
    if (e.op == Operator::variable) selected(static_cast<Variable>(e.index));
    if (e.op == Operator::constant || e.op == Operator::call) constant(e.index);
    check((e.op == Operator::exists || e.op == Operator::not_exists) == (e.pattern != nullptr), "a pattern where none is");
    if (e.op >= Operator::or_ && e.op <= Operator::divide && e.op != Operator::not_ && e.op != Operator::in && e.op != Operator::not_in) {
      check(e.arguments.size() >= 2, "an operator of less than two");
    }
    for (const Expression& argument : e.arguments) expression(argument, height + 1);
    if (e.pattern) pattern(*e.pattern, height + 1);
  }
  void pattern(const Pattern& p, std::size_t height) {
    check(height <= most_ + 2, "a pattern too high");
    const std::size_t n = p.parts.size();
    switch (p.kind) {
      case Pattern::Kind::triples: triples(p.triples, height); break;
      case Pattern::Kind::join:
      case Pattern::Kind::union_: check(n >= 2, "a chain of less than two"); break;
      case Pattern::Kind::left_join:
      case Pattern::Kind::minus: check(n == 2, "an operation of not two"); break;
      case Pattern::Kind::filter: check(n == 1 && p.condition, "a filter of not one"); break;
      case Pattern::Kind::extend:
        check(n == 1 && p.condition, "an extension of not one");
        selected(p.variable);
        break;
      case Pattern::Kind::graph:
        check(n == 1, "a graph of not one");
        node(p.node);
        break;
      case Pattern::Kind::values: values(p.values); break;
      case Pattern::Kind::select:
        check(p.query != nullptr, "no query");
        query(*p.query, height + 1);
        break;
    }
    if (p.condition) expression(*p.condition, height + 1);
    for (const auto& part : p.parts) {
      check(part != nullptr, "no part");
      pattern(*part, height + 1);
    }
  }

  const Query& top_;
  const std::size_t most_, depth_;
  const std::string& text_;
};

/// What is done with a query that was read.
void use(const Query& query, const ParseOptions& options, const std::string& text) { Checker(query, options, text).query(query, 1); }

/// A few graphs with all kinds of terms.
const lrt::query::Dataset& small_dataset() {
  static const auto* const all = [] {
    auto* const data = new lrt::query::Dataset();
    const auto put = [&](const char* name, const char* turtle) {
      lrt::rdf::ReadOptions options;
      options.base = "http://example.org/a/";
      data->put(name, lrt::rdf::read(std::string("@prefix : <http://example.org/> . ") + turtle, lrt::rdf::Syntax::turtle, options).value());
    };
    put("http://example.org/g1", ":a :p :b, 1, 2.5, \"x\", \"y\"@en ; :q [ :p _:n ; :r 1e3 ] . :b :p :c . :c :p :a .");
    put("http://example.org/g2",
        ":a :q \"2020-01-01T00:00:00Z\"^^<http://www.w3.org/2001/XMLSchema#dateTime>, true, \"z\"^^:t . :b :r ( 1 :a \"l\" ) . :d :p :d .");
    return data;
  }();
  return *all;
}

/// Evaluates a query and writes its answer.
void answer(const Query& query, const std::string& text) {
  lrt::query::Bounds bounds;
  bounds.time = std::chrono::seconds(5);  // with sanitizers; the steps are what counts
  bounds.steps = 20'000;
  bounds.rows = 50;
  bounds.bytes = 256 * 1024;
  const std::atomic<bool> cancelled{false};
  (void)lrt::query::dependencies_of(query);
  const auto found = lrt::query::evaluate(query, small_dataset(), bounds, cancelled, std::chrono::system_clock::time_point());
  if (!found) {
    if (found.error().code == lrt::Errc::timed_out) broken("20,000 steps that take 5 s", text);
    if (found.error().code != lrt::Errc::limit_exceeded) broken("an error that is no limit", text);
    return;
  }
  if (const auto* const table = std::get_if<lrt::query::Table>(&*found)) {
    if (table->rows() > bounds.rows) broken("more rows than the bound", text);
    for (const auto format :
         {lrt::query::ResultFormat::json, lrt::query::ResultFormat::xml, lrt::query::ResultFormat::csv, lrt::query::ResultFormat::tsv})
      (void)lrt::query::write(*table, format);
  } else if (const auto* const graph = std::get_if<lrt::rdf::Graph>(&*found)) {
    if (graph->size() > bounds.rows) broken("more triples than the bound", text);
    if (const auto written = lrt::rdf::write(*graph, lrt::rdf::Syntax::n_triples)) {
      const auto read = lrt::rdf::read(*written, lrt::rdf::Syntax::n_triples, {});
      if (!read || read->size() != graph->size()) broken("a graph that cannot be read back", text);
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  ParseOptions options;
  options.base = "http://example.org/a/b";
  options.max_depth = 12;
  options.max_triples = 200;
  options.max_term_bytes = 20'000;
  const auto parsed = lrt::query::parse(text, options);
  const bool again = lrt::query::parse(text + "\n# comment", options).has_value();
  if (again != parsed.has_value() && size + 16 < options.max_bytes) broken("a comment at the end changes what is read", text);
  if (parsed) {
    use(**parsed, options, text);
    answer(**parsed, text);
  } else {
    const lrt::Error& error = parsed.error();
    if (error.message.empty()) broken("an error without a word", text);
    if (error.offset && *error.offset > size) broken("an error behind the end", text);
    if (error.code == lrt::Errc::expected_rdf && !error.offset) broken("an error without a place", text);
  }
  return 0;
}

// SPDX-License-Identifier: Apache-2.0
#include "src/query/dependencies.hpp"

#include <algorithm>
#include <set>

#include <lrt/rdf/vocab.hpp>

namespace lrt::query {
namespace {

class Finder {
 public:
  explicit Finder(const Query& query) : query_(query), restricted_(!query.from.empty() || !query.from_named.empty()) {}

  Dependencies find() {
    if (query_.form == Query::Form::describe) {
      out_.everything = true;
      reads_default_graph();
    }
    walk(query_);
    out_.predicates.assign(predicates_.begin(), predicates_.end());
    if (!any_type_) out_.types.assign(types_.begin(), types_.end());
    if (!any_graph_) out_.graphs.assign(graphs_.begin(), graphs_.end());
    return std::move(out_);
  }

 private:
  /// The graphs in which a pattern is matched.
  enum class Place { default_graph, some_graph, one_graph };

  std::string text_of(std::uint32_t constant) const { return std::string(query_.constants[constant].view().text); }
  void reads_default_graph() {
    if (restricted_) graphs_.insert(query_.from.begin(), query_.from.end());
    else any_graph_ = true;
  }
  void reads(Place place, std::uint32_t graph) {
    switch (place) {
      case Place::default_graph: reads_default_graph(); break;
      case Place::some_graph:
        if (restricted_) graphs_.insert(query_.from_named.begin(), query_.from_named.end());
        else any_graph_ = true;
        break;
      case Place::one_graph: graphs_.insert(text_of(graph));
    }
  }

  void walk(const Query& query) {
    walk(*query.where, Place::default_graph, 0);
    walk_expressions(query, Place::default_graph, 0);
  }
  void walk_expressions(const Query& query, Place place, std::uint32_t graph) {
    for (const Query::Column& column : query.columns) {
      if (column.expression) walk(*column.expression, place, graph);
    }
    for (const Query::Group& group : query.group_by) walk(group.expression, place, graph);
    for (const Expression& condition : query.having) walk(condition, place, graph);
    for (const Query::Order& order : query.order_by) walk(order.expression, place, graph);
  }

  void walk(const Expression& expression, Place place, std::uint32_t graph) {
    switch (expression.op) {
      case Operator::now:
      case Operator::rand:
      case Operator::uuid:
      case Operator::struuid: out_.uses_now_or_random = true; break;
      default: break;
    }
    for (const Expression& argument : expression.arguments) walk(argument, place, graph);
    if (expression.pattern) walk(*expression.pattern, place, graph);
  }

  void walk(const Pattern& pattern, Place place, std::uint32_t graph) {
    if (pattern.condition) walk(*pattern.condition, place, graph);
    if (pattern.kind == Pattern::Kind::triples) {
      if (!pattern.triples.empty()) reads(place, graph);
      for (const TriplePattern& triple : pattern.triples) {
        if (triple.path) {
          if (walk(*triple.path) && !has_term(pattern, triple.subject) && !has_term(pattern, triple.object)) out_.everything = true;
        } else if (triple.predicate.is_variable()) {
          out_.everything = true;
        } else {
          const std::string predicate = text_of(triple.predicate.index);
          if (predicate == vocab::rdf_::type.text) {
            if (triple.object.is_variable()) any_type_ = true;
            else types_.insert(text_of(triple.object.index));
          }
          predicates_.insert(predicate);
        }
      }
    } else if (pattern.kind == Pattern::Kind::graph) {
      if (pattern.node.is_variable()) place = Place::some_graph;
      else place = Place::one_graph, graph = pattern.node.index;
      reads(place, graph);
      if (!needs_triple(*pattern.parts[0])) out_.everything = true;  // an added or removed graph is enough
    } else if (pattern.kind == Pattern::Kind::select) {
      walk(*pattern.query->where, place, graph);
      walk_expressions(*pattern.query, place, graph);
    }
    for (const auto& part : pattern.parts) walk(*part, place, graph);
  }

  /// Whether each solution has a triple of a known predicate.
  static bool needs_triple(const Pattern& pattern) {
    switch (pattern.kind) {
      case Pattern::Kind::triples: return std::any_of(pattern.triples.begin(), pattern.triples.end(), [](const TriplePattern& t) { return !t.path; });
      case Pattern::Kind::join: return std::any_of(pattern.parts.begin(), pattern.parts.end(), [](const auto& part) { return needs_triple(*part); });
      case Pattern::Kind::union_:
        return std::all_of(pattern.parts.begin(), pattern.parts.end(), [](const auto& part) { return needs_triple(*part); });
      case Pattern::Kind::left_join:
      case Pattern::Kind::minus:
      case Pattern::Kind::filter:
      case Pattern::Kind::extend: return needs_triple(*pattern.parts[0]);
      default: return false;
    }
  }

  /// Whether an end of a path is a term or a variable of another triple. The evaluation then begins there instead of at every node.
  static bool has_term(const Pattern& pattern, const Node& node) {
    if (!node.is_variable()) return true;
    const auto is = [&](const Node& other) { return other.is_variable() && other.index == node.index; };
    return std::any_of(pattern.triples.begin(), pattern.triples.end(),
                       [&](const TriplePattern& t) { return !t.path && (is(t.subject) || is(t.object)); });
  }

  /// @return  whether the path may have no length
  bool walk(const Path& path) {
    bool any = false, all = true;
    for (const Path& part : path.parts) {
      const bool empty = walk(part);
      any = any || empty;
      all = all && empty;
    }
    switch (path.kind) {
      case Path::Kind::link: {
        const std::string predicate = text_of(static_cast<std::uint32_t>(path.predicate));
        any_type_ = any_type_ || predicate == vocab::rdf_::type.text;
        predicates_.insert(predicate);
        return false;
      }
      case Path::Kind::negated: out_.everything = true; return false;
      case Path::Kind::zero_or_more:
      case Path::Kind::zero_or_one: return true;
      case Path::Kind::sequence: return all;
      default: return any;
    }
  }

  const Query& query_;
  bool restricted_, any_graph_ = false, any_type_ = false;
  std::set<std::string> predicates_, graphs_, types_;
  Dependencies out_;
};

}  // namespace

Dependencies dependencies_of(const Query& query) { return Finder(query).find(); }

}  // namespace lrt::query

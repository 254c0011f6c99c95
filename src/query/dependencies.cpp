#include "src/query/dependencies.hpp"

#include <algorithm>

namespace lrt::query {

namespace {

/// Visits all patterns and expressions. The parser bounds how deep they are.
class Search {
 public:
  Search(const Query& outermost, Dependencies& found) : constants_(outermost.constants), found_(found) {}

  void visit(const Query& query) {
    if (query.form == Query::Form::describe) found_.everything = true;
    visit(*query.where);
    for (const Query::Column& column : query.columns)
      if (column.expression) visit(*column.expression);
    for (const Query::Group& group : query.group_by) visit(group.expression);
    for (const Expression& expression : query.having) visit(expression);
    for (const Query::Order& order : query.order_by) visit(order.expression);
  }

 private:
  void visit(const Pattern& pattern) {
    for (const TriplePattern& t : pattern.triples) {
      if (t.path) visit(*t.path);
      else if (t.predicate.is_variable()) found_.everything = true;
      else add(static_cast<Constant>(t.predicate.index));
    }
    // Which graphs there are may count, whatever is in them.
    if (pattern.kind == Pattern::Kind::graph && pattern.node.is_variable() && is_empty(*pattern.parts[0])) found_.everything = true;
    for (const auto& part : pattern.parts) visit(*part);
    if (pattern.condition) visit(*pattern.condition);
    if (pattern.query) visit(*pattern.query);
  }
  static bool is_empty(const Pattern& pattern) { return pattern.kind == Pattern::Kind::triples ? pattern.triples.empty() : has_no_triples(pattern); }
  static bool has_no_triples(const Pattern& pattern) {
    return !pattern.query && std::all_of(pattern.parts.begin(), pattern.parts.end(), [](const auto& part) { return is_empty(*part); });
  }
  /// `*` and `?` also join each node with itself, so that any triple may count unless an end is fixed; the rest is what the links are.
  void visit(const Path& path) {
    switch (path.kind) {
      case Path::Kind::link: return add(path.predicate);
      case Path::Kind::negated:
      case Path::Kind::zero_or_more:
      case Path::Kind::zero_or_one: found_.everything = true; return;
      default:
        for (const Path& part : path.parts) visit(part);
    }
  }
  void visit(const Expression& expression) {
    switch (expression.op) {
      case Operator::now:
      case Operator::rand:
      case Operator::uuid:
      case Operator::struuid: found_.uses_now_or_random = true; break;
      default: break;
    }
    if (expression.pattern) visit(*expression.pattern);
    for (const Expression& argument : expression.arguments) visit(argument);
  }
  void add(Constant predicate) {
    const std::string_view iri = constants_[static_cast<std::size_t>(predicate)].view().text;
    if (std::find(found_.predicates.begin(), found_.predicates.end(), iri) == found_.predicates.end()) found_.predicates.emplace_back(iri);
  }

  const std::vector<rdf::Term>& constants_;
  Dependencies& found_;
};

}  // namespace

Dependencies dependencies_of(const Query& query) {
  Dependencies found;
  Search(query, found).visit(query);
  if (found.everything) found.predicates.clear();
  return found;
}

}  // namespace lrt::query

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <iterator>

#include <lrt/rdf/vocab.hpp>

#include "src/query/grammar.hpp"

namespace lrt::query {
namespace {

std::unique_ptr<Pattern> make_pattern(Pattern::Kind kind) {
  auto pattern = std::make_unique<Pattern>();
  pattern->kind = kind;
  return pattern;
}

bool is_empty(const Pattern& pattern) noexcept { return pattern.kind == Pattern::Kind::triples && pattern.triples.empty(); }

/// Adds a part to a sequence or alternative. Parts of the same kind become its own.
void add_part(Path& whole, Path&& part) {
  if (part.kind != whole.kind) {
    whole.parts.push_back(std::move(part));
  } else {
    std::move(part.parts.begin(), part.parts.end(), std::back_inserter(whole.parts));
  }
}

}  // namespace

// --- groups

bool Grammar::group_pattern(Part& out) {
  Group group_read;
  if (!group(group_read)) return false;
  out = std::move(group_read.part);
  if (group_read.filters.empty()) return true;
  Tree condition = all_of(std::move(group_read.filters));
  auto filter = make_pattern(Pattern::Kind::filter);
  filter->parts.push_back(std::move(out.pattern));
  filter->condition = std::move(condition.expression);
  out.pattern = std::move(filter);
  out.height = std::max(out.height, condition.height) + 1;
  return fits(out.height);
}

Grammar::Tree Grammar::all_of(std::vector<Tree>&& conditions) {
  if (conditions.size() == 1) return std::move(conditions.front());
  Tree all;
  all.expression.op = Operator::and_;
  for (Tree& condition : conditions) {
    all.height = std::max(all.height, condition.height + 1);
    all.expression.arguments.push_back(std::move(condition.expression));
  }
  return all;
}

/// GroupGraphPattern. Its part always has a pattern.
bool Grammar::group(Group& out) {
  const Nested nested(*this);
  if (!nested.allowed() || !require("{")) return false;
  const Restored<Aggregates> aggregates(aggregates_, Aggregates::refused);
  const Restored<std::size_t> basic_pattern(basic_pattern_, ++last_basic_pattern_);
  if (is_word("SELECT") ? !sub_select(out.part) : !group_elements(out)) return false;
  if (!out.part.pattern) out.part.pattern = make_pattern(Pattern::Kind::triples);
  return true;
}

bool Grammar::sub_select(Part& out) {
  const Restored<bool> has_aggregate(has_aggregate_, false);
  const Restored<Target> target(target_, {});
  out.pattern = make_pattern(Pattern::Kind::select);
  out.pattern->query = std::make_unique<Query>();
  return select_query(*out.pattern->query, out, false) && require("}") && fits(++out.height);
}

bool Grammar::starts_element() const {
  if (is_punctuation("{")) return true;
  if (!is(Token::Kind::word)) return false;
  for (const std::string_view word : {"OPTIONAL", "FILTER", "BIND", "GRAPH", "MINUS", "VALUES", "SERVICE"}) {
    if (is_word(word)) return true;
  }
  return false;
}

bool Grammar::group_elements(Group& out) {
  bool dot_wanted = false;  // between triples
  for (;;) {
    if (accept("}")) return true;
    if (starts_element()) {
      if (!element(out)) return false;
      accept(".");
      dot_wanted = false;
    } else if (dot_wanted || !starts_node()) {
      return expected(dot_wanted ? "'.', '}' or the beginning of a pattern" : "triples, a pattern or '}'");
    } else {
      Part part;
      if (out.open == nullptr) part.pattern = make_pattern(Pattern::Kind::triples);
      Pattern* const open = part.pattern ? part.pattern.get() : out.open;
      const Restored<Target> target(target_, {&open->triples, &out.part.scope, nullptr, true});
      if (!triples_same_subject()) return false;
      if (part.pattern) join(out, std::move(part));
      out.open = open;
      dot_wanted = !accept(".");
    }
  }
}

/// GraphPatternNotTriples. All but FILTER end the basic graph pattern.
bool Grammar::element(Group& group) {
  if (accept_word("FILTER")) {
    Tree condition;
    if (!constraint(condition)) return false;
    group.filters.push_back(std::move(condition));
    return true;
  }
  if (is_word("SERVICE")) {
    return fail(token_.at, "SERVICE is not supported: this endpoint does not query other endpoints", Errc::unsupported_syntax);
  }
  const bool read = is_punctuation("{")       ? group_or_union(group)
                    : accept_word("OPTIONAL") ? optional(group)
                    : accept_word("MINUS")    ? minus(group)
                    : accept_word("GRAPH")    ? graph(group)
                    : accept_word("BIND")     ? bind(group)
                                              : require_word("VALUES") && inline_data(group);
  group.open = nullptr;
  basic_pattern_ = ++last_basic_pattern_;
  return read && fits(group.part.height);
}

/// Join(group, part), without the empty pattern. Joins in each other become one.
void Grammar::join(Group& group, Part&& part) {
  group.open = nullptr;
  group.part.scope.add(part.scope.variables());
  if (is_empty(*part.pattern)) return;
  if (!group.part.pattern) {
    group.part.pattern = std::move(part.pattern);
    group.part.height = part.height;
    return;
  }
  if (group.part.pattern->kind != Pattern::Kind::join) {
    auto joined = make_pattern(Pattern::Kind::join);
    joined->parts.push_back(std::move(group.part.pattern));
    group.part.pattern = std::move(joined);
    ++group.part.height;
  }
  auto& parts = group.part.pattern->parts;
  if (part.pattern->kind == Pattern::Kind::join) {
    std::move(part.pattern->parts.begin(), part.pattern->parts.end(), std::back_inserter(parts));
    group.part.height = std::max(group.part.height, part.height);
  } else {
    parts.push_back(std::move(part.pattern));
    group.part.height = std::max(group.part.height, part.height + 1);
  }
}

/// An operation with what stands before in the group as its first part.
bool Grammar::combine(Group& group, Pattern::Kind kind, Part&& right, std::optional<Tree> condition) {
  auto pattern = make_pattern(kind);
  pattern->parts.push_back(group.part.pattern ? std::move(group.part.pattern) : make_pattern(Pattern::Kind::triples));
  std::size_t height = group.part.height;
  if (right.pattern) {
    pattern->parts.push_back(std::move(right.pattern));
    height = std::max(height, right.height);
  }
  if (condition) {
    height = std::max(height, condition->height);
    pattern->condition = std::move(condition->expression);
  }
  group.part.pattern = std::move(pattern);
  group.part.height = height + 1;
  group.open = nullptr;
  return fits(group.part.height);
}

bool Grammar::group_or_union(Group& group) {
  Part first;
  if (!group_pattern(first)) return false;
  if (is_word("UNION")) {
    auto pattern = make_pattern(Pattern::Kind::union_);
    pattern->parts.push_back(std::move(first.pattern));
    while (accept_word("UNION")) {
      Part next;
      if (!group_pattern(next)) return false;
      pattern->parts.push_back(std::move(next.pattern));
      first.height = std::max(first.height, next.height);
      first.scope.add(next.scope.variables());
    }
    first.pattern = std::move(pattern);
    ++first.height;
  }
  join(group, std::move(first));
  return true;
}

/// The filters of the group are the condition of the left join.
bool Grammar::optional(Group& left) {
  Group right;
  if (!group(right)) return false;
  std::optional<Tree> condition;
  if (!right.filters.empty()) condition = all_of(std::move(right.filters));
  left.part.scope.add(right.part.scope.variables());
  return combine(left, Pattern::Kind::left_join, std::move(right.part), std::move(condition));
}

bool Grammar::minus(Group& group) {
  Part right;
  return group_pattern(right) && combine(group, Pattern::Kind::minus, std::move(right), std::nullopt);
}

bool Grammar::graph(Group& group) {
  Part part, inner;
  part.pattern = make_pattern(Pattern::Kind::graph);
  Variable variable{};
  Constant name{};
  if (is(Token::Kind::variable)) {
    if (!named_variable(variable)) return false;
    part.pattern->node = variable;
    part.scope.add(variable);
  } else {
    if (!starts_iri()) return expected("a variable or an IRI");
    if (!iri(name)) return false;
    part.pattern->node = name;
  }
  if (!group_pattern(inner)) return false;
  part.pattern->parts.push_back(std::move(inner.pattern));
  part.height = inner.height + 1;
  part.scope.add(inner.scope.variables());
  join(group, std::move(part));
  return true;
}

bool Grammar::bind(Group& group) {
  Tree tree;
  if (!require("(") || !expression(tree) || !require_word("AS")) return false;
  const char* const from = token_.at;
  Variable variable{};
  if (!named_variable(variable) || !require(")")) return false;
  if (group.part.scope.has(variable)) return fail(from, "BIND of " + name_of(variable) + ", which the group has already");
  if (!combine(group, Pattern::Kind::extend, {}, std::move(tree))) return false;
  group.part.pattern->variable = variable;
  group.part.scope.add(variable);
  return true;
}

bool Grammar::inline_data(Group& group) {
  Part part;
  part.pattern = make_pattern(Pattern::Kind::values);
  if (!data_block(part.pattern->values)) return false;
  part.scope.add(part.pattern->values.variables);
  join(group, std::move(part));
  return true;
}

// --- triples

/// `{ triples }` of a template or of CONSTRUCT WHERE.
bool Grammar::triples_in_braces(Target target) {
  const Restored<Target> restored(target_, target);
  const Restored<std::size_t> basic_pattern(basic_pattern_, ++last_basic_pattern_);
  if (!require("{")) return false;
  bool dot_wanted = false;
  while (!accept("}")) {
    if (dot_wanted || !starts_node()) return expected(dot_wanted ? "'.' or '}'" : "triples or '}'");
    if (!triples_same_subject()) return false;
    dot_wanted = !accept(".");
  }
  return true;
}

bool Grammar::triples_same_subject() {
  Node subject;
  const std::size_t before = target_.triples->size();
  if (!node(subject)) return false;
  const bool complete = target_.triples->size() != before;  // brackets with triples in them
  return (complete && !starts_verb()) || property_list(subject);
}

bool Grammar::starts_verb() const {
  if (is(Token::Kind::variable) || starts_iri() || (is(Token::Kind::word) && token_.text == "a")) return true;
  return target_.paths && (is_punctuation("^") || is_punctuation("!") || is_punctuation("("));
}

bool Grammar::property_list(const Node& subject) {
  for (;;) {
    Verb predicate;
    if (!verb(predicate)) return false;
    do {
      Node object;
      if (!node(object) || !emit(subject, predicate, object)) return false;
    } while (accept(","));
    if (!accept(";")) return true;
    while (accept(";")) {}
    if (!starts_verb()) return true;
  }
}

bool Grammar::verb(Verb& out) {
  if (!starts_verb()) return expected("a predicate");
  if (is(Token::Kind::variable)) {
    Variable variable{};
    if (!named_variable(variable)) return false;
    if (target_.scope != nullptr) target_.scope->add(variable);
    out.predicate = variable;
    return true;
  }
  Path read;
  if (target_.paths ? !path(read, false) : !type_or_iri(read.predicate)) return false;
  out.predicate = read.predicate;
  if (read.kind != Path::Kind::link) out.path = std::make_shared<const Path>(std::move(read));
  return true;
}

bool Grammar::add(TriplePattern&& triple) {
  if (++triples_ > options_.max_triples) return exceeds(token_.at, "more than " + std::to_string(options_.max_triples) + " triple patterns");
  target_.triples->push_back(std::move(triple));
  return true;
}

/// A triple, or what a path means (18.2.2.4).
bool Grammar::emit(const Node& subject, const Verb& verb, const Node& object) {
  if (!verb.path) return add({subject, verb.predicate, object});
  const Path& path = *verb.path;
  switch (path.kind) {
    case Path::Kind::link: return add({subject, path.predicate, object});
    case Path::Kind::inverse: return add({object, path.parts.front().predicate, subject});
    case Path::Kind::sequence: {
      Node from = subject;
      for (const Path& part : path.parts) {
        const Node to = &part == &path.parts.back() ? object : Node(hidden_variable());
        if (!emit(from, {{}, std::shared_ptr<const Path>(verb.path, &part)}, to)) return false;
        from = to;
      }
      return true;
    }
    default: return add({subject, {}, object, verb.path});
  }
}

bool Grammar::starts_node() const {
  return is(Token::Kind::variable) || starts_iri() || is(Token::Kind::blank) || starts_literal() || is_punctuation("(") || is_punctuation("[");
}

/// GraphNode. Nodes in brackets emit their triples.
bool Grammar::node(Node& out) {
  if (is_punctuation("(")) return collection(out);
  if (is_punctuation("[")) return blank_node_property_list(out);
  return term(out);
}

bool Grammar::term(Node& out) {
  if (is(Token::Kind::variable)) {
    Variable variable{};
    if (!named_variable(variable)) return false;
    if (target_.scope != nullptr) target_.scope->add(variable);
    out = variable;
    return true;
  }
  if (is(Token::Kind::blank)) return blank_label_node(out);
  Constant constant{};
  if (starts_iri() ? !iri(constant) : starts_literal() ? !literal(constant) : !expected("a term or a variable")) return false;
  out = constant;
  return true;
}

bool Grammar::blank_label_node(Node& out) {
  if (target_.template_of != nullptr) {
    const Variable* there = template_labels_.find(token_.text);
    if (there == nullptr) {
      there = &template_labels_.add(token_.text, hidden_variable());
      target_.template_of->template_blanks.push_back(*there);
    }
    out = *there;
  } else {
    const Label* there = labels_.find(token_.text);
    if (there == nullptr) there = &labels_.add(token_.text, {hidden_variable(), basic_pattern_});
    if (there->basic_pattern != basic_pattern_) {
      return fail(token_.at, "the blank node label _:" + std::string(token_.text) + " is in two basic graph patterns");
    }
    out = there->variable;
  }
  advance();
  return true;
}

bool Grammar::collection(Node& out) {
  const Nested nested(*this);
  if (!nested.allowed() || !require("(")) return false;
  const Node nil = known(nil_, vocab::rdf_::nil);
  out = nil;
  std::optional<Node> last;
  while (!accept(")")) {
    if (!starts_node()) return expected("a term, a variable or ')'");
    const Variable cell = hidden_variable();
    if (target_.template_of != nullptr) target_.template_of->template_blanks.push_back(cell);
    if (!last) out = cell;
    else if (!add({*last, known(rest_, vocab::rdf_::rest), cell})) return false;
    Node item;
    if (!node(item) || !add({cell, known(first_, vocab::rdf_::first), item})) return false;
    last = cell;
  }
  return !last || add({*last, known(rest_, vocab::rdf_::rest), nil});
}

/// `[ predicate object ... ]`, or `[]`.
bool Grammar::blank_node_property_list(Node& out) {
  const Nested nested(*this);
  if (!nested.allowed() || !require("[")) return false;
  const Variable blank = hidden_variable();
  if (target_.template_of != nullptr) target_.template_of->template_blanks.push_back(blank);
  out = blank;
  return accept("]") || (property_list(out) && require("]"));
}

// --- paths: `inverted` paths lead from the end to the beginning, so that ^ comes to stand in front of links only

bool Grammar::path(Path& out, bool inverted) {
  const Nested nested(*this);
  if (!nested.allowed() || !path_sequence(out, inverted)) return false;
  if (!is_punctuation("|")) return true;
  Path whole;
  whole.kind = Path::Kind::alternative;
  add_part(whole, std::move(out));
  while (accept("|")) {
    Path next;
    if (!path_sequence(next, inverted)) return false;
    add_part(whole, std::move(next));
  }
  out = std::move(whole);
  return true;
}

bool Grammar::path_sequence(Path& out, bool inverted) {
  std::vector<Path> parts(1);
  if (!path_element(parts.back(), inverted)) return false;
  while (accept("/")) {
    if (!path_element(parts.emplace_back(), inverted)) return false;
  }
  if (parts.size() == 1) {
    out = std::move(parts.front());
    return true;
  }
  if (inverted) std::reverse(parts.begin(), parts.end());
  out.kind = Path::Kind::sequence;
  for (Path& part : parts) add_part(out, std::move(part));
  return true;
}

/// PathEltOrInverse: ^ binds weaker than * + and ?.
bool Grammar::path_element(Path& out, bool inverted) {
  if (accept("^")) inverted = !inverted;
  if (!path_primary(out, inverted)) return false;
  const bool many = is_punctuation("*"), some = is_punctuation("+");
  if (many || some || is_punctuation("?")) {
    Path repeated;
    repeated.kind = many ? Path::Kind::zero_or_more : some ? Path::Kind::one_or_more : Path::Kind::zero_or_one;
    repeated.parts.push_back(std::move(out));
    out = std::move(repeated);
    advance();
  }
  return true;
}

bool Grammar::path_primary(Path& out, bool inverted) {
  if (accept("(")) return path(out, inverted) && require(")");
  if (accept("!")) {
    if (!negated_set(out)) return false;
    if (inverted) std::swap(out.excluded, out.excluded_inverse);
    return true;
  }
  if (!starts_iri() && !(is(Token::Kind::word) && token_.text == "a")) return expected("a property path");
  if (!inverted) return type_or_iri(out.predicate);
  out.kind = Path::Kind::inverse;
  return type_or_iri(out.parts.emplace_back().predicate);
}

bool Grammar::negated_set(Path& out) {
  out.kind = Path::Kind::negated;
  if (!accept("(")) return negated_one(out);
  if (accept(")")) return true;
  do {
    if (!negated_one(out)) return false;
  } while (accept("|"));
  return accept(")") || expected("'|' or ')'");
}

bool Grammar::negated_one(Path& out) {
  auto& excluded = accept("^") ? out.excluded_inverse : out.excluded;
  return type_or_iri(excluded.emplace_back());
}

}  // namespace lrt::query

// SPDX-License-Identifier: Apache-2.0
#include "src/query/evaluate.hpp"

#include <cstddef>
#include <cstdint>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "src/query/budget.hpp"
#include "src/query/plan.hpp"
#include "src/query/solver.hpp"

namespace lrt::query {
namespace {

// What stands around a term and around a row or triple in the longest format: XML. The names of variables and predicates are counted apart.
constexpr std::size_t around_term = 64, around_row = 24;

/// The size of a text in the format that needs most: JSON for control characters, else XML.
std::size_t written_size(std::string_view text) noexcept {
  std::size_t size = text.size();
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F || c == '"') size += 5;
    else if (c == '&') size += 4;
    else if (c == '<' || c == '>') size += 3;
    else if (c == '\\') size += 1;
  }
  return size;
}

/// Counts the memory that a result keeps for each term.
class AnswerTerms {
 public:
  explicit AnswerTerms(Run& run) noexcept : run_(run) {}
  /// @return  the size of the term in a document at most
  std::size_t count(TermNumber term) {
    constexpr std::size_t of_entry = 128;
    const auto [at, is_new] = sizes_.try_emplace(term, around_term);
    if (!is_new) return at->second;
    const rdf::TermView view = run_.terms.term(term);
    run_.budget.work(view.text.size());
    run_.budget.take(of_entry + view.text.size() + view.language.size());
    at->second += written_size(view.text);
    if (view.is_literal()) at->second += view.language.empty() ? view.datatype.size() : view.language.size();
    return at->second;
  }

 private:
  Run& run_;
  std::unordered_map<TermNumber, std::size_t> sizes_;
};

/// A graph that is an answer: each blank node has a new one in it.
class AnswerGraph {
 public:
  explicit AnswerGraph(Run& run) noexcept : run_(run), terms_(run) {}
  rdf::Graph graph;

  struct Node {
    rdf::TermId id{};
    std::size_t size = around_term;  // in a document at most
  };
  Node node(TermNumber term) {
    const auto [at, is_new] = nodes_.try_emplace(term);
    if (is_new) {
      at->second.size = terms_.count(term);
      run_.budget.take(64);
      const rdf::TermView view = run_.terms.term(term);
      at->second.id = view.is_blank() ? graph.fresh_blank() : graph.intern(view);
    }
    return at->second;
  }
  Node fresh_blank() {
    run_.budget.take(64);
    Node node;
    node.id = graph.fresh_blank();
    return node;
  }
  void add(const Node& subject, const Node& predicate, const Node& object) {
    run_.budget.step();
    if (!graph.add(subject.id, predicate.id, object.id)) return;
    run_.budget.row();
    run_.budget.take(64);
    run_.budget.answer(subject.size + 2 * predicate.size + object.size + around_row);  // an element of XML has its name twice
  }

 private:
  Run& run_;
  AnswerTerms terms_;
  std::unordered_map<TermNumber, Node> nodes_;
};

Answer select(Run& run, const Query& query) {
  std::vector<Slot> output;
  std::vector<std::string> names;
  for (const Query::Column& column : query.columns) {
    output.push_back(number(column.variable));
    names.push_back(query.variables[number(column.variable)]);
  }
  Planner planner(run);
  Frame frame;
  planner.add_frame(frame);
  Solver solver(run, planner, query, output, {}, frame);
  planner.finish();
  Table table(std::move(names));
  AnswerTerms terms(run);
  std::unordered_map<TermNumber, std::string> labels;
  solver.solve([&](const TermNumber* row) {
    run.budget.row();
    run.budget.take(output.size() * sizeof(TermNumber));
    run.budget.answer(around_row);
    table.add_row();
    for (std::size_t i = 0; i < output.size(); ++i) {
      if (row[i] == nothing) continue;
      run.budget.answer(terms.count(row[i]) + table.variables()[i].size());
      rdf::TermView view = run.terms.term(row[i]);
      if (view.is_blank()) {
        const auto [label, is_new] = labels.try_emplace(row[i]);
        if (is_new) {
          run.budget.take(64);
          label->second = "b" + std::to_string(labels.size() - 1);
        }
        view.text = label->second;
      }
      table.set(i, view);
    }
    return true;
  });
  return table;
}

Answer ask(Run& run, const Query& query) {
  Planner planner(run);
  Frame frame;
  planner.add_frame(frame);
  Solver solver(run, planner, query, {}, {}, frame);
  planner.finish();
  bool found = false;
  solver.solve([&](const TermNumber*) {
    found = true;
    return false;
  });
  return found;
}

Answer construct(Run& run, const Query& query) {
  // The variables of the template, and where they are in a solution. Blank nodes of the template are variables that nothing binds.
  std::unordered_map<std::uint32_t, std::size_t> places;
  std::vector<Slot> output;
  std::vector<bool> is_blank(query.variables.size());
  for (const Variable blank : query.template_blanks) is_blank[number(blank)] = true;
  for (const TriplePattern& triple : query.template_triples) {
    for (const Node& node : {triple.subject, triple.predicate, triple.object}) {
      if (node.is_variable() && places.try_emplace(node.index, output.size()).second) output.push_back(node.index);
    }
  }
  Planner planner(run);
  Frame frame;
  planner.add_frame(frame);
  Solver solver(run, planner, query, output, {}, frame);
  planner.finish();
  AnswerGraph answer(run);
  std::vector<std::optional<AnswerGraph::Node>> blanks(output.size());
  solver.solve([&](const TermNumber* row) {
    blanks.assign(output.size(), std::nullopt);
    for (const TriplePattern& triple : query.template_triples) {
      const auto term = [&](const Node& node) { return node.is_variable() ? row[places[node.index]] : run.constants[node.index]; };
      const auto is_new = [&](const Node& node) { return node.is_variable() && is_blank[node.index]; };
      const TermNumber terms[3] = {term(triple.subject), term(triple.predicate), term(triple.object)};
      const Node* const nodes[3] = {&triple.subject, &triple.predicate, &triple.object};
      const auto type = [&](int i) { return run.terms.value(terms[i]).type; };
      bool valid = true;
      for (int i = 0; i < 3 && valid; ++i) {
        if (is_new(*nodes[i])) valid = i != 1;
        else if (terms[i] == nothing) valid = false;
        else if (i == 0) valid = type(0) == Type::iri || type(0) == Type::blank;
        else if (i == 1) valid = type(1) == Type::iri;
      }
      if (!valid) continue;
      AnswerGraph::Node made[3];
      for (int i = 0; i < 3; ++i) {
        if (!is_new(*nodes[i])) {
          made[i] = answer.node(terms[i]);
          continue;
        }
        auto& blank = blanks[places[nodes[i]->index]];
        if (!blank) blank = answer.fresh_blank();
        made[i] = *blank;
      }
      answer.add(made[0], made[1], made[2]);
    }
    return true;
  });
  return std::move(answer.graph);
}

/// The triples with each resource as their subject, and so for the blank nodes that are their objects.
Answer describe(Run& run, const Query& query) {
  std::vector<Slot> output;
  RowSet resources(run.budget, 1);
  for (const Node& node : query.described) {
    if (node.is_variable()) output.push_back(node.index);
    else resources.insert(&run.constants[node.index]);
  }
  Planner planner(run);
  Frame frame;
  planner.add_frame(frame);
  Solver solver(run, planner, query, output, {}, frame);
  planner.finish();
  if (!output.empty()) {
    solver.solve([&](const TermNumber* row) {
      for (std::size_t i = 0; i < output.size(); ++i) {
        if (row[i] != nothing) resources.insert(&row[i]);
      }
      return true;
    });
  }
  AnswerGraph answer(run);
  for (std::size_t i = 0; i < resources.size(); ++i) {
    const TermNumber subject = *resources.row(i);
    if (subject >= run.data.term_limit()) continue;
    auto matches = run.data.match(subject, nothing, nothing, run.view.default_graph);
    bool fits = false;
    while (const NumberedTriple* triple = matches.next(fits)) {
      run.budget.step();
      if (!fits) continue;
      answer.add(answer.node(triple->subject), answer.node(triple->predicate), answer.node(triple->object));
      if (run.terms.value(triple->object).type == Type::blank) resources.insert(&triple->object);
    }
  }
  return std::move(answer.graph);
}

/// The graphs that are named; others are empty.
GraphSet graphs_named(const Dataset& data, const std::vector<std::string>& names) {
  GraphSet graphs;
  for (const std::string& name : names) {
    if (const GraphNumber graph = data.graph_named(data.find(rdf::iri(name))); graph != nothing) graphs.insert(graph);
  }
  return graphs;
}

}  // namespace

Result<Answer> evaluate(const Query& query, const Dataset& dataset, const Bounds& bounds, const std::atomic<bool>& cancelled,
                        std::chrono::system_clock::time_point now, const Selection* selection) {
  const bool of_query = !query.from.empty() || !query.from_named.empty();
  const bool of_caller = selection && (!selection->default_graphs.empty() || !selection->named_graphs.empty());
  GraphSet default_graphs, named_graphs;
  View view;
  if (of_caller || of_query) {
    default_graphs = graphs_named(dataset, of_caller ? selection->default_graphs : query.from);
    named_graphs = graphs_named(dataset, of_caller ? selection->named_graphs : query.from_named);
    view.default_graph = default_graphs.members().size() == 1 ? Scope::one(default_graphs.members()[0]) : Scope::of(default_graphs);
    view.named = &named_graphs;
  }
  try {
    Budget budget(bounds, cancelled);
    budget.check();
    Run run(query, dataset, view, budget, now);
    switch (query.form) {
      case Query::Form::select: return select(run, query);
      case Query::Form::ask: return ask(run, query);
      case Query::Form::construct: return construct(run, query);
      case Query::Form::describe: return describe(run, query);
    }
  } catch (Ended& ended) { return unexpected(std::move(ended.error)); } catch (const std::bad_alloc&) {
    return unexpected(Errc::limit_exceeded, "not enough memory for the query");
  }
  return unexpected(Errc::failed, "the query has no form");
}

}  // namespace lrt::query

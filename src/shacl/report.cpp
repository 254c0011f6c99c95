// SPDX-License-Identifier: Apache-2.0
#include <lrt/shacl/report.hpp>

#include <unordered_map>

#include <lrt/rdf/value_codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/shacl/plan.hpp"
#include "src/shacl/messages.hpp"

namespace lrt::shacl {
namespace {

namespace sh = vocab::sh;

rdf::TermId blank_with(rdf::Graph& graph, Iri predicate, rdf::TermId object) {
  const rdf::TermId node = graph.fresh_blank();
  graph.add(node, graph.intern(predicate), object);
  return node;
}

rdf::TermId write_path(rdf::Graph& graph, const Plan& plan, PathIndex index) {
  const Path& path = plan.paths[index];
  const auto list = [&] {
    std::vector<rdf::TermId> members;
    for (const PathIndex part : path.parts) members.push_back(write_path(graph, plan, part));
    return graph.add_list(members);
  };
  switch (path.kind) {
    case Path::Kind::predicate: return graph.intern(plan.graph.term(path.predicate));
    case Path::Kind::sequence: return list();
    case Path::Kind::alternative: return blank_with(graph, sh::alternativePath, list());
    case Path::Kind::inverse: return blank_with(graph, sh::inversePath, write_path(graph, plan, path.parts.front()));
    case Path::Kind::zero_or_more: return blank_with(graph, sh::zeroOrMorePath, write_path(graph, plan, path.parts.front()));
    case Path::Kind::one_or_more: return blank_with(graph, sh::oneOrMorePath, write_path(graph, plan, path.parts.front()));
    case Path::Kind::zero_or_one: return blank_with(graph, sh::zeroOrOnePath, write_path(graph, plan, path.parts.front()));
  }
  return graph.fresh_blank();
}

/// The precedence of the context of a path. It decides where SPARQL needs parentheses.
enum class Around : std::uint8_t { nothing, list, sign };

/// In the syntax of SPARQL (SPARQL 1.1 9.1).
std::string path_text(const Plan& plan, PathIndex index, Around around) {
  const Path& path = plan.paths[index];
  const auto joined = [&](char separator) {
    std::string text;
    for (const PathIndex part : path.parts) text += (text.empty() ? "" : std::string(1, separator)) + path_text(plan, part, Around::list);
    return around == Around::nothing ? text : "(" + text + ")";
  };
  const auto with_sign = [&](const char* before, const char* after) {
    const std::string text = before + path_text(plan, path.parts.front(), Around::sign) + after;
    return around == Around::sign ? "(" + text + ")" : text;
  };
  switch (path.kind) {
    case Path::Kind::predicate: return shown(plan.graph.term(path.predicate));
    case Path::Kind::sequence: return joined('/');
    case Path::Kind::alternative: return joined('|');
    case Path::Kind::inverse: return with_sign("^", "");
    case Path::Kind::zero_or_more: return with_sign("", "*");
    case Path::Kind::one_or_more: return with_sign("", "+");
    case Path::Kind::zero_or_one: return with_sign("", "?");
  }
  return {};
}

class Writer {
 public:
  explicit Writer(rdf::Graph& graph) : graph_(graph) {}

  /// Labels of the data are reserved first, so that no new label equals one of them.
  void reserve(const std::vector<ValidationResult>& results) {
    for (const ValidationResult& r : results) {
      graph_.intern(r.focus.view());
      if (r.value) graph_.intern(r.value->view());
      reserve(r.details);
    }
  }

  void add(rdf::TermId owner, Iri predicate, const ValidationResult& r) {
    const rdf::TermId node = graph_.fresh_blank();
    graph_.add(owner, graph_.intern(predicate), node);
    put(node, vocab::rdf_::type, graph_.intern(sh::ValidationResult));
    put(node, sh::focusNode, graph_.intern(r.focus.view()));
    if (!r.path.empty()) put(node, sh::resultPath, r.path.write(graph_));
    if (r.value) put(node, sh::value, graph_.intern(r.value->view()));
    put(node, sh::sourceConstraintComponent, graph_.intern(r.component));
    put(node, sh::sourceShape, of_shapes(r.source_shape.view()));
    put(node, sh::resultSeverity, of_shapes(r.severity.view()));
    for (const rdf::Term& m : r.messages) put(node, sh::resultMessage, graph_.intern(m.view()));
    for (const ValidationResult& d : r.details) add(node, sh::detail, d);
  }

  void put(rdf::TermId subject, Iri predicate, rdf::TermId object) { graph_.add(subject, graph_.intern(predicate), object); }

 private:
  rdf::TermId of_shapes(const rdf::TermView& term) {
    if (!term.is_blank()) return graph_.intern(term);
    const auto [at, is_new] = blanks_.try_emplace(std::string(term.text));
    if (is_new) at->second = graph_.fresh_blank();
    return at->second;
  }
  rdf::Graph& graph_;
  std::unordered_map<std::string, rdf::TermId> blanks_;
};

void write_lines(std::string& out, const std::vector<ValidationResult>& results, std::size_t depth) {
  for (const ValidationResult& r : results) {
    out.append(depth * 2, ' ');
    out += shown(r.focus);
    if (!r.path.empty()) out += " " + r.path.to_string();
    out += ":";
    for (const rdf::Term& m : r.messages) out += " " + std::string(m.view().text);
    out += " [" + shown(r.component);
    if (r.severity.view() != rdf::TermView(sh::Violation)) out += ", " + shown(r.severity);
    out += "]\n";
    write_lines(out, r.details, depth + 1);
  }
}

}  // namespace

std::string PropertyPath::to_string() const {
  if (predicate_) return shown(*predicate_);
  return plan_ ? path_text(*plan_, path_, Around::nothing) : std::string();
}

std::optional<rdf::Term> PropertyPath::predicate() const {
  if (predicate_ || !plan_) return predicate_;
  const Path& path = plan_->paths[path_];
  return path.kind == Path::Kind::predicate ? std::optional(rdf::Term(plan_->graph.term(path.predicate))) : std::nullopt;
}

rdf::TermId PropertyPath::write(rdf::Graph& graph) const { return predicate_ ? graph.intern(predicate_->view()) : write_path(graph, *plan_, path_); }

rdf::Graph Report::to_graph() const {
  rdf::Graph graph;
  Writer writer(graph);
  writer.reserve(results_);
  const rdf::TermId report = graph.fresh_blank();
  writer.put(report, vocab::rdf_::type, graph.intern(sh::ValidationReport));
  writer.put(report, sh::conforms, graph.intern(rdf::literal(conforms() ? "true" : "false", vocab::xsd::boolean)));
  if (!complete_) writer.put(report, vocab::rdfs::comment, graph.intern(rdf::literal("The number of results was limited: there may be more.")));
  for (const ValidationResult& r : results_) writer.add(report, sh::result, r);
  return graph;
}

std::string Report::to_text() const {
  std::string out;
  write_lines(out, results_, 0);
  if (!complete_) out += "(the number of results was limited: there may be more)\n";
  return out;
}

}  // namespace lrt::shacl

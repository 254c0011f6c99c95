// SPDX-License-Identifier: Apache-2.0
#include "examples/ex_conductor/rules.hpp"

#include <optional>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>
#include <lrt/shacl/validator.hpp>

namespace {

using lrt::rdf::Graph;
using lrt::rdf::TermView;

constexpr std::string_view shape = R"(
@prefix c: <http://example.org/conductor#> .
@prefix sh: <http://www.w3.org/ns/shacl#> .
c:RuleShape a sh:NodeShape ;
    sh:targetClass c:Rule ;
    sh:nodeKind sh:IRI ;
    sh:property [ sh:path c:when ; sh:minCount 1 ; sh:maxCount 1 ; sh:node c:WhenShape ] ,
                [ sh:path c:then ; sh:minCount 1 ; sh:maxCount 1 ; sh:node c:ThenShape ] .
c:WhenShape a sh:NodeShape ;
    sh:property [ sh:path c:thing ; sh:minCount 1 ; sh:maxCount 1 ; sh:nodeKind sh:IRI ] ,
                [ sh:path c:property ; sh:minCount 1 ; sh:maxCount 1 ; sh:nodeKind sh:IRI ] ,
                [ sh:path c:unit ; sh:minCount 1 ; sh:maxCount 1 ; sh:nodeKind sh:IRI ] ;
    sh:xone ( [ sh:property [ sh:path c:above ; sh:minCount 1 ; sh:maxCount 1 ] ]
              [ sh:property [ sh:path c:below ; sh:minCount 1 ; sh:maxCount 1 ] ] ) .
c:ThenShape a sh:NodeShape ;
    sh:property [ sh:path c:on ; sh:minCount 1 ; sh:maxCount 1 ; sh:in ( c:others c:same ) ] ,
                [ sh:path c:thing ; sh:minCount 1 ; sh:maxCount 1 ; sh:nodeKind sh:IRI ] ,
                [ sh:path c:affects ; sh:minCount 1 ; sh:maxCount 1 ; sh:nodeKind sh:IRI ] ,
                [ sh:path c:input ; sh:minCount 1 ; sh:maxCount 1 ; sh:nodeKind sh:Literal ] ,
                [ sh:path c:unit ; sh:minCount 1 ; sh:maxCount 1 ; sh:nodeKind sh:IRI ] .
)";

std::string c(std::string_view name) { return "http://example.org/conductor#" + std::string(name); }

std::string text(const Graph& graph, const TermView& node, std::string_view name) {
  const std::string predicate = c(name);
  const std::optional<TermView> found = graph.object(node, lrt::rdf::iri(predicate));
  return found ? std::string(found->text) : std::string();
}

double number(const Graph& graph, const TermView& node, std::string_view name) {
  return lrt::rdf::lexical::parse_double(text(graph, node, name)).value_or(0);
}

}  // namespace

lrt::Result<std::vector<Rule>> read_rules(std::string_view turtle) {
  lrt::rdf::ReadOptions read;
  read.base = "http://example.org/rules";
  const lrt::Result<Graph> graph = lrt::rdf::read(turtle, lrt::rdf::Syntax::turtle, read);
  if (!graph) return lrt::unexpected(graph.error());
  const auto shapes = lrt::shacl::Shapes::compile(lrt::rdf::read(shape, lrt::rdf::Syntax::turtle, read).value());
  const auto report = lrt::shacl::validate(shapes.value(), *graph);
  if (!report) return lrt::unexpected(report.error());
  if (!report->conforms()) return lrt::unexpected(lrt::Errc::expected_value, report->to_text());

  std::vector<Rule> rules;
  const std::string kind = c("Rule"), when_name = c("when"), then_name = c("then");
  for (const TermView& node : graph->subjects(lrt::vocab::rdf_::type, lrt::rdf::iri(kind))) {
    const TermView when = *graph->object(node, lrt::rdf::iri(when_name)), then = *graph->object(node, lrt::rdf::iri(then_name));
    Rule rule;
    rule.name = node.text;
    rule.thing = text(*graph, when, "thing");
    rule.property = text(*graph, when, "property");
    rule.unit = text(*graph, when, "unit");
    rule.above = !text(*graph, when, "above").empty();
    rule.value = number(*graph, when, rule.above ? "above" : "below");
    rule.target = text(*graph, then, "thing");
    rule.affects = text(*graph, then, "affects");
    rule.input = number(*graph, then, "input");
    rule.input_unit = text(*graph, then, "unit");
    rule.others = text(*graph, then, "on") == c("others");
    rules.push_back(std::move(rule));
  }
  return rules;
}

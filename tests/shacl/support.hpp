// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>
#include <lrt/shacl/validator.hpp>

#include "tests/support/catch.hpp"

/// Shapes and data as Turtle snippets, and what a report finds as lines of text.
namespace shacl_test {

inline const std::string ex = "http://example.org/ns#";

inline std::string with_prefixes(std::string_view turtle) {
  return "@prefix ex: <" + ex +
         "> . @prefix sh: <http://www.w3.org/ns/shacl#> . @prefix xsd: <http://www.w3.org/2001/XMLSchema#> . "
         "@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> . @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> . "
         "@prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> . @prefix maths: "
         "<http://vocab.arvida.de/2015/06/maths/vocab#> . "
         "@prefix qudt: <http://qudt.org/schema/qudt/> . @prefix unit: <http://qudt.org/vocab/unit/> . @prefix ros: "
         "<http://ros.org/#> . "
         "@prefix hybrit: <https://hybr-it-projekt.de/ns/hybr-it#> . @prefix spatial: "
         "<http://vocab.arvida.de/2015/06/spatial/vocab#> .\n" +
         std::string(turtle);
}

inline lrt::rdf::Graph parse(std::string_view turtle, std::string_view base = "http://example.org/") {
  lrt::rdf::ReadOptions options;
  options.base = base;
  auto graph = lrt::rdf::read(with_prefixes(turtle), lrt::rdf::Syntax::turtle, options);
  if (!graph) FAIL(graph.error().message << " in\n" << turtle);
  return *std::move(graph);
}

inline lrt::shacl::Shapes compile(std::string_view turtle) {
  auto shapes = lrt::shacl::Shapes::compile(parse(turtle));
  if (!shapes) FAIL(shapes.error().message << " in\n" << turtle);
  return *std::move(shapes);
}

inline std::string line(const lrt::rdf::TermView& term) {
  std::string text(term.text);
  if (term.is_blank()) return "_:";
  if (term.is_literal()) return '"' + text + '"' + (term.language.empty() ? "" : "@" + std::string(term.language));
  return text.rfind(ex, 0) == 0 ? "ex:" + text.substr(ex.size()) : text;
}

/// "ex:focus ex:path value Component", `-` where there is no path or value.
inline std::string line(const lrt::shacl::ValidationResult& r) {
  std::string component(r.component.text.substr(r.component.text.rfind('#') + 1));
  component.resize(component.rfind("ConstraintComponent"));
  std::string path = r.path.empty() ? "-" : r.path.to_string();
  for (std::size_t at; (at = path.find("<" + ex)) != std::string::npos;) {
    path.erase(path.find('>', at), 1);
    path.replace(at, ex.size() + 1, "ex:");
  }
  return line(r.focus.view()) + " " + path + " " + (r.value ? line(r.value->view()) : "-") + " " + component;
}

inline std::vector<std::string> lines(const lrt::shacl::Report& report) {
  std::vector<std::string> out;
  for (const auto& r : report.results()) out.push_back(line(r));
  std::sort(out.begin(), out.end());
  return out;
}

inline std::vector<std::string> lines(std::string_view shapes, std::string_view data) {
  const auto report = lrt::shacl::validate(compile(shapes), parse(data));
  if (!report) FAIL(report.error().message);
  return lines(*report);
}

}  // namespace shacl_test

// SPDX-License-Identifier: Apache-2.0
#include <lrt/shacl/validator.hpp>

#include <cstdint>
#include <string>

#include <lrt/rdf/codec.hpp>

#include "tests/fuzz/round_trip.hpp"

// Shapes as Turtle, a byte 0xFF (which no UTF-8 text has), data as Turtle -> compile, validate within small limits -> the
// report as a graph, which must be writable, readable again, and the same at a second validation. Without data the shapes judge
// themselves.

namespace {

using lrt::Result;
using lrt::fuzz::broken;
using lrt::rdf::Graph;
using lrt::rdf::Syntax;

Result<Graph> read(std::string_view text) {
  // As a parser meets it in tests/shacl, so that what is found can be tried there; short inputs get further this way.
  static const std::string prefixes =
      "@prefix ex: <http://example.org/ns#> . @prefix sh: <http://www.w3.org/ns/shacl#> . @prefix xsd: "
      "<http://www.w3.org/2001/XMLSchema#> . "
      "@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> . @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .\n";
  lrt::rdf::ReadOptions options;
  options.base = "http://example.org/";
  options.max_triples = 500;
  return lrt::rdf::read(prefixes + std::string(text), Syntax::turtle, options);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string_view input(reinterpret_cast<const char*>(bytes), size);
  const std::size_t separator = input.find('\xFF');
  const Result<Graph> shapes_graph = read(input.substr(0, separator));
  if (!shapes_graph) return 0;
  const Result<Graph> data = separator == std::string_view::npos ? shapes_graph : read(input.substr(separator + 1));
  if (!data) return 0;

  lrt::shacl::CompileOptions compile_options;
  compile_options.ignore_unsupported = size % 2 == 0;
  compile_options.max_pattern_length = 60;
  compile_options.max_path_size = 50;
  const auto shapes = lrt::shacl::Shapes::compile(*shapes_graph, compile_options);
  if (!shapes) {
    if (shapes.error().message.empty()) broken("an error without a word", std::string(input));
    return 0;
  }
  lrt::shacl::ValidateOptions options;
  options.max_depth = 20;
  options.max_path_nodes = 1'000;
  options.max_results = 50;
  options.max_steps = 200'000;
  const auto report = lrt::shacl::validate(*shapes, *data, options);
  if (!report) {
    if (report.error().code != lrt::Errc::limit_exceeded) broken("an unexpected error", report.error().message);
    return 0;
  }
  const Graph graph = report->to_graph();
  const Result<std::string> written = lrt::rdf::write(graph, Syntax::turtle);
  if (!written) broken("a report that cannot be written", written.error().message);
  lrt::rdf::ReadOptions back_options;
  const Result<Graph> back = lrt::rdf::read(*written, Syntax::turtle, back_options);
  if (!back || back->size() != graph.size()) broken("a report that cannot be read", *written);
  if (!report->complete() && report->results().empty() && options.max_results != 0) broken("cut to nothing", *written);
  const auto again = lrt::shacl::validate(*shapes, *data, options);
  if (!again || *lrt::rdf::write(again->to_graph(), Syntax::turtle) != *written) broken("another report the second time", *written);

  // Every shape against every subject, directly.
  std::size_t tried = 0;
  for (const auto& s : shapes_graph->triples()) {
    const auto shape = shapes_graph->term(s.subject);
    if (!shapes->contains(shape)) continue;
    for (const auto& t : data->triples()) {
      if (++tried > 40) return 0;
      const auto one = lrt::shacl::validate(*shapes, *data, data->term(t.subject), shape, options);
      if (one) (void)one->to_text();
      else if (one.error().code != lrt::Errc::limit_exceeded) broken("an unexpected error", one.error().message);
    }
  }
  return 0;
}

// SPDX-License-Identifier: Apache-2.0
#include <lrt/client/schema.hpp>

#include <cstdint>
#include <string>

#include <lrt/base/iri.hpp>
#include <lrt/codegen.hpp>
#include <lrt/rdf/codec.hpp>

#include "src/rdf/plain.hpp"
#include "tests/fuzz/round_trip.hpp"

// Shapes as Turtle, a byte 0xFF (which no UTF-8 text has), a body in JSON -> a Schema of each node, the body as triples and back;
// and the header of the whole graph, which must fit what it was made of.

namespace {

using lrt::Result;
using lrt::client::Schema;
using lrt::fuzz::broken;
using lrt::rdf::Graph;
using lrt::rdf::Plain;
using lrt::rdf::Type;

Result<Graph> read(std::string_view text) {
  static const std::string prefixes =
      "@prefix ex: <http://example.org/ns#> . @prefix sh: <http://www.w3.org/ns/shacl#> . @prefix xsd: <http://www.w3.org/2001/XMLSchema#> . "
      "@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> . @prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> . "
      "@prefix maths: <http://vocab.arvida.de/2015/06/maths/vocab#> . @prefix qudt: <http://qudt.org/schema/qudt/> . "
      "@prefix unit: <http://qudt.org/vocab/unit/> . @prefix schema: <http://schema.org/> . @prefix hybrit: <https://hybr-it-projekt.de/ns/hybr-it#> "
      ". "
      "@prefix dcterms: <http://purl.org/dc/terms/> .\n";
  lrt::rdf::ReadOptions options;
  options.base = "http://example.org/";
  options.max_triples = 500;
  return lrt::rdf::read(prefixes + std::string(text), lrt::rdf::Syntax::turtle, options);
}

void check_type(const Type& type, int depth) {
  if (depth > 100) broken("a type nested too deeply", "");
  if (type.element) check_type(*type.element, depth + 1);
  for (const auto& field : type.fields) {
    if (!lrt::iri::is_absolute(field.predicate)) broken("a predicate that is no IRI", field.predicate);
    check_type(*field.type, depth + 1);
  }
}

void check_values(const Schema& schema, std::string_view body) {
  Graph graph;
  const auto focus = graph.intern(lrt::rdf::iri("http://example.org/focus"));
  if (!schema.write_plain_value(graph, focus, body, {"application", "json", {}}, 1'000)) return;
  const auto value = schema.read_value(graph, focus);
  if (!value) return;
  Graph again;
  schema.write_value(again, again.intern(lrt::rdf::iri("http://example.org/focus")), *value);
  const auto back = schema.read_value(again, again.intern(lrt::rdf::iri("http://example.org/focus")));
  if (!back || !same(*back, *value)) broken("another value", std::string(body));
  const auto text = write_plain(schema.type(), schema.facets(), *value, Plain::json);
  if (!text) broken("not written", text.error().message);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string_view input(reinterpret_cast<const char*>(bytes), size);
  const std::size_t separator = input.find('\xFF');
  const Result<Graph> shapes = read(input.substr(0, separator));
  if (!shapes) return 0;
  const std::string_view body = separator == std::string_view::npos ? std::string_view("1") : input.substr(separator + 1);
  lrt::client::SchemaOptions options;
  options.max_shapes = 500;
  for (std::uint32_t i = 0; i < shapes->term_count() && i < 200; ++i) {
    const auto term = shapes->term(lrt::rdf::TermId{i});
    const auto schema = Schema::read(*shapes, term, options);
    if (!schema) {
      if (schema.error().message.empty()) broken("an error without a word", std::string(input));
      continue;
    }
    for (const std::string& w : schema->warnings())
      if (w.empty() || w.size() > 3'000) broken("a warning without a word, or with too many", w);
    if (!schema->usable()) {
      if (schema->warnings().empty()) broken("nothing usable, and no word about it", std::string(input));
      continue;
    }
    check_type(schema->type(), 0);
    check_values(*schema, body);
  }

  lrt::client::DescribeOptions describe_options;
  describe_options.schema = options;
  const auto robot = lrt::client::describe(*shapes, describe_options);
  if (!robot) return 0;
  lrt::codegen::GenerateOptions generate_options;
  generate_options.max_bytes = 1'000'000;
  const auto made = lrt::codegen::generate(*robot, generate_options);
  if (!made) return 0;
  for (std::size_t at = 0; at < made->header.size(); ++at)
    if (made->header[at] == '\\' && (at + 1 == made->header.size() || made->header[at + 1] == '\n')) broken("a line that continues", made->header);
  const auto differences = lrt::codegen::check(made->header, *robot, generate_options);
  if (!differences) broken(differences.error().message.c_str(), made->header);
  if (!differences->empty()) broken(differences->front().c_str(), made->header);
  return 0;
}

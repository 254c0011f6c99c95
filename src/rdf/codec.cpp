// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/codec.hpp>

#include <lrt/base/immortal.hpp>

#include "src/base/quote.hpp"
#include "src/rdf/codecs.hpp"
#include "src/rdf/turtle_parser.hpp"

namespace lrt::rdf {
inline namespace v0 {
std::string_view media_type(Syntax syntax) noexcept {
  switch (syntax) {
    case Syntax::turtle: return "text/turtle";
    case Syntax::n_triples: return "application/n-triples";
    case Syntax::rdf_xml: return "application/rdf+xml";
    case Syntax::json_ld: return "application/ld+json";
    case Syntax::trig: return "application/trig";
    case Syntax::n_quads: return "application/n-quads";
  }
  return {};
}

const std::vector<Syntax>& available_syntaxes() {
  static const Immortal<std::vector<Syntax>> syntaxes([] {
    std::vector<Syntax> all = {Syntax::turtle, Syntax::n_triples};
    if (has_rdf_xml()) all.push_back(Syntax::rdf_xml);
    if (has_json_ld()) all.push_back(Syntax::json_ld);
    for (const Syntax s : {Syntax::trig, Syntax::n_quads}) all.push_back(s);
    return all;
  }());
  return *syntaxes;
}

std::optional<Syntax> syntax_of(std::string_view type) noexcept {
  for (const Syntax syntax : available_syntaxes()) {
    if (media_type(syntax) == type) return syntax;
  }
  return std::nullopt;
}

const Prefixes& default_prefixes() {
  static const Immortal<Prefixes> prefixes(Prefixes{
      {"hybrit", "https://hybr-it-projekt.de/ns/hybr-it#"},
      {"vom", "http://vocab.arvida.de/2015/06/vom/vocab#"},
      {"maths", "http://vocab.arvida.de/2015/06/maths/vocab#"},
      {"spatial", "http://vocab.arvida.de/2015/06/spatial/vocab#"},
      {"ros", "http://ros.org/#"},
      {"xhv", "http://www.w3.org/1999/xhtml/vocab#"},
      {"http-core", "http://www.w3.org/2011/http#"},
      {"http-methods", "http://www.w3.org/2011/http-methods#"},
      {"ldp", "http://www.w3.org/ns/ldp#"},
      {"sh", "http://www.w3.org/ns/shacl#"},
      {"dcterms", "http://purl.org/dc/terms/"},
      {"dcat", "http://www.w3.org/ns/dcat#"},
      {"rdf", "http://www.w3.org/1999/02/22-rdf-syntax-ns#"},
      {"rdfs", "http://www.w3.org/2000/01/rdf-schema#"},
      {"xsd", "http://www.w3.org/2001/XMLSchema#"},
      {"prov", "http://www.w3.org/ns/prov#"},
      {"sosa", "http://www.w3.org/ns/sosa/"},
      {"ssn", "http://www.w3.org/ns/ssn/"},
      {"void", "http://rdfs.org/ns/void#"},
      {"sd", "http://www.w3.org/ns/sparql-service-description#"},
      {"qudt", "http://qudt.org/schema/qudt/"},
      {"unit", "http://qudt.org/vocab/unit/"},
      {"quantitykind", "http://qudt.org/vocab/quantitykind/"},
      {"lrt", "https://w3id.org/lrt/ns#"},
  });
  return *prefixes;
}

namespace {

std::optional<Error> fault_of_base(const ReadOptions& options) {
  if (options.base.empty() || iri::is_absolute(options.base)) return std::nullopt;
  return Error{Errc::expected_iri, "the base is not an absolute IRI: \"" + std::string(options.base) + "\""};
}

Result<Graph> one_graph(Result<Dataset> read) {
  if (!read) return Unexpected{std::move(read).error()};
  if (!read->named.empty())
    return unexpected(Errc::unsupported_syntax,
                      "expected one graph, found the named graph <" + shortened(read->named.front().first) + ">, which is not supported here");
  return std::move(read->default_graph);
}

}  // namespace

Result<Graph> read(std::string_view text, Syntax syntax, const ReadOptions& options) {
  if (auto error = fault_of_base(options)) return Unexpected{*std::move(error)};
  switch (syntax) {
    case Syntax::turtle: return read_turtle(text, options);
    case Syntax::n_triples: return read_n_triples(text, options);
    case Syntax::trig: return one_graph(read_trig(text, options));
    case Syntax::n_quads: return one_graph(read_n_quads(text, options));
    case Syntax::rdf_xml: return read_rdf_xml(text, options);
    case Syntax::json_ld: return read_json_ld(text, options);
  }
  return unexpected(Errc::unsupported_syntax, "unknown syntax");
}

Result<Dataset> read_dataset(std::string_view text, Syntax syntax, const ReadOptions& options) {
  if (auto error = fault_of_base(options)) return Unexpected{*std::move(error)};
  switch (syntax) {
    case Syntax::trig: return read_trig(text, options);
    case Syntax::n_quads: return read_n_quads(text, options);
    case Syntax::json_ld: return read_json_ld_dataset(text, options);
    default: break;
  }
  Result<Graph> graph = read(text, syntax, options);
  if (!graph) return Unexpected{std::move(graph).error()};
  return Dataset{*std::move(graph), {}};
}

Result<std::string> write(const Graph& graph, Syntax syntax, const Prefixes& prefixes, std::string_view context) {
  switch (syntax) {
    case Syntax::turtle:
    case Syntax::trig: return write_turtle(graph, prefixes);
    case Syntax::n_triples:
    case Syntax::n_quads: return write_n_triples(graph);
    case Syntax::rdf_xml: return write_rdf_xml(graph, prefixes);
    case Syntax::json_ld: return write_json_ld(graph, prefixes, context);
  }
  return unexpected(Errc::unsupported_syntax, "unknown syntax");
}

Result<std::string> write(const Dataset& dataset, Syntax syntax, const Prefixes& prefixes) {
  if (syntax == Syntax::trig) return write_trig(dataset, prefixes);
  if (syntax == Syntax::n_quads) return write_n_quads(dataset);
  return unexpected(Errc::unsupported_syntax, std::string(media_type(syntax)) + " has no named graphs");
}

}  // namespace v0
}  // namespace lrt::rdf

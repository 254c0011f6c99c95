// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/codec.hpp>

#include <set>

#include "tests/support/catch.hpp"
#include "tests/support/graphs.hpp"

using namespace lrt;
using namespace lrt::test;
using rdf::Syntax;

TEST_CASE("a graph in TriG is Turtle, and in N-Quads N-Triples", "[rdf]") {
  const rdf::Graph graph = turtle("<a> dcterms:title \"x\"@en ; rdfs:seeAlso [ rdf:value ( 1 2 ) ] .");
  CHECK(rdf::write(graph, Syntax::trig).value() == rdf::write(graph, Syntax::turtle).value());
  CHECK(rdf::write(graph, Syntax::n_quads).value() == rdf::write(graph, Syntax::n_triples).value());
  for (const Syntax syntax : {Syntax::trig, Syntax::n_quads}) {
    CHECK(rdf::syntax_of(rdf::media_type(syntax)) == syntax);
    CHECK(rdf::has_named_graphs(syntax));
    rdf::ReadOptions options;
    options.base = "http://localhost/";
    CHECK(missing(rdf::read(rdf::write(graph, syntax).value(), syntax, options).value(), graph) == "");
  }
  CHECK_FALSE(rdf::has_named_graphs(Syntax::turtle));
}

TEST_CASE("named graphs are not read", "[rdf]") {
  rdf::ReadOptions options;
  options.base = "http://localhost/";
  for (const char* text : {"<a> { <b> <c> <d> . }", "{ <b> <c> <d> . }", "GRAPH <a> { <b> <c> <d> . }"})
    CHECK(rdf::read(text, Syntax::trig, options).error().code == Errc::expected_rdf);
  CHECK(rdf::read("<http://e/b> <http://e/c> <http://e/d> <http://e/a> .\n", Syntax::n_quads, options).error().code == Errc::expected_rdf);
}

TEST_CASE("a dataset has a default graph and named ones, whose blank nodes are their own", "[rdf]") {
  rdf::Dataset dataset;
  dataset.default_graph = turtle("<a> rdfs:seeAlso _:x , _:y . _:x rdfs:seeAlso _:y .");
  dataset.named.emplace_back("http://localhost/g1", turtle("<a> rdfs:seeAlso _:x , _:y . _:x rdfs:seeAlso _:y ."));
  dataset.named.emplace_back("http://localhost/g2", turtle("<b> a ldp:Container ; rdf:value [ rdf:value 1 ] ."));
  const std::string quads = rdf::write(dataset, Syntax::n_quads).value();
  std::set<std::string> labels;
  std::size_t lines = 0, in_g1 = 0, in_g2 = 0;
  for (std::size_t at = 0; at < quads.size(); ++lines) {
    const std::string line = quads.substr(at, quads.find('\n', at) - at);
    at += line.size() + 1;
    in_g1 += line.find(" <http://localhost/g1> .") != std::string::npos ? 1 : 0;
    in_g2 += line.find(" <http://localhost/g2> .") != std::string::npos ? 1 : 0;
    for (std::size_t label = line.find("_:"); label != std::string::npos; label = line.find("_:", label + 1))
      labels.insert(line.substr(label, line.find(' ', label) - label));
  }
  CHECK(lines == 9);
  CHECK(in_g1 == 3);
  CHECK(in_g2 == 3);
  CHECK(labels.size() == 5);  // x and y twice, and the nested one
  const std::string trig = rdf::write(dataset, Syntax::trig).value();
  CHECK(trig.find("@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .\n") != std::string::npos);
  CHECK(trig.find("@prefix ldp:") < trig.find("<http://localhost/a>"));
  CHECK(trig.find("\n<http://localhost/g1> {\n<http://localhost/a> rdfs:seeAlso") != std::string::npos);
  CHECK(trig.find("\n<http://localhost/g2> {\n<http://localhost/b> a ldp:Container ;\n    rdf:value [\n        rdf:value 1\n   "
                  " ] .\n}\n") != std::string::npos);
}

TEST_CASE("a dataset without graphs is empty; a syntax without named graphs and a relative name are refused", "[rdf]") {
  CHECK(rdf::write(rdf::Dataset(), Syntax::n_quads).value().empty());
  CHECK(rdf::write(rdf::Dataset(), Syntax::trig).value().empty());
  rdf::Dataset relative;
  relative.named.emplace_back("g", turtle("<a> rdf:value 1 ."));
  for (const Syntax syntax : {Syntax::trig, Syntax::n_quads}) CHECK(rdf::write(relative, syntax).error().code == Errc::unsupported_syntax);
  for (const Syntax syntax : {Syntax::turtle, Syntax::n_triples, Syntax::json_ld, Syntax::rdf_xml})
    CHECK(rdf::write(rdf::Dataset(), syntax).error().code == Errc::unsupported_syntax);
}

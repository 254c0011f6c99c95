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

namespace {

rdf::ReadOptions based() {
  rdf::ReadOptions options;
  options.base = "http://localhost/";
  return options;
}
Result<rdf::Dataset> trig(std::string_view text) { return rdf::read_dataset(text, Syntax::trig, based()); }
std::string fault(std::string_view text, Syntax syntax = Syntax::trig) {
  const Result<rdf::Dataset> read = rdf::read_dataset(text, syntax, based());
  return read ? "read" : read.error().message;
}

}  // namespace

TEST_CASE("where one graph is read, a named graph is refused by its name", "[rdf]") {
  for (const char* text : {"<a> { <b> <c> <d> . }", "GRAPH <a> { <b> <c> <d> . }", "<a> {}"}) {
    const Result<rdf::Graph> read = rdf::read(text, Syntax::trig, based());
    REQUIRE_FALSE(read);
    CHECK(read.error().code == Errc::unsupported_syntax);
    CHECK(read.error().message == "expected one graph, found the named graph <http://localhost/a>, which is not supported here");
  }
  CHECK(rdf::read("<http://e/b> <http://e/c> <http://e/d> <http://e/a> .\n", Syntax::n_quads, based()).error().code == Errc::unsupported_syntax);
  CHECK(rdf::read("{ <b> <c> <d> . }", Syntax::trig, based()).value().size() == 1);
  CHECK(rdf::read("<a> { <b> <c> <d> . }", Syntax::turtle, based()).error().code == Errc::expected_rdf);
  CHECK(rdf::read("<http://e/b> <http://e/c> <http://e/d> <http://e/a> .\n", Syntax::n_triples, based()).error().code == Errc::expected_rdf);
}

TEST_CASE("TriG is read", "[rdf]") {
  const rdf::Dataset d =
      trig(
          "PREFIX : <http://e/> @base <http://localhost/x/> . # a comment\n"
          ":s :p :o . { :s :p 1 } GRAPH :g { :s :p [ :q ( 1 2 ) ] . [ :p 3 ] . } \n"
          "<h>{:s a :T;:p 2,3;}graph<../i> { } :g { <y> :p <#z> . } PREFIX : <http://f/> :k { :s :p \"}\" } ( 1 ) :p [] . [] :p 5 .")
          .value();
  REQUIRE(d.named.size() == 4);
  CHECK(d.named[0].first == "http://e/g");
  CHECK(d.named[1].first == "http://localhost/x/h");
  CHECK(d.named[2].first == "http://localhost/i");
  CHECK(d.named[3].first == "http://f/k");
  CHECK(rdf::isomorphic(d.named[0].second, turtle("@prefix : <http://e/> . :s :p [ :q ( 1 2 ) ] . [] :p 3 . <x/y> :p <x/#z> .")));
  CHECK(rdf::isomorphic(d.named[1].second, turtle("@prefix : <http://e/> . :s a :T ; :p 2, 3 .")));
  CHECK(d.named[2].second.empty());
  CHECK(rdf::isomorphic(d.named[3].second, turtle("@prefix : <http://f/> . :s :p \"}\" .")));
  CHECK(rdf::isomorphic(d.default_graph, turtle("@prefix : <http://e/> . @prefix f: <http://f/> . :s :p :o, 1 . ( 1 ) f:p [] . [] f:p 5 .")));
  // One label in two graphs is two nodes.
  const rdf::Dataset shared = trig("<g> { _:a <p:p> 1 } <h> { _:a <p:p> 2 } _:a <p:p> 3 .").value();
  CHECK(shared.named[0].second.size() == 1);
  CHECK(shared.default_graph.size() == 1);
  CHECK(trig("").value().named.empty());
}

TEST_CASE("TriG that is not valid is refused with its place", "[rdf]") {
  CHECK(fault("<a> { <b> <c> <d> ") == "line 1, column 19: expected ',', ';' or '.', found the end of the text");
  CHECK(fault("<a> { <b> <c> <d> . ") == "line 1, column 5: '{' without an end");
  for (const char* text : {"<a> { <b> { } }",
                           "<a> <b> { }",
                           "<a> { <b> <c> } ",
                           "<a> { } .",
                           "<a> { [ <b> <c> } ]",
                           "}",
                           "( 1 ) { }",
                           "[ <p:p> 1 ] { }",
                           "GRAPH { }",
                           "GRAPH <a>",
                           "GRAPH <a> <b> <c> .",
                           "GRAPH GRAPH <a> { }",
                           "<a> { @prefix a: <b> . }",
                           "<a> { PREFIX a: <b> }",
                           "<a> { BASE <b> }",
                           "<a> { GRAPH <b> { } }",
                           "\"a\" { }",
                           "a { }",
                           "<a> { <b> <c> <d> . . }",
                           "{ { } }",
                           "GRAPH [ <p:p> 1 ] { }"}) {
    CAPTURE(text);
    CHECK(fault(text) != "read");
    CHECK(fault(text).find("line 1, column ") == 0);
  }
  for (const char* text : {"_:a { }", "[] { }", "GRAPH _:a { }", "GRAPH [] { }"}) {
    CAPTURE(text);
    CHECK(fault(text).find("expected an IRI as the name of the graph: a blank node is not supported") != std::string::npos);
    CHECK(trig(text).error().code == Errc::unsupported_syntax);
  }
  rdf::ReadOptions few = based();
  few.max_triples = 3;
  const auto sum = rdf::read_dataset("<a> { <b> <c> 1, 2 } <d> { <b> <c> 1, 2 }", Syntax::trig, few);
  CHECK(sum.error().code == Errc::limit_exceeded);
}

TEST_CASE("N-Quads are read", "[rdf]") {
  const rdf::Dataset d =
      rdf::read_dataset(
          "<http://e/s> <http://e/p> \"x\"@en <http://e/g> .\n_:a <http://e/p> _:a .\n<http://e/s><http://e/p>_:a<http://e/h>. # h\n"
          "_:a <http://e/p> <http://e/o> <http://e/g> .",
          Syntax::n_quads, based())
          .value();
  REQUIRE(d.named.size() == 2);
  CHECK(d.named[0].first == "http://e/g");
  CHECK(rdf::isomorphic(d.named[0].second, turtle("<http://e/s> <http://e/p> \"x\"@en . [] <http://e/p> <http://e/o> .")));
  CHECK(rdf::isomorphic(d.named[1].second, turtle("<http://e/s> <http://e/p> [] .")));
  CHECK(rdf::isomorphic(d.default_graph, turtle("_:a <http://e/p> _:a .")));
  CHECK(fault("<http://e/s> <http://e/p> <http://e/o> \"g\" .", Syntax::n_quads) == "line 1, column 40: expected '.', found \"\"g\"\"");
  CHECK(fault("<http://e/s> <http://e/p> <http://e/o> <g> .", Syntax::n_quads).find("expected an absolute IRI, found <g>") != std::string::npos);
  CHECK(fault("<http://e/s> <http://e/p> <http://e/o> _:g .", Syntax::n_quads).find("a blank node is not supported") != std::string::npos);
}

TEST_CASE("a dataset that is written is read again", "[rdf]") {
  rdf::Dataset dataset;
  dataset.default_graph = turtle("<a> rdfs:seeAlso _:x , _:y . _:x rdfs:seeAlso _:y .");
  dataset.named.emplace_back("http://localhost/g1", turtle("<a> rdfs:seeAlso [ rdf:value ( 1 [] ) ] ."));
  dataset.named.emplace_back("http://localhost/g2", turtle("() rdfs:label \"}\"@en, \"\"\"{\n\"\"\" ."));
  for (const Syntax syntax : {Syntax::trig, Syntax::n_quads}) {
    const rdf::Dataset back = rdf::read_dataset(rdf::write(dataset, syntax).value(), syntax, {}).value();
    CHECK(rdf::isomorphic(back.default_graph, dataset.default_graph));
    REQUIRE(back.named.size() == 2);
    for (std::size_t i = 0; i < 2; ++i) {
      CHECK(back.named[i].first == dataset.named[i].first);
      CHECK(rdf::isomorphic(back.named[i].second, dataset.named[i].second));
    }
  }
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

// SPDX-License-Identifier: Apache-2.0
#include "src/rdf/turtle_parser.hpp"

#include <string>

#include <lrt/rdf/vocab.hpp>

#include "tests/support/catch.hpp"

using namespace lrt::rdf;
using lrt::Errc;

namespace {

Graph accepted(const std::string& text) {
  ReadOptions options;
  options.base = "http://h/a/b";
  auto graph = read_turtle(text, options);
  INFO(text);
  if (!graph) FAIL(graph.error().message);
  return *graph;
}

/// The graph as N-Triples, with rdf: for its namespace.
std::string triples(const std::string& text) {
  std::string out = *write(accepted(text), Syntax::n_triples);
  const std::string whole = "<http://www.w3.org/1999/02/22-rdf-syntax-ns#";
  for (std::size_t at; (at = out.find(whole)) != std::string::npos;) {
    out.erase(out.find('>', at), 1);
    out.replace(at, whole.size(), "rdf:");
  }
  return out;
}

lrt::Error refusal(const std::string& text) {
  ReadOptions options;
  options.base = "http://h/a/b";
  const auto graph = read_turtle(text, options);
  INFO(text);
  if (graph) FAIL("accepted " << *write(*graph, Syntax::n_triples));
  CHECK(graph.error().code == Errc::expected_rdf);
  return graph.error();
}

}  // namespace

TEST_CASE("a keyword of a directive may be followed by any white space or a comment", "[rdf]") {
  for (const char* space : {"\n", "\r\n", "\t", "# comment\n", "\n\n  # one\n# two\n"}) {
    const std::string s = space;
    CHECK(triples("@prefix" + s + "p: <x#> . p:a p:b p:c .") == "<http://h/a/x#a> <http://h/a/x#b> <http://h/a/x#c> .\n");
    CHECK(triples("PREFIX" + s + "p:" + s + "<x#>" + s + "p:a p:b p:c .") == "<http://h/a/x#a> <http://h/a/x#b> <http://h/a/x#c> .\n");
    CHECK(triples("@base" + s + "<c/>" + s + "." + s + "<a> <b> <> .") == "<http://h/a/c/a> <http://h/a/c/b> <http://h/a/c/> .\n");
    CHECK(triples("bAsE" + s + "<c/> <a> <b> <> .") == "<http://h/a/c/a> <http://h/a/c/b> <http://h/a/c/> .\n");
  }
  CHECK(triples("@prefix:<x#>.:a :b :c.") == "<http://h/a/x#a> <http://h/a/x#b> <http://h/a/x#c> .\n");
  CHECK(triples("prefix p:<x#>p:a p:b p:.") == "<http://h/a/x#a> <http://h/a/x#b> <http://h/a/x#> .\n");
  CHECK(triples("@prefix prefix: <x#> . prefix:a prefix:base prefix:prefix .") == "<http://h/a/x#a> <http://h/a/x#base> <http://h/a/x#prefix> .\n");
  refusal("@prefixp: <x#> .");
  refusal("@PREFIX p: <x#> .");
  refusal("PREFIX p: <x#> .");
  refusal("@prefix p: <x#> p:a p:b p:c .");
}

TEST_CASE("an IRI of the RDF namespace is an IRI like others", "[rdf]") {
  const std::string rdf = "http://www.w3.org/1999/02/22-rdf-syntax-ns#";
  for (const char* name : {"_", "_0", "_1", "_01", "_99999999999999999999", "", "li", "nonsense", "nil"}) {
    const Graph g = accepted("<a:s> <" + rdf + name + "> <a:o> .");
    CHECK(g.contains(iri("a:s"), iri(rdf + name), iri("a:o")));
    const Graph prefixed = accepted("@prefix rdf: <" + rdf + "> . rdf:" + name + " <a:p> rdf:" + name + " .");
    CHECK(prefixed.contains(iri(rdf + name), iri("a:p"), iri(rdf + name)));
  }
}

TEST_CASE("triples come in the order of the document, and blank nodes are named as they appear", "[rdf]") {
  CHECK(triples("_:z <a:p> _:y , [ <a:q> _:z ; <a:r> [] ] .") == "_:b0 <a:p> _:b1 .\n_:b0 <a:p> _:b2 .\n_:b2 <a:q> _:b0 .\n_:b2 <a:r> _:b3 .\n");
  CHECK(triples("[ <a:p> 'x' ] <a:q> 'y' . [ <a:p> 'z' ] .") == "_:b0 <a:p> \"x\" .\n_:b0 <a:q> \"y\" .\n_:b1 <a:p> \"z\" .\n");
  CHECK(triples("<a:s> <a:p> ( 'x' [] ) , 'y' ; <a:q> () .") ==
        "<a:s> <a:p> _:b0 .\n_:b0 rdf:first \"x\" .\n_:b0 rdf:rest _:b1 .\n_:b1 rdf:first _:b2 .\n_:b1 rdf:rest rdf:nil .\n"
        "<a:s> <a:p> \"y\" .\n<a:s> <a:q> rdf:nil .\n");
  CHECK(triples("( ( 'x' ) ) <a:p> 'y' .") ==
        "_:b0 rdf:first _:b1 .\n_:b1 rdf:first \"x\" .\n_:b1 rdf:rest rdf:nil .\n_:b0 rdf:rest rdf:nil .\n_:b0 <a:p> \"y\" .\n");
  CHECK(triples("() <a:p> ( [ <a:q> ( 'x' ) ; <a:r> 'y' ] 'z' ) ; <a:s> 't' .") ==
        "rdf:nil <a:p> _:b0 .\n_:b0 rdf:first _:b1 .\n_:b1 <a:q> _:b2 .\n_:b2 rdf:first \"x\" .\n_:b2 rdf:rest rdf:nil .\n"
        "_:b1 <a:r> \"y\" .\n_:b0 rdf:rest _:b3 .\n_:b3 rdf:first \"z\" .\n_:b3 rdf:rest rdf:nil .\nrdf:nil <a:s> \"t\" .\n");
  CHECK(triples("_:b1 <a:p> _:b0 . _:b0 <a:p> _:b1 .") == "_:b0 <a:p> _:b1 .\n_:b1 <a:p> _:b0 .\n");
}

TEST_CASE("a number is of the datatype of its production, and keeps its digits", "[rdf]") {
  const auto object = [](const std::string& text) {
    const std::string all = triples("<a:s> <a:p> " + text + " .");
    const std::string xsd = "^^<http://www.w3.org/2001/XMLSchema#";
    const std::string term = all.substr(12, all.size() - 15);
    const std::size_t at = term.find(xsd);
    return at == std::string::npos ? term : term.substr(1, at - 2) + " " + term.substr(at + xsd.size(), term.size() - at - xsd.size() - 1);
  };
  for (const char* integer : {"0", "007", "-5", "+5", "123456789012345678901234567890"}) CHECK(object(integer) == integer + std::string(" integer"));
  for (const char* decimal : {"0.0", "-5.25", "+.5", ".5"}) CHECK(object(decimal) == decimal + std::string(" decimal"));
  for (const char* real : {"1e0", "1E-7", "1.e5", "-1.5E+10", ".5e1", "+0e0"}) CHECK(object(real) == real + std::string(" double"));
  CHECK(triples("<a:s> <a:p> 1.<a:s> <a:q> .5.") == triples("<a:s> <a:p> 1 . <a:s> <a:q> .5 ."));
  CHECK(object("true") == "true boolean");
  CHECK(object("false") == "false boolean");
  CHECK(object("'x'^^<http://www.w3.org/2001/XMLSchema#string>") == "\"x\"");
}

TEST_CASE("a prefixed name ends where its grammar says", "[rdf]") {
  const std::string p = "@prefix p: <a:> . @prefix p.q: <b:> . @prefix : <c:> . ";
  CHECK(triples(p + "p:x p:y p:z.") == "<a:x> <a:y> <a:z> .\n");
  CHECK(triples(p + "p: : p.q:.") == "<a:> <c:> <b:> .\n");
  CHECK(triples(p + "p:a.b..c p:y p:z...d.") == "<a:a.b..c> <a:y> <a:z...d> .\n");
  CHECK(triples(p + "p:0 p:_ p:a:b:.") == "<a:0> <a:_> <a:a:b:> .\n");
  CHECK(triples(p + "p:\\~\\.\\-\\!\\$\\&\\'\\(\\)\\*\\+\\,\\;\\=\\/\\?\\#\\@\\_ p:%4a p:\\%4a.") == "<a:~.-!$&'()*+,;=/?#@_> <a:%4a> <a:%4a> .\n");
  CHECK(triples(p + "p:a\\. p:b.\\- p:\\.c.") == "<a:a.> <a:b.-> <a:.c> .\n");
  CHECK(triples(p + "p:\xC3\xA9\xCC\x81 p:\xF0\x9F\x98\x80 p:x\xC2\xB7.") == "<a:\xC3\xA9\xCC\x81> <a:\xF0\x9F\x98\x80> <a:x\xC2\xB7> .\n");
  for (const char* bad : {"p:a p:b p:-1 .", "p:a p:b p:.c .", "@prefix r.: <a:> .", "@prefix -r: <a:> .", "@prefix _: <a:> .", "p:a p:b p:c\\",
                          "p:a p:b p:\\a .", "p:a p:b p:%4 .", "p:a p:b p:%4g .", "p:a p:b p:\\%zz .", "p:a p:b p:\xC2\xB7x .", "p:a p:b p:a~b .",
                          "p.:a p:b p:c .", "_:a p:b -p:c .", "p:a p:b p:c\xF0\x9F\xBF\xBE ."}) {
    refusal(p + bad);
  }
  CHECK(refusal("@prefix a: <a:> .\na:b\n  c:d a:e .").message == "line 3, column 3: undeclared prefix \"c:\"");
  CHECK(triples("@prefix p: <a:> . p:x p:y p:z . @prefix p: <b:> . p:x p:y p:z .") == "<a:x> <a:y> <a:z> .\n<b:x> <b:y> <b:z> .\n");
}

TEST_CASE("a label of a blank node ends where its grammar says", "[rdf]") {
  CHECK(triples("_:a.b <a:p> _:a.b.") == "_:b0 <a:p> _:b0 .\n");
  CHECK(triples("_:a <a:p> _:a-1,_:0,_:_,_:\xC3\xA9.") == "_:b0 <a:p> _:b1 .\n_:b0 <a:p> _:b2 .\n_:b0 <a:p> _:b3 .\n_:b0 <a:p> _:b4 .\n");
  for (const char* bad :
       {"_ <a:p> 1 .", "_: <a:p> 1 .", "_:-a <a:p> 1 .", "_:.a <a:p> 1 .", "_:a:b <a:p> 1 .", "_:\xC2\xB7 <a:p> 1 .", "_:a <a:p> _", "_:a <a:p> _:"})
    refusal(bad);
}

TEST_CASE("an error at any place of a document has its line and column", "[rdf]") {
  const std::string text = "@prefix p: <a:> .\np:a p:b [ p:c (1 2.5e1 'x'@en \"y\"^^p:d) ] ;\n  p:e _:f, <g>, true .\n";
  accepted(text);
  for (std::size_t n = 1; n < text.size(); ++n) {
    const std::string prefix = text.substr(0, n);
    ReadOptions options;
    options.base = "http://h/a/b";
    const auto graph = read_turtle(prefix, options);
    if (graph) continue;
    INFO(prefix);
    CHECK(graph.error().offset <= n);
    CHECK(graph.error().line > 0);
    CHECK(graph.error().column > 0);
    CHECK(graph.error().message.substr(0, 5) == "line ");
  }
  CHECK(refusal("<a> <b> <c>\n  <d> .").message == "line 2, column 3: expected ',', ';' or '.', found \"<d>\"");
  CHECK(refusal("<a> <b> 'x'^^5 .").message == "line 1, column 14: expected a datatype IRI, found \"5\"");
  CHECK(refusal("@prefix p: <a:>").message == "line 1, column 16: expected '.', found the end of the text");
}

// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/codec.hpp>

#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/rdf/vocab.hpp>

#include "src/rdf/turtle_parser.hpp"
#include "tests/support/catch.hpp"

using namespace lrt::rdf;
using lrt::Errc;
namespace vocab = lrt::vocab;

namespace {

constexpr std::string_view base = "http://h/baxter/right_s1/actions/rotate";

lrt::Error refusal(std::string_view text, Syntax syntax = Syntax::turtle) {
  const auto graph = read(text, syntax, {base});
  INFO(text);
  if (graph) FAIL("accepted: " << *write(*graph, Syntax::n_triples));
  CHECK(graph.error().code == Errc::expected_rdf);
  CHECK_FALSE(graph.error().message.empty());
  return graph.error();
}

Graph accepted(std::string_view text, Syntax syntax = Syntax::turtle) {
  auto graph = read(text, syntax, {base});
  INFO(text);
  if (!graph) FAIL(graph.error().message);
  return *graph;
}

const TermView literal_of_lang_string{TermKind::literal, "x", vocab::rdf_::langString.text};

std::string n_triples(const Graph& g) { return *write(g, Syntax::n_triples); }

}  // namespace

TEST_CASE("media types and syntaxes correspond", "[rdf][R1.2]") {
  CHECK(available_syntaxes().front() == Syntax::turtle);
  for (const Syntax syntax : {Syntax::turtle, Syntax::n_triples, Syntax::trig, Syntax::n_quads}) CHECK(syntax_of(media_type(syntax)) == syntax);
  for (const Syntax syntax : available_syntaxes()) CHECK(syntax_of(media_type(syntax)) == syntax);
  std::size_t known = 4;
  for (const Syntax syntax : {Syntax::rdf_xml, Syntax::json_ld}) known += syntax_of(media_type(syntax)) ? 1 : 0;
  CHECK(available_syntaxes().size() == known);
  CHECK_FALSE(syntax_of("text/plain"));
}

TEST_CASE("a syntax that is not available is refused by its name, not as wrong RDF", "[rdf]") {
  CHECK(media_type(Syntax::rdf_xml) == "application/rdf+xml");
  CHECK(media_type(Syntax::json_ld) == "application/ld+json");
  CHECK(json_ld_context().empty() == !syntax_of("application/ld+json"));
  for (const auto& [syntax, name] : {std::pair(Syntax::rdf_xml, "no RDF/XML"), std::pair(Syntax::json_ld, "no JSON-LD")}) {
    if (syntax_of(media_type(syntax))) continue;  // this build has it
    CHECK(read("<a/>", syntax, {base}).error().code == Errc::unsupported_syntax);
    CHECK(write(Graph(), syntax).error().message.find(name) != std::string::npos);
  }
}

TEST_CASE("a body is read with its effective URI as base", "[rdf]") {
  const Graph g = accepted(R"(@prefix maths: <http://vocab.arvida.de/2015/06/maths/vocab#> .
@prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
<> a maths:Scalar ; vom:numericalValue "43.6"^^xsd:float ; vom:unit maths:Degree ; vom:near <../x?y#z> .)");
  const TermView self = lrt::rdf::iri(base);
  CHECK(g.size() == 4);
  CHECK(g.contains(self, vocab::rdf_::type, vocab::maths::Scalar));
  CHECK(g.contains(self, vocab::vom::numericalValue, literal("43.6", vocab::xsd::float_)));
  CHECK(g.contains(self, lrt::rdf::iri("http://vocab.arvida.de/2015/06/vom/vocab#near"), lrt::rdf::iri("http://h/baxter/right_s1/x?y#z")));
}

TEST_CASE("an error tells line and column and what was found", "[rdf]") {
  const lrt::Error undeclared = refusal("<a> <b> <c> .\n  <a> vom:unit 1 .");
  CHECK(undeclared.line == 2);
  CHECK(undeclared.column == 7);
  CHECK(undeclared.offset == 20);
  CHECK(undeclared.message == "line 2, column 7: undeclared prefix \"vom:\"");
  CHECK(refusal("<a> <b> \"c .\n").message == "line 1, column 13: line end in a string");
  CHECK(refusal("<a> <b> \"c").message == "line 1, column 10: unterminated string");
  CHECK(refusal("<a> <b> <c").message == "line 1, column 9: unterminated IRI");
  CHECK(refusal("<a> <b> foo .").message == "line 1, column 9: expected an object, found \"foo\"");
  CHECK(refusal("<a> <b> [ <c> <d> .").message == "line 1, column 19: expected ',', ';' or ']', found \".\"");
  CHECK(refusal("<a> <b> [ <c> <d>").message == "line 1, column 9: '[' without an end");
  CHECK(refusal("<a> <b> <c> ] .").message == "line 1, column 13: expected ',', ';' or '.', found \"]\"");
  CHECK(refusal("<a> <b> <c>").message == "line 1, column 12: expected ',', ';' or '.', found the end of the text");
  CHECK(refusal("[] .").message == "line 1, column 4: expected a predicate, found \".\"");
  CHECK(refusal("<a> \"b\" <c> .").message == "line 1, column 5: expected a predicate, found \"\"b\"\"");
  CHECK(refusal("@prefix <b> .").message == "line 1, column 9: expected a prefix ending in ':', found \"<b>\"");
  CHECK(refusal("<a> <b> <c> .\n<a> <b> .\n").message == "line 2, column 9: expected an object, found \".\"");
}

TEST_CASE("each production of the Turtle grammar is accepted, and its neighbours are not", "[rdf]") {
  for (const char* good : {"", "# comment", "<a> <b> <c>, <d>; <e> <f>;; a <g>; .", "[ <p> 1 ] .", "[ <p> 1; ] <q> 2 .", "[] <p> [] .",
                           "( 1 .5 ( ) [ ] ) <p> ( [ a <T> ] ) .", "PREFIX : <p#> BASE <q> : :a :b.", "@prefix a: <p#> . a:a a a:a.a .",
                           "<a> <b> true, false, 'x' @en , 'y' ^^ <t>, '''z'''.", "<a> <b> 1.", "<a> <b> 1.0.", "<a> <b> -1.e-1.", "<a> a true."}) {
    accepted(good);
  }
  for (const char* bad : {".",
                          "<a> .",
                          "<a> <b> <c>",
                          "<a> <b> , <c> .",
                          "<a> <b> <c> ,; .",
                          "<a> ; <b> <c> .",
                          "( 1 ) .",
                          "[ ; <a> <b> ] .",
                          "[ <a> ] <b> <c> .",
                          "<a> <b> ( , ) .",
                          "<a> <b> ( <c> ] .",
                          "<a> <b> [ <c> <d> ) .",
                          "a <b> <c> .",
                          "<a> <b> a .",
                          "<a> _:b <c> .",
                          "1 <b> <c> .",
                          "<a> <b> 'x'^^'y' .",
                          "<a> <b> 'x' ^ ^ <t> .",
                          "<a> <b> <c>^^<t> .",
                          "<a> <b> @en .",
                          "@prefix : <p#> : :a :b .",
                          "PREFIX : <p#> . : :a :b .",
                          "@PREFIX : <p#> .",
                          "<a> <b> [ @base <x> . ] .",
                          "<a> <b> <c> . } .",
                          "<a> <b> <c> = <d> .",
                          "<a> => <c> .",
                          "@prefix p: .",
                          "@base p: .",
                          "@forAll <x> .",
                          "<a> <b> 1.e .",
                          "<a> <b> +.",
                          "<a> <b> tru .",
                          "<a> <b> \"x\"\"y\" ."}) {
    refusal(bad);
  }
}

TEST_CASE("relative IRIs need a base", "[rdf]") {
  CHECK(read("<> a <http://e/T> .", Syntax::turtle, {}).error().code == Errc::expected_rdf);
  CHECK(read("<http://e/a> a <http://e/T> .", Syntax::turtle, {}));
  CHECK(read("@base <http://e/> . <> a <T> .", Syntax::turtle, {})
            ->contains(lrt::rdf::iri("http://e/"), vocab::rdf_::type, lrt::rdf::iri("http://e/T")));
  CHECK(read("<a> <b> <c> .", Syntax::turtle, {"no base"}).error().code == Errc::expected_iri);
}

TEST_CASE("an absolute IRI is taken as it is, dot segments and all", "[rdf]") {
  CHECK(n_triples(accepted("<http://e/a/../b> <http://e/./p> <x:./y>, <../x> .")) ==
        "<http://e/a/../b> <http://e/./p> <x:./y> .\n<http://e/a/../b> <http://e/./p> <http://h/baxter/right_s1/x> .\n");
}

TEST_CASE("U+0000 is a character of literals and of nothing else", "[rdf][json_ld]") {
  const std::string nul(1, '\0');
  const TermView s = lrt::rdf::iri("http://e/a"), p = lrt::rdf::iri("http://e/b");
  const std::string before = "<http://e/a> <http://e/b> ";
  const std::string value = "43" + nul + ".6";
  for (const Syntax syntax : {Syntax::turtle, Syntax::n_triples}) {
    for (const std::string& written : {std::string("43\\u0000.6"), std::string("43\\U00000000.6"), value}) {
      const Graph g = accepted(before + "\"" + written + "\" . # " + nul, syntax);
      CHECK(g.contains(s, p, literal(value)));
      for (const Syntax as : {Syntax::turtle, Syntax::n_triples, Syntax::json_ld}) {
        CHECK(accepted(*write(g, as), as).contains(s, p, literal(value)));
      }
      CHECK(write(g, Syntax::rdf_xml).error().code == Errc::unsupported_syntax);  // also without Redland
    }
    for (const std::string& text : {before + "<http://e/" + nul + "> .", before + "<http://e/\\u0000> .", before + nul + "\"x\" .",
                                    before + "\"x\" ." + nul, before + "_:a" + nul + " .", before + "\"x\"@en" + nul + " .", nul}) {
      refusal(text, syntax);
    }
  }
  refusal("@prefix p: <p:> . p:a" + nul + " p:b p:c .");
  refusal(R"({"@id": "http://e/a", "http://e/b": {"@id": "http://e/\u0000"}})", Syntax::json_ld);
}

TEST_CASE("surrogates and what lies beyond Unicode are refused", "[rdf]") {
  for (const Syntax syntax : {Syntax::turtle, Syntax::n_triples}) {
    for (const char* escape : {"\\uD800", "\\uDFFF", "\\U00110000", "\\UFFFFFFFF", "\\u12", "\\x41", "\\"}) {
      refusal("<http://e/a> <http://e/b> \"" + std::string(escape) + "\" .", syntax);
    }
  }
}

TEST_CASE("invalid UTF-8 is refused with its place", "[rdf]") {
  const lrt::Error error = refusal("<a> <b> \"\xC3\x28\" .");
  CHECK(error.column == 10);
  refusal("<http://e/a> <http://e/b> \"\xED\xA0\x80\" .", Syntax::n_triples);
}

TEST_CASE("a text in UTF-16 is refused as such", "[rdf][json_ld]") {
  for (const Syntax syntax : {Syntax::turtle, Syntax::n_triples, Syntax::trig, Syntax::n_quads, Syntax::json_ld})
    for (const std::string mark : {"\xFF\xFE", "\xFE\xFF"}) {
      if (!syntax_of(media_type(syntax))) continue;
      CHECK(refusal(mark + std::string("<\0a\0", 4), syntax).message == "line 1, column 1: expected UTF-8, found UTF-16");
    }
}

TEST_CASE("characters that no IRI has are refused, escaped or not", "[rdf]") {
  for (const char* iri : {"http://e/a b", "http://e/\\u0020", "http://e/\\u003C", "http://e/\\u0001", "http://e/{x}", "http://e/%zz", "http://e/\\n",
                          "http://e/\"", "http://e/\xEF\xA3\xBF"}) {
    refusal("<" + std::string(iri) + "> <http://e/b> <http://e/c> .");
    refusal("<" + std::string(iri) + "> <http://e/b> <http://e/c> .", Syntax::n_triples);
  }
  refusal("<relative> <http://e/b> <http://e/c> .", Syntax::n_triples);
  refusal("@prefix e: <http://e/> . e:a e:b e:\\%zz .");
  CHECK(n_triples(accepted("<\\u0061> <b> <\\U000000E9> .")) ==
        "<http://h/baxter/right_s1/actions/a> <http://h/baxter/right_s1/actions/b> <http://h/baxter/right_s1/actions/é> .\n");
}

TEST_CASE("an N-Triples error after good lines fails the document", "[rdf]") {
  const lrt::Error error = refusal("<http://e/a> <http://e/b> <http://e/c> .\n<http://e/a> <http://e/b> .\n", Syntax::n_triples);
  CHECK(error.line == 2);
  refusal("<http://e/a> <http://e/b> <http://e/c>", Syntax::n_triples);
  refusal("<http://e/a> <http://e/b> <http://e/c> . <http://e/a> <http://e/b> <http://e/c> .", Syntax::n_triples);
  refusal("<http://e/a> \"b\" <http://e/c> .", Syntax::n_triples);
  refusal("@prefix e: <http://e/> .", Syntax::n_triples);
}

TEST_CASE("a literal may have its tag or type after white space", "[rdf]") {
  CHECK(n_triples(accepted("<a:> <b:> \"x\"@en-GB .")) == "<a:> <b:> \"x\"@en-gb .\n");
  refusal("<a:> <b:> \"x\"@1 .");
  refusal("<a:> <b:> \"x\"^^\"y\" .");
}

TEST_CASE("tokens of N-Triples and N-Quads may have spaces and tabs between them, or nothing", "[rdf]") {
  const std::string type = "<http://www.w3.org/2001/XMLSchema#token>";
  const std::string tagged = "<a:> <b:> \"x\"@en .\n", typed = "<a:> <b:> \"x\"^^" + type + " .\n", plain = "<a:> <b:> \"x\" .\n";
  const std::pair<std::string, std::string> lines[] = {
      {"<a:> <b:> \"x\" @en .", tagged},
      {"<a:> <b:> \"x\"\t@en.", tagged},
      {"<a:> <b:> \"x\" \t @en\t.", tagged},
      {"<a:> <b:> \"x\" @en . # why not", tagged},
      {"<a:>\t<b:>\t\"x\"@en\t.\t", tagged},
      {"<a:><b:>\"x\"@en.", tagged},
      {" \t<a:> <b:> \"x\"@en .", tagged},
      {"<a:> <b:> \"x\" ^^" + type + " .", typed},
      {"<a:> <b:> \"x\"^^ " + type + " .", typed},
      {"<a:> <b:> \"x\" ^^ " + type + ".", typed},
      {"<a:> <b:> \"x\"\t^^\t" + type + "\t.", typed},
      {"<a:><b:>\"x\"^^" + type + ".", typed},
      {"<a:> <b:> \"x\" .", plain},
      {"<a:> <b:> \"x\".#", plain},
      {"\r\n\n# first\r\n<a:> <b:> \"x\" .\r\n \t\r", plain},
  };
  for (const Syntax syntax : {Syntax::n_triples, Syntax::n_quads})
    for (const auto& [line, wanted] : lines) {
      INFO(line);
      CHECK(n_triples(accepted(line, syntax)) == wanted);
    }
  // A token is in one piece, and a triple on one line.
  for (const char* line : {"<a:> <b:> \"x\" @ en .", "<a:> <b:> \"x\"@en -gb .", "<a:> <b:> \"x\" ^ ^<c:> .", "<a:> <b:> \"x\"\n@en .",
                           "<a:> <b:> \"x\"^^\n<c:> .", "<a:> <b:> \"x\" ^^<c: > .", "<a:>\n<b:> \"x\" .", "<a:> <b:> _ :x ."}) {
    refusal(line, Syntax::n_triples);
    refusal(line, Syntax::n_quads);
  }
}

TEST_CASE("a literal of rdf:langString has a language, or is refused with its place", "[rdf][json_ld]") {
  const std::string rdf = "http://www.w3.org/1999/02/22-rdf-syntax-ns#", literal = "\"x\"^^<" + rdf + "langString>";
  struct Case {
    std::string text;
    std::uint32_t line, column;
  };
  for (const Case& c : {Case{"<a:> <b:> " + literal + " .", 1, 16}, Case{"<a:> <b:>\n\"x\" ^^ <" + rdf + "langString> .", 2, 8},
                        Case{"@prefix r: <" + rdf + "> .\n<a:> <b:> 1, 'x'^^r:langString .", 2, 19},
                        Case{"PREFIX : <" + rdf + ">\n<a:> <b:> ( ''^^:langString ) .", 2, 17},
                        Case{"<a:> <b:> [ <c:> \"\"\"x\"\"\"^^<" + rdf + "lang\\u0053tring> ] .", 1, 27}}) {
    for (const Syntax syntax : {Syntax::turtle, Syntax::trig}) {
      const auto error = read(c.text, syntax, {base}).error();
      INFO(c.text << ": " << error.message);
      CHECK(error.line == c.line);
      CHECK(error.column == c.column);
      CHECK(error.message.find("rdf:langString") != std::string::npos);
      refusal(c.text, syntax);
    }
  }
  for (const Syntax syntax : {Syntax::n_triples, Syntax::n_quads}) {
    const lrt::Error error = refusal("<a:> <b:> <c:> .\n<a:> <b:> " + literal + " .", syntax);
    CHECK(error.line == 2);
    CHECK(error.column == 16);
  }
  // Neighbours that RDF 1.1 has.
  for (const std::string& text : {std::string("\"x\"@en"), "\"x\"^^<" + rdf + "langstring>", "\"x\"^^<" + rdf + "dirLangString>",
                                  "\"x\"^^<" + rdf + "HTML>", "<" + rdf + "langString>"})
    CHECK(n_triples(accepted("<a:> <b:> " + text + " .")) == "<a:> <b:> " + text + " .\n");

  // What a host adds to a graph by itself is not written.
  Graph g;
  g.add(iri("a:"), iri("b:"), literal_of_lang_string);
  for (const Syntax syntax : {Syntax::turtle, Syntax::trig, Syntax::n_triples, Syntax::n_quads, Syntax::json_ld}) {
    if (!syntax_of(media_type(syntax))) continue;
    const auto text = write(g, syntax);
    REQUIRE_FALSE(text);
    CHECK(text.error().message.find("expected a language tag") != std::string::npos);
  }
}

TEST_CASE("a file of an earlier release with rdf:langString without a language is read, as strings", "[rdf]") {
  const auto graph = read_kept_n_triples(
      "<a:> <b:> \"x\"^^<http://www.w3.org/1999/02/22-rdf-syntax-ns#langString> .\n<a:> <b:> \"y\"@en .\n<a:> <b:> \"1\"^^<c:> .\n", {});
  REQUIRE(graph);
  CHECK(n_triples(*graph) == "<a:> <b:> \"x\" .\n<a:> <b:> \"y\"@en .\n<a:> <b:> \"1\"^^<c:> .\n");
}

TEST_CASE("a document may begin with a byte order mark", "[rdf][json_ld]") {
  const std::string mark = "\xEF\xBB\xBF", triple = "<a:> <b:> \"c\" .\n";
  const std::pair<Syntax, std::string> documents[] = {
      {Syntax::turtle, triple},
      {Syntax::turtle, "@prefix : <a:> . : <b:> 'c' ."},
      {Syntax::turtle, "# a comment\n" + triple},
      {Syntax::turtle, "\r\n" + triple},
      {Syntax::trig, triple},
      {Syntax::n_triples, triple},
      {Syntax::n_triples, "\n# a comment\r\n" + triple},
      {Syntax::n_quads, triple},
      {Syntax::json_ld, R"({"@id": "a:", "b:": "c"})"},
  };
  for (const auto& [syntax, text] : documents) {
    if (!syntax_of(media_type(syntax))) continue;
    CHECK(n_triples(accepted(text, syntax)) == triple);
    CHECK(n_triples(accepted(mark + text, syntax)) == triple);
  }
  for (const Syntax syntax : {Syntax::turtle, Syntax::n_triples}) {
    CHECK(accepted(mark, syntax).empty());
    refusal("\n" + mark + triple, syntax);
    refusal(triple + mark + triple, syntax);
    refusal(mark + mark + triple, syntax);
    // The column is that which an editor shows, the offset that in the bytes.
    const lrt::Error error = refusal(mark + "<a:> ! <c:> .", syntax);
    CHECK(error.line == 1);
    CHECK(error.column == 6);
    CHECK(error.offset == 8u);
    CHECK(refusal(mark + "\n<a:> ! <c:> .", syntax).column == 6);
  }
  CHECK(n_triples(accepted("<a:> <b:> \"" + mark + "\" .")) == "<a:> <b:> \"" + mark + "\" .\n");
}

TEST_CASE("a document's labels do not meet the names that are given to blank nodes", "[rdf]") {
  const Graph g = accepted("_:genid1 <p:> [] . [] <p:> _:genid2 . _:b0 <p:> _:g0 .");
  CHECK(g.size() == 3);
  std::size_t blanks = 0;
  for (std::uint32_t i = 0; i < g.term_count(); ++i) blanks += g.term(TermId{i}).is_blank();
  CHECK(blanks == 6);
  CHECK(g.find(blank("b0")));
  CHECK(g.find(blank("b5")));
}

TEST_CASE("nothing of one document is left for the next", "[rdf]") {
  accepted("@prefix left: <http://left/> . @base <http://left/> . _:a left:p <x> .");
  refusal("left:a left:p left:b .");
  CHECK(n_triples(accepted("<x> <p:> 1 .")).find("http://left/") == std::string::npos);
  refusal("<x> <p:> .");
  accepted("<x> <p:> 1 .");
}

TEST_CASE("more triples than allowed are refused while reading", "[rdf]") {
  std::string triples;
  for (int i = 0; i < 1000; ++i) { triples += "<http://e/a> <http://e/b> \"" + std::to_string(i) + "\" .\n"; }
  ReadOptions options{base, 999};
  CHECK(read(triples, Syntax::turtle, options).error().code == Errc::limit_exceeded);
  CHECK(read(triples, Syntax::n_triples, options).error().code == Errc::limit_exceeded);
  options.max_triples = 1000;
  CHECK(read(triples, Syntax::turtle, options)->size() == 1000);
}

TEST_CASE("brackets nested without end are refused before they reach the parser's stack", "[rdf]") {
  const auto nest = [](std::size_t n, const char* open, const char* close) {
    std::string text = "<s> <p> ";
    for (std::size_t i = 0; i < n; ++i) text += open;
    for (std::size_t i = 0; i < n; ++i) text += close;
    return text + " .";
  };
  CHECK(refusal(nest(100'000, "[<p>", "]")).message.find("nested more than 1000 deep") != std::string::npos);
  refusal(nest(100'000, "(", ")"));
  refusal(nest(1001, "(", ")"));
  CHECK(accepted(nest(1000, "(", ")")).size() == 1999);
}

TEST_CASE("language tags of more than 255 bytes are refused", "[rdf][json_ld]") {
  const std::string longest = "en-" + std::string(252, 'x');
  for (const Syntax syntax : {Syntax::turtle, Syntax::n_triples}) {
    const Graph g = accepted("<a:> <b:> \"x\"@" + longest + " .", syntax);
    for (const Syntax as : {Syntax::turtle, Syntax::n_triples, Syntax::json_ld}) CHECK(write(g, as));
    CHECK(refusal("<a:> <b:> \"x\"@" + longest + "y .", syntax).message.find("language tag of more than 255 bytes") != std::string::npos);
  }
}

TEST_CASE("threads that come and go read at once", "[rdf]") {
  std::vector<std::thread> threads;
  std::vector<int> good(6, 0);
  for (std::size_t n = 0; n < good.size(); ++n) {
    threads.emplace_back([n, &good] {
      for (int i = 0; i < 50; ++i) {
        const auto g = read("@prefix e: <http://e/> . e:s e:p [ e:q " + std::to_string(n) + " ] .", Syntax::turtle, {});
        const auto bad = read("<a:> <b:> .", Syntax::turtle, {});
        good[n] += g && g->size() == 2 && !bad;
      }
    });
  }
  for (std::thread& t : threads) t.join();
  CHECK(good == std::vector<int>(6, 50));
}

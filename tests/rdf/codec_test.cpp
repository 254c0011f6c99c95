#include <lrt/rdf/codec.hpp>

#include <string>
#include <thread>
#include <vector>

#include <lrt/rdf/vocab.hpp>

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

std::string n_triples(const Graph& g) { return *write(g, Syntax::n_triples); }

std::string rdf_xml(const std::string& content) {
  return "<rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\" xmlns:e=\"http://e/\">" + content + "</rdf:RDF>";
}

}  // namespace

TEST_CASE("media types and syntaxes correspond", "[rdf][R1.2]") {
  for (const Syntax syntax : available_syntaxes()) CHECK(syntax_of(media_type(syntax)) == syntax);
  CHECK_FALSE(syntax_of("text/plain"));
}

TEST_CASE("a body is read with its effective URI as base", "[rdf]") {
  const Graph g = accepted(R"(@prefix maths: <http://vocab.arvida.de/2015/06/maths/vocab#> .
@prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
<> a maths:Scalar ; vom:numericalValue "43.6"^^xsd:float ; vom:unit maths:Degree ; vom:near <../x?y#z> .)");
  const TermView self = lrt::rdf::iri(base);
  CHECK(g.size() == 4);
  CHECK(g.contains(self, vocab::rdf::type, vocab::maths::Scalar));
  CHECK(g.contains(self, vocab::vom::numericalValue, literal("43.6", vocab::xsd::float_)));
  CHECK(g.contains(self, lrt::rdf::iri("http://vocab.arvida.de/2015/06/vom/vocab#near"),
                   lrt::rdf::iri("http://h/baxter/right_s1/x?y#z")));
}

TEST_CASE("an error tells line and column and what was found", "[rdf]") {
  const lrt::Error undeclared = refusal("<a> <b> <c> .\n  <a> vom:unit 1 .");
  CHECK(undeclared.line == 2);
  CHECK(undeclared.column == 7);
  CHECK(undeclared.offset == 20);
  CHECK(undeclared.message == "line 2, column 7: undeclared prefix \"vom:\"");
  CHECK(refusal("<a> <b> \"c .\n").message == "line 1, column 13: line end in a string");
  CHECK(refusal("<a> <b> \"c").message == "line 1, column 10: string without an end");
  CHECK(refusal("<a> <b> <c").message == "line 1, column 9: IRI without an end");
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
  for (const char* good : {"", "# comment", "<a> <b> <c>, <d>; <e> <f>;; a <g>; .", "[ <p> 1 ] .", "[ <p> 1; ] <q> 2 .",
                           "[] <p> [] .", "( 1 .5 ( ) [ ] ) <p> ( [ a <T> ] ) .", "PREFIX : <p#> BASE <q> : :a :b.",
                           "@prefix a: <p#> . a:a a a:a.a .", "<a> <b> true, false, 'x' @en , 'y' ^^ <t>, '''z'''.",
                           "<a> <b> 1.", "<a> <b> 1.0.", "<a> <b> -1.e-1.", "<a> a true."}) {
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
            ->contains(lrt::rdf::iri("http://e/"), vocab::rdf::type, lrt::rdf::iri("http://e/T")));
  CHECK(read("<a> <b> <c> .", Syntax::turtle, {"no base"}).error().code == Errc::expected_iri);
  CHECK(read(rdf_xml("<e:T rdf:about='a'/>"), Syntax::rdf_xml, {}).error().code == Errc::expected_rdf);
  CHECK(read(rdf_xml("<e:T rdf:about='http://e/a'/>"), Syntax::rdf_xml, {}));
}

TEST_CASE("an absolute IRI is taken as it is, dot segments and all", "[rdf]") {
  CHECK(n_triples(accepted("<http://e/a/../b> <http://e/./p> <x:./y>, <../x> .")) ==
        "<http://e/a/../b> <http://e/./p> <x:./y> .\n<http://e/a/../b> <http://e/./p> <http://h/baxter/right_s1/x> .\n");
}

TEST_CASE("U+0000 is a character of literals and of nothing else", "[rdf]") {
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
      CHECK(write(g, Syntax::rdf_xml).error().code == Errc::unsupported_syntax);
    }
    for (const std::string& text :
         {before + "<http://e/" + nul + "> .", before + "<http://e/\\u0000> .", before + nul + "\"x\" .", before + "\"x\" ." + nul,
          before + "_:a" + nul + " .", before + "\"x\"@en" + nul + " .", nul}) {
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
  refusal(rdf_xml("<e:T e:p='\xFF'/>"), Syntax::rdf_xml);
}

TEST_CASE("characters that no IRI has are refused, escaped or not", "[rdf]") {
  for (const char* iri : {"http://e/a b", "http://e/\\u0020", "http://e/\\u003C", "http://e/\\u0001", "http://e/{x}",
                          "http://e/%zz", "http://e/\\n", "http://e/\"", "http://e/\xEF\xA3\xBF"}) {
    refusal("<" + std::string(iri) + "> <http://e/b> <http://e/c> .");
    refusal("<" + std::string(iri) + "> <http://e/b> <http://e/c> .", Syntax::n_triples);
  }
  refusal("<relative> <http://e/b> <http://e/c> .", Syntax::n_triples);
  refusal("@prefix e: <http://e/> . e:a e:b e:\\%zz .");
  refusal(rdf_xml("<e:T rdf:about='a b'/>"), Syntax::rdf_xml);
  CHECK(n_triples(accepted("<\\u0061> <b> <\\U000000E9> .")) ==
        "<http://h/baxter/right_s1/actions/a> <http://h/baxter/right_s1/actions/b> <http://h/baxter/right_s1/actions/é> .\n");
}

TEST_CASE("an N-Triples error after good lines fails the document", "[rdf]") {
  const lrt::Error error =
      refusal("<http://e/a> <http://e/b> <http://e/c> .\n<http://e/a> <http://e/b> .\n", Syntax::n_triples);
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
  std::string turtle, triples, xml;
  for (int i = 0; i < 1000; ++i) {
    triples += "<http://e/a> <http://e/b> \"" + std::to_string(i) + "\" .\n";
    xml += "<e:T rdf:about='http://e/" + std::to_string(i) + "'/>";
  }
  turtle = triples;
  ReadOptions options{base, 999};
  CHECK(read(turtle, Syntax::turtle, options).error().code == Errc::limit_exceeded);
  CHECK(read(triples, Syntax::n_triples, options).error().code == Errc::limit_exceeded);
  CHECK(read(rdf_xml(xml), Syntax::rdf_xml, options).error().code == Errc::limit_exceeded);
  options.max_triples = 1000;
  CHECK(read(turtle, Syntax::turtle, options)->size() == 1000);
  CHECK(read(rdf_xml(xml), Syntax::rdf_xml, options)->size() == 1000);
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
  CHECK(accepted(nest(1000, "(", ")")).size() == 1999);
}

TEST_CASE("RDF/XML is read with its place of error, without entities from elsewhere", "[rdf]") {
  CHECK(n_triples(accepted(rdf_xml("<e:T rdf:about=''><e:p xml:lang='en'>v</e:p></e:T>"), Syntax::rdf_xml)) ==
        "<http://h/baxter/right_s1/actions/rotate> <http://www.w3.org/1999/02/22-rdf-syntax-ns#type> <http://e/T> .\n"
        "<http://h/baxter/right_s1/actions/rotate> <http://e/p> \"v\"@en .\n");
  const lrt::Error error = refusal(rdf_xml("\n\n<e:T><f:p/></e:T>"), Syntax::rdf_xml);
  CHECK(error.line == 3);
}

TEST_CASE("RDF/XML with a document type is refused: no entities, of its own or from elsewhere", "[rdf]") {
  const std::string content = rdf_xml("<rdf:Description rdf:about='a'><e:p>&x;</e:p></rdf:Description>");
  for (const char* prolog : {"", "<?xml version='1.0'?>", "\xEF\xBB\xBF <!-- c --> <?pi?>"}) {
    refusal(prolog + ("<!DOCTYPE r [<!ENTITY x SYSTEM 'file:///etc/hostname'>]>" + content), Syntax::rdf_xml);
  }
  std::string bomb = "<!DOCTYPE r [<!ENTITY a0 'lollollollol'>";
  for (int i = 1; i < 12; ++i) {
    bomb += "<!ENTITY a" + std::to_string(i) + " '";
    for (int k = 0; k < 10; ++k) bomb += "&a" + std::to_string(i - 1) + ";";
    bomb += "'>";
  }
  refusal(bomb + "]>" + rdf_xml("<rdf:Description><e:p>&a11;</e:p></rdf:Description>"), Syntax::rdf_xml);
  accepted(rdf_xml("<rdf:Description><e:p>&lt;!DOCTYPE</e:p></rdf:Description>"), Syntax::rdf_xml);
  refusal("<?xml version='1.0' encoding='UTF-7'?>" + rdf_xml(""), Syntax::rdf_xml);
  accepted("<?xml version='1.0' encoding='utf-8'?>" + rdf_xml(""), Syntax::rdf_xml);
}

TEST_CASE("language tags that Raptor would read beyond are refused", "[rdf]") {
  const std::string longest = "en-" + std::string(252, 'x');
  for (const bool fits : {true, false}) {
    const std::string tag = longest + (fits ? "" : "y");
    for (const auto& [text, syntax] :
         {std::pair<std::string, Syntax>("<a:> <b:> \"x\"@" + tag + " .", Syntax::turtle),
          std::pair<std::string, Syntax>("<a:> <b:> \"x\"@" + tag + " .", Syntax::n_triples),
          std::pair<std::string, Syntax>(
              rdf_xml("<rdf:Description rdf:about='a:'><e:p xml:lang = '" + tag + "'>x</e:p></rdf:Description>"),
              Syntax::rdf_xml)}) {
      if (fits) {
        const Graph g = accepted(text, syntax);
        for (const Syntax as : available_syntaxes()) {
          if (as != Syntax::rdf_xml || syntax == as) CHECK(write(g, as));
        }
      } else {
        CHECK(refusal(text, syntax).message.find("language tag of more than 255 bytes") != std::string::npos);
      }
    }
  }
}

TEST_CASE("RDF/XML that XML cannot carry is refused when writing", "[rdf]") {
  const auto refused = [](const TermView& predicate, const TermView& object) {
    Graph g;
    g.add(lrt::rdf::iri("http://e/s"), predicate, object);
    const auto text = write(g, Syntax::rdf_xml);
    return !text && text.error().code == Errc::unsupported_syntax;
  };
  const TermView p = lrt::rdf::iri("http://e/p");
  CHECK_FALSE(refused(p, literal("a\r\n\t<&>\"'")));
  CHECK_FALSE(refused(p, tagged_literal("a", "en-gb")));
  CHECK(refused(lrt::rdf::iri("http://e/1"), literal("a")));
  CHECK(refused(lrt::rdf::iri("http://e/"), literal("a")));
  CHECK(refused(p, literal("\x01")));
  CHECK(refused(p, literal("\xEF\xBF\xBF")));
  CHECK(refused(p, literal(std::string_view("a\0b", 3))));
}

TEST_CASE("RDF/XML that was written reads back as the same graph", "[rdf]") {
  Graph g;
  const TermView s = lrt::rdf::iri("http://e/s");
  g.add(s, vocab::rdf::type, vocab::maths::Scalar);
  g.add(s, vocab::vom::numericalValue, literal("43.6", vocab::xsd::float_));
  g.add(s, vocab::vom::unit, blank("u"));
  g.add(blank("u"), vocab::rdf::type, vocab::maths::Degree);
  g.add(blank("v"), lrt::rdf::iri("http://e/p"), blank("v"));
  const auto text = write(g, Syntax::rdf_xml);
  REQUIRE(text);
  CHECK(text->find("xmlns:maths=") != std::string::npos);
  CHECK(text->find("xmlns:ros=") == std::string::npos);
  CHECK(isomorphic(g, accepted(*text, Syntax::rdf_xml)));
  for (int i = 0; i < 300; ++i)
    g.add(blank("v" + std::to_string(i)), lrt::rdf::iri("http://e/p"), blank("v" + std::to_string(i + 1)));
  const auto large = write(g, Syntax::rdf_xml);
  REQUIRE(large);
  CHECK(accepted(*large, Syntax::rdf_xml).size() == g.size());
}

TEST_CASE("threads that come and go read and write at once", "[rdf]") {
  std::vector<std::thread> threads;
  std::vector<int> good(6, 0);
  for (std::size_t n = 0; n < good.size(); ++n) {
    threads.emplace_back([n, &good] {
      for (int i = 0; i < 50; ++i) {
        const auto g = read("@prefix e: <http://e/> . e:s e:p [ e:q " + std::to_string(n) + " ] .", Syntax::turtle, {});
        const auto xml = g ? write(*g, Syntax::rdf_xml) : std::string();
        const auto bad = read("<a:> <b:> .", Syntax::turtle, {});
        good[n] += g && g->size() == 2 && xml && !bad;
      }
    });
  }
  for (std::thread& t : threads) t.join();
  CHECK(good == std::vector<int>(6, 50));
}

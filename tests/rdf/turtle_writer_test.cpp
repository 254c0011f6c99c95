// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/codec.hpp>

#include <string>

#include <lrt/rdf/vocab.hpp>

#include "tests/support/catch.hpp"

using namespace lrt::rdf;
namespace vocab = lrt::vocab;

namespace {

const TermView s = lrt::rdf::iri("http://e/s"), p = lrt::rdf::iri("http://e/p"), q = lrt::rdf::iri("http://e/q");
const Prefixes e_only = {{"e", "http://e/"}};

/// Turtle that reads back as the same graph.
std::string turtle(const Graph& g, const Prefixes& prefixes = e_only) {
  const auto text = write(g, Syntax::turtle, prefixes);
  if (!text) FAIL(text.error().message);
  const auto back = read(*text, Syntax::turtle, {});
  INFO(*text);
  if (!back) FAIL(back.error().message);
  CHECK(back->size() == g.size());
  if (g.size() < 1000) CHECK(isomorphic(g, *back));
  return *text;
}

/// The part of the object of the graph's only triple.
std::string object(const TermView& term) {
  Graph g;
  g.add(s, p, term);
  const std::string text = turtle(g), before = "e:s e:p ";
  const std::size_t at = text.find(before) + before.size();
  return text.substr(at, text.rfind(" .\n") - at);
}

}  // namespace

TEST_CASE("Turtle has the form of the paper's figures", "[rdf][R1.2]") {
  Graph g;
  const TermView rotation = lrt::rdf::iri("http://localhost/baxter/right_s1/rotation");
  g.add(rotation, vocab::spatial::rotationAngle, blank("angle"));
  g.add(rotation, vocab::rdf_::type, vocab::spatial::Rotation3D);
  g.add(blank("angle"), vocab::rdf_::type, vocab::maths::Scalar);
  g.add(blank("angle"), vocab::vom::numericalValue, literal("43.6", vocab::xsd::float_));
  g.add(blank("angle"), vocab::vom::unit, vocab::maths::Degree);
  g.add(rotation, vocab::rdf_::type, vocab::hybrit::Property);
  CHECK(turtle(g, default_prefixes()) == R"(@prefix hybrit: <https://hybr-it-projekt.de/ns/hybr-it#> .
@prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> .
@prefix maths: <http://vocab.arvida.de/2015/06/maths/vocab#> .
@prefix spatial: <http://vocab.arvida.de/2015/06/spatial/vocab#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .

<http://localhost/baxter/right_s1/rotation> a spatial:Rotation3D, hybrit:Property ;
    spatial:rotationAngle [
        a maths:Scalar ;
        vom:numericalValue "43.6"^^xsd:float ;
        vom:unit maths:Degree
    ] .
)");
}

TEST_CASE("an empty graph is an empty document", "[rdf]") {
  for (const Syntax syntax : available_syntaxes()) {
    const auto text = write(Graph(), syntax);
    REQUIRE(text);
    const auto back = read(*text, syntax, {});
    REQUIRE(back);
    CHECK(back->empty());
  }
  CHECK(write(Graph(), Syntax::turtle)->empty());
}

TEST_CASE("writing is deterministic: it follows the order of addition", "[rdf][R0.11]") {
  Graph a, b;
  for (int i = 0; i < 50; ++i) {
    for (Graph* g : {&a, &b})
      g->add(blank("n" + std::to_string(i % 7)), lrt::rdf::iri("http://e/p" + std::to_string(i % 3)), literal(std::to_string(i)));
  }
  for (const Syntax syntax : available_syntaxes()) CHECK(*write(a, syntax) == *write(b, syntax));
}

TEST_CASE("numbers and booleans lose their quotes only when Turtle reads the same literal", "[rdf]") {
  CHECK(object(literal("5", vocab::xsd::integer)) == "5");
  CHECK(object(literal("-005", vocab::xsd::integer)) == "-005");
  CHECK(object(literal("+5.0", vocab::xsd::decimal)) == "+5.0");
  CHECK(object(literal(".5", vocab::xsd::decimal)) == ".5");
  CHECK(object(literal("1.", vocab::xsd::decimal)) == "\"1.\"^^<http://www.w3.org/2001/XMLSchema#decimal>");
  CHECK(object(literal("5", vocab::xsd::decimal)) == "\"5\"^^<http://www.w3.org/2001/XMLSchema#decimal>");
  CHECK(object(literal("1e0", vocab::xsd::double_)) == "1e0");
  CHECK(object(literal("1.E-3", vocab::xsd::double_)) == "1.E-3");
  CHECK(object(literal("1.0", vocab::xsd::double_)) == "\"1.0\"^^<http://www.w3.org/2001/XMLSchema#double>");
  CHECK(object(literal("INF", vocab::xsd::double_)) == "\"INF\"^^<http://www.w3.org/2001/XMLSchema#double>");
  CHECK(object(literal("true", vocab::xsd::boolean)) == "true");
  CHECK(object(literal("1", vocab::xsd::boolean)) == "\"1\"^^<http://www.w3.org/2001/XMLSchema#boolean>");
  CHECK(object(literal("", vocab::xsd::integer)) == "\"\"^^<http://www.w3.org/2001/XMLSchema#integer>");
}

TEST_CASE("strings are escaped, a raw CR too", "[rdf]") {
  CHECK(object(literal("a\"b\\c\r\n\t")) == R"("a\"b\\c\r\n\t")");
  CHECK(object(literal(std::string_view("\x01\x1F\x7F", 3))) == R"("\u0001\u001F\u007F")");
  CHECK(object(literal("Grün \xF0\x9F\xA4\x96")) == "\"Grün \xF0\x9F\xA4\x96\"");
  CHECK(object(tagged_literal("a", "de-1996")) == "\"a\"@de-1996");
  Graph g;
  g.add(s, p, literal(std::string_view("a\0b", 3)));
  CHECK(write(g, Syntax::n_triples)->find("\"a\\u0000b\"") != std::string::npos);
}

TEST_CASE("a local name that readers of Turtle interpret differently is written as an IRI", "[rdf]") {
  CHECK(object(lrt::rdf::iri("http://e/")) == "e:");
  CHECK(object(lrt::rdf::iri("http://e/M-PER-SEC")) == "e:M-PER-SEC");
  CHECK(object(lrt::rdf::iri("http://e/1a.b")) == "e:1a.b");
  for (const std::string local : {"a/b", "a#b", "a.", "-a", ".a", "a:b", "a%20b", "a~b", "ä", "a,b"}) {
    CHECK(object(lrt::rdf::iri("http://e/" + local)) == "<http://e/" + local + ">");
  }
  CHECK(object(vocab::rdf_::type) == "<http://www.w3.org/1999/02/22-rdf-syntax-ns#type>");
}

TEST_CASE("the longest namespace is used, and unusable prefixes are ignored", "[rdf]") {
  Graph g;
  g.add(lrt::rdf::iri("http://long.example/ns/x"), lrt::rdf::iri("http://long.example/y"), s);
  CHECK(turtle(g, {{"l", "http://long.example/"},
                   {"n", "http://long.example/ns/"},
                   {"l", "http://e/"},
                   {"bad name", "http://e/"},
                   {"relative", "/ns/whatever"}}) ==
        "@prefix l: <http://long.example/> .\n@prefix n: <http://long.example/ns/> .\n\nn:x l:y <http://e/s> .\n");
}

TEST_CASE("a blank node in only one triple is nested, others get labels", "[rdf]") {
  Graph g;
  SECTION("nowhere mentioned") {
    g.add(blank("a"), p, literal("1"));
    CHECK(turtle(g) == "@prefix e: <http://e/> .\n\n[] e:p \"1\" .\n");
  }
  SECTION("mentioned twice") {
    g.add(s, p, blank("a"));
    g.add(s, q, blank("a"));
    g.add(blank("a"), p, literal("1"));
    CHECK(turtle(g) == "@prefix e: <http://e/> .\n\ne:s e:p _:a ;\n    e:q _:a .\n\n_:a e:p \"1\" .\n");
  }
  SECTION("an object only") {
    g.add(s, p, blank("a"));
    CHECK(turtle(g) == "@prefix e: <http://e/> .\n\ne:s e:p [] .\n");
  }
  SECTION("a cycle, and what hangs from it") {
    g.add(blank("a"), p, blank("b"));
    g.add(blank("b"), p, blank("a"));
    g.add(blank("b"), q, blank("c"));
    g.add(blank("c"), q, literal("1"));
    CHECK(turtle(g) == "@prefix e: <http://e/> .\n\n_:a e:p _:b .\n\n_:b e:p _:a ;\n    e:q [\n        e:q \"1\"\n    ] .\n");
  }
  SECTION("itself") {
    g.add(blank("a"), p, blank("a"));
    CHECK(turtle(g) == "@prefix e: <http://e/> .\n\n_:a e:p _:a .\n");
  }
}

TEST_CASE("labels that Turtle lacks are renamed without a clash", "[rdf]") {
  Graph g;
  for (const std::string label : {"b0", "a b", "", "-x", "y.", "ä", "b1"}) { g.add(blank(label), p, blank(label)); }
  CHECK(turtle(g) ==
        "@prefix e: <http://e/> .\n\n_:b0 e:p _:b0 .\n\n_:b2 e:p _:b2 .\n\n_:b3 e:p _:b3 .\n\n_:b4 e:p _:b4 .\n\n"
        "_:b5 e:p _:b5 .\n\n_:b6 e:p _:b6 .\n\n_:b1 e:p _:b1 .\n");
  const auto text = write(g, Syntax::n_triples);
  REQUIRE(text);
  const auto back = read(*text, Syntax::n_triples, {});
  REQUIRE(back);
  CHECK(isomorphic(g, *back));
}

TEST_CASE("well-formed lists are written with parentheses", "[rdf]") {
  Graph g;
  g.add(s, p, blank("1"));
  g.add(blank("1"), vocab::rdf_::first, literal("1", vocab::xsd::integer));
  g.add(blank("1"), vocab::rdf_::rest, blank("2"));
  g.add(blank("2"), vocab::rdf_::first, blank("inner"));
  g.add(blank("2"), vocab::rdf_::rest, vocab::rdf_::nil);
  SECTION("alone") {
    g.add(s, q, vocab::rdf_::nil);
    CHECK(turtle(g) == "@prefix e: <http://e/> .\n\ne:s e:p ( 1 [] ) ;\n    e:q () .\n");
  }
  SECTION("a list in a list") {
    g.add(blank("inner"), vocab::rdf_::first, literal("a"));
    g.add(blank("inner"), vocab::rdf_::rest, vocab::rdf_::nil);
    CHECK(turtle(g) == "@prefix e: <http://e/> .\n\ne:s e:p ( 1 ( \"a\" ) ) .\n");
  }
  SECTION("not if a cell is a subject of more, which Raptor's writer gets wrong") {
    g.add(blank("2"), q, literal("more"));
    CHECK(turtle(g).find("( ") == std::string::npos);
  }
  SECTION("not if somebody else mentions a cell") {
    g.add(s, q, blank("2"));
    CHECK(turtle(g).find("( ") == std::string::npos);
  }
  SECTION("not if a cell has two members") {
    g.add(blank("2"), vocab::rdf_::first, literal("b"));
    CHECK(turtle(g).find("( ") == std::string::npos);
  }
}

TEST_CASE("a nest a hundred thousand deep is written without recursion", "[rdf]") {
  Graph g;
  for (int i = 0; i < 100'000; ++i) g.add(blank("n" + std::to_string(i)), p, blank("n" + std::to_string(i + 1)));
  turtle(g);
  Graph lists;  // ( ( ( ... ) ) )
  for (int i = 0; i < 100'000; ++i) {
    lists.add(blank("n" + std::to_string(i)), vocab::rdf_::first, blank("n" + std::to_string(i + 1)));
    lists.add(blank("n" + std::to_string(i)), vocab::rdf_::rest, vocab::rdf_::nil);
  }
  const auto text = write(lists, Syntax::turtle);
  REQUIRE(text);
  ReadOptions options;
  options.max_triples = 300'000;
  const auto back = read(*text, Syntax::turtle, options);
  REQUIRE(back);
  CHECK(back->size() == lists.size());
}

TEST_CASE("a term that no syntax can express is refused and named", "[rdf]") {
  for (const TermView& term : {lrt::rdf::iri("relative"), lrt::rdf::iri("http://e/a b"), lrt::rdf::iri("http://e/<>"), literal("\xFF"),
                               tagged_literal("a", "not_a_tag"), literal("a", lrt::Iri("no datatype"))}) {
    Graph g;
    g.add(s, p, term);
    for (const Syntax syntax : available_syntaxes()) {
      const auto text = write(g, syntax);
      REQUIRE_FALSE(text);
      CHECK(text.error().code == lrt::Errc::unsupported_syntax);
      CHECK(text.error().message.find("cannot write ") == 0);
    }
  }
}

TEST_CASE("fragments that a document describes have prefixes, in the order of use", "[rdf][turtle]") {
  Graph g;
  const TermView a = lrt::rdf::iri("http://r/arm#a"), b = lrt::rdf::iri("http://r/arm#b.1"), c = lrt::rdf::iri("http://r/leg#c");
  g.add(s, p, a);
  g.add(a, p, literal("1"));
  g.add(s, q, b);
  g.add(b, p, c);
  g.add(c, p, lrt::rdf::iri("http://r/other#only-named"));
  CHECK(turtle(g) ==
        "@prefix e: <http://e/> .\n@prefix : <http://r/arm#> .\n@prefix p1: <http://r/leg#> .\n\n"
        "e:s e:p :a ;\n    e:q :b.1 .\n\n:a e:p \"1\" .\n\n:b.1 e:p p1:c .\n\np1:c e:p <http://r/other#only-named> .\n");
  // A name of the caller is not given twice.
  const Prefixes taken = {{"e", "http://e/"}, {"", "http://x/"}, {"p1", "http://y/"}};
  CHECK(turtle(g, taken).find("@prefix p2: <http://r/arm#> .\n@prefix p3: <http://r/leg#> .") != std::string::npos);
}

TEST_CASE("a document has at most 900 prefixes of fragments", "[rdf][turtle]") {
  Graph g;
  for (int i = 0; i < 1000; ++i) {
    const std::string part = "http://r/part" + std::to_string(i) + "#x";
    g.add(s, p, lrt::rdf::iri(part));
    g.add(lrt::rdf::iri(part), p, literal("1"));
  }
  const std::string text = turtle(g);  // lrt reads at most 1000 directives
  std::size_t prefixes = 0;
  for (std::size_t at = text.find("@prefix"); at != std::string::npos; at = text.find("@prefix", at + 1)) ++prefixes;
  CHECK(prefixes == 901);
}

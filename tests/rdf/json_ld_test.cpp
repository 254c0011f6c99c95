// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/codec.hpp>

#include <cstdint>
#include <cstring>
#include <string>
#include <tuple>

#include <lrt/rdf/lexical.hpp>
#include <lrt/rdf/vocab.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/graphs.hpp"

using namespace lrt::rdf;
using lrt::Errc;
using lrt::Result;
namespace vocab = lrt::vocab;
namespace test = lrt::test;

namespace {

const TermView s = lrt::rdf::iri("http://e/s"), p = lrt::rdf::iri("http://e/p"), q = lrt::rdf::iri("http://e/q");
const Prefixes e_only = {{"e", "http://e/"}};
constexpr const char* our_context = "http://localhost/ns/context.jsonld";

/// JSON-LD that reads back as the same graph.
std::string json(const Graph& g, const Prefixes& prefixes = e_only, std::string_view context = {}) {
  const auto text = write(g, Syntax::json_ld, prefixes, context);
  if (!text) FAIL(text.error().message);
  ReadOptions options;
  options.context = our_context;
  options.context_prefixes = &prefixes;
  const auto back = read(*text, Syntax::json_ld, options);
  INFO(*text);
  if (!back) FAIL(back.error().message);
  CHECK(back->size() == g.size());
  if (g.size() < 1000) CHECK(isomorphic(g, *back));
  return *text;
}

/// The value of the predicate http://e/p of a graph of one triple.
std::string value(const TermView& term, TermView predicate = p) {
  Graph g;
  g.add(s, predicate, term);
  const std::string text = json(g);
  const std::size_t at = text.find("\n  \"id\": \"e:s\",\n  ");
  REQUIRE(at != std::string::npos);
  const std::size_t from = text.find("\": ", at + 18) + 3;
  return text.substr(from, text.rfind("\n}\n") - from);
}

Result<Graph> parse(std::string_view text, std::string_view base = "http://localhost/arm/x") {
  ReadOptions options;
  options.base = base;
  options.context = our_context;
  return read(text, Syntax::json_ld, options);
}

/// Empty if the document is the graph of the Turtle.
std::string differs(std::string_view document, std::string_view turtle) {
  const Result<Graph> found = parse(document);
  if (!found) return found.error().message;
  return isomorphic(*found, test::turtle(turtle, "http://localhost/arm/x")) ? "" : *write(*found, Syntax::n_triples);
}

std::string refusal(std::string_view document, Errc code = Errc::expected_rdf) {
  const Result<Graph> found = parse(document);
  if (found) return "read: " + *write(*found, Syntax::n_triples);
  if (found.error().code != code) return "code: " + std::string(to_string(found.error().code)) + ": " + found.error().message;
  return found.error().message;
}
bool says(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("JSON-LD has the form that a web developer would write", "[rdf][json_ld][R1.2]") {
  Graph g = test::turtle(R"(<arm/angle> a hybrit:Property, maths:Scalar ; rdfs:seeAlso <arm> ; vom:numericalValue 43 ; vom:unit maths:Degree ;
                            qudt:hasUnit unit:DEG ; dcterms:modified "2016-06-01T12:00:00Z"^^xsd:dateTime ; rdfs:label "Winkel"@de .)");
  CHECK(json(g, default_prefixes(), our_context) == R"({
  "@context": "http://localhost/ns/context.jsonld",
  "id": "http://localhost/arm/angle",
  "type": ["Property", "Scalar"],
  "seeAlso": "http://localhost/arm",
  "numericalValue": 43,
  "unit": "maths:Degree",
  "hasUnit": "http://qudt.org/vocab/unit/DEG",
  "modified": "2016-06-01T12:00:00Z",
  "label": {"@language": "de", "@value": "Winkel"}
}
)");
  Graph nested =
      test::turtle(R"(<r> a spatial:Rotation3D ; spatial:rotationAngle [ vom:numericalValue "43.6"^^xsd:float ] ; rdf:value ( 1 true "a" ) .
                                 <s> a hybrit:Action ; hybrit:property <r>, <s> .)");
  CHECK(json(nested, default_prefixes()) == R"({
  "@context": {
    "id": "@id",
    "type": "@type",
    "hybrit": "https://hybr-it-projekt.de/ns/hybr-it#",
    "vom": "http://vocab.arvida.de/2015/06/vom/vocab#",
    "spatial": "http://vocab.arvida.de/2015/06/spatial/vocab#",
    "rdf": "http://www.w3.org/1999/02/22-rdf-syntax-ns#",
    "xsd": "http://www.w3.org/2001/XMLSchema#",
    "Action": "hybrit:Action",
    "property": {"@id": "hybrit:property", "@type": "@id"},
    "numericalValue": "vom:numericalValue",
    "Rotation3D": "spatial:Rotation3D",
    "rotationAngle": "spatial:rotationAngle",
    "value": "rdf:value"
  },
  "@graph": [
    {
      "id": "http://localhost/r",
      "type": "Rotation3D",
      "rotationAngle": {
        "numericalValue": {"@type": "xsd:float", "@value": "43.6"}
      },
      "value": {"@list": [1, true, "a"]}
    },
    {
      "id": "http://localhost/s",
      "type": "Action",
      "property": [
        "http://localhost/r",
        "http://localhost/s"
      ]
    }
  ]
}
)");
}

TEST_CASE("a literal is a JSON number only if every reader gets the same literal", "[rdf][json_ld]") {
  const auto integer = [](const char* text) { return value(literal(text, vocab::xsd::integer)); };
  for (const char* same : {"0", "5", "-5", "9007199254740991", "-9007199254740991"}) CHECK(integer(same) == same);
  for (const char* other : {"-0", "+5", "05", "", "9007199254740992", "123456789012345678901", "x"})
    CHECK(integer(other) == R"({"@type": "http://www.w3.org/2001/XMLSchema#integer", "@value": ")" + std::string(other) + "\"}");
  const auto real = [](const std::string& text) { return value(literal(text, vocab::xsd::double_)); };
  for (const char* same : {"4.36E1", "1.0E-1", "-1.5E-6", "3.14159265358979E0"}) CHECK(real(same) == same);
  for (const char* other : {"43.6", "1.0E0", "1.0E1", "4.36e1", "04.36E1", "4.360E1", "INF", "NaN", "1.5E-7", "5.0E-324", "4.940656458412465E-324",
                            "3.0000000000000004E-1", "1.0E21", "1E999", "0.0E0", "E", "1.E1"})
    CHECK(real(other) == R"({"@type": "http://www.w3.org/2001/XMLSchema#double", "@value": ")" + std::string(other) + "\"}");
  CHECK(value(literal("true", vocab::xsd::boolean)) == "true");
  CHECK(value(literal("1", vocab::xsd::boolean)) == R"({"@type": "http://www.w3.org/2001/XMLSchema#boolean", "@value": "1"})");
  CHECK(value(literal("1.5", vocab::xsd::decimal)) == R"({"@type": "http://www.w3.org/2001/XMLSchema#decimal", "@value": "1.5"})");
}

TEST_CASE("every finite double reads back bit-identically from JSON-LD, as a literal and as a number", "[rdf][json_ld]") {
  std::uint64_t state = 1;
  for (int i = 0; i < 20'000; ++i) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    double number;
    static_assert(sizeof number == sizeof state);
    std::memcpy(&number, &state, sizeof number);
    if (!(number - number == 0)) continue;
    Graph g;
    g.add(s, p, literal(lexical::format(number), vocab::xsd::double_));
    ReadOptions options;
    const Graph back = read(*write(g, Syntax::json_ld), Syntax::json_ld, options).value();
    const auto same = lexical::parse_double(back.object(s, p)->text);
    REQUIRE(std::memcmp(&*same, &number, sizeof number) == 0);
    // As a client writes it.
    const Graph native =
        parse("{\"http://e/p\": {\"@value\": " + lexical::format(number) + ", \"@type\": \"http://www.w3.org/2001/XMLSchema#double\"}}").value();
    const TermView read_as = native.term(native.triples().front().object);
    REQUIRE(read_as.datatype == vocab::xsd::double_.text);
    const auto again = lexical::parse_double(read_as.text);
    REQUIRE(std::memcmp(&*again, &number, sizeof number) == 0);
  }
}

TEST_CASE("strings of any Unicode are JSON strings", "[rdf][json_ld]") {
  CHECK(value(literal("a\"b\\c\r\n\t/")) == R"("a\"b\\c\r\n\t/")");
  CHECK(value(literal(std::string_view("\x01\x1F\x7F", 3))) == R"("\u0001\u001F\u007F")");
  CHECK(value(literal("Grün \xF0\x9F\xA4\x96 \xE2\x80\xA8")) == "\"Grün \xF0\x9F\xA4\x96 \xE2\x80\xA8\"");
  CHECK(value(literal("@id")) == "\"@id\"");
  CHECK(value(literal("e:x")) == "\"e:x\"");
  CHECK(value(tagged_literal("a", "de-1996")) == R"({"@language": "de-1996", "@value": "a"})");
  Graph g;
  g.add(s, p, literal("a\xFF"));
  CHECK(write(g, Syntax::json_ld).error().code == Errc::unsupported_syntax);
}

TEST_CASE("a value that a typed term cannot express is written with its type", "[rdf][json_ld]") {
  CHECK(value(vocab::maths::Degree, vocab::vom::unit) == "\"http://vocab.arvida.de/2015/06/maths/vocab#Degree\"");
  CHECK(value(literal("deg"), vocab::vom::unit) == R"({"@value": "deg"})");
  CHECK(value(literal("5", vocab::xsd::integer), vocab::vom::unit) == "5");
  CHECK(value(vocab::lrt_::running, vocab::lrt_::status) == "\"running\"");
  CHECK(value(s, vocab::lrt_::status) == "\"e:s\"");
  CHECK(value(literal("running"), vocab::lrt_::status) == R"({"@value": "running"})");
  CHECK(value(vocab::lrt_::running, vocab::vom::unit) == "\"https://w3id.org/lrt/ns#running\"");  // terms count for @vocab only
  CHECK(value(literal("0.5", vocab::xsd::double_), vocab::lrt_::progress) == "\"0.5\"");
  CHECK(value(literal("0.5"), vocab::lrt_::progress) == R"({"@value": "0.5"})");
  CHECK(value(literal("1", vocab::xsd::integer), vocab::lrt_::progress) == R"({"@type": "http://www.w3.org/2001/XMLSchema#integer", "@value": "1"})");
  CHECK(value(s) == R"({"id": "e:s"})");
}

TEST_CASE("an IRI whose scheme is the name of a prefix is not read as a compact IRI", "[rdf][json_ld]") {
  Graph g;
  g.add(lrt::rdf::iri("ros:thing"), lrt::rdf::iri("sh:path"), vocab::ros::rotation);
  g.add(lrt::rdf::iri("ros://host/x"), vocab::sh::path, lrt::rdf::iri("id:x"));
  const std::string text = json(g, default_prefixes(), our_context);
  CHECK_FALSE(says(text, our_context));
  CHECK_FALSE(says(text, "\"sh\":"));
  CHECK(says(text, "\"http://ros.org/#rotation\""));
  Graph fine;
  fine.add(lrt::rdf::iri("ros://host/x"), p, q);
  CHECK(says(json(fine, default_prefixes(), our_context), our_context));
}

TEST_CASE("a blank node in only one triple is nested", "[rdf][json_ld]") {
  const auto round = [](std::string_view turtle) { return json(test::turtle(turtle), default_prefixes()); };
  CHECK(says(round("<s> rdf:value [ rdf:value [ rdf:value 1 ] ] ."), "\"value\": {\n    \"value\": {\n      \"value\": 1\n    }\n  }"));
  CHECK(says(round("<s> rdf:value _:a . <t> rdf:value _:a . _:a rdf:value 1 ."), "\"id\": \"_:b0\""));
  CHECK(says(round("_:a rdf:value _:b . _:b rdf:value _:a ."), "\"id\": \"_:b1\""));
  CHECK(says(round("<s> rdf:value [] ."), "{\"id\": \"_:b0\"}"));
  CHECK_FALSE(says(round("[] rdf:value 1 ."), "\"id\": \"_:"));
  CHECK(says(round("[] rdf:value 1 . [] rdf:value 2 ."), "@graph"));
  Graph deep;
  for (int i = 0; i < 3000; ++i) deep.add(blank("n" + std::to_string(i)), p, blank("n" + std::to_string(i + 1)));
  json(deep);
  Graph odd;
  odd.add(blank("a b"), p, blank("b0"));
  odd.add(blank("b0"), p, blank("a b"));
  json(odd);
}

TEST_CASE("well-formed lists are @list, others are not", "[rdf][json_ld]") {
  const auto round = [](std::string_view turtle) { return json(test::turtle(turtle), default_prefixes()); };
  CHECK(says(round("<s> rdf:value ( 1 ( 2 () ) ) ."), R"("value": {"@list": [1, {"@list": [2, {"@list": []}]}]})"));
  CHECK(says(round("<s> hybrit:property ( <a> \"b\" ) ."), R"({"@list": ["http://localhost/a", {"@value": "b"}]})"));
  for (const char* no_list :
       {"<s> rdf:value _:l . _:l rdf:first 1 .", "<s> rdf:value _:l . _:l rdf:first 1, 2 ; rdf:rest () .", "_:l rdf:first 1 ; rdf:rest _:l .",
        "<s> rdf:value [ rdf:first 1 ; rdf:rest () ; a rdf:List ] .", "<s> rdf:value _:l . <t> rdf:value _:l . _:l rdf:first 1 ; rdf:rest () .",
        "() rdf:first () ; rdf:rest 5 .", "<s> rdf:first 1 ; rdf:rest ( 2 ) .", "<s> rdf:value [ rdf:first 1 ; rdf:rest \"x\" ] ."}) {
    CAPTURE(no_list);
    round(no_list);
  }
}

TEST_CASE("a type that is not an IRI is a value of rdf:type", "[rdf][json_ld][R1.4]") {
  const std::string text = json(test::turtle("<s> a \"x\", <C>, [ rdfs:label \"y\" ], hybrit:Action, _:c . _:c a _:c ."), default_prefixes());
  CHECK(says(text, R"("type": ["http://localhost/C", "Action"],)"));
  CHECK(says(text, "\"rdf:type\": [\n"));
}

TEST_CASE("invalid RDF is not written", "[rdf][json_ld]") {
  for (const auto& [subject, predicate, object] :
       {std::tuple{lrt::rdf::iri("rel"), p, q}, std::tuple{s, lrt::rdf::iri("rel"), q}, std::tuple{s, p, lrt::rdf::iri("http://e/ x")},
        std::tuple{s, p, literal("x", lrt::Iri("rel"))}, std::tuple{s, p, tagged_literal("x", "d e")}}) {
    Graph g;
    g.add(subject, predicate, object);
    const auto text = write(g, Syntax::json_ld);
    REQUIRE_FALSE(text);
    CHECK(text.error().code == Errc::unsupported_syntax);
  }
}

TEST_CASE("the context document has every term once, and every prefix without the name of a term", "[rdf][json_ld]") {
  const std::string text = json_ld_context();
  CHECK(says(text, R"("ros": "http://ros.org/#")"));
  CHECK(says(text, R"("unit": {"@id": "vom:unit", "@type": "@id"})"));
  CHECK_FALSE(says(text, "\"unit\": \"http"));
  CHECK(says(text, R"("sh:path": {"@type": "@id"})"));
  CHECK(parse("{\"@context\": [" + text.substr(text.find("{", 1), text.rfind('}') - text.find("{", 1)) + "], \"id\": \"a\", \"title\": \"b\"}"));
  // Under other prefixes terms keep their meaning.
  const Prefixes mine = {{"sh", "http://other/"},  {"state", "http://x/state#"}, {"h", "https://hybr-it-projekt.de/ns/hybr-it#"},
                         {"odd", "http://odd/ns"}, {"relative", "/somewhere"},   {"odd", "http://odd/second"}};
  const std::string other = json_ld_context(mine);
  CHECK_FALSE(says(other, "/somewhere"));
  CHECK_FALSE(says(other, "http://odd/second"));
  CHECK_FALSE(says(other, "sh:path"));
  CHECK_FALSE(says(other, "http://x/state#"));
  CHECK(says(other, R"("property": {"@id": "h:property", "@type": "@id"})"));
  CHECK(says(other, R"("odd": {"@id": "http://odd/ns", "@prefix": true})"));
  Graph g = test::turtle("<s> sh:path <http://other/a>, <http://odd/nsx> ; hybrit:property <b> .");
  CHECK(says(json(g, mine, our_context), "\"odd:x\""));
  json(g, mine);
}

TEST_CASE("expanded and flattened documents are read", "[rdf][json_ld][R1.2]") {
  CHECK(differs(R"([{"@id": "http://e/s", "@type": ["http://e/C"], "http://e/p": [{"@value": "a"}, {"@value": "b", "@language": "DE"},
                     {"@value": "5", "@type": "http://e/t"}, {"@id": "http://e/o"}, {"@list": [{"@value": 1}, {"@list": []}]}, {"@value": null}]}])",
                R"(<http://e/s> a <http://e/C> ; <http://e/p> "a", "b"@de, "5"^^<http://e/t>, <http://e/o>, ( 1 () ) .)") == "");
  CHECK(differs(R"({"@graph": [{"@id": "_:b1", "http://e/p": [{"@id": "_:b2"}]}, {"@id": "_:b2", "http://e/p": [{"@id": "_:b1"}]}]})",
                "_:x <http://e/p> _:y . _:y <http://e/p> _:x .") == "");
  CHECK(differs("[]", "") == "");
  CHECK(differs("{}", "") == "");
  CHECK(differs(R"([{"@value": "x"}, "y", 5, {"@list": [1]}, {"@set": [{"http://e/p": 1}]}, {"@id": "http://e/s"}])", "[] <http://e/p> 1 .") == "");
}

TEST_CASE("a document may refer to lrt's context", "[rdf][json_ld][R1.2]") {
  const std::string graph =
      "<http://localhost/arm/x> a hybrit:Property ; vom:numericalValue 4.36E1 ; vom:unit maths:Degree ; lrt:status lrt:running .";
  const std::string body = R"("id": "", "type": "Property", "numericalValue": 43.6, "unit": "maths:Degree", "status": "running"})";
  for (const char* by : {"\"http://localhost/ns/context.jsonld\"", "\"http://localhost/ns/context.jsonld?v=abc\"", "\"/ns/context.jsonld\"",
                         "\"../ns/context.jsonld\"", "[\"/ns/context.jsonld\", {\"x\": \"http://x/\"}]",
                         "[{\"numericalValue\": \"http://no/\"}, \"/ns/context.jsonld\"]", "\"https://w3id.org/lrt/context.jsonld\"",
                         "[null, \"/ns/context.jsonld\"]"}) {
    CAPTURE(by);
    CHECK(differs(std::string("{\"@context\": ") + by + ", " + body, graph) == "");
  }
  const std::string refused = refusal(R"({"@context": "https://schema.org/", "name": "x"})", Errc::unsupported_syntax);
  CHECK(says(refused, "https://schema.org/"));
  CHECK(says(refused, "lrt fetches none"));
  CHECK(says(refused, our_context));
  CHECK(says(refused, "/@context"));
  CHECK(says(refusal(R"({"http://e/p": {"@context": ["/ns/context.jsonld", "http://evil/ns/context.jsonld"]}})", Errc::unsupported_syntax),
             "/http:~1~1e~1p/@context/1"));
}

TEST_CASE("lrt's context among others in an array hides earlier terms, and later terms hide its terms", "[rdf][json_ld]") {
  const auto read_with = [](const char* context, const char* turtle) {
    CAPTURE(context);
    CHECK(differs(std::string("{\"@context\": ") + context + R"(, "a": 1, "title": 2, "x": 3})", turtle) == "");
  };
  read_with(R"([{"a": "e:a", "title": "e:title"}, "/ns/context.jsonld"])", "[] <e:a> 1 ; dcterms:title 2 ; maths:x 3 .");
  read_with(R"([{"a": "e:a"}, "/ns/context.jsonld", {"title": "e:title", "a": "e:b"}])", "[] <e:b> 1 ; <e:title> 2 ; maths:x 3 .");
  read_with(R"([{"a": "e:a"}, "/ns/context.jsonld", {"title": "e:title", "a": "e:b"}, "/ns/context.jsonld"])",
            "[] <e:b> 1 ; dcterms:title 2 ; maths:x 3 .");
  read_with(R"(["/ns/context.jsonld", {"a": "e:a", "x": null}, "/ns/context.jsonld", {"x": null}])", "[] <e:a> 1 ; dcterms:title 2 .");
  read_with(R"([{"a": "e:a"}, "/ns/context.jsonld", null, {"x": "e:x"}])", "[] <e:x> 3 .");
  CHECK(
      differs(
          R"({"@context": [{"a": "e:a"}, "/ns/context.jsonld", {"b": "e:b"}], "title": {"@context": [{"title": "e:t"}, "/ns/context.jsonld", {"a": "e:c"}],
                    "a": 1, "b": 2, "title": 3}, "a": 4})",
          "[] <e:a> 4 ; dcterms:title [ <e:c> 1 ; <e:b> 2 ; dcterms:title 3 ] .") == "");
}

TEST_CASE("contexts in the document are processed", "[rdf][json_ld]") {
  CHECK(
      differs(
          R"({"@context": {"e": "http://e/", "name": "e:name", "knows": {"@id": "e:knows", "@type": "@id"}, "@base": "http://b/x/", "@language": "EN",
                    "when": {"@id": "e:when", "@type": "http://e/date"}, "plain": {"@id": "e:plain", "@language": null}, "kind": "@type", "nothing": null},
                    "@id": "../s", "kind": "e:C", "name": "n", "knows": ["k", "_:b"], "when": "now", "plain": "p", "nothing": 5, "unknown": 6})",
          R"(<http://b/s> a <http://e/C> ; <http://e/name> "n"@en ; <http://e/knows> <http://b/x/k>, [] ; <http://e/when> "now"^^<http://e/date> ;
                   <http://e/plain> "p" .)") == "");
  CHECK(
      differs(
          R"({"@context": {"@vocab": "http://e/", "status": {"@type": "@vocab"}, "l": {"@container": "@list"}, "ll": {"@container": ["@list"], "@type": "@id"},
                    "s": {"@container": "@set"}, "lang": {"@container": "@language"}, "i": {"@container": "@index"}, "r": {"@reverse": "http://e/rr"}},
                    "@id": "", "a": 1, "status": ["a", "http://x/"], "l": [1, [2, []]], "ll": "z", "s": [1], "lang": {"de": ["x", "y"], "@none": "z"},
                    "i": {"one": 1, "two": [2, {"@id": "o"}]}, "r": [{"@id": "q"}], "@reverse": {"back": "http://no/"}})",
          "") == "at \"/@reverse/back\": expected nodes as values of a reversed property");
  CHECK(
      differs(
          R"({"@context": {"@vocab": "http://e/", "status": {"@type": "@vocab"}, "l": {"@container": "@list"}, "ll": {"@container": ["@list"], "@type": "@id"},
                    "s": {"@container": "@set"}, "lang": {"@container": "@language"}, "i": {"@container": "@index"}, "r": {"@reverse": "http://e/rr"}},
                    "@id": "", "a": 1, "status": ["a", "http://x/"], "l": [1, [2, []]], "ll": "z", "s": [1], "lang": {"de": ["x", "y"], "@none": "z"},
                    "i": {"one": 1, "two": [2, {"@id": "o"}]}, "r": [{"@id": "q"}], "@reverse": {"back": {"@id": "t"}}})",
          R"(<> <http://e/a> 1 ; <http://e/status> <http://e/a>, <http://x/> ; <http://e/l> ( 1 ( 2 () ) ) ; <http://e/ll> ( <z> ) ; <http://e/s> 1 ;
                   <http://e/lang> "x"@de, "y"@de, "z" ; <http://e/i> 1, 2, <o> . <q> <http://e/rr> <> . <t> <http://e/back> <> .)") == "");
  // Nested contexts; null removes all definitions.
  CHECK(differs(R"({"@context": {"p": "http://e/p"}, "p": [{"@context": {"p": "http://e/q"}, "p": 1}, {"@context": null, "p": 2, "http://e/p": 3}]})",
                "[] <http://e/p> [ <http://e/q> 1 ], [ <http://e/p> 3 ] .") == "");
  CHECK(differs(R"({"@context": [{"p": "http://e/p"}, {"e": "http://e/"}, {"q": "e:q"}], "p": 1, "q": 2, "@included": [{"@id": "i", "p": 3}],
                    "@nest": {"p": 4}, "@index": "x"})",
                "[] <http://e/p> 1, 4 ; <http://e/q> 2 . <i> <http://e/p> 3 .") == "");
  // A term is a prefix only if its definition is simple or says @prefix.
  CHECK(differs(R"({"@context": {"a": "http://e/a", "b": {"@id": "http://e/b", "@prefix": true}}, "a:x": 1, "b:x": 2})",
                "[] <a:x> 1 ; <http://e/bx> 2 .") == "");
}

TEST_CASE("numbers are read by the rules of JSON-LD, and exactly", "[rdf][json_ld]") {
  const auto number = [](const std::string& text, const std::string& type = "") {
    const Result<Graph> g =
        parse(type.empty() ? "{\"http://e/p\": " + text + "}" : "{\"http://e/p\": {\"@value\": " + text + ", \"@type\": \"" + type + "\"}}");
    if (!g) return g.error().message;
    return to_string(g->term(g->triples().front().object));
  };
  const std::string integer = "\"^^<http://www.w3.org/2001/XMLSchema#integer>", real = "\"^^<http://www.w3.org/2001/XMLSchema#double>";
  CHECK(number("5") == "\"5" + integer);
  CHECK(number("-5") == "\"-5" + integer);
  CHECK(number("-0") == "\"0" + integer);
  CHECK(number("5.0") == "\"5" + integer);
  CHECK(number("1e3") == "\"1000" + integer);
  CHECK(number("9007199254740993") == "\"9007199254740993" + integer);
  CHECK(number("123456789012345678901") == "\"123456789012345678901" + integer);
  CHECK(number("1234567890123456789012") == "\"1.2345678901234568E21" + real);
  CHECK(number("1e21") == "\"1.0E21" + real);
  CHECK(number("43.6") == "\"4.36E1" + real);
  CHECK(number("0.1") == "\"1.0E-1" + real);
  CHECK(number("0.30000000000000004") == "\"3.0000000000000004E-1" + real);
  CHECK(number("5e-324") == "\"4.940656458412465E-324" + real);
  CHECK(number("true") == "\"true\"^^<http://www.w3.org/2001/XMLSchema#boolean>");
  CHECK(number("5", "http://www.w3.org/2001/XMLSchema#double") == "\"5.0E0" + real);
  CHECK(number("5", "http://e/t") == "\"5\"^^<http://e/t>");
  CHECK(number("5.5", "http://e/t") == "\"5.5E0\"^^<http://e/t>");
  CHECK(says(number("1e999"), "xsd:double"));
}

TEST_CASE("invalid JSON is refused with its position", "[rdf][json_ld]") {
  const auto error = [](std::string_view text) { return parse(text).error(); };
  CHECK(says(refusal(""), "invalid JSON"));
  const lrt::Error comma = error("{\n  \"a\": 1,\n}");
  CHECK(comma.code == Errc::expected_rdf);
  CHECK(comma.line == 3);
  CHECK(comma.offset == 12u);
  CHECK(says(comma.message, "line 3, column 1: invalid JSON: "));
  CHECK(error("{\"a\": \xFF}").message == "line 1, column 7: invalid UTF-8");
  CHECK(says(refusal(R"({"a": "\ud800"})"), "surrogate"));
  CHECK(says(refusal(R"({"a\u0000b": "x"})"), "U+0000"));
  CHECK(says(refusal(R"({"a": 1} x)"), "invalid JSON"));
  CHECK(says(refusal("{'a': 1}"), "invalid JSON"));
  CHECK(says(refusal("{\"a\": NaN}"), "invalid JSON"));
  CHECK(says(refusal("// x\n{}"), "invalid JSON"));
  CHECK(refusal(R"({"x": {"a": 1, "b": 2, "a": 3}})") == "at \"/x/a\": a second member of this name");
  CHECK(says(refusal("5"), "expected an object or an array"));
  // A long token is shortened in the message.
  CHECK(refusal("{\"" + std::string(100'000, 'x')).size() < 300);
}

TEST_CASE("invalid JSON-LD is refused with the member's name", "[rdf][json_ld]") {
  struct Case {
    const char *document, *at, *says;
  };
  for (const Case& c : {
           Case{R"({"@id": 5})", "/@id", "expected an IRI as a string"},
           Case{R"({"@type": 5})", "/@type", "expected a type as a string"},
           Case{R"({"@type": "rel ative"})", "/@type", "expected an IRI"},
           Case{R"({"@id": "http://e/ x", "http://e/p": 1})", "/@id", "expected an absolute IRI, found \"http://e/ x\""},
           Case{R"({"http://e/p": {"@value": []}})", "/http:~1~1e~1p/@value", "expected a string"},
           Case{R"({"http://e/p": {"@value": "x", "@type": "http://e/t", "@language": "de"}})", "/http:~1~1e~1p/@language", "beside @type"},
           Case{R"({"http://e/p": {"@value": "x", "@language": "d e"}})", "/http:~1~1e~1p/@language", "language tag"},
           Case{R"({"http://e/p": {"@value": 5, "@language": "de"}})", "/http:~1~1e~1p/@value", "beside @language"},
           Case{R"({"http://e/p": {"@value": 5, "http://e/q": "de"}})", "/http:~1~1e~1p/http:~1~1e~1q", "beside @value"},
           Case{R"({"http://e/p": {"@list": [5], "@id": "de"}})", "/http:~1~1e~1p/@id", "beside @list"},
           Case{R"({"@context": {"id": "@id"}, "id": "a", "@id": "b"})", "/@id", "a second @id"},
           Case{R"({"@context": 5})", "/@context", "expected a context"},
           Case{R"({"@context": {"a": "b"}})", "/@context/a", "expected an IRI"},
           Case{R"({"@context": {"a": {"@type": "@id"}}})", "/@context/a", "has no IRI"},
           Case{R"({"@context": {"a": "b:x", "b": "a:x"}})", "/@context/a", "depends on itself"},
           Case{R"({"@context": {"@id": "http://e/"}})", "/@context/@id", "cannot be defined"},
           Case{R"({"@context": {"": "http://e/"}})", "/@context/", "expected a term"},
           Case{R"({"@context": {"a": 5}})", "/@context/a", "definition"},
           Case{R"({"@context": {"a": {"@id": "http://e/", "@odd": 1}}})", "/@context/a/@odd", "not part of"},
           Case{R"({"@context": {"a": {"@id": "http://e/", "@container": "@lost"}}})", "/@context/a/@container", "@lost"},
           Case{R"({"@context": {"a": {"@id": "http://e/", "@container": ["@list", "@set"]}}})", "/@context/a/@container", "exclude"},
           Case{R"({"@context": {"@version": 1.0}})", "/@context/@version", "1.1"},
           Case{R"({"@context": {"@language": 5}})", "/@context/@language", "language tag"},
           Case{R"({"@context": {"@vocab": 5}})", "/@context/@vocab", "expected an IRI"},
           Case{R"({"@context": {"@base": 5}})", "/@context/@base", "expected an IRI"},
           Case{R"({"@context": {"@base": null}, "@id": "x"})", "/@id", "relative IRI <x> and no base"},
           Case{R"({"@context": {"b": "http://b/", "b:x": "http://c/"}})", "/@context/b:x", "another IRI"},
           Case{R"({"@reverse": {"http://e/p": [{"@list": []}]}})", "/@reverse/http:~1~1e~1p/0", "a list cannot be reversed"},
           Case{R"({"@value": "x", "@nest": 5, "http://e/p": {"@nest": 5}})", "", "read: "},
       }) {
    CAPTURE(c.document);
    const std::string message = refusal(c.document);
    CHECK(says(message, c.says));
    if (*c.at) CHECK(says(message, "at \"" + std::string(c.at) + "\": "));
  }
  const auto without_base = read(R"({"@id": "x", "http://e/p": 1})", Syntax::json_ld, {});
  REQUIRE_FALSE(without_base);
  CHECK(says(without_base.error().message, "relative IRI <x> and no base"));
}

TEST_CASE("a literal of rdf:langString in JSON-LD has a language, or is refused with its place", "[rdf][json_ld]") {
  const std::string prefix = R"("rdf": "http://www.w3.org/1999/02/22-rdf-syntax-ns#")";
  const std::string document = "{\"@context\": {" + prefix + R"(, "p": {"@id": "http://e/p", "@type": "rdf:langString"}}, "@id": "", "p": )";
  CHECK(differs(document + R"({"@value": "x", "@language": "de"}})", "<> <http://e/p> \"x\"@de .") == "");
  CHECK(differs(document + R"({"@value": "x"}})", "<> <http://e/p> \"x\" .") == "");
  CHECK(differs(document + R"({"@value": "x", "@type": "rdf:HTML"}})", "<> <http://e/p> \"x\"^^rdf:HTML .") == "");
  for (const auto& [value, place] : {std::pair{R"("x")", "/p"}, std::pair{R"(["x"])", "/p/0"}, std::pair{"true", "/p"}, std::pair{"1", "/p"},
                                     std::pair{R"({"@value": "x", "@type": "rdf:langString"})", "/p/@value"},
                                     std::pair{R"({"@value": 5, "@type": "rdf:langString"})", "/p/@value"}})
    CHECK(refusal(document + value + "}") == "at \"" + std::string(place) + "\": expected a language tag with a literal of rdf:langString");
}

TEST_CASE("@json is a literal with the value in its canonical form", "[rdf][json_ld]") {
  const std::string context = R"({"@context": {"@version": 1.1, "e": {"@id": "http://e/p", "@type": "@json"}}, "@id": "", "e": )";
  const auto text = [](const std::string& document) {
    const Result<Graph> found = parse(document);
    if (!found) return found.error().message;
    if (found->size() != 1) return *write(*found, Syntax::n_triples);
    const TermView value = found->term(found->triples()[0].object);
    CHECK(value.datatype == "http://www.w3.org/1999/02/22-rdf-syntax-ns#JSON");
    return std::string(value.text);
  };
  const std::pair<const char*, const char*> cases[] = {
      {R"({"deg": 1})", R"({"deg":1})"},
      {"{ \"b\" : [ 1 , null, true ],\n \"a\" : {} }", R"({"a":{},"b":[1,null,true]})"},
      {"null", "null"},
      {"true", "true"},
      {"[]", "[]"},
      {"[[], [null], [1, [2]]]", "[[],[null],[1,[2]]]"},
      {"\"x\"", "\"x\""},
      {R"("\u0041\u00e4\ud83e\udd16")", "\"A\u00e4\U0001F916\""},
      {R"("\u0000\u000b\u001f\u007f\b\t\n\f\r\"\\\/")", "\"\\u0000\\u000b\\u001f\x7f\\b\\t\\n\\f\\r\\\"\\\\/\""},
      {"1.0", "1"},
      {"-0.0", "0"},
      {"1e21", "1e+21"},
      {"100000000000000000000", "100000000000000000000"},
      {"0.000001", "0.000001"},
      {"1E-7", "1e-7"},
      {"333333333.33333329", "333333333.3333333"},
      {"9007199254740993", "9007199254740992"},
      {"4.50", "4.5"},
      {R"({"@context": 5, "@id": 7, "@value": [], "x:y": "@z"})", R"({"@context":5,"@id":7,"@value":[],"x:y":"@z"})"},
      {R"({"\ufb33": 1, "\ud83d\ude00": 2, "\u20ac": 3, "\r": 4, "1": 5, "\u0080": 6, "\u00f6": 7})",
       "{\"\\r\":4,\"1\":5,\"\u0080\":6,\"\u00f6\":7,\"\u20ac\":3,\"\U0001F600\":2,\"\uFB33\":1}"},
  };
  for (const auto& [value, wanted] : cases) {
    CAPTURE(value);
    CHECK(text(context + value + "}") == wanted);
    CHECK(text(R"({"@id": "", "http://e/p": {"@type": "@json", "@value": )" + std::string(value) + "}}") == wanted);
  }
  // By an alias, in a list, and beside others.
  CHECK(text(R"({"@context": {"type": "@type", "json": "@json", "value": "@value"}, "http://e/p": {"type": "json", "value": {"a": 1}}})") ==
        R"({"a":1})");
  CHECK(differs(R"({"@context": {"e": {"@id": "http://e/p", "@type": "@json", "@container": "@list"}}, "@id": "", "e": [1]})",
                "<> <http://e/p> ( \"[1]\"^^rdf:JSON ) .") == "");
  CHECK(differs(R"({"@context": {"e": {"@id": "http://e/p", "@type": "@json", "@container": "@set"}}, "@id": "", "e": [1]})",
                "<> <http://e/p> \"[1]\"^^rdf:JSON .") == "");
  CHECK(differs(R"({"@context": {"e": {"@id": "http://e/p", "@type": "@json", "@container": "@index"}}, "@id": "", "e": {"a": 1}})",
                "<> <http://e/p> \"{\\\"a\\\":1}\"^^rdf:JSON .") == "");
  CHECK(differs(R"({"@id": "", "http://e/p": [{"@type": "@json", "@value": 1}, 1, {"@type": "@json", "@value": 1.0}]})",
                "<> <http://e/p> \"1\"^^rdf:JSON, 1 .") == "");
  CHECK(says(refusal(R"({"http://e/p": {"@type": "@json", "@value": 1, "@language": "de"}})"), "beside @type"));
  CHECK(says(refusal(R"({"@context": {"e": {"@reverse": "http://e/p", "@type": "@json"}}, "e": 1})"), "reversed"));
  CHECK(says(refusal(context + "1e400}"), "line 1, column "));
  // It is written so that it reads back, and a literal of that datatype is one however it is written.
  Graph g = test::turtle("<http://e/s> <http://e/p> \"{\\\"a\\\":1}\"^^rdf:JSON .");
  json(g);
}

TEST_CASE("maps of names, types and values of another property are read", "[rdf][json_ld]") {
  const auto with = [](const std::string& definition, const std::string& value, const std::string& more = {}) {
    return R"({"@context": {"@vocab": "http://e/", "p": {"@id": "http://e/p", )" + definition + "}" + more + R"(}, "@id": "", "p": )" + value + "}";
  };
  const auto reads = [&](const std::string& document, const std::string& turtle) {
    INFO(document);
    CHECK(differs(document, "@prefix e: <http://e/> . " + turtle) == "");
  };
  const std::string id = R"("@container": "@id")", type = R"("@container": "@type")", index = R"("@container": "@index", "@index": "i")";
  reads(with(id, R"({"http://e/a": {"q": 1}})"), "<> e:p e:a . e:a e:q 1 .");
  reads(with(id, R"({"a": {"q": 1}, "b": [{"q": 2}, {"q": 3}]})"), "<> e:p <a>, <b> . <a> e:q 1 . <b> e:q 2, 3 .");
  reads(with(id, R"({"_:x": {"q": 1}, "@none": {"q": 2}})"), "<> e:p [ e:q 1 ], [ e:q 2 ] .");
  reads(with(id, R"({"a": {"@id": "b", "q": 1}})"), "<> e:p <b> . <b> e:q 1 .");
  reads(with(R"("@container": ["@id", "@set"])", R"({"a": {}, "b": null})"), "<> e:p <a> .");
  reads(with(id, R"([{"@id": "a"}])"), "<> e:p <a> .");
  reads(with(type, R"({"T": {"q": 1}, "http://e/U": [{"@id": "a"}, {"@type": "V"}]})"),
        "<> e:p [ a e:T ; e:q 1 ], <a>, [ a e:U, e:V ] . <a> a e:U .");
  reads(with(type, R"({"@none": {"q": 1}})"), "<> e:p [ e:q 1 ] .");
  reads(with(type, R"({"T": "a"})"), "<> e:p <a> . <a> a e:T .");
  reads(with(type + R"(, "@type": "@vocab")", R"({"T": "a"})"), "<> e:p e:a . e:a a e:T .");
  reads(with(index, R"({"x": {"q": 1}, "y": [{"@id": "a"}, {"@id": "b"}]})"),
        "<> e:p [ e:i \"x\" ; e:q 1 ], <a>, <b> . <a> e:i \"y\" . <b> e:i \"y\" .");
  reads(with(index, R"({"@none": {"q": 1}})"), "<> e:p [ e:q 1 ] .");
  reads(with(index, R"({"x": {}})", R"(, "i": {"@type": "@id"})"), "<> e:p [ e:i <x> ] .");
  reads(with(index, R"({"x": {}})", R"(, "i": {"@type": "@vocab"})"), "<> e:p [ e:i e:x ] .");
  reads(with(R"("@container": "@index")", R"({"x": {"q": 1}, "y": 2})"), "<> e:p [ e:q 1 ], 2 .");
  for (const auto& [document, words] : {
           std::pair{with(id, R"({"a": "b"})"), "expected nodes"},
           std::pair{with(id, R"({"a": {"@value": 1}})"), "expected nodes"},
           std::pair{with(type, R"({"T": 1})"), "expected nodes"},
           std::pair{with(type + R"(, "@type": "http://e/d")", "{}"), "excludes another @type"},
           std::pair{with(index, R"({"x": 1})"), "expected nodes"},
           std::pair{with(R"("@index": "i")", "{}"), "expected @index as @container"},
           std::pair{with(R"("@container": "@index", "@index": "@id")", "{}"), "expected an IRI as @index"},
           std::pair{with(R"("@container": ["@id", "@type"])", "{}"), "exclude each other"},
           std::pair{std::string(R"({"@context": {"p": {"@reverse": "http://e/p", "@container": "@id"}}})"), "exclude each other"},
       }) {
    INFO(document);
    CHECK(says(refusal(document), words));
  }
}

TEST_CASE("a term may have a context for its values", "[rdf][json_ld]") {
  const auto reads = [&](const std::string& context, const std::string& members, const std::string& turtle) {
    const std::string document = "{\"@context\": {" + context + "}, \"@id\": \"\", " + members + "}";
    INFO(document);
    CHECK(differs(document, "@prefix e: <http://e/> . @prefix f: <http://f/> . " + turtle) == "");
  };
  const std::string context = R"("@vocab": "http://e/", "p": {"@id": "http://e/p", "@context": {"@vocab": "http://f/"}})";
  reads(context, R"("p": {"q": 1}, "q": 2)", "<> e:p [ f:q 1 ] ; e:q 2 .");
  reads(context, R"("p": [{"q": 1}, {"q": {"r": 3}}])", "<> e:p [ f:q 1 ], [ f:q [ f:r 3 ] ] .");
  reads(context, R"("p": {"@context": {"q": "http://e/own"}, "q": 1})", "<> e:p [ e:own 1 ] .");
  reads(context, R"("p": {"p": {"q": 1}})", "<> e:p [ e:p [ f:q 1 ] ] .");
  reads(R"("p": {"@id": "http://e/p", "@context": {"@language": "de"}})", R"("p": "x")", "<> e:p \"x\"@de .");
  reads(R"("p": {"@id": "http://e/p", "@context": {"p": {"@id": "http://e/p", "@type": "@id"}}})", R"("p": "x")", "<> e:p <x> .");
  reads(R"("p": {"@id": "http://e/p", "@context": {"@base": "http://f/"}, "@type": "@id"})", R"("p": "x")", "<> e:p f:x .");
  reads(R"("p": {"@id": "http://e/p", "@context": null}, "q": "http://e/q")", R"("p": {"q": 1, "http://e/r": 2})", "<> e:p [ e:r 2 ] .");
  reads(R"("p": {"@id": "http://e/p", "@context": [{"a": "http://f/a"}, {"b": "http://f/b"}]})", R"("p": {"a": 1, "b": 2})",
        "<> e:p [ f:a 1 ; f:b 2 ] .");
  reads(R"("p": {"@id": "http://e/p", "@container": "@list", "@context": {"a": "http://f/a"}})", R"("p": [{"a": 1}, {"a": 2}])",
        "<> e:p ( [ f:a 1 ] [ f:a 2 ] ) .");
  reads(R"("p": {"@id": "http://e/p", "@container": "@id", "@context": {"a": "http://f/a"}})", R"("p": {"x": {"a": 1}})", "<> e:p <x> . <x> f:a 1 .");
  reads(R"("p": {"@reverse": "http://e/p", "@context": {"a": "http://f/a"}})", R"("p": {"a": 1})", "[] e:p <> ; f:a 1 .");
  reads(R"("p": {"@id": "http://e/p", "@type": "@json", "@context": {"a": "http://f/a"}})", R"("p": {"a": 1})",
        "<> e:p \"{\\\"a\\\":1}\"^^rdf:JSON .");
  // One is processed once, however many values have it.
  std::string many = "{}";
  for (int i = 0; i < 1000; ++i) many += R"(, {"a": 1})";
  std::string terms = R"("a": "http://f/a")";
  for (int i = 0; i < 100; ++i) terms += ", \"t" + std::to_string(i) + "\": \"http://f/t\"";
  CHECK(parse(R"({"@context": {"p": {"@id": "http://e/p", "@context": {)" + terms + R"(}}}, "p": [)" + many + "]}"));
  CHECK(says(refusal(R"({"@context": {"p": {"@id": "http://e/p", "@context": 5}}, "p": 1})"), "at \"/@context/p/@context\": expected a context"));
}

TEST_CASE("unsupported features of JSON-LD are refused by name", "[rdf][json_ld]") {
  struct Case {
    const char *document, *name;
  };
  for (const Case& c : {
           Case{R"({"@id": "g", "@graph": [{"http://e/p": 1}]})", "a named graph"},
           Case{R"([{"@graph": [{"http://e/p": 1}]}])", "a named graph"},
           Case{R"({"http://e/p": {"@graph": []}})", "a named graph"},
           Case{R"({"@context": {"p": {"@id": "http://e/p", "@container": ["@graph", "@index"]}}, "p": {"a": {}}})", "a named graph"},
           Case{R"({"@context": {"@import": "http://e/"}})", "the context <http://e/> is not registered"},
           Case{R"({"@context": "http://e/"})", "the context <http://e/> is not registered"},
           Case{R"({"_:p": 1})", "a blank node as predicate"},
           Case{R"({"http://e/p": {"@list": [[1]]}})", "an array in a @list"},
       }) {
    CAPTURE(c.document);
    CHECK(says(refusal(c.document, Errc::unsupported_syntax), c.name));
  }
}

namespace {

/// The dataset of a document as N-Quads, or why it was refused.
std::string quads(std::string_view document, const Contexts& contexts = {}) {
  ReadOptions options;
  options.base = "http://localhost/arm/x";
  options.contexts = &contexts;
  const Result<Dataset> found = read_dataset(document, Syntax::json_ld, options);
  return found ? *write(*found, Syntax::n_quads) : found.error().message;
}
/// Empty if it is the dataset of the TriG.
std::string differs_from_trig(std::string_view document, const std::string& trig, const Contexts& contexts = {}) {
  ReadOptions options;
  options.base = "http://localhost/arm/x";
  options.contexts = &contexts;
  const Result<Dataset> found = read_dataset(document, Syntax::json_ld, options);
  if (!found) return found.error().message;
  const Dataset wanted = read_dataset("@prefix e: <http://e/> . @prefix f: <http://f/> . " + trig, Syntax::trig, options).value();
  bool same = isomorphic(found->default_graph, wanted.default_graph) && found->named.size() == wanted.named.size();
  for (std::size_t i = 0; same && i < wanted.named.size(); ++i)
    same = found->named[i].first == wanted.named[i].first && isomorphic(found->named[i].second, wanted.named[i].second);
  return same ? "" : "read: " + *write(*found, Syntax::n_quads);
}

}  // namespace

TEST_CASE("a type may have a context for its nodes", "[rdf][json_ld]") {
  const auto reads = [&](const std::string& context, const std::string& members, const std::string& turtle) {
    const std::string document = "{\"@context\": {" + context + "}, \"@id\": \"\", " + members + "}";
    INFO(document);
    CHECK(differs(document, "@prefix e: <http://e/> . @prefix f: <http://f/> . " + turtle) == "");
  };
  const std::string t = R"("@vocab": "http://e/", "T": {"@id": "http://e/T", "@context": {"a": "http://f/a"}},
                           "U": {"@id": "http://e/U", "@context": {"a": "http://f/u", "b": "http://f/b"}})";
  reads(t, R"("@type": "T", "a": 1)", "<> a e:T ; f:a 1 .");
  reads(t, R"("@type": ["U", "T"], "a": 1, "b": 2)", "<> a e:T, e:U ; f:u 1 ; f:b 2 .");  // by name: T, then U
  reads(t, R"("a": {"@type": "T", "a": 1}, "@type": "T")", "<> a e:T ; f:a [ a e:T ; f:a 1 ] .");
  // It does not hold for the nodes in the node, but for its values and references.
  reads(t, R"("@type": "T", "q": {"a": 1})", "<> a e:T ; e:q [ e:a 1 ] .");
  reads(t + R"(, "V": {"@id": "http://e/V", "@context": {"@propagate": true, "a": "http://f/a"}})", R"("@type": "V", "q": {"a": 1})",
        "<> a e:V ; e:q [ f:a 1 ] .");
  reads(R"("@vocab": "http://e/", "T": {"@id": "http://e/T", "@context": {"@base": "http://f/", "@vocab": "http://f/"}})",
        R"("@type": "T", "q": {"@id": "x"}, "r": {"@value": "x", "@type": "D"})", "f: a e:T ; f:q f:x ; f:r \"x\"^^f:D .");
  // Types are looked up outside of the context that they bring.
  reads(R"("@vocab": "http://e/", "T": {"@id": "http://e/T", "@context": {"@vocab": "http://f/", "T": "http://f/no"}})",
        R"("@type": ["T", "W"], "q": 1)", "<> a e:T, e:W ; f:q 1 .");
  reads(t + R"(, "p": {"@id": "http://e/p", "@container": "@type"})", R"("p": {"T": {"a": 1}, "U": {"a": 2}, "W": {"a": 3}})",
        "<> e:p [ a e:T ; f:a 1 ], [ a e:U ; f:u 2 ], [ a e:W ; e:a 3 ] .");
  reads(R"("@language": "de", "p": {"@id": "http://e/p", "@type": "@none"})", R"("p": "x")", "<> e:p \"x\"@de .");
  // In the list the context of the type has ended.
  reads(R"("p": {"@id": "http://e/p", "@type": "@json"}, "T": {"@id": "http://e/T", "@context": {"p": "http://e/p"}})",
        R"("@type": "T", "p": {"@list": ["x"]})", "<> a e:T ; e:p ( \"\\\"x\\\"\"^^rdf:JSON ) .");
  // A set in a term that is a list is a list, too.
  reads(R"("l": {"@id": "http://e/l", "@container": "@list"})", R"("l": [{"@set": [1, 2]}, {"@set": 3}, 4])", "<> e:l ( ( 1 2 ) 3 4 ) .");
  reads(R"("l": {"@id": "http://e/l", "@container": "@list"})", R"("l": {"@set": [1, 2]})", "<> e:l ( 1 2 ) .");
  // The context of a term comes after the return to the context around the node.
  reads(t + R"(, "p": {"@id": "http://e/p", "@context": {"c": "http://f/c"}})", R"("@type": "T", "p": {"a": 1, "c": 2})",
        "<> a e:T ; e:p [ e:a 1 ; f:c 2 ] .");
  reads(R"("@vocab": "http://e/", "p": {"@id": "http://e/p", "@context": {"@propagate": false, "c": "http://f/c"}})",
        R"("p": {"c": 1, "q": {"c": 2}})", "<> e:p [ f:c 1 ; e:q [ e:c 2 ] ] .");
  reads(R"("@vocab": "http://e/", "@propagate": false, "a": "http://f/a")", R"("a": {"http://e/b": {"a": 1}})", "<> f:a [ e:b [] ] .");
  reads(t + R"(, "in": "@included", "data": {"@id": "@nest", "@context": {"n": "http://f/n"}})",
        R"("data": {"n": 1, "a": 2}, "in": [{"@id": "y", "a": 3}])", "<> f:n 1 ; e:a 2 . <y> e:a 3 .");
}

TEST_CASE("protected terms are redefined by contexts of terms only", "[rdf][json_ld]") {
  const auto document = [](const std::string& contexts, const std::string& members) {
    return "{\"@context\": [" + contexts + "], \"@id\": \"\", " + members + "}";
  };
  const std::string a = R"({"@protected": true, "a": "http://e/a", "p": {"@id": "http://e/p", "@context": {"a": "http://f/a"}}})";
  CHECK(differs(document(a, R"("a": 1, "p": {"a": 2})"), "<> <http://e/a> 1 ; <http://e/p> [ <http://f/a> 2 ] .") == "");
  CHECK(differs(document(a + R"(, {"a": "http://e/a"})", R"("a": 1)"), "<> <http://e/a> 1 .") == "");
  CHECK(differs(document(R"({"@protected": true, "a": {"@id": "http://e/a", "@protected": false}}, {"a": "http://f/a"})", R"("a": 1)"),
                "<> <http://f/a> 1 .") == "");
  const std::string refused = refusal(document(a + R"(, {"a": "http://f/a"})", R"("a": 1)"));
  CHECK(says(refused, "at \"/@context/1/a\": the term \"a\" is protected"));
  // It stays protected after it was defined in the same way.
  CHECK(says(refusal(document(a + R"(, {"a": "http://e/a"}, {"a": "http://f/a"})", R"("a": 1)")), "/@context/2/a"));
  CHECK(says(refusal(document(a + ", null", R"("a": 1)")), "at \"/@context/1\": null would remove protected terms"));
  CHECK(says(refusal(document(a, R"("a": {"@context": {"a": null}})")), "is protected"));
  CHECK(says(refusal(document(R"({"T": {"@id": "http://e/T", "@context": {"a": "http://f/a"}}, "a": {"@id": "http://e/a", "@protected": true}})",
                              R"("@type": "T")")),
             "at \"/@context/0/T/@context/a\": the term \"a\" is protected"));
  CHECK(differs(document(R"({"a": {"@id": "http://e/a", "@protected": true}, "p": {"@id": "http://e/p", "@context": null}})",
                         R"("p": {"a": 1, "http://e/q": 2})"),
                "<> <http://e/p> [ <http://e/q> 2 ] .") == "");
  CHECK(says(refusal(document(R"({"@protected": 1})", R"("a": 1)")), "expected true or false"));
  CHECK(
      says(refusal(document(R"({"id": {"@id": "@id", "@protected": true}}, "http://localhost/ns/context.jsonld")", R"("a": 1)"), Errc::expected_rdf),
           "read: "));
  CHECK(says(refusal(document(R"({"unit": {"@id": "http://e/u", "@protected": true}}, "http://localhost/ns/context.jsonld")", R"("a": 1)")),
             "the term \"unit\" is protected, and <http://localhost/ns/context.jsonld> defines it in another way"));
  CHECK(differs(document(R"({"@type": {"@container": "@set", "@protected": true}})", R"("@type": "http://e/T")"), "<> a <http://e/T> .") == "");
  CHECK(says(refusal(document(R"({"@type": {"@id": "@type"}})", R"("a": 1)")), "the keyword @type cannot be defined"));
}

TEST_CASE("the base direction of texts is judged and dropped", "[rdf][json_ld]") {
  CHECK(differs(R"({"@context": {"@direction": "rtl", "@language": "ar", "p": {"@id": "http://e/p", "@direction": "ltr"}}, "@id": "", "p": "x"})",
                "<> <http://e/p> \"x\"@ar .") == "");
  CHECK(differs(R"({"@id": "", "http://e/p": {"@value": "x", "@direction": "rtl"}})", "<> <http://e/p> \"x\" .") == "");
  CHECK(says(refusal(R"({"@context": {"@direction": "up"}})"), "at \"/@context/@direction\": expected \"ltr\" or \"rtl\", found \"up\""));
  CHECK(says(refusal(R"({"http://e/p": {"@value": "x", "@direction": "rtl", "@type": "http://e/t"}})"), "@direction has no meaning beside @type"));
}

TEST_CASE("JSON-LD has named graphs where a dataset is read", "[rdf][json_ld]") {
  CHECK(differs_from_trig(
            R"({"@id": "g", "http://e/p": 1, "@graph": [{"@id": "a", "http://e/q": 2}, {"@id": "h", "@graph": {"@id": "", "http://e/r": 3}}]})",
            "<g> e:p 1 . <g> { <a> e:q 2 } <h> { <> e:r 3 }") == "");
  CHECK(differs_from_trig(R"({"@context": {"e": "http://e/"}, "@graph": [{"@id": "a", "e:q": 2}]})", "<a> e:q 2 .") == "");
  CHECK(differs_from_trig(R"([{"@id": "g", "@graph": []}, {"@id": "g", "@graph": {"@id": "_:b", "http://e/p": {"@id": "_:b"}}}])",
                          "<g> { _:b e:p _:b }") == "");
  const std::string by_id = R"({"@context": {"p": {"@id": "http://e/p", "@container": ["@graph", "@id"]}, "q": "http://e/q"}, "@id": "", "p": )";
  CHECK(differs_from_trig(by_id + R"({"g": {"q": 1}, "h": [{"@id": "a", "q": 2}, {"@id": "b", "q": 3}]}})",
                          "<> e:p <g>, <h> . <g> { [] e:q 1 } <h> { <a> e:q 2 . <b> e:q 3 }") == "");
  CHECK(differs_from_trig(by_id + R"({"g": {"@graph": [{"q": 1}]}}})", "<> e:p <g> . <g> { [] e:q 1 }") == "");
  const std::string by_index =
      R"({"@context": {"p": {"@id": "http://e/p", "@container": ["@graph", "@index"]}, "q": "http://e/q"}, "@id": "", "p": )";
  CHECK(differs_from_trig(by_index + R"({"x": {"@id": "g", "@graph": {"q": 1}}}})", "<> e:p <g> . <g> { [] e:q 1 }") == "");
  for (const std::string& unnamed : {by_index + R"({"x": {"q": 1}}})", by_id + R"({"@none": {"q": 1}}})", std::string(R"([{"@graph": []}])"),
                                     std::string(R"({"@context": {"p": {"@id": "http://e/p", "@container": "@graph"}}, "p": {"http://e/q": 1}})"),
                                     std::string(R"({"@id": "_:g", "@graph": []})")}) {
    CAPTURE(unnamed);
    CHECK(says(quads(unnamed), "a graph whose name is a blank node is not supported"));
  }
  CHECK(says(quads(R"({"@context": {"p": {"@id": "http://e/p", "@container": ["@graph", "@list"]}}})"), "exclude each other"));
  // A node in two graphs is two nodes.
  CHECK(differs_from_trig(R"([{"@id": "_:a", "http://e/p": 1}, {"@id": "g", "@graph": {"@id": "_:a", "http://e/p": 2}}])",
                          "[] e:p 1 . <g> { [] e:p 2 }") == "");
}

TEST_CASE("contexts that a host has registered are read by their IRI, and no others", "[rdf][json_ld]") {
  Contexts contexts;
  CHECK(contexts.empty());
  REQUIRE(contexts.add("http://c/a", R"({"@context": {"@vocab": "http://e/", "@base": "http://no/", "rel": {"@type": "@id", "@id": "rel"}}})"));
  REQUIRE(contexts.add("http://c/b", R"({"ignored": 1, "@context": ["a", {"T": {"@id": "f:T", "@context": "scoped"}, "f": "http://f/"}]})"));
  REQUIRE(contexts.add("http://c/scoped", R"({"@context": {"@import": "a", "@vocab": "http://f/", "own": "http://e/own"}})"));
  REQUIRE(contexts.add("http://c/protected", R"({"@context": {"@protected": true, "@import": "imported", "x": "http://e/x"}})"));
  REQUIRE(contexts.add("http://c/imported", R"({"@context": {"x": "http://f/x", "y": "http://f/y"}})"));
  REQUIRE(contexts.add("http://c/loop", R"({"@context": ["loop"]})"));
  REQUIRE(contexts.add("http://c/bad", R"({"@context": {"x": {"@id": 5}}})"));
  CHECK_FALSE(contexts.empty());
  const auto reads = [&](const std::string& document, const std::string& trig) {
    CAPTURE(document);
    CHECK(differs_from_trig(document, trig, contexts) == "");
  };
  const auto refuses = [&](const std::string& document, const std::string& sentence) {
    CAPTURE(document);
    CHECK(says(quads(document, contexts), sentence));
  };
  reads(R"({"@context": "http://c/a", "@id": "", "p": 1, "rel": "y"})", "<> e:p 1 ; e:rel <y> .");
  reads(R"({"@context": ["http://c/b", {"q": "http://q/"}], "@id": "", "q": 1, "p": {"@type": "T", "p": 2, "own": 3, "rel": "y"}})",
        "<> <http://q/> 1 ; e:p [ a f:T ; f:p 2 ; e:own 3 ; f:rel <y> ] .");
  reads(R"([{"@context": "http://c/a", "@id": "1", "p": 1}, {"@context": "http://c/a", "@id": "2", "p": 2}])", "<1> e:p 1 . <2> e:p 2 .");
  reads(R"({"@context": "http://c/protected", "@id": "", "x": 1, "y": 2})", "<> e:x 1 ; f:y 2 .");
  refuses(R"({"@context": ["http://c/protected", {"y": "http://e/y"}]})", "at \"/@context/1/y\": the term \"y\" is protected");
  refuses(R"({"@context": "http://c/none"})",
          "at \"/@context\": the context <http://c/none> is not registered, and lrt fetches none: embed it in the document, use "
          "<https://w3id.org/lrt/context.jsonld>, or have the host register its text (rdf::Contexts::add)");
  refuses(R"({"@context": {"@import": "http://c/b"}})", "expected the IRI of a context that is one object");
  refuses(R"({"@context": {"@import": "http://c/scoped"}})", "the context <http://c/scoped> imports another one");
  refuses(R"({"@context": "http://c/loop"})", "contexts that refer to contexts, more than 16 deep");
  refuses(R"({"@context": "http://c/bad"})", "in the context <http://c/bad> at \"/@context/x/@id\": expected an IRI");
  // Thousands of nodes may have it: it is processed once.
  std::string many = "[{}";
  for (int i = 0; i < 5000; ++i) many += R"(, {"@context": ["http://c/a", {}], "@id": "", "p": 1})";
  reads(many + "]", "<> e:p 1 .");

  const auto fault = [&](std::string_view iri, std::string_view text, Errc code) {
    const Result<void> added = contexts.add(iri, text);
    if (added) return std::string("added");
    CHECK(added.error().code == code);
    return added.error().message;
  };
  CHECK(says(fault("c", "{}", Errc::expected_iri), "the context <c>: expected an absolute IRI"));
  CHECK(says(fault("http://c/", "{\n \"@context\": }", Errc::expected_rdf), "the context <http://c/>: line 2, column 14"));
  CHECK(says(fault("http://c/", "{}", Errc::expected_rdf), "expected an object with the member @context"));
  CHECK(says(fault("http://c/", "[]", Errc::expected_rdf), "expected an object with the member @context"));
  CHECK(says(fault("http://c/", R"({"@context": 5})", Errc::expected_rdf), "at \"/@context\""));
  CHECK(says(fault("http://c/", "{\"@context\": {}, \"x\": \"" + std::string(Contexts::max_bytes, 'x') + "\"}", Errc::limit_exceeded),
             "1048576 bytes"));
  for (int i = 7; i < 100; ++i) REQUIRE(contexts.add("http://c/" + std::to_string(i), R"({"@context": {}})"));
  const Contexts full = contexts;
  CHECK(says(fault("http://c/100", R"({"@context": {}})", Errc::limit_exceeded), "more than 100 contexts"));
  REQUIRE(contexts.add("http://c/99", R"({"@context": {"p": "http://e/p"}})"));  // replaced
  reads(R"({"@context": "http://c/99", "@id": "", "p": 1})", "<> e:p 1 .");
  CHECK(differs_from_trig(R"({"@context": "http://c/99", "@id": "", "p": 1})", "", full) == "");
}

TEST_CASE("limits bound hostile JSON-LD", "[rdf][json_ld]") {
  const std::string base = "http://localhost/" + std::string(300, 'x');
  const auto code = [&](const std::string& text, std::size_t triples = 1000, std::size_t bytes = 1 << 20) {
    ReadOptions options;
    options.base = base;
    options.max_triples = triples;
    options.max_bytes = bytes;
    const Result<Graph> g = read(text, Syntax::json_ld, options);
    return g ? Errc::failed : g.error().code;
  };
  CHECK(code(std::string(257, '[') + std::string(257, ']')) == Errc::limit_exceeded);
  CHECK(code(std::string(256, '[') + std::string(256, ']')) == Errc::failed);
  CHECK(code(std::string(1'000'000, '[')) == Errc::limit_exceeded);
  std::string many = "{\"http://e/p\": [0";
  for (int i = 1; i < 1001; ++i) many += "," + std::to_string(i);
  CHECK(code(many + "]}") == Errc::limit_exceeded);
  CHECK(code(many + "]}", 1001) == Errc::failed);
  std::string nulls = "[null";
  for (int i = 0; i < 20'000; ++i) nulls += ",null";
  CHECK(code(nulls + "]") == Errc::limit_exceeded);
  // Short text, long IRIs.
  std::string prefixed = "{\"@context\": {\"a\": \"http://e/" + std::string(8000, 'x') + "#\"}, \"http://e/p\": [";
  for (int i = 0; i < 500; ++i) prefixed += (i ? "," : "") + std::string("{\"@id\": \"a:") + std::to_string(i) + "\"}";
  CHECK(code(prefixed + "]}") == Errc::limit_exceeded);
  std::string based = "[";
  for (int i = 0; i < 900; ++i) based += (i ? "," : "") + std::string("{\"@id\": \"") + std::to_string(i) + "\"}";
  CHECK(code(based + "]") == Errc::limit_exceeded);
  CHECK(code("{\"@id\": \"http://e/" + std::string(9000, 'x') + "\", \"http://e/p\": 1}") == Errc::limit_exceeded);
  // Endless contexts.
  std::string contexts = "[0", inner = "{\"@id\": \"http://e/x\"}", terms = "{\"@context\": {\"t\": \"http://e/t\"";
  for (int i = 0; i < 40; ++i) contexts += ",{}", inner = "{\"@context\": {}, \"http://e/p\": " + inner + "}";
  CHECK(code("{\"@context\": " + contexts.replace(0, 3, "[") + "]}") == Errc::limit_exceeded);
  CHECK(code(inner) == Errc::limit_exceeded);
  for (int i = 0; i < 4000; ++i) terms += ",\"t" + std::to_string(i) + "\": \"http://e/t\"";
  CHECK(code(terms + "}}") == Errc::limit_exceeded);
  std::string chain = "{\"@context\": {\"t0\": \"http://e/#\"";
  for (int i = 999; i > 0; --i) chain += ",\"t" + std::to_string(i) + "\": \"t" + std::to_string(i - 1) + ":x#\"";
  CHECK(code(chain + "}}") == Errc::limit_exceeded);
}

// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/codec.hpp>

#include <string>
#include <thread>
#include <vector>

#include <lrt/rdf/vocab.hpp>

#include "src/rdf/limits.hpp"
#include "src/rdf/redland/rdf_xml_scan.hpp"
#include "tests/support/catch.hpp"

using namespace lrt::rdf;
using lrt::Errc;
namespace vocab = lrt::vocab;

namespace {

constexpr std::string_view base = "http://h/baxter/right_s1/actions/rotate";

std::string repeated(std::size_t n, const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < n; ++i) out += text;
  return out;
}

std::string rdf_xml(const std::string& content, const std::string& namespaces = {}) {
  return "<rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\" xmlns:e=\"http://e/\" xmlns:v=\"http://v/\"" + namespaces + ">\n" +
         content + "</rdf:RDF>";
}

ReadOptions limits(std::size_t triples = 10'000, std::size_t bytes = 64 * 1024 * 1024) {
  ReadOptions options;
  options.base = base;
  options.max_triples = triples;
  options.max_bytes = bytes;
  return options;
}

lrt::Error refusal(const std::string& text) {
  const auto graph = read(text, Syntax::rdf_xml, limits());
  INFO(text);
  if (graph) FAIL("accepted: " << *write(*graph, Syntax::n_triples));
  CHECK(graph.error().code == Errc::expected_rdf);
  CHECK_FALSE(graph.error().message.empty());
  return graph.error();
}

/// The error of a document beyond a limit: it has a place.
lrt::Error beyond(const std::string& text, const ReadOptions& options = limits()) {
  const auto graph = read(text, Syntax::rdf_xml, options);
  INFO(text.substr(0, 200));
  if (graph) FAIL("accepted " << graph->size() << " triples");
  CHECK(graph.error().code == Errc::limit_exceeded);
  CHECK(graph.error().line > 0);
  CHECK(graph.error().message.substr(0, 5) == "line ");
  CHECK(graph.error().message.size() < 200);
  return graph.error();
}

Graph accepted(const std::string& text, const ReadOptions& options = limits()) {
  auto graph = read(text, Syntax::rdf_xml, options);
  INFO(text.substr(0, 200));
  if (!graph) FAIL(graph.error().message);
  return *graph;
}

std::string n_triples(const Graph& g) { return *write(g, Syntax::n_triples); }

bool says(const lrt::Error& error, const std::string& words) {
  INFO(error.message);
  return error.message.find(words) != std::string::npos;
}

}  // namespace

TEST_CASE("RDF/XML without a base has no relative IRIs", "[rdf][rdf_xml]") {
  CHECK(read(rdf_xml("<e:T rdf:about='a'/>"), Syntax::rdf_xml, {}).error().code == Errc::expected_rdf);
  CHECK(read(rdf_xml("<e:T rdf:about='http://e/a'/>"), Syntax::rdf_xml, {}));
}

TEST_CASE("RDF/XML with invalid UTF-8, an illegal IRI or a language tag beyond the limit is refused", "[rdf][rdf_xml]") {
  refusal(rdf_xml("<e:T e:p='\xFF'/>"));
  refusal(rdf_xml("<e:T rdf:about='a b'/>"));
  const auto tagged = [](const std::string& tag) {
    return rdf_xml("<rdf:Description rdf:about='a:'><e:p xml:lang = '" + tag + "'>x</e:p></rdf:Description>");
  };
  const std::string longest = "en-" + std::string(252, 'x');
  const Graph g = accepted(tagged(longest));
  for (const Syntax as : available_syntaxes()) CHECK(write(g, as));
  CHECK(says(refusal(tagged(longest + "y")), "language tag of more than 255 bytes"));
}

TEST_CASE("RDF/XML of more triples than allowed is refused while reading", "[rdf][rdf_xml]") {
  std::string xml;
  for (int i = 0; i < 1000; ++i) xml += "<e:T rdf:about='http://e/" + std::to_string(i) + "'/>";
  beyond(rdf_xml(xml), limits(999));
  CHECK(accepted(rdf_xml(xml), limits(1000)).size() == 1000);
  const std::string repeats = repeated(10, "<rdf:Description rdf:about='a:a'><v:a>1</v:a></rdf:Description>\n");
  CHECK(accepted(rdf_xml(repeats), limits(10)).size() == 1);
  CHECK(says(beyond(rdf_xml(repeats), limits(9)), "line 11: more than 9 triples"));
}

TEST_CASE("threads that come and go read and write RDF/XML at once", "[rdf][rdf_xml]") {
  std::vector<std::thread> threads;
  std::vector<int> good(6, 0);
  for (std::size_t n = 0; n < good.size(); ++n) {
    threads.emplace_back([n, &good] {
      for (int i = 0; i < 50; ++i) {
        const auto g = read("@prefix e: <http://e/> . e:s e:p [ e:q " + std::to_string(n) + " ] .", Syntax::turtle, {});
        const auto xml = g ? write(*g, Syntax::rdf_xml) : std::string();
        const auto back = xml ? read(*xml, Syntax::rdf_xml, {}) : Graph();
        const auto bad = read(*xml + "<", Syntax::rdf_xml, {});
        good[n] += g && xml && back && back->size() == 2 && !bad;
      }
    });
  }
  for (std::thread& t : threads) t.join();
  CHECK(good == std::vector<int>(6, 50));
}

TEST_CASE("an IRI of more than 8 KiB in RDF/XML is refused however it is written", "[rdf][rdf_xml][limits]") {
  const std::string most(max_iri - 9, 'a');  // behind "http://x/"
  for (const std::string name : {"rdf:about", "rdf:resource", "xml:base", "xmlns:w", "xmlns"}) {
    const std::string resource = name == "rdf:resource" ? "<rdf:Description><v:a " : "<rdf:Description ";
    const std::string end = name == "rdf:resource" ? "/></rdf:Description>" : "/>";
    accepted(rdf_xml(resource + name + "='http://x/" + most + "'" + end));
    CHECK(says(beyond(rdf_xml(resource + name + "='http://x/" + most + "a'" + end)), "IRI of more than 8192"));
  }
  const std::string based = "<rdf:Description xml:base='http://x/" + most.substr(8) + "/' rdf:about='";
  accepted(rdf_xml(based + "short'><v:a/></rdf:Description>"));
  CHECK(says(beyond(rdf_xml(based + "too-long'><v:a/></rdf:Description>")), "IRI of more than 8192"));
}

TEST_CASE("terms of RDF/XML are counted as they are when written out, each time they occur", "[rdf][rdf_xml][limits]") {
  const std::string name = " xmlns:w='http://x/" + std::string(991, 'w') + "'";
  const std::string nodes = repeated(20, "<rdf:Description><w:a>1</w:a></rdf:Description>");
  accepted(rdf_xml(nodes, name), limits(100, 100'000));
  beyond(rdf_xml(repeated(4, nodes), name), limits(100, 100'000));
  const std::string about = "<rdf:Description xml:base='http://x/" + std::string(991, 'b') + "/' rdf:about='a'>";
  beyond(rdf_xml(about + repeated(80, "<v:a rdf:resource='b'/>") + "</rdf:Description>"), limits(100, 100'000));
}

TEST_CASE("RDF/XML is read with its place of error, without entities from elsewhere", "[rdf][rdf_xml]") {
  CHECK(n_triples(accepted(rdf_xml("<e:T rdf:about=''><e:p xml:lang='en'>v</e:p></e:T>"))) ==
        "<http://h/baxter/right_s1/actions/rotate> <http://www.w3.org/1999/02/22-rdf-syntax-ns#type> <http://e/T> .\n"
        "<http://h/baxter/right_s1/actions/rotate> <http://e/p> \"v\"@en .\n");
  const lrt::Error error = refusal(rdf_xml("\n\n<e:T><f:p/></e:T>"));
  CHECK(error.line == 4);
}

TEST_CASE("a literal of rdf:langString in RDF/XML has a language, or is refused with its line", "[rdf][rdf_xml]") {
  const std::string type = " rdf:datatype='http://www.w3.org/1999/02/22-rdf-syntax-ns#langString'";
  const lrt::Error error = refusal(rdf_xml("<rdf:Description rdf:about='a:'>\n<e:p" + type + ">x</e:p>\n</rdf:Description>"));
  CHECK(error.line == 3);
  CHECK(says(error, "rdf:langString"));
  refusal(rdf_xml("<rdf:Description rdf:about='a:'><e:p" + type + "/></rdf:Description>"));
  refusal(rdf_xml("<rdf:Description rdf:about='a:'><e:p xml:lang='en'" + type + ">x</e:p></rdf:Description>"));
  CHECK(n_triples(accepted(rdf_xml("<rdf:Description rdf:about='a:'><e:p xml:lang='en'>x</e:p></rdf:Description>"))) ==
        "<a:> <http://e/p> \"x\"@en .\n");
  Graph g;
  g.add(iri("a:"), iri("http://e/p"), TermView{TermKind::literal, "x", vocab::rdf_::langString.text});
  CHECK_FALSE(write(g, Syntax::rdf_xml));
}

TEST_CASE("RDF/XML with a document type is refused: no entities, of its own or from elsewhere", "[rdf][rdf_xml]") {
  const std::string content = rdf_xml("<rdf:Description rdf:about='a'><e:p>&x;</e:p></rdf:Description>");
  for (const char* prolog : {"", "<?xml version='1.0'?>", "\xEF\xBB\xBF <!-- c --> <?pi?>"}) {
    refusal(prolog + ("<!DOCTYPE r [<!ENTITY x SYSTEM 'file:///etc/hostname'>]>" + content));
  }
  std::string bomb = "<!DOCTYPE r [<!ENTITY a0 'lollollollol'>";
  for (int i = 1; i < 12; ++i) {
    bomb += "<!ENTITY a" + std::to_string(i) + " '";
    for (int k = 0; k < 10; ++k) bomb += "&a" + std::to_string(i - 1) + ";";
    bomb += "'>";
  }
  refusal(bomb + "]>" + rdf_xml("<rdf:Description><e:p>&a11;</e:p></rdf:Description>"));
  accepted(rdf_xml("<rdf:Description><e:p>&lt;!DOCTYPE</e:p></rdf:Description>"));
  refusal("<?xml version='1.0' encoding='UTF-7'?>" + rdf_xml(""));
  accepted("<?xml version='1.0' encoding='utf-8'?>" + rdf_xml(""));
}

TEST_CASE("RDF/XML that XML cannot carry is refused when writing", "[rdf][rdf_xml]") {
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

TEST_CASE("RDF/XML that was written reads back as the same graph", "[rdf][rdf_xml]") {
  Graph g;
  const TermView s = lrt::rdf::iri("http://e/s");
  g.add(s, vocab::rdf_::type, vocab::maths::Scalar);
  g.add(s, vocab::vom::numericalValue, literal("43.6", vocab::xsd::float_));
  g.add(s, vocab::vom::unit, blank("u"));
  g.add(blank("u"), vocab::rdf_::type, vocab::maths::Degree);
  g.add(blank("v"), lrt::rdf::iri("http://e/p"), blank("v"));
  const auto text = write(g, Syntax::rdf_xml);
  REQUIRE(text);
  CHECK(text->find("xmlns:maths=") != std::string::npos);
  CHECK(text->find("xmlns:ros=") == std::string::npos);
  CHECK(isomorphic(g, accepted(*text)));
  for (int i = 0; i < 300; ++i) g.add(blank("v" + std::to_string(i)), lrt::rdf::iri("http://e/p"), blank("v" + std::to_string(i + 1)));
  const auto large = write(g, Syntax::rdf_xml);
  REQUIRE(large);
  CHECK(accepted(*large).size() == g.size());
}

TEST_CASE("RDF/XML elements, attributes and namespaces are limited in number", "[rdf][rdf_xml][limits]") {
  const auto nested = [](std::size_t n) {
    return rdf_xml("<rdf:Description><v:a rdf:parseType='Literal'>" + repeated(n, "<b>") + repeated(n, "</b>") + "</v:a></rdf:Description>");
  };
  accepted(nested(max_elements_deep - 3));
  CHECK(says(beyond(nested(max_elements_deep - 2)), "line 2, column 806: elements nested more than 256 deep"));
  beyond(rdf_xml(repeated(200, "<rdf:Description><v:a>") + repeated(200, "</v:a></rdf:Description>")));

  const auto numbered = [](std::size_t n, const std::string& before, const std::string& behind) {
    std::string out;
    for (std::size_t i = 0; i < n; ++i) out += before + std::to_string(i) + behind;
    return out;
  };
  CHECK(accepted(rdf_xml("<rdf:Description" + numbered(max_attributes, " v:a", "=''") + "/>")).size() == 256);
  CHECK(says(beyond(rdf_xml("<rdf:Description" + numbered(max_attributes + 1, " v:a", "=''") + "/>")), "more than 256 attributes"));
  beyond(rdf_xml("", numbered(max_attributes, " xmlns:a", "='a:'")));
  CHECK(says(beyond(rdf_xml(numbered(max_namespaces, "<rdf:Description xmlns:a", "='a:'/>"))), "more than 1000 namespace declarations"));
  accepted(rdf_xml(numbered(max_namespaces - 3, "<rdf:Description xmlns:a", "='a:'/>")));

  accepted(rdf_xml(repeated(29, "<rdf:Description/>")), limits(10));
  CHECK(says(beyond(rdf_xml(repeated(30, "<rdf:Description/>")), limits(10)), "more than 30 elements"));
  CHECK(says(beyond(rdf_xml("<rdf:Description xml:base='" + repeated(33, "../") + "'/>")), "32 dot segments"));
}

TEST_CASE("tags that would lead the scanner and libxml2 apart are refused", "[rdf][rdf_xml][limits]") {
  for (const std::string tag : {"<a b=c>", "<a b>", "<a b='<'/>", "<a b='", "<a", "<a <b>", "<a / b=''>", "<a =''>"}) {
    INFO(tag);
    const auto graph = read(rdf_xml(tag), Syntax::rdf_xml, limits());
    REQUIRE_FALSE(graph);
    CHECK(graph.error().code == Errc::expected_rdf);
    CHECK(graph.error().column > 0);
  }
  accepted(rdf_xml("<!-- <a b=c> --><?a <b c>?><rdf:Description v:a = \"a>b'/>\"\n><v:a><![CDATA[<a b=c>]]></v:a></rdf:Description>"));
}

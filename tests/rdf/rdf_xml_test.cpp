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

TEST_CASE("a prefix in RDF/XML that no open element declares is refused with its place", "[rdf][rdf_xml]") {
  CHECK(accepted(rdf_xml("<e:T rdf:about='a:'><n:p xmlns:n='http://n/' n:q='1' xml:lang='en'/></e:T>")).size() == 3);
  CHECK(accepted(rdf_xml("<e:T rdf:about='a:' n:q='1' xmlns:n='http://n/'/>")).size() == 2);  // declared behind its use
  CHECK(accepted("<R:RDF xmlns:R='http://www.w3.org/1999/02/22-rdf-syntax-ns#'><T xmlns='http://e/' R:about='a:'/></R:RDF>").size() == 1);
  for (const char* const content : {"<e:T ref:about='a:'/>", "<ref:T/>", "<e:T rdf:about='a:'><e:p xmlns:ref='http://n/'/><e:p ref:q='1'/></e:T>",
                                    "<e:T rdf:about='a:'><e:p xmlns:ref='http://n/'>x</e:p><ref:p>x</ref:p></e:T>"}) {
    const lrt::Error error = refusal(rdf_xml(content));
    CHECK(says(error, "the prefix ref is not declared"));
    CHECK(says(error, "line 2"));
  }
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

TEST_CASE("entities that a document of RDF/XML declares itself are written out", "[rdf][rdf_xml]") {
  const std::string triple = "<http://v/a> <http://e/p> \"1\" .\n";
  const auto with = [](const std::string& declarations, const std::string& content) {
    return "<?xml version='1.0'?>\n<!-- c --><!DOCTYPE rdf:RDF [" + declarations + "]>\n" + rdf_xml(content);
  };
  const auto about = [](const std::string& iri) { return "<rdf:Description rdf:about=\"" + iri + "\"><e:p>1</e:p></rdf:Description>"; };
  const std::string v = "<!ENTITY v \"http://v/\">";
  for (const std::string& document : {
           with(v, about("&v;a")),
           with("\n  " + v + "\n", about("&v;a")),
           with("<!ENTITY v 'http://v/'>", about("&v;a")),
           with("<!ENTITY\tv\n\"http://v/\" >", about("&v;a")),
           with("<!ENTITY h 'http:'><!ENTITY v '&h;//v/'>", about("&v;a")),
           with("<!ENTITY v '&h;//v/'><!ENTITY h 'http:'>", about("&v;a")),
           with(v + "<!ENTITY v 'http://other/'>", about("&v;a")),
           with("<!ENTITY v 'http:&#47;&#x2F;v&#x2f;'>", about("&v;a")),
           with("<!ENTITY lt '&#38;#60;'><!ENTITY amp '&#38;#38;'>" + v, about("&v;a")),
           with("<!-- <!ENTITY v 'x'> ]> --><?pi ]> ?>" + v, about("&v;a")),
           with("<!ELEMENT rdf:RDF ANY><!ATTLIST rdf:RDF a CDATA #IMPLIED><!NOTATION n SYSTEM 'n>'>" + v, about("&v;a")),
           with("<!ENTITY d \"<rdf:Description rdf:about='http://v/a'><e:p>1</e:p></rdf:Description>\">", "&d;"),
           with("<!ENTITY o \"<e:p>&n;</e:p>\"><!ENTITY n '1'>", "<rdf:Description rdf:about='http://v/a'>&o;</rdf:Description>"),
           with("", about("http://v/a")),
           "<!DOCTYPE rdf:RDF>" + rdf_xml(about("http://v/a")),
           "<!DOCTYPE rdf:RDF SYSTEM \"http://elsewhere/rdf.dtd\">" + rdf_xml(about("http://v/a")),
           "<!DOCTYPE rdf:RDF PUBLIC '-//X//Y' 'http://elsewhere/rdf.dtd' [" + v + "] >" + rdf_xml(about("&v;a")),
           "\xEF\xBB\xBF<!DOCTYPE rdf:RDF[" + v + "]>" + rdf_xml(about("&v;a")),
           "<!DOCTYPE rdf:RDF [" + v + "]><rdf:RDF xmlns:rdf='http://www.w3.org/1999/02/22-rdf-syntax-ns#' xmlns:e='http://e/' xml:base='&v;'>" +
               about("a") + "</rdf:RDF>",
           "<!DOCTYPE rdf:RDF [<!ENTITY e 'http://e/'>]><rdf:RDF xmlns:rdf='http://www.w3.org/1999/02/22-rdf-syntax-ns#' xmlns:e='&e;'>" +
               about("http://v/a") + "</rdf:RDF>",
       }) {
    INFO(document);
    CHECK(n_triples(accepted(document)) == triple);
  }
  // Only where XML has references, and quotes of an entity end no attribute.
  const std::string x = "<!ENTITY x 'y'>";
  const auto value = [&](const std::string& declarations, const std::string& content) {
    const Graph g = accepted(with(declarations, "<rdf:Description rdf:about='a:'><e:p>" + content + "</e:p></rdf:Description>"));
    REQUIRE(g.size() == 1);
    return std::string(g.term(g.triples()[0].object).text);
  };
  CHECK(value(x, "a&x;b") == "ayb");
  CHECK(value(x, "<![CDATA[&x;]]>") == "&x;");
  CHECK(value(x, "<!-- &x; -->&#x26;x;&amp;x;") == "&x;&x;");
  CHECK(value("<!ENTITY x '&#38;lt;&#38;#38;'>", "&x;") == "<&");
  CHECK(value("<!ENTITY x '\xC3\xB6&#x1F916;'>", "&x;") == "\xC3\xB6\xF0\x9F\xA4\x96");
  for (const char* attribute : {"e:p=\"&x;\"", "e:p='&x;'"}) {
    const Graph g = accepted(with("<!ENTITY x \"'&#34;\">", "<rdf:Description rdf:about='a:' " + std::string(attribute) + "/>"));
    CHECK(g.term(g.triples()[0].object).text == "'\"");
  }
  // Lines stay.
  CHECK(refusal(with("\n" + v + "\n", "\n" + about("&v;a") + "\n<e:T><f:p/></e:T>")).line == 8);
}

TEST_CASE("entities from elsewhere, and what else a document type can do, are refused with the place", "[rdf][rdf_xml]") {
  const std::string content = rdf_xml("<rdf:Description rdf:about='a:'><e:p>&x;</e:p></rdf:Description>");
  const std::pair<const char*, const char*> declarations[] = {
      {"<!ENTITY x SYSTEM 'file:///etc/hostname'>", "from elsewhere"},
      {"<!ENTITY x PUBLIC '-//X' 'http://127.0.0.1/'>", "from elsewhere"},
      {"<!ENTITY x SYSTEM 'x' NDATA n>", "from elsewhere"},
      {"<!ENTITY % x 'y'>", "parameter entity"},
      {"<!ENTITY % x SYSTEM 'http://127.0.0.1/'> %x;", "parameter entity"},
      {"%x;", "parameter entity"},
      {"<!ENTITY x '%y;'>", "parameter entity"},
      {"<!ATTLIST rdf:RDF a CDATA 'b'>", "default value"},
      {"<!ATTLIST rdf:RDF a CDATA #FIXED \"b\">", "default value"},
      {"<!ENTITY x '&x;'>", "contains itself"},
      {"<!ENTITY x '&y;'><!ENTITY y 'a&x;'>", "contains itself"},
      {"<!ENTITY x '<e:q>'>", ""},
      {"<!ENTITY x '<e:q '>", "part of an element"},
      {"<!ENTITY x '<!-- '>", "part of an element"},
      {"<!ENTITY x '&#0;'>", "character"},
      {"<!ENTITY x '&#xD800;'>", "character"},
      {"<!ENTITY x '&#x110000;'>", "character"},
      {"<!ENTITY x '&#;'>", "character reference"},
      {"<!ENTITY x>", "expected a text in quotes"},
      {"<!ENTITY x 'y' z>", "expected '>'"},
      {"<!ENTITY x 'y", ""},
      {"<!NONSENSE>", "expected a declaration"},
      {"", ""},
  };
  for (const char* prolog : {"", "<?xml version='1.0'?>", "\xEF\xBB\xBF <!-- c --> <?pi?>"})
    for (const auto& [declaration, words] : declarations) {
      const lrt::Error error = refusal(prolog + ("<!DOCTYPE r [" + std::string(declaration) + "]>" + content));
      CHECK(says(error, words));
      CHECK(error.line > 0);
    }
  refusal("<!DOCTYPE r [<!ENTITY x '<y'>]>" + rdf_xml("<rdf:Description rdf:about='&x;'/>"));
  refusal("<!DOCTYPE r []><!DOCTYPE r []>" + rdf_xml(""));
  refusal("<!DOCTYPE r [" + rdf_xml(""));
  refusal("<!DOCTYPE [ ]>" + rdf_xml(""));
  accepted(rdf_xml("<rdf:Description><e:p>&lt;!DOCTYPE</e:p></rdf:Description>"));
}

TEST_CASE("entities that grow without end are refused at a limit", "[rdf][rdf_xml][limits]") {
  const auto bomb = [](const std::string& first, int levels) {
    std::string text = "<!DOCTYPE r [<!ENTITY a0 '" + first + "'>";
    for (int i = 1; i < levels; ++i) {
      text += "<!ENTITY a" + std::to_string(i) + " '";
      for (int k = 0; k < 10; ++k) text += "&a" + std::to_string(i - 1) + ";";
      text += "'>";
    }
    return text + "]>" + rdf_xml("<rdf:Description rdf:about='a:'><e:p>&a" + std::to_string(levels - 1) + ";</e:p></rdf:Description>");
  };
  CHECK(says(beyond(bomb("lollollollol", 12)), "entities"));
  CHECK(says(beyond(bomb("", 12)), "entities"));  // of nothing, but many
  CHECK(says(beyond(bomb("<e:q/>", 12)), "entities"));
  CHECK(accepted(bomb("x", 4)).term(accepted(bomb("x", 4)).triples()[0].object).text.size() == 1000);
  // A long one, many times.
  std::string wide = "<!DOCTYPE r [<!ENTITY x '" + std::string(100'000, 'x') + "'>]>";
  beyond(wide + rdf_xml("<rdf:Description rdf:about='a:'><e:p>" + repeated(1000, "&x;") + "</e:p></rdf:Description>"));
  beyond("<!DOCTYPE r [" + repeated(1001, "<!ENTITY x 'y'>") + "]>" + rdf_xml(""), limits(10'000, 100'000'000));
  std::string deep = "<!DOCTYPE r [<!ENTITY a0 'x'>";
  for (int i = 1; i < 40; ++i) deep += "<!ENTITY a" + std::to_string(i) + " '&a" + std::to_string(i - 1) + ";'>";
  CHECK(says(beyond(deep + "]>" + rdf_xml("<rdf:Description rdf:about='a:'><e:p>&a39;</e:p></rdf:Description>")), "deep"));
  // The limits of the document count what the entities say.
  std::string nested = "<!DOCTYPE r [<!ENTITY t '" + repeated(100, "<e:T><e:p>1</e:p></e:T>") + "'>]>";
  beyond(nested + rdf_xml(repeated(10, "&t;")), limits(1000));
  CHECK(accepted(nested + rdf_xml("&t;"), limits(1000)).size() == 200);
}

TEST_CASE("RDF/XML is read in the encodings that XML processors read, and in those that it declares", "[rdf][rdf_xml]") {
  const auto utf16 = [](const std::u16string& text, bool big) {
    std::string bytes;
    for (const char16_t unit : text) {
      const char high = static_cast<char>(unit >> 8), low = static_cast<char>(unit & 0xFF);
      bytes += big ? high : low;
      bytes += big ? low : high;
    }
    return bytes;
  };
  const auto wide = [](const std::string& ascii) { return std::u16string(ascii.begin(), ascii.end()); };
  const std::string head = rdf_xml("").substr(0, rdf_xml("").size() - 10) + "<rdf:Description rdf:about='a:'><e:p>",
                    tail = "</e:p></rdf:Description></rdf:RDF>";
  const std::string wanted = "<a:> <http://e/p> \"\xC3\xB6\xF0\x9F\xA4\x96\" .\n", latin = "<a:> <http://e/p> \"\xC3\xB6\" .\n";
  const std::u16string o16 = u"\u00f6\U0001F916", mark = u"\uFEFF";
  for (const bool big : {false, true}) {
    const std::u16string body = wide(head) + o16 + wide(tail);
    CHECK(n_triples(accepted(utf16(mark + body, big))) == wanted);
    CHECK(n_triples(accepted(utf16(mark + wide("<?xml version='1.0' encoding='UTF-16'?>\n") + body, big))) == wanted);
    CHECK(n_triples(accepted(utf16(wide("<?xml version='1.0' encoding=\"utf-16\" standalone='yes'?>") + body, big))) == wanted);
    CHECK(n_triples(accepted(utf16(mark + wide("<!DOCTYPE r [<!ENTITY x 'a:'>]>") + body, big))) == wanted);
    refusal(utf16(mark + wide(head) + u"\xD83E" + wide(tail), big));
    refusal(utf16(mark + wide(head) + u"\xDD16\xD83E" + wide(tail), big));
    refusal(utf16(mark + body, big) + "x");
    refusal(utf16(mark + wide(head) + std::u16string(1, u'\0') + wide(tail), big));
  }
  for (const char* name : {"ISO-8859-1", "iso-8859-1", "latin1"})
    CHECK(n_triples(accepted("<?xml version='1.0' encoding='" + std::string(name) + "'?>" + head + "\xF6" + tail)) == latin);
  CHECK(n_triples(accepted("<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?><!DOCTYPE r [<!ENTITY x '\xF6'>]>" + head + "&x;" + tail)) == latin);
  CHECK(n_triples(accepted("<?xml version='1.0' encoding='utf-8'?>" + head + "\xC3\xB6" + tail)) == latin);
  CHECK(n_triples(accepted("\xEF\xBB\xBF<?xml version='1.0' encoding='UTF-8'?>" + head + "\xC3\xB6" + tail)) == latin);
  CHECK(n_triples(accepted("<?xml version='1.0' encoding='US-ASCII'?>" + head + "&#xF6;" + tail)) == latin);
  refusal("<?xml version='1.0' encoding='US-ASCII'?>" + head + "\xC3\xB6" + tail);
  refusal(head + "\xF6" + tail);
  for (const char* name : {"UTF-7", "windows-1252", "UTF-16", "UTF-32", "EBCDIC-CP-US", ""}) {
    if (*name) CHECK(says(refusal("<?xml version='1.0' encoding='" + std::string(name) + "'?>" + head + tail), "expected one of the encodings"));
  }
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

// SPDX-License-Identifier: Apache-2.0
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <lrt/rdf/codec.hpp>
#include <lrt/thing.hpp>
#include <lrt/version.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/graphs.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

const std::string own = "https://w3id.org/lrt/ns";

rdf::Graph term_list() {
  Bench bench;
  return bench.get("/ns/lrt").graph();
}

std::set<std::string> subjects_in(const rdf::Graph& graph) {
  std::set<std::string> found;
  for (const rdf::Triple& t : graph.triples())
    if (graph.term(t.subject).is_iri()) found.emplace(graph.term(t.subject).text);
  found.erase(own);
  return found;
}

Iri owl(const char* name) {
  static std::set<std::string> kept;
  return Iri(std::string_view(*kept.insert(std::string("http://www.w3.org/2002/07/owl#") + name).first));
}

}  // namespace

TEST_CASE("the term list is an ontology of the library's version", "[engine][R1.5]") {
  const rdf::Graph terms = term_list();
  const rdf::TermView ontology = rdf::iri(own);
  CHECK(terms.contains(ontology, rdf::TermView(vocab::rdf_::type), rdf::TermView(owl("Ontology"))));
  CHECK(terms.object(ontology, rdf::TermView(owl("versionInfo"))).value().text == LRT_VERSION);
  CHECK(terms.object(ontology, rdf::TermView(owl("versionIRI"))).value().text == own + "/" LRT_VERSION);
  CHECK(terms.object(ontology, rdf::TermView(vocab::dcterms::title)));
  CHECK(terms.object(ontology, rdf::iri("http://purl.org/dc/terms/license")));
}

TEST_CASE(
    "each term of the term list has type, label, comment and a vocabulary, each property a domain and a range where they are "
    "true",
    "[engine][R1.5]") {
  const rdf::Graph terms = term_list();
  // Of several kinds of subjects or objects, which have no class in common.
  const std::set<std::string> without_domain = {
      "lrt#frame",           "lrt#elementType",      "lrt#all",        "lrt#stop",       "lrt#unreachableSince", "lrt#mqttBroker",
      "lrt#mqttTopic",       "lrt#mqttCommandTopic", "lrt#valueFrom",  "lrt#inputField", "lrt#tolerance",        "lrt#period",
      "hybrit#websocketUrl", "hybrit#subscriptions", "hybrit#binding", "lrt#stopState",  "lrt#unavailable",      "lrt#error"};
  const std::set<std::string> without_range = {"lrt#state", "lrt#frame",     "lrt#input",        "lrt#result",
                                               "lrt#mesh",  "lrt#texture",   "hybrit#blueprint", "hybrit#onResource",
                                               "lrt#all",   "lrt#allGraphs", "lrt#session",      "lrt#inputField"};
  const std::map<std::string, std::string> judged = {
      {own + "#", "lrt#"}, {"https://hybr-it-projekt.de/ns/hybr-it#", "hybrit#"}, {"http://ros.org/#", "ros#"}};
  std::size_t properties = 0;
  for (const std::string& term : subjects_in(terms)) {
    CAPTURE(term);
    const rdf::TermView node = rdf::iri(term);
    const auto count = [&](Iri predicate) { return terms.objects(node, rdf::TermView(predicate)).size(); };
    CHECK(count(vocab::rdf_::type) >= 1);
    CHECK(count(vocab::rdfs::label) == 1);
    CHECK(count(vocab::rdfs::comment) == 1);
    CHECK(count(vocab::rdfs::isDefinedBy) == 1);
    for (const Iri predicate : {vocab::rdfs::label, vocab::rdfs::comment})
      for (const rdf::TermView& text : terms.objects(node, rdf::TermView(predicate))) CHECK(text.language == "en");
    const std::string space = term.substr(0, term.find('#') + 1);
    const auto prefix = judged.find(space);
    if (prefix == judged.end() || !terms.contains(node, rdf::TermView(vocab::rdf_::type), rdf::TermView(vocab::rdf_::Property))) continue;
    ++properties;
    const std::string name = prefix->second + term.substr(space.size());
    const rdf::TermView domain = rdf::iri("http://www.w3.org/2000/01/rdf-schema#domain"),
                        range = rdf::iri("http://www.w3.org/2000/01/rdf-schema#range");
    CHECK(terms.objects(node, domain).size() == 1 - without_domain.count(name));
    CHECK(terms.objects(node, range).size() == 1 - without_range.count(name));
  }
  CHECK(properties > 70);
}

TEST_CASE("the term list has every term of docs/modelling.md", "[engine][R1.5]") {
  const std::set<std::string> listed = subjects_in(term_list());
  std::ifstream file(LRT_SOURCE_DIR "/docs/modelling.md");
  const std::string page((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  std::size_t terms = 0;
  const std::regex term("\\b(lrt|hybrit|ros|vom|maths|spatial):([A-Za-z][A-Za-z0-9]*)");
  for (std::sregex_iterator i(page.begin(), page.end(), term), end; i != end; ++i, ++terms) {
    CAPTURE(i->str());
    std::string iri;
    for (const auto& [prefix, space] : rdf::default_prefixes())
      if (prefix == (*i)[1]) iri = space + (*i)[2].str();
    CHECK(listed.count(iri) == 1);
  }
  CHECK(terms > 80);
}

TEST_CASE("the term list has every term of vocab.hpp whose vocabulary no server documents", "[engine][R1.5]") {
  const std::set<std::string> listed = subjects_in(term_list());
  std::ifstream header(LRT_SOURCE_DIR "/include/lrt/rdf/vocab.hpp");
  std::map<std::string, std::string> spaces;
  std::size_t terms = 0;
  for (std::string line; std::getline(header, line);) {
    std::smatch found;
    if (std::regex_search(line, found, std::regex("^#define LRT_VOCAB_(\\w+) \"(.*)\""))) spaces[found[1]] = found[2];
    if (!std::regex_search(line, found, std::regex("^LRT_TERM(?:_AS)?\\((\\w+),.*?\\b(\\w+)\"?\\);"))) continue;
    const std::string prefix = found[1];
    if (prefix != "lrt" && prefix != "hybrit" && prefix != "ros" && prefix != "vom" && prefix != "maths" && prefix != "spatial") continue;
    ++terms;
    CAPTURE(line);
    CHECK(listed.count(spaces.at(prefix) + found[2].str()) == 1);
  }
  CHECK(terms > 120);
}

namespace {

const std::string html = "\nAccept: text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8";

/// The values of an attribute, as the page has them.
std::vector<std::string> values_of(const std::string& page, const std::string& attribute) {
  std::vector<std::string> found;
  const std::string start = " " + attribute + "=\"";
  for (std::size_t at = page.find(start); at != std::string::npos; at = page.find(start, at + 1))
    found.push_back(page.substr(at + start.size(), page.find('"', at + start.size()) - at - start.size()));
  return found;
}

/// The part that the server writes.
std::string main_of(const Answer& page) {
  const std::size_t from = page.body.find("<main"), to = page.body.find("</main>");
  REQUIRE(from != std::string::npos);
  return page.body.substr(from, to - from);
}

std::string in_html(std::string text) {
  for (const auto& [from, to] :
       {std::pair("&", "&amp;"), std::pair("<", "&lt;"), std::pair(">", "&gt;"), std::pair("\"", "&quot;"), std::pair("'", "&#39;")})
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + std::strlen(to))) text.replace(at, 1, to);
  return text;
}

struct Reading {
  std::string user = "<x>";
  double level = 0;
};

}  // namespace

template <>
struct lrt::rdf::traits<Reading> : lrt::rdf::Record<Reading> {
  static void describe(Record& r) {
    r.field("user", &Reading::user);
    r.field("level", &Reading::level).unit(unit::metre);
  }
};

TEST_CASE("the term list is a page with an anchor for each term, in English, without a script", "[engine][R1.5]") {
  Bench bench;
  const rdf::Graph terms = bench.get("/ns/lrt").graph();
  const Answer answer = bench.ask("GET /ns/lrt" + html);
  CHECK(answer.status == 200);
  CHECK(answer.field("Content-Type") == "text/html; charset=utf-8");
  CHECK(answer.field("Content-Language") == "en");
  CHECK(answer.members("Vary").count("Accept") == 1);
  CHECK(answer.field("Content-Security-Policy") == bench.ask("GET /" + html).field("Content-Security-Policy"));
  CHECK(answer.body.find("<html lang=\"en\">") != std::string::npos);
  CHECK(answer.body.find("<title>Terms of Linked Robotic Things</title>") != std::string::npos);
  const std::string page = main_of(answer);
  CHECK(page.find("<script") == std::string::npos);
  CHECK(page.find("<h1>Terms of Linked Robotic Things</h1>") != std::string::npos);

  const std::vector<std::string> all = values_of(answer.body, "id");
  const std::set<std::string> anchors(all.begin(), all.end());
  CHECK(anchors.size() == all.size());  // none twice, also not with the parts of the page around
  for (const std::string& target : values_of(page, "href")) {
    CAPTURE(target);
    if (target.front() == '#') CHECK(anchors.count(target.substr(1)) == 1);
    else CHECK((target.rfind("http", 0) == 0 || target.rfind("?accept=", 0) == 0));
  }
  std::map<std::string, std::string> prefixes;
  for (const auto& [prefix, space] : rdf::default_prefixes()) prefixes[space] = prefix;
  std::size_t own_terms = 0;
  for (const std::string& term : subjects_in(terms)) {
    CAPTURE(term);
    const std::string space = term.substr(0, term.find('#') + 1), name = term.substr(space.size());
    const std::string anchor = space == own + "#" ? name : prefixes.at(space) + ":" + name;
    own_terms += space == own + "#";
    REQUIRE(anchors.count(anchor) == 1);
    const std::size_t from = page.find("<article class=\"card\" id=\"" + anchor + "\">");
    const std::string about = page.substr(from, page.find("</article>", from) - from);
    for (const Iri predicate : {vocab::rdfs::label, vocab::rdfs::comment})
      CHECK(about.find(in_html(std::string(terms.object(rdf::iri(term), rdf::TermView(predicate)).value().text))) != std::string::npos);
    CHECK(about.find("<code>" + term + "</code>") != std::string::npos);
    for (const auto& [predicate, caption] :
         {std::pair(vocab::rdfs::domain, "Domain"), std::pair(vocab::rdfs::range, "Range"), std::pair(vocab::rdfs::subClassOf, "Subclass of")})
      CHECK((about.find(std::string("<dt>") + caption + "</dt>") != std::string::npos) ==
            terms.object(rdf::iri(term), rdf::TermView(predicate)).has_value());
  }
  CHECK(own_terms > 90);
}

TEST_CASE("the page of the term list has its own tag, and RDF has what it had", "[engine][R0.11][R1.2]") {
  Bench bench;
  const Answer page = bench.ask("GET /ns/lrt" + html);
  CHECK(page.field("ETag") != bench.get("/ns/lrt").field("ETag"));
  CHECK(page.field("ETag") != bench.ask("GET /" + html).field("ETag"));
  CHECK(bench.ask("GET /ns/lrt" + html + "\nIf-None-Match: " + page.field("ETag")).status == 304);
  CHECK(bench.ask("HEAD /ns/lrt" + html).field("ETag") == page.field("ETag"));
  CHECK(bench.ask("GET /ns/lrt" + html + "\nIf-None-Match: " + bench.get("/ns/lrt").field("ETag")).status == 200);
  for (const char* accept : {"*/*", "text/*", "text/html, text/turtle", "text/html;q=0.5, */*;q=0.6"})
    CHECK(bench.ask(std::string("GET /ns/lrt\nAccept: ") + accept).field("Content-Type") == "text/turtle");
}

TEST_CASE("the server's own terms are a page, too", "[engine][R1.5]") {
  Bench bench;
  Thing arm{"arm"};
  const Reading reading;
  arm.property("reading", [&] { return reading; });
  bench.add(std::move(arm));
  const Answer before = bench.ask("GET /ns/vocabulary" + html);
  const std::string page = main_of(before);
  for (const char* part : {"<h1>Terms of this robot</h1>", "id=\"Reading\"", "id=\"Reading/user\"", "id=\"Reading/level\"", "id=\"Thing/reading\"",
                           "<dt>Domain</dt><dd><a href=\"#Reading\">Reading</a></dd>", "http://localhost/ns/vocabulary#",
                           "data-of=\"http://localhost/ns/vocabulary\""}) {
    CAPTURE(part);
    CHECK(page.find(part) != std::string::npos);
  }
  Thing leg{"leg"};
  leg.property("height", [] { return 1.5; });
  bench.add(std::move(leg));
  const Answer after = bench.ask("GET /ns/vocabulary" + html);
  CHECK(after.body.find("id=\"Thing/height\"") != std::string::npos);
  CHECK(after.field("ETag") != before.field("ETag"));
}

// SPDX-License-Identifier: Apache-2.0
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>

#include <lrt/rdf/codec.hpp>
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
  const std::set<std::string> without_domain = {"lrt#frame",
                                                "lrt#elementType",
                                                "lrt#all",
                                                "lrt#stop",
                                                "lrt#unreachableSince",
                                                "lrt#mqttBroker",
                                                "lrt#mqttTopic",
                                                "lrt#mqttCommandTopic",
                                                "hybrit#websocketUrl",
                                                "hybrit#subscriptions",
                                                "hybrit#binding"};
  const std::set<std::string> without_range = {"lrt#state",        "lrt#frame",         "lrt#input", "lrt#result",    "lrt#mesh",   "lrt#texture",
                                               "hybrit#blueprint", "hybrit#onResource", "lrt#all",   "lrt#allGraphs", "lrt#session"};
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

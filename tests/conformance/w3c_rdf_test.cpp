// SPDX-License-Identifier: Apache-2.0
#include <lrt/rdf/codec.hpp>

#include <fstream>
#include <sstream>
#include <string>

#include <lrt/rdf/vocab.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/skip.hpp"

// The W3C suites of RDF 1.1 Turtle and N-Triples, read from LRT_SHARED_DIR/suites and never copied into the project; and small ones of our own.

namespace {

using lrt::Iri;
using lrt::Result;
using lrt::rdf::Graph;
using lrt::rdf::Syntax;
using lrt::rdf::TermView;

constexpr Iri mf_entries{"http://www.w3.org/2001/sw/DataAccess/tests/test-manifest#entries"};
constexpr Iri mf_action{"http://www.w3.org/2001/sw/DataAccess/tests/test-manifest#action"};
constexpr Iri mf_result{"http://www.w3.org/2001/sw/DataAccess/tests/test-manifest#result"};
const std::string rdft = "http://www.w3.org/ns/rdftest#";

const std::string turtle_base = "https://w3c.github.io/rdf-tests/rdf/rdf11/rdf-turtle/";
const std::string n_triples_base = "https://w3c.github.io/rdf-tests/rdf/rdf11/rdf-n-triples/";

std::optional<std::string> file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return std::nullopt;
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// Where a document of the suite is on disk: behind the last '/' of its IRI.
std::string path_of(const std::string& folder, std::string_view iri) { return folder + "/" + std::string(iri.substr(iri.rfind('/') + 1)); }

/// What went wrong, or an empty text.
std::string outcome(const std::string& folder, Syntax syntax, std::string_view type, TermView action, std::optional<TermView> result) {
  const auto text = file(path_of(folder, action.text));
  if (!text) return "no file for " + std::string(action.text);
  const Result<Graph> graph = lrt::rdf::read(*text, syntax, {action.text});
  if (type.find("Negative") != std::string_view::npos) return graph ? "accepted what is wrong" : "";
  if (!graph) return "refused: " + graph.error().message;
  if (type.find("Eval") == std::string_view::npos) return "";
  const auto expected_text = file(path_of(folder, result->text));
  if (!expected_text) return "no file for " + std::string(result->text);
  const Result<Graph> expected = lrt::rdf::read(*expected_text, Syntax::n_triples, {});
  if (!expected) return "result refused: " + expected.error().message;
  return lrt::rdf::isomorphic(*graph, *expected) ? "" : "another graph:\n" + *lrt::rdf::write(*graph, Syntax::n_triples);
}

/// @param least  entries of the manifest
void run(const std::string& folder, const std::string& base, Syntax syntax, std::size_t least) {
  const auto text = file(folder + "/manifest.ttl");
  if (!text) {
    lrt::test::print_skip("no W3C suite in " + folder);
    return;
  }
  const Result<Graph> manifest = lrt::rdf::read(*text, Syntax::turtle, {base});
  if (!manifest) FAIL(manifest.error().message);
  const auto head = manifest->match(nullptr, &static_cast<const TermView&>(TermView(mf_entries)), nullptr);
  REQUIRE_FALSE(head.empty());
  const auto entries = manifest->list(head.begin()->object);
  REQUIRE(entries);
  REQUIRE(entries->size() >= least);
  for (const auto id : *entries) {
    const TermView entry = manifest->term(id);
    const auto type = manifest->object(entry, lrt::vocab::rdf_::type);
    const auto action = manifest->object(entry, mf_action);
    REQUIRE(type);
    REQUIRE(action);
    const std::string fault = outcome(folder, syntax, type->text, *action, manifest->object(entry, mf_result));
    INFO(entry.text << " " << type->text.substr(rdft.size()));
    INFO(fault);
    CHECK(fault.empty());
  }
}

/// Writes and reads back what a suite's documents say.
void round_trip(const std::string& folder, const std::string& base, Syntax syntax) {
  const auto text = file(folder + "/manifest.ttl");
  if (!text) {
    lrt::test::print_skip("no W3C suite in " + folder);
    return;
  }
  const Result<Graph> manifest = lrt::rdf::read(*text, Syntax::turtle, {base});
  REQUIRE(manifest);
  std::size_t graphs = 0, as_rdf_xml = 0;
  const TermView action = mf_action;
  for (const auto& t : manifest->match(nullptr, &action, nullptr)) {
    const TermView document = manifest->term(t.object);
    const auto source = file(path_of(folder, document.text));
    REQUIRE(source);
    const Result<Graph> graph = lrt::rdf::read(*source, syntax, {document.text});
    if (!graph) continue;
    ++graphs;
    INFO(document.text);
    for (const Syntax as : lrt::rdf::available_syntaxes()) {
      const Result<std::string> written = lrt::rdf::write(*graph, as);
      if (as == Syntax::rdf_xml && !written) {
        CHECK(written.error().code == lrt::Errc::unsupported_syntax);
        continue;
      }
      as_rdf_xml += as == Syntax::rdf_xml;
      REQUIRE(written);
      INFO(*written);
      const Result<Graph> back = lrt::rdf::read(*written, as, {});
      INFO((back ? "" : back.error().message));
      REQUIRE(back);
      CHECK(lrt::rdf::isomorphic(*graph, *back));
    }
  }
  INFO(graphs << " graphs, " << as_rdf_xml << " as RDF/XML");
  CHECK(as_rdf_xml * 10 > graphs * 5);
}

const std::string suites = LRT_SHARED_DIR "/suites";
const std::string own_suites = LRT_SOURCE_DIR "/tests/conformance/suites";
const std::string own_base = "http://suite.example/";
}  // namespace

TEST_CASE("a small Turtle suite of our own passes", "[conformance][rdf][R1.2]") {
  run(own_suites + "/turtle", own_base + "turtle/", Syntax::turtle, 5);
}

TEST_CASE("a small N-Triples suite of our own passes", "[conformance][rdf]") {
  run(own_suites + "/n-triples", own_base + "n-triples/", Syntax::n_triples, 3);
}

TEST_CASE("every graph of our own suites survives writing and reading in each syntax", "[conformance][rdf][R1.2]") {
  round_trip(own_suites + "/turtle", own_base + "turtle/", Syntax::turtle);
  round_trip(own_suites + "/n-triples", own_base + "n-triples/", Syntax::n_triples);
}

TEST_CASE("the W3C Turtle suite passes", "[conformance][rdf][R1.2]") { run(suites + "/rdf-turtle", turtle_base, Syntax::turtle, 50); }

TEST_CASE("the W3C N-Triples suite passes", "[conformance][rdf]") { run(suites + "/rdf-n-triples", n_triples_base, Syntax::n_triples, 50); }

TEST_CASE("every graph of the W3C suites survives writing and reading in each syntax", "[conformance][rdf][R1.2]") {
  round_trip(suites + "/rdf-turtle", turtle_base, Syntax::turtle);
  round_trip(suites + "/rdf-n-triples", n_triples_base, Syntax::n_triples);
}

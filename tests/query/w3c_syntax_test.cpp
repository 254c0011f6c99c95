// SPDX-License-Identifier: Apache-2.0
#include "src/query/parser.hpp"

#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "tests/support/catch.hpp"

// The queries of the W3C suites of SPARQL 1.1 and 1.0, read from LRT_SHARED_DIR/suites and never copied into the project; and a few of
// our own.

namespace {

using lrt::Iri;
using lrt::Result;
using lrt::rdf::Graph;
using lrt::rdf::Syntax;
using lrt::rdf::TermView;

const std::string manifest_names = "http://www.w3.org/2001/sw/DataAccess/tests/test-manifest#";
const std::string query_names = "http://www.w3.org/2001/sw/DataAccess/tests/test-query#";
const std::string w3c_folder = LRT_SHARED_DIR "/suites/sparql11/";
const std::string own_folder = LRT_SOURCE_DIR "/tests/conformance/suites/sparql/";
const std::string base = "http://suite.example/";  // stands for the folder

std::optional<std::string> file(const std::string& folder, std::string_view iri) {
  std::ifstream in(folder + std::string(iri.substr(base.size())), std::ios::binary);
  if (!in) return std::nullopt;
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// What is in an RDF list that is the value of a property of any subject.
std::vector<std::string> listed(const Graph& graph, const std::string& property) {
  std::vector<std::string> result;
  const TermView predicate = lrt::rdf::iri(property);
  for (const auto& triple : graph.match(nullptr, &predicate, nullptr)) {
    const auto members = graph.list(triple.object);
    REQUIRE(members);
    for (const auto id : *members) result.emplace_back(graph.term(id).text);
  }
  return result;
}

struct Run {
  std::string folder;
  std::size_t good = 0, bad = 0, evaluated = 0;
};

void judge(const std::string& type, const std::string& query, Run& run) {
  const auto text = file(run.folder, query);
  INFO(type << " " << query);
  REQUIRE(text);
  INFO(*text);
  const bool negative = type.find("Negative") != std::string::npos;
  ++(negative ? run.bad : type.find("Positive") != std::string::npos ? run.good : run.evaluated);
  lrt::query::ParseOptions options;
  options.base = query;
  const auto parsed = lrt::query::parse(*text, options);
  INFO((parsed ? "accepted" : parsed.error().message));
  CHECK(parsed.has_value() != negative);
  if (!parsed) {
    CHECK(parsed.error().code == lrt::Errc::expected_rdf);
    CHECK(parsed.error().offset);
  }
}

void read_manifest(const std::string& iri, Run& run) {
  const auto text = file(run.folder, iri);
  INFO(iri);
  REQUIRE(text);
  lrt::rdf::ReadOptions options;
  options.base = iri;
  const Result<Graph> graph = lrt::rdf::read(*text, Syntax::turtle, options);
  INFO((graph ? "" : graph.error().message));
  REQUIRE(graph);
  for (const std::string& part : listed(*graph, manifest_names + "include")) read_manifest(part, run);
  const std::string action_iri = manifest_names + "action", query_iri = query_names + "query";
  for (const std::string& name : listed(*graph, manifest_names + "entries")) {
    const TermView entry = lrt::rdf::iri(name);
    const auto type = graph->object(entry, lrt::vocab::rdf_::type);
    const auto action = graph->object(entry, lrt::rdf::iri(action_iri));
    INFO(name);
    REQUIRE(type);
    REQUIRE(action);
    const auto query = graph->object(*action, lrt::rdf::iri(query_iri));
    judge(std::string(type->text), std::string(query ? query->text : action->text), run);
  }
}

}  // namespace

TEST_CASE("the parser judges every query of the W3C suites as they do", "[query]") {
  if (!file(w3c_folder, base + "manifest-sparql11-query.ttl")) {
    WARN("skipped: no W3C suite in " << w3c_folder);
    return;
  }
  Run run{w3c_folder};
  for (const char* name :
       {"manifest-sparql11-query.ttl", "manifest-sparql11-results.ttl", "sparql10/manifest-syntax.ttl", "sparql10/manifest-evaluation.ttl"}) {
    read_manifest(base + name, run);
  }
  INFO(run.good << " good, " << run.bad << " bad, " << run.evaluated << " evaluated");
  CHECK(run.good == 212);
  CHECK(run.bad == 90);
  CHECK(run.evaluated == 518);
}

TEST_CASE("the parser judges every query of a small suite of our own", "[query]") {
  Run run{own_folder};
  read_manifest(base + "manifest.ttl", run);
  CHECK(run.good == 1);
  CHECK(run.bad == 2);
  CHECK(run.evaluated == 2);
}

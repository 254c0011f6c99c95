// SPDX-License-Identifier: Apache-2.0
#include <lrt/shacl/validator.hpp>

#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/skip.hpp"

// The W3C suite of SHACL Core, read from LRT_SHARED_DIR/suites/shacl and never copied into the project; and a small one of our own. Reports are compared as
// the suite asks: sh:conforms, and for every result the properties below, as graphs. sh:resultMessage counts where it is
// expected.

namespace {

using lrt::Iri;
using lrt::Result;
using lrt::rdf::Graph;
using lrt::rdf::Syntax;
using lrt::rdf::TermId;
using lrt::rdf::TermView;
using lrt::rdf::Triple;
namespace sh = lrt::vocab::sh;
namespace shacl = lrt::shacl;

#define MF "http://www.w3.org/2001/sw/DataAccess/tests/test-manifest#"
#define SHT "http://www.w3.org/ns/shacl-test#"
constexpr Iri mf_include{MF "include"}, mf_entries{MF "entries"}, mf_action{MF "action"}, mf_result{MF "result"};
constexpr Iri sht_data{SHT "dataGraph"}, sht_shapes{SHT "shapesGraph"}, sht_failure{SHT "Failure"};

/// A suite: its folder, and the IRI that stands for the folder.
struct Suite {
  std::string folder, base;
};
const Suite w3c_suite{LRT_SHARED_DIR "/suites/shacl", "http://datashapes.org/sh/tests/"};
const Suite own_suite{LRT_SOURCE_DIR "/tests/conformance/suites/shacl", "http://suite.example/shacl/"};

/// Cases that do not come out as the suite says, with the reason. One that does come out fails the test: remove it then.
const std::map<std::string, std::string> known_failures = {};

struct Case {
  std::string iri;
  std::shared_ptr<const Graph> manifest;
};

std::optional<std::string> file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return std::nullopt;
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::optional<Graph> document(const Suite& suite, std::string_view iri) {
  const auto text = file(suite.folder + "/" + std::string(iri.substr(suite.base.size())));
  if (!text) return std::nullopt;
  lrt::rdf::ReadOptions options;
  options.base = iri;
  Result<Graph> graph = lrt::rdf::read(*text, Syntax::turtle, options);
  if (!graph) FAIL_CHECK(iri << ": " << graph.error().message);
  return graph ? std::optional<Graph>(*std::move(graph)) : std::nullopt;
}

void collect(const Suite& suite, const std::string& manifest, std::set<std::string>& seen, std::vector<Case>& out) {
  if (!seen.insert(manifest).second) return;
  const auto graph = document(suite, manifest);
  if (!graph) return;  // the suite's part on SPARQL is not there
  const auto shared = std::make_shared<const Graph>(*graph);
  for (const TermView include : shared->objects(lrt::rdf::iri(manifest), mf_include)) collect(suite, std::string(include.text), seen, out);
  if (const auto head = shared->object(lrt::rdf::iri(manifest), mf_entries)) {
    const auto entries = shared->list(*shared->find(*head));
    REQUIRE(entries);
    for (const TermId e : *entries) out.push_back({std::string(shared->term(e).text), shared});
  }
}

std::vector<Case> cases(const Suite& suite) {
  std::vector<Case> out;
  std::set<std::string> seen;
  collect(suite, suite.base + "manifest.ttl", seen, out);
  return out;
}

/// Copies a term and, of a blank node, all that hangs from it (paths).
TermId copy(const Graph& from, TermId id, Graph& to, std::map<TermId, TermId>& blanks, bool deep) {
  const TermView term = from.term(id);
  if (!term.is_blank()) return to.intern(term);
  const auto known = blanks.find(id);
  if (known != blanks.end()) return known->second;
  const TermId mine = blanks[id] = to.fresh_blank();
  if (deep) {
    for (const Triple& t : from.match(id, std::nullopt, std::nullopt))
      to.add(mine, to.intern(from.term(t.predicate)), copy(from, t.object, to, blanks, true));
  }
  return mine;
}

/// What counts of a report.
Graph relevant(const Graph& graph, TermId report, bool with_messages) {
  Graph out;
  const TermId root = out.fresh_blank();
  if (const auto conforms = graph.object(graph.term(report), sh::conforms)) out.add(out.term(root), sh::conforms, *conforms);
  std::map<TermId, TermId> blanks;
  const auto results = graph.find(sh::result);
  if (!results) return out;
  for (const Triple& r : graph.match(report, *results, std::nullopt)) {
    const TermId node = out.fresh_blank();
    out.add(root, out.intern(sh::result), node);
    std::vector<Iri> kept = {sh::focusNode, sh::resultPath, sh::value, sh::sourceShape, sh::sourceConstraintComponent, sh::resultSeverity};
    if (with_messages) kept.push_back(sh::resultMessage);
    for (const Iri predicate : kept) {
      const auto p = graph.find(predicate);
      if (!p) continue;
      for (const Triple& t : graph.match(r.object, *p, std::nullopt)) {
        std::map<TermId, TermId> of_path;
        const bool path = predicate == sh::resultPath;
        out.add(node, out.intern(predicate), copy(graph, t.object, out, path ? of_path : blanks, path));
      }
    }
  }
  return out;
}

/// What went wrong, or an empty text.
std::string outcome(const Suite& suite, const Case& test) {
  const Graph& manifest = *test.manifest;
  const TermView entry = lrt::rdf::iri(test.iri);
  const auto action = manifest.object(entry, mf_action), expected = manifest.object(entry, mf_result);
  if (!action || !expected) return "no action or result";
  const auto data_iri = manifest.object(*action, sht_data), shapes_iri = manifest.object(*action, sht_shapes);
  if (!data_iri || !shapes_iri) return "no graphs";
  const auto data = document(suite, data_iri->text), shapes_graph = document(suite, shapes_iri->text);
  if (!data || !shapes_graph) return "a graph is missing";
  const Result<shacl::Shapes> shapes = shacl::Shapes::compile(*shapes_graph);
  const bool failure = *expected == TermView(sht_failure);
  if (!shapes) return failure ? "" : "refused: " + shapes.error().message;
  const Result<shacl::Report> report = shacl::validate(*shapes, *data);
  if (!report) return failure ? "" : "not judged: " + report.error().message;
  if (failure) return "expected a failure";
  const Graph graph = report->to_graph();
  const TermView conforms = sh::conforms;
  const auto roots = graph.match(nullptr, &conforms, nullptr);
  const TermId expected_root = *manifest.find(*expected);
  bool messages = false;
  const TermView message = sh::resultMessage;
  for (const Triple& t : manifest.match(nullptr, &message, nullptr)) messages = messages || manifest.term(t.subject).is_blank();
  const Graph found = relevant(graph, roots.begin()->subject, messages), wanted = relevant(manifest, expected_root, messages);
  if (lrt::rdf::isomorphic(found, wanted)) return "";
  return "expected\n" + *lrt::rdf::write(wanted, Syntax::turtle) + "\nfound\n" + *lrt::rdf::write(found, Syntax::turtle) + "\n" + report->to_text();
}

}  // namespace

TEST_CASE("the W3C SHACL Core suite passes but for the known failures", "[conformance][shacl]") {
  if (!file(w3c_suite.folder + "/manifest.ttl")) {
    lrt::test::print_skip("no W3C suite in " + w3c_suite.folder);
    return;
  }
  static const std::vector<Case> all = cases(w3c_suite);
  REQUIRE(all.size() > 90);
  for (const Case& test : all) {
    DYNAMIC_SECTION(test.iri.substr(w3c_suite.base.size())) {
      const std::string fault = outcome(w3c_suite, test);
      INFO(fault);
      const auto known = known_failures.find(test.iri);
      if (known == known_failures.end()) {
        CHECK(fault.empty());
      } else {
        INFO("listed as a known failure: " << known->second);
        CHECK_FALSE(fault.empty());
      }
    }
  }
}

TEST_CASE("a small SHACL suite of our own passes", "[conformance][shacl]") {
  const std::vector<Case> all = cases(own_suite);
  CHECK(all.size() == 2);
  for (const Case& test : all) {
    INFO(test.iri);
    CHECK(outcome(own_suite, test) == "");
  }
}

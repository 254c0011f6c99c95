// SPDX-License-Identifier: Apache-2.0
// Queries and standing queries of a reader do not tell a robot with hidden things from its twin without them.
#include <lrt/query.hpp>

#include <algorithm>
#include <chrono>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/query/requests.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/twins.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace lrt::test::twins;
using std::chrono::milliseconds;

namespace {

engine::EngineOptions with_endpoint() {
  query::EndpointOptions endpoint;
  endpoint.time = std::chrono::hours(1);
  engine::EngineOptions options;
  options.query = query::endpoint(endpoint);
  return options;
}

struct Case {
  const char* query;
  const char* accept;
  bool changes = false;
};

const std::vector<Case>& cases() {
  static const std::vector<Case> all = {
      {"SELECT (COUNT(*) AS ?n) { GRAPH ?g { ?s ?p ?o } FILTER(!CONTAINS(STR(?g), 'blueprints')) }", "text/csv"},
      {"SELECT (COUNT(DISTINCT ?g) AS ?n) { GRAPH ?g { ?s ?p ?o } }", "text/csv"},
      {"SELECT ?g ?v { GRAPH ?g { ?x <https://example.org/near> ?v } } ORDER BY ?g ?v", "application/sparql-results+json"},
      {"SELECT ?g ?v { GRAPH ?g { ?x <http://www.w3.org/2000/01/rdf-schema#label> ?v } } ORDER BY ?g ?v", "text/csv", true},
      {"SELECT ?g ?x ?v { GRAPH ?g { ?x <p:r> ?v } } ORDER BY ?g ?v", "application/sparql-results+json"},
      {"CONSTRUCT { ?x <p:r> ?v } { GRAPH ?g { ?x <p:r> ?v } }", "application/n-triples"},
      {"DESCRIBE <http://localhost/world/g0#z> <http://localhost/world>", "application/n-triples"},
      {"SELECT ?s (COUNT(?o) AS ?n) { ?s <http://www.w3.org/ns/ldp#contains> ?o } GROUP BY ?s ORDER BY ?s", "text/csv"},
      {"ASK { ?s ?p ?o FILTER(CONTAINS(STR(?s), 'veiled')) }", "application/sparql-results+json"},
  };
  return all;
}

/// An event without its numbers: how many results came between two messages depends on when the query was evaluated (0076).
std::string without_numbers(const std::string& event) {
  std::string plain;
  for (std::size_t at = 0; at < event.size();) {
    const std::size_t end = std::min(event.find('\n', at), event.size() - 1) + 1;
    const std::string line = event.substr(at, end - at);
    if (line.rfind("sequence:", 0) != 0 && line.rfind("left-out:", 0) != 0) plain += line;
    at = end;
  }
  return plain;
}

std::string target(const Case& one) { return "/sparql?query=" + encoded(one.query) + (one.changes ? "&changes=true" : ""); }

}  // namespace

TEST_CASE("queries and standing queries of a reader are those of a robot without what is hidden", "[query][security][twins]") {
  const unsigned seed = GENERATE(1U, 2U);
  CAPTURE(seed);
  std::mt19937 source(seed);
  const auto random = [&] { return static_cast<unsigned>(source()); };
  Robot robot(true, with_endpoint()), twin(false, with_endpoint());
  std::map<std::string, Plain> of_robot, of_twin;
  for (Robot* r : {&robot, &twin})
    for (const Case& one : cases()) {
      CAPTURE(one.query);
      r->channels.emplace_back(one.query, r->bench.open_stream(target(one), by("anna")));
    }
  std::size_t messages = 0;
  for (int step = 0; step < 40; ++step) {
    CAPTURE(step);
    std::string done;
    for (unsigned n = random() % 3; n < 3; ++n) {
      const unsigned kind = random() % (Robot::changes + Robot::hidden_changes), number = random() % 1000;
      done += " " + std::to_string(kind) + ":" + std::to_string(number);
      for (Robot* r : {&robot, &twin}) kind < Robot::changes ? r->change(kind, number) : r->change_hidden(kind - Robot::changes, number);
    }
    CAPTURE(done);
    for (Robot* r : {&robot, &twin}) r->bench.clock.advance(milliseconds(150));
    auto got = robot.messages(), expected = twin.messages();
    for (const auto& [name, channel] : robot.channels) {
      CAPTURE(name);
      std::string all_got, all_expected;
      for (const std::string& text : got[name]) all_got += of_robot[name](without_numbers(text));
      for (const std::string& text : expected[name]) all_expected += of_twin[name](without_numbers(text));
      CHECK(difference(all_got, all_expected) == "");
      messages += expected[name].size();
    }
    if (step % 4 != 0) continue;
    for (const Case& one : cases()) {
      CAPTURE(one.query);
      if (one.changes) continue;
      const std::string request = "GET " + target(one) + "\n" + by("anna") + "Accept: " + one.accept + "\n";
      const Answer answer = twin.bench.ask(request);
      CHECK(answer.status == 200);
      CHECK(difference(of_robot[one.accept](robot.bench.ask(request)), of_twin[one.accept](answer)) == "");
    }
  }
  CHECK(messages > 40);
}

TEST_CASE("the name of a standing query does not count those of others", "[query][security][twins]") {
  Robot robot(true, with_endpoint()), twin(false, with_endpoint());
  const Case one = cases()[0], other = cases()[1];
  robot.ids->hidden = true;
  (void)robot.bench.open_stream(target(other), by("carl"));
  robot.ids->hidden = false;
  std::vector<std::string> lists;
  for (Robot* r : {&robot, &twin}) {
    (void)r->bench.open_stream(target(one), by("anna"));
    lists.push_back(r->bench.ask("GET /sparql/subscriptions\n" + by("anna") + "Accept: application/n-triples\n").body);
  }
  CHECK(lists[0].find("/sparql/standing-") != std::string::npos);
  CHECK(difference(lists[0], lists[1]) == "");
}

// SPDX-License-Identifier: Apache-2.0
// What all queries hold together, of all callers and under all names of a robot, has a limit in bytes.
#include <lrt/query.hpp>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <lrt/engine/query_service.hpp>
#include <lrt/rdf/graph.hpp>

#include "src/query/memory.hpp"
#include "tests/support/catch.hpp"

namespace {

using lrt::Errc;
using lrt::engine::QueryData;
using lrt::engine::QueryService;

constexpr std::size_t mebibyte = 1024 * 1024;

/// A graph of so many triples.
std::shared_ptr<const lrt::rdf::Graph> graph_of(std::size_t triples) {
  lrt::rdf::Graph graph;
  for (std::size_t i = 0; i < triples; ++i) {
    const std::string subject = "u:n" + std::to_string(i), text = std::to_string(i);
    graph.add(lrt::rdf::iri(subject), lrt::rdf::iri("u:value"), lrt::rdf::literal(text));
  }
  return std::make_shared<const lrt::rdf::Graph>(std::move(graph));
}

std::shared_ptr<QueryData> data_of(const QueryService& service, const std::shared_ptr<const lrt::rdf::Graph>& graph) {
  std::shared_ptr<QueryData> data = service.make_data();
  lrt::engine::NamedGraph named;
  named.name = "u:graph";
  named.graph = graph;
  data->change({named});
  return data;
}

lrt::Result<std::shared_ptr<const lrt::engine::QueryAnswer>> evaluate(const QueryService& service, QueryData& data, const std::string& text) {
  static const std::atomic<bool> never{false};
  const auto query = service.parse(text, "u:", {}, {});
  REQUIRE(query);
  return service.evaluate(**query, data, never, {}, std::nullopt);
}

bool names_limit(const lrt::Error& error) { return error.code == Errc::limit_exceeded && error.message.find("max_total_bytes") != std::string::npos; }

}  // namespace

TEST_CASE("the graphs of all callers and names have one limit in bytes", "[query]") {
  lrt::query::EndpointOptions options;
  options.max_total_bytes = 8 * mebibyte;
  const auto service = lrt::query::endpoint(options);
  const auto graph = graph_of(10'000);
  std::vector<std::shared_ptr<QueryData>> names;
  std::size_t refused = 0;
  for (int i = 0; i < 16; ++i) {
    names.push_back(data_of(*service, graph));
    if (const auto answer = evaluate(*service, *names.back(), "ASK { ?s ?p ?o }"); !answer) {
      ++refused;
      CHECK(names_limit(answer.error()));
    }
  }
  CHECK(refused > 0);
  CHECK(refused < 16);
  std::printf("16 names of a robot with %zu triples, at most 8 MiB together: %zu names are served, %zu refused with the name of the limit\n",
              graph->size(), names.size() - refused, refused);
  names.erase(names.begin(), names.begin() + 12);  // nobody asks under these names any more
  CHECK(evaluate(*service, *names.front(), "ASK { ?s ?p ?o }"));
}

TEST_CASE("a query that grows ends at what all queries may hold together, and others go on", "[query]") {
  lrt::query::EndpointOptions options;
  options.max_total_bytes = 16 * mebibyte;
  options.max_solution_bytes = 1024 * mebibyte;
  options.time = std::chrono::seconds(60);
  options.max_rows = 10'000'000;
  options.max_steps = 2'000'000'000;
  const auto service = lrt::query::endpoint(options);
  const auto data = data_of(*service, graph_of(2'000));
  const auto large = evaluate(*service, *data, "SELECT ?a ?b { ?a ?p ?v . ?b ?q ?w } ORDER BY ?v ?w");
  REQUIRE_FALSE(large);
  CHECK(names_limit(large.error()));
  CHECK(evaluate(*service, *data, "ASK { ?s ?p ?o }"));

  // Answers that are kept count, too, until they are gone.
  std::vector<std::shared_ptr<const lrt::engine::QueryAnswer>> kept;
  for (int i = 0; i < 200; ++i) {
    auto answer = evaluate(*service, *data, "SELECT * { ?s ?p ?o }");
    if (!answer) {
      CHECK(names_limit(answer.error()));
      break;
    }
    kept.push_back(*std::move(answer));
  }
  CHECK(kept.size() < 200);
  CHECK_FALSE(kept.empty());
  kept.clear();
  CHECK(evaluate(*service, *data, "SELECT * { ?s ?p ?o }"));
}

TEST_CASE("shares of memory are given back", "[query]") {
  const auto memory = std::make_shared<lrt::query::Memory>(100);
  {
    lrt::query::MemoryShare one(memory), two(memory);
    CHECK(one.set(60));
    CHECK_FALSE(two.set(41));
    CHECK(two.bytes() == 0);
    CHECK(two.set(40));
    CHECK_FALSE(one.set(61));
    CHECK(one.set(10));
    const lrt::query::MemoryShare moved(std::move(one));
    CHECK(memory->used() == 50);
    CHECK_FALSE(two.set(~std::size_t{0}));
  }
  CHECK(memory->used() == 0);
}

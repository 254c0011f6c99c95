// SPDX-License-Identifier: Apache-2.0
// Large graphs whose versions share their structure, and the indexes of queries.

#include <lrt/query.hpp>

#include <atomic>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/engine/query_service.hpp>
#include <lrt/rdf/vocab.hpp>
#include <lrt/world.hpp>

#include "src/model/graph_state.hpp"
#include "src/rdf/shared_graph.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;

namespace {

const std::string name = "http://robot/world/map", base = "http://robot", placeholder = "http://lrt.invalid";

engine::NamedGraph named(std::shared_ptr<const rdf::Graph> graph, bool placed = true) {
  if (placed) return {name, std::move(graph), placeholder, base};
  return {name, std::move(graph)};
}

std::string ask(const engine::QueryService& service, engine::QueryData& data, const std::string& text) {
  const auto query = service.parse(text, base, {}, {}).value();
  const std::atomic<bool> cancelled{false};
  return service.evaluate(*query, data, cancelled, TimePoint{}, std::nullopt).value()->write(0).value();
}

const std::string counted = "SELECT (COUNT(*) AS ?n) { ?s ?p ?o }";

/// All triples, by what blank nodes cannot change.
std::string all_of(const engine::QueryService& service, engine::QueryData& data) {
  return ask(service, data, counted) + ask(service, data, "SELECT ?s ?p ?o { ?s ?p ?o FILTER(!isBlank(?s) && !isBlank(?o)) } ORDER BY ?s ?p ?o") +
         ask(service, data, "SELECT ?p (COUNT(*) AS ?n) { GRAPH ?g { ?s ?p ?o FILTER(isBlank(?s) || isBlank(?o)) } } GROUP BY ?p ORDER BY ?p");
}

}  // namespace

TEST_CASE("queries see each version of a large graph as they would see it alone", "[query][shared]") {
  query::EndpointOptions options;
  options.time = std::chrono::hours(1);
  options.max_steps = ~std::uint64_t{0};
  const auto service = query::endpoint(options);
  const auto state = [] {
    GraphOptions graph;
    graph.max_triples = 1'000'000;
    return model::GraphState::create("/world/map", graph, "http://lrt.invalid/shapes", nullptr).value();
  }();
  std::mt19937 random(3);
  const auto node = [&] {
    const auto n = random() % 900;
    const std::string number = std::to_string(n);
    if (n % 7 == 0) return rdf::Term(rdf::blank("n" + number));
    if (n % 7 == 1) return rdf::Term(rdf::iri(base + "/things/" + std::to_string(n / 14)));  // two terms that are one when they are placed
    if (n % 7 == 2) return rdf::Term(rdf::iri(placeholder + "/things/" + std::to_string(n / 14)));
    return rdf::Term(rdf::iri("#n" + number));
  };
  const auto predicate = [&] { return rdf::Term(rdf::iri("http://e/p" + std::to_string(random() % 9))); };
  const auto object = [&] { return random() % 2 ? node() : rdf::Term(rdf::literal(std::to_string(random() % 200), vocab::xsd::integer)); };
  const auto add_some = [&](model::GraphEdit& edit, int n) {
    for (int i = 0; i < n; ++i) {
      const rdf::Term s = node(), p = predicate(), o = object();
      edit.add(s.view(), p.view(), o.view());
    }
  };
  state->update([&](model::GraphEdit& edit) { add_some(edit, 6'000); }).value();
  REQUIRE(rdf::SharedGraph::in(*state->version().graph));
  const std::shared_ptr<engine::QueryData> data = service->make_data();
  for (int round = 0; round < 8; ++round) {
    data->change({named(state->version().graph)});
    const std::shared_ptr<engine::QueryData> alone = service->make_data();
    alone->change({named(std::make_shared<const rdf::Graph>([&] {
      rdf::Graph plain;
      plain.merge(*state->version().graph);
      return plain;
    }()))});
    REQUIRE(all_of(*service, *data) == all_of(*service, *alone));
    for (int writes = 0; writes < 3; ++writes)
      state
          ->update([&](model::GraphEdit& edit) {
            add_some(edit, 20);
            for (int i = 0; i < 30; ++i) {
              const rdf::Term s = node(), p = predicate();
              const rdf::TermView sv = s.view(), pv = p.view();
              edit.remove(&sv, &pv, nullptr);
            }
            if (round == 5 && writes == 1) edit.clear(), add_some(edit, 5'000);
          })
          .value();
  }
}

TEST_CASE("a query keeps its moment while a large graph changes", "[query][shared]") {
  const auto service = query::endpoint();
  const auto state = model::GraphState::create("/world/map", {}, "http://lrt.invalid/shapes", nullptr).value();
  const auto add = [&](int from, int to) {
    state
        ->update([&](model::GraphEdit& edit) {
          for (int i = from; i < to; ++i) edit.add(rdf::iri("#n" + std::to_string(i)), rdf::iri("http://e/p"), edit.term_of(i));
        })
        .value();
  };
  add(0, 5'000);
  const std::shared_ptr<const rdf::Graph> first = state->version().graph;
  const std::shared_ptr<engine::QueryData> data = service->make_data(), old = service->make_data();
  data->change({named(first, false)});
  const std::string before = ask(*service, *data, counted);
  add(5'000, 5'010);
  data->change({named(state->version().graph, false)});
  old->change({named(first, false)});
  CHECK(ask(*service, *data, counted) != before);
  CHECK(ask(*service, *old, counted) == before);
  data->change({named(first, false)});  // back again
  CHECK(ask(*service, *data, counted) == before);
  data->change({{name, nullptr}});
  CHECK(ask(*service, *data, counted).find("\"0\"") != std::string::npos);
}

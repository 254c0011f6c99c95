// SPDX-License-Identifier: Apache-2.0
// CPU times of lrt::query.   query_bench [Things, default 10000]

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <lrt/rdf/graph.hpp>
#include <lrt/rdf/vocab.hpp>

#include "src/query/dataset.hpp"
#include "src/query/evaluate.hpp"
#include "src/query/parser.hpp"
#include "tests/bench/cpu.hpp"

namespace {

using lrt::query::Dataset;
using lrt::rdf::Graph;

const std::string ns = "http://example.org/robot#";

lrt::rdf::TermView ex(std::string& memory, const std::string& name) {
  memory = ns + name;
  return lrt::rdf::iri(memory);
}

void add(Graph& graph, const std::string& subject, const std::string& predicate, const std::string& object) {
  std::string s, p, o;
  graph.add(ex(s, subject), ex(p, predicate), ex(o, object));
}

void add_number(Graph& graph, const std::string& subject, const std::string& predicate, double value) {
  std::string s, p;
  const std::string text = std::to_string(value);
  graph.add(ex(s, subject), ex(p, predicate), lrt::rdf::literal(text, lrt::vocab::xsd::double_));
}

/// 15 triples in two graphs: what a joint is, and where it stands.
Graph description(std::size_t i, bool is_joint) {
  const std::string self = "joint" + std::to_string(i), limit = "limit" + std::to_string(i);
  Graph graph;
  std::string s, o;
  graph.add(ex(s, self), lrt::vocab::rdf_::type, ex(o, is_joint ? "Joint" : "Part"));
  add(graph, self, "partOf", "arm" + std::to_string(i / 7));
  add(graph, self, "next", "joint" + std::to_string(i + 1));
  add(graph, self, "limit", limit);
  add_number(graph, limit, "max", 1 + static_cast<double>(i % 10));
  add_number(graph, limit, "min", -1);
  add(graph, limit, "unit", "radian");
  for (int k = 0; k < 4; ++k) add(graph, self, "ability" + std::to_string(k), "ability" + std::to_string(i % 20));
  return graph;
}

Graph state(std::size_t i, std::size_t time) {
  const std::string self = "joint" + std::to_string(i);
  Graph graph;
  add_number(graph, self, "position", static_cast<double>((i * 7 + time) % 1000) / 100);
  add_number(graph, self, "velocity", static_cast<double>(time % 17));
  add(graph, self, "mode", "holding");
  add(graph, self, "status", "good");
  return graph;
}

Dataset world(std::size_t things, std::size_t joints) {
  Dataset data;
  for (std::size_t i = 0; i < things; ++i) {
    data.put(ns + "things/" + std::to_string(i), description(i, i < joints));
    data.put(ns + "things/" + std::to_string(i) + "/state", state(i, 0));
  }
  return data;
}

template <class F>
double median_us(std::size_t repeats, F&& f) {
  std::vector<double> times;
  for (int round = 0; round < 9; ++round) {
    const double start = bench::cpu_microseconds(0);
    for (std::size_t i = 0; i < repeats; ++i) f();
    times.push_back((bench::cpu_microseconds(0) - start) / static_cast<double>(repeats));
  }
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

void time_query(const Dataset& data, const char* name, const std::string& text, std::size_t repeats) {
  auto query = lrt::query::parse("PREFIX : <" + ns + "> " + text, {});
  if (!query) std::fprintf(stderr, "%s: %s\n", name, query.error().message.c_str()), std::exit(1);
  const std::atomic<bool> cancelled{false};
  std::size_t rows = 0;
  const double us = median_us(repeats, [&] {
    auto answer = lrt::query::evaluate(**query, data, {}, cancelled, std::chrono::system_clock::now());
    if (!answer) std::fprintf(stderr, "%s: %s\n", name, answer.error().message.c_str()), std::exit(1);
    rows = std::get<lrt::query::Table>(*answer).rows();
  });
  std::printf("  %-44s %10.1f us, %zu rows\n", name, us, rows);
}

void time_world(const Dataset& data, std::size_t repeats) {
  std::printf("%zu triples in %zu graphs, %zu KiB\n", data.triple_count(), data.graph_count(), data.bytes() / 1024);
  time_query(data, "joints near a limit", "SELECT ?joint ?p ?max { ?joint a :Joint ; :position ?p ; :limit [ :max ?max ] FILTER(?p > 0.95 * ?max) }",
             repeats);
  time_query(data, "the same with OPTIONAL and ORDER BY",
             "SELECT ?joint ?p ?max ?n { ?joint a :Joint ; :position ?p ; :limit [ :max ?max ] OPTIONAL { ?joint :next ?n . ?n "
             ":velocity 3.0 } "
             "FILTER(?p > 0.95 * ?max) } ORDER BY DESC(?p)",
             repeats);
  time_query(data, "the highest position of each arm",
             "SELECT ?arm (MAX(?p) AS ?top) { ?joint :partOf ?arm ; :position ?p } GROUP BY ?arm ORDER BY DESC(?top) LIMIT 10", repeats);
  time_query(data, "what follows a joint (path)", "SELECT (COUNT(?n) AS ?count) { :joint0 :next+ ?n }", 1);
  time_query(data, "the graphs that say something of a joint", "SELECT ?g { GRAPH ?g { :joint7 ?p ?o } }", repeats * 20);
  time_query(data, "ASK-like, LIMIT 1", "SELECT ?j { ?j a :Joint ; :position ?p FILTER(?p > 5) } LIMIT 1", repeats * 20);
}

}  // namespace

int main(int argc, char** argv) {
  const std::size_t things = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 10'000;
  time_world(world(133, 50), 300);
  Dataset data = world(things, things);
  time_world(data, 5);
  std::size_t time = 1;
  std::vector<Graph> states;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < 500; ++i) names.push_back(ns + "things/" + std::to_string(i) + "/state");
  const double update = median_us(20, [&] {
    ++time;
    states.clear();
    for (std::size_t i = 0; i < 500; ++i) states.push_back(state(i, time));
  });
  const double with_put = median_us(20, [&] {
    ++time;
    states.clear();
    for (std::size_t i = 0; i < 500; ++i) states.push_back(state(i, time));
    for (std::size_t i = 0; i < 500; ++i) data.put(names[i], states[i]);
  });
  std::printf("  %-44s %10.1f us\n", "500 states changed", with_put - update);
  std::printf("  %-44s %10.1f us\n", "a copy", median_us(3, [&] { const Dataset copy = data; }));
}

// SPDX-License-Identifier: Apache-2.0
// A large graph of a World: bulk load, one write, the next query, a standing query, memory.   world_bench [triples, default 1000000]

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/query.hpp>
#include <lrt/rdf/vocab.hpp>
#include <lrt/served.hpp>
#include <lrt/server.hpp>
#include <lrt/transport/loopback.hpp>
#include <lrt/world.hpp>

#include "tests/bench/cpu.hpp"
#include "tests/support/message.hpp"

namespace {

using Steady = std::chrono::steady_clock;
using namespace lrt;

const std::string ns = "http://example.org/world#";

double ms_since(Steady::time_point begin) { return std::chrono::duration<double, std::milli>(Steady::now() - begin).count(); }

std::size_t memory_mb() {
  std::FILE* const file = std::fopen("/proc/self/statm", "r");
  unsigned long all = 0, resident = 0;
  if (!file || std::fscanf(file, "%lu %lu", &all, &resident) != 2) resident = 0;
  if (file) std::fclose(file);
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)) / 1024 / 1024;
}

/// Objects with ten triples each: a class, a place, numbers.
rdf::Graph content(std::size_t triples) {
  rdf::Graph graph;
  for (std::size_t i = 0; graph.size() < triples; ++i) {
    const std::string self = "http://lrt.invalid/world/map#o" + std::to_string(i), type = ns + "Class" + std::to_string(i % 50),
                      room = ns + "room" + std::to_string(i % 1'000);
    graph.add(rdf::iri(self), vocab::rdf_::type, rdf::iri(type));
    graph.add(rdf::iri(self), rdf::iri(ns + "in"), rdf::iri(room));
    graph.add(rdf::iri(self), vocab::rdfs::label, rdf::literal("object " + std::to_string(i)));
    for (int k = 0; k < 7; ++k)
      graph.add(rdf::iri(self), rdf::iri(ns + "p" + std::to_string(k)),
                rdf::literal(std::to_string((i * 31 + k) % 100'000) + ".5", vocab::xsd::double_));
  }
  return graph;
}

Served serve(Server& server, const std::string& text, bool can_stream = false) {
  test::RequestText request(text + "\nHost: localhost:4711");
  request.get().local_port = 4711;
  request.get().can_stream = can_stream;
  return server.serve(request.get());
}

/// @return  how long it took, ms
double ask(Server& server, const std::string& percent_encoded) {
  const auto begin = Steady::now();
  const Served served = serve(server, "GET /sparql?query=" + percent_encoded);
  if (served.response.status != 200)
    std::printf("  a query got %d %s\n", served.response.status, served.response.body ? served.response.body->c_str() : "");
  return ms_since(begin);
}

void print(const char* what, std::vector<double> times) {
  std::sort(times.begin(), times.end());
  std::printf("%-64s median %8.3f ms  longest %8.3f ms\n", what, times[times.size() / 2], times.back());
}

}  // namespace

int main(int argc, char** argv) {
  const std::size_t triples = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 1'000'000;
  Options options;
  options.listen.port = 0;
  options.listen.transport = transport::no_network;
  options.threads.io = Io::own_thread;
  query::EndpointOptions limits;
  limits.max_triples = 4 * triples;
  limits.max_total_bytes = std::size_t{8} << 30;
  limits.time = std::chrono::seconds(60);
  limits.max_steps = 2'000'000'000;
  limits.min_interval = std::chrono::milliseconds(1);
  options.query = query::endpoint(limits);
  Server server = Server::create(std::move(options)).value();
  World world("world");
  GraphOptions large;
  large.max_triples = 2 * triples;
  large.max_bytes = std::size_t{4} << 30;
  WorldGraph map = world.graph("map", large);
  server.add(std::move(world)).value();

  std::size_t before = memory_mb();
  {
    const rdf::Graph graph = content(triples);
    std::printf("%-64s %zu MB\n", "memory of a plain graph with these triples", memory_mb() - before);
    const auto begin = Steady::now();
    map.update([&](GraphUpdate& u) { u.add(graph); }).value();
    std::printf("%-64s %8.1f ms\n", "bulk load: all triples by one update", ms_since(begin));
  }
  const std::size_t with_graph = memory_mb();
  std::printf("%-64s %zu MB\n", "memory of the World", with_graph - before);

  int number = 0;
  const auto write = [&] {
    ++number;
    const auto begin = Steady::now();
    map.update([&](GraphUpdate& u) { u.set("#o" + std::to_string(number * 37), Iri(std::string_view("http://example.org/world#p3")), number); })
        .value();
    return ms_since(begin);
  };
  std::vector<double> times;
  for (int i = 0; i < 41; ++i) times.push_back(write());
  print("a write: one value of one object is set (41 times)", times);
  times.clear();
  for (int i = 0; i < 41; ++i) {
    const auto begin = Steady::now();
    const std::string fresh = "#new" + std::to_string(i);
    map.update([&](GraphUpdate& u) { u.add(fresh, vocab::rdfs::label, "a new object"); }).value();
    times.push_back(ms_since(begin));
  }
  print("a write: one triple is added (41 times)", times);

  const std::string one =
      "SELECT%20%3Fx%20WHERE%20%7B%20%3Fx%20%3Chttp%3A%2F%2Fexample.org%2Fworld%23in%3E%20%3Chttp%3A%2F%2Fexample.org%2Fworld%23room7%3E%20%7D";
  std::printf("%-64s %8.1f ms\n", "the first query", ask(server, one));
  std::printf("%-64s %zu MB\n", "memory of the World with the indexes of queries", memory_mb() - before);
  times.clear();
  for (int i = 0; i < 41; ++i) times.push_back(ask(server, one));
  print("a query of 100 objects, without a change", times);
  times.clear();
  for (int i = 0; i < 11; ++i) {
    write();
    times.push_back(ask(server, one));
  }
  print("the query after a write (11 times)", times);
  std::printf("%-64s %zu MB\n", "memory then", memory_mb() - before);

  for (const bool concerned : {false, true}) {
    const std::string predicate = concerned ? "p3" : "in";
    Served stream = serve(server,
                          "GET "
                          "/sparql?query=SELECT%20%3Fv%20WHERE%20%7B%20%3Chttp%3A%2F%2Flocalhost%3A4711%2Fworld%2Fmap%23o37%3E%20%3Chttp%3A%2F%"
                          "2Fexample.org%2Fworld%23" +
                              predicate + "%3E%20%3Fv%20%7D\nAccept: text/event-stream",
                          true);
    if (!stream.events) {
      std::printf("the subscription got %d %s\n", stream.response.status, stream.response.body ? stream.response.body->c_str() : "");
      return 1;
    }
    (void)stream.events->next(std::chrono::seconds(30));
    const double cpu = bench::cpu_microseconds(0);
    const auto begin = Steady::now();
    for (int i = 0; i < 41; ++i) {
      write();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    // The last write is seen.
    map.update([&](GraphUpdate& u) {
         u.set("#o37", concerned ? Iri(std::string_view("http://example.org/world#p3")) : Iri(std::string_view("http://example.org/world#in")), 4711);
       })
        .value();
    for (;;) {
      const EventSource::Event event = stream.events->next(std::chrono::seconds(60));
      if (event.end || !event.bytes || event.bytes->find("4711") != std::string::npos) break;
    }
    std::printf("%-64s %8.1f ms of CPU, %8.1f ms\n",
                concerned ? "a standing query over 42 writes that it depends on" : "a standing query over 41 other writes and one",
                (bench::cpu_microseconds(0) - cpu) / 1e3, ms_since(begin));
  }
  server.stop();
  return 0;
}

// SPDX-License-Identifier: Apache-2.0
// A host with a model of Redland, for tests of programs.
//
//   redland_host serve FILE --port N     its model is in FILE (SQLite); it counts in it, 100 times a second, and clients may write it
//   redland_host times STORAGE COUNT     a line of Markdown for docs/redland.md: a model with COUNT statements, 100 writes of a client, 100 changes of the host
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include "tests/redland/host.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

volatile std::sig_atomic_t ended = 0;
void on_signal(int) { ended = 1; }

int serve(const std::string& file, int port) {
  librdf_world* const redland = librdf_new_world();
  librdf_world_open(redland);
  librdf_storage* const storage = librdf_new_storage(redland, "sqlite", file.c_str(), std::filesystem::exists(file) ? "" : "new='yes'");
  if (!storage) return std::fprintf(stderr, "no storage on SQLite: vendor/install.sh librdf\n"), 1;
  librdf_model* const model = librdf_new_model(redland, storage, nullptr);
  const auto node = [&](const char* text) { return librdf_new_node_from_uri_string(redland, reinterpret_cast<const unsigned char*>(text)); };
  const auto count = [&](int n) {
    const std::string text = std::to_string(n);
    librdf_model_transaction_start(model);
    for (const char* name : {"urn:host1", "urn:host2"}) {
      librdf_node *const s = node(name), *const p = node("urn:p");
      librdf_node* const old = librdf_model_get_target(model, s, p);
      if (old) {
        librdf_statement* const gone = librdf_new_statement_from_nodes(redland, node(name), node("urn:p"), old);
        librdf_model_remove_statement(model, gone);
        librdf_free_statement(gone);
      }
      librdf_model_add(model, s, p, librdf_new_node_from_literal(redland, reinterpret_cast<const unsigned char*>(text.c_str()), nullptr, 0));
    }
    librdf_model_transaction_commit(model);
  };
  {
    Options options;
    options.listen.port = static_cast<std::uint16_t>(port);
    GraphOptions graph;
    graph.clients_may_write = true;
    Server server = Server::create(options).value();
    World world("world");
    redland::Model shown = redland::Model::attach(world, "tasks", model, {}, graph).value();
    server.add(std::move(world)).value();
    std::printf("listening on http://127.0.0.1:%d/\n", static_cast<int>(server.port()));
    std::fflush(stdout);
    for (int turn = 0; ended == 0; ++turn) {
      if (turn % 20 == 0 && !std::getenv("LRT_FULL_DISK")) count(turn), shown.changed();  // on a full disk only clients write
      server.poll();
      std::this_thread::sleep_for(std::chrono::microseconds(500));
    }
  }
  librdf_free_model(model);
  librdf_free_storage(storage);
  librdf_free_world(redland);
  return 0;
}

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

long resident_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.compare(0, 6, "VmRSS:") == 0) return std::atol(line.c_str() + 6) / 1024;
  return 0;
}

/// Of the whole process: what else the machine does, counts little.
struct Took {
  double wall = 0, cpu = 0;
};
template <class F>
Took measure(F work) {
  const Clock::time_point begin = Clock::now();
  const std::clock_t cpu = std::clock();
  work();
  return {seconds_since(begin), static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC};
}

int times(const std::string& name, int count) {
  const StorageKind* kind = nullptr;
  for (const StorageKind& one : all_storages)
    if (one.name == name) kind = &one;
  if (!kind) return std::fprintf(stderr, "unknown storage %s\n", name.c_str()), 2;
  const StorageKind synced = kind->has_transactions ? sqlite_file : *kind;
  const long at_begin = resident_mb();
  Stranger stranger(synced);
  const Took load = measure([&] {
    librdf_model_transaction_start(stranger.model());
    for (int i = 0; i < count; ++i) stranger.add("urn:s" + std::to_string(i / 10), "urn:p" + std::to_string(i % 10), "value " + std::to_string(i));
    librdf_model_transaction_commit(stranger.model());
  });
  const long of_model = resident_mb();
  std::optional<Host> host;
  const Took attach = measure([&] {
    host.emplace(stranger, [&](Options&, GraphOptions& graph, redland::Options& how) {
      graph.max_triples = 1'000'000;
      how.allows_partial_writes = true;
      how.write_timeout = std::chrono::seconds(30);
    });
  });
  const long attached = resident_mb();
  const Took get = measure([&] { (void)host->get(); });
  std::string rows;
  const Took query = measure([&] { rows = host->query("SELECT (COUNT(*) AS ?n) { GRAPH ?g { ?s <urn:p3> ?o } }"); });
  if (rows != "n\r\n" + std::to_string(count / 10) + "\r\n") return std::fprintf(stderr, "the query returns %s\n", rows.c_str()), 1;
  int refused = 0;
  const Took writes = measure([&] {
    for (int i = 0; i < 100; ++i) refused += host->patch("INSERT DATA { <urn:w" + std::to_string(i) + "> <urn:p3> 1 }").status == 204 ? 0 : 1;
  });
  const Took changes = measure([&] {
    for (int i = 0; i < 100; ++i) {
      stranger.add("urn:h" + std::to_string(i), "urn:p3", "1");
      host->changed();
    }
  });
  if (refused != 0 || host->model->graph().snapshot()->size() != static_cast<std::size_t>(count) + 200)
    return std::fprintf(stderr, "%d writes were refused\n", refused), 1;
  std::printf("| %s, %d | %.2f s | %.0f ms | %.0f ms | %.0f ms | %.1f ms; %.1f ms | %.1f ms; %.1f ms | %.1f ms; %.1f ms | %ld; %ld MB |\n",
              name.c_str(), count, load.wall, attach.cpu * 1e3, get.cpu * 1e3, query.cpu * 1e3, writes.cpu * 10, writes.wall * 10, changes.cpu * 10,
              changes.wall * 10, host->longest_poll * 1e3, static_cast<double>(host->model->counters().longest_step.count()) / 1e3,
              of_model - at_begin, attached - of_model);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  if (what == "times" && argc == 4) return times(argv[2], std::atoi(argv[3]));
  if (what == "serve" && argc == 5 && std::string_view(argv[3]) == "--port") return serve(argv[2], std::atoi(argv[4]));
  return std::fprintf(stderr, "usage: redland_host serve FILE --port N | times STORAGE COUNT\n"), 2;
}

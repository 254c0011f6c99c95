// SPDX-License-Identifier: Apache-2.0
// A host with a model of Redland, for tests of programs.
//
//   redland_host serve FILE --port N     its model is in FILE (SQLite); it counts in it, 100 times a second, and clients may write it
//   redland_host times STORAGE COUNT     a line of Markdown: times of a model with COUNT statements
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
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
      if (turn % 20 == 0) count(turn), shown.changed();
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

int times(const std::string& name, int count) {
  const StorageKind* kind = nullptr;
  for (const StorageKind& one : all_storages)
    if (one.name == name) kind = &one;
  if (!kind) return std::fprintf(stderr, "unknown storage %s\n", name.c_str()), 2;
  StorageKind synced = *kind;
  if (kind->has_transactions) synced.options = "new='yes'";
  const long at_begin = resident_mb();
  Stranger stranger(synced);
  Clock::time_point begin = Clock::now();
  librdf_model_transaction_start(stranger.model());
  for (int i = 0; i < count; ++i) stranger.add("urn:s" + std::to_string(i / 10), "urn:p" + std::to_string(i % 10), "value " + std::to_string(i));
  librdf_model_transaction_commit(stranger.model());
  const double load = seconds_since(begin);
  const long of_model = resident_mb();
  begin = Clock::now();
  Host host(stranger, [&](Options&, GraphOptions& graph, redland::Options& how) {
    graph.max_triples = 1'000'000;
    how.allows_partial_writes = true;
  });
  const double attach = seconds_since(begin);
  const long attached = resident_mb();
  begin = Clock::now();
  const std::size_t bytes = host.get().body.size();
  const double get = seconds_since(begin);
  begin = Clock::now();
  const std::string rows = host.query("SELECT (COUNT(*) AS ?n) { GRAPH ?g { ?s <urn:p3> ?o } }");
  const double query = seconds_since(begin);
  begin = Clock::now();
  for (int i = 0; i < 100; ++i)
    if (const Answer answer = host.patch("INSERT DATA { <urn:w" + std::to_string(i) + "> <urn:p3> 1 }"); answer.status != 204)
      return std::fprintf(stderr, "%d %s\n", answer.status, answer.body.c_str()), 1;
  const double writes = seconds_since(begin);
  begin = Clock::now();
  double most = 0;
  for (int i = 0; i < 100; ++i) {
    stranger.add("urn:h" + std::to_string(i), "urn:p3", "1");
    const Clock::time_point before = Clock::now();
    host.changed();
    most = std::max(most, seconds_since(before));
  }
  const double changes = seconds_since(begin);
  const redland::Counters counters = host.model->counters();
  std::printf(
      "| %s, %d | %.2f s | %.2f s | %.0f ms (%zu kB) | %.0f ms | %.1f ms each | %.1f ms each, at most %.0f | %.1f ms of CPU, %.1f ms | %ld, %ld MB "
      "|\n",
      name.c_str(), count, load, attach, get * 1e3, bytes / 1000, query * 1e3, writes * 10, changes * 10, most * 1e3, host.longest_poll * 1e3,
      static_cast<double>(counters.longest_step.count()) / 1e3, of_model - at_begin, attached - of_model);
  if (rows != "n\r\n" + std::to_string(count / 10) + "\r\n") return std::fprintf(stderr, "the query returns %s\n", rows.c_str()), 1;
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

// SPDX-License-Identifier: Apache-2.0
// A robot with a World whose graph is kept in a file, to be killed and to run out of disk.
//
//   kept_world FILE TRIPLES [--port N] [--transport NAME] [--measure]
//
// TRIPLES: of the graph at first. Prints its URL. Code updates the graph 100 times a second (`<#host> <p:is> COUNT`), and prints nothing of it.
// --measure: instead writes one triple, and prints how long that took, how long it was until the robot had ended with it on the disk, and how many bytes
// were written for it.
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include <lrt/lrt.hpp>
#include <lrt/transport/named.hpp>

namespace {

using Clock = std::chrono::steady_clock;

volatile std::sig_atomic_t ends = 0;

double milliseconds_since(Clock::time_point start) { return std::chrono::duration<double, std::milli>(Clock::now() - start).count(); }

/// Bytes that this process has written.
long long written() {
  long long bytes = 0;
  if (std::FILE* const file = std::fopen("/proc/self/io", "r")) {
    if (std::fscanf(file, "rchar: %*d wchar: %lld", &bytes) != 1) bytes = 0;
    (void)std::fclose(file);
  }
  return bytes;
}

void measure(lrt::WorldGraph map, lrt::Server server) {
  const long long before = written();
  const Clock::time_point start = Clock::now();
  map.update([&](lrt::GraphUpdate& u) { u.add("#new", lrt::vocab::rdfs::label, std::to_string(start.time_since_epoch().count())); }).value();
  const double updated = milliseconds_since(start);
  { const lrt::Server ends_here = std::move(server); }
  std::printf("one triple: update() %.1f ms, on the disk after %.1f ms, %lld bytes written\n", updated, milliseconds_since(start),
              written() - before);
}

}  // namespace

int main(int count, char** given) {
  if (count < 3) return 2;
  const std::string file = given[1];
  const long triples = std::atol(given[2]);
  bool measures = false;
  lrt::Options options;
  options.listen.port = 0;
  for (int i = 3; i < count; ++i) {
    const std::string_view arg = given[i];
    if (arg == "--measure") measures = true;
    else if (arg == "--port" && i + 1 < count) options.listen.port = static_cast<std::uint16_t>(std::atoi(given[++i]));
    else if (arg == "--transport" && i + 1 < count)
      options.listen.transport = [name = std::string(given[++i])](lrt::transport::TransportOptions t) {
        return lrt::transport::make_named(name, std::move(t));
      };
    else return 2;
  }
  options.log = [](lrt::LogLevel, std::string_view line) { std::fprintf(stderr, "%.*s\n", static_cast<int>(line.size()), line.data()); };
  lrt::Server server = lrt::Server::create(std::move(options)).value();
  server.add(lrt::server_thing(server)).value();
  lrt::World world("world");
  lrt::GraphOptions kept;
  kept.file = file;
  kept.clients_may_write = true;
  kept.max_triples = 4'000'000;
  kept.max_bytes = 1024 * 1024 * 1024;
  lrt::WorldGraph map = world.graph("map", std::move(kept));
  const lrt::Result<void> added = server.add(std::move(world));
  if (!added) {
    std::fprintf(stderr, "%s\n", added.error().message.c_str());
    return 1;
  }
  if (triples > 0 && map.snapshot()->empty()) {
    map.update([&](lrt::GraphUpdate& u) {
         for (long i = 0; i < triples; ++i) u.add("#n" + std::to_string(i), lrt::vocab::rdfs::label, i);
       })
        .value();
    while (map.unsaved_changes() > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  if (measures) {
    measure(map, std::move(server));
    return 0;
  }
  std::signal(SIGTERM, [](int) { ends = 1; });
  server.start();
  std::printf("http://127.0.0.1:%u/\n", unsigned{server.port()});
  std::fflush(stdout);
  for (int i = 0; ends == 0; ++i) {
    if (triples == 0) (void)map.update([&](lrt::GraphUpdate& u) { u.set("#host", lrt::Iri("p:is"), i); });
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return 0;
}

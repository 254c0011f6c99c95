// SPDX-License-Identifier: Apache-2.0
// One client and many robots; and the way of a value from one robot to another.
//
//   client_bench [--robots 100] [--seconds 5] [--json]
//
// robots: a process with so many servers (each with its thread), each of which publishes a property at 10 Hz. A client in another process watches
// each by WebSocket. CPU time and resident memory are of the whole process, divided by the robots.
// latency: robot A publishes the time at 1 kHz. Robot B, another process, follows it with Latest and has a loop at 1 kHz, which publishes what it takes.
// "received": until the client of B has the message; "taken": until the loop of B has the value, which is up to a period later.

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <lrt/client/latest.hpp>
#include <lrt/lrt.hpp>
#include <lrt/rdf/lexical.hpp>

#include "src/client/watches.hpp"
#include "tests/bench/cpu.hpp"

namespace {

using namespace lrt;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using SteadyClock = std::chrono::steady_clock;

std::int64_t now_ns() { return std::chrono::duration_cast<nanoseconds>(SteadyClock::now().time_since_epoch()).count(); }

double resident_kib(int pid) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  for (std::string line; std::getline(status, line);)
    if (line.rfind("VmRSS:", 0) == 0) return std::atof(line.c_str() + 6);
  return 0;
}

struct Robot {
  explicit Robot() {
    Options options;
    options.listen.port = 0;
    server = std::make_unique<Server>(Server::create(std::move(options)).value());
    Thing thing("arm");
    value = thing.property<std::int64_t>("value");
    server->add(std::move(thing)).value();
    value.publish(0);
  }
  std::unique_ptr<Server> server;
  PushedProperty<std::int64_t> value;
};

/// In a process of its own: robots that publish the time with this period. Writes their ports, and the memory that it had before them.
[[noreturn]] void serve(std::size_t count, microseconds period, int out) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const double before = resident_kib(::getpid());
  std::vector<Robot> robots(count);
  std::vector<std::uint16_t> ports;
  for (const Robot& robot : robots) ports.push_back(robot.server->port());
  if (::write(out, &before, sizeof before) != sizeof before) ::_exit(1);
  const auto bytes = static_cast<ssize_t>(ports.size() * sizeof ports[0]);
  if (::write(out, ports.data(), static_cast<std::size_t>(bytes)) != bytes) ::_exit(1);
  for (auto next = SteadyClock::now();; next += period) {
    std::this_thread::sleep_until(next);
    for (Robot& robot : robots) robot.value.publish(now_ns());
  }
}

struct Process {
  Process(std::size_t count, microseconds period) : ports(count) {
    int ends[2];
    if (::pipe(ends) != 0) std::exit(1);
    pid = ::fork();
    if (pid == 0) serve(count, period, ends[1]);
    const auto read = [&](void* to, std::size_t size) {
      for (std::size_t at = 0; at < size;) {
        const auto got = ::read(ends[0], static_cast<char*>(to) + at, size - at);
        if (got <= 0) std::exit(1);
        at += static_cast<std::size_t>(got);
      }
    };
    read(&memory_before, sizeof memory_before);
    read(ports.data(), ports.size() * sizeof ports[0]);
  }
  ~Process() {
    ::kill(pid, SIGKILL);
    ::waitpid(pid, nullptr, 0);
  }
  std::string url(std::size_t i) const { return "http://127.0.0.1:" + std::to_string(ports[i]) + "/arm/value"; }

  pid_t pid = 0;
  double memory_before = 0;
  std::vector<std::uint16_t> ports;
};

double part(std::vector<double>& sorted, double share) {
  if (sorted.empty()) return 0;
  std::sort(sorted.begin(), sorted.end());
  return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
}

Result<std::int64_t> decode(const client::Change& change) {
  Result<rdf::Graph> graph = change.graph();
  if (!graph) return unexpected(std::move(graph).error());
  const auto value = graph->object(rdf::iri(change.url), vocab::vom::numericalValue);
  if (!value) return unexpected(Errc::expected_value, "no number");
  return static_cast<std::int64_t>(std::strtoll(std::string(value->text).c_str(), nullptr, 10));
}

struct Figures {
  double messages = 0, server_cpu = 0, client_cpu = 0, server_memory = 0, client_memory = 0;
};

Figures many_robots(std::size_t count, int seconds) {
  const Process robots(count, milliseconds(100));
  const double before = resident_kib(::getpid());
  client::Options options;
  options.callbacks = client::Callbacks::in_background;
  client::Watches watches(client::HttpClient::create(options).value());
  client::WatchOptions by_websocket;
  by_websocket.via = client::Via::websocket;
  std::atomic<std::uint64_t> messages{0};
  std::vector<client::Watch> handles;
  for (std::size_t i = 0; i < count; ++i)
    handles.push_back(watches.watch(robots.url(i), by_websocket, [&](const client::Change&) { ++messages; }).value());
  while (!std::all_of(handles.begin(), handles.end(), [](const client::Watch& watch) { return watch.counts().values > 0; }))
    std::this_thread::sleep_for(milliseconds(10));
  std::this_thread::sleep_for(milliseconds(500));
  const double server = bench::cpu_microseconds(robots.pid), own = bench::cpu_microseconds(::getpid());
  const std::uint64_t received = messages;
  const auto begin = SteadyClock::now();
  std::this_thread::sleep_for(std::chrono::seconds(seconds));
  const double time = std::chrono::duration<double>(SteadyClock::now() - begin).count(), n = static_cast<double>(count);
  return {static_cast<double>(messages - received) / time, (bench::cpu_microseconds(robots.pid) - server) / time / n,
          (bench::cpu_microseconds(::getpid()) - own) / time / n, (resident_kib(robots.pid) - robots.memory_before) / n,
          (resident_kib(::getpid()) - before) / n};
}

void follow(int seconds, std::vector<double>& received, std::vector<double>& taken) {
  const Process a(1, milliseconds(1));
  Robot b;
  client::Watches watches(client::HttpClient::create({}).value());
  client::WatchOptions by_websocket;
  by_websocket.via = client::Via::websocket;
  std::atomic<std::int64_t> since{0};
  auto latest =
      client::Latest<std::int64_t>::follow(
          [&](client::OnChange on_change) { return watches.watch(a.url(0), by_websocket, std::move(on_change), client::Watches::Delivery::at_once); },
          [&](const client::Change& change) {
            Result<std::int64_t> value = decode(change);
            if (value && since != 0) received.push_back(static_cast<double>(now_ns() - *value) / 1e3);
            return value;
          })
          .value();
  received.reserve(100'000);
  taken.reserve(100'000);
  const auto begin = SteadyClock::now();
  std::int64_t value = 0;
  for (auto next = begin; next < begin + std::chrono::seconds(seconds + 1); next += milliseconds(1)) {
    std::this_thread::sleep_until(next);
    if (next > begin + std::chrono::seconds(1)) since = 1;
    if (!latest.take(value)) continue;
    b.value.publish(value);
    if (since != 0) taken.push_back(static_cast<double>(now_ns() - value) / 1e3);
  }
  latest.stop();
}

}  // namespace

int main(int argc, char** argv) {
  std::size_t robots = 100;
  int seconds = 5;
  bool json = false;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--json") == 0) json = true;
    else if (i + 1 < argc && std::strcmp(argv[i], "--robots") == 0) robots = static_cast<std::size_t>(std::atoi(argv[++i]));
    else if (i + 1 < argc && std::strcmp(argv[i], "--seconds") == 0) seconds = std::atoi(argv[++i]);
  }
  const Figures many = many_robots(robots, seconds);
  std::vector<double> received, taken;
  follow(seconds, received, taken);
  const double p50 = part(received, 0.5), p99 = part(received, 0.99), taken_p50 = part(taken, 0.5), taken_p99 = part(taken, 0.99);
  if (json) {
    std::printf(
        "{\"robots\": %zu, \"messages_per_second\": %.0f, \"server_cpu_us\": %.0f, \"client_cpu_us\": %.0f, \"server_kib\": %.0f, \"client_kib\": "
        "%.1f, "
        "\"received_p50_us\": %.0f, \"received_p99_us\": %.0f, \"taken_p50_us\": %.0f, \"taken_p99_us\": %.0f}\n",
        robots, many.messages, many.server_cpu, many.client_cpu, many.server_memory, many.client_memory, p50, p99, taken_p50, taken_p99);
    return 0;
  }
  std::printf("%zu robots, each watched at 10 Hz: %.0f messages/s\n", robots, many.messages);
  std::printf("  CPU for each robot and second: server %.0f us, client %.0f us\n", many.server_cpu, many.client_cpu);
  std::printf("  memory for each robot: server %.0f KiB, client %.1f KiB\n", many.server_memory, many.client_memory);
  std::printf(
      "a value at 1 kHz, published in A: received and decoded in B after %.0f us (p99 %.0f us), taken by the loop of B after %.0f us (p99 %.0f us); "
      "%zu values\n",
      p50, p99, taken_p50, taken_p99, received.size());
}

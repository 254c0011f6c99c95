// SPDX-License-Identifier: Apache-2.0
// What an idle connection costs the server in resident memory, and what stays when all have left.
//
//   idle_memory --port N --pid SERVER [--path /] [--connections 1000] [--tls] [--websocket]
//
// Each connection makes one GET, or with --websocket subscribes, and stays open. Ten that are closed again come before, so that what the first request alone costs does
// not count. Resident: what the server's own pages grow by (Rss of smaps_rollup); the system's socket buffers are not in it.

#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "tests/bench/stream.hpp"

namespace {

double resident_kib(int pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/smaps_rollup");
  std::string word;
  double kib = 0;
  while (file >> word)
    if (word == "Rss:") file >> kib;
  return kib;
}

void get(bench::Stream& stream, const std::string& request) {
  if (stream.send(request) != static_cast<ssize_t>(request.size())) std::fprintf(stderr, "send failed\n"), std::exit(1);
  std::string answer;
  char buffer[16 * 1024];
  while (true) {
    const ssize_t got = stream.receive(buffer, sizeof buffer);
    if (got < 0) std::fprintf(stderr, "the server closed a connection\n"), std::exit(1);
    if (got == 0) {
      stream.wait();
      continue;
    }
    answer.append(buffer, static_cast<std::size_t>(got));
    if (answer.compare(0, 12, "HTTP/1.1 101") == 0) return;
    const auto end = answer.find("\r\n\r\n"), length = answer.find("\r\nContent-Length: ");
    if (end == std::string::npos || length == std::string::npos) continue;
    if (answer.size() >= end + 4 + std::strtoul(answer.c_str() + length + 18, nullptr, 10)) break;
  }
  if (answer.compare(0, 12, "HTTP/1.1 200") != 0) std::fprintf(stderr, "%s\n", answer.c_str()), std::exit(1);
}

}  // namespace

int main(int argc, char** argv) {
  int port = 8080, pid = 0;
  std::size_t connections = 1000;
  bool tls = false, websocket = false;
  std::string path = "/";
  for (int i = 1; i < argc; ++i) {
    const std::string_view name = argv[i];
    if (name == "--tls") tls = true;
    else if (name == "--websocket") websocket = true;
    else if (i + 1 == argc) return std::fprintf(stderr, "unknown option %s\n", argv[i]), 2;
    else if (name == "--port") port = std::atoi(argv[++i]);
    else if (name == "--pid") pid = std::atoi(argv[++i]);
    else if (name == "--path") path = argv[++i];
    else if (name == "--connections") connections = static_cast<std::size_t>(std::atol(argv[++i]));
    else return std::fprintf(stderr, "unknown option %s\n", argv[i]), 2;
  }
  rlimit files{};
  ::getrlimit(RLIMIT_NOFILE, &files);
  files.rlim_cur = files.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &files);

  const std::string request = "GET " + path + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\nAccept: */*\r\n" +
                              (websocket ? "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                                           "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
                                         : "\r\n");
  const auto open = [&](std::size_t count) {
    std::vector<bench::Stream> streams(count);
    for (bench::Stream& stream : streams) {
      stream.connect(port, tls);
      stream.finish_handshake();
      get(stream, request);
    }
    return streams;
  };
  const auto settle = [] { std::this_thread::sleep_for(std::chrono::milliseconds(500)); };
  open(10);
  settle();
  const double before = resident_kib(pid);
  double after = 0;
  {
    const std::vector<bench::Stream> idle = open(connections);
    settle();
    after = resident_kib(pid);
  }
  settle();
  std::printf("%zu idle connections: resident %.0f KiB before, %.0f KiB with them, %.2f KiB each; %.0f KiB when they have left\n", connections,
              before, after, (after - before) / static_cast<double>(connections), resident_kib(pid));
}

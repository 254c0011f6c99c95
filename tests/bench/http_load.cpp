// SPDX-License-Identifier: Apache-2.0
// A bounded HTTP client for tests/bench: so many keep-alive connections, one request at a time on each.
//
//   http_load --port N [--path /] [--connections 8] [--requests 100000] [--seconds 0] [--warm-up 0] [--pid SERVER] [--spread N]
//             [--tls] [--put BODY | --post BODY | --if-none-match TAG] [--rate 0] [--reconnect]
//
// With --spread, '%' in the path stands for a number from 1 to N that jumps about. With --put or --post the Turtle body is sent instead
// of a GET. --rate bounds requests/s; who waits for its turn is let go in steps of 1 ms. With --reconnect each request has a connection
// of its own, and its latency begins before connect.
//
// Ends after so many requests in all, or after so many seconds if given, or on SIGTERM. Connections are made, and --warm-up requests done,
// before the clock starts. Prints requests/s and latencies, its own CPU time per request (where that is all the time there was, it is this
// program that is measured), checks that every response is 2xx (with --if-none-match: 304) and, with --pid, prints the CPU time per request that this process used.

#include <sys/epoll.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "tests/bench/cpu.hpp"
#include "tests/bench/stream.hpp"

namespace {

using Clock = std::chrono::steady_clock;

volatile std::sig_atomic_t ended = 0;

struct Connection {
  bench::Stream stream;
  bool open = false;         ///< the handshake is over
  std::string received;      ///< of an answer that came in pieces
  std::size_t expected = 0;  ///< bytes of the whole answer; 0 while its head is incomplete
  Clock::time_point begin;
};

std::size_t content_length(std::string_view head) {
  static constexpr std::string_view name = "\r\nContent-Length: ";
  const auto at = head.find(name);
  return at == std::string_view::npos ? 0 : static_cast<std::size_t>(std::strtoul(head.data() + at + name.size(), nullptr, 10));
}

}  // namespace

int main(int argc, char** argv) {
  int port = 8080;
  int connections = 8;
  int pid = 0;
  long requests = 100'000;
  long warm_up = 0;
  double seconds = 0;
  double rate = 0;
  bool tls = false, reconnect = false;
  std::string path = "/", method = "GET", body, tag, field;
  std::size_t spread = 1;
  for (int i = 1; i < argc; ++i) {
    const std::string_view name = argv[i];
    if (name == "--tls") tls = true;
    else if (name == "--reconnect") reconnect = true;
    else if (i + 1 == argc) return std::fprintf(stderr, "unknown option %s\n", argv[i]), 2;
    else if (name == "--port") port = std::atoi(argv[++i]);
    else if (name == "--connections") connections = std::atoi(argv[++i]);
    else if (name == "--requests") requests = std::atol(argv[++i]);
    else if (name == "--warm-up") warm_up = std::atol(argv[++i]);
    else if (name == "--seconds") seconds = std::atof(argv[++i]);
    else if (name == "--path") path = argv[++i];
    else if (name == "--put") method = "PUT", body = argv[++i];
    else if (name == "--post") method = "POST", body = argv[++i];
    else if (name == "--if-none-match") tag = argv[++i];
    else if (name == "--field") field = argv[++i];
    else if (name == "--rate") rate = std::atof(argv[++i]);
    else if (name == "--spread") spread = static_cast<std::size_t>(std::atol(argv[++i]));
    else if (name == "--pid") pid = std::atoi(argv[++i]);
    else return std::fprintf(stderr, "unknown option %s\n", argv[i]), 2;
  }
  struct sigaction action {};
  action.sa_handler = [](int) { ended = 1; };  // without SA_RESTART: epoll_wait must return
  ::sigaction(SIGTERM, &action, nullptr);
  std::signal(SIGPIPE, SIG_IGN);

  const auto request_for = [&](std::size_t number) {
    std::string where = path;
    if (const auto at = where.find('%'); at != std::string::npos) where.replace(at, 1, std::to_string(number));
    std::string request =
        method + " " + where + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\nUser-Agent: http_load\r\nAccept: */*\r\n";
    if (!field.empty()) request += field + "\r\n";
    if (!tag.empty()) request += "If-None-Match: " + tag + "\r\n";
    if (method != "GET") request += "Content-Type: text/turtle\r\nContent-Length: " + std::to_string(body.size()) + "\r\n";
    return request + "\r\n" + body;
  };
  std::vector<std::string> all_requests;
  for (std::size_t i = 1; i <= spread; ++i) all_requests.push_back(request_for(i));

  const int epoll = ::epoll_create1(EPOLL_CLOEXEC);
  std::vector<Connection> all(static_cast<std::size_t>(connections));
  const auto connect = [&](std::size_t i) {
    all[i].stream.connect(port, tls);
    all[i].open = false;
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.u64 = i;
    ::epoll_ctl(epoll, EPOLL_CTL_ADD, all[i].stream.fd(), &event);
  };
  if (!reconnect) {
    for (std::size_t i = 0; i < all.size(); ++i) {
      connect(i);
      all[i].stream.finish_handshake();
      all[i].open = true;
    }
  }

  std::vector<float> latencies;
  latencies.reserve(static_cast<std::size_t>(std::min(requests, 10'000'000L)));
  long sent = 0;  // or about to be, once a handshake is over
  long done = 0;  // with those of the warm-up
  long bad = 0;
  double own_before = bench::cpu_microseconds(::getpid());
  double cpu_before = pid ? bench::cpu_microseconds(pid) : 0;
  auto begin = Clock::now();
  const auto first = begin;
  auto deadline = begin + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  const auto write_request = [&](Connection& connection) {
    const std::string& request = all_requests[static_cast<std::size_t>(sent) * 7919 % spread];
    if (connection.stream.send(request) != static_cast<ssize_t>(request.size())) std::fprintf(stderr, "send failed\n"), std::exit(1);
  };
  /// true: go on; false: the connection to that server is gone
  const auto shake_hands = [&](Connection& connection) {
    const auto step = connection.stream.handshake();
    if (step == bench::Stream::Step::done) connection.open = true, write_request(connection);
    return step != bench::Stream::Step::failed;
  };
  std::vector<std::size_t> waiting;  // for their turn
  const auto send_next = [&](std::size_t i, Clock::time_point now) {
    if (ended || (seconds > 0 ? now >= deadline : sent >= warm_up + requests)) return;
    if (rate > 0 && static_cast<double>(sent) >= rate * std::chrono::duration<double>(now - first).count()) {
      waiting.push_back(i);
      return;
    }
    Connection& connection = all[i];
    connection.begin = now;
    ++sent;
    if (!reconnect) return write_request(connection);
    connect(i);
    if (!shake_hands(connection)) std::fprintf(stderr, "a TLS handshake failed\n"), std::exit(1);
  };
  for (std::size_t i = 0; i < all.size(); ++i) send_next(i, begin);

  static char buffer[64 * 1024];
  epoll_event events[256];
  auto progress = begin;
  while (!ended && (done < sent || !waiting.empty())) {
    const int ready = ::epoll_wait(epoll, events, 256, waiting.empty() ? 10'000 : 1);
    if (ready < 0 && errno == EINTR) continue;
    auto now = Clock::now();
    if (ready > 0 || done == sent) progress = now;
    if (now - progress > std::chrono::seconds(9)) return std::fprintf(stderr, "no answer within 10 s\n"), 1;
    for (int i = 0; i < ready; ++i) {
      auto& connection = all[events[i].data.u64];
      if (!connection.open) {
        if (!shake_hands(connection)) return std::fprintf(stderr, "a TLS handshake failed after %ld answers\n", done), 1;
        if (!connection.open || !connection.stream.pending()) continue;
      }
      bool complete = false;
      std::string_view answer;
      do {
        const auto got = connection.stream.receive(buffer, sizeof buffer);
        if (got < 0) return std::fprintf(stderr, "the server closed a connection after %ld answers\n", done), 1;
        if (got == 0) break;
        answer = std::string_view(buffer, static_cast<std::size_t>(got));
        if (!connection.received.empty()) answer = connection.received.append(answer);
        if (connection.expected == 0) {
          const auto end = answer.find("\r\n\r\n");
          if (end != std::string_view::npos) connection.expected = end + 4 + content_length(answer.substr(0, end + 4));
        }
        complete = connection.expected > 0 && answer.size() >= connection.expected;
        if (!complete && connection.received.empty()) connection.received = answer;
      } while (!complete && connection.stream.pending());
      if (!complete) continue;
      if (answer.compare(0, tag.empty() ? 10 : 12, tag.empty() ? "HTTP/1.1 2" : "HTTP/1.1 304") != 0) ++bad;
      now = Clock::now();
      latencies.push_back(std::chrono::duration<float, std::micro>(now - connection.begin).count());
      connection.received.clear();
      connection.expected = 0;
      if (++done == warm_up) {
        latencies.clear();
        own_before = bench::cpu_microseconds(::getpid());
        cpu_before = pid ? bench::cpu_microseconds(pid) : 0;
        begin = now;
        deadline = begin + (deadline - first);
      }
      if (reconnect) connection.stream.close(true);
      send_next(events[i].data.u64, now);
    }
    if (waiting.empty()) continue;
    std::vector<std::size_t> turn;
    turn.swap(waiting);
    for (const std::size_t i : turn) send_next(i, now);
  }
  const double elapsed = std::chrono::duration<double>(Clock::now() - begin).count();
  const double cpu = pid ? bench::cpu_microseconds(pid) - cpu_before : 0;
  const double own = bench::cpu_microseconds(::getpid()) - own_before;
  const auto measured = static_cast<double>(latencies.size());
  std::sort(latencies.begin(), latencies.end());
  const auto percentile = [&](double p) {
    if (latencies.empty()) return 0.0;
    return static_cast<double>(latencies[static_cast<std::size_t>(p * static_cast<double>(latencies.size() - 1))]);
  };
  std::printf("%zu requests on %d connections in %.2f s: %.0f/s, p50 %.1f us, p99 %.1f us, %ld not 2xx", latencies.size(), connections, elapsed,
              measured / elapsed, percentile(0.5), percentile(0.99), bad);
  std::printf(", load CPU %.2f us/request", measured > 0 ? own / measured : 0.0);
  if (pid) std::printf(", server CPU %.2f us/request", measured > 0 ? cpu / measured : 0.0);
  std::printf("\n");
  return bad == 0 ? 0 : 1;
}

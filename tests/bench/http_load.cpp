// A bounded HTTP client for tests/bench: so many keep-alive connections, one GET at a time on each.
//
//   http_load --port N [--path /] [--connections 8] [--requests 100000] [--seconds 0] [--pid SERVER] [--spread N]
//
// With --spread, '%' in the path stands for a number from 1 to N that jumps about.
//
// Ends after so many requests in all, or after so many seconds if given. Prints requests/s and latencies, checks that every answer is
// 200 and, with --pid, prints the CPU time per request that this process used, read from /proc.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "tests/bench/cpu.hpp"

namespace {

using Clock = std::chrono::steady_clock;

struct Connection {
  int socket = -1;
  std::string received;
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
  double seconds = 0;
  std::string path = "/";
  std::size_t spread = 1;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string_view name = argv[i];
    const char* const value = argv[i + 1];
    if (name == "--port") port = std::atoi(value);
    else if (name == "--connections") connections = std::atoi(value);
    else if (name == "--requests") requests = std::atol(value);
    else if (name == "--seconds") seconds = std::atof(value);
    else if (name == "--path") path = value;
    else if (name == "--spread") spread = static_cast<std::size_t>(std::atol(value));
    else if (name == "--pid") pid = std::atoi(value);
    else return std::fprintf(stderr, "unknown option %s\n", argv[i]), 2;
  }
  const auto request_for = [&](std::size_t number) {
    std::string where = path;
    if (const auto at = where.find('%'); at != std::string::npos) where.replace(at, 1, std::to_string(number));
    return "GET " + where + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
                              "\r\nUser-Agent: http_load\r\nAccept: */*\r\n\r\n";
  };
  std::vector<std::string> all_requests;
  for (std::size_t i = 1; i <= spread; ++i) all_requests.push_back(request_for(i));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));

  const int epoll = ::epoll_create1(0);
  std::vector<Connection> all(static_cast<std::size_t>(connections));
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i].socket = ::socket(AF_INET, SOCK_STREAM, 0);
    const int on = 1;
    ::setsockopt(all[i].socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    if (::connect(all[i].socket, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) return std::perror("connect"), 1;
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.u64 = i;
    ::epoll_ctl(epoll, EPOLL_CTL_ADD, all[i].socket, &event);
  }

  std::vector<float> latencies;
  latencies.reserve(static_cast<std::size_t>(std::min(requests, 10'000'000L)));
  long sent = 0;
  long done = 0;
  long bad = 0;
  const double cpu_before = pid ? bench::cpu_microseconds(pid) : 0;
  const auto begin = Clock::now();
  const auto deadline = begin + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  const auto send_next = [&](Connection& connection) {
    if (seconds > 0 ? Clock::now() >= deadline : sent >= requests) return;
    connection.begin = Clock::now();
    const std::string& request = all_requests[static_cast<std::size_t>(sent) * 7919 % spread];
    if (::send(connection.socket, request.data(), request.size(), MSG_NOSIGNAL) > 0) ++sent;
  };
  for (auto& connection : all) send_next(connection);
  char buffer[64 * 1024];
  epoll_event events[64];
  while (done < sent) {
    const int ready = ::epoll_wait(epoll, events, 64, 10'000);
    if (ready <= 0) return std::fprintf(stderr, "no answer within 10 s\n"), 1;
    for (int i = 0; i < ready; ++i) {
      auto& connection = all[events[i].data.u64];
      const auto got = ::recv(connection.socket, buffer, sizeof buffer, 0);
      if (got <= 0) return std::fprintf(stderr, "the server closed a connection after %ld answers\n", done), 1;
      connection.received.append(buffer, static_cast<std::size_t>(got));
      if (connection.expected == 0) {
        const auto end = connection.received.find("\r\n\r\n");
        if (end == std::string::npos) continue;
        connection.expected = end + 4 + content_length(std::string_view(connection.received).substr(0, end + 4));
      }
      if (connection.received.size() < connection.expected) continue;
      if (connection.received.compare(0, 12, "HTTP/1.1 200") != 0) ++bad;
      ++done;
      latencies.push_back(std::chrono::duration<float, std::micro>(Clock::now() - connection.begin).count());
      connection.received.clear();
      connection.expected = 0;
      send_next(connection);
    }
  }
  const double elapsed = std::chrono::duration<double>(Clock::now() - begin).count();
  const double cpu = pid ? bench::cpu_microseconds(pid) - cpu_before : 0;
  std::sort(latencies.begin(), latencies.end());
  const auto percentile = [&](double p) {
    if (latencies.empty()) return 0.0;
    return static_cast<double>(latencies[static_cast<std::size_t>(p * static_cast<double>(latencies.size() - 1))]);
  };
  std::printf("%ld requests on %d connections in %.2f s: %.0f/s, p50 %.1f us, p99 %.1f us, %ld not 200", done, connections,
              elapsed, static_cast<double>(done) / elapsed, percentile(0.5), percentile(0.99), bad);
  if (pid) std::printf(", server CPU %.2f us/request", cpu / static_cast<double>(done));
  std::printf("\n");
  return bad == 0 ? 0 : 1;
}

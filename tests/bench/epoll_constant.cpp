// SPDX-License-Identifier: Apache-2.0
// The yardstick for tests/bench: a bare epoll program that responds to every header section with the same bytes.
//
//   epoll_constant [--port 0] [--size 600 (of the body) | --total BYTES (with the header section) | --response FILE]
//
// With --response it sends the bytes of the file, for example those of `curl -si URL`: header section and body.
//
// Ends on SIGINT or SIGTERM and prints the CPU time (user + system) that it used per request.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>

namespace {

volatile std::sig_atomic_t ended = 0;
void on_signal(int) { ended = 1; }

double cpu_microseconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) * 1e6 +
         static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

std::string content_of(const char* file) {
  std::ifstream in(file, std::ios::binary);
  std::string content{std::istreambuf_iterator<char>(in), {}};
  if (content.empty()) std::fprintf(stderr, "%s: no bytes\n", file), std::exit(1);
  return content;
}

}  // namespace

int main(int argc, char** argv) {
  int port = 0;
  std::size_t size = 600;
  std::string response;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::strcmp(argv[i], "--port") == 0) port = std::atoi(argv[i + 1]);
    else if (std::strcmp(argv[i], "--size") == 0) size = static_cast<std::size_t>(std::atol(argv[i + 1]));
    else if (std::strcmp(argv[i], "--total") == 0) size = static_cast<std::size_t>(std::atol(argv[i + 1])) - 66;
    else if (std::strcmp(argv[i], "--response") == 0) response = content_of(argv[i + 1]);
    else return std::fprintf(stderr, "usage: epoll_constant [--port N] [--size BYTES | --total BYTES | --response FILE]\n"), 2;
  }
  struct sigaction action {};
  action.sa_handler = on_signal;  // without SA_RESTART: epoll_wait must return
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);

  const int on = 1;
  const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0);
  ::setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  socklen_t length = sizeof address;
  if (::bind(listener, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 || ::listen(listener, 512) != 0) {
    return std::perror("listen"), 1;
  }
  ::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &length);
  std::printf("listening on http://127.0.0.1:%u/\n", unsigned{ntohs(address.sin_port)});
  std::fflush(stdout);

  if (response.empty()) {
    response = "HTTP/1.1 200 OK\r\nContent-Type: text/plain\r\nContent-Length: " + std::to_string(size) + "\r\n\r\n" + std::string(size, 'x');
  }
  const int epoll = ::epoll_create1(0);
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = listener;
  ::epoll_ctl(epoll, EPOLL_CTL_ADD, listener, &event);

  unsigned long requests = 0;
  const double cpu_before = cpu_microseconds();
  epoll_event events[128];
  static char buffer[64 * 1024];
  while (!ended) {
    const int ready = ::epoll_wait(epoll, events, 128, -1);
    for (int i = 0; i < ready; ++i) {
      const int socket = events[i].data.fd;
      if (socket == listener) {
        const int client = ::accept4(listener, nullptr, nullptr, SOCK_NONBLOCK);
        if (client < 0) continue;
        ::setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
        event.data.fd = client;
        ::epoll_ctl(epoll, EPOLL_CTL_ADD, client, &event);
        continue;
      }
      const auto got = ::recv(socket, buffer, sizeof buffer, 0);
      if (got <= 0) {
        ::close(socket);
        continue;
      }
      if (::memmem(buffer, static_cast<std::size_t>(got), "\r\n\r\n", 4)) {
        if (::send(socket, response.data(), response.size(), MSG_NOSIGNAL) > 0) ++requests;
      }
    }
  }
  const double cpu = cpu_microseconds() - cpu_before;
  std::printf("%lu requests, %.2f microseconds of CPU each\n", requests, requests ? cpu / static_cast<double>(requests) : 0.0);
}

// SPDX-License-Identifier: Apache-2.0
// The yardstick for push_load: a bare epoll program that sends a number to every WebSocket, each in a system call of its own.
//
//   epoll_broadcast [--payload 600 (bytes)] [--period 1000 (us)]
//
// Takes any request for a WebSocket and does not read afterwards. A client that is slower misses values. The message is Turtle of the
// shape that push_load reads, padded with a comment. Ends on SIGINT or SIGTERM.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <string>
#include <string_view>
#include <vector>

namespace {

volatile std::sig_atomic_t ended = 0;

struct Client {
  int socket;
  std::string rest;  ///< of a frame that was sent in part
};

/// A text frame of a server: RFC 6455 5.2, not masked.
std::string frame_of(double value, std::size_t payload_bytes) {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  std::tm tm{};
  ::gmtime_r(&now.tv_sec, &tm);
  char seconds[32], text[256];
  std::strftime(seconds, sizeof seconds, "%Y-%m-%dT%H:%M:%S", &tm);
  const int size = std::snprintf(text, sizeof text, "<> vom:numericalValue %.6f ; dcterms:modified \"%s.%06ldZ\"^^xsd:dateTime .\n# ", value, seconds,
                                 now.tv_nsec / 1000);
  std::string payload(text, static_cast<std::size_t>(size));
  payload.resize(std::max(payload.size(), payload_bytes), '.');
  std::string frame = "\x81";
  if (payload.size() < 126) frame += static_cast<char>(payload.size());
  else (frame += '\x7E') += {static_cast<char>(payload.size() >> 8), static_cast<char>(payload.size() & 0xFF)};
  return frame + payload;
}

/// false: the client has gone
bool send_to(Client& client, std::string_view frame) {
  if (!client.rest.empty()) {
    const ssize_t put = ::send(client.socket, client.rest.data(), client.rest.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (put < 0) return errno == EAGAIN;
    client.rest.erase(0, static_cast<std::size_t>(put));
    if (!client.rest.empty()) return true;
  }
  const ssize_t put = ::send(client.socket, frame.data(), frame.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  if (put < 0) return errno == EAGAIN;
  client.rest = frame.substr(static_cast<std::size_t>(put));
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  std::size_t payload_bytes = 600;
  long period = 1000;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (std::strcmp(argv[i], "--payload") == 0) payload_bytes = static_cast<std::size_t>(std::atol(argv[i + 1]));
    else if (std::strcmp(argv[i], "--period") == 0) period = std::atol(argv[i + 1]);
    else return std::fprintf(stderr, "usage: epoll_broadcast [--payload BYTES] [--period US]\n"), 2;
  }
  struct sigaction action {};
  action.sa_handler = [](int) { ended = 1; };  // without SA_RESTART: epoll_wait must return
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);

  const int on = 1;
  const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof address;
  if (::bind(listener, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 || ::listen(listener, 4096) != 0) return std::perror("listen"), 1;
  ::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &length);
  std::printf("listening on http://127.0.0.1:%u/\n", unsigned{ntohs(address.sin_port)});
  std::fflush(stdout);

  const int timer = ::timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC);
  itimerspec every{};
  every.it_interval.tv_sec = every.it_value.tv_sec = period / 1'000'000;
  every.it_interval.tv_nsec = every.it_value.tv_nsec = period % 1'000'000 * 1000;
  ::timerfd_settime(timer, 0, &every, nullptr);
  const int epoll = ::epoll_create1(EPOLL_CLOEXEC);
  epoll_event event{};
  event.events = EPOLLIN;
  for (const int descriptor : {listener, timer}) {
    event.data.fd = descriptor;
    ::epoll_ctl(epoll, EPOLL_CTL_ADD, descriptor, &event);
  }
  static constexpr char upgraded[] =
      "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n\r\n";
  std::vector<Client> clients;
  double value = 0;
  while (!ended) {
    epoll_event events[2];
    const int ready = ::epoll_wait(epoll, events, 2, -1);
    for (int i = 0; i < ready; ++i) {
      if (events[i].data.fd == timer) {
        unsigned long ticks = 0;
        if (::read(timer, &ticks, sizeof ticks) != sizeof ticks) continue;
        value += 0.001 * static_cast<double>(ticks);
        const std::string frame = frame_of(value, payload_bytes);
        clients.erase(std::remove_if(clients.begin(), clients.end(),
                                     [&](Client& client) {
                                       const bool gone = !send_to(client, frame);
                                       if (gone) ::close(client.socket);
                                       return gone;
                                     }),
                      clients.end());
        continue;
      }
      const int socket = ::accept4(listener, nullptr, nullptr, SOCK_CLOEXEC);
      char request[4096];
      if (socket < 0) continue;
      ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
      if (::recv(socket, request, sizeof request, 0) > 0 && ::send(socket, upgraded, sizeof upgraded - 1, MSG_NOSIGNAL) > 0)
        clients.push_back({socket, {}});
      else ::close(socket);
    }
  }
}

// SPDX-License-Identifier: Apache-2.0
// What the machine itself costs, beside robot.cpp: as much of HTTP as large_bodies.py needs, and nothing else. Bodies are read and thrown away.
//
//   bare_server [--in-poll]
//
// A GET gets a response at once. A PUT of a small body gets it from the control loop, which runs at 1 kHz, as a command of a robot does. A large body gets 413. With --in-poll
// the control loop serves everything. Standard input and output are as those of attacked_robot.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <iostream>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <unordered_map>
#include <utility>
#include <vector>

#include "tests/attack/sample.hpp"

namespace {

using Time = std::chrono::steady_clock::time_point;
using lrt::attack::Measured;
using lrt::attack::thread_time;
constexpr std::chrono::microseconds step{1000}, budget{200};
constexpr std::size_t small_bytes = 2048;

void respond(int socket, std::string_view status, std::string_view body = {}) {
  const std::string text = "HTTP/1.1 " + std::string(status) +
                           (status == "204 No Content" ? "" : "\r\nContent-Length: " + std::to_string(body.size())) + "\r\n\r\n" + std::string(body);
  [[maybe_unused]] const ssize_t sent = ::send(socket, text.data(), text.size(), MSG_NOSIGNAL);
}

class BareServer {
 public:
  BareServer() : listening_(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)), set_(::epoll_create1(EPOLL_CLOEXEC)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* const generic = reinterpret_cast<sockaddr*>(&address);
    if (::bind(listening_, generic, size) != 0 || ::listen(listening_, 100) != 0 || ::getsockname(listening_, generic, &size) != 0) std::abort();
    std::printf("http://127.0.0.1:%d/\n", ntohs(address.sin_port));
    std::fflush(stdout);
    watch(listening_);
  }

  /// Waits for events and serves one round of them. False: there were none.
  bool serve(int wait) {
    std::array<epoll_event, 64> events{};
    const int count = ::epoll_wait(set_, events.data(), static_cast<int>(events.size()), wait);
    for (int i = 0; i < count; ++i) {
      const int socket = events[static_cast<std::size_t>(i)].data.fd;
      if (socket == listening_) accept();
      else if (!receive(socket, clients_[socket])) clients_.erase(socket), ::close(socket);
    }
    return count > 0;
  }

  /// Commands that arrived: their responses leave now.
  void run_commands() {
    std::vector<int> due;
    {
      const std::lock_guard lock(mutex_);
      due.swap(commands_);
    }
    for (const int socket : due) respond(socket, "204 No Content");
  }

 private:
  struct Client {
    std::string header;
    std::size_t length = 0, left = 0;
  };

  void watch(int socket) {
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.fd = socket;
    ::epoll_ctl(set_, EPOLL_CTL_ADD, socket, &event);
  }
  void accept() {
    const int socket = ::accept4(listening_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (socket < 0) return;
    const int on = 1;
    ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    watch(socket);
  }

  /// One read. False: the client has gone.
  bool receive(int socket, Client& client) {
    const ssize_t got = ::recv(socket, scratch_.data(), scratch_.size(), 0);
    if (got <= 0) return false;
    std::size_t size = static_cast<std::size_t>(got);
    if (client.left == 0) {
      const std::size_t before = client.header.size();
      client.header.append(scratch_.data(), size);
      const std::size_t end = client.header.find("\r\n\r\n");
      if (end == std::string::npos) return true;
      size = before + size - (end + 4);
      client.header.resize(end + 4);
      const std::size_t field = client.header.find("Content-Length: ");
      client.length = client.left = field == std::string::npos ? 0 : std::strtoul(client.header.c_str() + field + 16, nullptr, 10);
    }
    client.left -= std::min(client.left, size);
    if (client.left > 0) return true;
    if (client.header[0] == 'G') respond(socket, "200 OK", "0.5");
    else if (client.length > small_bytes) respond(socket, "413 Content Too Large");
    else if (client.header[1] == 'O') respond(socket, "204 No Content");
    else command(socket);
    client.header.clear();
    return true;
  }
  void command(int socket) {
    const std::lock_guard lock(mutex_);
    commands_.push_back(socket);
  }

  const int listening_, set_;
  std::array<char, 64 * 1024> scratch_{};
  std::unordered_map<int, Client> clients_;
  std::mutex mutex_;
  std::vector<int> commands_;
};

}  // namespace

int main(int count, char** arguments) {
  const bool in_poll = count > 1 && std::string_view(arguments[1]) == "--in-poll";
  BareServer server;
  std::atomic<std::promise<Measured>*> wanted{nullptr};
  std::atomic<bool> ended{false};
  std::thread control([&] {
    Time next = std::chrono::steady_clock::now();
    Measured own;
    while (!ended) {
      std::this_thread::sleep_until(next += step);
      const Time begun = std::chrono::steady_clock::now();
      own.late.add(begun - next);
      const std::chrono::nanoseconds used = thread_time();
      if (in_poll) {
        while (server.serve(0) && std::chrono::steady_clock::now() < begun + budget) {}
      }
      server.run_commands();
      own.poll.add(std::chrono::steady_clock::now() - begun);
      own.cpu.add(thread_time() - used);
      if (std::chrono::steady_clock::now() - next > step) next = std::chrono::steady_clock::now();
      if (auto* promise = wanted.exchange(nullptr)) promise->set_value(std::exchange(own, {}));
    }
  });
  std::thread io;
  if (!in_poll)
    io = std::thread([&] {
      while (!ended) server.serve(50);
    });
  for (std::string line; std::getline(std::cin, line);) {
    std::promise<Measured> promise;
    wanted = &promise;
    std::printf("%s\n", promise.get_future().get().json().c_str());
    std::fflush(stdout);
  }
  ended = true;
  control.join();
  if (io.joinable()) io.join();
  return 0;
}

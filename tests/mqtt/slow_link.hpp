// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace lrt::test {

/// A proxy on a loopback port that passes bytes on slowly, late, and at times not at all, as a modem does. It reads what it is sent into a buffer without a
/// limit, so that the sender's socket never shows that the link is slow.
class SlowLink {
 public:
  using Clock = std::chrono::steady_clock;
  struct Options {
    std::uint16_t to = 0;  ///< port on loopback
    double bytes_per_second = 20'000;
    std::chrono::milliseconds delay{100};  ///< in each direction
    std::chrono::milliseconds stall_every{10'000}, stall{500};
  };

  explicit SlowLink(const Options& options) : options_(options), listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    if (::bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 || ::listen(listener_, 8) != 0 ||
        ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0)
      throw std::runtime_error("no listening socket");
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { run(); });
  }
  ~SlowLink() {
    ends_ = true;
    thread_.join();
    ::close(listener_);
  }
  SlowLink(const SlowLink&) = delete;
  SlowLink& operator=(const SlowLink&) = delete;

  std::uint16_t port() const noexcept { return port_; }
  /// Passes nothing on until it is called again.
  void hang(bool hangs) noexcept { hangs_ = hangs; }
  /// The most bytes that it has kept at a time on their way to the broker.
  std::size_t most_kept() const noexcept { return most_kept_; }

 private:
  struct Chunk {
    std::string bytes;
    Clock::time_point since;
  };
  /// One direction of one connection.
  struct Way {
    std::deque<Chunk> kept{};
    std::size_t bytes = 0;
    double credit = 0;
    bool has_ended = false;
  };
  struct Pair {
    std::array<int, 2> sockets{-1, -1};  ///< of the robot, and to the broker
    std::array<Way, 2> ways{};           ///< from the socket with the same index to the other one
    Pair() = default;
    ~Pair() {
      for (const int s : sockets)
        if (s >= 0) ::close(s);
    }
    Pair(const Pair&) = delete;
    Pair& operator=(const Pair&) = delete;
  };

  void run() {
    Clock::time_point last = Clock::now();
    const Clock::time_point begin = last;
    while (!ends_) {
      pollfd item{listener_, POLLIN, 0};
      ::poll(&item, 1, 2);
      accept();
      const Clock::time_point now = Clock::now();
      const double seconds = std::chrono::duration<double>(now - std::exchange(last, now)).count();
      const bool stalls = options_.stall_every.count() > 0 && (now - begin) % options_.stall_every >= options_.stall_every - options_.stall;
      for (const auto& pair : pairs_)
        for (const std::size_t from : {0U, 1U}) {
          read(*pair, from, now);
          if (hangs_ || stalls) pair->ways[from].credit = 0;
          else write(*pair, from, now, seconds);
        }
      pairs_.erase(std::remove_if(pairs_.begin(), pairs_.end(), [](const auto& p) { return p->ways[0].has_ended || p->ways[1].has_ended; }),
                   pairs_.end());
    }
  }
  void accept() {
    const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (client < 0) return;
    auto pair = std::make_unique<Pair>();
    pair->sockets[0] = client;
    pair->sockets[1] = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(options_.to);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::connect(pair->sockets[1], reinterpret_cast<sockaddr*>(&address), sizeof address) == 0) pairs_.push_back(std::move(pair));
  }
  void read(Pair& pair, std::size_t from, Clock::time_point now) {
    Way& way = pair.ways[from];
    char bytes[65'536];
    for (int i = 0; i < 16; ++i) {
      const ssize_t got = ::recv(pair.sockets[from], bytes, sizeof bytes, MSG_DONTWAIT);
      if (got == 0) way.has_ended = true;
      if (got <= 0) break;
      way.kept.push_back({std::string(bytes, static_cast<std::size_t>(got)), now});
      way.bytes += static_cast<std::size_t>(got);
    }
    if (from == 0) most_kept_ = std::max<std::size_t>(most_kept_, way.bytes);
  }
  void write(Pair& pair, std::size_t from, Clock::time_point now, double seconds) {
    Way& way = pair.ways[from];
    way.credit = std::min(way.credit + seconds * options_.bytes_per_second, options_.bytes_per_second / 20);
    while (!way.kept.empty() && way.credit >= 1 && now - way.kept.front().since >= options_.delay) {
      std::string& first = way.kept.front().bytes;
      const ssize_t sent =
          ::send(pair.sockets[1 - from], first.data(), std::min(first.size(), static_cast<std::size_t>(way.credit)), MSG_DONTWAIT | MSG_NOSIGNAL);
      if (sent < 0) return;
      way.credit -= static_cast<double>(sent);
      way.bytes -= static_cast<std::size_t>(sent);
      first.erase(0, static_cast<std::size_t>(sent));
      if (first.empty()) way.kept.pop_front();
    }
  }

  const Options options_;
  const int listener_;
  std::uint16_t port_ = 0;
  std::atomic<bool> ends_{false}, hangs_{false};
  std::atomic<std::size_t> most_kept_{0};
  std::vector<std::unique_ptr<Pair>> pairs_;
  std::thread thread_;
};

}  // namespace lrt::test

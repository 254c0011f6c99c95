// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace lrt::test {

/// A TCP proxy on 127.0.0.1 whose directions freeze and thaw by command: what arrives on a frozen one waits, and nothing is lost.
class FrozenLink {
 public:
  explicit FrozenLink(std::uint16_t server) : server_(server), listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address = at(0);
    socklen_t size = sizeof address;
    if (::bind(listener_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0 || ::listen(listener_, 64) != 0 ||
        ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0)
      throw std::runtime_error("no proxy");
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { run(); });
  }
  ~FrozenLink() {
    ended_ = true;
    thread_.join();
    ::close(listener_);
  }
  FrozenLink(const FrozenLink&) = delete;
  FrozenLink& operator=(const FrozenLink&) = delete;

  std::uint16_t port() const noexcept { return port_; }
  std::string url() const { return "http://127.0.0.1:" + std::to_string(port_) + "/"; }
  void freeze_to_server() { frozen_[0] = true; }
  void freeze_to_client() { frozen_[1] = true; }
  void freeze() { frozen_[0] = frozen_[1] = true; }
  void thaw() { frozen_[0] = frozen_[1] = false; }
  /// Where later connections go.
  void lead_to(std::uint16_t server) { server_ = server; }
  /// Connections so far.
  std::size_t connections() const noexcept { return connections_; }

 private:
  struct Pair {
    Pair(int client, int server) : from{client, server} {}
    Pair(const Pair&) = delete;
    Pair& operator=(const Pair&) = delete;
    const std::array<int, 2> from;  ///< the client, the server
    std::array<bool, 2> ended{};
    ~Pair() {
      for (const int descriptor : from) ::close(descriptor);
    }
  };
  static sockaddr_in at(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return address;
  }
  void take_client() {
    const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client < 0) return;
    const int server = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    auto pair = std::make_unique<Pair>(client, server);
    const sockaddr_in address = at(server_);
    if (::connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return;
    pairs_.push_back(std::move(pair));
    ++connections_;
  }
  /// Passes on what is there. False: the connection is over.
  bool pass(Pair& pair, std::size_t side) {
    std::array<char, 16 * 1024> buffer;
    const auto got = ::recv(pair.from[side], buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (got < 0) return false;
    if (got == 0) {
      pair.ended[side] = true;
      ::shutdown(pair.from[1 - side], SHUT_WR);
      return !pair.ended[1 - side];
    }
    for (decltype(got + 0) sent = 0; sent < got;) {
      const auto n = ::send(pair.from[1 - side], buffer.data() + sent, static_cast<std::size_t>(got - sent), MSG_NOSIGNAL);
      if (n <= 0) return false;
      sent += n;
    }
    return true;
  }
  void run() {
    while (!ended_) {
      std::vector<pollfd> wanted{{listener_, POLLIN, 0}};
      for (const auto& pair : pairs_)
        for (std::size_t side = 0; side < 2; ++side)
          wanted.push_back({pair->from[side], static_cast<short>(frozen_[side] || pair->ended[side] ? 0 : POLLIN), 0});
      if (::poll(wanted.data(), wanted.size(), 5) <= 0) continue;
      std::vector<std::unique_ptr<Pair>> rest;
      for (std::size_t i = 0; i < pairs_.size(); ++i) {
        bool open = true;
        for (std::size_t side = 0; side < 2 && open; ++side)
          if ((wanted[1 + 2 * i + side].revents & (POLLIN | POLLHUP | POLLERR)) != 0 && !frozen_[side] && !pairs_[i]->ended[side])
            open = pass(*pairs_[i], side);
        if (open) rest.push_back(std::move(pairs_[i]));
      }
      pairs_ = std::move(rest);
      if ((wanted[0].revents & POLLIN) != 0) take_client();
    }
  }

  std::atomic<std::uint16_t> server_;
  const int listener_;
  std::uint16_t port_ = 0;
  std::array<std::atomic<bool>, 2> frozen_{};
  std::atomic<bool> ended_{false};
  std::atomic<std::size_t> connections_{0};
  std::vector<std::unique_ptr<Pair>> pairs_;
  std::thread thread_;
};

}  // namespace lrt::test

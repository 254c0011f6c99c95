// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <list>
#include <mutex>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <lrt/http/message.hpp>

namespace lrt::test {

/// A receiver's end of a connection. Every call ends when the receiver is destroyed.
class Peer {
 public:
  Peer(int descriptor, SSL* tls) : descriptor_(descriptor), tls_(tls) {}
  ~Peer() {
    SSL_free(tls_);
    ::close(descriptor_);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  int descriptor() const noexcept { return descriptor_; }
  bool shake_hands() { return tls_ == nullptr || SSL_accept(tls_) == 1; }

  /// Header section and body of a request as received; empty: the connection is closed.
  std::string read_request() {
    while (true) {
      const std::size_t end = received_.find("\r\n\r\n");
      if (end != std::string::npos) {
        const std::size_t at = received_.find("Content-Length: ");
        const std::size_t length = at < end ? std::strtoul(received_.c_str() + at + 16, nullptr, 10) : 0;
        if (received_.size() >= end + 4 + length) {
          std::string request = received_.substr(0, end + 4 + length);
          received_.erase(0, request.size());
          return request;
        }
      }
      if (!read_some()) return {};
    }
  }
  bool send(std::string_view bytes) {
    while (!bytes.empty()) {
      const auto put = tls_ != nullptr ? SSL_write(tls_, bytes.data(), static_cast<int>(bytes.size()))
                                       : static_cast<int>(::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL));
      if (put <= 0) return false;
      bytes.remove_prefix(static_cast<std::size_t>(put));
    }
    return true;
  }
  /// Sends byte by byte, one in 20 ms, until the other side closes.
  void drip(std::string_view bytes) {
    for (std::size_t i = 0;; ++i) {
      pollfd item{descriptor_, POLLIN, 0};
      if (::poll(&item, 1, 20) > 0 && !read_some()) return;
      if (!send(bytes.substr(i % bytes.size(), 1))) return;
    }
  }
  /// Waits until the other side closes. Received bytes are dropped.
  void hang() {
    while (read_some()) received_.clear();
  }
  /// Waits until the other side closes, without reading.
  void hang_deaf() {
    pollfd item{descriptor_, POLLRDHUP, 0};
    while (::poll(&item, 1, 60'000) == 0) {}
  }

 private:
  bool read_some() {
    char buffer[16 * 1024];
    const auto got = tls_ != nullptr ? SSL_read(tls_, buffer, sizeof buffer) : static_cast<int>(::recv(descriptor_, buffer, sizeof buffer, 0));
    if (got <= 0) return false;
    received_.append(buffer, static_cast<std::size_t>(got));
    return true;
  }
  int descriptor_;
  SSL* tls_;
  std::string received_;
};

inline std::string answer(int status, std::string_view body = {}, std::string_view fields = {}) {
  std::string text = "HTTP/1.1 " + std::to_string(status) + " Word\r\n" + std::string(fields);
  if (status != 204) text += "Content-Length: " + std::to_string(body.size()) + "\r\n";
  return text + "\r\n" + std::string(body);
}

/// A receiver of callbacks on loopback. `serve` gets each connection on a thread of its own.
class Receiver {
 public:
  using Serve = std::function<void(Peer&)>;
  explicit Receiver(Serve serve, SSL_CTX* tls = nullptr, int family = AF_INET) : serve_(std::move(serve)), tls_(tls) {
    // The TLS handshake and close may write to a closed connection.
    sigset_t pipe;
    ::sigemptyset(&pipe);
    ::sigaddset(&pipe, SIGPIPE);
    listener_ = ::socket(family, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_storage address{};
    socklen_t size = sizeof(sockaddr_in);
    address.ss_family = static_cast<sa_family_t>(family);
    if (family == AF_INET) {
      reinterpret_cast<sockaddr_in&>(address).sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    } else {
      reinterpret_cast<sockaddr_in6&>(address).sin6_addr = in6addr_loopback;
      size = sizeof(sockaddr_in6);
    }
    if (listener_ < 0 || ::bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 || ::listen(listener_, 128) != 0) {
      ::close(listener_);
      throw std::runtime_error("cannot listen");
    }
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(reinterpret_cast<sockaddr_in&>(address).sin_port);  // at the same offset as in sockaddr_in6
    acceptor_ = std::thread([this, pipe] {
      ::pthread_sigmask(SIG_BLOCK, &pipe, nullptr);  // in the receiver's threads only: lrt must not rely on it
      accept();
    });
  }
  ~Receiver() {
    ending_ = true;
    ::shutdown(listener_, SHUT_RDWR);
    acceptor_.join();
    {
      const std::lock_guard lock(mutex_);
      for (const int descriptor : open_) ::shutdown(descriptor, SHUT_RDWR);
    }
    for (std::thread& thread : threads_) thread.join();
    ::close(listener_);
  }
  Receiver(const Receiver&) = delete;
  Receiver& operator=(const Receiver&) = delete;

  std::uint16_t port() const noexcept { return port_; }
  int connections() const noexcept { return connections_; }
  std::string url(std::string_view host = "127.0.0.1", std::string_view target = "/hook") const {
    return (tls_ != nullptr ? "https://" : "http://") + std::string(host) + ":" + std::to_string(port_) + std::string(target);
  }

 private:
  void accept() {
    while (!ending_) {
      const int descriptor = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
      if (descriptor < 0) {
        if (errno == EINTR || errno == ECONNABORTED) continue;
        return;
      }
      ++connections_;
      const std::lock_guard lock(mutex_);
      open_.push_back(descriptor);
      threads_.emplace_back([this, descriptor] {
        SSL* session = nullptr;
        if (tls_ != nullptr) {
          session = SSL_new(tls_);
          SSL_set_fd(session, descriptor);
        }
        const int watched = ::dup(descriptor);
        {
          Peer peer(watched, session);
          if (session != nullptr) SSL_set_fd(session, watched);
          if (peer.shake_hands()) serve_(peer);
        }
        ::shutdown(descriptor, SHUT_RDWR);
        const std::lock_guard end(mutex_);
        open_.remove(descriptor);
        ::close(descriptor);
      });
    }
  }

  Serve serve_;
  SSL_CTX* tls_;
  int listener_ = -1;
  std::uint16_t port_ = 0;
  std::atomic<bool> ending_{false};
  std::atomic<int> connections_{0};
  std::mutex mutex_;
  std::list<int> open_;
  std::vector<std::thread> threads_;
  std::thread acceptor_;
};

/// Sends the same response to every request and records the requests.
class Recorder {
 public:
  explicit Recorder(std::string text = answer(204)) : text_(std::move(text)) {}
  void operator()(Peer& peer) {
    while (true) {
      std::string request = peer.read_request();
      if (request.empty()) return;
      {
        const std::lock_guard lock(mutex_);
        requests_.push_back(std::move(request));
      }
      if (!peer.send(text_)) return;
    }
  }
  std::vector<std::string> requests() const {
    const std::lock_guard lock(mutex_);
    return requests_;
  }

 private:
  std::string text_;
  mutable std::mutex mutex_;
  std::vector<std::string> requests_;
};

}  // namespace lrt::test

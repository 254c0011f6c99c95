// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <utility>

#if LRT_BENCH_TLS
#include <openssl/ssl.h>
#endif

namespace bench {

#if LRT_BENCH_TLS
/// One for the program: no verification, no resumption, as few reads of the socket as can be.
inline SSL_CTX* client_context() {
  static SSL_CTX* const context = [] {
    SSL_CTX* const made = ::SSL_CTX_new(::TLS_client_method());
    ::SSL_CTX_set_session_cache_mode(made, SSL_SESS_CACHE_OFF);
    ::SSL_CTX_set_read_ahead(made, 1);
    ::SSL_CTX_set_mode(made, SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER);
    return made;
  }();
  return context;
}
#endif

/// A client's connection on loopback, plain or TLS, not blocking.
class Stream {
 public:
  enum class Step : std::uint8_t { done, again, failed };

  Stream() = default;
  Stream(Stream&& other) noexcept { swap(other); }
  Stream& operator=(Stream&& other) noexcept {
    swap(other);
    return *this;
  }
  ~Stream() { close(); }

  /// Connects; with TLS what follows is handshake(). Ends the program when that fails: these programs measure, they do not test.
  void connect(int port, bool tls, int receive_buffer = 0) {
    close();
    fd_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const int on = 1;
    ::setsockopt(fd_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    if (receive_buffer > 0) ::setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    if (::connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) std::perror("connect"), std::exit(1);
    ::fcntl(fd_, F_SETFL, O_NONBLOCK);
    if (!tls) return;
#if LRT_BENCH_TLS
    ssl_ = ::SSL_new(client_context());
    ::SSL_set_fd(ssl_, fd_);
    ::SSL_set_connect_state(ssl_);
#else
    std::fprintf(stderr, "built without OpenSSL: no TLS\n"), std::exit(1);
#endif
  }

  Step handshake() {
#if LRT_BENCH_TLS
    if (ssl_) {
      const int result = ::SSL_do_handshake(ssl_);
      return result == 1 ? Step::done : would_block(result) ? Step::again : Step::failed;
    }
#endif
    return Step::done;
  }
  /// The same for programs that have nothing else to do meanwhile.
  void finish_handshake() {
    Step step;
    while ((step = handshake()) == Step::again) wait();
    if (step == Step::failed) std::fprintf(stderr, "the TLS handshake failed\n"), std::exit(1);
  }

  /// Bytes taken; 0: not now; -1: the connection is gone.
  ssize_t send(std::string_view bytes) {
#if LRT_BENCH_TLS
    if (ssl_) {
      const int n = ::SSL_write(ssl_, bytes.data(), static_cast<int>(bytes.size()));
      return n > 0 ? n : would_block(n) ? 0 : -1;
    }
#endif
    const ssize_t n = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    return n >= 0 ? n : errno == EAGAIN ? 0 : -1;
  }
  /// Bytes got; 0: none now; -1: the connection is gone.
  ssize_t receive(char* buffer, std::size_t size) {
#if LRT_BENCH_TLS
    if (ssl_) {
      const int n = ::SSL_read(ssl_, buffer, static_cast<int>(size));
      return n > 0 ? n : would_block(n) ? 0 : -1;
    }
#endif
    const ssize_t n = ::recv(fd_, buffer, size, 0);
    return n > 0 ? n : n < 0 && errno == EAGAIN ? 0 : -1;
  }
  /// Whether there is something that epoll does not know of.
  bool pending() const {
#if LRT_BENCH_TLS
    return ssl_ && ::SSL_has_pending(ssl_) == 1;
#else
    return false;
#endif
  }
  void wait() const {
    pollfd ready{fd_, POLLIN, 0};
    ::poll(&ready, 1, 1'000);
  }
  int fd() const { return fd_; }

  /// @param reset  leaves no port in TIME_WAIT, of which there are some 28,000
  void close(bool reset = false) {
#if LRT_BENCH_TLS
    if (ssl_) ::SSL_free(std::exchange(ssl_, nullptr));
#endif
    if (fd_ < 0) return;
    const linger at_once{1, 0};
    if (reset) ::setsockopt(fd_, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    ::close(std::exchange(fd_, -1));
  }

 private:
  void swap(Stream& other) noexcept {
    std::swap(fd_, other.fd_);
#if LRT_BENCH_TLS
    std::swap(ssl_, other.ssl_);
#endif
  }
#if LRT_BENCH_TLS
  bool would_block(int result) const {
    const int error = ::SSL_get_error(ssl_, result);
    return error == SSL_ERROR_WANT_READ || error == SSL_ERROR_WANT_WRITE;
  }
  SSL* ssl_ = nullptr;
#endif
  int fd_ = -1;
};

}  // namespace bench

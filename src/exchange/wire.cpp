// SPDX-License-Identifier: Apache-2.0
#include "src/exchange/wire.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <system_error>

#include "src/base/third_party_call.hpp"

namespace lrt::exchange {
namespace {

std::string system_message(int error) { return std::system_category().message(error); }

bool is_hang_up(int error) noexcept { return error == EPIPE || error == ECONNRESET || error == ENOTCONN || error == ECONNABORTED; }

Unexpected socket_error(int error) { return unexpected(is_hang_up(error) ? Errc::closed : Errc::io_error, system_message(error)); }

Unexpected process_ends() { return unexpected(Errc::cancelled, "the process is exiting"); }

}  // namespace

Result<std::unique_ptr<Wire>> Wire::open(const Address& address, std::uint16_t port, WaitLimit limit) {
  const int descriptor = ::socket(address.socket.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (descriptor < 0) return unexpected(Errc::io_error, system_message(errno));
  std::unique_ptr<Wire> wire(new Wire(descriptor));
  const int on = 1;
  ::setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  sockaddr_storage to = address.socket;
  if (to.ss_family == AF_INET) reinterpret_cast<sockaddr_in&>(to).sin_port = htons(port);
  else reinterpret_cast<sockaddr_in6&>(to).sin6_port = htons(port);
  if (::connect(descriptor, reinterpret_cast<const sockaddr*>(&to), address.size) != 0) {
    if (errno != EINPROGRESS) return unexpected(Errc::io_error, system_message(errno));
    if (Result<void> ready = wire->wait(POLLOUT, limit); !ready) return unexpected(std::move(ready).error());
    int error = 0;
    socklen_t size = sizeof error;
    if (::getsockopt(descriptor, SOL_SOCKET, SO_ERROR, &error, &size) != 0) error = errno;
    if (error != 0) return unexpected(Errc::io_error, system_message(error));
  }
  return wire;
}

Wire::~Wire() {
  tls_.reset();
  ::close(descriptor_);
}

Result<void> Wire::wait(short events, WaitLimit limit) const {
  pollfd items[2] = {{descriptor_, events, 0}, {limit.stop_descriptor, POLLIN, 0}};
  while (true) {
    // Rounded up, so that the wait does not end before the time limit.
    const auto rest = std::chrono::ceil<std::chrono::milliseconds>(limit.until - std::chrono::steady_clock::now()).count();
    const int found = ::poll(items, 2, static_cast<int>(std::clamp<std::int64_t>(rest, 0, INT_MAX)));
    if (found < 0 && errno != EINTR) return unexpected(Errc::io_error, system_message(errno));
    if (found > 0 && items[1].revents != 0) return unexpected(Errc::cancelled, "the server is stopping");
    // Checked even if the socket is ready: a receiver that sends byte by byte gets no extra time.
    if (rest <= 0) return unexpected(Errc::timed_out, "timed out");
    if (found > 0) return {};
  }
}

Result<void> Wire::secure(const ClientTls& tls, const std::string& host, WaitLimit limit) {
  tls_ = tls.session(descriptor_, host);
  if (!tls_) return unexpected(Errc::io_error, "TLS: OpenSSL cannot make a session for " + host);
  while (true) {
    int why = SSL_ERROR_NONE;
    {
      const ThirdPartyCall call;  // not while it waits
      if (!call) return process_ends();
      ERR_clear_error();
      const int done = SSL_do_handshake(tls_.get());
      if (done == 1) return {};
      const int error = errno;
      why = SSL_get_error(tls_.get(), done);
      if (why != SSL_ERROR_WANT_READ && why != SSL_ERROR_WANT_WRITE) {
        return unexpected(Errc::io_error,
                          tls_reason(tls_.get(), done != 0 && error != 0 ? system_message(error) : "the receiver closed the connection"));
      }
    }
    if (Result<void> ready = wait(why == SSL_ERROR_WANT_READ ? POLLIN : POLLOUT, limit); !ready) return ready;
  }
}

Result<std::size_t> Wire::read(char* to, std::size_t size, WaitLimit limit) {
  size = std::min<std::size_t>(size, INT_MAX);
  while (true) {
    // Checked before each read: a receiver that sends byte by byte gets no extra time.
    if (limit.until <= std::chrono::steady_clock::now()) return unexpected(Errc::timed_out, "timed out");
    short events = POLLIN;
    if (tls_) {
      const ThirdPartyCall call;
      if (!call) return process_ends();
      ERR_clear_error();
      const int got = SSL_read(tls_.get(), to, static_cast<int>(size));
      if (got > 0) return static_cast<std::size_t>(got);
      const int error = errno;
      const int why = SSL_get_error(tls_.get(), got);
      if (why == SSL_ERROR_ZERO_RETURN) return std::size_t{0};
      if (why == SSL_ERROR_SYSCALL) {
        ERR_clear_error();
        return got == 0 || error == 0 ? unexpected(Errc::closed, "it closed the connection") : socket_error(error);
      }
      if (why == SSL_ERROR_WANT_WRITE) events = POLLOUT;
      else if (why != SSL_ERROR_WANT_READ) return unexpected(Errc::closed, tls_reason(tls_.get(), "TLS failed"));
    } else {
      const auto got = ::recv(descriptor_, to, size, 0);
      if (got >= 0) return static_cast<std::size_t>(got);
      if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) return socket_error(errno);
    }
    if (Result<void> ready = wait(events, limit); !ready) return unexpected(std::move(ready).error());
  }
}

Result<void> Wire::write(std::string_view bytes, WaitLimit limit) {
  while (!bytes.empty()) {
    short events = POLLOUT;
    if (tls_) {
      const ThirdPartyCall call;
      if (!call) return process_ends();
      ERR_clear_error();
      const int put = SSL_write(tls_.get(), bytes.data(), static_cast<int>(std::min<std::size_t>(bytes.size(), INT_MAX)));
      if (put > 0) {
        bytes.remove_prefix(static_cast<std::size_t>(put));
        continue;
      }
      const int error = errno;
      const int why = SSL_get_error(tls_.get(), put);
      if (why == SSL_ERROR_SYSCALL && error != 0) {
        ERR_clear_error();
        return socket_error(error);
      }
      if (why == SSL_ERROR_WANT_READ) events = POLLIN;
      else if (why != SSL_ERROR_WANT_WRITE) return unexpected(Errc::closed, tls_reason(tls_.get(), "it closed the connection"));
    } else {
      const auto put = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (put >= 0) {
        bytes.remove_prefix(static_cast<std::size_t>(put));
        continue;
      }
      if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) return socket_error(errno);
    }
    if (Result<void> ready = wait(events, limit); !ready) return ready;
  }
  return {};
}

bool Wire::is_idle() {
  char byte = 0;
  if (tls_) {  // reads TLS messages such as session tickets
    const ThirdPartyCall call;
    if (!call) return false;
    ERR_clear_error();
    const int got = SSL_read(tls_.get(), &byte, 1);
    const bool idle = got <= 0 && SSL_get_error(tls_.get(), got) == SSL_ERROR_WANT_READ;
    ERR_clear_error();
    return idle;
  }
  return ::recv(descriptor_, &byte, 1, MSG_PEEK) < 0 && (errno == EAGAIN || errno == EWOULDBLOCK);
}

void Wire::end() noexcept {
  const ThirdPartyCall call;
  if (!tls_ || !call) return;
  ERR_clear_error();
  SSL_shutdown(tls_.get());
  ERR_clear_error();
}

}  // namespace lrt::exchange

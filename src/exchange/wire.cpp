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

Result<std::unique_ptr<Wire>> Wire::begin(const Address& address, std::uint16_t port) {
  const int descriptor = ::socket(address.socket.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (descriptor < 0) return unexpected(Errc::io_error, system_message(errno));
  std::unique_ptr<Wire> wire(new Wire(descriptor));
  const int on = 1;
  ::setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  sockaddr_storage to = address.socket;
  if (to.ss_family == AF_INET) reinterpret_cast<sockaddr_in&>(to).sin_port = htons(port);
  else reinterpret_cast<sockaddr_in6&>(to).sin6_port = htons(port);
  if (::connect(descriptor, reinterpret_cast<const sockaddr*>(&to), address.size) != 0 && errno != EINPROGRESS)
    return unexpected(Errc::io_error, system_message(errno));
  return wire;
}

Result<Needs> Wire::try_connect() {
  pollfd item{descriptor_, POLLOUT, 0};
  if (::poll(&item, 1, 0) == 0) return Needs::writable;
  int error = 0;
  socklen_t size = sizeof error;
  if (::getsockopt(descriptor_, SOL_SOCKET, SO_ERROR, &error, &size) != 0) error = errno;
  if (error != 0) return unexpected(Errc::io_error, system_message(error));
  return Needs::nothing;
}

Result<std::unique_ptr<Wire>> Wire::open(const Address& address, std::uint16_t port, WaitLimit limit) {
  Result<std::unique_ptr<Wire>> wire = begin(address, port);
  while (wire) {
    const Result<Needs> needs = (*wire)->try_connect();
    if (!needs) return unexpected(needs.error());
    if (*needs == Needs::nothing) break;
    if (Result<void> ready = (*wire)->wait(*needs, limit); !ready) return unexpected(std::move(ready).error());
  }
  return wire;
}

Wire::~Wire() {
  tls_.reset();
  ::close(descriptor_);
}

Result<void> Wire::wait(Needs needs, WaitLimit limit) const {
  pollfd items[2] = {{descriptor_, static_cast<short>(needs == Needs::readable ? POLLIN : POLLOUT), 0}, {limit.stop_descriptor, POLLIN, 0}};
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

Result<void> Wire::begin_secure(const ClientTls& tls, const std::string& host) {
  tls_ = tls.session(descriptor_, host);
  if (!tls_) return unexpected(Errc::io_error, "TLS: OpenSSL cannot make a session for " + host);
  return {};
}

Result<Needs> Wire::try_secure() {
  const ThirdPartyCall call;
  if (!call) return process_ends();
  ERR_clear_error();
  const int done = SSL_do_handshake(tls_.get());
  if (done == 1) return Needs::nothing;
  const int error = errno;
  const int why = SSL_get_error(tls_.get(), done);
  if (why == SSL_ERROR_WANT_READ) return Needs::readable;
  if (why == SSL_ERROR_WANT_WRITE) return Needs::writable;
  return unexpected(Errc::io_error, tls_reason(tls_.get(), done != 0 && error != 0 ? system_message(error) : "the receiver closed the connection"));
}

Result<void> Wire::secure(const ClientTls& tls, const std::string& host, WaitLimit limit) {
  if (Result<void> begun = begin_secure(tls, host); !begun) return begun;
  while (true) {
    const Result<Needs> needs = try_secure();
    if (!needs) return unexpected(needs.error());
    if (*needs == Needs::nothing) return {};
    if (Result<void> ready = wait(*needs, limit); !ready) return ready;
  }
}

Result<Moved> Wire::try_read(char* to, std::size_t size) {
  size = std::min<std::size_t>(size, INT_MAX);
  if (!tls_) {
    const auto got = ::recv(descriptor_, to, size, 0);
    if (got >= 0) return Moved{static_cast<std::size_t>(got), Needs::nothing};
    if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) return socket_error(errno);
    return Moved{0, Needs::readable};
  }
  const ThirdPartyCall call;
  if (!call) return process_ends();
  ERR_clear_error();
  const int got = SSL_read(tls_.get(), to, static_cast<int>(size));
  if (got > 0) return Moved{static_cast<std::size_t>(got), Needs::nothing};
  const int error = errno;
  switch (SSL_get_error(tls_.get(), got)) {
    case SSL_ERROR_ZERO_RETURN: return Moved{};
    case SSL_ERROR_WANT_READ: return Moved{0, Needs::readable};
    case SSL_ERROR_WANT_WRITE: return Moved{0, Needs::writable};
    case SSL_ERROR_SYSCALL:
      ERR_clear_error();
      return got == 0 || error == 0 ? unexpected(Errc::closed, "it closed the connection") : socket_error(error);
    default: return unexpected(Errc::closed, tls_reason(tls_.get(), "TLS failed"));
  }
}

Result<std::size_t> Wire::read(char* to, std::size_t size, WaitLimit limit) {
  while (true) {
    // Checked before each read: a receiver that sends byte by byte gets no extra time.
    if (limit.until <= std::chrono::steady_clock::now()) return unexpected(Errc::timed_out, "timed out");
    Result<Moved> moved = try_read(to, size);
    if (!moved) return unexpected(std::move(moved).error());
    if (moved->needs == Needs::nothing) return moved->bytes;
    if (Result<void> ready = wait(moved->needs, limit); !ready) return unexpected(std::move(ready).error());
  }
}

Result<Moved> Wire::try_write(std::string_view bytes) {
  if (!tls_) {
    const auto put = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (put >= 0) return Moved{static_cast<std::size_t>(put), Needs::nothing};
    if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) return socket_error(errno);
    return Moved{0, Needs::writable};
  }
  const ThirdPartyCall call;
  if (!call) return process_ends();
  ERR_clear_error();
  const int put = SSL_write(tls_.get(), bytes.data(), static_cast<int>(std::min<std::size_t>(bytes.size(), INT_MAX)));
  if (put > 0) return Moved{static_cast<std::size_t>(put), Needs::nothing};
  const int error = errno;
  switch (SSL_get_error(tls_.get(), put)) {
    case SSL_ERROR_WANT_READ: return Moved{0, Needs::readable};
    case SSL_ERROR_WANT_WRITE: return Moved{0, Needs::writable};
    case SSL_ERROR_SYSCALL:
      if (error != 0) {
        ERR_clear_error();
        return socket_error(error);
      }
      [[fallthrough]];
    default: return unexpected(Errc::closed, tls_reason(tls_.get(), "it closed the connection"));
  }
}

Result<void> Wire::write(std::string_view bytes, WaitLimit limit) {
  while (!bytes.empty()) {
    const Result<Moved> moved = try_write(bytes);
    if (!moved) return unexpected(moved.error());
    bytes.remove_prefix(moved->bytes);
    if (moved->needs == Needs::nothing) continue;
    if (Result<void> ready = wait(moved->needs, limit); !ready) return ready;
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

// SPDX-License-Identifier: Apache-2.0
#include "src/transport/http/listener.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>
#include <string>
#include <utility>

#include "src/base/resolve.hpp"
#include "src/transport/http/connection.hpp"

namespace lrt::transport {
namespace {

constexpr int backlog = 4096;  // the system has a limit of its own
constexpr int accepts_per_turn = 16;
/// Idle connections that are tried for one without pending input, which is closed.
constexpr int max_tried = 16;
constexpr int discards_at_once = 16;
constexpr std::chrono::milliseconds pause_time{100};
constexpr std::string_view overloaded = "HTTP/1.1 503 Service Unavailable\r\nContent-Length: 0\r\nRetry-After: 1\r\nConnection: close\r\n\r\n";

int open_reserve() noexcept { return ::open("/dev/null", O_RDONLY | O_CLOEXEC); }

std::uint16_t port_of(const sockaddr_storage& address) noexcept {
  return ntohs(address.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6&>(address).sin6_port
                                             : reinterpret_cast<const sockaddr_in&>(address).sin_port);
}

/// "127.0.0.1" also for an IPv4 client of an IPv6 socket.
std::string numeric_address(const sockaddr_storage& address) {
  char text[INET6_ADDRSTRLEN] = "";
  if (address.ss_family == AF_INET) {
    ::inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in&>(address).sin_addr, text, sizeof text);
  } else if (address.ss_family == AF_INET6) {
    const auto& v6 = reinterpret_cast<const sockaddr_in6&>(address).sin6_addr;
    if (IN6_IS_ADDR_V4MAPPED(&v6)) ::inet_ntop(AF_INET, v6.s6_addr + 12, text, sizeof text);
    else ::inet_ntop(AF_INET6, &v6, text, sizeof text);
  }
  return text;
}

/// Does not wait: a client whose request comes later may see a reset instead of the response. A client that expects TLS gets no response.
void refuse_at_once(const Socket& socket, bool secure) noexcept {
  const int descriptor = socket.descriptor();
  [[maybe_unused]] const auto sent = secure ? 0 : ::send(descriptor, overloaded.data(), overloaded.size(), MSG_NOSIGNAL);
  ::shutdown(descriptor, SHUT_WR);
  char discarded[4096];
  for (int turn = 0; turn<discards_at_once&& ::recv(descriptor, discarded, sizeof discarded, 0)> 0; ++turn) {}
}

}  // namespace

Listener::~Listener() { close(); }

Result<void> Listener::open() {
  const auto& options = loop_.options;
  std::optional<Address> wanted = lrt::numeric_address(options.address);
  if (!wanted) return unexpected(Errc::invalid_option, "address \"" + options.address + "\": expected a numeric IPv4 or IPv6 address");

  const auto failed = [&](const char* step) -> Result<void> {
    const int error = errno;
    loop_.readiness.close(socket_);
    return unexpected(error == EADDRINUSE ? Errc::address_in_use : Errc::io_error,
                      "address " + options.address + ", port " + std::to_string(options.port) + ": " + step + ": " + std::strerror(error));
  };
  wanted->set_port(options.port);
  socket_ = Socket(::socket(wanted->socket.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, IPPROTO_TCP));
  if (!socket_.is_open()) return failed("socket");
  const int on = 1;
  if (::setsockopt(socket_.descriptor(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0) return failed("SO_REUSEADDR");
  if (::bind(socket_.descriptor(), wanted->get(), wanted->size) != 0) return failed("bind");
  if (::listen(socket_.descriptor(), backlog) != 0) return failed("listen");
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  if (::getsockname(socket_.descriptor(), reinterpret_cast<sockaddr*>(&address), &size) != 0) return failed("getsockname");
  if (!loop_.readiness.watch(socket_, *this, EPOLLIN)) return failed("epoll_ctl");
  port_ = port_of(address);
  fill_reserve();
  resumes_at_.reset();
  return {};
}

void Listener::close() {
  Watched::unlink();
  loop_.readiness.close(socket_);
  for (const int descriptor : reserve_) ::close(descriptor);
  reserve_.clear();
  port_ = 0;
  resumes_at_.reset();
}

void Listener::resume(TimePoint now) {
  if (!resumes_at_ || *resumes_at_ > now.steady) return;
  if (loop_.readiness.watch(socket_, *this, EPOLLIN)) resumes_at_.reset();
  else resumes_at_ = now.steady + pause_time;
}

void Listener::pause(const char* reason) {
  loop_.log(LogLevel::warning, std::string("accepting connections pauses: ") + reason);
  resumes_at_ = loop_.clock.now().steady + pause_time;
  loop_.readiness.watch(socket_, *this, 0);
}

void Listener::on_ready(std::uint32_t) {
  if (!socket_.is_open() || resumes_at_) return;
  bool closed_one = false;  // without effect if descriptors are not what is missing
  for (int turn = 0; turn < accepts_per_turn; ++turn) {
    sockaddr_storage address{};
    socklen_t size = sizeof address;
    Socket accepted(::accept4(socket_.descriptor(), reinterpret_cast<sockaddr*>(&address), &size, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (accepted.is_open()) {
      closed_one = false;
      admit(std::move(accepted), address, false);
      if (loop_.readiness.is_over()) break;
      continue;
    }
    switch (errno) {
      case EAGAIN: return;
      case EMFILE:
      case ENFILE:
        if ((!std::exchange(closed_one, true) && close_idle()) || accept_with_reserve()) continue;
        return pause(std::strerror(EMFILE));
      case ENOBUFS:
      case ENOMEM: return pause(std::strerror(errno));
      default: break;  // the client has disconnected, or its network had an error (accept(2))
    }
  }
  loop_.readiness.later(*this);
}

/// @param scarce  the descriptor is one of the reserve
void Listener::admit(Socket socket, const sockaddr_storage& address, bool scarce) {
  const int descriptor = socket.descriptor();
  const auto now = loop_.clock.now();
  std::string peer = numeric_address(address);
  const int on = 1;
  ::setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  const bool secure = loop_.options.tls.has_value();
  auto place = loop_.addresses.take(peer);
  const bool full = scarce || !place || (!is_below_limit() && !close_idle());
  const bool reserves = full && make_reserve();
  if (full && !reserves && (scarce || loop_.refused >= max_refused)) return refuse_at_once(socket, secure);
  std::unique_ptr<TlsStream> tls;
  if (secure && !(tls = loop_.tls.make(descriptor))) return loop_.log(LogLevel::warning, "a connection is closed: no memory for TLS");
  if (full) place.reset();
  const auto connection =
      std::make_shared<Connection>(loop_, std::move(socket), std::move(peer), std::move(place).value_or(Addresses::Place()), std::move(tls));
  if (reserves) connection->open_reserved(now, scarce);
  else if (full) connection->open_refused(now);
  else connection->open(now);
}

/// Whether a reserved connection is free. If none is, the one that has waited for its request for longest is refused.
bool Listener::make_reserve() {
  const std::size_t max = loop_.options.limits.reserved_connections;
  while (loop_.reserved_count >= max) {
    if (loop_.reserved.empty()) return false;
    auto& longest = loop_.reserved.front();
    longest.read_pending();
    if (loop_.reserved_count < max) break;
    if (!loop_.reserved.empty() && &loop_.reserved.front() == &longest) longest.leave_reserve(loop_.clock.now());
    if (!loop_.reserved.empty() && &loop_.reserved.front() == &longest) return false;
  }
  return true;
}

bool Listener::is_below_limit() const noexcept {
  return loop_.clients.size() - loop_.refused - loop_.reserved_count < loop_.options.limits.max_connections;
}

/// Closes the connection that has been idle for longest. A connection with a request that on_ready() has not seen is not idle: the request is
/// served now.
bool Listener::close_idle() {
  const std::size_t before = loop_.clients.size();
  Connection* served = nullptr;
  for (int tried = 0; tried < max_tried && !loop_.idle.empty(); ++tried) {
    auto& longest = loop_.idle.front();
    longest.read_pending();
    if (loop_.clients.size() < before) return true;  // it was closed before
    if (longest.is_idle() && &loop_.idle.front() == &longest) {
      longest.close();
      return true;
    }
    if (!served && longest.is_idle()) served = &longest;
    if (loop_.readiness.is_over()) break;
  }
  if (served) served->close();
  return served != nullptr;
}

void Listener::fill_reserve() {
  const std::size_t wanted = std::max<std::size_t>(1, loop_.options.limits.reserved_connections);
  while (reserve_.size() < wanted) {
    const int descriptor = open_reserve();
    if (descriptor < 0) return;
    reserve_.push_back(descriptor);
  }
}

/// Accepts one client with a reserve descriptor, or with that of the reserved connection that has waited longest.
bool Listener::accept_with_reserve() {
  fill_reserve();
  if (!reserve_.empty()) {
    ::close(reserve_.back());
    reserve_.pop_back();
  } else if (!loop_.reserved.empty()) {
    auto& longest = loop_.reserved.front();
    longest.read_pending();
    if (!loop_.reserved.empty() && &loop_.reserved.front() == &longest) longest.close();
  } else {
    return false;
  }
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  Socket accepted(::accept4(socket_.descriptor(), reinterpret_cast<sockaddr*>(&address), &size, SOCK_NONBLOCK | SOCK_CLOEXEC));
  const bool has_accepted = accepted.is_open();
  if (has_accepted) admit(std::move(accepted), address, true);
  fill_reserve();
  return has_accepted;
}

}  // namespace lrt::transport

#include "src/transport/asio/listener.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "src/transport/asio/connection.hpp"

namespace lrt::transport {
namespace {

constexpr int accepts_per_turn = 16;
/// Clients over the limit that are told so with patience at one time; those beyond get `no_room` and are closed.
constexpr std::size_t refused_at_once = 64;
/// Idle connections that are looked at for one that has nothing pending, to make room.
constexpr int looks_for_room = 16;
constexpr int discards_at_once = 16;
constexpr std::chrono::milliseconds pause_time{100};
constexpr std::string_view no_room =
    "HTTP/1.1 503 Service Unavailable\r\nContent-Length: 0\r\nRetry-After: 1\r\nConnection: close\r\n\r\n";

int open_reserve() noexcept { return ::open("/dev/null", O_RDONLY | O_CLOEXEC); }

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

/// Without waiting: what the client sends later meets a closed connection, and it may lose the answer over that. One that expects TLS
/// gets none.
void refuse_at_once(int descriptor, bool secure) noexcept {
  [[maybe_unused]] const auto sent = secure ? 0 : ::send(descriptor, no_room.data(), no_room.size(), MSG_NOSIGNAL);
  ::shutdown(descriptor, SHUT_WR);
  char discarded[4096];
  for (int turn = 0; turn < discards_at_once && ::recv(descriptor, discarded, sizeof discarded, 0) > 0; ++turn) {}
  ::close(descriptor);
}

}  // namespace

Listener::Listener(Loop& loop) : loop_(loop), acceptor_(loop.io) {}

Listener::~Listener() { close(); }

Result<void> Listener::open() {
  namespace ip = boost::asio::ip;
  boost::system::error_code error;
  const auto& options = loop_.options;
  const auto address = ip::make_address(options.address, error);
  if (error)
    return unexpected(Errc::invalid_option, "address \"" + options.address + "\": expected a numeric IPv4 or IPv6 address");

  const ip::tcp::endpoint endpoint(address, options.port);
  const auto failed = [&](const char* step) -> Result<void> {
    boost::system::error_code ignored;
    acceptor_.close(ignored);
    const auto code = error == boost::asio::error::address_in_use ? Errc::address_in_use : Errc::io_error;
    return unexpected(
        code, "address " + options.address + ", port " + std::to_string(options.port) + ": " + step + ": " + error.message());
  };
  protocol_ = endpoint.protocol();
  if (acceptor_.open(protocol_, error)) return failed("socket");
  ::fcntl(acceptor_.native_handle(), F_SETFD, FD_CLOEXEC);
  if (acceptor_.set_option(Acceptor::reuse_address(true), error)) return failed("SO_REUSEADDR");
  if (acceptor_.non_blocking(true, error)) return failed("non-blocking");
  if (acceptor_.bind(endpoint, error)) return failed("bind");
  if (acceptor_.listen(Acceptor::max_listen_connections, error)) return failed("listen");
  const auto bound = acceptor_.local_endpoint(error);
  if (error) return failed("getsockname");
  port_ = bound.port();
  reserve_ = open_reserve();
  resumes_at_.reset();
  wait();
  return {};
}

void Listener::close() {
  boost::system::error_code ignored;
  acceptor_.close(ignored);
  if (reserve_ >= 0) ::close(reserve_);
  reserve_ = -1;
  port_ = 0;
  resumes_at_.reset();
}

void Listener::resume(TimePoint now) {
  if (!resumes_at_ || *resumes_at_ > now.steady) return;
  resumes_at_.reset();
  wait();
}

void Listener::pause(const char* reason) {
  loop_.log(LogLevel::warning, std::string("accepting connections pauses: ") + reason);
  resumes_at_ = loop_.clock.now().steady + pause_time;
}

void Listener::wait() {
  acceptor_.async_wait(Acceptor::wait_read, [this](const boost::system::error_code& error) {
    if (!error) accept_some();
  });
}

void Listener::accept_some() {
  for (int turn = 0; turn < accepts_per_turn; ++turn) {
    sockaddr_storage address{};
    socklen_t size = sizeof address;
    const int descriptor =
        ::accept4(acceptor_.native_handle(), reinterpret_cast<sockaddr*>(&address), &size, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (descriptor >= 0) {
      admit(descriptor, numeric_address(address));
      if (loop_.readiness.is_over()) break;
      continue;
    }
    switch (errno) {
      case EAGAIN: return wait();
      case EMFILE:
      case ENFILE:
        if (refuse_with_reserve()) continue;
        return pause(std::strerror(EMFILE));
      case ENOBUFS:
      case ENOMEM: return pause(std::strerror(errno));
      default: break;  // the client is gone already, or its network had an error (accept(2))
    }
  }
  wait();
}

void Listener::admit(int descriptor, std::string peer) {
  const auto now = loop_.clock.now();
  const int on = 1;
  ::setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  const bool secure = loop_.options.tls.has_value();
  auto place = loop_.addresses.take(peer);
  const bool full = !place || (!has_room() && !make_room());
  if (full && loop_.refused >= refused_at_once) return refuse_at_once(descriptor, secure);
  std::unique_ptr<TlsStream> tls;
  if (secure && !(tls = loop_.tls.make(descriptor))) {
    ::close(descriptor);
    return loop_.log(LogLevel::warning, "a connection is dropped: no memory for TLS");
  }
  Socket socket(loop_.io);
  boost::system::error_code error;
  if (socket.assign(protocol_, descriptor, error)) {
    ::close(descriptor);
    return pause(error.message().c_str());
  }
  if (full) place.reset();
  const auto connection =
      std::make_shared<Connection>(loop_, std::move(socket), std::move(peer), std::move(place).value_or(Addresses::Place()), std::move(tls));
  if (full) connection->open_refused(now);
  else connection->open(now);
}

bool Listener::has_room() const noexcept {
  return loop_.clients.size() - loop_.refused < loop_.options.limits.connections;
}

/// Closes the connection that has been idle longest. One whose next request has arrived unnoticed is not idle: it is served now, as
/// it would have been soon.
bool Listener::make_room() {
  Connection* served = nullptr;
  for (int look = 0; look < looks_for_room && !loop_.idle.empty(); ++look) {
    auto& longest = static_cast<Connection&>(loop_.idle.front());
    longest.on_ready(false);
    if (has_room()) return true;  // it was gone
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

/// Accepts one client with the descriptor that was kept for this, to tell it that there are no more.
bool Listener::refuse_with_reserve() {
  if (reserve_ < 0) {
    reserve_ = open_reserve();
    return false;
  }
  ::close(reserve_);
  const int descriptor = ::accept4(acceptor_.native_handle(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  const bool refused = descriptor >= 0;
  if (refused) refuse_at_once(descriptor, loop_.options.tls.has_value());
  reserve_ = open_reserve();
  return refused;
}

}  // namespace lrt::transport

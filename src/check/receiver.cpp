// SPDX-License-Identifier: Apache-2.0
#include "src/check/receiver.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <lrt/base/iri.hpp>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <system_error>

#include "src/base/ascii.hpp"
#include "src/base/random.hpp"
#include "src/base/resolve.hpp"
#include "src/http/form.hpp"

namespace lrt::check {
namespace {

using Instant = std::chrono::steady_clock::time_point;
using std::chrono::milliseconds;

constexpr milliseconds connection_time{5'000};  // of one connection of the server
constexpr std::size_t max_header_bytes = 64 * 1024;
constexpr std::size_t max_notifications = 100;

std::string system_message() { return std::system_category().message(errno); }

/// Bytes of a connection, until a time and until the descriptor `stop` is readable.
class Input {
 public:
  Input(int connection, int stop, std::size_t max)
      : connection_(connection), stop_(stop), max_(max), until_(std::chrono::steady_clock::now() + connection_time) {}

  bool more() {
    const auto rest = std::chrono::ceil<milliseconds>(until_ - std::chrono::steady_clock::now()).count();
    pollfd items[2] = {{connection_, POLLIN, 0}, {stop_, POLLIN, 0}};
    if (rest <= 0 || bytes.size() > max_ || ::poll(items, 2, static_cast<int>(rest)) <= 0 || items[1].revents != 0) return false;
    char buffer[16 * 1024];
    const auto got = ::recv(connection_, buffer, sizeof buffer, 0);
    if (got <= 0) return false;
    bytes.append(buffer, static_cast<std::size_t>(got));
    return true;
  }
  std::string bytes;

 private:
  int connection_, stop_;
  std::size_t max_;
  Instant until_;
};

std::optional<std::string> read_chunked(Input& in) {
  std::string body;
  while (true) {
    std::size_t end = 0;
    while ((end = in.bytes.find("\r\n")) == std::string::npos)
      if (!in.more()) return std::nullopt;
    std::size_t size = 0;
    const auto result = std::from_chars(in.bytes.data(), in.bytes.data() + end, size, 16);
    if (result.ec != std::errc() || size > 64 * 1024 * 1024) return std::nullopt;
    in.bytes.erase(0, end + 2);
    while (in.bytes.size() < size + 2)
      if (!in.more()) return std::nullopt;
    if (size == 0) return body;
    body.append(in.bytes, 0, size);
    in.bytes.erase(0, size + 2);
  }
}

}  // namespace

Result<std::unique_ptr<Receiver>> Receiver::open(const std::string& address, std::size_t max_bytes, const ThreadOptions& threads) {
  std::string host = address;
  std::uint16_t port = 0;
  const std::size_t colon = address.rfind(':');
  if (colon != std::string::npos && (address.find(':') == colon || (colon > 0 && address[colon - 1] == ']'))) {
    const auto result = std::from_chars(address.data() + colon + 1, address.data() + address.size(), port);
    if (result.ec != std::errc() || result.ptr != address.data() + address.size())
      return unexpected(Errc::invalid_option, "callback_address: expected an address with a port, found \"" + address + "\"");
    host.resize(colon);
  }
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  sockaddr_storage storage{};
  socklen_t size = 0;
  auto& v4 = reinterpret_cast<sockaddr_in&>(storage);
  auto& v6 = reinterpret_cast<sockaddr_in6&>(storage);
  if (::inet_pton(AF_INET, host.c_str(), &v4.sin_addr) == 1) {
    storage.ss_family = AF_INET;
    v4.sin_port = htons(port);
    size = sizeof v4;
  } else if (::inet_pton(AF_INET6, host.c_str(), &v6.sin6_addr) == 1) {
    storage.ss_family = AF_INET6;
    v6.sin6_port = htons(port);
    size = sizeof v6;
  } else {
    return unexpected(Errc::invalid_option, "callback_address: expected a numeric address, found \"" + host + "\"");
  }
  std::unique_ptr<Receiver> receiver(new Receiver());
  receiver->max_bytes_ = max_bytes;
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return unexpected(Errc::io_error, system_message());
  receiver->stop_read_ = ends[0];
  receiver->stop_write_ = ends[1];
  receiver->listener_ = ::socket(storage.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int on = 1;
  if (receiver->listener_ >= 0) ::setsockopt(receiver->listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (receiver->listener_ < 0 || ::bind(receiver->listener_, reinterpret_cast<const sockaddr*>(&storage), size) != 0 ||
      ::listen(receiver->listener_, 16) != 0 || ::getsockname(receiver->listener_, reinterpret_cast<sockaddr*>(&storage), &size) != 0)
    return unexpected(Errc::io_error, "callback_address " + address + ": " + system_message());
  port = ntohs(storage.ss_family == AF_INET ? v4.sin_port : v6.sin6_port);
  receiver->path_ = "/lrt-check-" + random_hex(6);
  receiver->url_ = "http://" + (storage.ss_family == AF_INET ? host : "[" + host + "]") + ":" + std::to_string(port) + receiver->path_;
  Result<Thread> thread = start_thread("lrt-receiver", threads, [r = receiver.get()] { r->run(); });
  if (!thread) return unexpected(std::move(thread).error());
  receiver->thread_ = *std::move(thread);
  return receiver;
}

Receiver::~Receiver() {
  if (stop_write_ >= 0) (void)!::write(stop_write_, "", 1);
  thread_.join();
  for (const int descriptor : {listener_, stop_read_, stop_write_})
    if (descriptor >= 0) ::close(descriptor);
}

void Receiver::run() {
  while (true) {
    pollfd items[2] = {{listener_, POLLIN, 0}, {stop_read_, POLLIN, 0}};
    if (::poll(items, 2, -1) < 0 && errno != EINTR) return;
    if (items[1].revents != 0) return;
    const int connection = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (connection < 0) continue;
    try {
      serve(connection);
    } catch (...) {  // out of memory: the server gets no response
    }
    ::close(connection);
  }
}

void Receiver::serve(int connection) {
  Input in(connection, stop_read_, max_bytes_ + max_header_bytes);
  std::size_t end = 0;
  while ((end = in.bytes.find("\r\n\r\n")) == std::string::npos)
    if (in.bytes.size() > max_header_bytes || !in.more()) return;
  const std::string header = in.bytes.substr(0, end + 2);
  in.bytes.erase(0, end + 4);
  Notification notification;
  const std::string_view line = std::string_view(header).substr(0, header.find("\r\n"));
  for (std::size_t at = line.size() + 2; at < header.size();) {
    const std::size_t stop = header.find("\r\n", at), colon = header.find(':', at);
    if (colon < stop)
      notification.fields.add(std::string_view(header).substr(at, colon - at),
                              lrt::detail::trim(std::string_view(header).substr(colon + 1, stop - colon - 1)));
    at = stop + 2;
  }
  const std::string_view method = line.substr(0, line.find(' '));
  std::string_view target = line.substr(std::min(line.find(' ') + 1, line.size()));
  target = target.substr(0, target.find(' '));
  if (notification.fields.find("Expect")) (void)::send(connection, "HTTP/1.1 100 Continue\r\n\r\n", 25, MSG_NOSIGNAL);
  if (notification.fields.find("Transfer-Encoding")) {
    std::optional<std::string> body = read_chunked(in);
    if (!body) return;
    notification.body = *std::move(body);
  } else if (const auto length = notification.fields.find("Content-Length")) {
    std::size_t size = 0;
    if (std::from_chars(length->data(), length->data() + length->size(), size).ec != std::errc() || size > max_bytes_) return;
    while (in.bytes.size() < size)
      if (!in.more()) return;
    notification.body = in.bytes.substr(0, size);
  }
  std::string response = "HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";
  const bool mine = target.substr(0, target.find('?')) == path_;
  if (mine && (method == "POST" || method == "PUT")) {
    response = "HTTP/1.1 204 No Content\r\nConnection: close\r\n\r\n";
    notification.text = header + "\r\n" + notification.body;
    const std::lock_guard<std::mutex> lock(mutex_);
    if (notifications_.size() < max_notifications) notifications_.push_back(std::move(notification));
    arrived_.notify_all();
  } else if (mine && method == "GET") {
    const std::string challenge = http::query_parameter(target, "hub.challenge", http::Plus::space).value_or("");
    response = "HTTP/1.1 200 OK\r\nContent-Type: text/plain\r\nConnection: close\r\nContent-Length: " + std::to_string(challenge.size()) +
               "\r\n\r\n" + challenge;
  }
  (void)::send(connection, response.data(), response.size(), MSG_NOSIGNAL);
}

std::optional<Receiver::Notification> Receiver::wait(Instant until) {
  std::unique_lock<std::mutex> lock(mutex_);
  if (!arrived_.wait_until(lock, until, [this] { return !notifications_.empty(); })) return std::nullopt;
  std::optional<Notification> first = std::move(notifications_.front());
  notifications_.pop_front();
  return first;
}

}  // namespace lrt::check

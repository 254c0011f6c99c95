// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "tests/support/message.hpp"

namespace lrt::test {

/// An HTTP/1.1 client on one connection to 127.0.0.1.
class Socket {
 public:
  /// What stands between the messages and the connection, such as TLS. Driven by the socket.
  class Layer {
   public:
    virtual ~Layer() = default;
    virtual void write(std::string_view text) = 0;         ///< the client's, to be given to the connection some time
    virtual std::string give() = 0;                        ///< what the connection is to get now
    virtual std::string take(std::string_view bytes) = 0;  ///< what came from the connection, as the server wrote it
  };

  explicit Socket(std::uint16_t port, std::unique_ptr<Layer> layer = nullptr)
      : descriptor_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)), layer_(std::move(layer)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::connect(descriptor_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) throw std::runtime_error("connect failed");
  }
  ~Socket() { ::close(descriptor_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  /// Sends a request written as for RequestText. Small requests only: it fits into the socket's buffer.
  void send(const std::string& text) {
    RequestText request(text);
    const http::Request& r = request.get();
    std::string bytes = header_of(r);
    if (!r.body.empty() || r.find("Content-Type")) bytes += "Content-Length: " + std::to_string(r.body.size()) + "\r\n";
    write(bytes.append("\r\n").append(r.body));
  }
  /// Sends the header section of a request with a body, which is to follow.
  void send_header(const std::string& text, std::size_t body_bytes, bool expects_continue) {
    RequestText request(text);
    write(header_of(request.get()) + "Content-Length: " + std::to_string(body_bytes) + (expects_continue ? "\r\nExpect: 100-continue" : "") +
          "\r\n\r\n");
  }
  void write(std::string_view bytes) {
    if (!layer_) return put(bytes);
    layer_->write(bytes);
    pass({});
  }

  /// The response if it is complete now. Waits at most `wait` for bytes.
  std::optional<Answer> receive(std::chrono::milliseconds wait = std::chrono::milliseconds(0)) {
    if (auto answer = parse()) return answer;
    pollfd item{descriptor_, POLLIN, 0};
    if (ended_ || ::poll(&item, 1, static_cast<int>(wait.count())) <= 0) return std::nullopt;
    char buffer[64 * 1024];
    const auto n = ::recv(descriptor_, buffer, sizeof buffer, 0);
    if (n <= 0) ended_ = true;
    else if (layer_) pass({buffer, static_cast<std::size_t>(n)});
    else received_.append(buffer, static_cast<std::size_t>(n));
    return parse();
  }

  /// Sends and waits, at most a minute; `meanwhile` is called again and again.
  Answer ask(
      const std::string& text, const std::function<void()>& meanwhile = [] {}) {
    send(text);
    return await(meanwhile);
  }
  Answer await(const std::function<void()>& meanwhile = [] {}) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (true) {
      meanwhile();
      if (auto answer = receive(std::chrono::milliseconds(1))) return *std::move(answer);
      if (ended_) throw std::runtime_error("closed without an answer");
      if (std::chrono::steady_clock::now() > until) throw std::runtime_error("no answer in a minute");
    }
  }
  bool ended() const noexcept { return ended_; }

 private:
  std::optional<Answer> parse() {
    const std::size_t end = received_.find("\r\n\r\n");
    if (end == std::string::npos) return std::nullopt;
    Answer answer;
    answer.status = std::atoi(received_.c_str() + 9);
    for (std::size_t at = received_.find("\r\n") + 2; at < end + 2;) {
      const std::size_t stop = received_.find("\r\n", at), colon = received_.find(": ", at);
      answer.fields.add(std::string_view(received_).substr(at, colon - at), std::string_view(received_).substr(colon + 2, stop - colon - 2));
      at = stop + 2;
    }
    const std::size_t length = head_ ? 0 : std::strtoul(answer.field("Content-Length").c_str(), nullptr, 10);
    if (received_.size() < end + 4 + length) return std::nullopt;
    answer.body = received_.substr(end + 4, length);
    received_.erase(0, end + 4 + length);
    return answer;
  }
  std::string header_of(const http::Request& r) {
    std::string bytes(r.method);
    bytes.append(" ").append(r.target).append(" HTTP/1.1\r\n");
    for (const http::Field& f : r.fields) bytes.append(f.name).append(": ").append(f.value).append("\r\n");
    head_ = r.method == "HEAD";
    return bytes;
  }
  void put(std::string_view bytes) {
    for (std::size_t sent = 0; sent < bytes.size();) {
      const auto n = ::send(descriptor_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (n < 0 && errno != EINTR) throw std::runtime_error("send failed");
      if (n > 0) sent += static_cast<std::size_t>(n);
    }
  }
  void pass(std::string_view bytes) {
    received_ += layer_->take(bytes);
    put(layer_->give());
  }

  int descriptor_;
  std::unique_ptr<Layer> layer_;
  std::string received_;
  bool head_ = false, ended_ = false;
};

}  // namespace lrt::test

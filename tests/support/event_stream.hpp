// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace lrt::test {

/// An event as a page gets it.
struct Event {
  std::string id, data;
  friend bool operator==(const Event& a, const Event& b) { return a.id == b.id && a.data == b.data; }
};

/// Reads an event stream as a browser does (WHATWG HTML 9.2.6).
class EventParser {
 public:
  void read(std::string_view bytes) {
    for (const char c : bytes) {
      const bool ends = c == '\r' || (c == '\n' && !after_cr_);
      if (c != '\r' && c != '\n') line_ += c;
      after_cr_ = c == '\r';
      if (ends) end_line(std::exchange(line_, {}));
    }
  }
  std::vector<Event> take() { return std::exchange(events_, {}); }
  std::size_t comments = 0;

 private:
  void end_line(const std::string& line) {
    if (line.empty()) {
      if (!data_.empty()) {
        data_.pop_back();
        events_.push_back({id_, std::exchange(data_, {})});
      }
      return;
    }
    const std::size_t colon = line.find(':');
    if (colon == 0) {
      ++comments;
      return;
    }
    const std::string name = line.substr(0, colon);
    std::string value = colon == std::string::npos ? std::string() : line.substr(colon + 1);
    if (!value.empty() && value[0] == ' ') value.erase(0, 1);
    if (name == "data") data_ += value + "\n";
    if (name == "id" && value.find('\0') == std::string::npos) id_ = value;
  }

  std::string line_, data_, id_;
  std::vector<Event> events_;
  bool after_cr_ = false;
};

/// A client that reads an event stream from its socket.
class StreamClient {
 public:
  StreamClient(std::uint16_t port, const std::string& path, const std::string& fields = {}, int minor = 1)
      : descriptor_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::connect(descriptor_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) throw std::runtime_error("connect failed");
    const std::string request = "GET " + path + " HTTP/1." + std::to_string(minor) + "\r\nHost: 127.0.0.1:" + std::to_string(port) +
                                "\r\nAccept: text/event-stream\r\n" + fields + "\r\n";
    if (::send(descriptor_, request.data(), request.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(request.size()))
      throw std::runtime_error("send failed");
  }
  ~StreamClient() { close(); }
  StreamClient(const StreamClient&) = delete;
  StreamClient& operator=(const StreamClient&) = delete;

  void close() {
    if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
  }
  /// Reads what has arrived; waits a little for something.
  void step() {
    pollfd item{descriptor_, POLLIN, 0};
    if (ended || ::poll(&item, 1, 1) <= 0) return;
    char buffer[64 * 1024];
    const auto n = ::recv(descriptor_, buffer, sizeof buffer, 0);
    if (n <= 0) {
      ended = true;
      return;
    }
    received_.append(buffer, static_cast<std::size_t>(n));
    if (header.empty()) {
      const std::size_t end = received_.find("\r\n\r\n");
      if (end == std::string::npos) return;
      header = received_.substr(0, end + 2);
      status = std::atoi(header.c_str() + 9);
      received_.erase(0, end + 4);
    }
    if (header.find("chunked") == std::string::npos) return parser_.read(std::exchange(received_, {}));
    while (true) {
      const std::size_t line = received_.find("\r\n");
      if (line == std::string::npos) return;
      const std::size_t size = std::strtoul(received_.c_str(), nullptr, 16);
      if (received_.size() < line + 4 + size) return;
      parser_.read(std::string_view(received_).substr(line + 2, size));
      received_.erase(0, line + 4 + size);
      finished |= size == 0;
    }
  }
  std::vector<Event> take() { return parser_.take(); }

  int status = 0;
  std::string header;
  bool finished = false, ended = false;  ///< by the last chunk; by the end of the connection

 private:
  int descriptor_;
  std::string received_;
  EventParser parser_;
};

}  // namespace lrt::test

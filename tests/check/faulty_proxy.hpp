// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <deque>
#include <functional>
#include <list>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>

#include <lrt/rdf/codec.hpp>

#include "tests/support/fields.hpp"

namespace lrt::test {

/// A listening socket on a port of its own.
class Listener {
 public:
  explicit Listener(std::uint32_t address = INADDR_LOOPBACK) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(address);
    socklen_t size = sizeof at;
    if (::bind(socket_, reinterpret_cast<const sockaddr*>(&at), size) != 0 || ::listen(socket_, 64) != 0 ||
        ::getsockname(socket_, reinterpret_cast<sockaddr*>(&at), &size) != 0)
      throw std::runtime_error("no listener");
    port_ = ntohs(at.sin_port);
  }
  ~Listener() { ::close(socket_); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  std::uint16_t port() const noexcept { return port_; }
  /// A connection, or -1 after `wait_ms`.
  int accept(int wait_ms) const {
    pollfd item{socket_, POLLIN, 0};
    return ::poll(&item, 1, wait_ms) > 0 ? ::accept4(socket_, nullptr, nullptr, SOCK_CLOEXEC) : -1;
  }

 private:
  int socket_;
  std::uint16_t port_ = 0;
};

/// A request as a proxy has seen it.
struct Asked {
  std::string method, target, header;
  std::size_t index = 0, count = 1;  ///< among those that came at once
  bool has(std::string_view text) const { return header.find(text) != std::string::npos; }
};

/// What a proxy changes. Each function may be empty.
struct Fault {
  std::function<void(std::string& bytes)> request{};                          ///< what the client has sent at once
  std::function<void(const Asked& asked, std::string& response)> response{};  ///< a complete response; empty: it is not sent
  std::function<bool(const Asked& asked)> closes{};                           ///< whether the connection ends after the response
  std::function<void(std::string&bytes)> to_server{}, to_client{};            ///< frames of a WebSocket that came at once
};

/// Stands between a client and a server, and makes the server faulty.
class FaultyProxy {
 public:
  explicit FaultyProxy(std::uint32_t address = INADDR_LOOPBACK) : listener_(address) {}
  ~FaultyProxy() {
    ended_ = true;
    if (thread_.joinable()) thread_.join();
    for (std::thread& t : connections_) t.join();
  }
  FaultyProxy(const FaultyProxy&) = delete;
  FaultyProxy& operator=(const FaultyProxy&) = delete;

  std::uint16_t port() const noexcept { return listener_.port(); }
  void start(std::uint16_t server, Fault fault) {
    server_ = server;
    fault_ = std::move(fault);
    thread_ = std::thread([this] {
      while (!ended_)
        if (const int client = listener_.accept(5); client >= 0) connections_.emplace_back([this, client] { Connection(*this, client).run(); });
    });
  }

 private:
  class Connection {
   public:
    Connection(FaultyProxy& proxy, int client) : proxy_(proxy), client_(client), server_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
      sockaddr_in at{};
      at.sin_family = AF_INET;
      at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      at.sin_port = htons(proxy.server_);
      open_ = ::connect(server_, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0;
    }
    ~Connection() {
      ::close(client_);
      ::close(server_);
    }
    Connection(const Connection&) = delete;
    Connection& operator=(const Connection&) = delete;

    void run() {
      while (open_ && !proxy_.ended_) {
        pollfd items[2] = {{client_, POLLIN, 0}, {server_, POLLIN, 0}};
        if (::poll(items, 2, 5) <= 0) continue;
        if (items[1].revents != 0) from_server();
        else if (items[0].revents != 0) from_client();
      }
    }

   private:
    static void put(int to, std::string_view bytes) {
      while (!bytes.empty()) {
        const auto n = ::send(to, bytes.data(), bytes.size(), MSG_NOSIGNAL);
        if (n <= 0) return;
        bytes.remove_prefix(static_cast<std::size_t>(n));
      }
    }
    /// Reads all that is there.
    bool get(int from, std::string& bytes) const {
      char buffer[64 * 1024];
      const auto n = ::recv(from, buffer, sizeof buffer, 0);
      if (n <= 0) return false;
      bytes.append(buffer, static_cast<std::size_t>(n));
      while (true) {
        const auto more = ::recv(from, buffer, sizeof buffer, MSG_DONTWAIT);
        if (more <= 0) return true;
        bytes.append(buffer, static_cast<std::size_t>(more));
      }
    }

    void from_client() {
      std::string bytes;
      if (!get(client_, bytes)) {
        open_ = false;
        return;
      }
      if (websocket_) {
        if (proxy_.fault_.to_server) proxy_.fault_.to_server(bytes);
      } else {
        note(bytes);
        if (proxy_.fault_.request) proxy_.fault_.request(bytes);
      }
      put(server_, bytes);
    }
    /// Remembers the requests. A body is not told from a request; it has no such line.
    void note(const std::string& bytes) {
      const std::size_t before = asked_.size();
      for (std::size_t at = 0; at < bytes.size();) {
        const std::size_t line = bytes.find("\r\n", at), end = bytes.find("\r\n\r\n", at);
        const std::string first = bytes.substr(at, line - at);
        const std::size_t space = first.find(' ');
        if (first.find(" HTTP/1.") != std::string::npos && space != std::string::npos)
          asked_.push_back({first.substr(0, space), first.substr(space + 1, first.find(' ', space + 1) - space - 1), bytes.substr(at, end - at + 2),
                            asked_.size() - before, 1});
        if (end == std::string::npos) break;
        at = end + 4;
      }
      for (std::size_t i = before; i < asked_.size(); ++i) asked_[i].count = asked_.size() - before;
    }

    /// An event stream, whose events come as they are.
    static bool is_stream(const std::string& response) {
      const std::string_view header = std::string_view(response).substr(0, response.find("\r\n\r\n"));
      return header.find("text/event-stream") != header.npos && header.find("Content-Length") == header.npos;
    }

    void from_server() {
      if (!get(server_, received_)) {
        put(client_, received_);
        open_ = false;
        return;
      }
      while (!websocket_ && !streams_ && !received_.empty()) {
        const std::size_t end = received_.find("\r\n\r\n");
        if (end == std::string::npos) return;
        const int status = std::atoi(received_.c_str() + 9);
        Asked asked;
        if (!asked_.empty()) asked = asked_.front();
        const std::size_t field = received_.find("\r\nContent-Length: ");
        std::size_t size = end + 4;
        if (status != 101 && asked.method != "HEAD" && status != 204 && status != 304 && field < end)
          size += std::strtoul(received_.c_str() + field + 18, nullptr, 10);
        if (received_.size() < size) return;
        std::string response = received_.substr(0, size);
        received_.erase(0, size);
        if (status != 100 && !asked_.empty()) asked_.pop_front();
        const bool was_stream = is_stream(response);
        if (proxy_.fault_.response) proxy_.fault_.response(asked, response);
        put(client_, response);
        websocket_ = status == 101;
        streams_ = was_stream && !response.empty();
        if (!streams_ && proxy_.fault_.closes && proxy_.fault_.closes(asked)) open_ = false;
      }
      if ((!websocket_ && !streams_) || received_.empty()) return;
      if (websocket_ && proxy_.fault_.to_client) proxy_.fault_.to_client(received_);
      put(client_, received_);
      received_.clear();
    }

    FaultyProxy& proxy_;
    int client_, server_;
    bool open_ = false, websocket_ = false, streams_ = false;
    std::deque<Asked> asked_;
    std::string received_;
  };

  Listener listener_;
  std::uint16_t server_ = 0;
  Fault fault_;
  std::atomic<bool> ended_{false};
  std::list<std::thread> connections_;
  std::thread thread_;
};

// ------------------------------------------------------------------------------------------------------------------- for the functions

inline bool replace(std::string& text, std::string_view from, std::string_view to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) return false;
  text.replace(at, from.size(), to);
  return true;
}

inline int status_of(const std::string& response) { return std::atoi(response.c_str() + 9); }
inline void set_status(std::string& response, int status) { response.replace(9, 3, std::to_string(status)); }

inline void drop_field(std::string& message, std::string_view name) {
  while (true) {
    const std::size_t at = message.find("\r\n" + std::string(name) + ": ");
    if (at == std::string::npos || at > message.find("\r\n\r\n")) return;
    message.erase(at, message.find("\r\n", at + 2) - at);
  }
}
inline void add_field(std::string& message, const std::string& line) { message.insert(message.find("\r\n\r\n"), "\r\n" + line); }
inline void set_field(std::string& message, std::string_view name, const std::string& value) {
  drop_field(message, name);
  add_field(message, std::string(name) + ": " + value);
}

inline std::string body_of(const std::string& message) { return message.substr(message.find("\r\n\r\n") + 4); }
/// Another body, whose parts the server does not know.
inline void set_body(std::string& message, const std::string& body) {
  drop_field(message, "Accept-Ranges");
  message.resize(message.find("\r\n\r\n") + 4);
  set_field(message, "Content-Length", std::to_string(body.size()));
  message += body;
}

/// Changes the graph of a response, in whatever syntax it is.
inline void edit_graph(const Asked& asked, std::string& response, const std::function<void(const rdf::Graph& from, rdf::Graph& to)>& edit) {
  const std::string field = field_of(response, "Content-Type");
  const auto syntax = rdf::syntax_of(field.substr(0, field.find(';')));
  if (syntax && asked.method == "HEAD") drop_field(response, "Content-Length");  // which is that of another body
  if (!syntax || asked.method != "GET" || status_of(response) != 200) return;
  const auto graph = rdf::read(body_of(response), *syntax, {"http://robot.example/"});
  if (!graph) return;
  rdf::Graph edited;
  edit(*graph, edited);
  if (const auto text = rdf::write(edited, *syntax)) set_body(response, *text);
}
/// Removes the triples for which `is` is true.
inline void strip(const Asked& asked, std::string& response,
                  const std::function<bool(rdf::TermView subject, rdf::TermView predicate, rdf::TermView object)>& is) {
  edit_graph(asked, response, [&](const rdf::Graph& from, rdf::Graph& to) {
    for (const rdf::Triple& t : from.triples())
      if (!is(from.term(t.subject), from.term(t.predicate), from.term(t.object)))
        to.add(from.term(t.subject), from.term(t.predicate), from.term(t.object));
  });
}

/// The response becomes one without a body.
inline void set_empty(std::string& response, int status) {
  set_status(response, status);
  for (const char* name : {"Content-Length", "Content-Type", "Accept-Ranges"}) drop_field(response, name);
  response.resize(response.find("\r\n\r\n") + 4);
}

/// Receives the callbacks of a server, changes them and hands them to their receiver.
class CallbackRelay {
 public:
  /// @param change  the body and the fields of the n-th callback, from 0; false: it is dropped
  using ChangeFunction = std::function<bool(std::size_t n, std::string& header, std::string& body)>;
  explicit CallbackRelay(ChangeFunction change) : change_(std::move(change)), thread_([this] { run(); }) {}
  ~CallbackRelay() {
    ended_ = true;
    thread_.join();
  }
  CallbackRelay(const CallbackRelay&) = delete;
  CallbackRelay& operator=(const CallbackRelay&) = delete;

  /// Names the relay instead of the receiver in a subscribing request.
  void rewrite_request(std::string& request) {
    const std::string callback = field_of(request, "Callback"), local = "http://127.0.0.1:";
    if (callback.compare(0, local.size(), local) != 0) return;
    const int receiver = std::atoi(callback.c_str() + local.size());
    receiver_ = receiver;
    set_field(request, "Callback", local + std::to_string(listener_.port()) + callback.substr(callback.find('/', local.size())));
  }
  /// Names the receiver again. Both ports have five digits, so that no length changes.
  void rewrite_response(std::string& response) const {
    const std::string mine = ":" + std::to_string(listener_.port()) + "/lrt-check-", theirs = ":" + std::to_string(receiver_.load()) + "/lrt-check-";
    while (mine.size() == theirs.size() && replace(response, mine, theirs)) {}
  }

 private:
  void run() {
    std::size_t n = 0;
    while (!ended_) {
      const int connection = listener_.accept(5);
      if (connection < 0) continue;
      std::string bytes;
      char buffer[64 * 1024];
      std::size_t whole = std::string::npos;
      while (bytes.size() < whole) {
        const auto got = ::recv(connection, buffer, sizeof buffer, 0);
        if (got <= 0) break;
        bytes.append(buffer, static_cast<std::size_t>(got));
        if (const std::size_t end = bytes.find("\r\n\r\n"); end != std::string::npos)
          whole = end + 4 + std::strtoul(field_of(bytes, "Content-Length").c_str(), nullptr, 10);
      }
      std::string body = body_of(bytes), header = bytes.substr(0, bytes.find("\r\n\r\n") + 4);
      if (change_(n++, header, body)) {
        set_field(header, "Content-Length", std::to_string(body.size()));
        set_field(header, "Connection", "close");
        sockaddr_in at{};
        at.sin_family = AF_INET;
        at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        at.sin_port = htons(static_cast<std::uint16_t>(receiver_.load()));
        const int receiver = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
        if (::connect(receiver, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0) {
          const std::string all = header + body;
          (void)!::send(receiver, all.data(), all.size(), MSG_NOSIGNAL);
          while (::recv(receiver, buffer, sizeof buffer, 0) > 0) {}
        }
        ::close(receiver);
      }
      constexpr std::string_view done = "HTTP/1.1 204 No Content\r\nConnection: close\r\n\r\n";
      (void)!::send(connection, done.data(), done.size(), MSG_NOSIGNAL);
      ::close(connection);
    }
  }

  Listener listener_;
  ChangeFunction change_;
  std::atomic<int> receiver_{0};
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

}  // namespace lrt::test

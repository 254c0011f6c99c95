// SPDX-License-Identifier: Apache-2.0
#pragma once

// What the transport tests share: a handler that defers on demand, a clock that is moved by hand, a raw client, and a parser of responses.

#include <arpa/inet.h>
#include <fcntl.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <deque>
#include <memory>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/base/clock.hpp>
#include <lrt/engine/handler.hpp>
#include <lrt/transport/named.hpp>
#include <lrt/transport/transport.hpp>

#include "src/http/target.hpp"
#include "tests/support/catch.hpp"

namespace lrt::test {

/// The transport under test: "http", or the one that the environment names in LRT_TEST_TRANSPORT.
inline std::unique_ptr<transport::Transport> make_network(transport::TransportOptions options) {
  const char* const name = std::getenv("LRT_TEST_TRANSPORT");
  auto made = transport::make_named(name != nullptr ? name : "http", std::move(options));
  if (!made) throw std::runtime_error(std::string("this build has no transport ") + name);
  return made;
}

class HandClock final : public Clock {
 public:
  TimePoint now() const noexcept override {
    const auto since = std::chrono::milliseconds(milliseconds_.load());
    return {std::chrono::steady_clock::time_point(std::chrono::hours(1) + since),
            std::chrono::system_clock::time_point(std::chrono::seconds(784111777) + since)};
  }
  void advance(std::chrono::milliseconds by) { milliseconds_ += by.count(); }

 private:
  std::atomic<std::int64_t> milliseconds_{0};
};

/// GET / sends hello; POST / echoes; /head sends the request's header section; /defer responds after complete(); /big?n has n bytes;
/// /none is 204, /same 304; /stop is a stop; anything else 404.
class TestHandler : public engine::Handler {
 public:
  bool is_stop(const http::Request& request) noexcept override { return request.target == "/stop"; }
  engine::Outcome handle(const http::Request& request, TimePoint) override {
    ++requests;
    peer = std::string(request.peer);
    const auto target = http::split_target(request.target);
    const auto path = target ? target->path : std::string_view();
    if (path == "/defer") {
      const auto ticket = engine::Ticket{++last_ticket_};
      open.push_back(ticket);
      return engine::Deferred{ticket};
    }
    http::Response response;
    response.fields.add("Content-Type", "text/plain");
    if (path == "/head") {
      std::string text(request.method);
      text.append(" ").append(request.target).append("\n");
      for (const auto& field : request.fields) text.append(field.name).append("=").append(field.value).append("\n");
      response.set_body(std::move(text));
    } else if (path == "/big") {
      response.set_body(std::string(std::strtoul(std::string(target->query).c_str(), nullptr, 10), 'b'));
    } else if (path == "/stop") {
      response.set_body("stopped");
    } else if (path == "/none" || path == "/same") {
      response.status = path == "/none" ? 204 : 304;
    } else if (path == "/" || path == "*") {
      response.set_body(request.body.empty() ? "hello" : std::string(request.body));
    } else {
      response.status = 404;
    }
    return response;
  }
  std::optional<engine::Reply> next_reply(TimePoint) override {
    const std::lock_guard lock(mutex_);
    if (ready_.empty()) return std::nullopt;
    auto reply = std::move(ready_.front());
    ready_.pop_front();
    return reply;
  }
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const override { return std::nullopt; }
  void abandon(engine::Ticket ticket) noexcept override { abandoned.push_back(ticket); }
  void input_ended(engine::Ticket ticket) noexcept override { ended.push_back(ticket); }

  /// From any thread; the transport must be woken after it.
  void complete(engine::Ticket ticket, std::string body) {
    http::Response response;
    response.set_body(std::move(body));
    const std::lock_guard lock(mutex_);
    ready_.push_back({ticket, std::move(response)});
  }

  std::size_t requests = 0;
  std::string peer;
  std::vector<engine::Ticket> open;
  std::vector<engine::Ticket> abandoned, ended;

 private:
  std::uint64_t last_ticket_ = 0;
  std::mutex mutex_;
  std::deque<engine::Reply> ready_;
};

/// Refuses every request by its header section, or admits bodies up to a limit.
class HeaderJudge final : public TestHandler {
 public:
  engine::HeaderVerdict judge_header(const http::Request& request, std::optional<std::uint64_t> body_bytes, TimePoint) override {
    ++judged;
    declared = body_bytes;
    CHECK(request.body.empty());
    CHECK_FALSE(request.find("Content-Length"));
    if (!status) return {std::nullopt, max_body_bytes, false, mark};
    http::Response response;
    response.status = *status;
    response.set_body("refused");
    return {std::move(response)};
  }
  engine::Outcome handle(const http::Request& request, TimePoint now) override {
    was_judged = request.judged == mark;
    return TestHandler::handle(request, now);
  }
  std::optional<int> status;
  std::size_t max_body_bytes = 1'000'000;
  std::size_t judged = 0;
  std::optional<std::uint64_t> declared;
  const std::shared_ptr<const void> mark = std::make_shared<int>();  ///< of the verdict; comes back with the request
  bool was_judged = false;
};

/// An IPv4 address of this machine that is not a loopback address. Empty: there is none.
inline std::string outer_address() {
  std::string address;
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return address;
  for (const auto* at = all; at != nullptr && address.empty(); at = at->ifa_next) {
    if (at->ifa_addr == nullptr || at->ifa_addr->sa_family != AF_INET) continue;
    char text[INET_ADDRSTRLEN] = "";
    ::inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(at->ifa_addr)->sin_addr, text, sizeof text);
    if (std::string_view(text).substr(0, 4) != "127.") address = text;
  }
  ::freeifaddrs(all);
  return address;
}

inline std::string post_of(std::size_t bytes, const std::string& fields = {}) {
  return "POST / HTTP/1.1\r\nHost: a\r\n" + fields + "Content-Length: " + std::to_string(bytes) + "\r\n\r\n";
}

struct Answer {
  int status = 0;
  std::string head;
  std::string body;
  bool complete = false;
};

inline bool contains(std::string_view text, std::string_view part) { return text.find(part) != std::string_view::npos; }

/// Parses a stream of responses. Interim responses are left out. `heads` are the indices of responses to HEAD requests.
inline std::vector<Answer> parse_answers(std::string_view bytes, const std::set<std::size_t>& heads = {}) {
  std::vector<Answer> answers;
  while (!bytes.empty()) {
    Answer answer;
    const auto end = bytes.find("\r\n\r\n");
    if (end == std::string_view::npos) {
      answer.head = std::string(bytes);
      answers.push_back(answer);
      break;
    }
    answer.head = std::string(bytes.substr(0, end + 4));
    bytes.remove_prefix(end + 4);
    answer.status = answer.head.compare(0, 9, "HTTP/1.1 ") == 0 ? std::atoi(answer.head.c_str() + 9) : -1;
    if (answer.status == 100) continue;
    std::size_t length = 0;
    const auto field = answer.head.find("\r\nContent-Length: ");
    if (field != std::string::npos && heads.count(answers.size()) == 0) { length = std::strtoul(answer.head.c_str() + field + 18, nullptr, 10); }
    answer.body = std::string(bytes.substr(0, length));
    answer.complete = answer.body.size() == length;
    bytes.remove_prefix(answer.body.size());
    answers.push_back(std::move(answer));
  }
  return answers;
}

inline std::vector<int> statuses(const std::vector<Answer>& answers) {
  std::vector<int> result;
  for (const auto& answer : answers) result.push_back(answer.complete ? answer.status : 0);
  return result;
}

/// A TCP client that never blocks: step() sends and receives what is possible now.
class RawClient {
 public:
  explicit RawClient(std::uint16_t port, const char* address = "127.0.0.1", int receive_buffer = 0) {
    sockaddr_storage storage{};
    socklen_t size = sizeof(sockaddr_in);
    if (std::string_view(address).find(':') != std::string_view::npos) {
      auto& v6 = reinterpret_cast<sockaddr_in6&>(storage);
      v6.sin6_family = AF_INET6;
      v6.sin6_port = htons(port);
      ::inet_pton(AF_INET6, address, &v6.sin6_addr);
      size = sizeof(sockaddr_in6);
    } else {
      auto& v4 = reinterpret_cast<sockaddr_in&>(storage);
      v4.sin_family = AF_INET;
      v4.sin_port = htons(port);
      ::inet_pton(AF_INET, address, &v4.sin_addr);
    }
    socket_ = ::socket(storage.ss_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (receive_buffer > 0) ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    if (::connect(socket_, reinterpret_cast<sockaddr*>(&storage), size) != 0) throw std::runtime_error("connect failed");
    ::fcntl(socket_, F_SETFL, O_NONBLOCK);
  }
  RawClient(RawClient&& other) noexcept
      : received(std::move(other.received)), ended(other.ended), failed(other.failed), socket_(other.socket_), out_(std::move(other.out_)) {
    other.socket_ = -1;
  }
  ~RawClient() { close(); }

  void send(std::string_view bytes) { out_ += bytes; }

  void step() {
    if (socket_ < 0) return;
    if (!out_.empty()) {
      const auto sent = ::send(socket_, out_.data(), out_.size(), MSG_NOSIGNAL);
      if (sent > 0) out_.erase(0, static_cast<std::size_t>(sent));
      else if (errno != EAGAIN) out_.clear(), send_failed = true;
    }
    if (paused) return;
    char buffer[16 * 1024];
    for (;;) {
      const auto got = ::recv(socket_, buffer, sizeof buffer, 0);
      if (got > 0) {
        received.append(buffer, static_cast<std::size_t>(got));
        continue;
      }
      if (got == 0) ended = true;
      else if (errno != EAGAIN) ended = failed = true;
      return;
    }
  }

  bool all_sent() const { return out_.empty(); }
  void half_close() { ::shutdown(socket_, SHUT_WR); }
  void close() {
    if (socket_ >= 0) ::close(socket_);
    socket_ = -1;
  }
  /// Ends with RST, as a crash of the client's machine or a close with unread data would.
  void reset() {
    const linger hard{1, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_LINGER, &hard, sizeof hard);
    close();
  }

  std::string received;
  bool ended = false;   ///< the server closed
  bool failed = false;  ///< ... with RST
  bool send_failed = false;
  bool paused = false;  ///< does not read

 private:
  int socket_ = -1;
  std::string out_;
};

inline std::string get(std::string_view path, std::string_view more = {}) {
  return "GET " + std::string(path) + " HTTP/1.1\r\nHost: robot\r\n" + std::string(more) + "\r\n";
}

/// A transport that is driven by the test's own thread, in between the steps of its clients.
struct TestHost {
  explicit TestHost(std::unique_ptr<transport::Transport> made) : TestHost(std::move(made), nullptr) {}
  /// @param other  serves instead of `handler`
  TestHost(std::unique_ptr<transport::Transport> made, engine::Handler* other) : server(std::move(made)) {
    if (const auto started = server->start(other ? *other : handler); !started) throw std::runtime_error(started.error().message);
  }
  RawClient client(int receive_buffer = 0) { return RawClient(server->port(), "127.0.0.1", receive_buffer); }

  /// Polls until `reached`, but no longer than anything here can take.
  template <class Reached>
  bool run(std::initializer_list<RawClient*> clients, Reached reached) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (std::chrono::steady_clock::now() < end) {
      for (auto* const client : clients) client->step();
      if (reached()) return true;
      server->poll(std::chrono::milliseconds(1), std::chrono::milliseconds(1));
    }
    return false;
  }
  bool run_to_end(RawClient& client) {
    return run({&client}, [&] { return client.ended; });
  }
  bool run_to_answers(RawClient& client, std::size_t count, const std::set<std::size_t>& heads = {}) {
    return run({&client}, [&] {
      const auto answers = parse_answers(client.received, heads);
      return answers.size() >= count && answers[count - 1].complete;
    });
  }
  bool run_until_handled(RawClient& client, std::size_t requests) {
    return run({&client}, [&] { return handler.requests >= requests; });
  }
  /// Lets everything happen that can happen without a wait.
  void settle() {
    for (int i = 0; i < 20; ++i) server->poll(std::chrono::milliseconds(1), std::chrono::milliseconds(1));
  }
  void complete(std::size_t index, std::string body) {
    handler.complete(handler.open.at(index), std::move(body));
    server->waker()->wake();
  }
  /// Another client is served.
  bool is_well() {
    auto other = client();
    other.send(get("/", "Connection: close\r\n"));
    return run_to_end(other) && statuses(parse_answers(other.received)) == std::vector{200};
  }

  TestHandler handler;
  std::unique_ptr<transport::Transport> server;
};

}  // namespace lrt::test

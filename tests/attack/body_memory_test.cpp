// SPDX-License-Identifier: Apache-2.0
// Clients that send bodies and never finish them. LRT_ATTACK_CLIENTS says how many there are; the figures are printed.

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <lrt/server.hpp>
#include <lrt/transport/named.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/socket.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

constexpr std::size_t body_bytes = 1'000'000;

std::size_t client_count() {
  const char* const given = std::getenv("LRT_ATTACK_CLIENTS");
  return given ? std::strtoul(given, nullptr, 10) : 120;
}

/// Of this process, in MB.
double resident() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.compare(0, 6, "VmRSS:") == 0) return std::strtod(line.c_str() + 6, nullptr) / 1000;
  return 0;
}

/// Sends all but the last byte of a body, and reads what comes.
class Unfinished {
 public:
  Unfinished(std::uint16_t port, const std::string& header) : out_(header), socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) throw std::runtime_error("connect failed");
    ::fcntl(socket_, F_SETFL, O_NONBLOCK);
  }
  ~Unfinished() { ::close(socket_); }
  Unfinished(const Unfinished&) = delete;
  Unfinished& operator=(const Unfinished&) = delete;

  /// True if something was sent or received.
  bool step() {
    static const std::string zeros(64 * 1024, ' ');
    const std::size_t left = header_sent_ ? body_bytes - 1 - sent_ : out_.size();
    bool moved = false;
    if (left > 0 && status() == 0) {
      const auto n = ::send(socket_, header_sent_ ? zeros.data() : out_.data(), std::min(left, header_sent_ ? zeros.size() : left), MSG_NOSIGNAL);
      if (n > 0) {
        moved = true;
        if (header_sent_) sent_ += static_cast<std::size_t>(n);
        header_sent_ = true;
      }
    }
    char buffer[4096];
    const auto n = ::recv(socket_, buffer, sizeof buffer, 0);
    if (n > 0) received_.append(buffer, static_cast<std::size_t>(n));
    return moved || n > 0;
  }
  /// Of the response; 0: none has come.
  int status() const { return received_.size() < 12 ? 0 : std::atoi(received_.c_str() + 9); }
  bool has_retry_after() const { return received_.find("Retry-After: ") != std::string::npos; }
  std::size_t sent() const noexcept { return sent_; }

 private:
  std::string out_, received_;
  const int socket_;
  bool header_sent_ = false;
  std::size_t sent_ = 0;
};

/// Runs the clients until each has its response, or some have and nothing moves any more.
void run(std::vector<std::unique_ptr<Unfinished>>& clients) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  auto quiet = std::chrono::steady_clock::now();
  for (bool open = true, refused = false; open && (!refused || std::chrono::steady_clock::now() < quiet) && std::chrono::steady_clock::now() < end;) {
    bool moved = false;
    open = false;
    for (auto& client : clients) {
      moved |= client->step();
      (client->status() == 0 ? open : refused) = true;
    }
    if (moved) quiet = std::chrono::steady_clock::now() + std::chrono::seconds(1);
    else std::this_thread::yield();
  }
}

struct Robot {
  explicit Robot(const std::string& transport) {
    rlimit files{};
    ::getrlimit(RLIMIT_NOFILE, &files);
    files.rlim_cur = files.rlim_max;
    ::setrlimit(RLIMIT_NOFILE, &files);
    Options options;
    options.listen.port = 0;
    options.listen.transport = [transport](transport::TransportOptions o) { return transport::make_named(transport, std::move(o)); };
    options.threads.dispatch = Dispatch::io_thread;
    options.security.authorize = [](const http::Request& request) {
      return request.find("Authorization") ? engine::Access::granted : engine::Access::unauthenticated;
    };
    limit = options.limits.max_total_body_bytes;
    server = std::make_unique<Server>(Server::create(std::move(options)).value());
    Thing thing{"arm"};
    thing.property("note", [this] { return note; }).on_write([this](std::string text) { note = std::move(text); });
    server->add(std::move(thing)).value();
  }
  std::string header(const std::string& fields) const {
    return "PUT /arm/note HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(server->port()) + "\r\nContent-Type: application/json\r\n" + fields +
           "Content-Length: " + std::to_string(body_bytes) + "\r\n\r\n";
  }
  /// The status of a small command of an authorized client.
  int command() const {
    Socket client(server->port());
    return client
        .ask("PUT /arm/note\nHost: 127.0.0.1:" + std::to_string(server->port()) + "\nAuthorization: me\nContent-Type: application/json\n\n\"hello\"")
        .status;
  }
  std::size_t limit = 0;
  std::string note;
  std::unique_ptr<Server> server;
};

struct Figures {
  std::size_t unauthorized = 0, refused = 0, kept_bytes = 0;
  bool all_say_when = true;
  int command = 0;
  double before = 0, during = 0, after = 0;
};

Figures attack(Robot& robot, const std::string& fields) {
  Figures f;
  f.command = robot.command();
  f.before = resident();
  std::vector<std::unique_ptr<Unfinished>> clients;
  for (std::size_t i = 0; i < client_count(); ++i) clients.push_back(std::make_unique<Unfinished>(robot.server->port(), robot.header(fields)));
  run(clients);
  f.during = resident();
  for (const auto& client : clients) {
    if (client->status() == 401) ++f.unauthorized;
    else if (client->status() == 503) ++f.refused, f.all_say_when &= client->has_retry_after();
    else if (client->status() == 0) f.kept_bytes += client->sent();
  }
  f.command = robot.command();
  clients.clear();
  // The server sees them leave after others that have something to say.
  for (int i = 0; i < 1000; ++i) {
    (void)robot.command();
    f.after = resident();
    if (f.after < f.before + 0.25 * (f.during - f.before)) break;
  }
  return f;
}

}  // namespace

TEST_CASE("bodies that never end use a bounded memory, and none before the client is authorized", "[attack][R0.2][R0.5]") {
  for (const std::string_view name : transport::names()) {
    const std::string transport(name);
    INFO(transport);
    Robot robot(transport);
    const Figures strangers = attack(robot, ""), friends = attack(robot, "Authorization: me\r\n");
    for (const auto& [who, f] : {std::pair("not authorized", &strangers), std::pair("authorized", &friends)})
      std::printf(
          "%s, %zu clients %s: %zu are refused with 401, %zu with 503, %.1f MB of bodies are kept; resident %.1f MB before, "
          "%.1f during, %.1f after\n",
          transport.c_str(), client_count(), who, f->unauthorized, f->refused, static_cast<double>(f->kept_bytes) / 1e6, f->before, f->during,
          f->after);
    CHECK(strangers.unauthorized == client_count());
    CHECK(strangers.kept_bytes == 0);
    CHECK(strangers.command == 204);
    CHECK(friends.refused > 0);
    CHECK(friends.all_say_when);
    CHECK(friends.kept_bytes <= robot.limit + body_bytes);  // and what is in the buffers of the last socket
    CHECK(friends.command == 204);
    if (lrt::test::is_sanitized) continue;  // it keeps memory that was freed, and more for each byte
    CHECK(friends.during - friends.before < 1.5 * static_cast<double>(robot.limit) / 1e6);
    CHECK(friends.after - friends.before < 0.5 * static_cast<double>(robot.limit) / 1e6);
  }
}

// SPDX-License-Identifier: Apache-2.0
#include <lrt/transport/transport.hpp>

#include <poll.h>

#include <deque>
#include <initializer_list>
#include <memory>
#include <thread>

#include "tests/support/catch.hpp"
#include "tests/support/websocket.hpp"
#include "tests/transport/harness.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::microseconds;
using std::chrono::milliseconds;

namespace {

/// A TestHandler whose channels, of /ws, say what is put into `news`, once `due` has come.
class Handler final : public engine::Handler {
 public:
  engine::Outcome handle(const http::Request& request, TimePoint now) override {
    if (request.target != "/ws") return inner.handle(request, now);
    channel = engine::Channel{1};
    return engine::Upgraded{*channel, {}};
  }
  std::optional<engine::Reply> next_reply(TimePoint now) override { return inner.next_reply(now); }
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const override { return due; }
  void abandon(engine::Ticket ticket) noexcept override { inner.abandon(ticket); }
  std::optional<engine::Channel> next_ready(TimePoint now) override {
    if (!due || *due > now.steady) return std::nullopt;
    due.reset();
    return channel;
  }
  std::optional<engine::Push> next_push(engine::Channel, TimePoint) override {
    if (news.empty()) return std::nullopt;
    auto text = std::make_shared<const std::string>(std::move(news.front()));
    news.pop_front();
    return engine::Push{std::move(text)};
  }
  void closed(engine::Channel) noexcept override { channel.reset(); }

  TestHandler inner;
  std::optional<engine::Channel> channel;
  std::deque<std::string> news;
  std::optional<std::chrono::steady_clock::time_point> due;
};

/// A host that sleeps in a poll() of its own until the transport's descriptor is readable, by the machine's clock.
struct Host {
  explicit Host(transport::Limits limits = {}, microseconds given_budget = milliseconds(1)) : budget(given_budget) {
    transport::TransportOptions options;
    options.port = 0;
    options.limits = limits;
    server = make_network(std::move(options));
    if (const auto started = server->start(handler); !started) throw std::runtime_error(started.error().message);
    item.fd = server->descriptor();
  }
  RawClient client() { return RawClient(server->port()); }

  /// Loopback delivers within the system calls: when no client has anything to do, only the descriptor can bring more.
  template <class Client, class Reached>
  bool run(std::initializer_list<Client*> clients, Reached reached) {
    for (;;) {
      for (auto* const client : clients) client->step();
      if (reached()) return true;
      if (::poll(&item, 1, 60'000) != 1) return false;  // for ever, but for a test
      ++wakes;
      server->poll(budget, milliseconds(0));
    }
  }
  bool run_to_answers(RawClient& client, std::size_t count) {
    return run({&client}, [&] {
      const auto answers = parse_answers(client.received);
      return answers.size() >= count && answers[count - 1].complete;
    });
  }
  bool is_quiet() {
    for (int i = 0; i < 10 && ::poll(&item, 1, 0) == 1; ++i) server->poll(budget, milliseconds(0));
    return ::poll(&item, 1, 0) == 0;
  }

  Handler handler;
  std::unique_ptr<transport::Transport> server;
  microseconds budget;
  pollfd item{-1, POLLIN, 0};
  std::size_t wakes = 0;
};

}  // namespace

TEST_CASE("a host that sleeps on the descriptor serves requests, and is not woken for nothing", "[transport]") {
  Host host;
  REQUIRE(host.item.fd >= 0);
  CHECK(host.server->descriptor() == host.item.fd);
  CHECK(host.is_quiet());
  auto client = host.client();
  for (std::size_t i = 1; i <= 100; ++i) {
    client.send(get("/"));
    REQUIRE(host.run_to_answers(client, i));
  }
  CHECK(host.wakes <= 103);  // accepting, and perhaps the alarm
  CHECK(host.is_quiet());
  host.server->stop();
  CHECK(host.server->descriptor() == -1);
  REQUIRE(host.server->start(host.handler));
  host.item.fd = host.server->descriptor();
  auto again = host.client();
  again.send(get("/"));
  REQUIRE(host.run_to_answers(again, 1));
}

TEST_CASE("the descriptor is readable after a wake from another thread", "[transport][threads]") {
  Host host;
  auto client = host.client();
  client.send(get("/defer"));
  REQUIRE(host.run({&client}, [&] { return !host.handler.inner.open.empty(); }));
  CHECK(host.is_quiet());
  std::thread other([&, waker = host.server->waker()] {
    host.handler.inner.complete(host.handler.inner.open[0], "from elsewhere");
    waker->wake();
  });
  const bool answered = host.run_to_answers(client, 1);
  other.join();
  REQUIRE(answered);
  CHECK(parse_answers(client.received)[0].body == "from elsewhere");
  CHECK(host.is_quiet());
}

TEST_CASE("the descriptor is readable when a time is over", "[transport]") {
  transport::Limits limits;
  limits.header_timeout = milliseconds(30);
  limits.linger_timeout = milliseconds(30);
  Host host(limits);
  auto silent = host.client();
  auto slow = host.client();
  slow.send("GET / HT");
  REQUIRE(host.run({&silent, &slow}, [&] { return silent.ended && !slow.received.empty(); }));
  CHECK(statuses(parse_answers(slow.received)) == std::vector{408});
  // Only the server sees the end of lingering.
  while (host.server->poll(milliseconds(1), milliseconds(0)) != milliseconds::max()) {
    REQUIRE(::poll(&host.item, 1, 20'000) == 1);
    REQUIRE(++host.wakes < 50);
  }
  CHECK(host.is_quiet());
}

TEST_CASE("the descriptor is readable when the handler has something due for a WebSocket", "[transport][R0.14]") {
  Host host;
  WebSocketClient client(host.server->port());
  client.send(WebSocketClient::handshake("/ws"));
  REQUIRE(host.run({&client}, [&] { return client.status == 101; }));
  for (std::size_t i = 1; i <= 5; ++i) {
    host.handler.news.push_back(std::to_string(i));
    host.handler.due = std::chrono::steady_clock::now() + microseconds(1500);
    if (i == 1) host.server->waker()->wake();  // as a handler does whose deadline becomes earlier
    else host.server->poll(milliseconds(1), milliseconds(0));
    REQUIRE(host.run({&client}, [&] { return client.frames.size() == i; }));
    CHECK(client.frames[i - 1].payload == std::to_string(i));
  }
  CHECK(host.wakes < 50);
  for (int i = 0; i < 100; ++i) host.handler.news.push_back(std::string(1000, 'n'));  // more than one turn
  host.handler.due = std::chrono::steady_clock::now();
  host.server->waker()->wake();
  REQUIRE(host.run({&client}, [&] { return client.frames.size() == 105; }));
  CHECK(host.is_quiet());
}

TEST_CASE("the descriptor stays readable while a budget leaves something over", "[transport]") {
  Host host({}, microseconds(0));
  SECTION("pipelined requests") {
    auto client = host.client();
    std::string requests;
    for (int i = 0; i < 200; ++i) requests += get("/");
    client.send(requests);
    REQUIRE(host.run_to_answers(client, 200));
    CHECK(host.wakes >= 100);
  }
  SECTION("deferred responses") {
    std::vector<RawClient> clients;
    for (std::size_t i = 1; i <= 5; ++i) {
      clients.push_back(host.client());
      clients.back().send(get("/defer"));
      REQUIRE(host.run({&clients.back()}, [&] { return host.handler.inner.requests == i; }));
    }
    for (const auto ticket : host.handler.inner.open) host.handler.inner.complete(ticket, "done");
    host.server->waker()->wake();
    for (auto& client : clients) REQUIRE(host.run_to_answers(client, 1));
  }
  SECTION("messages of a WebSocket") {
    WebSocketClient client(host.server->port());
    client.send(WebSocketClient::handshake("/ws"));
    for (int i = 0; i < 50; ++i) client.send(Frame{Frame::ping, std::to_string(i)});
    REQUIRE(host.run({&client}, [&] { return client.frames.size() == 50; }));
  }
  host.budget = milliseconds(1);
  CHECK(host.is_quiet());
}

TEST_CASE("the descriptor stays readable while a budget leaves clients whose time is over", "[transport]") {
  transport::Limits limits;
  limits.header_timeout = milliseconds(50);
  Host host(limits, microseconds(0));
  std::vector<RawClient> clients;
  for (int i = 0; i < 40; ++i) clients.push_back(host.client());
  for (auto& client : clients) REQUIRE(host.run({&client}, [&] { return client.ended; }));
  host.budget = milliseconds(1);
  CHECK(host.is_quiet());
}

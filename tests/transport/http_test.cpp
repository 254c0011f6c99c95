// SPDX-License-Identifier: Apache-2.0
#include <lrt/transport/transport.hpp>

#include <sys/resource.h>

#include <cstdlib>
#include <memory>
#include <new>
#include <thread>

#include "tests/support/catch.hpp"
#include "tests/support/skip.hpp"
#include "tests/transport/framing_cases.hpp"
#include "tests/transport/harness.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;

namespace {

std::atomic<std::size_t> allocations{0};

}  // namespace

// Counted for the test that an idle poll() allocates nothing.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* const memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace {

transport::TransportOptions on_any_port() {
  transport::TransportOptions options;
  options.port = 0;
  options.limits.max_body_bytes = 1'000'000;
  options.limits.linger_timeout = milliseconds(300);
  options.limits.stop_timeout = milliseconds(200);
  return options;
}

struct Host : TestHost {
  explicit Host(transport::TransportOptions options = on_any_port()) : TestHost(make_network(std::move(options))) {}
};

}  // namespace

TEST_CASE("framing on the socket is as in the session, and the connection closes without losing the response", "[transport][R0.1]") {
  Host host;
  for (const auto& item : framing_cases()) {
    INFO(item.name);
    auto client = host.client();
    client.send(item.bytes);
    if (item.closes) {
      REQUIRE(host.run_to_end(client));
      CHECK_FALSE(client.failed);
    } else {
      REQUIRE(host.run_to_answers(client, item.statuses.size()));
      CHECK_FALSE(client.ended);
    }
    CHECK(statuses(parse_answers(client.received)) == item.statuses);
  }
}

TEST_CASE("framing on the socket does not depend on how the bytes arrive", "[transport][R0.1]") {
  Host host;
  for (const auto& item : framing_cases()) {
    if (item.bytes.size() > 1000) continue;  // the session's test splits the long ones
    INFO(item.name);
    auto client = host.client();
    for (const char byte : item.bytes) {
      client.send({&byte, 1});
      client.step();
      host.server->poll(milliseconds(1), milliseconds(0));
      if (client.ended) break;
    }
    REQUIRE((item.closes ? host.run_to_end(client) : host.run_to_answers(client, item.statuses.size())));
    CHECK(statuses(parse_answers(client.received)) == item.statuses);
  }
}

TEST_CASE("10 MiB of header section or body are refused with a response that the client reads", "[transport][R0.1]") {
  const std::string much(10 * 1024 * 1024, 'a');
  const std::pair<int, std::string> cases[] = {
      {414, "GET /" + much + " HTTP/1.1\r\nHost: a\r\n\r\n"},
      {431, "GET / HTTP/1.1\r\nHost: a\r\nX: " + much + "\r\n\r\n"},
      {413, "POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 10485760\r\n\r\n" + much},
      {413, "POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\nA00000\r\n" + much + "\r\n0\r\n\r\n"},
  };
  for (const auto& [status, bytes] : cases) {
    INFO(status);
    {
      Host host;  // a client that reads while it sends
      auto client = host.client();
      client.send(bytes);
      REQUIRE(host.run({&client}, [&] { return !parse_answers(client.received).empty(); }));
      REQUIRE(host.run_to_end(client));
      CHECK(statuses(parse_answers(client.received)) == std::vector{status});
    }
    {
      Host host;  // a client that sends all it can before it reads anything
      auto client = host.client();
      client.paused = true;
      client.send(bytes);
      REQUIRE(host.run({&client}, [&] { return client.all_sent(); }));
      client.paused = false;
      REQUIRE(host.run_to_end(client));
      CHECK(statuses(parse_answers(client.received)) == std::vector{status});
    }
  }
}

TEST_CASE("a body just within the limit arrives whole", "[transport]") {
  Host host;
  auto client = host.client();
  const std::string body(1'000'000, 'x');
  client.send("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 1000000\r\n\r\n" + body);
  REQUIRE(host.run_to_answers(client, 1));
  CHECK(parse_answers(client.received)[0].body == body);
  CHECK(host.handler.peer == "127.0.0.1");
}

TEST_CASE("pipelined requests get their responses in order with a deferred response among them", "[transport][R0.1]") {
  Host host;
  auto client = host.client();
  client.send(get("/") + get("/defer") + get("/head") + get("/big?100000") + get("/"));
  REQUIRE(host.run_until_handled(client, 2));
  host.settle();
  CHECK(host.handler.requests == 2);
  host.complete(0, "deferred");
  REQUIRE(host.run_to_answers(client, 5));
  const auto answers = parse_answers(client.received);
  CHECK(statuses(answers) == std::vector{200, 200, 200, 200, 200});
  CHECK(answers[1].body == "deferred");
  CHECK(answers[3].body.size() == 100'000);
}

TEST_CASE("100 Continue comes before the body is sent", "[transport][R0.1]") {
  Host host;
  auto client = host.client();
  client.send("POST / HTTP/1.1\r\nHost: a\r\nExpect: 100-continue\r\nContent-Length: 5\r\n\r\n");
  REQUIRE(host.run({&client}, [&] { return contains(client.received, "HTTP/1.1 100 Continue\r\n\r\n"); }));
  CHECK(host.handler.requests == 0);
  client.send("robot");
  REQUIRE(host.run_to_answers(client, 1));
  CHECK(parse_answers(client.received)[0].body == "robot");
}

TEST_CASE("HEAD has the header section of GET and no body", "[transport][R0.1]") {
  Host host;
  auto client = host.client();
  client.send("HEAD /big?5000 HTTP/1.1\r\nHost: a\r\n\r\n" + get("/"));
  REQUIRE(host.run_to_answers(client, 2, {0}));
  const auto answers = parse_answers(client.received, {0});
  CHECK(contains(answers[0].head, "Content-Length: 5000\r\n"));
  CHECK(answers[1].body == "hello");
}

TEST_CASE("one connection carries 10,000 requests", "[transport][R0.1]") {
  Host host;
  auto client = host.client();
  std::string hundred;
  for (int i = 0; i < 100; ++i) hundred += get("/none");
  for (int i = 0; i < 100; ++i) {
    client.send(hundred);
    REQUIRE(host.run_until_handled(client, static_cast<std::size_t>(i + 1) * 100));
  }
  client.send(get("/", "Connection: close\r\n"));
  REQUIRE(host.run_to_end(client));
  CHECK(host.handler.requests == 10'001);
  CHECK(parse_answers(client.received).size() == 10'001);
}

TEST_CASE("slow clients get 408 by the clock of the options", "[transport]") {
  HandClock clock;
  auto options = on_any_port();
  options.clock = &clock;
  Host host(options);
  auto idle = host.client();
  auto head = host.client();
  auto body = host.client();
  idle.send(get("/none"));
  head.send("GET / HTTP/1.1\r\nHo");
  body.send("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\n\r\nhe");
  const auto steps = [&] {
    for (int i = 0; i < 20; ++i) {
      for (auto* const client : {&idle, &head, &body}) client->step();
      host.server->poll(milliseconds(1), milliseconds(1));
    }
  };
  steps();
  clock.advance(options.limits.header_timeout - milliseconds(1));
  steps();
  CHECK(head.received.empty());
  clock.advance(milliseconds(1));
  REQUIRE(host.run({&head}, [&] { return !head.received.empty(); }));
  CHECK(statuses(parse_answers(head.received)) == std::vector{408});

  head.send("st: a\r\n\r\n");  // too late: discarded
  steps();
  CHECK(host.handler.requests == 1);
  CHECK_FALSE(body.ended);
  clock.advance(options.limits.body_timeout);
  REQUIRE(host.run({&body}, [&] { return !body.received.empty(); }));
  CHECK(statuses(parse_answers(body.received)) == std::vector{408});
  CHECK_FALSE(idle.ended);
  clock.advance(options.limits.idle_timeout);
  REQUIRE(host.run_to_end(idle));
  CHECK(statuses(parse_answers(idle.received)) == std::vector{204});
}

TEST_CASE("a client must complete the header section of its first request within header_timeout of being accepted", "[transport][R0.1]") {
  HandClock clock;
  auto options = on_any_port();
  options.clock = &clock;
  Host host(options);
  auto silent = host.client();
  auto late = host.client();
  auto served = host.client();
  served.send(get("/"));
  REQUIRE(host.run_to_answers(served, 1));
  clock.advance(options.limits.header_timeout - milliseconds(1));
  late.send("GET / HT");
  late.step();
  host.settle();
  for (auto* const client : {&silent, &late}) client->step();
  CHECK_FALSE(silent.ended);
  CHECK(late.received.empty());
  CHECK(host.server->poll(milliseconds(1), milliseconds(0)) == milliseconds(1));
  clock.advance(milliseconds(1));
  REQUIRE(host.run_to_end(silent));
  CHECK(silent.received.empty());
  REQUIRE(host.run_to_answers(late, 1));
  CHECK(statuses(parse_answers(late.received)) == std::vector{408});
  served.send("GET / HT");  // a later header section has its time from its first byte
  host.run({&served}, [&] { return served.all_sent(); });
  host.settle();
  clock.advance(options.limits.header_timeout - milliseconds(1));
  host.settle();
  served.send("TP/1.1\r\nHost: a\r\n\r\n");
  REQUIRE(host.run_to_answers(served, 2));
  CHECK(statuses(parse_answers(served.received)) == std::vector{200, 200});
}

TEST_CASE("bytes that trickle in do not prolong the time of a header section", "[transport]") {
  HandClock clock;
  auto options = on_any_port();
  options.clock = &clock;
  Host host(options);
  auto client = host.client();
  client.send("GET / HTTP/1.1\r\nX: ");
  for (int i = 0; i < 12; ++i) {
    client.send("a");
    for (int step = 0; step < 5; ++step) client.step(), host.server->poll(milliseconds(1), milliseconds(1));
    clock.advance(milliseconds(1000));
  }
  REQUIRE(host.run({&client}, [&] { return !client.received.empty(); }));
  CHECK(statuses(parse_answers(client.received)) == std::vector{408});
}

TEST_CASE("a client that takes no bytes of a response is given up", "[transport]") {
  HandClock clock;
  auto options = on_any_port();
  options.clock = &clock;
  Host host(options);
  auto client = host.client(4096);
  client.paused = true;
  client.send(get("/big?30000000"));
  REQUIRE(host.run_until_handled(client, 1));
  for (int i = 0; i < 20; ++i) {  // bytes that the system still buffers are progress, and end
    host.settle();
    clock.advance(options.limits.write_timeout + milliseconds(1));
  }
  host.settle();
  client.paused = false;
  REQUIRE(host.run_to_end(client));
  CHECK(client.received.size() < 30'000'000);
}

TEST_CASE("a large response arrives whole at a client that reads slowly", "[transport]") {
  Host host;
  auto client = host.client(4096);
  client.paused = true;
  client.send(get("/big?30000000") + get("/"));
  REQUIRE(host.run_until_handled(client, 1));
  client.paused = false;
  REQUIRE(host.run({&client},
                   [&] { return client.received.size() > 30'000'000 && contains(client.received.substr(client.received.size() - 5), "hello"); }));
  CHECK(statuses(parse_answers(client.received)) == std::vector{200, 200});
}

TEST_CASE("a small request is served before large bodies that arrived before it", "[transport]") {
  struct Order final : TestHandler {
    engine::Outcome handle(const http::Request& request, TimePoint now) override {
      order += request.method == "GET" ? 'g' : 'P';
      return TestHandler::handle(request, now);
    }
    std::string order;
  } handler;
  TestHost host(make_network(on_any_port()), &handler);
  const std::string body(50'000, 'b');
  std::vector<RawClient> large;
  auto small = host.client();
  for (int i = 0; i < 3; ++i) {
    large.push_back(host.client());
    large.back().send("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 50000\r\nExpect: 100-continue\r\n\r\n");
    REQUIRE(host.run({&large.back()}, [&] { return contains(large.back().received, "100 Continue"); }));
  }
  for (auto& client : large) {
    client.send(body);
    while (!client.all_sent()) client.step();
  }
  small.send(get("/"));
  while (!small.all_sent()) small.step();
  host.server->poll(std::chrono::seconds(1), std::chrono::seconds(1));
  REQUIRE(host.run({&large[0], &large[1], &large[2]}, [&] { return handler.order.size() == 4; }));
  CHECK(handler.order == "gPPP");
}

TEST_CASE("a client killed in any state leaves the others alone", "[transport]") {
  Host host;
  const std::string starts[] = {"",
                                "GET / HT",
                                "POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 50\r\n\r\nhe",
                                "POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhe",
                                "POST / HTTP/1.1\r\nHost: a\r\nExpect: 100-continue\r\nContent-Length: 50\r\n\r\n",
                                get("/big?30000000"),
                                get("/defer"),
                                get("/defer") + std::string(20'000, 'x'),
                                "GET / HTTP/1.0\r\n\r\n",
                                "bad\r\n\r\n"};
  for (const bool hard : {true, false}) {
    for (const auto& start : starts) {
      INFO(start.substr(0, 60) << (hard ? " RST" : " FIN"));
      auto client = host.client(4096);
      client.paused = true;
      client.send(start);
      for (int i = 0; i < 10; ++i) client.step(), host.server->poll(milliseconds(1), milliseconds(1));
      hard ? client.reset() : client.close();
      host.settle();
      auto other = host.client();
      other.send(get("/", "Connection: close\r\n"));
      REQUIRE(host.run_to_end(other));
      CHECK(statuses(parse_answers(other.received)) == std::vector{200});
    }
  }
  CHECK(host.handler.open.size() == 4);
  CHECK(host.handler.abandoned.size() >= 2);  // after RST; after FIN the client may still read
  for (std::size_t i = 0; i < host.handler.open.size(); ++i) host.complete(i, "too late");
  host.settle();
}

TEST_CASE("a client that closes its side after the request gets the response", "[transport]") {
  Host host;
  auto client = host.client();
  client.send(get("/") + get("/defer"));
  client.step();
  client.half_close();
  REQUIRE(host.run_until_handled(client, 2));
  host.settle();
  CHECK(host.handler.ended.size() == 1);
  host.complete(0, "late");
  REQUIRE(host.run_to_end(client));
  CHECK_FALSE(client.failed);
  CHECK(statuses(parse_answers(client.received)) == std::vector{200, 200});
}

TEST_CASE("connections above the limit get 503, until one disconnects", "[transport]") {
  auto options = on_any_port();
  options.limits.max_connections = 2;
  Host host(options);
  auto first = host.client();
  auto second = host.client();
  first.send(get("/defer"));
  second.send("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\n\r\nhe");
  REQUIRE(host.run_until_handled(first, 1));
  REQUIRE(host.run({&second}, [&] { return second.all_sent(); }));
  host.settle();
  auto third = host.client();
  third.send(get("/"));
  REQUIRE(host.run_to_end(third));
  CHECK_FALSE(third.failed);
  CHECK(statuses(parse_answers(third.received)) == std::vector{503});
  first.close();
  host.settle();
  host.complete(0, "nobody there");
  host.settle();
  auto fourth = host.client();
  fourth.send(get("/"));
  REQUIRE(host.run_to_answers(fourth, 1));
  CHECK(statuses(parse_answers(fourth.received)) == std::vector{200});
}

TEST_CASE("a stop is served when all connections are taken, also those that are reserved for it", "[transport][R0.1]") {
  auto options = on_any_port();
  options.limits.max_connections = 3;
  options.limits.reserved_connections = 4;
  Host host(options);
  std::vector<RawClient> slow;
  for (int i = 0; i < 20; ++i) {
    slow.push_back(host.client());
    slow.back().send(i % 2 ? "POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\n\r\nhe" : "POST /stop HTTP/1.1\r\nHo");
    slow.back().step();
    host.settle();
  }
  auto another = host.client();
  another.send(get("/"));
  REQUIRE(host.run_to_end(another));
  CHECK(statuses(parse_answers(another.received)) == std::vector{503});
  for (int i = 0; i < 10; ++i) {
    auto stop = host.client();
    stop.send("POST /stop HTTP/1.1\r\nHost: a\r\nContent-Length: 0\r\n\r\n" + get("/"));
    REQUIRE(host.run_to_end(stop));
    const auto answers = parse_answers(stop.received);
    REQUIRE(statuses(answers) == std::vector{200});
    CHECK(answers[0].body == "stopped");
    CHECK(contains(answers[0].head, "\r\nConnection: close\r\n"));
  }
  int open = 0;
  for (auto& client : slow) {
    client.step();
    open += !client.ended;
    CHECK((client.received.empty() || statuses(parse_answers(client.received)) == std::vector{503}));
  }
  CHECK(open >= 3);
  CHECK(open <= 7);
  CHECK(host.handler.requests == 10);
}

TEST_CASE("a reserved connection waits for its request, and is given back", "[transport][R0.1]") {
  auto options = on_any_port();
  options.limits.max_connections = 1;
  options.limits.reserved_connections = 1;
  Host host(options);
  auto busy = host.client();
  busy.send(get("/defer"));
  REQUIRE(host.run_until_handled(busy, 1));
  for (int i = 0; i < 3; ++i) {
    auto stop = host.client();
    host.settle();
    stop.send("POST /stop HTTP/1.1\r\nHost: a\r\n");
    stop.step();
    host.settle();
    stop.send("Content-Length: 4\r\n\r\nab");
    stop.step();
    host.settle();
    stop.send("cd");
    REQUIRE(host.run_to_end(stop));
    CHECK(statuses(parse_answers(stop.received)) == std::vector{200});
  }
}

TEST_CASE("silent connections exclude no client: the one that is idle for longest is closed", "[transport][R0.1]") {
  auto options = on_any_port();
  options.limits.max_connections = 4;
  Host host(options);
  std::vector<RawClient> silent;
  for (int i = 0; i < 40; ++i) silent.push_back(host.client()), host.settle();
  auto client = host.client();
  client.send(get("/"));
  REQUIRE(host.run_to_answers(client, 1));
  CHECK(statuses(parse_answers(client.received)) == std::vector{200});
  int open = 0;
  for (std::size_t i = 0; i < silent.size(); ++i) {
    silent[i].step();
    CHECK(silent[i].received.empty());
    CHECK(silent[i].ended == (i < 37));
    open += !silent[i].ended;
  }
  CHECK(open == 3);
}

TEST_CASE("the connection that is idle for longest is closed for a new one, and none that waits for a response or has sent bytes",
          "[transport][R0.1]") {
  auto options = on_any_port();
  options.limits.max_connections = 5;
  Host host(options);
  auto waiting = host.client();
  waiting.send(get("/defer"));
  REQUIRE(host.run_until_handled(waiting, 1));
  auto in_head = host.client();
  in_head.send("GET / HTTP/1.1\r\nHo");
  REQUIRE(host.run({&in_head}, [&] { return in_head.all_sent(); }));
  auto first = host.client();
  auto second = host.client();
  auto third = host.client();
  for (auto* const client : {&third, &first, &second, &third}) {  // third was used last
    const auto before = parse_answers(client->received).size();
    client->send(get("/"));
    REQUIRE(host.run_to_answers(*client, before + 1));
  }
  host.settle();
  first.send(get("/"));  // has arrived, and the server does not know
  first.step();
  auto sixth = host.client();
  sixth.send(get("/"));
  REQUIRE(host.run_to_answers(sixth, 1));
  CHECK(statuses(parse_answers(sixth.received)) == std::vector{200});
  REQUIRE(host.run_to_end(second));
  CHECK_FALSE(second.failed);
  REQUIRE(host.run_to_answers(first, 2));
  in_head.send("st: a\r\n\r\n");
  REQUIRE(host.run_to_answers(in_head, 1));
  host.complete(0, "late");
  REQUIRE(host.run_to_answers(waiting, 1));
  for (auto* const client : {&waiting, &in_head, &first, &third}) {
    client->step();
    CHECK_FALSE(client->ended);
  }
}

TEST_CASE("of many clients at once each gets its response, however few connections there may be", "[transport][R0.1]") {
  auto options = on_any_port();
  options.limits.max_connections = 20;
  for (const auto budget : {std::chrono::microseconds(0), std::chrono::microseconds(100'000)}) {
    Host host(options);
    std::vector<RawClient> clients;
    for (int i = 0; i < 200; ++i) {
      clients.push_back(host.client());
      clients.back().send(get("/"));
      clients.back().step();
    }
    for (int i = 0; i < 2000; ++i) host.server->poll(budget, milliseconds(0));
    for (auto& client : clients) {
      client.step();
      CHECK_FALSE(client.failed);
      CHECK(statuses(parse_answers(client.received)) == std::vector{200});
    }
  }
}

TEST_CASE("each refused client gets 503, however many there are", "[transport][R0.1]") {
  auto options = on_any_port();
  options.limits.max_connections = 1;
  Host host(options);
  auto busy = host.client();
  busy.send(get("/defer"));
  REQUIRE(host.run_until_handled(busy, 1));
  std::vector<RawClient> refused;
  for (int i = 0; i < 200; ++i) {
    refused.push_back(host.client());
    refused.back().send(get("/"));
    refused.back().step();
  }
  for (int i = 0; i < 500; ++i) host.server->poll(milliseconds(1), milliseconds(0));
  for (auto& client : refused) {
    client.step();
    CHECK_FALSE(client.failed);
    const auto answers = parse_answers(client.received);
    REQUIRE(statuses(answers) == std::vector{503});
    CHECK(contains(answers[0].head, "\r\nRetry-After: 1\r\n"));
  }
  CHECK(host.handler.requests == 1);
}

TEST_CASE("poll leaves what its budget does not cover to the next poll, which does not wait", "[transport]") {
  HandClock clock;
  auto options = on_any_port();
  options.clock = &clock;
  Host host(options);
  SECTION("deferred responses") {
    std::vector<RawClient> clients;
    for (std::size_t i = 0; i < 5; ++i) {
      clients.push_back(host.client());
      clients.back().send(get("/defer"));
      REQUIRE(host.run_until_handled(clients.back(), i + 1));
    }
    for (const auto ticket : host.handler.open) host.handler.complete(ticket, "done");
    host.server->waker()->wake();
    const auto answered = [&] {
      std::size_t count = 0;
      for (auto& client : clients) client.step(), count += client.received.empty() ? 0 : 1;
      return count;
    };
    for (int i = 0; i < 1000 && answered() == 0; ++i) host.server->poll(std::chrono::microseconds(0), milliseconds(1));
    for (std::size_t n = 1; n < 5; ++n) {
      CHECK(answered() == n);
      const auto begin = std::chrono::steady_clock::now();
      const auto due = host.server->poll(std::chrono::microseconds(0), std::chrono::minutes(10));
      CHECK(std::chrono::steady_clock::now() - begin < std::chrono::minutes(1));
      CHECK(due == milliseconds(0));
    }
    CHECK(answered() == 5);
    host.settle();
    CHECK(host.server->poll(milliseconds(1), milliseconds(0)) > milliseconds(0));
  }
  SECTION("pipelined requests") {
    auto client = host.client();
    std::string requests;
    for (int i = 0; i < 20; ++i) requests += get("/");
    client.send(requests);
    client.step();
    std::size_t most = 0;
    for (int i = 0; i < 1000 && host.handler.requests < 20; ++i) {
      const auto before = host.handler.requests;
      host.server->poll(std::chrono::microseconds(0), milliseconds(1));
      most = std::max(most, host.handler.requests - before);
    }
    CHECK(host.handler.requests == 20);
    CHECK(most <= 2);
    REQUIRE(host.run_to_answers(client, 20));
  }
  SECTION("clients whose time is over") {
    std::vector<RawClient> clients;
    for (int i = 0; i < 5; ++i) clients.push_back(host.client());
    host.settle();
    clock.advance(options.limits.header_timeout);
    for (std::size_t n = 1; n <= 5; ++n) {
      host.server->poll(std::chrono::microseconds(0), std::chrono::minutes(10));
      std::size_t ended = 0;
      for (auto& client : clients) client.step(), ended += client.ended ? 1 : 0;
      CHECK(ended == n);
    }
  }
}

TEST_CASE("without descriptors clients are refused, and served again when there are some", "[transport]") {
  HandClock clock;
  auto options = on_any_port();
  options.clock = &clock;
  Host host(options);
  auto idle = host.client();
  idle.send(get("/"));
  REQUIRE(host.run_to_answers(idle, 1));
  auto served = host.client();
  served.send(get("/"));
  REQUIRE(host.run_to_answers(served, 1));
  auto refused = host.client();  // its descriptor exists; the server's end does not
  rlimit before{};
  ::getrlimit(RLIMIT_NOFILE, &before);
  rlimit none = before;
  none.rlim_cur = 0;
  ::setrlimit(RLIMIT_NOFILE, &none);
  host.settle();
  ::setrlimit(RLIMIT_NOFILE, &before);
  idle.step();
  CHECK(idle.ended);  // for the new one, in vain; the others are kept
  clock.advance(milliseconds(200));
  served.send(get("/"));
  REQUIRE(host.run_to_answers(served, 2));
  auto later = host.client();
  later.send(get("/"));
  REQUIRE(host.run_to_answers(later, 1));
}

TEST_CASE("the last descriptor serves to refuse clients with 503", "[transport]") {
  Host host;
  auto first = host.client();
  auto second = host.client();
  for (auto* const client : {&first, &second}) client->send(get("/"));
  for (auto* const client : {&first, &second}) client->step();
  rlimit before{};
  ::getrlimit(RLIMIT_NOFILE, &before);
  const int next = ::dup(0);
  ::close(next);
  rlimit full = before;
  full.rlim_cur = static_cast<rlim_t>(next);
  ::setrlimit(RLIMIT_NOFILE, &full);
  const bool ended = host.run_to_end(first) && host.run_to_end(second);
  ::setrlimit(RLIMIT_NOFILE, &before);
  REQUIRE(ended);
  CHECK(statuses(parse_answers(first.received)) == std::vector{503});
  CHECK(statuses(parse_answers(second.received)) == std::vector{503});
  CHECK(host.handler.requests == 0);
  auto later = host.client();
  later.send(get("/"));
  REQUIRE(host.run_to_answers(later, 1));
}

TEST_CASE("a stop is served when descriptors have run out", "[transport][R0.1]") {
  Host host;
  std::vector<RawClient> slow;
  for (int i = 0; i < 40; ++i) {
    slow.push_back(host.client());
    slow.back().send("POST /stop HTTP/1.1\r\nHo");
    slow.back().step();
  }
  std::vector<RawClient> stops;
  for (int i = 0; i < 3; ++i) stops.push_back(host.client());
  rlimit before{};
  ::getrlimit(RLIMIT_NOFILE, &before);
  const int next = ::dup(0);
  ::close(next);
  rlimit full = before;
  full.rlim_cur = static_cast<rlim_t>(next);
  ::setrlimit(RLIMIT_NOFILE, &full);
  host.settle();
  bool served = true;
  for (auto& stop : stops) {
    stop.send("POST /stop HTTP/1.1\r\nHost: a\r\nContent-Length: 0\r\n\r\n");
    served = host.run_to_end(stop) && statuses(parse_answers(stop.received)) == std::vector{200} && served;
  }
  ::setrlimit(RLIMIT_NOFILE, &before);
  CHECK(served);
  CHECK(host.handler.requests == 3);
}

TEST_CASE("when descriptors run out, the connection that is idle for longest is closed", "[transport]") {
  Host host;
  auto idle = host.client(), busy = host.client();
  idle.send(get("/"));
  REQUIRE(host.run_to_answers(idle, 1));
  busy.send(get("/defer"));
  REQUIRE(host.run_until_handled(busy, 2));
  auto late = host.client();
  late.send(get("/"));
  late.step();
  rlimit before{};
  ::getrlimit(RLIMIT_NOFILE, &before);
  const int next = ::dup(0);
  ::close(next);
  rlimit full = before;
  full.rlim_cur = static_cast<rlim_t>(next);
  ::setrlimit(RLIMIT_NOFILE, &full);
  const bool served = host.run_to_answers(late, 1) && host.run_to_end(idle);
  ::setrlimit(RLIMIT_NOFILE, &before);
  REQUIRE(served);
  CHECK(statuses(parse_answers(late.received)) == std::vector{200});
  CHECK_FALSE(busy.ended);
}

TEST_CASE("stop sends the responses that the handler still gives and 503 for the rest", "[transport]") {
  Host host;
  auto answered = host.client();
  auto forgotten = host.client();
  auto idle = host.client();
  answered.send(get("/defer"));
  REQUIRE(host.run_until_handled(answered, 1));
  forgotten.send(get("/defer"));
  REQUIRE(host.run_until_handled(forgotten, 2));
  const auto port = host.server->port();
  host.handler.complete(host.handler.open[0], "in time");
  host.server->stop();
  CHECK(host.server->port() == 0);
  CHECK(host.handler.abandoned == std::vector{host.handler.open[1]});
  for (auto* const client : {&answered, &forgotten, &idle}) {
    for (int i = 0; i < 1000 && !client->ended; ++i) client->step();
    CHECK(client->ended);
  }
  CHECK(statuses(parse_answers(answered.received)) == std::vector{200});
  CHECK(statuses(parse_answers(forgotten.received)) == std::vector{503});
  CHECK_THROWS(RawClient(port));

  REQUIRE(host.server->start(host.handler));  // and it can begin again
  auto again = host.client();
  again.send(get("/"));
  REQUIRE(host.run_to_answers(again, 1));
}

TEST_CASE("a waker ends poll's wait from another thread, and outlives its transport", "[transport][threads]") {
  auto host = std::make_unique<Host>();
  const auto waker = host->server->waker();
  auto client = host->client();
  client.send(get("/defer"));
  REQUIRE(host->run_until_handled(client, 1));
  std::thread other([&] {
    host->handler.complete(host->handler.open[0], "from elsewhere");
    waker->wake();
  });
  for (int i = 0; i < 100 && client.received.empty(); ++i) {
    host->server->poll(milliseconds(1), std::chrono::seconds(10));
    client.step();
  }
  other.join();
  CHECK(parse_answers(client.received).at(0).body == "from elsewhere");
  host.reset();
  waker->wake();
  waker->wake();
}

TEST_CASE("poll says how long nothing is due", "[transport]") {
  HandClock clock;
  auto options = on_any_port();
  options.clock = &clock;
  Host host(options);
  CHECK(host.server->poll(milliseconds(1), milliseconds(0)) == milliseconds::max());
  auto client = host.client();
  client.send(get("/"));
  REQUIRE(host.run_to_answers(client, 1));
  CHECK(host.server->poll(milliseconds(1), milliseconds(0)) == options.limits.idle_timeout);
  clock.advance(milliseconds(1000));
  CHECK(host.server->poll(milliseconds(1), milliseconds(0)) == options.limits.idle_timeout - milliseconds(1000));
}

TEST_CASE("poll allocates nothing when there is nothing to do, and nothing for a plain request", "[transport]") {
  Host host;
  auto client = host.client();
  for (int i = 0; i < 3; ++i) {
    client.send(get("/none"));
    REQUIRE(host.run_to_answers(client, static_cast<std::size_t>(i + 1)));
  }
  const auto before_idle = allocations.load();
  for (int i = 0; i < 100; ++i) host.server->poll(milliseconds(1), milliseconds(0));
  CHECK(allocations.load() == before_idle);

  const std::string request = get("/none");
  const auto before_handler = allocations.load();
  host.handler.handle({"GET", "/none", 11, {}, {}, {}, false}, system_clock().now());
  const auto of_handler = allocations.load() - before_handler;
  client.send(request);
  client.received.reserve(10'000);
  client.step();
  const auto before_request = allocations.load();
  for (int i = 0; i < 20; ++i) host.server->poll(milliseconds(1), milliseconds(1));
  // cpp-httplib parses header sections into strings of its own.
  CHECK(allocations.load() - before_request <= of_handler);
  CHECK(host.handler.requests == 5);
}

TEST_CASE("start says why it cannot listen", "[transport]") {
  Host host;
  TestHandler handler;
  auto options = on_any_port();
  options.port = host.server->port();
  const auto taken = make_network(options)->start(handler);
  REQUIRE_FALSE(taken);
  CHECK(taken.error().code == Errc::address_in_use);
  options.address = "robot.example";
  const auto named = make_network(options)->start(handler);
  REQUIRE_FALSE(named);
  CHECK(named.error().code == Errc::invalid_option);
  options.address = "192.0.2.1";
  const auto foreign = make_network(options)->start(handler);
  REQUIRE_FALSE(foreign);
  CHECK(foreign.error().code == Errc::io_error);
  CHECK_FALSE(host.server->start(handler));
}

TEST_CASE("IPv6 is served where there is any", "[transport]") {
  auto options = on_any_port();
  options.address = "::1";
  TestHandler handler;
  const auto server = make_network(options);
  if (!server->start(handler)) return print_skip("this machine has no IPv6");
  RawClient client(server->port(), "::1");
  client.send(get("/"));
  for (int i = 0; i < 5000 && client.received.empty(); ++i) {
    client.step();
    server->poll(milliseconds(1), milliseconds(1));
  }
  CHECK(statuses(parse_answers(client.received)) == std::vector{200});
  CHECK(handler.peer == "::1");
}

TEST_CASE("a thousand idle connections do not keep ten from being served", "[transport]") {
  rlimit descriptors{};
  ::getrlimit(RLIMIT_NOFILE, &descriptors);
  const std::size_t idle_count = descriptors.rlim_cur > 2200 ? 1000 : 100;
  Host host;
  std::vector<RawClient> idle;
  for (std::size_t i = 0; i < idle_count; ++i) {
    idle.push_back(host.client());
    host.server->poll(milliseconds(1), milliseconds(0));
  }
  for (int i = 0; i < 10; ++i) {
    auto client = host.client();
    client.send(get("/", "Connection: close\r\n"));
    REQUIRE(host.run_to_end(client));
    CHECK(statuses(parse_answers(client.received)) == std::vector{200});
  }
}

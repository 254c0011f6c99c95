// SPDX-License-Identifier: Apache-2.0
#include "examples/ex_own_transport/epoll_transport.hpp"

#include <poll.h>
#include <sys/resource.h>

#include <memory>
#include <thread>

#include "tests/support/catch.hpp"
#include "tests/transport/framing_cases.hpp"
#include "tests/transport/harness.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::microseconds;
using std::chrono::milliseconds;

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
  explicit Host(transport::TransportOptions options = on_any_port()) : TestHost(make_epoll_transport(std::move(options))) {}

  /// Whether descriptor() says that there is something to do.
  bool calls(milliseconds max_wait = milliseconds(0)) {
    pollfd item{server->descriptor(), POLLIN, 0};
    return ::poll(&item, 1, static_cast<int>(max_wait.count())) == 1;
  }
  /// Waits until it says so. false: it does not within a time that no machine takes.
  bool will_call() { return calls(milliseconds(60'000)); }
};

}  // namespace

TEST_CASE("a transport of one's own handles all framing cases, whichever way their bytes arrive", "[transport][own][R0.1]") {
  Host host;
  const bool bytewise = GENERATE(false, true);
  for (const auto& item : framing_cases()) {
    if (bytewise && item.bytes.size() > 1000) continue;
    INFO(item.name);
    auto client = host.client();
    if (!bytewise) client.send(item.bytes);
    for (std::size_t i = 0; bytewise && i < item.bytes.size() && !client.ended; ++i) {
      client.send({&item.bytes[i], 1});
      client.step();
      host.server->poll(milliseconds(1), milliseconds(0));
    }
    CHECK((item.closes ? host.run_to_end(client) : host.run_to_answers(client, item.statuses.size())));
    CHECK_FALSE(client.failed);
    CHECK(client.ended == item.closes);
    CHECK(statuses(parse_answers(client.received)) == item.statuses);
  }
}

TEST_CASE("a transport of one's own refuses lines over the limit", "[transport][own][R0.1]") {
  auto options = on_any_port();
  options.limits.max_line_bytes = 8000;
  Host host(options);
  const std::string much(8000, 'a');
  const std::pair<int, std::string> cases[] = {{200, "GET /?" + much.substr(15) + " HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n"},
                                               {414, "GET /?" + much.substr(14) + " HTTP/1.1\r\nHost: a\r\n\r\n"},
                                               {200, get("/", "Connection: close\r\nX: " + much.substr(3) + "\r\n")},
                                               {431, get("/", "X: " + much.substr(2) + "\r\n")}};
  for (const auto& [status, bytes] : cases) {
    auto client = host.client();
    client.send(bytes);
    REQUIRE(host.run_to_end(client));
    CHECK(statuses(parse_answers(client.received)) == std::vector{status});
  }
}

TEST_CASE("a transport of one's own refuses 10 MiB with a response that the client reads", "[transport][own][R0.1]") {
  const std::string much(10 * 1024 * 1024, 'a');
  const std::pair<int, std::string> cases[] = {
      {414, "GET /" + much + " HTTP/1.1\r\nHost: a\r\n\r\n"},
      {413, "POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 10485760\r\n\r\n" + much},
      {413, "POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\nA00000\r\n" + much + "\r\n0\r\n\r\n"},
  };
  for (const auto& [status, bytes] : cases) {
    Host host;
    auto client = host.client();
    client.send(bytes);
    REQUIRE(host.run({&client}, [&] { return !parse_answers(client.received).empty(); }));
    REQUIRE(host.run_to_end(client));
    CHECK(statuses(parse_answers(client.received)) == std::vector{status});
  }
}

TEST_CASE("a transport of one's own responds to pipelined requests in order, a deferred and a large one among them", "[transport][own][R0.1]") {
  Host host;
  auto client = host.client(4096);
  client.send(get("/") + get("/defer") + "HEAD /big?5000 HTTP/1.1\r\nHost: a\r\n\r\n" + get("/big?3000000") + get("/"));
  REQUIRE(host.run_until_handled(client, 2));
  host.settle();
  CHECK(host.handler.requests == 2);
  host.complete(0, "deferred");
  REQUIRE(host.run_to_answers(client, 5, {2}));
  const auto answers = parse_answers(client.received, {2});
  CHECK(statuses(answers) == std::vector{200, 200, 200, 200, 200});
  CHECK(answers[1].body == "deferred");
  CHECK(contains(answers[2].head, "Content-Length: 5000\r\n"));
  CHECK(answers[3].body.size() == 3'000'000);
}

TEST_CASE("a transport of one's own says 100 Continue before the body is sent", "[transport][own][R0.1]") {
  Host host;
  auto client = host.client();
  client.send("POST / HTTP/1.1\r\nHost: a\r\nExpect: 100-continue\r\nContent-Length: 5\r\n\r\n");
  REQUIRE(host.run({&client}, [&] { return contains(client.received, "HTTP/1.1 100 Continue\r\n\r\n"); }));
  CHECK(host.handler.requests == 0);
  client.send("robot");
  REQUIRE(host.run_to_answers(client, 1));
  CHECK(parse_answers(client.received)[0].body == "robot");
}

TEST_CASE("a transport of one's own gives up clients that are slow, by the clock of the options", "[transport][own][R0.1]") {
  HandClock clock;
  auto options = on_any_port();
  options.clock = &clock;
  Host host(options);
  auto silent = host.client(), head = host.client(), body = host.client(), idle = host.client(), deaf = host.client(4096);
  head.send("GET / HTTP/1.1\r\nHo");
  body.send("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\n\r\nhe");
  idle.send(get("/none"));
  deaf.paused = true;
  deaf.send(get("/big?30000000"));
  REQUIRE(host.run({&head, &body, &idle, &deaf}, [&] { return host.handler.requests == 2; }));
  const auto pass = [&](milliseconds time) {
    clock.advance(time);
    for (int i = 0; i < 20; ++i) {
      for (auto* const one : {&silent, &head, &body, &idle, &deaf}) one->step();
      host.server->poll(milliseconds(1), milliseconds(1));
    }
  };
  pass(options.limits.header_timeout - milliseconds(1));
  CHECK_FALSE(silent.ended);
  CHECK(head.received.empty());
  pass(milliseconds(1));
  CHECK(silent.ended);
  CHECK(silent.received.empty());
  CHECK(statuses(parse_answers(head.received)) == std::vector{408});
  CHECK(body.received.empty());
  pass(options.limits.body_timeout - options.limits.header_timeout);
  CHECK(statuses(parse_answers(body.received)) == std::vector{408});
  CHECK_FALSE(idle.ended);
  pass(options.limits.idle_timeout - options.limits.body_timeout);
  CHECK(idle.ended);
  CHECK(statuses(parse_answers(idle.received)) == std::vector{204});
  deaf.paused = false;
  REQUIRE(host.run_to_end(deaf));
  CHECK(deaf.received.size() < 30'000'000);
}

TEST_CASE("a transport of one's own survives clients that are killed in any state", "[transport][own]") {
  Host host;
  const std::string starts[] = {"",
                                "GET / HT",
                                "POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 50\r\n\r\nhe",
                                "POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhe",
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
      REQUIRE(host.is_well());
    }
  }
  CHECK(host.handler.abandoned.size() >= 2);  // after RST; after FIN the client may still read
  for (std::size_t i = 0; i < host.handler.open.size(); ++i) host.complete(i, "too late");
  host.settle();
  CHECK(host.is_well());
}

TEST_CASE("a client of a transport of one's own that closes its side after the request gets the response", "[transport][own]") {
  Host host;
  auto client = host.client();
  client.send(get("/") + get("/defer"));
  client.step();
  client.half_close();
  REQUIRE(host.run_until_handled(client, 2));
  host.settle();
  host.complete(0, "late");
  REQUIRE(host.run_to_end(client));
  CHECK_FALSE(client.failed);
  CHECK(statuses(parse_answers(client.received)) == std::vector{200, 200});
}

TEST_CASE("a transport of one's own responds to a request that ends too early", "[transport][own][R0.1]") {
  Host host;
  for (const std::string start : {"GET / HT", "POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\n\r\nhe"}) {
    auto client = host.client();
    client.send(start);
    client.step();
    client.half_close();
    REQUIRE(host.run_to_end(client));
    CHECK(statuses(parse_answers(client.received)) == std::vector{400});
  }
}

TEST_CASE("a transport of one's own responds 503 to clients over the limit, until one disconnects", "[transport][own]") {
  auto options = on_any_port();
  options.limits.max_connections = 1;
  Host host(options);
  auto first = host.client();
  first.send(get("/"));
  REQUIRE(host.run_to_answers(first, 1));
  auto second = host.client();
  second.send(get("/"));
  REQUIRE(host.run_to_end(second));
  CHECK_FALSE(second.failed);
  CHECK(statuses(parse_answers(second.received)) == std::vector{503});
  second.close();
  first.close();
  host.settle();
  CHECK(host.is_well());
}

TEST_CASE("a transport of one's own without descriptors rests, and goes on when there are some", "[transport][own]") {
  Host host;
  auto client = host.client();
  rlimit before{};
  ::getrlimit(RLIMIT_NOFILE, &before);
  const int next = ::dup(0);
  ::close(next);
  rlimit full = before;
  full.rlim_cur = static_cast<rlim_t>(next);
  ::setrlimit(RLIMIT_NOFILE, &full);
  const auto due = (host.server->poll(milliseconds(1), milliseconds(100)), host.server->poll(milliseconds(1), milliseconds(0)));
  const bool calls = host.calls();
  ::setrlimit(RLIMIT_NOFILE, &before);
  CHECK(due > milliseconds(0));
  CHECK(due <= milliseconds(100));
  CHECK_FALSE(calls);
  client.send(get("/"));
  REQUIRE(host.run_to_answers(client, 1));
}

TEST_CASE("a transport of one's own leaves to the next poll what the budget does not cover", "[transport][own]") {
  Host host;
  auto client = host.client();
  std::string requests;
  for (int i = 0; i < 20; ++i) requests += get("/");
  client.send(requests);
  client.step();
  REQUIRE(host.will_call());
  for (int i = 0; i < 1000 && host.handler.requests < 20; ++i) {
    const auto before = host.handler.requests;
    const auto due = host.server->poll(microseconds(0), milliseconds(1));
    CHECK(host.handler.requests <= before + 2);  // what was read, and what continues after its response
    if (before > 0 && host.handler.requests < 20) {
      CHECK(due == milliseconds(0));
      CHECK(host.will_call());  // a host that sleeps on descriptor() comes back
    }
  }
  REQUIRE(host.run_to_answers(client, 20));
  host.settle();
  CHECK_FALSE(host.calls());
}

TEST_CASE("the descriptor of a transport of one's own is readable when a time has come or it was woken", "[transport][own]") {
  auto options = on_any_port();
  options.limits.header_timeout = milliseconds(300);
  Host host(options);
  CHECK(host.server->poll(milliseconds(1), milliseconds(0)) == milliseconds::max());
  CHECK_FALSE(host.calls());
  const auto begun = std::chrono::steady_clock::now();
  auto client = host.client();
  CHECK(host.will_call());
  host.settle();
  const bool early = host.calls();
  if (std::chrono::steady_clock::now() - begun < options.limits.header_timeout) {  // on a slow machine the time has come, and is over
    CHECK_FALSE(early);
    CHECK(host.will_call());
  }
  REQUIRE(host.run_to_end(client));
  CHECK_FALSE(host.calls());
  host.server->waker()->wake();
  CHECK(host.calls());
}

TEST_CASE("stop of a transport of one's own sends the responses that the handler still gives and 503 for the rest", "[transport][own]") {
  Host host;
  auto answered = host.client(), forgotten = host.client(), idle = host.client();
  answered.send(get("/defer"));
  REQUIRE(host.run_until_handled(answered, 1));
  forgotten.send(get("/defer"));
  REQUIRE(host.run_until_handled(forgotten, 2));
  const auto port = host.server->port();
  host.handler.complete(host.handler.open[0], "in time");
  host.server->stop();
  CHECK(host.server->port() == 0);
  CHECK(host.server->descriptor() == -1);
  CHECK(host.handler.abandoned == std::vector{host.handler.open[1]});
  for (auto* const client : {&answered, &forgotten, &idle}) {
    for (int i = 0; i < 1000 && !client->ended; ++i) client->step();
    CHECK(client->ended);
  }
  CHECK(statuses(parse_answers(answered.received)) == std::vector{200});
  CHECK(statuses(parse_answers(forgotten.received)) == std::vector{503});
  CHECK_THROWS(RawClient(port));
  REQUIRE(host.server->start(host.handler));
  CHECK(host.is_well());
}

TEST_CASE("the waker of a transport of one's own ends its wait from another thread, and outlives it", "[transport][threads][own]") {
  auto host = std::make_unique<Host>();
  const auto waker = host->server->waker();
  std::thread other([&] { waker->wake(); });
  const auto begin = std::chrono::steady_clock::now();
  host->server->poll(milliseconds(1), std::chrono::minutes(10));
  other.join();
  CHECK(std::chrono::steady_clock::now() - begin < std::chrono::minutes(1));
  host.reset();
  waker->wake();
}

TEST_CASE("a transport of one's own says why it cannot listen", "[transport][own]") {
  Host host;
  TestHandler handler;
  auto options = on_any_port();
  options.port = host.server->port();
  CHECK(make_epoll_transport(options)->start(handler).error().code == Errc::address_in_use);
  options.address = "robot.example";
  CHECK(make_epoll_transport(options)->start(handler).error().code == Errc::invalid_option);
  options.address = "192.0.2.1";
  CHECK(make_epoll_transport(options)->start(handler).error().code == Errc::io_error);
  options = on_any_port();
  options.tls.emplace();
  CHECK(make_epoll_transport(options)->start(handler).error().code == Errc::invalid_option);
  CHECK_FALSE(host.server->start(handler));
}

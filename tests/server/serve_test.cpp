// SPDX-License-Identifier: Apache-2.0
#include <lrt/server.hpp>

#include <atomic>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include <lrt/served.hpp>
#include <lrt/transport/loopback.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/message.hpp"
#include "tests/support/socket.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

constexpr std::uint16_t host_port = 4711;

/// Calls Server::serve() as a host's own HTTP server on port 4711 does.
Served serve(Server& server, const std::string& text, bool can_stream = false, std::string_view prefix = "") {
  const std::size_t body = text.find("\n\n");
  RequestText request(text.substr(0, body) + "\nHost: localhost:4711" + (body == std::string::npos ? "" : text.substr(body)));
  request.get().local_port = host_port;
  request.get().can_stream = can_stream;
  request.get().mount = prefix;
  return server.serve(request.get());
}
int status(Server& server, const std::string& text) { return serve(server, text).response.status; }

/// A server with each way to do I/O, with a port of its own and without.
Server make(Io io, bool network, Options options = {}) {
  options.listen.port = 0;
  options.threads.io = io;
  if (!network) options.listen.transport = transport::no_network;
  return Server::create(std::move(options)).value();
}

struct Kind {
  Io io;
  bool network;
};
const Kind kinds[] = {{Io::own_thread, true}, {Io::own_thread, false}, {Io::in_poll, true}, {Io::in_poll, false}};

/// Polls on a thread of its own.
class Polling {
 public:
  explicit Polling(Server& server)
      : thread_([this, &server] {
          while (!ended_) {
            server.poll();
            std::this_thread::yield();
          }
        }) {}
  ~Polling() {
    ended_ = true;
    thread_.join();
  }

 private:
  std::atomic<bool> ended_{false};
  std::thread thread_;
};

/// The next event that has bytes, or the end. Fails after a minute.
EventSource::Event next_event(EventSource& source) {
  const auto until = std::chrono::steady_clock::now() + seconds(60);
  while (std::chrono::steady_clock::now() < until) {
    EventSource::Event event = source.next(milliseconds(100));
    if (event.bytes || event.end) return event;
  }
  FAIL("no event in a minute");
  return {};
}

}  // namespace

TEST_CASE("serve answers what needs no lambda, whoever polls or not", "[server][serve]") {
  for (const auto& [io, network] : kinds) {
    Server server = make(io, network);
    Thing thing{"arm"};
    auto pushed = thing.property<double>("p");
    server.add(std::move(thing)).value();
    pushed.publish(2.5);
    CHECK(status(server, "GET /") == 200);
    CHECK(status(server, "GET /nothing") == 404);
    CHECK(status(server, "PATCH /arm") == 405);
    const Served served = serve(server, "GET /arm/p\nAccept: text/plain");
    CHECK(served.response.status == 200);
    CHECK(served.response.content() == "2.5");
    CHECK_FALSE(served.events);
    CHECK((server.port() != 0) == network);
  }
}

TEST_CASE("serve waits for the lambdas that the host runs", "[server][serve][R0.5]") {
  for (const auto& [io, network] : kinds) {
    Server server = make(io, network);
    int value = 0;
    Thing thing{"arm"};
    thing.property("p", [&] { return value; }).on_write([&](int written) { value = written; });
    server.add(std::move(thing)).value();
    const Polling polling(server);
    CHECK(serve(server, "GET /arm/p\nAccept: text/plain").response.content() == "0");
    CHECK(status(server, "PUT /arm/p\nContent-Type: text/plain\n\n7") == 204);
    CHECK(serve(server, "GET /arm/p\nAccept: text/plain").response.content() == "7");
  }
}

TEST_CASE("serve is 503 when the host does not poll, and the lambda is not run later", "[server][serve][R0.6]") {
  for (const auto& [io, network] : kinds) {
    Options options;
    options.limits.host_timeout = milliseconds(1);
    Server server = make(io, network, std::move(options));
    int writes = 0;
    Thing thing{"arm"};
    thing.property("p", [] { return 1; }).on_write([&](int) { ++writes; });
    server.add(std::move(thing)).value();
    const Served served = serve(server, "GET /arm/p");
    CHECK(served.response.status == 503);
    CHECK(served.response.fields.find("Retry-After"));
    CHECK(status(server, "PUT /arm/p\nContent-Type: text/plain\n\n7") == 503);
    for (int i = 0; i < 10; ++i) server.poll();
    CHECK(writes == 0);
  }
}

TEST_CASE("requests of guests and of the server's own port do not get each other's responses", "[server][serve]") {
  const Io io = GENERATE(Io::own_thread, Io::in_poll);
  Server server = make(io, true);
  Thing thing{"arm"};
  thing.property("a", [] { return 1; });
  thing.property("b", [] { return 2; });
  server.add(std::move(thing)).value();
  const Polling polling(server);
  std::atomic<int> wrong{0};
  std::thread guest([&] {
    for (int i = 0; i < 200; ++i) wrong += serve(server, "GET /arm/a\nAccept: text/plain").response.content() != "1";
  });
  Socket client(server.port());
  for (int i = 0; i < 200; ++i) wrong += client.ask("GET /arm/b\nAccept: text/plain\nHost: 127.0.0.1:" + std::to_string(server.port())).body != "2";
  guest.join();
  CHECK(wrong == 0);
}

TEST_CASE("the own port's request that a guest finds overdue is answered", "[server][serve][R0.6]") {
  Options options;
  options.limits.host_timeout = milliseconds(1);
  Server server = make(Io::own_thread, true, std::move(options));
  Thing thing{"arm"};
  thing.property("p", [] { return 1; });
  server.add(std::move(thing)).value();
  Socket client(server.port());
  for (int i = 0; i < 20; ++i) {
    client.send("GET /arm/p\nHost: 127.0.0.1:" + std::to_string(server.port()));
    CHECK(status(server, "GET /arm/p") == 503);
    CHECK(client.await().status == 503);
  }
}

TEST_CASE("lambdas on the I/O thread serve guests without a poll of the host's", "[server][serve][R0.5]") {
  const bool network = GENERATE(true, false);
  Options options;
  options.threads.dispatch = Dispatch::io_thread;
  Server server = make(Io::own_thread, network, std::move(options));
  Thing thing{"arm"};
  thing.property("p", [] { return 3; });
  server.add(std::move(thing)).value();
  for (int i = 0; i < 20; ++i) CHECK(serve(server, "GET /arm/p\nAccept: text/plain").response.content() == "3");
}

TEST_CASE("a stop answers waiting guests with 503 and ends their event streams", "[server][serve]") {
  for (const auto& [io, network] : kinds) {
    Options options;
    options.limits.host_timeout = seconds(600);
    Server server = make(io, network, std::move(options));
    Thing thing{"arm"};
    thing.property("pulled", [] { return 1; });
    auto pushed = thing.property<double>("pushed");
    server.add(std::move(thing)).value();
    pushed.publish(1);
    std::vector<std::future<int>> waiting;
    for (int i = 0; i < 4; ++i) waiting.push_back(std::async(std::launch::async, [&] { return status(server, "GET /arm/pulled"); }));
    auto streaming = std::async(std::launch::async, [&] {
      Served served = serve(server, "GET /arm/pushed\nAccept: text/event-stream", true);
      if (!served.events) return false;
      while (!served.events->next(milliseconds::max()).end) {}
      return served.events->next(milliseconds::max()).end;  // and again
    });
    server.stop();
    for (auto& one : waiting) CHECK(one.get() == 503);
    streaming.get();  // it was open, or came too late
    CHECK(status(server, "GET /arm/pushed") == 503);
    CHECK(serve(server, "GET /arm/pushed\nAccept: text/event-stream", true).response.status == 503);
  }
}

TEST_CASE("an event stream of a guest has the value and each change, and ends with its source", "[server][serve]") {
  for (const auto& [io, network] : kinds) {
    Server server = make(io, network);
    Thing thing{"arm"};
    auto pushed = thing.property<int>("p");
    server.add(std::move(thing)).value();
    pushed.publish(0);
    const Polling polling(server);
    const auto subscriptions = [&] { return std::string(serve(server, "GET /arm/subscriptions\nAccept: text/turtle").response.content()); };
    {
      Served served = serve(server, "GET /arm/p?accept=text/plain\nAccept: text/event-stream", true);
      REQUIRE(served.events);
      CHECK(served.response.status == 200);
      CHECK(served.response.fields.find("Content-Type") == "text/event-stream");
      CHECK(next_event(*served.events).bytes->find("\ndata: 0\n") != std::string::npos);
      CHECK_FALSE(served.events->next(milliseconds(0)).bytes);
      for (int i = 1; i <= 5; ++i) {
        pushed.publish(i);
        CHECK(next_event(*served.events).bytes->find("\ndata: " + std::to_string(i) + "\n") != std::string::npos);
      }
      CHECK(subscriptions().find("ldp:contains") != std::string::npos);
      EventSource moved = std::move(*served.events);
      pushed.publish(9);
      CHECK(next_event(moved).bytes->find("\ndata: 9\n") != std::string::npos);
    }
    CHECK(subscriptions().find("ldp:contains") == std::string::npos);
  }
}

TEST_CASE("a subscription that a client cancels ends the stream", "[server][serve]") {
  Server server = make(Io::own_thread, false);
  Thing thing{"arm"};
  auto pushed = thing.property<int>("p");
  server.add(std::move(thing)).value();
  pushed.publish(0);
  Served served = serve(server, "GET /arm/p\nAccept: text/event-stream", true);
  REQUIRE(served.events);
  const std::string location(served.response.fields.find("Location").value());
  CHECK(status(server, "DELETE " + location.substr(location.find("/arm"))) == 204);
  EventSource::Event event;
  while (!event.end) event = next_event(*served.events);
  CHECK(event.end);
}

TEST_CASE("many guests at once, some with streams, while things come and go", "[server][serve][threads]") {
  const Io io = GENERATE(Io::own_thread, Io::in_poll);
  Server server = make(io, false);
  Thing thing{"arm"};
  int value = 0;
  thing.property("pulled", [&] { return value; });
  thing.action("count", [&] { ++value; });
  auto pushed = thing.property<int>("pushed");
  server.add(std::move(thing)).value();
  pushed.publish(0);
  std::atomic<int> wrong{0}, done{0};
  std::vector<std::thread> guests;
  {
    const Polling polling(server);
    for (int t = 0; t < 6; ++t) {
      guests.emplace_back([&, t] {
        for (int i = 0; i < 40; ++i) {
          if (t == 0) {
            Served served = serve(server, "GET /arm/pushed\nAccept: text/event-stream", true);
            wrong += !served.events || !next_event(*served.events).bytes;
          } else if (t == 1) {
            wrong += !server.add(Thing{"other"}) || !server.remove("other");
          } else if (t == 2) {
            wrong += status(server, "POST /arm/actions/count") != 204;
          } else {
            wrong += status(server, "GET /arm/pulled") != 200;
          }
        }
        ++done;
      });
    }
    for (int i = 1; done < 6; ++i) {
      pushed.publish(i);
      std::this_thread::yield();
    }
    for (std::thread& guest : guests) guest.join();
  }
  CHECK(wrong == 0);
  CHECK(value == 40);
}

TEST_CASE("a guest's request may name loopback with the host's port, or an allowed host", "[server][serve][R0.2]") {
  Options options;
  options.security.allowed_hosts = {"robot.example"};
  Server server = make(Io::own_thread, false, std::move(options));
  server.add(Thing{"arm"}).value();
  const auto base = [&](const std::string& host, int version = 11) {
    RequestText request("GET /\nAccept: text/turtle" + (host.empty() ? "\nHost:" : "\nHost: " + host));
    request.get().local_port = host_port;
    request.get().mount = "/robot";
    request.get().version = version;
    if (host.empty()) request.get().fields.pop_back();
    const Served served = server.serve(request.get());
    if (served.response.status != 200) return std::to_string(served.response.status);
    const std::string text(served.response.content());
    const std::size_t at = text.find("ldp:contains <") + 14;
    return text.substr(at, text.find('>', at) - at);
  };
  CHECK(base("localhost:4711") == "http://localhost:4711/robot/arm");
  CHECK(base("127.0.0.1:4711") == "http://127.0.0.1:4711/robot/arm");
  CHECK(base("[::1]:4711") == "http://[::1]:4711/robot/arm");
  CHECK(base("robot.example:4711") == "http://robot.example:4711/robot/arm");
  CHECK(base("", 10) == "http://127.0.0.1:4711/robot/arm");
  CHECK(base("localhost") == "http://localhost/robot/arm");  // a port that somebody forwards
  CHECK(base("localhost:4712") == "http://localhost:4712/robot/arm");
  CHECK(base("evil.example:4711") == "421");
}

TEST_CASE("one server at two prefixes of one host knows both IRIs of a resource", "[server][serve]") {
  Options options;
  options.callbacks.allow = {"127.0.0.1"};
  Server server = make(Io::own_thread, false, std::move(options));
  Thing thing{"arm"};
  auto pushed = thing.property<int>("p");
  server.add(std::move(thing)).value();
  pushed.publish(1);
  for (const std::string_view prefix : {"/robot/deep", "/robot", "", "/robot", "/robot/deep"}) {
    const std::string base = "http://localhost:4711" + std::string(prefix);
    const Served read = serve(server, "GET /arm\nAccept: text/turtle", false, prefix);
    CHECK(read.response.content().find("<" + base + "/arm/p>") != std::string_view::npos);
    const Served made = serve(server,
                              "POST /arm/subscriptions\nContent-Type: text/turtle\n\n@prefix hybrit: <https://hybr-it-projekt.de/ns/hybr-it#> . <> a "
                              "hybrit:Subscription, hybrit:WebCallback ; hybrit:onResource <" +
                                  base + "/arm/p> ; hybrit:callbackURL \"http://127.0.0.1:9/\"^^<http://www.w3.org/2001/XMLSchema#anyURI> .",
                              false, prefix);
    CHECK(made.response.status == 201);
    CHECK(made.response.fields.find("Location").value_or("").substr(0, base.size() + 5) == base + "/arm/");
  }
}

TEST_CASE("the authorizer is asked once about a guest's request and may use the server", "[server][serve][R0.2]") {
  Server* to_use = nullptr;
  std::atomic<int> calls{0};
  Options options;
  options.security.authorize = [&](const http::Request& request) {
    if (++calls == 1) to_use->add(Thing{"born"}).value();
    return request.method == "GET" ? engine::Access::granted : engine::Access::forbidden;
  };
  Server server = make(Io::own_thread, false, std::move(options));
  to_use = &server;
  Thing thing{"arm"};
  thing.property("p", [] { return 1; });
  server.add(std::move(thing)).value();
  const Polling polling(server);
  CHECK(status(server, "GET /arm/p") == 200);
  CHECK(calls == 1);
  CHECK(status(server, "GET /born") == 200);
  CHECK(status(server, "DELETE /arm/p") == 403);
}

TEST_CASE("a Responder on another thread answers a waiting guest", "[server][serve][R0.6]") {
  for (const auto& [io, network] : kinds) {
    Server server = make(io, network);
    std::thread worker;
    Thing thing{"arm"};
    thing.action("work", [&](Responder done) { worker = std::thread([done] { done.succeed(); }); });
    server.add(std::move(thing)).value();
    {
      const Polling polling(server);
      CHECK(status(server, "POST /arm/actions/work\nPrefer: wait=10") / 100 == 2);
    }
    worker.join();
  }
}

TEST_CASE("a callback to the host's own port is refused: it would come back", "[server][serve][R0.13]") {
  Options options;
  options.security.allowed_hosts = {"robot.example"};
  options.callbacks.allow = {"127.0.0.1", "localhost", "robot.example"};
  Server server = make(Io::own_thread, false, std::move(options));
  Thing thing{"arm"};
  auto pushed = thing.property<int>("p");
  server.add(std::move(thing)).value();
  pushed.publish(1);
  const auto order = [&](const std::string& url) { return status(server, "GET /arm/p\nUpgrade: callback\nCallback: " + url); };
  CHECK(order("http://127.0.0.1:4711/arm/actions/turn") == 403);
  CHECK(order("http://localhost:4711/") == 403);
  CHECK(order("http://robot.example:4711/") == 403);
  CHECK(order("http://127.0.0.1:9/receiver") == 201);
}

// SPDX-License-Identifier: Apache-2.0
#include <lrt/server.hpp>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <future>
#include <iterator>
#include <mutex>
#include <thread>

#include <lrt/transport/loopback.hpp>
#include <lrt/transport/named.hpp>

#include "src/server/listen_addresses.hpp"
#include "tests/support/allocations.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"
#include "tests/support/socket.hpp"
#include "tests/support/websocket.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

Options any_port(Io io = Io::own_thread) {
  Options options;
  options.listen.port = 0;
  options.threads.io = io;
  return options;
}

Server make(Options options = any_port()) { return Server::create(std::move(options)).value(); }

std::size_t threads() {
  const std::filesystem::directory_iterator tasks("/proc/self/task");
  return static_cast<std::size_t>(std::distance(begin(tasks), end(tasks)));
}

/// Waits for a condition; fails the test after a minute.
template <class F>
void eventually(F condition) {
  const auto until = std::chrono::steady_clock::now() + seconds(60);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > until) FAIL("it did not come true in a minute");
    std::this_thread::yield();
  }
}

class Flag {
 public:
  void set() {
    const std::lock_guard lock(mutex_);
    set_ = true;
    changed_.notify_all();
  }
  bool wait() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, seconds(60), [this] { return set_; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool set_ = false;
};

const Io all_io[] = {Io::own_thread, Io::in_poll};

}  // namespace

TEST_CASE("create says why it does not listen", "[server][R0.2]") {
  Server first = make();
  Options taken = any_port();
  taken.listen.port = first.port();
  const auto code = [](Options options) {
    const Result<Server> server = Server::create(std::move(options));
    return server ? Errc{255} : server.error().code;
  };
  CHECK(code(taken) == Errc::address_in_use);
  Options open = any_port();
  open.listen.address = "0.0.0.0";
  CHECK(code(open) == Errc::insecure_address);
  open.listen.address = "::";
  CHECK(code(open) == Errc::insecure_address);
  Options bad = any_port();
  bad.listen.address = "not an address";
  CHECK(code(bad) != Errc{255});
  Options no_executor = any_port();
  no_executor.threads.dispatch = Dispatch::executor;
  CHECK(code(no_executor) == Errc::invalid_option);
  Options nothing = any_port();
  nothing.listen.transport = [](transport::TransportOptions) { return nullptr; };
  CHECK(code(nothing) == Errc::invalid_option);
}

TEST_CASE("a network address needs an authorizer or the integrator's word", "[server][R0.2]") {
  Options open = any_port();
  open.listen.address = "0.0.0.0";
  SECTION("the word") { open.security.allow_unprotected_network = true; }
  SECTION("an authorizer") {
    open.security.authorize = [](const http::Request&) { return engine::Access::granted; };
  }
  Server server = make(std::move(open));
  CHECK(Socket(server.port()).ask("GET /\nHost: 127.0.0.1:" + std::to_string(server.port())).status == 200);
}

TEST_CASE("any loopback address will do", "[server][R0.2]") {
  Options options = any_port();
  options.listen.address = "127.0.0.2";
  CHECK(make(std::move(options)).url().find("http://127.0.0.2:") == 0);
  Options six = any_port();
  six.listen.address = "::1";
  if (const Result<Server> server = Server::create(std::move(six))) CHECK(server->url() == "http://[::1]:" + std::to_string(server->port()) + "/");
  else CHECK(server.error().code == Errc::io_error);  // a machine without IPv6
}

TEST_CASE("the address may be a host name, which requests may name", "[server][R0.2]") {
  for (const std::string_view transport : transport::names()) {
    CAPTURE(transport);
    Options options = any_port();
    options.listen.address = "LocalHost";
    options.listen.transport = [&](transport::TransportOptions t) {
      CHECK(t.address == "127.0.0.1");
      return transport::make_named(transport, std::move(t));
    };
    Server server = make(std::move(options));
    const std::string port = std::to_string(server.port());
    CHECK(server.url() == "http://LocalHost:" + port + "/");
    for (const std::string host : {"localhost:", "LOCALHOST:", "127.0.0.1:"}) {
      const Answer root = Socket(server.port()).ask("GET /\nHost: " + host + port);
      CHECK(root.status == 200);
    }
    CHECK(Socket(server.port()).ask("GET /\nHost: robot.local:" + port).status == 421);
  }
}

TEST_CASE("a host name is resolved once: IPv4 first, and what does not resolve is one error", "[server][R0.2]") {
  CHECK(listen_addresses("::1").value() == std::vector<std::string>{"::1"});
  CHECK(listen_addresses("192.0.2.1").value() == std::vector<std::string>{"192.0.2.1"});
  CHECK(listen_addresses("localhost").value().front() == "127.0.0.1");
  Options options = any_port();
  options.listen.address = "robot.invalid";  // RFC 6761 6.4: it never resolves
  const Result<Server> server = Server::create(options);
  REQUIRE_FALSE(server);
  CHECK(server.error().code == Errc::invalid_option);
  CHECK(server.error().message.find("listen.address: expected a numeric address or a host name that resolves, found \"robot.invalid\"") == 0);
  options.listen.address = "127.0.0.1.robot.invalid";  // not a loopback address
  CHECK(Server::create(options).error().code == Errc::invalid_option);
}

TEST_CASE("a port that another server has is not taken on another address of the name", "[server][R0.2]") {
  Server first = make();
  Options options = any_port();
  options.listen.address = "localhost";
  options.listen.port = first.port();
  CHECK(Server::create(std::move(options)).error().code == Errc::address_in_use);
}

TEST_CASE("with its own thread pushed and static resources are served though the host never polls", "[server][R0.5]") {
  Server server = make();
  Thing thing{"arm"};
  auto pushed = thing.property<double>("pushed");
  server.add(std::move(thing)).value();
  pushed.publish(1.5);
  Socket client(server.port());
  const std::string host = "\nHost: 127.0.0.1:" + std::to_string(server.port());
  CHECK(client.ask("GET /" + host).status == 200);
  CHECK(client.ask("GET /arm" + host).status == 200);
  const Answer a = client.ask("GET /arm/pushed" + host);
  CHECK(a.status == 200);
  CHECK(missing(a, "<arm/pushed> vom:numericalValue \"1.5\"^^xsd:double .", server.url()) == "");
}

TEST_CASE("a pulled property is 503 when the host does not poll, and is not read later without a client", "[server][R0.6]") {
  Options options = any_port();
  options.limits.host_timeout = milliseconds(1);
  Server server = make(std::move(options));
  Thing thing{"arm"};
  int writes = 0;
  thing.property("p", [] { return 1; }).on_write([&](int) { ++writes; });
  server.add(std::move(thing)).value();
  Socket client(server.port());
  const std::string host = "Host: 127.0.0.1:" + std::to_string(server.port()) + "\n";
  const Answer a = client.ask("GET /arm/p\n" + host);
  CHECK(a.status == 503);
  CHECK(a.has("Retry-After"));
  CHECK(client.ask(Bench::turtle_request("PUT", "/arm/p", number_body("1"), host)).status == 503);
  for (int i = 0; i < 10; ++i) server.poll();
  CHECK(writes == 0);
}

TEST_CASE("lambdas run in poll, on the host's thread, with either kind of I/O", "[server][R0.5]") {
  const Io io = GENERATE(Io::own_thread, Io::in_poll);
  Server server = make(any_port(io));
  std::thread::id ran;
  Thing thing{"arm"};
  thing.property("p", [&] { return ran = std::this_thread::get_id(), 1; });
  server.add(std::move(thing)).value();
  Socket client(server.port());
  const Answer a = client.ask("GET /arm/p\nHost: 127.0.0.1:" + std::to_string(server.port()), [&] { server.poll(); });
  CHECK(a.status == 200);
  CHECK(ran == std::this_thread::get_id());
}

TEST_CASE("Io::in_poll makes no thread, Io::own_thread one", "[server]") {
  const std::size_t before = threads();
  {
    Server server = make(any_port(Io::in_poll));
    Socket client(server.port());
    CHECK(client.ask("GET /\nHost: 127.0.0.1:" + std::to_string(server.port()), [&] { server.poll(); }).status == 200);
    CHECK(threads() == before);
  }
  {
    Server server = make(any_port(Io::own_thread));
    CHECK(threads() == before + 1);
  }
  eventually([&] { return threads() == before; });
}

TEST_CASE("poll begins at most one lambda after its budget is used up, and says that there is more", "[server]") {
  Options options = any_port(Io::in_poll);
  transport::Loopback* loopback = nullptr;
  options.listen.transport = [&](transport::TransportOptions t) {
    auto made = std::make_unique<transport::Loopback>(std::move(t));
    loopback = made.get();
    return made;
  };
  Server server = make(std::move(options));
  int calls = 0, answers = 0;
  for (int i = 0; i < 5; ++i) {
    Thing thing{"arm" + std::to_string(i)};
    thing.property("p", [&] { return ++calls; });
    server.add(std::move(thing)).value();
    RequestText request("GET /arm" + std::to_string(i) + "/p\nHost: localhost:0");
    loopback->submit(request.get(), [&](http::Response r) { answers += r.status == 200; });
  }
  for (int expected = 1; expected <= 5; ++expected) {
    const milliseconds rest = server.poll(microseconds(0));
    CHECK(calls == expected);
    if (expected < 5) CHECK(rest.count() == 0);
  }
  server.poll();
  CHECK(answers == 5);
}

TEST_CASE("an idle poll allocates nothing", "[server]") {
  for (const Io io : all_io) {
    Server server = make(any_port(io));
    for (int i = 0; i < 10; ++i) server.poll();
    const std::size_t before = allocations;
    for (int i = 0; i < 100; ++i) server.poll();
    CHECK(allocations == before);
  }
}

TEST_CASE("a GET whose representation is kept allocates nothing, nor does its 304", "[server]") {
  Server server = make(any_port(Io::in_poll));
  Thing thing{"arm"};
  auto angle = thing.property<double>("angle", unit::radian);
  angle.publish(1.5);
  server.add(std::move(thing)).value();
  Socket client(server.port());
  std::string get = "GET /arm/angle\nHost: 127.0.0.1:" + std::to_string(server.port());
  const Answer first = client.ask(get, [&] { server.poll(); });
  for (const int status : {200, 304}) {
    INFO(status);
    if (status == 304) get += "\nIf-None-Match: " + first.field("ETag");
    std::size_t made = 0;
    for (int i = 0; i < 20; ++i) {
      const Answer answer = client.ask(get, [&] {
        const std::size_t before = allocations;
        server.poll();
        if (i >= 10) made += allocations - before;
      });
      REQUIRE(answer.status == status);
    }
    CHECK(made == 0);
  }
}

TEST_CASE("things come and go while the server serves", "[server][R0.3]") {
  for (const Io io : all_io) {
    Server server = make(any_port(io));
    Socket client(server.port());
    const std::string host = "\nHost: 127.0.0.1:" + std::to_string(server.port());
    const auto status = [&](const std::string& path) { return client.ask("GET " + path + host, [&] { server.poll(); }).status; };
    CHECK(status("/arm") == 404);
    server.add(Thing{"arm"}).value();
    CHECK(status("/arm") == 200);
    CHECK(server.add(Thing{"arm"}).error().code == Errc::duplicate_path);
    CHECK(server.remove("leg").error().code == Errc::unknown_path);
    server.remove("arm").value();
    CHECK(status("/arm") == 404);
  }
}

TEST_CASE("a lambda may add and remove things", "[server][R0.3]") {
  const Dispatch where = GENERATE(Dispatch::in_poll, Dispatch::io_thread);
  Options options = any_port();
  options.threads.dispatch = where;
  Server server = make(std::move(options));
  Thing thing{"arm"};
  thing.action("grow", [&] {
    server.add(Thing{"arm/new"}).value();
    server.remove("arm/new").value();
    server.add(Thing{"arm/other"}).value();
  });
  server.add(std::move(thing)).value();
  Socket client(server.port());
  const std::string host = "\nHost: 127.0.0.1:" + std::to_string(server.port());
  CHECK(client.ask("POST /arm/actions/grow" + host, [&] { server.poll(); }).status == 204);
  CHECK(client.ask("GET /arm/other" + host).status == 200);
}

TEST_CASE("start runs the host's part on a thread of its own, until stop", "[server]") {
  for (const Io io : all_io) {
    const std::size_t before = threads();
    {
      Server server = make(any_port(io));
      Thing thing{"arm"};
      std::thread::id ran;
      thing.property("p", [&] { return ran = std::this_thread::get_id(), 1; });
      server.add(std::move(thing)).value();
      server.start();
      Socket client(server.port());
      CHECK(client.ask("GET /arm/p\nHost: 127.0.0.1:" + std::to_string(server.port())).status == 200);
      CHECK(ran != std::this_thread::get_id());
      server.wake();
      server.stop();
      CHECK(server.add(Thing{"late"}).error().code == Errc::closed);
    }
    eventually([&] { return threads() == before; });
  }
}

TEST_CASE("run ends when another thread stops the server", "[server]") {
  for (const Io io : all_io) {
    Server server = make(any_port(io));
    auto running = std::async(std::launch::async, [&] { server.run(); });
    server.stop();
    CHECK(running.wait_for(seconds(10)) == std::future_status::ready);
    server.stop();  // again
    CHECK(server.poll() > milliseconds(0));
    server.run();  // returns at once
  }
}

TEST_CASE("stop from a lambda ends run", "[server]") {
  const Io io = GENERATE(Io::own_thread, Io::in_poll);
  const Dispatch where = GENERATE(Dispatch::in_poll, Dispatch::io_thread);
  CAPTURE(static_cast<int>(io), static_cast<int>(where));
  Options options = any_port(io);
  options.threads.dispatch = where;
  Server server = make(std::move(options));
  Thing thing{"arm"};
  thing.action("stop", [&] { server.stop(); });
  server.add(std::move(thing)).value();
  auto running = std::async(std::launch::async, [&] { server.run(); });
  Socket client(server.port());
  client.send("POST /arm/actions/stop\nHost: 127.0.0.1:" + std::to_string(server.port()));
  CHECK(running.wait_for(seconds(10)) == std::future_status::ready);
  eventually([&] {  // a response or a clean close
    const auto answer = client.receive(milliseconds(10));
    return client.ended() || (answer && (answer->status == 503 || answer->status == 204));
  });
}

TEST_CASE("stop from a lambda and from another thread at once ends both", "[server]") {
  for (const Io io : all_io)
    for (int round = 0; round < 20; ++round) {
      Server server = make(any_port(io));
      Flag begun;
      Thing thing{"arm"};
      thing.action("stop", [&] {
        begun.set();
        eventually([&] { return !server.add(Thing{"x" + std::to_string(std::rand())}); });  // until the other has begun to stop
        server.stop();
      });
      server.add(std::move(thing)).value();
      server.start();
      Socket client(server.port());
      client.send("POST /arm/actions/stop\nHost: 127.0.0.1:" + std::to_string(server.port()));
      REQUIRE(begun.wait());
      auto stopping = std::async(std::launch::async, [&] { server.stop(); });
      REQUIRE(stopping.wait_for(seconds(10)) == std::future_status::ready);
    }
}

TEST_CASE("start twice is start once", "[server]") {
  Server server = make();
  server.start();
  server.start();
  CHECK(Socket(server.port()).ask("GET /\nHost: 127.0.0.1:" + std::to_string(server.port())).status == 200);
}

TEST_CASE("stop responds 503 to requests in flight, or closes", "[server][R0.6]") {
  Server server = make();
  Thing thing{"arm"};
  thing.property("p", [] { return 1; });
  server.add(std::move(thing)).value();
  Socket waiting(server.port()), other(server.port());
  const std::string host = "\nHost: 127.0.0.1:" + std::to_string(server.port());
  waiting.send("GET /arm/p" + host);
  CHECK(other.ask("GET /" + host).status == 200);  // after it, most likely: the other has been read
  server.stop();
  eventually([&] {
    const auto answer = waiting.receive(milliseconds(10));
    if (answer) CHECK(answer->status == 503);
    return answer || waiting.ended();
  });
}

TEST_CASE("destruction with requests in flight, responders kept, and things published is clean", "[server]") {
  for (const Io io : all_io) {
    std::optional<Responder> kept;
    std::optional<PushedProperty<double>> pushed;
    {
      Server server = make(any_port(io));
      Thing thing{"arm"};
      pushed = thing.property<double>("p");
      thing.action("act", [&](Responder done) { kept = std::move(done); });
      server.add(std::move(thing)).value();
      Socket client(server.port());
      client.send("POST /arm/actions/act\nPrefer: wait=100\nHost: 127.0.0.1:" + std::to_string(server.port()));
      eventually([&] { return server.poll(), kept.has_value(); });
    }
    pushed->publish(1);
    kept->progress(0.5);
    kept->succeed();
  }
}

TEST_CASE("a waiting request gets its response as soon as a Responder is used, from any thread", "[server][R0.8]") {
  for (const Io io : all_io) {
    Server server = make(any_port(io));
    std::optional<Responder> kept;
    Thing thing{"arm"};
    thing.action("act", [&](Responder done) { kept = std::move(done); });
    server.add(std::move(thing)).value();
    Socket client(server.port());
    client.send("POST /arm/actions/act\nPrefer: wait=100\nHost: 127.0.0.1:" + std::to_string(server.port()));
    eventually([&] { return server.poll(), kept.has_value(); });
    std::thread other([&] { kept->succeed(); });
    CHECK(client.await([&] { server.poll(); }).status == 204);
    other.join();
  }
}

TEST_CASE("an emergency stop works while the host is busy and a long action runs", "[server][R0.5]") {
  const std::string transport(GENERATE(from_range(transport::names())));
  CAPTURE(transport);
  Options options = any_port();
  options.listen.transport = [&](transport::TransportOptions t) { return transport::make_named(transport, std::move(t)); };
  Server server = make(std::move(options));
  std::atomic<bool> stopped{false}, enabled{true}, reported{false}, plan_has_ended{false};
  std::optional<Responder> drive;
  Flag planning, plan_may_end;
  Thing thing{"base"};
  thing.action("drive", [&](Responder done) { drive = std::move(done); });
  thing.action("plan", [&] {
    planning.set();
    plan_has_ended = plan_may_end.wait();
  });
  thing.action("stop", [&] { stopped = true; }).dispatch(Dispatch::io_thread);
  thing
      .action("stopAndReport",
              [&](const Responder& done) {
                reported = true;
                done.succeed();
              })
      .dispatch(Dispatch::io_thread);
  thing.property("enabled", [&] { return enabled.load(); }).on_write([&](bool on) { enabled = on; }).dispatch(Dispatch::io_thread);
  server.add(std::move(thing)).value();
  const std::string host = "\nHost: 127.0.0.1:" + std::to_string(server.port());

  const auto ask = [&](const std::string& request) { return Socket(server.port()).ask(request); };
  std::atomic<bool> over{false};
  std::thread host_thread([&] {
    while (!over) server.poll(), std::this_thread::yield();
  });
  CHECK(ask("POST /base/actions/drive" + host).status == 204);
  CHECK(ask("POST /base/actions/plan\nPrefer: respond-async" + host).status == 202);
  CHECK(planning.wait());

  CHECK(ask("POST /base/actions/stop" + host).status == 204);
  CHECK(stopped);
  CHECK(ask("POST /base/actions/stopAndReport" + host).status == 204);
  CHECK(reported);
  CHECK(ask("PUT /base/enabled\nContent-Type: application/json" + host + "\n\nfalse").status == 204);
  CHECK_FALSE(enabled);
  CHECK(ask("GET /base/enabled\nAccept: application/json" + host).body == "false");
  CHECK_FALSE(plan_has_ended);
  plan_may_end.set();
  over = true;
  host_thread.join();
  REQUIRE(drive);
  CHECK(*drive);
}

TEST_CASE("a command that the robot refuses at once is not 204, and a host that does not poll gives 503", "[server][R0.6]") {
  const std::string transport(GENERATE(from_range(transport::names())));
  CAPTURE(transport);
  Options options = any_port();
  options.limits.host_timeout = milliseconds(50);
  options.listen.transport = [&](transport::TransportOptions t) { return transport::make_named(transport, std::move(t)); };
  Server server = make(std::move(options));
  int starts = 0;
  Thing thing{"arm"};
  thing.action("go", [&](const Responder& done) {
    ++starts;
    done.fail({Errc::refused, "the brake is on"});
  });
  server.add(std::move(thing)).value();
  const std::string request = "POST /arm/actions/go\nHost: 127.0.0.1:" + std::to_string(server.port());
  const Answer late = Socket(server.port()).ask(request);  // nobody polls
  CHECK(late.status == 503);
  CHECK(late.has("Retry-After"));
  server.poll();
  CHECK(starts == 0);
  // A loaded machine may take longer than the timeout: a command that gets 503 has not begun then, either.
  int refused = 0;
  eventually([&] {
    Socket client(server.port());
    client.send(request);
    const Answer answer = client.await([&] { server.poll(); });
    if (answer.status == 503) return false;
    CHECK(answer.status == 409);
    CHECK(answer.says("the brake is on"));
    return ++refused, true;
  });
  CHECK(starts == refused);
}

TEST_CASE("an executor runs the lambdas of Things with Dispatch::executor", "[server][R0.5]") {
  std::mutex mutex;
  std::vector<std::function<void()>> handed;
  Options options = any_port();
  options.threads.executor = [&](std::function<void()> job) {
    const std::lock_guard lock(mutex);
    handed.push_back(std::move(job));
  };
  Server server = make(std::move(options));
  int calls = 0;
  Thing thing{"arm"};
  thing.dispatch(Dispatch::executor).property("p", [&] { return ++calls; });
  server.add(std::move(thing)).value();
  Socket client(server.port());
  const Answer a = client.ask("GET /arm/p\nHost: 127.0.0.1:" + std::to_string(server.port()), [&] {
    const std::lock_guard lock(mutex);
    for (auto& job : handed) job();
    handed.clear();
  });
  CHECK(a.status == 200);
  CHECK(calls == 1);
}

TEST_CASE("an executor that throws costs the request, not the server", "[server][R0.6]") {
  Options options = any_port();
  options.limits.host_timeout = milliseconds(1);
  options.threads.executor = [](std::function<void()>) { throw std::runtime_error("full"); };
  Server server = make(std::move(options));
  Thing thing{"arm"};
  thing.dispatch(Dispatch::executor).property("p", [] { return 1; });
  server.add(std::move(thing)).value();
  Socket client(server.port());
  const std::string host = "\nHost: 127.0.0.1:" + std::to_string(server.port());
  CHECK(client.ask("GET /arm/p" + host).status == 503);
  CHECK(client.ask("GET /" + host).status == 200);
}

TEST_CASE("a server is moved while it serves", "[server]") {
  Server first = make();
  const std::uint16_t port = first.port();
  Server second = std::move(first);
  CHECK(second.port() == port);
  CHECK(Socket(port).ask("GET /\nHost: 127.0.0.1:" + std::to_string(port)).status == 200);
  second = make();
  CHECK_THROWS(Socket(port).ask("GET /\nHost: 127.0.0.1:" + std::to_string(port)));
}

TEST_CASE("lambdas on the I/O thread run without the host", "[server][R0.5]") {
  Options options = any_port();
  options.threads.dispatch = Dispatch::io_thread;
  Server server = make(std::move(options));
  SampleRobot robot;
  server.add(robot.arm()).value();
  Socket client(server.port());
  const std::string host = "Host: 127.0.0.1:" + std::to_string(server.port()) + "\n";
  CHECK(client.ask("GET /arm/count\n" + host).status == 200);
  CHECK(client.ask(Bench::turtle_request("PUT", "/arm/count", number_body("5"), host)).status == 204);
  CHECK(client.ask("POST /arm/actions/measure\n" + host).status == 200);
  CHECK(robot.count == 5);
}

TEST_CASE("many clients and a publishing control loop get along", "[server][R0.11]") {
  Server server = make();
  Thing thing{"arm"};
  auto pushed = thing.property<std::array<double, 3>>("pushed");
  std::atomic<int> written{0};
  thing.property("pulled", [&] { return written.load(); }).on_write([&](int v) { written = v; });
  server.add(std::move(thing)).value();
  pushed.publish({0, 0, 0});
  const std::string host = "Host: 127.0.0.1:" + std::to_string(server.port()) + "\n";
  std::atomic<int> done{0}, wrong{0};
  std::vector<std::thread> clients;
  for (int c = 0; c < 4; ++c)
    clients.emplace_back([&, c] {
      try {
        Socket socket(server.port());
        for (int i = 0; i < 50; ++i) {
          wrong += socket.ask("GET /arm/pushed\n" + host).status != 200;
          wrong += socket.ask("GET /arm/state\n" + host).status != 200;
          wrong += socket.ask(Bench::turtle_request("PUT", "/arm/pulled", number_body(std::to_string(c * 100 + i)), host)).status != 204;
        }
      } catch (const std::exception&) { ++wrong; }
      ++done;
    });
  double step = 0;
  while (done < 4) {
    ++step;
    pushed.publish({step, step, step});
    server.poll();
  }
  for (auto& t : clients) t.join();
  CHECK(wrong == 0);
}

namespace {
/// A picture of a camera: its number is its RDF.
struct Picture {
  std::uint32_t number = 0;
  Bytes bytes;
};
}  // namespace

template <>
struct lrt::rdf::traits<Picture> : lrt::rdf::Record<Picture> {
  static void describe(Record<Picture>& r) { r.field("number", &Picture::number); }
};

TEST_CASE("pictures reach four clients as they are, and no transport copies them", "[server][R0.12][R0.17]") {
  const std::string name(GENERATE(from_range(transport::names())));
  CAPTURE(name);
  constexpr std::size_t size = 1'000'000, clients = 4;
  Options options = any_port(Io::in_poll);
  options.listen.transport = [&](transport::TransportOptions o) { return transport::make_named(name, std::move(o)); };
  Server server = make(std::move(options));
  Thing head{"head"};
  auto image = head.property<Picture>("image").representation("image/x-test", [](const Picture& p) { return p.bytes; });
  server.add(std::move(head)).value();

  std::deque<WebSocketClient> sockets;
  for (std::size_t i = 0; i < clients; ++i) {
    sockets.emplace_back(server.port());
    sockets.back().send("GET /head/image?accept=image/x-test HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(server.port()) +
                        "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: " + WebSocketClient::key +
                        "\r\n\r\n");
  }
  std::size_t polled =
      0;  // bytes allocated within poll(), in pieces as large as those of a picture: how often poll() is called depends on the machine
  const auto until = [&](const auto& reached) {
    eventually([&] {
      const std::size_t before = allocated_bytes;
      server.poll(milliseconds(1));
      if (const std::size_t more = allocated_bytes - before; more >= size / 10) polled += more;
      for (WebSocketClient& s : sockets) s.step();
      return reached();
    });
  };
  const auto all = [&](std::size_t frames) {
    return [&, frames] { return std::all_of(sockets.begin(), sockets.end(), [&](const WebSocketClient& s) { return s.frames.size() == frames; }); };
  };
  Picture picture{1, std::make_shared<const std::string>(size, 'a')};
  image.publish(picture);
  until([&] { return std::all_of(sockets.begin(), sockets.end(), [](const WebSocketClient& s) { return s.status != 0; }); });
  CHECK(sockets.front().status == 101);
  until(all(1));
  polled = 0;
  for (char c : {'b', 'c', 'd'}) {
    picture = {picture.number + 1, std::make_shared<const std::string>(size, c)};
    image.publish(picture);
    until(all(picture.number));
    for (const WebSocketClient& s : sockets) {
      CHECK(s.frames.back().opcode == Frame::binary);
      CHECK(s.frames.back().payload == *picture.bytes);
    }
  }
  std::printf("%s: %.0f KB allocated in poll() for 3 pictures of %.0f KB to %zu clients\n", name.c_str(), static_cast<double>(polled) / 1e3,
              size / 1e3, clients);
  CHECK(polled < size);
}

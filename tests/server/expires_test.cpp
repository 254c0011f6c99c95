// SPDX-License-Identifier: Apache-2.0
// PropertyHandle::expires() in a server: a drive command without a driver stops the base.

#include <poll.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <lrt/lrt.hpp>
#include <lrt/served.hpp>
#include <lrt/server_thing.hpp>
#include <lrt/transport/loopback.hpp>

#include "tests/support/allocation_counters.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/message.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/socket.hpp"

namespace {

using namespace lrt;
using namespace lrt::test;
using std::chrono::microseconds;
using std::chrono::milliseconds;

bool comes_true(const std::function<bool()>& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(milliseconds(1));
  }
  return true;
}

/// A base whose drive command lives 200 ms, on a server whose clock moves by hand.
struct Base {
  explicit Base(Options options = {}, std::optional<Dispatch> where = {}) {
    options.clock = &clock;
    options.listen.transport = transport::no_network;
    options.log = [this](LogLevel, std::string_view text) {
      const std::lock_guard lock(log_mutex);
      log += std::string(text) + "\n";
    };
    server.emplace(Server::create(std::move(options)).value());
    Thing thing{"base"};
    drive = thing.property<double>("drive");
    drive.on_write([this](double speed) -> Result<void> {
      done.push_back("write");
      if (speed > 10) throw std::runtime_error("the motor is hot");
      if (speed > 5) return refused("too fast");
      wheels = speed;
      return {};
    });
    drive.expires(milliseconds(200), [this] {
      done.push_back("lapse");
      wheels = 0;
      ++lapses;
      if (throws) throw std::runtime_error("no wheels");
    });
    if (where) drive.dispatch(*where);
    server->add(std::move(thing)).value();
  }

  /// A PUT while the host polls.
  int put(const std::string& speed) {
    std::atomic<int> status{0};
    std::thread client([&] {
      RequestText request("PUT /base/drive\nHost: localhost\nContent-Type: application/json\n\n" + speed);
      status = server->serve(request.get()).response.status;
    });
    while (status == 0) server->poll();
    client.join();
    return status;
  }
  void after(int ms) {
    clock.advance(milliseconds(ms));
    server->poll();
  }

  FakeClock clock;
  std::mutex log_mutex;
  std::string log;
  std::vector<std::string> done;
  std::atomic<double> wheels{0};
  std::atomic<int> lapses{0};
  bool throws = false;
  PushedProperty<double> drive;
  std::optional<Server> server;
};

TEST_CASE("a written value that is not renewed lapses once; a write renews it, also with an equal value", "[server]") {
  Options options;
  options.threads.io = GENERATE(Io::in_poll, Io::own_thread);
  Base base(std::move(options));
  CHECK(base.put("0.5") == 204);
  base.after(199);
  CHECK(base.lapses == 0);
  CHECK(base.put("0.5") == 204);
  base.after(199);
  CHECK(base.lapses == 0);
  CHECK(base.wheels == 0.5);
  base.after(1);
  CHECK(base.lapses == 1);
  CHECK(base.wheels == 0);
  for (int i = 0; i < 5; ++i) base.after(1000);
  CHECK(base.lapses == 1);
  // The next command drives again, and lapses again.
  CHECK(base.put("0.4") == 204);
  CHECK(base.wheels == 0.4);
  base.after(200);
  CHECK(base.lapses == 2);
}

TEST_CASE("neither the robot's own values nor refused writes renew a life", "[server]") {
  Base base;
  CHECK(base.put("0.5") == 204);
  base.after(150);
  base.drive.publish(0.6);
  CHECK(base.put("6") == 409);
  CHECK(base.put("\"fast\"") == 422);
  base.after(49);
  CHECK(base.lapses == 0);
  base.after(1);
  CHECK(base.lapses == 1);
  // A refused write alone has no life.
  CHECK(base.put("6") == 409);
  base.after(1000);
  CHECK(base.lapses == 1);
  // One that threw may have set the value.
  CHECK(base.put("11") == 500);
  base.after(200);
  CHECK(base.lapses == 2);
}

TEST_CASE("a lapse precedes a write that came too late, though the write is in the host's queue already", "[server]") {
  Options options;
  options.threads.io = Io::own_thread;
  Base base(std::move(options));
  CHECK(base.put("0.5") == 204);
  std::atomic<int> status{0};
  std::thread client([&] {
    RequestText request("PUT /base/drive\nHost: localhost\nContent-Type: application/json\n\n0.7");
    status = base.server->serve(request.get()).response.status;
  });
  REQUIRE(comes_true([&] { return base.server->counters().waiting_requests == 1; }));
  base.clock.advance(milliseconds(300));  // the host's loop is late
  while (status == 0) base.server->poll();
  client.join();
  CHECK(status == 204);
  CHECK(base.done == std::vector<std::string>{"write", "lapse", "write"});
  CHECK(base.wheels == 0.7);
  CHECK(base.lapses == 1);
}

TEST_CASE("a lapse takes no memory in the host's loop", "[server]") {
  Options options;
  options.threads.io = Io::own_thread;
  Base base(std::move(options));
  base.done.reserve(100);
  CHECK(base.put("0.5") == 204);
  base.clock.advance(milliseconds(200));
  const std::size_t before = allocations;
  base.server->poll();
  const std::size_t after = allocations;
  CHECK(base.lapses == 1);
  CHECK(after == before);
}

TEST_CASE("a poll without budget runs one lapse, and says that there is more", "[server]") {
  FakeClock clock;
  Options options;
  options.clock = &clock;
  options.listen.transport = transport::no_network;
  options.threads.io = GENERATE(Io::in_poll, Io::own_thread);
  Server server = Server::create(std::move(options)).value();
  int lapses = 0;
  Thing thing{"base"};
  for (int i = 0; i < 5; ++i) {
    auto wheel = thing.property<double>("wheel" + std::to_string(i));
    wheel.on_write([](double) {});
    wheel.expires(milliseconds(100 + 100 * i), [&] { ++lapses; });
  }
  server.add(std::move(thing)).value();
  for (int i = 0; i < 5; ++i) {
    std::atomic<int> status{0};
    std::thread client([&] {
      RequestText request("PUT /base/wheel" + std::to_string(i) + "\nHost: localhost\nContent-Type: application/json\n\n1");
      status = server.serve(request.get()).response.status;
    });
    while (status == 0) server.poll();
    client.join();
    REQUIRE(status == 204);
  }
  CHECK(server.poll() <= milliseconds(100));
  clock.advance(milliseconds(300));
  CHECK(server.poll(microseconds(0)).count() == 0);
  CHECK(lapses == 1);
  CHECK(server.poll(microseconds(0)).count() == 0);
  CHECK(server.poll(microseconds(0)) <= milliseconds(100));
  CHECK(lapses == 3);
  clock.advance(milliseconds(200));
  server.poll(std::chrono::seconds(1));
  CHECK(lapses == 5);
}

TEST_CASE("what throws in a lapse is logged once, and the next one runs", "[server]") {
  Base base;
  base.throws = true;
  CHECK(base.put("0.5") == 204);
  base.after(200);
  base.after(200);
  CHECK(base.lapses == 1);
  CHECK(comes_true([&] {
    base.server->poll();
    const std::lock_guard lock(base.log_mutex);
    return base.log.find("expires() of property \"/base/drive\" failed: it threw: no wheels") != std::string::npos;
  }));
  CHECK(base.put("0.5") == 204);
  base.after(200);
  CHECK(base.lapses == 2);
}

TEST_CASE("the values of a thing that was removed do not lapse", "[server]") {
  Base base;
  CHECK(base.put("0.5") == 204);
  base.server->remove("base").value();
  base.after(1000);
  CHECK(base.lapses == 0);
}

TEST_CASE("when the server stops, written values lapse at once: nobody can renew them", "[server]") {
  SECTION("on the thread that polls") {
    Base base;
    CHECK(base.put("0.5") == 204);
    base.server->stop();
    CHECK(base.lapses == 1);
    base.after(1000);
    CHECK(base.lapses == 1);
  }
  SECTION("stopped by another thread: the next poll") {
    Base base;
    CHECK(base.put("0.5") == 204);
    std::thread([&] { base.server->stop(); }).join();
    CHECK(base.lapses == 0);
    base.server->poll();
    CHECK(base.lapses == 1);
  }
  SECTION("run() on a thread of its own") {
    Base base;
    base.server->start();
    RequestText request("PUT /base/drive\nHost: localhost\nContent-Type: application/json\n\n0.5");
    CHECK(base.server->serve(request.get()).response.status == 204);
    base.server->stop();
    CHECK(base.lapses == 1);
  }
  SECTION("the thread that does I/O") {
    Options options;
    options.threads.io = GENERATE(Io::in_poll, Io::own_thread);
    Base base(std::move(options), Dispatch::io_thread);
    CHECK(base.put("0.5") == 204);
    base.server->stop();
    CHECK(base.lapses == 1);
  }
}

TEST_CASE("with Dispatch::io_thread a value lapses though the host never polls", "[server]") {
  Options options;
  options.threads.io = Io::own_thread;
  options.listen.port = 0;
  Server server = Server::create(std::move(options)).value();
  std::atomic<int> lapses{0};
  std::atomic<double> wheels{0};
  Thing thing{"base"};
  auto drive = thing.property<double>("drive");
  drive.dispatch(Dispatch::io_thread);
  drive.on_write([&](double speed) { wheels = speed; });
  drive.expires(milliseconds(200), [&] { wheels = 0, ++lapses; });
  server.add(std::move(thing)).value();
  {
    Socket driver(server.port());  // it vanishes after one command
    CHECK(driver.ask("PUT /base/drive\nHost: 127.0.0.1:" + std::to_string(server.port()) + "\nContent-Type: application/json\n\n0.5").status == 204);
  }
  CHECK(comes_true([&] { return lapses == 1; }));
  CHECK(wheels == 0);
}

TEST_CASE("on an executor a value lapses there", "[server]") {
  std::mutex mutex;
  std::vector<std::function<void()>> tasks;
  Options options;
  options.threads.executor = [&](std::function<void()> task) {
    const std::lock_guard lock(mutex);
    tasks.push_back(std::move(task));
  };
  options.threads.io = Io::own_thread;
  Base base(std::move(options), Dispatch::executor);
  const auto run = [&] {
    std::vector<std::function<void()>> now;
    {
      const std::lock_guard lock(mutex);
      now.swap(tasks);
    }
    for (auto& task : now) task();
    return base.lapses.load();
  };
  std::atomic<int> status{0};
  std::thread client([&] {
    RequestText request("PUT /base/drive\nHost: localhost\nContent-Type: application/json\n\n0.5");
    status = base.server->serve(request.get()).response.status;
  });
  CHECK(comes_true([&] { return run(), status != 0; }));
  client.join();
  CHECK(status == 204);
  base.clock.advance(milliseconds(200));
  base.server->wake();
  CHECK(comes_true([&] {
    RequestText request("GET /base\nHost: localhost");  // a turn
    (void)base.server->serve(request.get());
    return run() == 1;
  }));
  CHECK(base.wheels == 0);
}

TEST_CASE("a host that sleeps on the descriptor wakes up for a lapse", "[server]") {
  Options options;
  options.listen.port = 0;
  options.threads.io = GENERATE(Io::in_poll, Io::own_thread);
  Server server = Server::create(std::move(options)).value();
  std::atomic<int> lapses{0};
  Thing thing{"base"};
  auto drive = thing.property<double>("drive");
  drive.on_write([](double) {});
  drive.expires(milliseconds(100), [&] { ++lapses; });
  server.add(std::move(thing)).value();
  std::thread client([&] {
    try {
      Socket socket(server.port());
      socket.ask("PUT /base/drive\nHost: 127.0.0.1:" + std::to_string(server.port()) + "\nContent-Type: application/json\n\n0.5");
    } catch (const std::exception&) {}
  });
  bool woke = true;
  while (lapses == 0 && woke) {
    pollfd item{server.descriptor(), POLLIN, 0};
    woke = ::poll(&item, 1, 30'000) == 1;
    server.poll();
  }
  client.join();
  CHECK(woke);
  CHECK(lapses == 1);
}

}  // namespace

// SPDX-License-Identifier: Apache-2.0
// Server::poll() beside threads that have the engine: it never waits for them, and nothing is lost.

#include <lrt/server.hpp>

#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <poll.h>

#include <lrt/served.hpp>
#include <lrt/transport/named.hpp>

#include "src/server/engine_lock.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/event_stream.hpp"
#include "tests/support/message.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/socket.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

/// The engine calls it with its lock. A thread that calls it may stay there.
class HeldIds final : public IdSource {
 public:
  std::string next() override {
    std::unique_lock lock(mutex_);
    if (std::exchange(holds_, false)) {
      is_held_ = true;
      changed_.notify_all();
      if (!changed_.wait_for(lock, seconds(20), [this] { return !is_held_; })) was_too_long_ = true;
      is_held_ = false;
    }
    return "i" + std::to_string(++last_);
  }
  /// The next call stays until release().
  void hold() {
    const std::lock_guard lock(mutex_);
    holds_ = true;
  }
  void wait_until_held() {
    std::unique_lock lock(mutex_);
    REQUIRE(changed_.wait_for(lock, seconds(30), [this] { return is_held_; }));
  }
  void release() {
    const std::lock_guard lock(mutex_);
    is_held_ = false;
    changed_.notify_all();
  }
  bool was_too_long() {
    const std::lock_guard lock(mutex_);
    return was_too_long_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool holds_ = false, is_held_ = false, was_too_long_ = false;
  int last_ = 0;
};

/// A server in poll(), and another thread of the host that can keep its engine.
struct Robot {
  explicit Robot(Options options = {}) {
    options.listen.port = 0;
    options.threads.io = Io::in_poll;
    options.ids = ids;
    server.emplace(Server::create(std::move(options)).value());
    Thing thing{"arm"};
    angle = thing.property<double>("angle");
    angle->publish(1);
    thing.property("target", [this] { return target; }).on_write([this](double value) { target = value; });
    thing.action("act", [this] { ++acted; });
    thing.action("halt", [this] { ++halted; }).stop();
    server->add(std::move(thing)).value();
    server->descriptor();  // the host sleeps on it
    for (int i = 0; i < 5; ++i) server->poll();
  }
  ~Robot() {
    ids->release();
    if (holder.joinable()) {
      while (!holder_has_ended) server->poll();
      holder.join();
    }
  }

  /// From now on another thread has the engine.
  void take_engine() {
    ids->hold();
    holder_has_ended = false;
    holder = std::thread([this] {
      RequestText request("POST /arm/actions/act\nHost: localhost:4711");
      request.get().local_port = 4711;
      (void)server->serve(request.get());
      holder_has_ended = true;
      server->wake();
    });
    ids->wait_until_held();
  }
  /// Polls as a loop does, and counts how often the thread waited.
  long poll_often(int times = 50) {
    rusage before{}, after{};
    ::getrusage(RUSAGE_THREAD, &before);
    for (int i = 0; i < times; ++i) server->poll(microseconds(200));
    ::getrusage(RUSAGE_THREAD, &after);
    return after.ru_nvcsw - before.ru_nvcsw;
  }
  /// Polls only when the descriptor says so.
  void until(const std::function<bool()>& condition) {
    const auto end = std::chrono::steady_clock::now() + seconds(30);
    while (!condition()) {
      REQUIRE(std::chrono::steady_clock::now() < end);
      pollfd item{server->descriptor(), POLLIN, 0};
      if (::poll(&item, 1, 10) == 1) server->poll();
    }
  }
  std::size_t subscribed() const { return server->counters().event_streams; }
  std::string host() const { return "\nHost: 127.0.0.1:" + std::to_string(server->port()); }

  const std::shared_ptr<HeldIds> ids = std::make_shared<HeldIds>();
  std::optional<Server> server;
  std::optional<PushedProperty<double>> angle;
  double target = 0;
  std::atomic<int> acted{0}, halted{0};
  std::thread holder;
  std::atomic<bool> holder_has_ended{true};
};

}  // namespace

TEST_CASE("poll returns while another thread has the engine, and what came meanwhile is done afterwards", "[server][poll]") {
  Robot robot;
  StreamClient watcher(robot.server->port(), "/arm/angle");
  std::vector<Event> events;
  const auto watch = [&] {
    watcher.step();
    for (Event& e : watcher.take()) events.push_back(std::move(e));
  };
  robot.until([&] { return watch(), events.size() == 1; });
  Socket reader(robot.server->port()), writer(robot.server->port()), body(robot.server->port()), stop(robot.server->port());
  robot.poll_often(5);

  robot.take_engine();
  robot.angle->publish(2);
  reader.send("GET /arm/angle" + robot.host() + "\nAccept: text/plain");
  writer.send("PUT /arm/target" + robot.host() + "\nContent-Type: text/plain\n\n7");
  body.send_header("PUT /arm/target" + robot.host() + "\nContent-Type: text/plain", 1, false);
  stop.send("POST /arm/actions/halt" + robot.host());
  const long waits = robot.poll_often();
  body.write("8");
  const long more_waits = robot.poll_often();
  StreamClient late(robot.server->port(), "/arm/angle");
  robot.poll_often();
  CHECK_FALSE(robot.ids->was_too_long());  // else poll() had to wait for the other thread
  if (!is_sanitized) CHECK(waits + more_waits == 0);
  CHECK_FALSE(reader.receive().has_value());

  robot.ids->release();  // from here on poll() is called only when the descriptor is readable
  std::optional<Answer> read, written, had_body, stopped;
  const auto receive = [](Socket& socket, std::optional<Answer>& answer) {
    if (!answer) answer = socket.receive();
  };
  robot.until([&] {
    receive(reader, read), receive(writer, written), receive(body, had_body), receive(stop, stopped);
    return read && written && had_body && stopped;
  });
  CHECK(read->status == 200);
  CHECK(read->body == "2");
  CHECK(written->status == 204);
  CHECK(had_body->status == 204);
  CHECK(stopped->status == 204);
  CHECK(robot.halted == 1);
  robot.until([&] { return watch(), events.size() >= 2; });
  std::vector<Event> first;
  robot.until([&] {
    late.step();
    for (Event& e : late.take()) first.push_back(std::move(e));
    return !first.empty();
  });
  CHECK(late.status == 200);
  CHECK(first.front().id == events.back().id);
}

TEST_CASE("a channel that ends while another thread has the engine is forgotten", "[server][poll]") {
  Robot robot;
  {
    StreamClient watcher(robot.server->port(), "/arm/angle");
    robot.until([&] { return watcher.step(), !watcher.take().empty(); });
    CHECK(robot.subscribed() == 1);
    robot.take_engine();
  }
  robot.poll_often();
  CHECK_FALSE(robot.ids->was_too_long());
  robot.ids->release();
  robot.until([&] { return robot.subscribed() == 0; });
}

TEST_CASE("a command is not carried out if its connection has broken while another thread had the engine", "[server][poll]") {
  Robot robot;
  const int client = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(robot.server->port());
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  REQUIRE(::connect(client, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0);
  robot.poll_often(5);
  robot.take_engine();
  const std::string request = "POST /arm/actions/halt HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(robot.server->port()) + "\r\n\r\n";
  REQUIRE(::send(client, request.data(), request.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(request.size()));
  robot.poll_often();
  const linger at_once{1, 0};  // the connection is reset
  REQUIRE(::setsockopt(client, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once) == 0);
  ::close(client);
  robot.poll_often();
  CHECK_FALSE(robot.ids->was_too_long());
  robot.ids->release();
  robot.until([&] { return robot.acted == 1; });  // what the other thread has asked for
  CHECK(robot.halted == 0);
}

TEST_CASE("requests beyond the limit are refused while another thread has the engine", "[server][poll]") {
  Options options;
  options.limits.max_waiting_requests = 3;
  Robot robot(std::move(options));
  std::vector<std::unique_ptr<Socket>> clients;
  for (int i = 0; i < 10; ++i) clients.push_back(std::make_unique<Socket>(robot.server->port()));
  robot.poll_often(5);
  robot.take_engine();
  for (const auto& client : clients) client->send("GET /arm/angle" + robot.host());
  std::vector<std::optional<Answer>> answers(clients.size());
  const auto answered = [&] {
    std::size_t count = 0;
    for (std::size_t i = 0; i < clients.size(); ++i) {
      if (!answers[i]) answers[i] = clients[i]->receive();
      count += answers[i] ? 1 : 0;
    }
    return count;
  };
  robot.until([&] { return answered() == 7; });
  CHECK_FALSE(robot.ids->was_too_long());
  robot.ids->release();
  robot.until([&] { return answered() == 10; });
  int served = 0, refused = 0;
  for (const auto& answer : answers) {
    served += answer->status == 200 ? 1 : 0;
    refused += answer->status == 503 && answer->field("Retry-After") == "1" ? 1 : 0;
  }
  CHECK(served == 3);
  CHECK(refused == 7);
}

TEST_CASE("bodies beyond the limit are refused while another thread has the engine, small ones are not", "[server][poll]") {
  constexpr std::size_t size = 10'000;
  Options options;
  options.limits.max_waiting_body_bytes = 4 * (2 * size + size / 2);  // two bodies of one client
  Robot robot(std::move(options));
  std::vector<std::unique_ptr<Socket>> clients;
  const auto begin = [&] {
    clients.push_back(std::make_unique<Socket>(robot.server->port()));
    clients.back()->send_header("PUT /arm/target" + robot.host() + "\nContent-Type: text/plain", size, false);
  };
  for (int i = 0; i < 4; ++i) begin();
  Socket small(robot.server->port());
  robot.poll_often();
  robot.take_engine();
  for (const auto& client : clients) client->write(std::string(size, '7'));
  small.send("PUT /arm/target" + robot.host() + "\nContent-Type: text/plain\n\n7");
  std::vector<std::optional<Answer>> answers(clients.size());
  const auto answered = [&] {
    std::size_t count = 0;
    for (std::size_t i = 0; i < clients.size(); ++i) {
      if (!answers[i]) answers[i] = clients[i]->receive();
      count += answers[i] ? 1 : 0;
    }
    return count;
  };
  robot.until([&] { return answered() == 2; });
  robot.poll_often();
  CHECK(answered() == 2);
  CHECK_FALSE(robot.ids->was_too_long());
  robot.ids->release();
  robot.until([&] { return answered() == 4; });
  int refused = 0;
  for (const auto& answer : answers) refused += answer->status == 503 && answer->field("Retry-After") == "1" ? 1 : 0;
  CHECK(refused == 2);
  std::optional<Answer> of_small;
  robot.until([&] { return (of_small = small.receive()).has_value(); });
  CHECK(of_small->status == 204);

  // What waited is not counted any more.
  robot.until([&] { return robot.holder_has_ended.load(); });
  robot.holder.join();
  clients.clear();
  answers.assign(2, std::nullopt);
  for (int i = 0; i < 2; ++i) begin();
  robot.poll_often();
  robot.take_engine();
  for (const auto& client : clients) client->write(std::string(size, '7'));
  robot.poll_often();
  CHECK(answered() == 0);
  robot.ids->release();
  robot.until([&] { return answered() == 2; });
  for (const auto& answer : answers) CHECK(answer->status != 503);
}

TEST_CASE("a server stops while requests wait for its engine", "[server][poll]") {
  std::optional<Robot> robot(std::in_place);
  Socket client(robot->server->port());
  robot->poll_often(5);
  robot->take_engine();
  client.send("GET /arm/angle" + robot->host());
  robot->poll_often();
  CHECK_FALSE(robot->ids->was_too_long());
  robot->ids->release();
  robot->server->stop();
  const auto answer = client.receive(seconds(30));
  CHECK((!answer || answer->status == 503 || answer->status == 200));
  robot.reset();
}

TEST_CASE("counters that are read inside poll do not wait for the engine", "[server][poll]") {
  bool takes = false, has_read = false;
  Robot robot;
  Thing thing("counters");
  thing.dispatch(Dispatch::io_thread);
  thing.property("streams", [&] {
    const bool is_taken = std::exchange(takes, false);
    if (is_taken) robot.take_engine();
    const std::uint64_t streams = robot.server->counters().event_streams;
    has_read = is_taken;
    return streams;
  });
  robot.server->add(std::move(thing)).value();
  StreamClient watcher(robot.server->port(), "/arm/angle");
  robot.until([&] { return watcher.step(), robot.subscribed() == 1; });
  Socket client(robot.server->port());
  std::optional<Answer> answer;
  const auto is_answered = [&] { return (answer = client.receive()).has_value(); };
  const std::string request = "GET /counters/streams" + robot.host() + "\nAccept: text/plain";
  client.send(request);
  robot.until(is_answered);
  CHECK(answer->body == "1");
  takes = true;
  client.send(request);
  robot.until([&] { return has_read; });
  CHECK_FALSE(robot.ids->was_too_long());  // else the lambda had to wait for the other thread
  robot.ids->release();
  robot.until(is_answered);
  CHECK(answer->status == 200);
  CHECK(answer->body == "1");
}

// -------------------------------------------------------------------------------------------------------------- the lock

TEST_CASE("whoever was refused hears when the lock is free, and only then", "[server][poll]") {
  std::atomic<int> told{0};
  EngineLock lock([&] { ++told; });
  lock.lock();
  lock.unlock();
  CHECK(told == 0);
  CHECK(lock.try_lock());
  lock.unlock();
  CHECK(told == 0);
  lock.lock();
  bool got = true;
  std::thread([&] { got = lock.try_lock(); }).join();
  CHECK_FALSE(got);
  CHECK(lock.was_refused());
  CHECK(told == 0);
  lock.unlock();
  CHECK(told == 1);
  CHECK(lock.try_lock());
  CHECK_FALSE(lock.was_refused());
  lock.unlock();
  CHECK(told == 1);
}

TEST_CASE("no refusal of the lock goes unheard, and who never waits gets its turn beside many", "[server][poll]") {
  std::atomic<bool> free{false}, ends{false};
  EngineLock lock([&] { free = true; });
  long value = 0;
  std::vector<std::thread> others;
  std::atomic<long> turns{0};
  for (int i = 0; i < 4; ++i)
    others.emplace_back([&] {
      while (!ends) {
        const std::lock_guard held(lock);
        ++value;
        ++turns;
      }
    });
  const auto end = std::chrono::steady_clock::now() + seconds(60);
  int got = 0;
  while (got < 200 && std::chrono::steady_clock::now() < end) {
    if (const std::unique_lock held(lock, std::try_to_lock); held) {
      ++value;
      ++got;
      continue;
    }
    while (!free && std::chrono::steady_clock::now() < end) std::this_thread::yield();  // a lost wake would stay here
    free = false;
  }
  ends = true;
  for (std::thread& other : others) other.join();
  CHECK(got == 200);
  CHECK(value == turns + got);
}

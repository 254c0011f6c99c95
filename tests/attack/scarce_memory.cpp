// SPDX-License-Identifier: Apache-2.0
// Of a thousand allocations of a server some fail, at random, on all of its threads: a request gets a response or its connection is closed. When memory
// is there again, each request is served. LRT_ATTACK_RUNS: how many servers of each kind; LRT_ATTACK_SEED: where the first begins.

#include <lrt/rdf/value.hpp>
#include <lrt/server.hpp>
#include <lrt/transport/named.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/sample_robot.hpp"
#include "tests/support/socket.hpp"

namespace {

/// Of a thousand allocations, on threads that are not the test's.
std::atomic<unsigned> failing{0};
std::atomic<std::uint64_t> drawn{0}, failures{0};
thread_local bool is_of_test = false;

bool fails_now() noexcept {
  const unsigned share = failing.load(std::memory_order_relaxed);
  if (share == 0 || is_of_test) return false;
  // SplitMix64: the n-th number of a sequence, on any thread.
  std::uint64_t x = drawn.fetch_add(0x9E3779B97F4A7C15U, std::memory_order_relaxed);
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9U;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBU;
  const bool fails = (x ^ (x >> 31)) % 1'000 < share;
  if (fails) failures.fetch_add(1, std::memory_order_relaxed);
  return fails;
}

}  // namespace

#include "tests/attack/failing_new.hpp"  // calls fails_now()

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;

namespace {

std::size_t number_in(const char* variable, std::size_t otherwise) {
  const char* const text = std::getenv(variable);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

struct Setting {
  const char* transport;
  Io io;
};

/// A robot with all that a server may have, on threads of its own.
class Scene {
 public:
  explicit Scene(const Setting& setting) {
    Options options;
    options.listen.port = 0;
    options.listen.transport = [name = std::string(setting.transport)](transport::TransportOptions t) {
      return transport::make_named(name, std::move(t));
    };
    options.threads.io = setting.io;
    options.threads.body_threads = 1;
    options.limits.small_body_bytes = 16;
    options.limits.host_timeout = milliseconds(300);
    options.limits.stop_timeout = milliseconds(200);
    options.subscriptions.sample_period = milliseconds(1);
    options.callbacks.file = folder_ / "state/subscriptions";
    options.callbacks.allow = {"127.0.0.1"};
    options.callbacks.first_pause = options.callbacks.max_pause = milliseconds(1);
    options.callbacks.save_timeout = milliseconds(300);
    options.security.audit.sink = [this](std::string_view) { ++audited_; };
    options.log = [this](LogLevel, std::string_view) { ++logged_; };
    server_.emplace(Server::create(std::move(options)).value());
    server_->add(robot_.arm()).value();
    runner_ = std::thread([this] {
      while (!over_) { server_->run(); }
    });
  }
  ~Scene() {
    over_ = true;
    server_->stop();
    runner_.join();
  }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  /// 0: the connection was closed without a response. -1: neither within half a minute.
  int ask(const std::string& text) {
    int status = -1;
    try {
      if (!socket_ || socket_->ended()) socket_.emplace(server_->port());
      socket_->send(text);
      for (const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30); std::chrono::steady_clock::now() < end;) {
        if (auto answer = socket_->receive(milliseconds(20))) return said_ = std::move(answer->body), answer->status;
        if (socket_->ended()) {
          status = 0;
          break;
        }
      }
    } catch (const std::exception&) { status = 0; }
    socket_.reset();
    return status;
  }
  /// The same, again while it is 503: a slow machine does not reach the host or the disk in time.
  int ask_patiently(const std::string& text) {
    int status = ask(text);
    for (int again = 0; again < 100 && status == 503; ++again) status = ask(text);
    return status;
  }
  /// Begins a stream and leaves it open.
  void open(const std::string& text) {
    try {
      streams_.push_back(std::make_unique<Socket>(server_->port()));
      streams_.back()->send(text);
    } catch (const std::exception&) {}
    if (streams_.size() > 20) streams_.erase(streams_.begin(), streams_.begin() + 10);
  }
  void close_streams() { streams_.clear(); }
  /// The body of the last response.
  const std::string& said() const noexcept { return said_; }
  void hang_up() { socket_.reset(); }

 private:
  Folder folder_;
  SampleRobot robot_;
  std::optional<Server> server_;
  std::atomic<bool> over_{false};
  std::atomic<std::size_t> audited_{0}, logged_{0};
  std::thread runner_;
  std::optional<Socket> socket_;
  std::string said_;
  std::vector<std::unique_ptr<Socket>> streams_;
};

const std::string pose = R"({"x": 1, "y": 2, "frame": "base"})";

/// Requests that go all ways through a server, with the response when there is memory.
std::vector<std::pair<std::string, int>> requests() {
  return {
      {"GET /", 200},
      {"GET /arm", 200},
      {"GET /arm/state\nAccept: application/ld+json", 200},
      {"GET /arm/angle\nAccept: application/json", 200},
      {"GET /arm/speed", 200},
      {"GET /arm\nAccept: text/html", 200},
      {"GET /all", 200},
      {"GET /nowhere", 404},
      {"OPTIONS /arm/angle", 204},
      {"PUT /arm/angle\nContent-Type: application/json\n\n43.5", 204},
      {"PUT /arm/angle\nContent-Type: application/json\n\n430", 422},
      {"PUT /arm/pose\nContent-Type: application/json\n\n" + pose, 204},
      {"PUT /arm/count\nContent-Type: text/turtle\n\n<> a <", 400},
      {"POST /arm/actions/home", 200},
      {"POST /arm/waypoints\nContent-Type: application/json\n\n" + pose, 201},
      {"GET /arm/angle\nUpgrade: callback\nConnection: Upgrade\nCallback: http://127.0.0.1:9/x", 201},
      {"GET /arm/subscriptions", 200},
  };
}

void run(const Setting& setting, unsigned share, std::uint64_t seed) {
  CAPTURE(setting.transport, share, seed);
  is_of_test = true;
  Scene scene(setting);
  const auto all = requests();
  std::vector<int> usual;
  for (const auto& one : all) usual.push_back(scene.ask_patiently(one.first));
  drawn = seed;
  const std::uint64_t before = failures;
  failing = share;
  std::size_t served = 0, refused = 0;
  for (std::size_t i = 0; i < 12 * all.size(); ++i) {
    const auto& one = all[(i * 7 + seed) % all.size()].first;
    CAPTURE(one);
    const int status = scene.ask(one);
    CHECK(status >= 0);  // a response, or the connection is closed
    ++(status > 0 && status < 500 ? served : refused);
    if (i % 10 == 0) scene.open("GET /arm/angle\nAccept: text/event-stream");
    if (i % 10 == 5)
      scene.open("GET /arm/angle\nUpgrade: websocket\nConnection: Upgrade\nSec-WebSocket-Version: 13\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==");
    if (i % 50 == 49) scene.close_streams();
  }
  failing = 0;
  scene.hang_up();  // the server may be closing this connection just now
  CHECK(failures > before);
  CHECK(served > 0);
  scene.close_streams();
  CAPTURE(served, refused);
  for (std::size_t i = 0; i < all.size(); ++i) {
    CAPTURE(all[i].first);
    const int status = scene.ask_patiently(all[i].first);
    CAPTURE(status, scene.said());
    CHECK((status == usual[i] || (status == 409 && usual[i] == 201)));  // 409: the collection is full by now
  }
}

}  // namespace

TEST_CASE("a value that cannot be copied for want of memory stays what it is, and so does the other", "[attack][memory]") {
  const std::string text(100, 'x');
  const rdf::Value value(rdf::Value::Sequence{rdf::Value(text), rdf::Value(std::int64_t{4})});
  rdf::Value other(text);
  std::size_t thrown = 0;
  failing = 1'000;
  try {
    const rdf::Value copy(value);
  } catch (const std::bad_alloc&) { ++thrown; }
  try {
    other = value;
  } catch (const std::bad_alloc&) { ++thrown; }
  failing = 0;
  CHECK(thrown == 2);
  CHECK(rdf::same(other, rdf::Value(text)));
  CHECK(value.sequence()->size() == 2);
}

TEST_CASE("a server of whose allocations some fail goes on, and serves each request when memory is there again", "[attack][memory]") {
  const std::size_t runs = number_in("LRT_ATTACK_RUNS", 10), seed = number_in("LRT_ATTACK_SEED", 1);
  std::vector<Setting> settings = {{"http", Io::own_thread}, {"http", Io::in_poll}};
  if (transport::make_named("libwebsockets", {})) settings.push_back({"libwebsockets", Io::own_thread});
  for (const Setting& setting : settings)
    for (std::size_t i = 0; i < runs; ++i) run(setting, 5 + static_cast<unsigned>(i % 6), seed + i);
}

// SPDX-License-Identifier: Apache-2.0
// A stop as a state, over a server with threads.
#include <lrt/server.hpp>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include <lrt/served.hpp>
#include <lrt/transport/loopback.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/message.hpp"
#include "tests/support/rights_matrix.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

/// A base whose flag is the state. It may be used by several servers, one after the other.
struct Base {
  Thing thing() {
    Thing base{"base"};
    base.action("drive", [this] { ++drives; });
    Action release = base.action("release", [this] { flag = false; });
    base.action("stop", [this] { flag = true; }).stop([this] { return flag.load(); }, release);
    base.property("slow", [this] {
      std::unique_lock lock(mutex);
      blocks = true;
      changed.notify_all();
      changed.wait(lock, [this] { return !is_held; });
      return 1;
    });
    return base;
  }
  void hold(bool held) {
    const std::lock_guard lock(mutex);
    is_held = held;
    changed.notify_all();
  }

  std::atomic<bool> flag{false};
  std::atomic<int> drives{0};
  std::mutex mutex;
  std::condition_variable changed;
  bool is_held = false, blocks = false;  ///< guarded by mutex
};

http::Response ask(Server& server, const std::string& text, const std::string& who = {}) {
  const std::size_t body = text.find("\n\n");
  const std::string token = who.empty() ? "" : "Authorization: Bearer " + who + "-0123456789abcdef\n";
  RequestText request(text.substr(0, body) + "\nHost: localhost:4711\n" + token + (body == std::string::npos ? "" : text.substr(body + 1)));
  request.get().local_port = 4711;
  return server.serve(request.get()).response;
}

std::string state(Server& server, const std::string& who = {}) {
  return std::string(ask(server, "GET /base/stopped\nAccept: application/json", who).content());
}

/// The field that makes a release valid for ten seconds.
std::string valid(Server& server, const std::string& who = {}) {
  const std::string now = ask(server, "GET /", who).fields.joined("Robot-Time");
  const std::size_t slash = now.find('/');
  REQUIRE(slash != std::string::npos);
  return "\nValid-Until: " + now.substr(0, slash + 1) + std::to_string(std::stoll(now.substr(slash + 1)) + 10'000);
}

bool eventually(const std::function<bool()>& is) {
  for (const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30); std::chrono::steady_clock::now() < end;
       std::this_thread::sleep_for(std::chrono::milliseconds(2)))
    if (is()) return true;
  return false;
}

Options without_network() {
  Options options;
  options.listen.transport = transport::no_network;
  return options;
}

}  // namespace

TEST_CASE("a stop is seen and obeyed by all, though a getter blocks the host's loop", "[server][stop]") {
  Base base;
  Server server = Server::create(without_network()).value();
  server.add(base.thing()).value();
  server.start();
  CHECK(eventually([&] { return state(server) == R"({"stopped":false})"; }));
  CHECK(ask(server, "POST /base/actions/drive").status == 204);
  base.hold(true);
  std::thread reader([&] { (void)ask(server, "GET /base/slow"); });
  CHECK(eventually([&] {
    const std::lock_guard lock(base.mutex);
    return base.blocks;
  }));
  CHECK(ask(server, "POST /base/actions/stop").status == 204);
  CHECK(base.flag);
  CHECK(state(server).find(R"("stopped":true)") != std::string::npos);
  CHECK(ask(server, "POST /base/actions/drive").status == 409);
  base.hold(false);
  reader.join();
  CHECK(ask(server, "POST /base/actions/release" + valid(server)).status == 204);
  CHECK(state(server) == R"({"stopped":false})");
  CHECK(ask(server, "POST /base/actions/drive").status == 204);
  CHECK(base.drives == 2);
}

TEST_CASE("a robot that was stopped is stopped after a restart, before its first command", "[server][stop]") {
  Base base;
  {
    Server server = Server::create(without_network()).value();
    server.add(base.thing()).value();
    server.start();
    CHECK(ask(server, "POST /base/actions/drive").status == 204);
    CHECK(ask(server, "POST /base/actions/stop").status == 204);
  }
  Server server = Server::create(without_network()).value();
  server.add(base.thing()).value();
  server.start();
  CHECK(ask(server, "POST /base/actions/drive").status == 409);
  CHECK(state(server).find(R"("by":"the robot itself")") != std::string::npos);
  CHECK(ask(server, "POST /base/actions/release" + valid(server)).status == 204);
  CHECK(ask(server, "POST /base/actions/drive").status == 204);
  CHECK(base.drives == 2);
}

TEST_CASE("a press at the hardware is found without a request", "[server][stop]") {
  Base base;
  Server server = Server::create(without_network()).value();
  server.add(base.thing()).value();
  server.start();
  CHECK(eventually([&] { return state(server) == R"({"stopped":false})"; }));
  base.flag = true;
  CHECK(eventually([&] { return state(server).find(R"("by":"the robot itself")") != std::string::npos; }));
  CHECK(ask(server, "POST /base/actions/drive").status == 409);
  base.flag = false;
  CHECK(eventually([&] { return ask(server, "POST /base/actions/drive").status == 204; }));
}

TEST_CASE("a policy says who may end a stop", "[server][stop][security]") {
  Base base;
  Rulebook book;
  const std::string rules(Rulebook::rules), mode = "acl:mode acl:Write, lrt:Invoke .";
  Options options;
  book.apply(options);
  options.listen.transport = transport::no_network;
  options.threads.dispatch = Dispatch::in_poll;
  Server server = Server::create(std::move(options)).value();
  server.add(base.thing()).value();
  server.start();
  CHECK(ask(server, "POST /base/actions/stop", "anna").status == 403);
  CHECK(ask(server, "POST /base/actions/stop", "bert").status == 204);
  CHECK(state(server, "anna").find(R"("by":"bert")") != std::string::npos);
  CHECK(ask(server, "POST /base/actions/drive", "bert").status == 409);
  for (const char* const who : {"anna", "bert", "carl"}) CHECK(ask(server, "POST /base/actions/release" + valid(server, who), who).status == 403);
  book.put_rules(std::string(rules).replace(rules.find(mode), mode.size(), "acl:mode acl:Write, lrt:Invoke, lrt:Release ."));
  CHECK(eventually([&] { return ask(server, "POST /base/actions/release", "bert").status == 428; }));
  CHECK(ask(server, "POST /base/actions/release" + valid(server, "bert"), "bert").status == 204);
  CHECK(ask(server, "POST /base/actions/drive", "bert").status == 204);
}

// SPDX-License-Identifier: Apache-2.0
#include <lrt/server.hpp>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <fstream>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <lrt/engine/query_service.hpp>
#include <lrt/served.hpp>
#include <lrt/transport/loopback.hpp>
#include <lrt/transport/named.hpp>

#include "src/server/audit.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/message.hpp"
#include "tests/support/sample_robot.hpp"
#include "tests/support/socket.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace std::chrono_literals;
using Json = nlohmann::json;

namespace {

const std::string token_of_anna = "anna-0123456789abcdef", token_of_bert = "bert-0123456789abcdef";
const std::string anna = "Authorization: Bearer " + token_of_anna, bert = "Authorization: Bearer " + token_of_bert;
const std::string number = "\nContent-Type: application/json\n\n5";

/// Keeps what the sink gets.
class Lines {
 public:
  void add(std::string_view line) {
    const std::lock_guard lock(mutex_);
    lines_.emplace_back(line);
    threads_.push_back(std::this_thread::get_id());
    changed_.notify_all();
  }
  /// The first lines, once there are so many.
  std::vector<Json> first(std::size_t count) {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, 60s, [&] { return lines_.size() >= count; })) throw std::runtime_error("no line in a minute");
    std::vector<Json> all;
    for (const std::string& line : lines_) {
      CHECK(line.find_first_of("\r\n") == std::string::npos);
      all.push_back(Json::parse(line));
    }
    return all;
  }
  std::vector<std::string> all() {
    const std::lock_guard lock(mutex_);
    return lines_;
  }
  std::vector<std::thread::id> threads() {
    const std::lock_guard lock(mutex_);
    return threads_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> lines_;
  std::vector<std::thread::id> threads_;
};

/// An endpoint that refuses every query.
class NoQueries final : public engine::QueryService {
 public:
  const Limits& limits() const noexcept override { return limits_; }
  Result<std::shared_ptr<const engine::PreparedQuery>> parse(std::string_view, std::string_view, std::vector<std::string>,
                                                             std::vector<std::string>) const override {
    return unexpected(Errc::expected_rdf, "expected another query");
  }
  std::shared_ptr<engine::QueryData> make_data() const override { return nullptr; }
  Result<std::shared_ptr<const engine::QueryAnswer>> evaluate(const engine::PreparedQuery&, engine::QueryData&, const std::atomic<bool>&, TimePoint,
                                                              std::optional<std::size_t>) const override {
    return unexpected(Errc::cancelled, "no query is evaluated");
  }

 private:
  Limits limits_;
};

/// A robot with an audit.
struct Audited {
  explicit Audited(const std::function<void(Options&)>& change = {}) {
    std::ofstream(folder / "tokens") << "anna reader " + token_of_anna + "\nbert operator " + token_of_bert + "\n";
    Options options;
    options.listen.port = 0;
    options.listen.transport = transport::no_network;
    options.security.token_file = folder / "tokens";
    options.security.audit.sink = [this](std::string_view line) { lines.add(line); };
    options.threads.dispatch = Dispatch::io_thread;
    options.clock = &clock;
    options.ids = std::make_shared<FixedIds>();
    options.callbacks.allow = {"127.0.0.1"};
    options.log = [this](LogLevel, std::string_view message) { log.add(message); };
    if (change) change(options);
    server.emplace(Server::create(std::move(options)).value());
    server->add(robot.arm()).value();
  }

  int status(const std::string& text, const std::string& fields = "") {
    const std::size_t body = text.find("\n\n");
    RequestText request(text.substr(0, body) + "\nHost: localhost:4711\n" + fields + (body == std::string::npos ? "" : text.substr(body)));
    request.get().local_port = 4711;
    request.get().can_stream = true;
    request.get().peer = "192.0.2.1";
    return server->serve(request.get()).response.status;
  }

  Folder folder;
  FakeClock clock;
  SampleRobot robot;
  Lines lines, log;
  std::optional<Server> server;
};

const std::string callback = "\nUpgrade: callback\nConnection: Upgrade\nCallback: http://127.0.0.1:9/secret-path";

}  // namespace

TEST_CASE("the audit says who did what to which resource with which outcome", "[server][security]") {
  Audited g;
  CHECK(g.status("GET /arm", anna) == 200);  // reads are not in it
  CHECK(g.status("PUT /arm/angle" + number, bert) == 204);
  CHECK(g.status("POST /arm/actions/turn?ticket=hidden" + number, bert) == 204);  // deferred: its last status counts
  CHECK(g.status("POST /arm/actions/fail", bert) == 500);
  CHECK(g.status("PUT /arm/angle" + number, anna) == 403);
  CHECK(g.status("GET /arm") == 401);
  CHECK(g.status("GET /arm\nOrigin: http://evil.example\nAccept: text/event-stream", bert) == 403);
  CHECK(g.status("PUT /nothing" + number, bert) == 404);
  RequestText other("GET /arm\nHost: evil.example");
  other.get().local_port = 4711;
  CHECK(g.server->serve(other.get()).response.status == 421);
  const std::vector<Json> lines = g.lines.first(8);
  REQUIRE(lines.size() == 8);
  const auto line = [](const char* principal, const char* method, const char* resource, int status, const char* reason = nullptr) {
    Json all = {{"time", "2026-11-21T10:38:39.000000Z"},
                {"event", "request"},
                {"principal", nullptr},
                {"address", "192.0.2.1"},
                {"method", method},
                {"resource", resource},
                {"status", status}};
    if (principal) all["principal"] = principal;
    if (reason) all["reason"] = reason;
    return all;
  };
  CHECK(lines[0] == line("bert", "PUT", "/arm/angle", 204));
  CHECK(lines[1] == line("bert", "POST", "/arm/actions/turn", 204));
  CHECK(lines[2] == line("bert", "POST", "/arm/actions/fail", 500));
  CHECK(lines[3] == line("anna", "PUT", "/arm/angle", 403, "right"));
  CHECK(lines[4] == line(nullptr, "GET", "/arm", 401, "credentials"));
  CHECK(lines[5] == line("bert", "GET", "/arm", 403, "origin"));
  CHECK(lines[6] == line("bert", "PUT", "/nothing", 404));
  CHECK(lines[7]["reason"] == "host");
}

TEST_CASE("a query by POST is a read in the audit", "[server][security]") {
  const bool reads = GENERATE(false, true);
  Audited g([&](Options& options) {
    options.security.audit.reads = reads;
    options.query = std::make_shared<NoQueries>();
  });
  const std::string type = "\nContent-Type: application/sparql-query\n\nASK {}";
  CHECK(g.status("POST /sparql" + type, anna) == 400);
  CHECK(g.status("POST /sparql" + type) == 401);
  CHECK(g.status("POST /sparql/subscriptions" + type, bert) == 405);
  CHECK(g.status("PUT /arm/angle" + number, bert) == 204);
  const std::vector<Json> lines = g.lines.first(reads ? 4 : 3);
  const std::size_t refused = reads ? 1 : 0;
  if (reads) CHECK(lines[0]["status"] == 400);
  CHECK(lines[refused]["status"] == 401);
  CHECK(lines[refused + 1]["resource"] == "/sparql/subscriptions");
  CHECK(lines[refused + 2]["resource"] == "/arm/angle");
}

TEST_CASE("the audit has reads if the option says so", "[server][security]") {
  Audited g([](Options& options) { options.security.audit.reads = true; });
  CHECK(g.status("GET /arm/angle?accept=text/turtle", anna) == 200);
  CHECK(g.status("HEAD /arm/speed", anna) == 200);
  const std::vector<Json> lines = g.lines.first(2);
  CHECK(lines[0]["resource"] == "/arm/angle");
  CHECK(lines[1]["method"] == "HEAD");
  CHECK(lines[1]["status"] == 200);
}

TEST_CASE("the audit has subscriptions when they are made and when they end", "[server][security]") {
  Audited g;
  CHECK(g.status("GET /arm/angle" + callback, anna) == 201);
  CHECK(g.status("DELETE /arm/subscriptions/i1", anna) == 204);
  {
    RequestText request("GET /arm/angle\nHost: localhost:4711\nAccept: text/event-stream\n" + anna);
    request.get().local_port = 4711;
    request.get().can_stream = true;
    CHECK(g.server->serve(request.get()).response.status == 200);
  }
  CHECK(g.status("GET /arm/angle" + callback, anna) == 201);
  g.server->remove("arm").value();
  const std::vector<Json> lines = g.lines.first(7);
  CHECK(lines[0]["event"] == "subscription_made");
  CHECK(lines[0]["principal"] == "anna");
  CHECK(lines[0]["subscription"] == "/arm/subscriptions/i1");
  CHECK(lines[0]["observed"] == "/arm/angle");
  CHECK(lines[0]["protocol"] == "callback");
  CHECK(lines[0]["status"] == 201);
  // Its end, and the request that ends it.
  CHECK(lines[1]["event"] == "subscription_ended");
  CHECK(lines[1]["subscription"] == "/arm/subscriptions/i1");
  CHECK(lines[1]["principal"] == "anna");
  CHECK(lines[2]["method"] == "DELETE");
  CHECK(lines[2]["principal"] == "anna");
  CHECK(lines[3]["event"] == "subscription_made");
  CHECK(lines[3]["protocol"] == "event_stream");
  CHECK(lines[3]["status"] == 200);
  CHECK(lines[4]["event"] == "subscription_ended");
  CHECK(lines[4]["subscription"] == "/arm/subscriptions/i2");
  CHECK(lines[5]["event"] == "subscription_made");
  CHECK(lines[6]["event"] == "subscription_ended");
  CHECK(lines[6]["subscription"] == "/arm/subscriptions/i3");
}

TEST_CASE("no token, cookie, query, callback URL or body is in the audit", "[server][security]") {
  Audited g([](Options& options) { options.security.audit.reads = true; });
  const std::string secrets = "Cookie: session=hush-cookie\nX-Api-Key: hush-key\n";
  CHECK(g.status("GET /arm/angle?ticket=hush-ticket\n" + secrets + bert) == 200);
  CHECK(g.status("GET /arm/angle\n" + secrets + "Authorization: Bearer hush-0123456789abcdef") == 401);
  CHECK(g.status("GET http://localhost:4711/arm/angle?hush-absolute\n" + bert) == 200);
  CHECK(g.status("PUT /arm/name\n" + bert + "\nContent-Type: text/plain\n\nhush-body") == 204);
  CHECK(g.status("PUT /arm/angle\n" + bert + "\nContent-Type: application/json\n\n\"hush-wrong\"") >= 400);
  CHECK(g.status("GET /arm/angle\n" + bert + "\nUpgrade: callback\nConnection: Upgrade\nCallback: http://127.0.0.1:9/hush-url") == 201);
  CHECK(g.status("GET /arm/angle\n" + bert + "\nUpgrade: callback\nConnection: Upgrade\nCallback: http://hush.example/hush-url") == 403);
  CHECK(g.lines.first(7).size() == 7);
  for (const std::string& line : g.lines.all()) {
    CHECK(line.find("hush") == std::string::npos);
    CHECK(line.find(token_of_bert) == std::string::npos);
  }
}

TEST_CASE("a line of the audit stays a line, whatever a client has sent", "[server][security]") {
  Audited g([](Options& options) {
    options.security.authenticate = [](const http::Request& request) -> std::optional<security::Principal> {
      if (!request.find("X-Name")) return std::nullopt;
      return security::Principal{"eve\n\",\"status\":200}\xE2\x80\xA8\x1b[31m\xF0\x9F\xA4\x96\xFF", {"operator"}};
    };
  });
  CHECK(g.status("PUT /a\"b\\c\x7F\x01\xE2\x80\xA8" + number, "X-Name: 1") >= 400);
  CHECK(g.status("PUT /" + std::string(5000, 'a') + number, "X-Name: 1") == 404);
  const std::vector<Json> lines = g.lines.first(2);
  for (const std::string& line : g.lines.all())
    for (const char c : line) CHECK((c >= 0x20 && c < 0x7F));
  CHECK(lines[0]["principal"] == "eve\n\",\"status\":200}\xE2\x80\xA8\x1b[31m\xF0\x9F\xA4\x96\xC3\xBF");
  CHECK(lines[1]["resource"].get<std::string>().size() == 1027);
}

TEST_CASE("lines that the sink does not take in time are dropped and counted in the next line", "[server][security]") {
  std::mutex gate;
  Audited* all = nullptr;
  std::atomic<int> calls{0};
  std::unique_lock closed(gate);
  Audited g([&](Options& options) {
    options.security.audit.max_waiting_lines = 3;
    options.security.audit.sink = [&](std::string_view line) {
      ++calls;
      const std::lock_guard pass(gate);
      all->lines.add(line);
    };
  });
  all = &g;
  CHECK(g.status("PUT /arm/angle" + number, bert) == 204);
  while (calls == 0) std::this_thread::yield();
  for (int i = 0; i < 10; ++i) CHECK(g.status("PUT /arm/angle" + number, bert) == 204);  // the sink hangs, the server does not
  closed.unlock();
  CHECK(g.lines.first(4)[0].count("dropped") == 0);
  CHECK(g.status("PUT /arm/angle" + number, bert) == 204);
  const std::vector<Json> lines = g.lines.first(5);
  std::uint64_t dropped = 0;
  for (const Json& line : lines) dropped += line.value("dropped", std::uint64_t{0});
  CHECK(dropped == 7);
}

TEST_CASE("the sink of the audit may throw, and has a thread of its own", "[server][security]") {
  std::atomic<int> calls{0};
  Audited* all = nullptr;
  Audited g([&](Options& options) {
    options.security.audit.sink = [&](std::string_view line) {
      if (++calls <= 2) throw std::runtime_error("the disk is full");
      all->lines.add(line);
    };
  });
  all = &g;
  for (int i = 0; i < 3; ++i) {
    CHECK(g.status("PUT /arm/angle" + number, bert) == 204);
    while (calls <= i) std::this_thread::yield();
  }
  const std::vector<Json> lines = g.lines.first(1);
  CHECK(lines[0]["dropped"] == 2);
  CHECK(g.lines.threads().at(0) != std::this_thread::get_id());
  g.server->stop();
  const std::vector<std::string> log = g.log.all();
  CHECK(std::count(log.begin(), log.end(), "the audit sink threw an exception, and lines are lost: the disk is full") == 1);
}

TEST_CASE("stop() writes all lines of the audit, and may be called by its sink", "[server][security]") {
  Audited g;
  for (int i = 0; i < 100; ++i) CHECK(g.status("PUT /arm/angle" + number, bert) == 204);
  g.server->stop();
  CHECK(g.lines.all().size() == 100);
  Audited* all = nullptr;
  Audited other([&](Options& options) {
    options.security.audit.sink = [&](std::string_view line) {
      all->server->stop();
      all->lines.add(line);
    };
  });
  all = &other;
  CHECK(other.status("PUT /arm/angle" + number, bert) == 204);
  CHECK(other.lines.first(1).size() == 1);
}

TEST_CASE("the audit has requests over each transport once, with their client's address", "[server][security]") {
  for (const std::string_view transport : transport::names()) {
    CAPTURE(transport);
    Audited g([&](Options& options) {
      options.listen.transport = [transport](transport::TransportOptions t) { return transport::make_named(std::string(transport), std::move(t)); };
    });
    const std::string host = "\nHost: 127.0.0.1:" + std::to_string(g.server->port()) + "\n";
    const std::string put = "PUT /arm/angle" + host + bert + "\nContent-Type: application/json";
    Socket socket(g.server->port());
    CHECK(socket.ask(put + "\n\n5").status == 204);
    socket.send_header(put, 1, true);
    CHECK(socket.await().status == 100);
    socket.write("5");
    CHECK(socket.await().status == 204);
    Socket refused(g.server->port());
    refused.send_header("PUT /arm/angle" + host + anna + "\nContent-Type: application/json", 1, true);
    CHECK(refused.await().status == 403);
    {
      Socket watcher(g.server->port());
      CHECK(watcher
                .ask("GET /arm/angle" + host + anna +
                     "\nConnection: Upgrade\nUpgrade: websocket\nSec-WebSocket-Version: 13\nSec-WebSocket-Key: "
                     "dGhlIHNhbXBsZSBub25jZQ==")
                .status == 101);
    }
    const std::vector<Json> lines = g.lines.first(5);
    for (const Json& line : lines) CHECK(line["address"] == "127.0.0.1");
    CHECK(lines[0]["status"] == 204);
    CHECK(lines[1]["status"] == 204);
    CHECK(lines[1]["principal"] == "bert");
    CHECK(lines[2]["status"] == 403);
    CHECK(lines[2]["principal"] == "anna");
    CHECK(lines[3]["event"] == "subscription_made");
    CHECK(lines[3]["protocol"] == "websocket");
    CHECK(lines[4]["event"] == "subscription_ended");
    CHECK(lines[4]["principal"] == "anna");
    g.server->stop();
    CHECK(g.lines.all().size() == 5);
  }
}

TEST_CASE("the queue of the audit has a size", "[server][security]") {
  Options options;
  options.listen.transport = transport::no_network;
  options.security.audit.max_waiting_lines = 0;
  const auto refused = Server::create(std::move(options));
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message == "security.audit.max_waiting_lines: expected 1 to 1000000, found 0");
}

TEST_CASE("the audit has what is hidden for want of a right, and not what does not exist", "[server][security]") {
  Audited g([](Options& options) {
    options.security.rules = {{"/arm", security::Scope::tree, {}, security::Rights::all()},
                              {"/arm/speed", security::Scope::tree, {security::Who::Kind::role, "reader"}, security::Right::read}};
  });
  CHECK(g.status("GET /arm/speed", bert) == 404);
  CHECK(g.status("GET /arm/nothing", bert) == 404);
  CHECK(g.status("PUT /arm/speed" + number, bert) == 404);
  CHECK(g.status("PUT /arm/nothing" + number, bert) == 404);
  g.server->stop();
  const std::vector<Json> lines = g.lines.first(3);
  REQUIRE(lines.size() == 3);
  CHECK(lines[0]["method"] == "GET");
  CHECK(lines[0]["resource"] == "/arm/speed");
  CHECK(lines[0]["reason"] == "right");
  CHECK(lines[1]["reason"] == "right");
  CHECK(lines[2].count("reason") == 0);
}

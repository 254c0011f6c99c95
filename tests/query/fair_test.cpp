// SPDX-License-Identifier: Apache-2.0
// Queries are fair: those of one client, however many and however long, do not delay those of another. The long ones here never end by themselves, so that
// an answer beside them does not depend on the speed of the machine.

#include <lrt/query.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/engine/query_service.hpp>
#include <lrt/security.hpp>
#include <lrt/server.hpp>

#include "src/base/turns.hpp"
#include "tests/query/requests.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/event_stream.hpp"
#include "tests/support/folder.hpp"
#include "tests/support/socket.hpp"
#include "tests/support/watchdog.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::seconds;

namespace {

const std::string endless = "SELECT (COUNT(*) AS ?n) { ?a ?b ?c . ?d ?e ?f . ?g ?h ?i . ?j ?k ?l . ?m ?o ?p }";
const std::string known = "ASK { </arm> ?p ?o }";

struct Robot {
  explicit Robot(query::EndpointOptions endpoint = {}) {
    Options options;
    options.listen.port = 0;
    options.limits.host_timeout = std::chrono::hours(1);
    options.threads.dispatch = Dispatch::io_thread;
    options.security.authenticate = [](const http::Request& request) -> std::optional<security::Principal> {
      const std::string_view field = request.find("Authorization").value_or("");
      if (field.empty()) return std::nullopt;
      security::Principal principal;
      principal.name = field.substr(0, field.find('/'));  // "anna/1", "anna/2": tickets of one principal
      principal.roles = {"reader"};
      return principal;
    };
    security::Rule everything;
    everything.path = "/";
    everything.rights = security::Rights::all();
    options.security.rules.push_back(std::move(everything));
    endpoint.time = std::chrono::hours(1);
    endpoint.max_steps = ~std::uint64_t{0};
    endpoint.max_age = std::chrono::milliseconds(0);
    options.query = query::endpoint(std::move(endpoint));
    server.emplace(Server::create(std::move(options)).value());
    Thing arm{"arm"};
    angle = arm.property<double>("angle", unit::radian);
    server->add(std::move(arm)).value();
    angle->publish(0.5);
  }

  std::string target(const std::string& query) const { return "/sparql?query=" + encoded(query); }
  std::string request(const std::string& query, const std::string& who) const {
    return "GET " + target(query) + "\nHost: 127.0.0.1:" + std::to_string(server->port()) + (who.empty() ? "" : "\nAuthorization: " + who) +
           "\nAccept: application/sparql-results+json";
  }
  std::unique_ptr<Socket> begin(const std::string& query, const std::string& who) const {
    auto socket = std::make_unique<Socket>(server->port());
    socket->send(request(query, who));
    return socket;
  }
  Answer ask(const std::string& query, const std::string& who) const { return Socket(server->port()).ask(request(query, who)); }
  std::unique_ptr<StreamClient> watch(const std::string& query, const std::string& who) const {
    return std::make_unique<StreamClient>(server->port(), target(query), who.empty() ? "" : "Authorization: " + who + "\r\n");
  }

  std::optional<Server> server;
  std::optional<PushedProperty<double>> angle;
};

/// Waits for the next event of a stream.
std::string next_of(StreamClient& stream) {
  for (const auto end = std::chrono::steady_clock::now() + seconds(60); std::chrono::steady_clock::now() < end;) {
    stream.step();
    for (const Event& event : stream.take()) return event.data;
    if (stream.ended) return "ended, status " + std::to_string(stream.status);
  }
  return "nothing within a minute";
}

template <class Sockets>
bool none_is_answered(Sockets& sockets) {
  for (auto& socket : sockets)
    if (socket->receive()) return false;
  return true;
}

}  // namespace

TEST_CASE("16 queries of one principal without an end do not delay those of others", "[query][fair]") {
  const Watchdog watchdog("fair queries", seconds(200));
  for (const unsigned threads : {1U, 2U}) {
    CAPTURE(threads);
    query::EndpointOptions endpoint;
    endpoint.threads = threads;
    const Robot robot(endpoint);
    std::vector<std::unique_ptr<Socket>> anna;
    for (int i = 0; i < 16; ++i) anna.push_back(robot.begin(endless, "anna/" + std::to_string(i)));  // as many tickets
    std::vector<double> ms;
    const auto timed = [&](const std::string& who) {
      const auto begin = std::chrono::steady_clock::now();
      CHECK(robot.ask(known, who).says("true"));
      ms.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
    };
    for (int i = 0; i < 5; ++i) {
      timed("bert");
      timed("");  // by its address
    }
    std::sort(ms.begin(), ms.end());
    std::printf("%u threads, 16 endless queries of one principal; an ASK of another: median %.1f ms, longest of %zu %.1f ms\n", threads,
                ms[ms.size() / 2], ms.size(), ms.back());
    CHECK(robot.ask(known, "anna/99").status == 429);
    CHECK(none_is_answered(anna));
    // Several at a time, of several clients, beside a long one of each.
    std::vector<std::unique_ptr<Socket>> others, brief;
    for (const char* who : {"carl", "dora", "emil"}) others.push_back(robot.begin(endless, who));
    for (const char* who : {"carl", "dora", "emil", "fred"}) brief.push_back(robot.begin("ASK { ?s ?p ?o }", who));
    CHECK(brief.back()->await().says("true"));
    CHECK(none_is_answered(others));
  }
}

TEST_CASE("clients whose queries take all places leave one for the first query of another", "[query][fair]") {
  const Watchdog watchdog("places for queries", seconds(120));
  query::EndpointOptions endpoint;
  endpoint.max_queries = 6;
  const Robot robot(endpoint);
  std::vector<std::unique_ptr<Socket>> busy;
  for (int i = 0; i < 3; ++i)
    for (const char* who : {"anna", "bert"}) busy.push_back(robot.begin(endless, who));
  for (int i = 0; i < 3; ++i) CHECK(robot.ask(known, "carl").says("true"));
  CHECK(none_is_answered(busy));
  CHECK(robot.ask(known, "anna").status == 503);
  // As many clients as there are places.
  for (const char* who : {"c", "d", "e", "f"}) busy.push_back(robot.begin(endless, who));
  const Answer refused = [&] {
    while (true)
      if (Answer answer = robot.ask(known, "g"); answer.status == 503) return answer;  // those four may not have arrived yet
  }();
  CHECK_FALSE(refused.field("Retry-After").empty());
}

TEST_CASE("standing queries without an end delay neither queries nor standing queries of others", "[query][fair]") {
  const Watchdog watchdog("fair standing queries", seconds(200));
  Robot robot;
  std::vector<std::unique_ptr<StreamClient>> anna;
  for (int i = 0; i < 8; ++i) anna.push_back(robot.watch(endless + " LIMIT " + std::to_string(i + 1), "anna"));
  CHECK(robot.ask(known, "bert").says("true"));
  const auto bert = robot.watch("SELECT ?v { GRAPH </arm/angle> { ?s <http://vocab.arvida.de/2015/06/vom/vocab#numericalValue> ?v } }", "bert");
  CHECK(next_of(*bert).find("0.5") != std::string::npos);
  for (const double value : {1.25, 2.25}) {
    robot.angle->publish(value);
    CHECK(next_of(*bert).find(std::to_string(value).substr(0, 4)) != std::string::npos);
  }
  for (auto& stream : anna) {
    stream->step();
    CHECK(stream->take().empty());
  }
}

TEST_CASE("a standing query that several share is evaluated in the time of one who is not busy", "[query][fair]") {
  const Watchdog watchdog("a shared standing query", seconds(200));
  Robot robot;
  const std::string shared = "SELECT ?v { GRAPH </arm/angle> { ?s <http://vocab.arvida.de/2015/06/vom/vocab#numericalValue> ?v } }";
  const auto first = robot.watch(shared, "anna");
  CHECK(next_of(*first).find("0.5") != std::string::npos);
  const auto second = robot.watch(shared, "bert");
  CHECK(next_of(*second).find("0.5") != std::string::npos);
  const auto busy = robot.watch(endless, "anna");
  CHECK(robot.ask(known, "bert").says("true"));
  robot.angle->publish(1.25);
  CHECK(next_of(*second).find("1.25") != std::string::npos);
  CHECK(next_of(*first).find("1.25") != std::string::npos);
}

TEST_CASE("queries that wait for their turn are cancelled, reach their time limit, and end with their server", "[query][fair][threads]") {
  const Watchdog watchdog("queries that wait for their turn", seconds(200));
  Robot robot;
  std::vector<std::unique_ptr<Socket>> sockets;
  for (int i = 0; i < 4; ++i)
    for (const char* who : {"anna", "bert", "carl"}) sockets.push_back(robot.begin(endless, who));
  CHECK(robot.ask(known, "dora").says("true"));
  sockets.erase(sockets.begin(), sockets.begin() + 6);  // their clients leave, in their turn or not
  for (int i = 0; i < 3; ++i) CHECK(robot.ask(known, "dora").says("true"));
  CHECK(none_is_answered(sockets));
  const auto stream = robot.watch(endless, "emil");
  robot.server->stop();
  robot.server.reset();
}

TEST_CASE("a query has its own time, not that of those that ran meanwhile, and its limit of memory beside them", "[query][fair]") {
  const Watchdog watchdog("limits of queries in turns", seconds(120));
  // Two services with one memory cannot be had here: the graphs and solutions of two clients have max_total_bytes together.
  query::EndpointOptions endpoint;
  endpoint.max_total_bytes = 8 * 1024 * 1024;
  endpoint.max_solution_bytes = 64 * 1024 * 1024;
  endpoint.max_rows = 10'000'000;
  const Robot robot(endpoint);
  const auto busy = robot.begin(endless, "anna");
  const Answer large = robot.ask("SELECT * { ?a ?b ?c . ?d ?e ?f . ?g ?h ?i } ORDER BY ?a ?e ?i", "bert");
  CHECK(large.status == 503);
  CHECK(large.says("max_total_bytes"));
  CHECK(robot.ask(known, "bert").says("true"));
  CHECK_FALSE(busy->receive());
}

namespace {

/// Makes each rest as long as an hour, and counts them.
class Counted final : public Turns {
 public:
  Counted() { set_current(this); }
  ~Counted() override { set_current(nullptr); }
  Duration rest() noexcept override { return ++rests, std::chrono::hours(1); }
  void leave() noexcept override {}
  void come_back() noexcept override {}
  std::size_t rests = 0;
};

}  // namespace

TEST_CASE("the time in which others have their turn does not count, and the answer is written in turns, too", "[query][fair]") {
  query::EndpointOptions options;
  options.time = std::chrono::minutes(10);
  const auto service = query::endpoint(options);
  rdf::Graph graph;
  for (int i = 0; i < 2'000; ++i) graph.add(rdf::iri("u:n" + std::to_string(i)), rdf::iri("u:value"), rdf::literal(std::to_string(i)));
  engine::NamedGraph named;
  named.name = "u:graph";
  named.graph = std::make_shared<const rdf::Graph>(std::move(graph));
  const std::shared_ptr<engine::QueryData> data = service->make_data();
  data->change({named});
  const auto query = service->parse("SELECT * { ?s ?p ?o }", "u:", {}, {});
  REQUIRE(query);
  const std::atomic<bool> never{false};
  Counted turns;
  const auto answer = service->evaluate(**query, *data, never, {}, std::nullopt);
  REQUIRE(answer);
  CHECK(turns.rests > 10);
  const std::size_t before = turns.rests;
  for (std::size_t type = 0; type < 4; ++type) CHECK((*answer)->write(type));
  CHECK(turns.rests >= before + 4 * 30);
}

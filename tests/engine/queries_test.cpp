// SPDX-License-Identifier: Apache-2.0
#include <lrt/engine/engine.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <lrt/engine/query_service.hpp>
#include <lrt/rdf/codec.hpp>
#include <lrt/rdf/vocab.hpp>
#include <lrt/security.hpp>
#include <lrt/world.hpp>

#include "src/engine/parts.hpp"
#include "src/engine/resources/world.hpp"
#include "src/engine/snapshots.hpp"
#include "src/security/policy.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/event_stream.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;

namespace {

/// A query language for tests. "objects <P>": all objects of a predicate, sorted. "graphs": the names of all graphs. "error", "large", "slow".
class SmallQueries final : public engine::QueryService {
 public:
  using Graphs = std::map<std::string, std::shared_ptr<const rdf::Graph>>;

  class Prepared final : public engine::PreparedQuery {
   public:
    explicit Prepared(std::string t) : text(std::move(t)) {
      if (text.rfind("objects ", 0) == 0) needs.predicates = {text.substr(8)};
      else needs.everything = text == "graphs";
      needs.time = text == "now";
    }
    const std::vector<std::string_view>& types() const override {
      static const std::vector<std::string_view> all{"application/sparql-results+json", "text/csv"};
      return all;
    }
    const engine::QueryDependencies& dependencies() const override { return needs; }
    bool has_rows() const noexcept override { return text != "yes"; }
    const std::string text;
    engine::QueryDependencies needs;
  };
  class Answered final : public engine::QueryAnswer {
   public:
    explicit Answered(std::multiset<std::string> r) : rows(std::move(r)) {}
    Result<std::string> write(std::size_t type) const override { return ++written, text(type); }
    std::string text(std::size_t type) const {
      std::string all = type == 0 ? "json:" : "csv:";
      for (const std::string& row : rows) all += row + ";";
      return all;
    }
    std::uint64_t digest() const noexcept override { return std::hash<std::string>()(text(0)); }
    Result<std::string> changes_since(const QueryAnswer& before, std::uint64_t sequence) const override {
      ++written;
      const auto& then = static_cast<const Answered&>(before).rows;
      std::string all = std::to_string(sequence) + ":";
      for (const std::string& row : rows) all += then.count(row) ? "" : "+" + row;
      for (const std::string& row : then) all += rows.count(row) ? "" : "-" + row;
      return all;
    }
    const std::multiset<std::string> rows;
    inline static std::size_t written = 0;  ///< documents that were written
  };
  class Data final : public engine::QueryData {
   public:
    Data(std::size_t& changes, Graphs& last, std::shared_ptr<void> counted) : changes_(changes), last_(last), counted_(std::move(counted)) {}
    void change(std::vector<engine::NamedGraph> graphs) override {
      changes_ += graphs.size();
      for (auto& one : graphs) {
        if (one.graph) all[one.name] = one.graph;
        else all.erase(one.name);
      }
      last_ = all;
    }
    Graphs all;

   private:
    std::size_t& changes_;
    Graphs& last_;
    const std::shared_ptr<void> counted_;
  };

  const Limits& limits() const noexcept override { return given; }
  Result<std::shared_ptr<const engine::PreparedQuery>> parse(std::string_view text, std::string_view, std::vector<std::string> default_graphs,
                                                             std::vector<std::string> named_graphs) const override {
    if (text == "error") return Unexpected{Error{Errc::expected_rdf, "line 1, column 4: expected a query", 3, 1, 4}};
    if (text == "update") return unexpected(Errc::unsupported_syntax, "DELETE is an update");
    datasets = std::move(default_graphs);
    datasets.insert(datasets.end(), named_graphs.begin(), named_graphs.end());
    return std::shared_ptr<const engine::PreparedQuery>(std::make_shared<Prepared>(std::string(text)));
  }
  std::shared_ptr<engine::QueryData> make_data() const override { return std::make_shared<Data>(changes, graphs, datasets_counter); }
  Result<std::shared_ptr<const engine::QueryAnswer>> evaluate(const engine::PreparedQuery& query, engine::QueryData& data,
                                                              const std::atomic<bool>& cancelled, TimePoint now,
                                                              std::optional<std::size_t> max_rows) const override {
    ++evaluations;
    const std::string& text = static_cast<const Prepared&>(query).text;
    if (cancelled) return unexpected(Errc::cancelled, "cancelled");
    if (text == "large") return unexpected(Errc::limit_exceeded, "more than 10 rows");
    std::multiset<std::string> rows;
    if (text == "now") rows.insert(std::to_string(now.utc.time_since_epoch().count()));
    for (const auto& [name, graph] : static_cast<Data&>(data).all) {
      if (text == "graphs") rows.insert(name.substr(name.find('/', 8)));
      for (const rdf::Triple& t : graph->triples())
        if (text.rfind("objects ", 0) == 0 && graph->term(t.predicate).text == text.substr(8)) rows.insert(std::string(graph->term(t.object).text));
    }
    if (max_rows && rows.size() > *max_rows) return unexpected(Errc::limit_exceeded, "more rows than a standing query may have");
    return std::shared_ptr<const engine::QueryAnswer>(std::make_shared<Answered>(std::move(rows)));
  }

  Limits given;
  mutable std::vector<std::string> datasets;
  mutable Graphs graphs;                                            ///< that were seen last
  std::shared_ptr<int> datasets_counter = std::make_shared<int>();  ///< each Data refers to it
  std::size_t kept_datasets() const { return static_cast<std::size_t>(datasets_counter.use_count()) - 1; }
  mutable std::size_t changes = 0, evaluations = 0;
};

const std::string objects_of_value = "objects%20http%3A%2F%2Fvocab.arvida.de%2F2015%2F06%2Fvom%2Fvocab%23numericalValue";

struct Robot {
  explicit Robot(engine::EngineOptions options = {}, SmallQueries::Limits limits = {})
      : service(std::make_shared<SmallQueries>()), bench(with(std::move(options), limits)) {
    bench.add(robot.arm());
  }
  std::string ask(const std::string& query, const std::string& fields = {}) { return bench.ask("GET /sparql?query=" + query + "\n" + fields).body; }
  std::vector<std::string> events(engine::Channel channel) {
    EventParser parser;
    for (const std::string& message : bench.messages(channel)) parser.read(message);
    std::vector<std::string> all;
    for (const Event& event : parser.take()) all.push_back(event.data);
    return all;
  }
  void publish(double v, milliseconds later = milliseconds(100)) {
    robot.angle_handle->publish(v);
    bench.clock.advance(later);
  }
  engine::EngineOptions with(engine::EngineOptions options, SmallQueries::Limits limits) {
    service->given = std::move(limits);
    options.query = service;
    return options;
  }
  std::shared_ptr<SmallQueries> service;
  SampleRobot robot;
  Bench bench;
};

}  // namespace

TEST_CASE("a query is asked of the present values of all resources", "[engine][query]") {
  Robot asked;
  CHECK(asked.ask(objects_of_value).find("10;") != std::string::npos);
  asked.robot.angle_handle->publish(25);
  asked.robot.speed = 7.25F;
  asked.bench.clock.advance(milliseconds(200));  // older than max_age: the speed is read again
  const std::string later = asked.ask(objects_of_value);
  CHECK(later.find("25;") != std::string::npos);
  CHECK(later.find("7.25;") != std::string::npos);
  CHECK(later.find("10;") == std::string::npos);
}

TEST_CASE("each resource is a graph by its URI, and a removed one is none", "[engine][query]") {
  Robot asked;
  asked.bench.add(asked.robot.tool());
  const std::string all = asked.ask("graphs");
  for (const char* path :
       {"/arm;", "/arm/angle;", "/arm/speed;", "/arm/actions/turn;", "/arm/waypoints;", "/arm/tool;", "/arm/tool/weight;", "/ns/vocabulary;"}) {
    CAPTURE(path, all);
    CHECK(all.find(path) != std::string::npos);
  }
  CHECK(all.find("/arm/broken;") == std::string::npos);  // it cannot be read
  CHECK(all.find("/arm/state;") == std::string::npos);   // its triples are in the graphs of the properties
  asked.bench.engine.remove("arm/tool").value();
  CHECK(asked.ask("graphs").find("/arm/tool") == std::string::npos);
}

TEST_CASE("subscriptions are graphs for queries that may need them, and their counters are read for those that name one", "[engine][query]") {
  Robot asked;
  const auto with_subscriptions = [&] {
    return std::count_if(asked.service->graphs.begin(), asked.service->graphs.end(),
                         [](const auto& one) { return one.first.find("/subscriptions") != std::string::npos; });
  };
  const std::string titles = "objects%20http%3A%2F%2Fpurl.org%2Fdc%2Fterms%2Ftitle", drops = "objects%20https%3A%2F%2Fw3id.org%2Flrt%2Fns%23dropped",
                    owners = "objects%20https%3A%2F%2Fw3id.org%2Flrt%2Fns%23delivery";
  const auto slow = asked.bench.open("/arm/angle?queueLength=1");
  (void)asked.ask(titles);
  CHECK(with_subscriptions() == 0);
  (void)asked.ask(owners);
  CHECK(with_subscriptions() == 3);  // with the containers of the arm and of the endpoint
  const auto changes_by = [&](const std::string& query) {
    const std::size_t before = asked.service->changes;
    (void)asked.ask(query);
    return asked.service->changes - before;
  };
  (void)changes_by(drops);
  for (int i = 0; i < 3; ++i) asked.publish(20 + i, milliseconds(10));
  (void)asked.bench.engine.next_ready(asked.bench.clock.now());
  (void)changes_by(titles);
  CHECK(changes_by(owners) == 0);
  CHECK(changes_by(drops) == 1);
  CHECK(changes_by(drops) == 0);
  asked.bench.engine.closed(slow);
  CHECK(changes_by(titles) == 2);  // it is gone, and the container has changed
  CHECK(with_subscriptions() == 2);
}

TEST_CASE("a first query that takes long to prepare is prepared in several turns", "[engine][query]") {
  Robot asked;
  asked.bench.add(asked.robot.tool());
  asked.bench.clock.run_slowly(milliseconds(1));
  const Bench::Sent sent = asked.bench.send("GET /sparql?query=graphs\n");
  std::size_t turns = 0;
  for (; turns < 100 && !asked.bench.answer(sent); ++turns) asked.bench.run();
  CHECK(turns > 1);
  REQUIRE(asked.bench.answer(sent));
  CHECK(asked.bench.answer(sent)->body.find("/arm/tool;") != std::string::npos);
}

TEST_CASE("only what has changed is described again", "[engine][query]") {
  Robot asked;
  (void)asked.ask("graphs");
  const std::size_t before = asked.service->changes;
  (void)asked.ask("graphs");
  CHECK(asked.service->changes == before);
  asked.robot.angle_handle->publish(11);
  (void)asked.ask("graphs");
  CHECK(asked.service->changes == before + 1);
}

TEST_CASE("the graphs are those of GET", "[engine][query]") {
  Robot asked;
  (void)asked.ask("graphs");
  for (const char* path : {"/arm", "/arm/angle", "/arm/actions/turn", "/arm/waypoints", "/ns/vocabulary"}) {
    CAPTURE(path);
    const Answer got = asked.bench.ask("GET " + std::string(path) + "\nAccept: application/n-triples\n");
    const auto queried = asked.service->graphs.find("http://localhost" + std::string(path));
    REQUIRE(queried != asked.service->graphs.end());
    CHECK(rdf::isomorphic(rdf::read(got.body, rdf::Syntax::n_triples, {}).value(), *queried->second));
  }
}

TEST_CASE("what the protocol says of requests", "[engine][query]") {
  Robot asked;
  const auto status = [&](const std::string& request) { return asked.bench.ask(request).status; };
  const std::string form = "Content-Type: application/x-www-form-urlencoded\n\n";
  CHECK(status("POST /sparql\n" + form + "query=graphs") == 200);
  CHECK(status("POST /sparql\nContent-Type: application/x-www-form-urlencoded; charset=UTF-8\n\nquery=graphs") == 200);
  CHECK(status("POST /sparql\nContent-Type: application/sparql-query\n\ngraphs") == 200);
  CHECK(status("POST /sparql?query=graphs\nContent-Type: application/sparql-query\n\ngraphs") == 400);
  CHECK(status("POST /sparql\n" + form + "query=graphs&query=graphs") == 400);
  CHECK(status("POST /sparql\n" + form + "quer=graphs") == 400);
  CHECK(status("POST /sparql\n" + form + "query=%zz") == 400);
  CHECK(status("POST /sparql\n" + form + "query=%ff") == 400);
  CHECK(status("POST /sparql\nContent-Type: application/sparql-query\n\n\xff") == 400);
  CHECK(status("POST /sparql\nContent-Type: application/sparql-query; charset=latin1\n\ngraphs") == 415);
  CHECK(status("POST /sparql\nContent-Type: text/turtle\n\ngraphs") == 415);
  CHECK(status("POST /sparql\n\ngraphs") == 415);
  CHECK(status("POST /sparql\n" + form + "update=x") == 403);
  CHECK(status("POST /sparql\nContent-Type: application/sparql-update\n\nx") == 403);
  CHECK(status("GET /sparql?update=x") == 403);
  CHECK(status("PUT /sparql\nContent-Type: application/sparql-query\n\ngraphs") == 405);
  CHECK(status("GET /sparql?query=graphs&default-graph-uri=relative") == 400);
  CHECK(status("GET /sparql?query=graphs&changes=perhaps") == 400);
  CHECK(status("GET /sparql?query=" + std::string(17 * 1024, 'x')) == 413);

  const Answer wrong = asked.bench.ask("GET /sparql?query=error");
  CHECK(wrong.status == 400);
  CHECK(wrong.body.find("line 1, column 4: expected a query") != std::string::npos);
  CHECK(asked.bench.ask("GET /sparql?query=update").status == 403);
  CHECK(asked.bench.ask("GET /sparql?query=large").status == 503);
  CHECK(asked.bench.ask("GET /sparql?query=large").body.find("more than 10 rows") != std::string::npos);
  CHECK(asked.bench.ask("GET /sparql?query=graphs\nAccept: image/png\n").status == 406);

  (void)asked.ask("graphs&default-graph-uri=http://e/a+b&named-graph-uri=http%3A%2F%2Fe%2Fc");
  CHECK(asked.service->datasets.empty());  // "http://e/a b" is no IRI, so that it was refused
  (void)asked.ask("graphs&default-graph-uri=http://e/a&named-graph-uri=http%3A%2F%2Fe%2Fc");
  CHECK(asked.service->datasets == std::vector<std::string>{"http://e/a", "http://e/c"});
}

TEST_CASE("a page that may read may send a query by POST, and nothing else", "[engine][query][security]") {
  engine::EngineOptions options;
  options.read_origins = {"https://reader.example"};
  options.allowed_origins = {"https://dashboard.example"};
  Robot asked(options);
  const std::string reader = "\nOrigin: https://reader.example", stranger = "\nOrigin: http://evil.example";
  const auto post = [&](const std::string& path, const std::string& fields) {
    return asked.bench.ask("POST " + path + fields + "\nContent-Type: application/sparql-query\n\ngraphs");
  };
  const Answer read = post("/sparql", reader);
  CHECK(read.status == 200);
  CHECK(read.field("Access-Control-Allow-Origin") == "https://reader.example");
  CHECK(asked.bench.ask("POST /sparql" + reader + "\nContent-Type: application/x-www-form-urlencoded\n\nquery=graphs").status == 200);
  CHECK(post("/sparql?default-graph-uri=http://e/a", reader).status == 200);
  CHECK(post("/sparql", "\nOrigin: https://dashboard.example").status == 200);
  CHECK(post("/sparql", "").status == 200);
  CHECK(post("/sparql", stranger).status == 403);
  CHECK(post("/sparql", reader + stranger).status == 403);
  CHECK(asked.bench.ask("POST /sparql" + reader + "\nContent-Type: application/sparql-update\n\nx").status == 403);
  CHECK(asked.bench.ask("POST /sparql" + reader + "\nContent-Type: application/x-www-form-urlencoded\n\nupdate=x").status == 403);
  for (const char* path : {"/sparql/subscriptions", "/arm/actions/home", "/arm", "/nowhere"}) CHECK(post(path, reader).status == 403);
  for (const char* method : {"PUT", "DELETE", "PATCH"}) CHECK(asked.bench.ask(method + (" /sparql" + reader)).status == 403);

  const auto methods = [&](const std::string& path, const std::string& origin) {
    return asked.bench.ask("OPTIONS " + path + origin + "\nAccess-Control-Request-Method: POST\nAccess-Control-Request-Headers: content-type")
        .members("Access-Control-Allow-Methods");
  };
  CHECK(methods("/sparql", reader) == std::set<std::string>{"GET", "HEAD", "OPTIONS", "POST"});
  CHECK(methods("/arm/actions/home", reader) == std::set<std::string>{"GET", "HEAD", "OPTIONS"});
  CHECK(methods("/sparql", stranger).empty());
}

TEST_CASE("the answer to a query has the fields of a representation", "[engine][query]") {
  Robot asked;
  const Answer answer = asked.bench.ask("GET /sparql?query=graphs\nAccept: text/csv\n");
  CHECK(answer.body.rfind("csv:", 0) == 0);
  CHECK(answer.field("Content-Type") == "text/csv; charset=utf-8");
  CHECK(answer.field("Vary") == "Accept");
  CHECK(answer.field("Cache-Control") == "no-cache");
  CHECK(asked.bench.ask("GET /sparql?query=graphs\nAccept: text/csv\nIf-None-Match: " + answer.tag() + "\n").status == 304);
  CHECK(asked.bench.ask("GET /sparql?query=graphs\nIf-None-Match: " + answer.tag() + "\n").status == 200);
  const Answer without = asked.bench.ask("GET /sparql\nAccept: text/turtle\n");
  CHECK(without.status == 200);
  CHECK(without.body.find("sd:Service") != std::string::npos);
  CHECK(without.body.find("SPARQL11Query") != std::string::npos);
  CHECK(asked.bench.ask("OPTIONS /sparql").field("Allow") == "GET, HEAD, OPTIONS, POST");
  CHECK(asked.bench.ask("OPTIONS /sparql").field("Accept-Post") == "application/sparql-query, application/x-www-form-urlencoded");
}

TEST_CASE("queries are as many as the endpoint takes, and one whose client has gone ends", "[engine][query]") {
  SmallQueries::Limits limits;
  limits.max_queries = 2;
  Robot asked({}, limits);
  (void)asked.ask("graphs");
  const auto first = asked.bench.send("GET /sparql?query=graphs"), second = asked.bench.send("GET /sparql?query=graphs");
  REQUIRE(first.ticket);
  const auto third = asked.bench.send("GET /sparql?query=graphs");
  CHECK(third.answer.status == 503);
  CHECK(!third.answer.field("Retry-After").empty());
  asked.bench.engine.abandon(*first.ticket);
  asked.bench.run();
  CHECK(!asked.bench.answer(first));
  CHECK(asked.bench.answer(second)->status == 200);
  CHECK(asked.bench.ask("GET /sparql?query=graphs").status == 200);
  // The end of its sending does not tell whether a client has gone.
  const auto half = asked.bench.send("GET /sparql?query=graphs");
  asked.bench.engine.input_ended(*half.ticket);
  asked.bench.run();
  REQUIRE(asked.bench.answer(half));
  CHECK(asked.bench.answer(half)->status == 503);
}

TEST_CASE("one client cannot use up the queries of all", "[engine][query]") {
  SmallQueries::Limits limits;
  limits.max_queries_per_client = 2;
  limits.max_standing_per_client = 1;
  engine::EngineOptions options;
  options.authorize = [](const http::Request& request) {
    engine::Caller caller;
    caller.client = std::string(request.find("Client").value_or(""));
    return caller;
  };
  Robot asked(std::move(options), limits);
  const auto send = [&](const std::string& client) { return asked.bench.send("GET /sparql?query=graphs\nClient: " + client + "\n"); };
  const auto first = send("anna"), second = send("anna"), third = send("anna"), other = send("bert");
  CHECK(third.answer.status == 429);
  CHECK(!third.answer.field("Retry-After").empty());
  CHECK(other.ticket);
  CHECK(send("").ticket);  // this machine
  asked.bench.run();
  for (const auto& sent : {first, second, other}) CHECK(asked.bench.answer(sent)->status == 200);
  CHECK(send("anna").ticket);  // those before have ended

  const auto a = asked.bench.open_stream("/sparql?query=graphs", "Client: anna\n");
  CHECK(asked.bench.stream("/sparql?query=" + objects_of_value, "Client: anna\n").answer.status == 429);
  (void)asked.bench.open_stream("/sparql?query=graphs", "Client: anna\n");  // shares the first one
  (void)asked.bench.open_stream("/sparql?query=" + objects_of_value, "Client: bert\n");
  (void)a;
}

TEST_CASE("standing queries are evaluated one after the other, and leave the places of queries free", "[engine][query]") {
  SmallQueries::Limits limits;
  limits.max_queries = 1;
  Robot asked({}, limits);
  (void)asked.ask("graphs");
  std::vector<Bench::Sent> streams;
  for (int i = 0; i < 5; ++i) streams.push_back(asked.bench.stream("/sparql?query=now&default-graph-uri=http://e/" + std::to_string(i)));
  asked.bench.collect();
  auto jobs = asked.bench.take_query_jobs();
  CHECK(jobs.size() == 1);  // as many as there are threads
  const auto query = asked.bench.send("GET /sparql?query=graphs");
  REQUIRE(query.ticket);
  asked.bench.run();
  REQUIRE(asked.bench.answer(query));
  CHECK(asked.bench.answer(query)->status == 200);
  for (auto& job : jobs) job.run();
  asked.bench.run();
  for (const auto& stream : streams) CHECK(asked.bench.answer(stream)->status == 200);
  // All have their turn, also when they are due together.
  const std::size_t before = asked.service->evaluations;
  asked.bench.clock.advance(milliseconds(1100));
  asked.bench.run();
  CHECK(asked.service->evaluations == before + streams.size());
}

TEST_CASE("a standing query whose subscribers leave before its first result ends", "[engine][query]") {
  Robot asked;
  (void)asked.ask("graphs");
  for (const bool only_sending_ends : {false, true}) {
    CAPTURE(only_sending_ends);
    const std::size_t before = asked.service->evaluations;
    const auto a = asked.bench.stream("/sparql?query=graphs"), b = asked.bench.stream("/sparql?query=graphs");
    const std::string path = only_sending_ends ? "/sparql/standing-2" : "/sparql/standing-1";
    const auto leave = [&](const Bench::Sent& sent) {
      if (only_sending_ends) asked.bench.engine.input_ended(*sent.ticket);
      else asked.bench.engine.abandon(*sent.ticket);
      CHECK(asked.bench.engine.next_deadline() <= asked.bench.clock.now().steady);
      asked.bench.collect();
    };
    leave(a);
    CHECK(asked.bench.send("GET " + path).answer.status != 404);
    leave(b);
    CHECK(asked.bench.send("GET " + path).answer.status == 404);
    asked.bench.run();
    CHECK(asked.service->evaluations == before);
    if (only_sending_ends) CHECK(asked.bench.answer(b)->status == 503);
  }
}

TEST_CASE("results of standing queries are written by their jobs", "[engine][query]") {
  for (const char* changes : {"", "changes=true&"}) {
    CAPTURE(changes);
    Robot asked;
    const auto channel = asked.bench.open_stream("/sparql?" + std::string(changes) + "query=" + objects_of_value);
    std::vector<engine::Channel> others;
    if (std::string(changes).empty()) {
      others.push_back(
          asked.bench.open("/sparql?query=" + objects_of_value, "Accept: text/csv\n"));  // in another media type, while there is a result
      CHECK(asked.bench.messages(others[0]).size() == 1);
    }
    (void)asked.events(channel);
    asked.publish(17);
    (void)asked.bench.engine.next_ready(asked.bench.clock.now());  // the scan
    asked.bench.collect();
    auto jobs = asked.bench.take_query_jobs();
    REQUIRE(jobs.size() == 1);
    for (auto& job : jobs) job.run();
    const std::size_t written = SmallQueries::Answered::written;
    std::size_t messages = 0;
    for (int i = 0; i < 3; ++i, asked.bench.look())
      for (const auto& [c, push] : asked.bench.pushes()) messages += push.message ? 1 : 0;
    CHECK(messages == 1 + others.size());
    CHECK(SmallQueries::Answered::written == written);
  }
}

TEST_CASE("the graphs follow what comes and goes without a change of the structure", "[engine][query]") {
  Robot asked;
  const auto graphs = [&] { return asked.ask("graphs"); };
  const auto has = [&](const std::string& path) { return graphs().find(path + ";") != std::string::npos; };
  (void)graphs();
  const std::string invocation = asked.bench.ask("POST /arm/actions/grip\nPrefer: respond-async\n").field("Location").substr(16);
  CHECK(has(invocation));
  const auto text_of = [&] { return rdf::write(*asked.service->graphs.at("http://localhost" + invocation), rdf::Syntax::n_triples).value(); };
  CHECK(text_of().find("0.25") == std::string::npos);
  asked.robot.grips[0].progress(0.25);
  (void)graphs();
  CHECK(text_of().find("0.25") != std::string::npos);
  (void)std::move(asked.robot.grips[0]).succeed();
  (void)graphs();
  CHECK(text_of().find("endedAtTime") != std::string::npos);
  CHECK(asked.bench.ask("DELETE " + invocation).status == 204);
  CHECK_FALSE(has(invocation));

  const Answer made = asked.bench.ask("POST /arm/waypoints\nContent-Type: application/json\n\n{\"x\":1,\"y\":2,\"frame\":\"base\"}");
  REQUIRE(made.status == 201);
  const std::string member = made.field("Location").substr(16);
  CHECK(has(member));
  CHECK(asked.bench.ask("DELETE " + member).status == 204);
  CHECK_FALSE(has(member));

  // At the same path there is another resource.
  for (const double weight : {1.25, 2.5}) {
    Thing box("box");
    box.property<double>("weight").publish(weight);
    asked.bench.add(std::move(box));
    CHECK(asked.ask(objects_of_value).find(std::to_string(weight).substr(0, 3)) != std::string::npos);
    asked.bench.engine.remove("box").value();
  }
  CHECK_FALSE(has("/box/weight"));
}

TEST_CASE("a query reads the properties that it needs and may see", "[engine][query][security]") {
  int open = 0, hidden = 0;
  engine::EngineOptions options;
  options.authorize = [policy =
                           security::Policy::create({{"/", security::Scope::tree, {}, security::Right::read},
                                                     {"/hidden", security::Scope::tree, {security::Who::Kind::role, "chief"}, security::Right::read}})
                               .value()](const http::Request&) {
    engine::Caller caller;
    caller.view = policy->view(nullptr);
    return caller;
  };
  Robot asked(std::move(options));
  Thing first("open"), second("hidden");
  first.property("weight", [&] { return ++open; });
  second.property("weight", [&] { return ++hidden; });
  asked.bench.add(std::move(first));
  asked.bench.add(std::move(second));
  const auto reads = [&](const std::string& query) {
    const int before = open;
    asked.bench.clock.advance(milliseconds(200));
    (void)asked.ask(query);
    return open - before;
  };
  (void)reads("graphs");
  CHECK(reads(objects_of_value) == 1);
  CHECK(reads("objects%20http%3A%2F%2Fpurl.org%2Fdc%2Fterms%2Ftitle") == 0);
  CHECK(reads("nothing") == 0);
  CHECK(reads("graphs") == 1);
  CHECK(hidden == 0);
}

TEST_CASE("a standing query whose first result is awaited opens nothing for who has lost the right to it", "[engine][query][security]") {
  using security::Right;
  auto view = std::make_shared<const security::View>(Right::read | Right::subscribe);
  std::set<std::string> known = {"anna", "bert"};
  const auto caller = [&](const std::string& name) {
    engine::Caller made;
    made.principal = std::make_shared<const security::Principal>(security::Principal{name, {}});
    made.view = view;
    return made;
  };
  engine::EngineOptions options;
  options.authorize = [&](const http::Request& request) { return caller(std::string(request.find("Who").value_or("bert"))); };
  options.renew = [&](const security::Principal* owner) {
    return owner && known.count(owner->name) ? std::optional(caller(owner->name)) : std::nullopt;
  };
  Robot asked(std::move(options));
  const std::string path = "/sparql?query=" + objects_of_value;
  const auto first = asked.bench.stream(path, "Who: anna\n"), second = asked.bench.upgrade(path, "Who: anna\n"),
             other = asked.bench.stream(path, "Who: bert\n");
  REQUIRE((first.ticket && second.ticket && other.ticket));
  int status = 401;
  SECTION("it was signed out") { asked.bench.engine.sign_out("anna"); }
  SECTION("it is no longer known") {
    known.erase("anna");
    asked.bench.engine.renew_rights();
    status = 403;
  }
  asked.bench.run();
  for (const auto& sent : {first, second}) CHECK(asked.bench.answer(sent).value().status == status);
  CHECK(asked.bench.answer(other).value().status == 200);
  CHECK(asked.bench.engine.counts().event_streams == 1);
  CHECK(asked.bench.engine.counts().websockets == 0);
}

TEST_CASE("a standing query remains when a policy with the same rights is loaded", "[engine][query][security]") {
  using security::Right;
  std::vector<security::Rule> rules = {{"/", security::Scope::tree, {}, Right::read | Right::subscribe}};
  std::shared_ptr<security::Policy> policy = security::Policy::create(rules).value();
  const auto caller = [&] {
    engine::Caller made;
    made.view = policy->view(nullptr);
    return made;
  };
  engine::EngineOptions options;
  options.authorize = [&](const http::Request&) { return caller(); };
  options.renew = [&](const security::Principal*) { return std::optional(caller()); };
  Robot asked(std::move(options));
  const auto load = [&] {
    policy = security::Policy::create(rules).value();
    asked.bench.engine.renew_rights();
    std::size_t closed = 0;
    for (const auto& [channel, push] : asked.bench.pushes()) closed += push.close != 0 ? 1 : 0;
    return closed;
  };
  const auto channel = asked.bench.open_stream("/sparql?query=" + objects_of_value);
  CHECK(asked.events(channel).size() == 1);
  CHECK(load() == 0);
  rules.push_back({"/other", security::Scope::tree, {security::Who::Kind::role, "chief"}, Right::read});
  rules.push_back({"/other", security::Scope::tree, {}, Right::read | Right::subscribe});
  CHECK(load() == 0);
  asked.publish(33);
  CHECK(asked.events(channel).size() == 1);
  const std::size_t evaluations = asked.service->evaluations;
  (void)asked.bench.open_stream("/sparql?query=" + objects_of_value);
  CHECK(asked.service->evaluations == evaluations);  // they share it
  CHECK(asked.service->kept_datasets() == 1);
  rules.push_back({"/arm", security::Scope::tree, {security::Who::Kind::role, "chief"}, Right::read});
  CHECK(load() == 2);  // what the query was evaluated on is no longer theirs
}

TEST_CASE("a reader's standing query counts its changes, and its name counts no others", "[engine][query][security]") {
  engine::EngineOptions options;
  const auto view = std::make_shared<const security::View>(security::Right::read | security::Right::subscribe);
  options.authorize = [view](const http::Request& request) {
    engine::Caller caller;
    caller.principal = std::make_shared<const security::Principal>(security::Principal{std::string(request.find("Who").value_or("")), {}});
    caller.view = view;
    return caller;
  };
  Robot asked(std::move(options));
  std::map<engine::Channel, std::vector<std::uint64_t>> numbers;
  const auto take = [&] {
    asked.bench.clock.advance(std::chrono::seconds(1));
    for (const auto& [channel, push] : asked.bench.pushes()) {
      if (!push.message) continue;
      const std::size_t at = push.message->find("sequence: ");
      numbers[channel].push_back(at == std::string::npos ? 0 : std::stoull(push.message->substr(at + 10)));
    }
  };
  const auto anna = asked.bench.open_stream("/sparql?query=graphs", "Who: anna\n"),
             bert = asked.bench.open_stream("/sparql?query=graphs", "Who: bert\n");
  take();
  for (const char* path : {"one", "two"}) {
    asked.bench.add(Thing{path});
    take();
  }
  for (const auto channel : {anna, bert}) {
    const std::vector<std::uint64_t>& all = numbers[channel];
    REQUIRE(all.size() >= 3);
    CHECK(all.front() > 0);
    for (std::size_t i = 1; i < all.size(); ++i) CHECK(all[i] > all[i - 1]);
  }
  for (const char* who : {"anna", "bert"})
    for (const char* name : {"1", "2"}) CHECK(asked.bench.ask(std::string("GET /sparql/standing-") + name + "\nWho: " + who).status == 404);
}

TEST_CASE("a query waits for no published value that its sender may not see", "[engine][query][security]") {
  FakeClock clock;
  engine::EngineOptions options;
  options.clock = &clock;
  options.ids = std::make_shared<FixedIds>();
  engine::Parts parts(std::move(options));
  World world("world");
  WorldGraph map = world.graph("map");
  parts.add(std::move(world)).value();
  auto cup = map.published<double>("cup", Iri("https://example.org/pose"));
  cup.publish(0.5);
  static_cast<engine::WorldGraphResource&>(*parts.registry.find("/world/map")).take_changes(parts);
  REQUIRE(parts.registry.find("/world/map/cup"));
  const SmallQueries service;
  engine::Snapshots snapshots(service, clock, parts.registry, parts.representations, parts.subscribers,
                              [] { return std::vector<engine::Resource*>(); });
  const auto properties_of = [&](const engine::Audience& audience) {
    std::size_t count = 0;
    const auto counted = [&](engine::PropertyResource&) { ++count; };
    const auto ignored = [](engine::HostContent&) {};
    snapshots.for_each_read(*snapshots.of(0, audience, {}), counted, ignored);
    return count;
  };
  const auto policy =
      security::Policy::create({{"/", security::Scope::tree, {}, security::Right::read},
                                {"/world/map/cup", security::Scope::tree, {security::Who::Kind::role, "chief"}, security::Right::read}})
          .value();
  CHECK(properties_of({}) == 1);
  CHECK(properties_of({policy->view(nullptr), nullptr}) == 0);
}

TEST_CASE("what queries have stored is removed a minute after the last", "[engine][query]") {
  Robot asked;
  (void)asked.ask("graphs");
  CHECK(asked.service->kept_datasets() == 1);
  asked.bench.clock.advance(std::chrono::seconds(59));
  asked.bench.run();
  CHECK(asked.service->kept_datasets() == 1);
  CHECK(asked.bench.engine.next_deadline() <= asked.bench.clock.now().steady + std::chrono::seconds(1));
  asked.bench.clock.advance(std::chrono::seconds(1));
  asked.bench.run();
  CHECK(asked.service->kept_datasets() == 0);
  asked.robot.angle_handle->publish(44);
  CHECK(asked.ask(objects_of_value).find("44;") != std::string::npos);
  // A standing query uses it.
  const auto channel = asked.bench.open_stream("/sparql?query=" + objects_of_value);
  asked.bench.clock.advance(std::chrono::seconds(120));
  (void)asked.events(channel);
  CHECK(asked.service->kept_datasets() == 1);
}

TEST_CASE("a standing query tells its answer, and again when it has changed", "[engine][query]") {
  Robot asked;
  const engine::Channel channel =
      asked.bench.open_stream("/sparql?query=objects%20http%3A%2F%2Fvocab.arvida.de%2F2015%2F06%2Fvom%2Fvocab%23numericalValue");
  const auto first = asked.events(channel);
  REQUIRE(first.size() == 1);
  CHECK(first[0].find("10;") != std::string::npos);
  CHECK(asked.events(channel).empty());
  asked.publish(12);
  const auto second = asked.events(channel);
  REQUIRE(second.size() == 1);
  CHECK(second[0].find("12;") != std::string::npos);
  asked.publish(12.0);
  CHECK(asked.events(channel).empty());
}

TEST_CASE("a standing query is evaluated only when something changes that it depends on", "[engine][query]") {
  Robot asked;
  const engine::Channel channel = asked.bench.open_stream("/sparql?query=objects%20http%3A%2F%2Fpurl.org%2Fdc%2Fterms%2Ftitle");
  CHECK(asked.events(channel).size() == 1);
  const std::size_t before = asked.service->evaluations;
  asked.publish(13);
  CHECK(asked.events(channel).empty());
  CHECK(asked.service->evaluations == before);
  asked.bench.add(asked.robot.tool());  // with a title
  asked.bench.clock.advance(milliseconds(100));
  const auto later = asked.events(channel);
  REQUIRE(later.size() == 1);
  CHECK(later[0].find("The tool") != std::string::npos);
}

TEST_CASE("a standing query is not evaluated for other triples of a large graph", "[engine][query][world]") {
  Robot asked;
  World world("world");
  WorldGraph map = world.graph("map", {});
  map.update([](GraphUpdate& u) {
       for (int i = 0; i < 5'000; ++i) u.add("#o" + std::to_string(i), vocab::rdfs::label, i);
     })
      .value();
  asked.bench.add(std::move(world));
  const engine::Channel channel = asked.bench.open_stream("/sparql?query=objects%20http%3A%2F%2Fe%2Fcolour");
  CHECK(asked.events(channel) == std::vector<std::string>{"json:"});
  /// @return  how often the query was evaluated, and its results
  const auto after = [&](const std::function<void(GraphUpdate&)>& change) {
    const std::size_t before = asked.service->evaluations;
    map.update(change).value();
    asked.bench.run();
    asked.bench.clock.advance(milliseconds(200));
    const auto results = asked.events(channel);
    return std::pair(asked.service->evaluations - before, results);
  };
  const Iri colour("http://e/colour"), weight("http://e/weight");
  using Results = std::vector<std::string>;
  CHECK(after([&](GraphUpdate& u) { u.add("#o1", weight, 3); }) == std::pair(std::size_t{0}, Results{}));
  CHECK(after([&](GraphUpdate& u) { u.add("#o1", colour, "red"); }) == std::pair(std::size_t{1}, Results{"json:red;"}));
  CHECK(after([&](GraphUpdate& u) { u.remove_node("#o2"); }) == std::pair(std::size_t{0}, Results{}));
  CHECK(after([&](GraphUpdate& u) { u.set("#o1", weight, 4).set("#o1", colour, "blue"); }) == std::pair(std::size_t{1}, Results{"json:blue;"}));
  CHECK(after([&](GraphUpdate& u) { u.remove_node("#o1"); }) == std::pair(std::size_t{1}, Results{"json:"}));
  map.update([&](GraphUpdate& u) { u.add("#o3", colour, "green"); }).value();  // two changes in one turn
  CHECK(after([&](GraphUpdate& u) { u.add("#o3", weight, 5); }) == std::pair(std::size_t{1}, Results{"json:green;"}));
  const auto sees = [&] { return asked.ask("objects%20http%3A%2F%2Fe%2Fweight"); };
  CHECK(sees() == "json:5;");  // other queries see what it was not evaluated for
}

TEST_CASE("a standing query notices triples with predicates that a resource did not have", "[engine][query]") {
  Robot asked;
  const std::string prov = "http%3A%2F%2Fwww.w3.org%2Fns%2Fprov%23", error = "https%3A%2F%2Fw3id.org%2Flrt%2Fns%23error";
  Thing lidar("lidar");
  auto cloud = lidar.property<std::vector<double>>("cloud");
  cloud.publish(std::vector<double>(2000, 1.0));  // more than max_value_members
  asked.bench.add(std::move(lidar));
  /// How many results each channel gets.
  const auto step = [&] {
    asked.bench.clock.advance(milliseconds(600));  // the sample period, too
    std::map<engine::Channel, std::size_t> results;
    for (const auto& [channel, push] : asked.bench.pushes()) results[channel] += push.message ? 1 : 0;
    return results;
  };
  // An optional field.
  const auto tolerance = asked.bench.open_stream("/sparql?query=objects%20http%3A%2F%2Flocalhost%2Fns%2Fvocabulary%23Pose%2Ftolerance");
  CHECK(asked.events(tolerance).front() == "json:");
  asked.robot.pose.tolerance = 0.25;
  CHECK(step()[tolerance] == 1);
  // An invocation that begins and ends, with or without an error.
  const auto ended = asked.bench.open_stream("/sparql?query=objects%20" + prov + "endedAtTime"),
             failed = asked.bench.open_stream("/sparql?query=objects%20" + error);
  auto results = step();
  CHECK(results[ended] == 1);
  CHECK(results[failed] == 1);
  for (const char* end : {"succeeds", "fails"}) {
    CAPTURE(end);
    CHECK(asked.bench.ask("POST /arm/actions/grip\nPrefer: respond-async\n").status == 202);
    CHECK(step()[ended] == 0);
    if (std::string(end) == "fails") (void)std::move(asked.robot.grips.back()).fail({Errc::refused, "it slipped"});
    else (void)std::move(asked.robot.grips.back()).succeed();
    results = step();
    CHECK(results[ended] == 1);
    CHECK(results[failed] == (std::string(end) == "fails" ? 1 : 0));
  }
  // A list that was too long, or empty.
  const auto rest = asked.bench.open_stream("/sparql?query=objects%20http%3A%2F%2Fwww.w3.org%2F1999%2F02%2F22-rdf-syntax-ns%23rest");
  (void)asked.events(rest);
  cloud.publish({1, 2, 3});
  CHECK(step()[rest] == 1);
  cloud.publish({});
  CHECK(step()[rest] == 1);
  cloud.publish({4, 5});
  CHECK(step()[rest] == 1);
}

TEST_CASE("a standing query notices a property that cannot be read any more, or can be read again", "[engine][query]") {
  Robot asked;
  bool works = false;
  double weight = 77;
  Thing scale("scale");
  scale.property("weight", [&] {
    if (!works) throw std::runtime_error("no sensor");
    return weight;
  });
  asked.bench.add(std::move(scale));
  const auto channel = asked.bench.open_stream("/sparql?query=" + objects_of_value);
  std::map<engine::Channel, std::size_t> messages;
  const auto next = [&] {
    asked.bench.clock.advance(milliseconds(600));  // more than the sample period
    std::string last;
    for (const auto& [to, push] : asked.bench.pushes()) {
      messages[to] += push.message ? 1 : 0;
      if (to == channel && push.message) last = *push.message;
    }
    return last;
  };
  CHECK(next().find("77;") == std::string::npos);
  works = true;
  CHECK(next().find("77;") != std::string::npos);
  const auto watcher = asked.bench.open_stream("/scale/weight");
  (void)next();
  CHECK(messages[watcher] == 1);
  works = false;
  const std::string without = next();
  CHECK(without.find("data: json:") != std::string::npos);
  CHECK(without.find("77;") == std::string::npos);
  works = true;
  CHECK(next().find("77;") != std::string::npos);  // the same value
  CHECK(messages[watcher] == 1);                   // who observes the value has it already
}

TEST_CASE("a standing query is evaluated at most at its interval", "[engine][query]") {
  Robot asked;
  const engine::Channel channel = asked.bench.open_stream("/sparql?minimumInterval=2&query=" + objects_of_value);
  CHECK(asked.events(channel).size() == 1);
  const std::size_t before = asked.service->evaluations;
  for (int i = 0; i < 10; ++i) {
    asked.publish(20 + i);
    (void)asked.events(channel);
  }
  CHECK(asked.service->evaluations == before);
  asked.bench.clock.advance(milliseconds(1000));
  const auto later = asked.events(channel);
  REQUIRE(later.size() == 1);
  CHECK(later[0].find("29;") != std::string::npos);
  CHECK(asked.service->evaluations == before + 1);
}

TEST_CASE("subscribers of one query share it, and it goes with the last of them", "[engine][query]") {
  Robot asked;
  const auto a = asked.bench.open_stream("/sparql?query=" + objects_of_value), b = asked.bench.open("/sparql?query=" + objects_of_value);
  CHECK(asked.bench.get("/sparql/standing-1").status == 200);
  CHECK(asked.bench.get("/sparql/standing-2").status == 404);
  CHECK(asked.bench.get("/sparql/subscriptions").body.find("/sparql/subscriptions/i") != std::string::npos);
  asked.bench.engine.closed(a);
  asked.bench.run();
  CHECK(asked.bench.get("/sparql/standing-1").status == 200);
  asked.bench.engine.closed(b);
  asked.bench.run();
  CHECK(asked.bench.get("/sparql/standing-1").status == 404);
  const std::size_t before = asked.service->evaluations;
  asked.publish(14);
  asked.bench.run();
  CHECK(asked.service->evaluations == before);
}

TEST_CASE("a standing query tells which rows are new and which are gone", "[engine][query]") {
  Robot asked;
  const auto channel = asked.bench.open_stream("/sparql?changes=true&query=" + objects_of_value);
  const auto first = asked.events(channel);
  REQUIRE(first.size() == 1);
  CHECK(first[0].rfind("json:", 0) == 0);
  const auto changes_after = [&](double value) {
    asked.publish(value);
    CHECK(asked.events(channel).empty());  // the evaluation
    asked.bench.look();                    // queues are filled by the next scan
    return asked.events(channel);
  };
  CHECK(changes_after(15) == std::vector<std::string>{"2:+15-10"});
  CHECK(changes_after(16) == std::vector<std::string>{"3:+16-15"});
  const auto other = asked.bench.open_stream("/sparql?changes=true&query=" + objects_of_value);
  CHECK(asked.events(other)[0].rfind("json:", 0) == 0);
  CHECK(asked.bench.ask("GET /sparql?changes=true&query=yes\nUpgrade: callback\nConnection: Upgrade\nCallback: http://127.0.0.1:1/\n").status == 400);
}

TEST_CASE("a standing query that reaches a limit ends its subscriptions with the reason", "[engine][query]") {
  SmallQueries::Limits limits;
  limits.max_standing_rows = 15;
  limits.max_standing = 1;
  Robot asked({}, limits);
  CHECK(asked.bench.answer(asked.bench.stream("/sparql?query=large")) == std::nullopt);
  asked.bench.run();
  const auto channel = asked.bench.open_stream("/sparql?query=objects%20http%3A%2F%2Fpurl.org%2Fdc%2Fterms%2Ftitle");
  CHECK(asked.events(channel).size() == 1);
  const auto refused = asked.bench.stream("/sparql?query=graphs");
  CHECK(refused.answer.status == 503);
  for (int i = 0; i < 20; ++i) {
    Thing thing("other" + std::to_string(i));
    thing.title("Thing " + std::to_string(i));
    asked.bench.add(std::move(thing));
  }
  asked.bench.clock.advance(milliseconds(100));
  std::uint16_t code = 0;
  for (const auto& [c, push] : asked.bench.pushes())
    if (c == channel && push.close != 0) code = push.close;
  CHECK(code == 1011);
  CHECK(asked.bench.get("/sparql/standing-2").status == 404);
}

TEST_CASE("a standing query that asks for the time is evaluated each second", "[engine][query]") {
  Robot asked;
  const auto channel = asked.bench.open_stream("/sparql?query=now");
  CHECK(asked.events(channel).size() == 1);
  asked.bench.clock.advance(milliseconds(500));
  CHECK(asked.events(channel).empty());
  asked.bench.clock.advance(milliseconds(600));
  CHECK(asked.events(channel).size() == 1);
}

TEST_CASE("the list of Things links to the endpoint", "[engine][query][R0.9]") {
  Robot asked;
  const Answer root = asked.bench.get("/");
  CHECK(root.links_to("http://localhost/sparql", "https://w3id.org/lrt/ns#query"));
  CHECK(root.body.find("lrt:query <http://localhost/sparql>") != std::string::npos);
  Thing taken("sparql");
  CHECK(asked.bench.engine.add(std::move(taken)).error().code == Errc::duplicate_path);
}

TEST_CASE("without a query service there is no endpoint", "[engine][query]") {
  Bench bench;
  CHECK(bench.get("/sparql?query=graphs").status == 404);
  engine::EngineOptions options;
  const auto service = std::make_shared<SmallQueries>();
  service->given.path = "sparql";
  options.query = service;
  Bench wrong(std::move(options));
  CHECK(wrong.engine.check().error().code == Errc::invalid_option);
}

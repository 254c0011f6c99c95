// SPDX-License-Identifier: Apache-2.0
// SPARQL end to end: a server, the HTTP transport, clients' sockets.

#include <lrt/query.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <iterator>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/server.hpp>
#include <lrt/server_thing.hpp>
#include <lrt/world.hpp>

#include "tests/delivery/receiver.hpp"
#include "tests/query/requests.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/event_stream.hpp"
#include "tests/support/message.hpp"
#include "tests/support/rights_matrix.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/socket.hpp"
#include "tests/support/watchdog.hpp"
#include "tests/support/websocket.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::seconds;

namespace {

const std::string prefixes =
    "PREFIX vom: <http://vocab.arvida.de/2015/06/vom/vocab#> PREFIX rdfs: <http://www.w3.org/2000/01/rdf-schema#> "
    "PREFIX dcterms: <http://purl.org/dc/terms/> PREFIX : <http://example.org/> ";
constexpr Iri height{"http://example.org/height"};
/// Answered never: there are some hundred triples.
const std::string endless = "SELECT (COUNT(*) AS ?n) { ?a ?b ?c . ?d ?e ?f . ?g ?h ?i . ?j ?k ?l . ?m ?o ?p }";

/// Limits that no query of a test reaches, so that only what the test does ends one.
query::EndpointOptions unlimited() {
  query::EndpointOptions options;
  options.time = std::chrono::hours(1);
  options.max_steps = ~std::uint64_t{0};
  return options;
}

/// An arm, a World, and a SPARQL endpoint at a port.
struct Robot {
  explicit Robot(
      query::EndpointOptions endpoint = {}, const std::function<void(Options&)>& change = [](Options&) {}) {
    Options options;
    options.listen.port = 0;
    options.threads.dispatch = Dispatch::io_thread;
    endpoint.max_age = std::chrono::milliseconds(0);
    options.query = query::endpoint(std::move(endpoint));
    change(options);
    server.emplace(Server::create(std::move(options)).value());
    Thing arm{"arm"};
    arm.title("An arm");
    angle = arm.property<double>("angle", unit::radian);
    arm.property("pulled", [this] { return static_cast<std::int64_t>(++reads); });
    World world("world");
    GraphOptions of_map;
    of_map.turtle =
        "@prefix : <http://example.org/> . @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> . <#cup> rdfs:label \"the "
        "cup\" ; :near <#plate> .";
    map = world.graph("map", std::move(of_map));
    tasks = world.graph("tasks");
    cup = map.published<double>("cup", height, unit::metre);
    server->add(std::move(arm)).value();
    server->add(std::move(world)).value();
    angle->publish(0.5);
    base = "http://127.0.0.1:" + std::to_string(server->port());
  }

  /// `text` as for RequestText.
  Answer ask(const std::string& text, const std::string& who = {}) { return Socket(server->port()).ask(complete(text, who)); }
  std::string complete(const std::string& text, const std::string& who = {}) const {
    const std::size_t line = std::min(text.find('\n'), text.size());
    const std::string token = who.empty() ? "" : "\nAuthorization: Bearer " + who + "-0123456789abcdef";
    return text.substr(0, line) + "\nHost: 127.0.0.1:" + std::to_string(server->port()) + token + text.substr(line);
  }
  std::string target(const std::string& query, const std::string& more = {}) const { return "/sparql?query=" + encoded(prefixes + query) + more; }
  Answer query(const std::string& query, const std::string& accept = "text/csv", const std::string& who = {}, const std::string& more = {}) {
    return ask("GET " + target(query, more) + "\nAccept: " + accept, who);
  }

  std::atomic<int> reads{0};
  std::optional<Server> server;
  std::optional<PushedProperty<double>> angle;
  WorldGraph map, tasks;
  PublishedObject<double> cup;
  std::string base;
};

/// An endpoint without a server.
struct Service {
  explicit Service(query::EndpointOptions options = unlimited()) : service(query::endpoint(std::move(options))), data(service->make_data()) {}
  Result<std::shared_ptr<const engine::QueryAnswer>> ask(const std::string& query, std::optional<std::size_t> max_rows = std::nullopt) {
    const auto parsed = service->parse(query, "http://example.org/", {}, {});
    if (!parsed) return unexpected(parsed.error());
    return service->evaluate(**parsed, *data, cancelled, TimePoint{}, max_rows);
  }
  std::string csv(const std::string& query) {
    constexpr std::size_t csv = 2;  // of the types of SELECT
    const auto answer = ask(query);
    return answer ? (*answer)->write(csv).value() : answer.error().message;
  }

  std::shared_ptr<const engine::QueryService> service;
  std::shared_ptr<engine::QueryData> data;
  std::atomic<bool> cancelled{false};
};

template <class F>
void until(const char* what, F condition) {
  for (const auto end = std::chrono::steady_clock::now() + seconds(30); !condition();) {
    if (std::chrono::steady_clock::now() > end) FAIL("not within 30 s: " << what);
    std::this_thread::yield();
  }
}

/// A subscriber by event stream.
std::vector<Event> events(StreamClient& client, std::size_t count) {
  std::vector<Event> all;
  until("the events", [&] {
    client.step();
    for (Event& e : client.take()) all.push_back(std::move(e));
    return all.size() >= count || client.ended;
  });
  REQUIRE(all.size() == count);
  return all;
}

/// One by WebSocket.
class Watcher {
 public:
  Watcher(const Robot& robot, const std::string& target) : socket_(robot.server->port()) {
    socket_.send("GET " + target + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(robot.server->port()) +
                 "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: " + WebSocketClient::key +
                 "\r\n\r\n");
  }
  std::string next() {
    until("a message", [&] {
      socket_.step();
      return !socket_.frames.empty() || socket_.ended;
    });
    REQUIRE(!socket_.frames.empty());
    std::string text = std::move(socket_.frames.front().payload);
    socket_.frames.pop_front();
    return text;
  }
  WebSocketClient& socket() noexcept { return socket_; }

 private:
  WebSocketClient socket_;
};

}  // namespace

TEST_CASE("each form of a query is answered in each of its formats", "[query][endpoint]") {
  Robot robot;
  const std::string select = "SELECT ?label ?none { </world/map#cup> rdfs:label ?label OPTIONAL { ?label :no ?none } }";
  const auto type = [](const Answer& a) { return a.field("Content-Type"); };
  const Answer json = robot.query(select, "application/sparql-results+json"), xml = robot.query(select, "application/sparql-results+xml"),
               csv = robot.query(select, "text/csv"), tsv = robot.query(select, "text/tab-separated-values");
  CHECK(type(json) == "application/sparql-results+json");
  CHECK(json.says(R"("value":"the cup")"));
  CHECK(type(xml) == "application/sparql-results+xml");
  CHECK(xml.says("<literal>the cup</literal>"));
  CHECK(type(csv) == "text/csv; charset=utf-8");
  CHECK(csv.body == "label,none\r\nthe cup,\r\n");
  CHECK(type(tsv) == "text/tab-separated-values");
  CHECK(tsv.body == "?label\t?none\n\"the cup\"\t\n");

  CHECK(robot.query("ASK { ?s rdfs:label \"the cup\" }", "application/sparql-results+json").says("\"boolean\":true"));
  CHECK(robot.query("ASK { ?s rdfs:label \"the fork\" }", "application/sparql-results+xml").says("<boolean>false</boolean>"));
  CHECK(robot.query("ASK {}", "text/csv").status == 406);

  const std::string same = "CONSTRUCT { ?s :is ?l . ?s :has [ rdfs:label ?l ] } WHERE { GRAPH </world/map> { ?s rdfs:label ?l } }";
  rdf::Graph expected =
      turtle("@prefix e: <http://example.org/> . </world/map#cup> e:is \"the cup\" ; e:has [ rdfs:label \"the cup\" ] .", robot.base + "/");
  for (const rdf::Syntax syntax : rdf::available_syntaxes()) {
    CAPTURE(rdf::media_type(syntax));
    const Answer built = robot.query(same, std::string(rdf::media_type(syntax)));
    REQUIRE(built.status == 200);
    CHECK(type(built) == rdf::media_type(syntax));
    CHECK(rdf::isomorphic(built.graph(), expected));
    const Answer described = robot.query("DESCRIBE </world/map#cup>", std::string(rdf::media_type(syntax)));
    REQUIRE(described.status == 200);
    CHECK(rdf::isomorphic(described.graph(), *robot.map.snapshot()) == false);  // its IRIs have the base of the request
    CHECK(missing(described, "</world/map#cup> rdfs:label \"the cup\" ; <http://example.org/near> </world/map#plate> .", robot.base + "/") == "");
    CHECK(described.graph().size() == robot.map.snapshot()->size());
  }
}

TEST_CASE("a query may begin with a byte order mark, wherever it is", "[query][endpoint]") {
  Robot robot;
  const std::string mark = "\xEF\xBB\xBF", ask = "ASK {}", json = "\nAccept: application/sparql-results+json";
  for (const std::string& request : {"POST /sparql\nContent-Type: application/sparql-query" + json + "\n\n" + mark + ask,
                                     "POST /sparql\nContent-Type: application/x-www-form-urlencoded" + json + "\n\nquery=" + encoded(mark + ask),
                                     "POST /sparql\nContent-Type: application/x-www-form-urlencoded" + json + "\n\n" + mark + "query=" + encoded(ask),
                                     "GET /sparql?query=" + encoded(mark + ask) + json}) {
    CAPTURE(request);
    const Answer answer = robot.ask(request);
    CHECK(answer.status == 200);
    CHECK(answer.says("\"boolean\":true"));
  }
}

TEST_CASE("a query is answered of the values of the moment", "[query][endpoint]") {
  Robot robot;
  const std::string of_angle = "SELECT ?v { GRAPH </arm/angle> { ?x vom:numericalValue ?v } }";
  CHECK(rows(robot.query(of_angle)) == Rows{"0.5"});
  robot.angle->publish(0.75);
  CHECK(rows(robot.query(of_angle)) == Rows{"0.75"});

  const std::string of_pulled = "SELECT ?v { GRAPH </arm/pulled> { ?x vom:numericalValue ?v } }";
  const int before = robot.reads;
  CHECK(rows(robot.query(of_pulled)) == Rows{std::to_string(before + 1)});
  CHECK(rows(robot.query(of_pulled)) == Rows{std::to_string(before + 2)});

  const std::string of_cup =
      "SELECT ?v { </world/map#cup> :height </world/map/cup> . GRAPH </world/map> { </world/map/cup> vom:numericalValue ?v } }";
  CHECK(rows(robot.query(of_cup)).empty());  // it has no value yet
  robot.cup.publish(1.25);
  CHECK(rows(robot.query(of_cup)) == Rows{"1.25"});
  robot.cup.publish(1.5);
  CHECK(rows(robot.query(of_cup)) == Rows{"1.5"});

  REQUIRE(robot.tasks.update([](GraphUpdate& u) { u.add("#fetch", vocab::rdfs::label, "fetch the cup"); }));
  CHECK(rows(robot.query("SELECT ?t { GRAPH </world/tasks> { ?s rdfs:label ?t } }")) == Rows{"fetch the cup"});
  Thing tool{"arm/tool"};
  tool.title("A tool");
  REQUIRE(robot.server->add(std::move(tool)));
  CHECK(rows(robot.query("SELECT ?t { </arm/tool> dcterms:title ?t }")) == Rows{"A tool"});
  REQUIRE(robot.server->remove("arm/tool"));
  CHECK(rows(robot.query("SELECT ?t { </arm/tool> dcterms:title ?t }")).empty());
}

TEST_CASE("graphs are stored within the time of the query that needs them, and before each the limit of triples is checked", "[query][endpoint]") {
  query::EndpointOptions options = unlimited();
  options.max_triples = 10;
  Service service(options);
  const std::string count = "SELECT (COUNT(*) AS ?n) { ?s ?p ?o }";
  const auto graph = [](const std::string& subject, int triples) {
    auto made = std::make_shared<rdf::Graph>();
    for (int i = 0; i < triples; ++i) made->add(rdf::iri("u:" + subject), rdf::iri("u:p"), rdf::literal(std::to_string(i)));
    return std::shared_ptr<const rdf::Graph>(std::move(made));
  };
  // Who keeps a graph has not stored it yet.
  const auto is_kept = [](const std::shared_ptr<const rdf::Graph>& one) { return one.use_count() > 1; };
  const auto a = graph("a", 3), b = graph("b", 7), large = graph("large", 11), larger = graph("larger", 12), c = graph("c", 6), small = graph("b", 1);

  service.data->change({{"u:a", a}});
  service.cancelled = true;
  CHECK(service.ask(count).error().code == Errc::cancelled);
  CHECK(is_kept(a));
  service.cancelled = false;
  CHECK(service.csv(count) == "n\r\n3\r\n");
  CHECK_FALSE(is_kept(a));

  service.data->change({{"u:large", large}, {"u:larger", larger}});
  for (int i = 0; i < 2; ++i) {
    const auto refused = service.ask(count);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == Errc::limit_exceeded);
    CHECK(refused.error().message == "this robot has 14 triples and more; the maximum for queries is 10");
    CHECK_FALSE(is_kept(large));
    CHECK(is_kept(larger));
  }
  service.data->change({{"u:larger", nullptr}, {"u:large", nullptr}});
  CHECK(service.csv(count) == "n\r\n3\r\n");
  CHECK_FALSE(is_kept(larger));

  // What counts is the result of all changes, whatever their order.
  service.data->change({{"u:b", b}});
  CHECK(service.csv(count) == "n\r\n10\r\n");
  service.data->change({{"u:c", c}, {"u:d", larger}, {"u:b", small}, {"u:d", nullptr}});
  CHECK(service.csv(count) == "n\r\n10\r\n");
}

TEST_CASE("the result of a standing query is limited by its bytes, too, because the engine writes it", "[query][endpoint]") {
  Service service;
  const std::string ten = "SELECT ?t { VALUES ?i { 0 1 2 3 4 5 6 7 8 9 } BIND('" + std::string(10'000, 'a') + "' AS ?t) }";
  CHECK(service.ask(ten));
  CHECK(service.ask(ten, 100));
  const auto refused = service.ask(ten, 20);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::limit_exceeded);
  CHECK(refused.error().message.find("81,920 bytes of its answer") != std::string::npos);
}

TEST_CASE("the digest of an answer tells terms apart, but neither blank nodes nor an order that nobody asked for", "[query][endpoint]") {
  Service service;
  const auto digest = [&](const std::string& query) {
    const std::uint64_t of_standing = (*service.ask(query, 100))->digest();
    CHECK((*service.ask(query))->digest() == of_standing);
    return of_standing;
  };
  std::set<std::uint64_t> all;
  const char* const terms[] = {"<u:a>", "'u:a'", "'u:a'@en", "'u:a'@de", "'u:a'^^<u:type>", "'u:b'", "'u:b' 'u:b'", "UNDEF", "'en'"};
  for (const char* const term : terms) all.insert(digest("SELECT ?x { VALUES ?x { " + std::string(term) + " } }"));
  CHECK(all.size() == std::size(terms));
  CHECK(digest("SELECT ?x ?y { VALUES (?x ?y) { (1 2) (3 4) } }") == digest("SELECT ?x ?y { VALUES (?x ?y) { (3 4) (1 2) } }"));
  CHECK(digest("SELECT ?x ?y { VALUES (?x ?y) { (1 2) (3 4) } }") != digest("SELECT ?x ?y { VALUES (?x ?y) { (1 4) (3 2) } }"));
  CHECK(digest("SELECT ?x { VALUES ?x { 1 2 } } ORDER BY ?x") != digest("SELECT ?x { VALUES ?x { 1 2 } } ORDER BY DESC(?x)"));
  CHECK(digest("SELECT ?x { BIND(BNODE() AS ?x) }") == digest("SELECT ?x { BIND(BNODE('a') AS ?x) }"));
  CHECK(digest("CONSTRUCT { <u:a> <u:p> 1, 2 } {}") == digest("CONSTRUCT { <u:a> <u:p> 2, 1 } {}"));
  CHECK(digest("CONSTRUCT { <u:a> <u:p> 1 } {}") != digest("CONSTRUCT { <u:a> <u:p> 2 } {}"));
  CHECK(digest("ASK {}") != digest("ASK { <u:a> <u:a> <u:a> }"));
}

TEST_CASE("each resource is a named graph, and a request can say which count", "[query][endpoint]") {
  Robot robot;
  const Rows names = rows(robot.query("SELECT ?g { GRAPH ?g {} }"));
  for (const char* path : {"/arm", "/arm/angle", "/arm/pulled", "/world", "/world/map", "/world/tasks"}) {
    CAPTURE(path);
    CHECK(names.count(robot.base + path) == 1);
  }
  const std::string map = "&default-graph-uri=" + encoded(robot.base + "/world/map"), arm = "&default-graph-uri=" + encoded(robot.base + "/arm");
  const std::string labels = "SELECT ?l { { ?s rdfs:label ?l } UNION { ?s dcterms:title ?l FILTER(?s = </arm>) } }";
  CHECK(rows(robot.query(labels, "text/csv", "", map)) == Rows{"the cup"});
  CHECK(rows(robot.query(labels, "text/csv", "", arm)) == Rows{"An arm"});
  CHECK(rows(robot.query(labels, "text/csv", "", arm + map)) == Rows{"An arm", "the cup"});
  CHECK(rows(robot.query("SELECT ?l FROM </world/map> { ?s rdfs:label ?l }")) == Rows{"the cup"});
  CHECK(rows(robot.query("SELECT ?l FROM </arm> { ?s rdfs:label ?l }", "text/csv", "", map)) == Rows{"the cup"});  // the request's counts (2.1.4)
  CHECK(rows(robot.query("SELECT ?g { GRAPH ?g {} }", "text/csv", "", "&named-graph-uri=" + encoded(robot.base + "/arm"))) ==
        Rows{robot.base + "/arm"});
  CHECK(rows(robot.query("SELECT ?s { ?s rdfs:label ?l }", "text/csv", "", "&named-graph-uri=" + encoded(robot.base + "/world/map"))).empty());
  CHECK(rows(robot.query("SELECT ?s { ?s ?p ?o }", "text/csv", "", "&default-graph-uri=" + encoded("http://example.org/unknown"))).empty());
}

TEST_CASE("a query that is wrong, or an update, is refused with the place or the name", "[query][endpoint]") {
  Robot robot;
  const Answer wrong = robot.ask("GET /sparql?query=" + encoded("SELECT ?a {\n ?a ?b }"));
  CHECK(wrong.status == 400);
  CHECK(wrong.says("line 2"));
  const Answer update = robot.ask("POST /sparql\nContent-Type: application/sparql-update\n\nINSERT DATA { <a:b> <a:b> <a:b> }");
  CHECK(update.status == 403);
  CHECK(robot.ask("GET /sparql?query=" + encoded("INSERT DATA { <a:b> <a:b> <a:b> }")).status / 100 == 4);
  CHECK(robot.ask("GET /sparql?query=" + encoded("SELECT * { SERVICE <http://127.0.0.1:1/> { ?s ?p ?o } }")).status == 403);
  CHECK(missing(robot.ask("GET /sparql\nAccept: text/turtle"), "</sparql> a <http://www.w3.org/ns/sparql-service-description#Service> .",
                robot.base + "/") == "");
}

TEST_CASE("who asks sees in the graphs what they may read, and counts tell no more", "[query][endpoint][security]") {
  Rulebook book;
  Robot robot({}, [&](Options& options) { book.apply(options); });
  std::vector<Thing> things;
  things.push_back(ruled_arm([](double) {}));
  Thing veiled{"veiled_arm"};
  veiled.title("veiled arm").property<double>("weight").publish(4);
  things.push_back(std::move(veiled));
  REQUIRE(robot.server->remove("arm"));
  REQUIRE(robot.server->add(std::move(things)));

  const std::string everything = "SELECT * { GRAPH ?g { ?s ?p ?o } }", count = "SELECT (COUNT(*) AS ?n) { ?s ?p ?o }",
                    graphs = "SELECT (COUNT(?g) AS ?n) { GRAPH ?g {} }";
  CHECK(robot.query(everything).status == 401);
  CHECK(robot.query(everything, "text/csv", "carl").says("veiled"));
  for (const char* who : {"anna", "bert"}) {
    CAPTURE(who);
    const Answer seen = robot.query(everything, "text/csv", who);
    CHECK(seen.status == 200);
    CHECK(seen.says("/arm/angle"));
    CHECK_FALSE(seen.says("veiled"));
    CHECK(seen.field("Cache-Control").find("private") != std::string::npos);
    CHECK(rows(robot.query("ASK { ?s ?p ?o FILTER(CONTAINS(STR(?o), \"veiled\")) }", "application/sparql-results+json", who)).empty());
    CHECK(robot.query("ASK { GRAPH </arm/veiled_angle> {} }", "application/sparql-results+json", who).says("false"));
    CHECK(robot.query("ASK { GRAPH </arm/veiled_angle> {} }", "application/sparql-results+json", "carl").says("true"));
    CHECK(robot.query("DESCRIBE </arm/veiled_angle>", "application/n-triples", who).body.empty());
    // What comes and goes behind the veil moves no number.
    const Rows triples = rows(robot.query(count, "text/csv", who)), names = rows(robot.query(graphs, "text/csv", who));
    const Rows all = rows(robot.query(count, "text/csv", "carl"));
    CHECK(all != triples);
    Thing hidden{"veiled_arm/part"};
    hidden.title("veiled part").property<double>("size").publish(1);
    REQUIRE(robot.server->add(std::move(hidden)));
    CHECK(rows(robot.query(count, "text/csv", who)) == triples);
    CHECK(rows(robot.query(graphs, "text/csv", who)) == names);
    CHECK(rows(robot.query(count, "text/csv", "carl")) != all);
    REQUIRE(robot.server->remove("veiled_arm/part"));
  }
  // A reader may POST a query, but not write.
  CHECK(robot.ask("POST /sparql\nContent-Type: application/sparql-query\nAccept: text/csv\n\n" + count, "anna").status == 200);
  CHECK(robot.ask("PUT /arm/angle\nContent-Type: application/json\n\n5", "anna").status == 403);
  // The graphs of a principal are those of GET.
  for (const std::string& name : rows(robot.query("SELECT ?g { GRAPH ?g {} }", "text/csv", "anna"))) {
    CAPTURE(name);
    const Answer got = robot.ask("GET " + name.substr(robot.base.size()) + "\nAccept: application/n-triples", "anna");
    REQUIRE(got.status == 200);
    const Answer asked = robot.query("CONSTRUCT { ?s ?p ?o } { GRAPH <" + name + "> { ?s ?p ?o } }", "application/n-triples", "anna");
    CHECK(rdf::isomorphic(got.graph(), asked.graph()));
  }
}

TEST_CASE("nobody sees another's standing query", "[query][endpoint][security]") {
  Rulebook book;
  Robot robot({}, [&](Options& options) { book.apply(options); });
  const std::string target = robot.target("SELECT ?v { GRAPH </arm/angle> { ?x vom:numericalValue ?v } }");
  StreamClient carl(robot.server->port(), target, "Authorization: Bearer carl-0123456789abcdef\r\n");
  CHECK(events(carl, 1)[0].data.find("0.5") != std::string::npos);
  CHECK(robot.ask("GET /sparql/subscriptions", "carl").linked("related").size() +
            robot.ask("GET /sparql/subscriptions\nAccept: text/turtle", "carl").says("onResource") >
        0);
  const std::string list = robot.ask("GET /sparql/subscriptions\nAccept: application/n-triples", "carl").body;
  const std::size_t begin = list.find("/sparql/standing-");
  REQUIRE(begin != std::string::npos);
  const std::string standing = list.substr(begin, list.find('>', begin) - begin);
  CHECK(standing != "/sparql/standing-1");  // a number would count those of others
  CHECK(robot.ask("GET " + standing, "carl").status == 200);
  for (const char* who : {"anna", "bert"}) {
    CAPTURE(who);
    CHECK(robot.ask("GET " + standing, who).status == 404);
    const Answer seen = robot.ask("GET /sparql/subscriptions\nAccept: text/turtle", who);
    CHECK(seen.status == 200);
    CHECK_FALSE(seen.says("/sparql/subscriptions/"));
    CHECK_FALSE(seen.says("standing"));
    CHECK_FALSE(robot.query("SELECT * { GRAPH ?g { ?s ?p ?o } }", "text/csv", who).says("standing"));
  }
}

TEST_CASE("a standing query over an event stream has the answer, and the answer again when it is another", "[query][endpoint]") {
  Robot robot;
  StreamClient client(robot.server->port(), robot.target("SELECT ?v { GRAPH </arm/angle> { ?x vom:numericalValue ?v } }"));
  CHECK(events(client, 1)[0].data.find("\"value\":\"0.5\"") != std::string::npos);
  robot.angle->publish(0.625);
  CHECK(events(client, 1)[0].data.find("\"value\":\"0.625\"") != std::string::npos);
  CHECK(robot.server->counters().event_streams == 1);
  client.close();
  until("the end of the subscription", [&] { return robot.server->counters().event_streams == 0; });
  until("the end of the query", [&] { return robot.ask("GET /sparql/standing-1").status == 404; });
}

TEST_CASE("a standing query over a WebSocket notices Things and graphs of a World", "[query][endpoint]") {
  Robot robot;
  Watcher labels(robot, robot.target("SELECT ?l { ?s rdfs:label ?l FILTER(STRSTARTS(STR(?s), STR(</world/>))) } ORDER BY ?l"));
  Watcher titles(robot, robot.target("SELECT ?l { ?s dcterms:title ?l FILTER(STRSTARTS(STR(?s), STR(</arm>))) }"));
  CHECK(labels.next().find("the cup") != std::string::npos);
  CHECK(titles.next().find("A tool") == std::string::npos);
  REQUIRE(robot.tasks.update([](GraphUpdate& u) { u.add("#fetch", vocab::rdfs::label, "fetch the cup"); }));
  const std::string both = labels.next();
  CHECK(both.find("\"fetch the cup\"") < both.find("\"the cup\""));
  Thing tool{"arm/tool"};
  tool.title("A tool");
  REQUIRE(robot.server->add(std::move(tool)));
  CHECK(titles.next().find("A tool") != std::string::npos);
  REQUIRE(robot.server->remove("arm/tool"));
  CHECK(titles.next().find("A tool") == std::string::npos);
  CHECK(robot.server->counters().websockets == 2);
}

TEST_CASE("a standing query with changes=true has the rows that came and those that went", "[query][endpoint]") {
  Robot robot;
  const std::string target = robot.target("SELECT ?v { GRAPH </arm/angle> { ?x vom:numericalValue ?v } }", "&changes=true");
  Watcher socket(robot, target);
  StreamClient stream(robot.server->port(), target);
  CHECK(socket.next().find("\"0.5\"") != std::string::npos);
  CHECK(events(stream, 1)[0].data.find("\"0.5\"") != std::string::npos);
  for (int i = 0; i < 3; ++i) {
    CAPTURE(i);
    const std::string before = i == 0 ? "0.5" : std::to_string(i) + ".25", after = std::to_string(i + 1) + ".25";
    robot.angle->publish(i + 1.25);
    for (const std::string& text : {socket.next(), events(stream, 1)[0].data}) {
      CAPTURE(text);
      const std::size_t removed = text.find("\"removed\":");
      REQUIRE(removed != std::string::npos);
      CHECK(text.find("\"" + after + "\"") < removed);
      CHECK(text.find("\"" + before + "\"", removed) != std::string::npos);
      CHECK(text.find("\"sequence\":" + std::to_string(i + 2)) != std::string::npos);
    }
  }
}

TEST_CASE("a web callback gets the answer of a standing query, and each new one", "[query][endpoint]") {
  Recorder recorder;
  Receiver receiver([&](Peer& peer) { recorder(peer); });
  Robot robot({}, [](Options& options) { options.callbacks.allow = {"127.0.0.1"}; });
  const Answer made = robot.ask("GET " + robot.target("SELECT ?v { GRAPH </arm/angle> { ?x vom:numericalValue ?v } }") +
                                "\nUpgrade: callback\nConnection: Upgrade\nCallback: " + receiver.url());
  CHECK(made.status == 201);
  robot.angle->publish(0.875);
  until("the callback", [&] {
    const auto all = recorder.requests();
    return !all.empty() && all.back().find("\"0.875\"") != std::string::npos;
  });
  CHECK(recorder.requests().back().find("application/sparql-results+json") != std::string::npos);
}

TEST_CASE("a client that leaves ends its query", "[query][endpoint]") {
  const Watchdog watchdog("a query whose client has gone", seconds(120));
  Robot robot(unlimited());  // with one thread
  const int before = robot.reads;
  {
    Socket client(robot.server->port());
    client.send(robot.complete("GET " + robot.target(endless)));
    until("the query runs", [&] { return robot.reads > before; });
  }
  CHECK(rows(robot.query("SELECT ?l { </world/map#cup> rdfs:label ?l }")) == Rows{"the cup"});
}

TEST_CASE("while a query runs without an end, others' requests are answered", "[query][endpoint]") {
  const Watchdog watchdog("requests beside an endless query", seconds(120));
  query::EndpointOptions two = unlimited();
  two.threads = 2;
  Robot robot(two);
  Socket waiting(robot.server->port()), other(robot.server->port());
  const int before = robot.reads;
  waiting.send(robot.complete("GET " + robot.target(endless)));
  until("the query runs", [&] { return robot.reads > before; });
  for (int i = 0; i < 100; ++i) CHECK(other.ask(robot.complete("GET /arm/angle")).status == 200);
  CHECK(rows(robot.query("SELECT ?l { </world/map#cup> rdfs:label ?l }")) == Rows{"the cup"});
  CHECK_FALSE(waiting.receive());
}

TEST_CASE("explosive queries end at a limit, which the answer names, and delay nobody", "[query][endpoint]") {
  const Watchdog watchdog("explosive queries", seconds(240));
  query::EndpointOptions endpoint;
  endpoint.time = std::chrono::hours(1);  // so that what they need counts, not the machine
  endpoint.max_steps = 1'000'000;
  endpoint.max_solution_bytes = 4 * 1024 * 1024;
  endpoint.max_rows = 1'000;
  Robot robot(endpoint);
  std::string optionals, doubled = "BIND(\"aaaaaaaaaaaaaaaa\" AS ?c0) ";
  for (int i = 0; i < 12; ++i) optionals += "OPTIONAL { ?s" + std::to_string(i) + " ?p" + std::to_string(i) + " ?s" + std::to_string(i + 1) + " ";
  optionals += std::string(12, '}');
  for (int i = 0; i < 40; ++i)
    doubled += "BIND(CONCAT(?c" + std::to_string(i) + ", ?c" + std::to_string(i) + ") AS ?c" + std::to_string(i + 1) + ") ";
  const struct {
    std::string query;
    std::vector<std::string> limits;
  } all[] = {
      {endless, {"steps"}},
      {"SELECT * { ?a ?b ?c . ?d ?e ?f }", {"1,000 rows", "bytes"}},
      {"SELECT * { ?a ?b ?c . ?d ?e ?f . ?g ?h ?i } ORDER BY ?a ?e ?i", {"bytes", "steps", "rows"}},
      {"SELECT DISTINCT ?a ?e ?i { ?a ?b ?c . ?d ?e ?f . ?g ?h ?i }", {"bytes", "steps", "rows"}},
      {"SELECT (COUNT(*) AS ?n) { " + optionals + " }", {"steps", "bytes"}},
      {"SELECT (COUNT(*) AS ?n) { ?a (!:x|^!:x)* ?b . ?b (!:x|^!:x)* ?c . ?c (!:x|^!:x)* ?d }", {"steps", "bytes"}},
      {"SELECT (COUNT(*) AS ?n) { ?a ?b ?c . ?d ?e ?f . ?g ?h ?i FILTER(REGEX(CONCAT(STR(?c), STR(?f), STR(?i)), "
       "\"(a*)*(x+x+)+y\")) }",
       {"steps", "regular expression"}},
      {"SELECT (STRLEN(?c40) AS ?n) { " + doubled + " }", {"bytes"}},
      {"CONSTRUCT { ?a ?b ?f } { ?a ?b ?c . ?d ?e ?f }", {"1,000 rows", "bytes"}},
      {"SELECT (GROUP_CONCAT(?c) AS ?n) { ?a ?b ?c . ?d ?e ?f . ?g ?h ?i }", {"bytes", "steps"}},
      {"SELECT ?c14 { VALUES ?i { 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 } { SELECT ?c14 { " +
           doubled.substr(0, doubled.find("BIND(CONCAT(?c14")) + "} } }",
       {"bytes of its answer"}},
  };
  Socket other(robot.server->port());
  for (const auto& one : all) {
    CAPTURE(one.query);
    Socket client(robot.server->port());
    client.send(robot.complete("GET " + robot.target(one.query)));
    std::optional<Answer> answer;
    int answered = 0;
    do {
      CHECK(other.ask(robot.complete("GET /arm/angle")).status == 200);
      ++answered;
      answer = client.receive();
    } while (!answer);
    CAPTURE(answer->body);
    CHECK(answer->status == 503);
    CHECK(std::any_of(one.limits.begin(), one.limits.end(), [&](const std::string& limit) { return answer->says(limit); }));
  }
  // Expressions that other engines do not come back from.
  const Answer replaced = robot.query("SELECT (REPLACE(\"aaa\", \"a*\", \"b\") AS ?r) {}", "application/sparql-results+json");
  CHECK(replaced.says("\"bindings\":[\n{}]"));  // an error: the pattern matches the empty text (XPath Functions 5.6.4)
  const Answer searched = robot.query("SELECT (REGEX(\"aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa!\", \"^(a|aa)+$\") AS ?r) {}");
  CHECK((searched.status == 200 || searched.says("regular expression") || searched.says("steps")));
}

TEST_CASE("the time of a query is a limit, too", "[query][endpoint]") {
  const Watchdog watchdog("the time of a query", seconds(120));
  query::EndpointOptions endpoint = unlimited();
  endpoint.time = std::chrono::milliseconds(50);
  Robot robot(endpoint);
  const Answer late = robot.query(endless);
  CHECK(late.status == 503);
  CHECK(late.says("50 ms"));
}

TEST_CASE("queries are counted: begun, failed, refused, and those that stand", "[query][endpoint]") {
  const Watchdog watchdog("counters of queries", seconds(120));
  query::EndpointOptions endpoint = unlimited();
  endpoint.max_steps = 10'000;
  Robot robot(endpoint);
  const auto counters = [&] { return robot.server->counters(); };
  CHECK(counters().queries == 0);
  CHECK(robot.query("SELECT ?l { </world/map#cup> rdfs:label ?l }").status == 200);
  CHECK(counters().queries == 1);
  CHECK(counters().failed_queries == 0);
  CHECK(counters().query_seconds > 0);
  CHECK(robot.query("SELECT nothing").status == 400);  // was not begun
  CHECK(robot.query(endless).status == 503);
  CHECK(counters().queries == 2);
  CHECK(counters().failed_queries == 1);
  CHECK(counters().running_queries == 0);
  StreamClient stream(robot.server->port(), robot.target("SELECT ?v { GRAPH </arm/angle> { ?x vom:numericalValue ?v } }"));
  (void)events(stream, 1);
  CHECK(counters().standing_queries == 1);
  CHECK(counters().queries == 2);
  CHECK(counters().refused_queries == 0);

  query::EndpointOptions one = unlimited();
  one.max_queries = 1;
  Robot full(one);
  Socket waiting(full.server->port());
  waiting.send(full.complete("GET " + full.target(endless)));
  until("the query runs", [&] { return full.server->counters().running_queries == 1; });
  CHECK(full.query("SELECT ?l { </world/map#cup> rdfs:label ?l }").status == 503);
  CHECK(full.server->counters().refused_queries == 1);
  CHECK(full.server->counters().queries == 1);
}

TEST_CASE("a server stops while queries run and stand", "[query][endpoint]") {
  const Watchdog watchdog("stop() during a query", seconds(120));
  Robot robot(unlimited());
  StreamClient stream(robot.server->port(), robot.target("SELECT ?v { GRAPH </arm/angle> { ?x vom:numericalValue ?v } }"));
  (void)events(stream, 1);
  Socket client(robot.server->port());
  const int before = robot.reads;
  client.send(robot.complete("GET " + robot.target(endless)));
  until("the query runs", [&] { return robot.reads > before; });
  robot.server->stop();
  robot.server.reset();
  until("the end of the stream", [&] {
    stream.step();
    return stream.ended || stream.finished;
  });
}

TEST_CASE("queries see whole graphs while others add and remove Things, publish and update", "[query][endpoint][threads]") {
  const Watchdog watchdog("queries beside changes", seconds(240));
  query::EndpointOptions endpoint;
  endpoint.threads = 2;
  Robot robot(endpoint);
  std::atomic<bool> over{false};
  std::thread changes([&] {
    for (int i = 0; !over; ++i) {
      Thing tool{"arm/tool"};
      tool.title("A tool").property<double>("weight").publish(i);
      if (!robot.server->add(std::move(tool))) std::abort();
      if (!robot.server->remove("arm/tool")) std::abort();
    }
  });
  std::thread values([&] {
    for (int i = 0; !over; ++i) {
      robot.angle->publish(i);
      robot.cup.publish(i);
      const Object number{static_cast<std::int64_t>(i)};
      (void)robot.tasks.update([&](GraphUpdate& u) { u.set("#a", vocab::rdfs::label, number).set("#b", vocab::rdfs::label, number); });
    }
  });
  StreamClient stream(robot.server->port(), robot.target("SELECT ?t { ?s dcterms:title ?t }"));
  const int count = is_sanitized ? 30 : 200;
  for (int i = 0; i < count; ++i) {
    // Both labels are of one update.
    const Rows pairs = rows(robot.query("SELECT (COUNT(DISTINCT ?l) AS ?n) { GRAPH </world/tasks> { ?s rdfs:label ?l } }"));
    CHECK((pairs == Rows{"1"} || pairs == Rows{"0"}));
    CHECK(rows(robot.query("SELECT ?t { GRAPH </arm> { </arm> dcterms:title ?t } }")) == Rows{"An arm"});
    stream.step();
  }
  over = true;
  changes.join();
  values.join();
}

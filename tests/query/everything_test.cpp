// SPDX-License-Identifier: Apache-2.0
// Queries see everything with a URI: each document that GET returns, for whom GET returns it.

#include <lrt/query.hpp>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/rdf/codec.hpp>
#include <lrt/security.hpp>
#include <lrt/world.hpp>

#include "src/security/policy.hpp"
#include "tests/query/requests.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/event_stream.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;

namespace {

const std::string base = "http://localhost";
const std::string prefixes =
    "PREFIX hybrit: <https://hybr-it-projekt.de/ns/hybr-it#> PREFIX lrt: <https://w3id.org/lrt/ns#> PREFIX dcterms: <http://purl.org/dc/terms/> "
    "PREFIX sd: <http://www.w3.org/ns/sparql-service-description#> PREFIX void: <http://rdfs.org/ns/void#> "
    "PREFIX xsd: <http://www.w3.org/2001/XMLSchema#> ";

/// Documents that repeat others, and would be described again with each value or Thing: `/arm/state`, `/arm/all`, `/all`, `/ns/structure`.
bool repeats_others(const std::string& path) {
  const auto ends_with = [&](std::string_view end) {
    return path.size() >= end.size() && path.compare(path.size() - end.size(), end.size(), end) == 0;
  };
  return ends_with("/state") || ends_with("/all") || ends_with("/ns/structure");
}

/// A robot with one of everything: anna reads the arm, bert may subscribe and write, carl manages everything.
struct Robot {
  explicit Robot(bool has_rules = true) : bench(options(has_rules)) {
    bench.add(sample.arm());
    bench.add(sample.tool());
    Thing hidden("hidden");
    hidden.title("Hidden").property<double>("weight").publish(3);
    bench.add(std::move(hidden));
    Thing judged("judged");
    judged.property<double>("weight").at_least(0).publish(2);
    judged.shapes("<#own> a <http://www.w3.org/ns/shacl#NodeShape> .");  // so that it has a Blueprint of its own
    bench.add(std::move(judged));
    World world("world");
    GraphOptions of_map;
    of_map.turtle = "<#cup> <http://www.w3.org/2000/01/rdf-schema#label> \"the cup\" ; <http://example.org/near> [ <http://example.org/a> 1 ] .";
    map = world.graph("map", std::move(of_map));
    cup = map.published<double>("cup", Iri("http://example.org/height"), unit::metre);
    bench.add(std::move(world));
    cup.publish(0.25);
  }

  engine::EngineOptions options(bool has_rules) {
    engine::EngineOptions all;
    all.query = query::endpoint(unlimited());
    all.callbacks.allow = {"127.0.0.1"};
    if (!has_rules) return all;
    using security::Right;
    const auto role = [](const char* name) { return security::Who{security::Who::Kind::role, name}; };
    const security::Rights reads = Right::read | Right::subscribe, changes = reads | Right::write | Right::invoke;
    policy = security::Policy::create({{"/", security::Scope::tree, role("reader"), reads},
                                       {"/", security::Scope::tree, role("operator"), changes},
                                       {"/", security::Scope::tree, role("chief"), changes | Right::manage},
                                       {"/hidden", security::Scope::tree, role("chief"), changes | Right::manage}})
                 .value();
    all.authorize = [this](const http::Request& request) {
      engine::Caller caller;
      const std::string name(request.find("Who").value_or(""));
      auto made = std::make_shared<security::Principal>();
      made->name = name;
      made->roles = {name == "carl" ? "chief" : name == "bert" ? "operator" : "reader"};
      caller.principal = made;
      caller.view = policy->view(made.get());
      return caller;
    };
    return all;
  }
  static query::EndpointOptions unlimited() {
    query::EndpointOptions endpoint;
    endpoint.time = std::chrono::hours(1);
    endpoint.max_steps = ~std::uint64_t{0};
    return endpoint;
  }

  static std::string target(const std::string& query, const std::string& more = {}) { return "/sparql?query=" + encoded(prefixes + query) + more; }
  static std::string by(const std::string& who) { return who.empty() ? std::string() : "Who: " + who + "\n"; }
  Answer get(const std::string& path, const std::string& who = {}) {
    return bench.ask("GET " + path + "\nAccept: application/n-triples\n" + by(who));
  }
  Answer query(const std::string& query, const std::string& who = {}, const std::string& accept = "text/csv") {
    return bench.ask("GET " + target(query) + "\nAccept: " + accept + "\n" + by(who));
  }
  /// What one subscriber gets while all others are slow and get nothing.
  std::vector<std::string> events(engine::Channel one) {
    EventParser parser;
    do {
      bench.run();
      while (bench.engine.next_ready(bench.clock.now())) {}
      while (const auto push = bench.engine.next_push(one, bench.clock.now()))
        if (push->message) parser.read(*push->message);
    } while (bench.run() > 0);
    std::vector<std::string> all;
    for (Event& event : parser.take()) all.push_back(std::move(event.data));
    return all;
  }
  /// Longer than standing queries wait between two evaluations.
  void wait() {
    bench.clock.advance(milliseconds(150));
    bench.run();
  }
  std::string subscribe(const std::string& who, const std::string& path = "/arm/angle") {
    const Answer made =
        bench.ask("GET " + path + "\nUpgrade: callback\nConnection: Upgrade\nCallback: http://127.0.0.1:9/secret-of-" + who + "\n" + by(who));
    CHECK(made.status == 201);
    return made.field("Location");
  }

  std::shared_ptr<security::Policy> policy;
  SampleRobot sample;
  WorldGraph map;
  PublishedObject<double> cup;
  Bench bench;
};

/// All documents in RDF that one finds from the list of Things, by their paths.
std::map<std::string, Answer> documents(Robot& robot, const std::string& who) {
  std::map<std::string, Answer> found;
  std::set<std::string> known{"/"};
  std::vector<std::string> open{"/"};
  const auto follow = [&](std::string_view iri) {
    if (iri.substr(0, base.size()) != base || iri.size() == base.size() || iri[base.size()] != '/') return;
    std::string path(iri.substr(base.size()));
    path.resize(std::min(path.find_first_of("#?"), path.size()));
    if (known.insert(path).second) open.push_back(std::move(path));
  };
  while (!open.empty()) {
    const std::string path = std::move(open.back());
    open.pop_back();
    const Answer answer = robot.get(path, who);
    for (const char* rel : {"related", "up", "describedby", "https://w3id.org/lrt/ns#query", "https://w3id.org/lrt/ns#all"})
      for (const std::string& target : answer.linked(rel)) follow(target);
    if (answer.status != 200 || answer.field("Content-Type").find("application/n-triples") != 0) continue;
    const rdf::Graph graph = answer.graph();
    for (std::size_t i = 0; i < graph.term_count(); ++i)
      if (const rdf::TermView term = graph.term(static_cast<rdf::TermId>(i)); term.is_iri()) follow(term.text);
    found.emplace(path, answer);
  }
  return found;
}

const std::string drops = "SELECT ?s ?n { ?s a hybrit:Subscription ; lrt:dropped ?n }";

}  // namespace

TEST_CASE("each document that GET returns is a graph, with the same triples for the same principal", "[query][everything]") {
  for (const bool has_rules : {false, true}) {
    Robot robot(has_rules);
    const std::string json = "Content-Type: application/json\n\n";
    CHECK(robot.bench.ask("POST /arm/waypoints\n" + Robot::by("bert") + json + "{\"x\":1,\"y\":2,\"frame\":\"base\"}").status == 201);
    CHECK(robot.bench.ask("POST /arm/actions/grip\n" + Robot::by("bert")).status / 100 == 2);
    const std::string of_bert = robot.subscribe("bert"), of_carl = robot.subscribe("carl");
    (void)robot.bench.open("/arm/speed", Robot::by("anna"));
    (void)robot.bench.open_stream(Robot::target(drops), Robot::by("anna"));
    engine::FeedSubscription feed;
    feed.path = "/arm/count";
    feed.statements = {{"http://example.org/topic", Object(std::string("robot/count"))}};
    REQUIRE(robot.bench.engine.subscribe(std::move(feed), robot.bench.clock.now()));
    robot.bench.run();
    for (const std::string who : {"anna", "bert", "carl"}) {
      const std::map<std::string, Answer> all = documents(robot, who);
      for (const char* path : {"/", "/ns/lrt", "/ns/vocabulary", "/.well-known/void", "/sparql", "/sparql/subscriptions", "/arm",
                               "/arm/subscriptions", "/arm/angle", "/arm/actions/turn", "/judged/blueprint", "/world/map", "/world/map/cup"}) {
        CAPTURE(has_rules, who, path);
        CHECK(all.count(path) == 1);
      }
      const Rows names = rows(robot.query("SELECT ?g { GRAPH ?g {} }", who));
      CAPTURE(names);
      std::size_t compared = 0;
      for (const auto& [path, got] : all) {
        CAPTURE(has_rules, who, path);
        if (repeats_others(path)) {
          CHECK(names.count(base + path) == 0);
          continue;
        }
        CHECK(names.count(base + path) == (got.graph().empty() ? names.count(base + path) : 1));
        const Answer asked = robot.query("CONSTRUCT { ?s ?p ?o } { GRAPH <" + base + path + "> { ?s ?p ?o } }", who, "application/n-triples");
        CHECK(rdf::isomorphic(got.graph(), asked.graph()));
        ++compared;
      }
      CHECK(compared > 35);
      // And no more than GET: each name is a document.
      for (const std::string& name : names) {
        CAPTURE(has_rules, who, name);
        CHECK(robot.get(name.substr(base.size()), who).status == 200);
      }
      if (!has_rules) continue;
      const Answer everything = robot.query("SELECT * { GRAPH ?g { ?s ?p ?o } }", who);
      CHECK(everything.says("secret-of-bert") == (who != "anna"));
      CHECK(everything.says("secret-of-carl") == (who == "carl"));
      CHECK(everything.says("/hidden") == (who == "carl"));
    }
  }
}

TEST_CASE("a query finds the subscriptions by each of their terms, also if it is the first to need them", "[query][everything]") {
  Robot robot;
  const std::string callback = robot.subscribe("bert");
  (void)robot.bench.open("/arm/angle?minimumInterval=1&queueLength=5", Robot::by("bert"));
  engine::FeedSubscription feed;
  feed.path = "/arm/count";
  feed.statements = {{"http://example.org/topic", Object(std::string("robot/count"))}};
  REQUIRE(robot.bench.engine.subscribe(std::move(feed), robot.bench.clock.now()));
  std::set<std::string> terms;
  const std::string in_list = "FILTER(CONTAINS(STR(?g), \"/subscriptions\"))";
  for (const std::string& term : rows(robot.query("SELECT DISTINCT ?p { GRAPH ?g { ?s ?p ?o } " + in_list + " }", "bert")))
    terms.insert("<" + term + "> ?o");
  const std::size_t predicates = terms.size();
  for (const std::string& type : rows(robot.query("SELECT DISTINCT ?t { GRAPH ?g { ?s a ?t } " + in_list + " }", "bert")))
    terms.insert("a <" + type + ">");
  CHECK(predicates > 14);
  CHECK(terms.size() > predicates + 4);
  for (const std::string& term : terms) {
    CAPTURE(term);
    robot.bench.clock.advance(std::chrono::seconds(61));  // the graphs of the last query are forgotten
    robot.bench.run();
    CHECK(robot.query("ASK { GRAPH ?g { ?s " + term + " } " + in_list + " }", "bert", "application/sparql-results+json").says("true"));
  }
}

TEST_CASE("subscriptions of others are not seen by equal queries of principals with the same rights", "[query][everything][security]") {
  Robot robot;
  const std::string query = "SELECT ?s { ?s a hybrit:Subscription ; hybrit:callbackURL ?url }";
  const std::string of_anna = robot.subscribe("anna"), of_dora = robot.subscribe("dora");
  CHECK(rows(robot.query(query, "anna")) == Rows{of_anna});
  CHECK(rows(robot.query(query, "dora")) == Rows{of_dora});
  CHECK(rows(robot.query(query, "carl")) == Rows{of_anna, of_dora});
  // Standing queries, too: each has its own answer.
  const auto anna = robot.bench.open_stream(Robot::target(query), Robot::by("anna"));
  const auto dora = robot.bench.open_stream(Robot::target(query), Robot::by("dora"));
  const auto first = robot.events(anna);
  REQUIRE(first.size() == 1);
  CHECK(first[0].find(of_anna) != std::string::npos);
  CHECK(first[0].find(of_dora) == std::string::npos);
  robot.wait();
  const auto other = robot.events(dora);
  REQUIRE(other.size() == 1);
  CHECK(other[0].find(of_dora) != std::string::npos);
  CHECK(other[0].find(of_anna) == std::string::npos);
  const auto path_for = [&](const char* who) {  // of the standing query that one of them sees
    const std::string list = robot.get("/sparql/subscriptions", who).body;
    const std::size_t at = list.find("/sparql/standing-");
    REQUIRE(at != std::string::npos);
    return list.substr(at, list.find_first_of(">\" ,;", at) - at);
  };
  const std::string of_a = path_for("anna"), of_d = path_for("dora");
  CHECK(robot.get(of_a, "anna").status == 406);  // it is there, and is no Turtle
  CHECK(robot.get(of_d, "dora").status == 406);
  CHECK(robot.get(of_a, "dora").status == 404);
  CHECK(robot.get(of_d, "anna").status == 404);
}

TEST_CASE("the drops of a query are those of the counters, and only subscriptions themselves trigger a standing query", "[query][everything]") {
  Robot robot(false);
  Thing scanner("scanner");
  auto list = scanner.property<std::vector<double>>("ranges");  // its predicates are others when its length is another
  list.publish({1});
  robot.bench.add(std::move(scanner));
  constexpr std::size_t slow_readers = 20;
  for (std::size_t i = 0; i < slow_readers; ++i) (void)robot.bench.open("/arm/angle?queueLength=" + std::to_string(i % 4 + 1));
  const auto standing = robot.bench.open_stream(Robot::target(drops));
  const auto with_clock =
      robot.bench.open_stream(Robot::target("SELECT ?s ?n { ?s lrt:dropped ?n FILTER(NOW() > \"2000-01-01T00:00:00Z\"^^xsd:dateTime) }"));
  const auto by_any_predicate = robot.bench.open_stream(Robot::target("SELECT ?s ?n { ?s ?p ?n FILTER(?p = lrt:dropped) }"));
  for (int i = 0; i < 5; ++i) robot.wait();
  const auto changes = [&] {
    std::size_t count = 0;
    for (int i = 0; i < 10; ++i) {
      robot.wait();
      for (const auto channel : {standing, with_clock, by_any_predicate}) count += robot.events(channel).size();
    }
    return count;
  };
  CHECK(changes() > 0);
  CHECK(changes() == 0);

  const auto load = [&](int count) {
    for (int i = 0; i < count; ++i) {
      robot.sample.angle_handle->publish(i % 80 + 0.25);
      list.publish(std::vector<double>(static_cast<std::size_t>(i % 5), 1));
      robot.bench.clock.advance(milliseconds(10));
      (void)robot.events(standing);
    }
  };
  std::size_t dropped = 0;
  for (int round = 0; round < 3; ++round) {
    load(40);
    CHECK(changes() == 0);
    std::size_t sum = 0;
    const Rows found = rows(robot.query(drops));
    CHECK(found.size() == slow_readers + 3);
    for (const std::string& row : found) {
      const std::string iri = row.substr(0, row.find(',')), count = row.substr(row.find(',') + 1);
      const Answer got = robot.get(iri.substr(base.size()));
      CHECK(got.says("<https://w3id.org/lrt/ns#dropped> \"" + count + "\""));
      sum += std::stoul(count);
    }
    CHECK(sum > dropped);
    CHECK(sum == robot.bench.engine.counts().messages_dropped);
    dropped = sum;
    CHECK(rows(robot.query("SELECT ?s { ?s lrt:dropped ?n FILTER(?n > 0) }")).size() >= slow_readers);
    CHECK(changes() == 0);  // that a client has asked is no reason either
  }

  const std::string made = robot.subscribe("anna");
  CHECK(changes() == 3);
  CHECK(robot.bench.ask("DELETE " + made.substr(base.size())).status / 100 == 2);
  const auto saved = robot.bench.take_saved();
  if (saved) robot.bench.engine.saved(saved->revision, true);
  CHECK(changes() == 3);
  CHECK(changes() == 0);
}

TEST_CASE("a counter of the program triggers no standing query, and is read when one asks", "[query][everything]") {
  Robot robot(false);
  std::int64_t count = 1;
  Thing thing("server");
  thing.property("requests", [&] { return count; }).as_counter().sample(milliseconds(10));
  thing.property("other", [&] { return count; }).sample(milliseconds(10));
  robot.bench.add(std::move(thing));
  const auto values_of = [](const char* path) {
    return "SELECT ?v { <" + base + path + "> <http://vocab.arvida.de/2015/06/vom/vocab#numericalValue> ?v }";
  };
  const auto counter = robot.bench.open_stream(Robot::target(values_of("/server/requests")));
  const auto other = robot.bench.open_stream(Robot::target(values_of("/server/other")));
  CHECK(robot.events(counter).size() == 1);
  robot.wait();
  CHECK(robot.events(other).size() == 1);
  count = 2;
  std::size_t of_counter = 0, of_other = 0;
  for (int i = 0; i < 5; ++i) {
    robot.wait();
    of_counter += robot.events(counter).size();
    robot.wait();
    of_other += robot.events(other).size();
  }
  CHECK(of_counter == 0);
  CHECK(of_other == 1);
  CHECK(rows(robot.query(values_of("/server/requests"))) == Rows{"2"});
}

TEST_CASE("a query says which values are stale", "[query][everything]") {
  Robot robot(false);
  const std::string stale = "SELECT ?p { ?p a hybrit:Property ; dcterms:modified ?when FILTER(NOW() - ?when > \"PT10S\"^^xsd:dayTimeDuration) }";
  robot.sample.angle_handle->publish(20);
  robot.bench.clock.advance(milliseconds(10));
  (void)robot.query(stale);
  CHECK(rows(robot.query(stale)).count(base + "/arm/angle") == 0);
  robot.bench.clock.advance(milliseconds(10'001));
  CHECK(rows(robot.query(stale)).count(base + "/arm/angle") == 1);
  robot.sample.angle_handle->publish(21);
  CHECK(rows(robot.query(stale)).count(base + "/arm/angle") == 0);
}

TEST_CASE("the service lists its graphs, and VoID says what the dataset is", "[query][everything]") {
  Robot robot;
  for (const std::string who : {"anna", "carl"}) {
    CAPTURE(who);
    const Rows named = rows(robot.query("SELECT ?g { ?service sd:defaultDataset/sd:namedGraph/sd:name ?g }", who));
    Rows graphs = rows(robot.query("SELECT ?g { GRAPH ?g {} FILTER(!CONTAINS(STR(?g), \"/subscriptions/\")) }", who));
    // Those of properties that have no value now are empty.
    for (const std::string& name : named) {
      CAPTURE(name);
      CHECK((graphs.count(name) == 1 || robot.get(name.substr(base.size()), who).status == 500));
    }
    for (const std::string& name : graphs) {
      CAPTURE(name);
      const bool comes_and_goes = name == base + "/world/map/cup";  // a published value: only those that stay are listed
      CHECK(named.count(name) == (comes_and_goes ? 0 : 1));
    }
    CHECK((named.count(base + "/hidden") == 1) == (who == "carl"));
    const Answer about = robot.bench.ask("GET /.well-known/void\nAccept: text/turtle\n" + Robot::by(who));
    CHECK(about.status == 200);
    CHECK(missing(about,
                  "@prefix void: <http://rdfs.org/ns/void#> . </.well-known/void#dataset> a void:Dataset ; void:sparqlEndpoint </sparql> ; "
                  "void:rootResource </> ; "
                  "void:exampleResource </arm> ; void:uriSpace \"http://localhost/\" ; void:feature <http://www.w3.org/ns/formats/Turtle> .",
                  base + "/") == "");
    CHECK(missing(robot.bench.ask("GET /\nAccept: text/turtle\n" + Robot::by(who)), "</> rdfs:seeAlso </.well-known/void> .", base + "/") == "");
  }
}

TEST_CASE("the list of graphs has an end, and a query has all", "[query][everything]") {
  Robot robot(false);
  for (int i = 0; i < 700; ++i) {
    Thing thing("part-" + std::to_string(i));
    thing.property<double>("weight").publish(i);
    robot.bench.add(std::move(thing));
  }
  CHECK(rows(robot.query("SELECT ?g { ?service sd:defaultDataset/sd:namedGraph/sd:name ?g }")).size() == 1'000);
  CHECK(rows(robot.query("SELECT ?g { GRAPH ?g {} }")).size() > 2'000);
}

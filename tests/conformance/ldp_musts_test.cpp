// SPDX-License-Identifier: Apache-2.0
// Every MUST of LDP 1.0 that ldp_musts.txt says we pass, as a check of that name, and the file against the W3C suite's own list.

#include <lrt/engine/engine.hpp>

#include <algorithm>
#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <lrt/server.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"
#include "tests/support/skip.hpp"
#include "tests/support/socket.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

const std::string here = "http://localhost";
const std::string subscriptions = "/arm/subscriptions", waypoints = "/arm/waypoints";
const std::string type = "type";
const std::string constrained_by(vocab::ldp::constrainedBy.text);

std::string pose(const std::string& x = "1", const std::string& more = {}) {
  return "<> a maths:Vector3D ; maths:x [ vom:numericalValue " + x +
         " ; qudt:hasUnit unit:M ] ; maths:y [ vom:numericalValue 2 ; qudt:hasUnit unit:M ] ;"
         " <http://localhost/ns/vocabulary#Pose/frame> \"base\" " +
         more + ".";
}
std::string callback(const std::string& more = {}, const std::string& url = "http://127.0.0.1:9/r") {
  return "<> a hybrit:WebCallback ; hybrit:onResource </arm/angle> ; hybrit:callbackURL \"" + url + "\"^^xsd:anyURI " + more + ".";
}

/// The sample robot with one of every kind of resource.
struct Robot {
  explicit Robot(engine::EngineOptions options = {}) : bench(allowing(std::move(options))) {
    bench.add(robot.arm());
    bench.add(robot.tool());
    member = made(waypoints, pose());
    subscription = made(subscriptions, callback());
    invocation = path_of(bench.turtle("POST", "/arm/actions/turn", number_body("5", "maths:Degree")).field("Location"));
    kinds = {"/",        "/arm",           "/arm/tool/state", "/arm/angle", "/arm/speed",  "/arm/actions/turn",
             invocation, "/arm/blueprint", waypoints,         member,       subscriptions, subscription};
  }
  static engine::EngineOptions allowing(engine::EngineOptions options) {
    options.callbacks.allow = {"127.0.0.1"};
    options.max_body_triples = 100;
    return options;
  }
  static std::string path_of(const std::string& iri) {
    REQUIRE(iri.compare(0, here.size(), here) == 0);
    return iri.substr(here.size());
  }
  std::string made(const std::string& container, const std::string& body, const std::string& fields = {}) {
    const Answer a = bench.turtle("POST", container, body, fields);
    INFO(a.body);
    REQUIRE(a.status == 201);
    return path_of(a.field("Location"));
  }
  std::string body_for(const std::string& container) const { return container == waypoints ? pose() : callback(); }
  std::set<std::string> contained(const std::string& container) {
    const rdf::Graph graph = bench.get(container).graph();
    std::set<std::string> members;
    for (const rdf::TermView& member_iri : graph.objects(rdf::iri(here + container), vocab::ldp::contains))
      members.insert(std::string(member_iri.text));
    return members;
  }

  SampleRobot robot;
  Bench bench;
  std::string member, subscription, invocation;
  std::vector<std::string> kinds;
};

/// Without the prefixes.
std::string shortened(const std::string& request) {
  const std::size_t first = request.find("\n\n@prefix "), last = request.rfind("> . ");
  if (first == std::string::npos || last == std::string::npos || last < first) return request.substr(0, 400);
  return request.substr(0, first + 2) +
         request.substr(request.rfind("ns/lrt#> . ") == std::string::npos ? last : request.rfind("ns/lrt#> . ") + 11).substr(0, 300);
}

/// One of every answer that the engine gives for a resource that exists: what was asked, of what, and what came.
struct Exchange {
  std::string request;
  int expected;
  Answer answer;
};
std::vector<Exchange> every_answer() {
  std::vector<Exchange> all;
  Robot r;
  const auto ask = [&](int expected, const std::string& request) { all.push_back({request, expected, r.bench.ask(request)}); };
  const auto turtle = [&](int expected, const std::string& method, const std::string& path, const std::string& body, const std::string& fields = {}) {
    ask(expected, Bench::turtle_request(method, path, body, fields));
  };
  for (const std::string& path : r.kinds) {
    ask(200, "GET " + path);
    ask(200, "HEAD " + path);
    ask(204, "OPTIONS " + path);
    ask(304, "GET " + path + "\nIf-None-Match: " + r.bench.get(path).tag());
    ask(206, "GET " + path + "\nRange: bytes=0-9");
    ask(416, "GET " + path + "\nRange: bytes=9999999-");
    ask(406, "GET " + path + "\nAccept: image/png");
    ask(412, "GET " + path + "\nIf-Match: \"never\"");
    ask(400, "GET " + path + "\nIf-Match: never");
    ask(405, "PATCH " + path + "\nContent-Type: text/turtle\n\n<> a <> .");
    if (r.bench.get(path).field("Allow").find("PUT") == std::string::npos) turtle(405, "PUT", path, pose());
    if (r.bench.get(path).field("Allow").find("POST") == std::string::npos) turtle(405, "POST", path, pose());
    if (r.bench.get(path).field("Allow").find("DELETE") == std::string::npos) ask(405, "DELETE " + path);
    else ask(412, "DELETE " + path + "\nIf-Match: \"never\"");
  }
  for (const std::string& path : {std::string("/"), waypoints, subscriptions}) {
    ask(404, "GET " + path + "?page=9");
    ask(400, "GET " + path + "?page=x");
    ask(200, "GET " + path + "\nPrefer: return=minimal");
  }
  for (const std::string& path : {waypoints, subscriptions}) {
    turtle(400, "POST", path, "no Turtle");
    turtle(422, "POST", path, "<> a <http://localhost/elsewhere> .");
    turtle(422, "POST", path, "<> a <http://localhost/elsewhere> .", "Accept: application/problem+json\n");
    turtle(409, "POST", path, r.body_for(path), "Link: <http://www.w3.org/ns/ldp#BasicContainer>; rel=\"type\"\n");
    turtle(412, "POST", path, r.body_for(path), "If-Match: \"never\"\n");
    turtle(201, "POST", path, r.body_for(path));
    turtle(201, "POST", path, r.body_for(path), "Prefer: return=minimal\n");
    const std::string newest = Robot::path_of(all.back().answer.field("Location"));
    ask(204, "DELETE " + newest);
    turtle(201, "POST", path, r.body_for(path), "Prefer: return=representation\nAccept: application/n-triples\n");
    ask(415, "POST " + path + "\nContent-Type: text/csv\n\nx");
    ask(415, "POST " + path + "\nContent-Type: text/turtle\nContent-Encoding: gzip\n\nx");
    std::string many;
    for (int i = 0; i < 200; ++i) many += "<> <p> " + std::to_string(i) + " . ";
    turtle(413, "POST", path, many);
  }
  turtle(409, "POST", waypoints, pose());  // it is full
  turtle(403, "POST", subscriptions, callback({}, "http://evil.example/"));
  turtle(422, "POST", subscriptions, callback({}, "nonsense"));
  turtle(422, "POST", subscriptions, callback("; a hybrit:WebSocket "));
  // Subscribing by GET.
  ask(201, "GET /arm/angle\nUpgrade: callback\nCallback: http://127.0.0.1:9/r");
  ask(403, "GET /arm/angle\nUpgrade: callback\nCallback: http://evil.example/");
  ask(400, "GET /arm/angle\nUpgrade: callback");
  ask(406, "GET /arm/angle\nUpgrade: callback\nCallback: http://127.0.0.1:9/r\nAccept: image/png");
  all.push_back(
      {"upgrade of version 8", 426, [&] {
         RequestText request(
             "GET /arm/angle\nUpgrade: websocket\nConnection: Upgrade\nSec-WebSocket-Version: 8\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==");
         request.get().can_upgrade = true;
         return r.bench.sent(r.bench.engine.handle(request.get(), r.bench.clock.now())).answer;
       }()});
  all.push_back({"upgrade", 101, r.bench.upgrade("/arm/angle").answer});
  // Properties and actions.
  turtle(204, "PUT", "/arm/angle", number_body("7", "maths:Degree"));
  turtle(200, "PUT", "/arm/angle", number_body("8", "maths:Degree"), "Prefer: return=representation\n");
  turtle(422, "PUT", "/arm/angle", number_body("700", "maths:Degree"));
  turtle(422, "PUT", "/arm/angle", number_body("7", "maths:Radian"));
  turtle(400, "PUT", "/arm/angle", "no Turtle");
  turtle(412, "PUT", "/arm/angle", number_body("7", "maths:Degree"), "If-Match: \"never\"\n");
  turtle(412, "PUT", "/arm/count", number_body("7"), "If-Match: \"never\"\n");
  turtle(412, "PUT", "/arm/angle", number_body("7", "maths:Degree"), "If-None-Match: *\n");
  ask(415, "PUT /arm/angle\nContent-Type: image/png\n\nx");
  ask(415, "PUT /arm/angle\n\nx");
  ask(400, "PUT /arm/angle\nContent-Type: text/turtle\nContent-Range: bytes 0-1/2\n\nx");
  turtle(204, "POST", "/arm/actions/turn", number_body("9", "maths:Degree"));
  turtle(200, "POST", "/arm/actions/measure", "", "Prefer: return=representation\n");
  turtle(202, "POST", "/arm/actions/grip", number_body("5"), "Prefer: respond-async\n");
  turtle(422, "POST", "/arm/actions/turn", number_body("900", "maths:Degree"));
  turtle(409, "POST", "/arm/actions/refuse", "");
  turtle(500, "POST", "/arm/actions/fail", "");
  turtle(400, "POST", "/arm/actions/turn", "no Turtle");
  ask(500, "GET /arm/broken");
  ask(200, "GET /arm/state");  // of which that one is a part, and says why it is missing
  r.robot.locked = true;
  turtle(409, "PUT", "/arm/angle", number_body("7", "maths:Degree"));
  ask(409, "DELETE " + r.member);
  r.robot.locked = false;
  ask(204, "DELETE " + r.member);
  ask(204, "DELETE " + r.subscription);
  ask(204, "DELETE " + r.invocation);
  // A host that does not run its lambdas.
  const auto late = [&](const std::string& request) {
    const auto sent = r.bench.send(request);
    r.bench.clock.advance(std::chrono::seconds(5));
    all.push_back({request, 503, r.bench.answer(sent).value()});
    r.bench.run();
  };
  late("GET /arm/speed");
  late(Bench::turtle_request("PUT", "/arm/angle", number_body("3", "maths:Degree")));
  late(Bench::turtle_request("POST", "/arm/actions/turn", number_body("3", "maths:Degree")));
  late("GET /arm/speed\nUpgrade: callback\nCallback: http://127.0.0.1:9/r");
  ask(501, "BREW /arm/angle");
  {
    Robot stopping;
    const std::string slow = "GET /arm/speed", next = "GET " + subscriptions;
    const auto sent = stopping.bench.send(slow);
    stopping.bench.engine.stop();
    all.push_back({slow, 503, stopping.bench.answer(sent).value()});
    all.push_back({next, 503, stopping.bench.ask(next)});
  }
  {
    engine::EngineOptions few;
    few.subscriptions.max_subscriptions = 1;
    Robot full(few);
    all.push_back({"one subscription too many", 503, full.bench.turtle("POST", subscriptions, callback())});
  }
  return all;
}

const std::vector<Exchange>& answers() {
  static const std::vector<Exchange> all = every_answer();
  return all;
}

bool is_of_container(const std::string& request) {
  const std::string path = request.substr(request.find(' ') + 1, request.find_first_of(" \n?", request.find(' ') + 1) - request.find(' ') - 1);
  return path == "/" || path == waypoints || path == subscriptions;
}

std::set<int> statuses(const std::function<bool(const Exchange&)>& of) {
  std::set<int> found;
  for (const Exchange& e : answers())
    if (of(e)) found.insert(e.answer.status);
  return found;
}

// ------------------------------------------------------------------------------------------------------------------- the checks

void resource_links() {
  for (const Exchange& e : answers()) {
    INFO(shortened(e.request) << "\n" << e.answer.status << "\n" << e.answer.fields.block() << e.answer.body);
    CHECK(e.answer.status == e.expected);
    CHECK(e.answer.links_to(vocab::ldp::Resource.text, type));
  }
  CHECK(statuses([](const Exchange&) { return true; }) ==
        std::set<int>{101, 200, 201, 202, 204, 206, 304, 400, 403, 404, 405, 406, 409, 412, 413, 415, 416, 422, 426, 500, 501, 503});
}

void container_links() {
  for (const Exchange& e : answers()) {
    INFO(shortened(e.request) << "\n" << e.answer.status << "\n" << e.answer.fields.block());
    if (is_of_container(e.request)) CHECK(e.answer.links_to(vocab::ldp::BasicContainer.text, type));
    else if (e.request != "one subscription too many") CHECK_FALSE(e.answer.links_to(vocab::ldp::BasicContainer.text, type));
    else CHECK(e.answer.links_to(vocab::ldp::BasicContainer.text, type));
  }
  CHECK(statuses([](const Exchange& e) { return is_of_container(e.request) || e.expected == 503; }) ==
        std::set<int>{200, 201, 204, 206, 304, 400, 403, 404, 405, 406, 409, 412, 413, 415, 416, 422, 503});
}

void constraints_are_linked() {
  std::set<int> seen;
  Robot r;
  for (const Exchange& e : answers()) {
    const bool writes = e.request.compare(0, 4, "PUT ") == 0 || e.request.compare(0, 5, "POST ") == 0;
    if (!writes || e.answer.status < 400 || e.answer.status > 499) continue;
    INFO(shortened(e.request) << "\n" << e.answer.status << "\n" << e.answer.fields.block());
    const auto constraints = e.answer.linked(constrained_by);
    CHECK(constraints.size() == 1);
    for (const std::string& iri : constraints) CHECK(r.bench.get(Robot::path_of(iri)).status == 200);
    seen.insert(e.answer.status);
  }
  CHECK(seen == std::set<int>{400, 403, 405, 409, 412, 413, 415, 422});
}

void unknown_is_constrained() {
  Robot r;
  for (const Answer& a : {r.bench.turtle("PUT", "/arm/pose", "<> <http://localhost/unknown> 1 ."),
                          r.bench.turtle("POST", waypoints, "<> <http://localhost/unknown> 1 ."),
                          r.bench.turtle("POST", subscriptions, "<> <http://localhost/unknown> 1 .")}) {
    CHECK(a.status == 422);
    CHECK(a.says("sh:ValidationReport"));
    CHECK(a.links_to("http://localhost" + lrt::test::kind_of(r.bench, "/arm"), constrained_by));
  }
}

void created() {
  for (const std::string& container : {waypoints, subscriptions}) {
    Robot r;
    const Answer a = r.bench.turtle("POST", container, r.body_for(container));
    CHECK(a.status == 201);
    const std::string location = a.field("Location");
    CHECK(location.compare(0, here.size() + container.size() + 1, here + container + "/") == 0);
    CHECK(r.bench.get(Robot::path_of(location)).status == 200);
  }
}

void contained_after_post() {
  for (const std::string& container : {waypoints, subscriptions}) {
    Robot r;
    std::set<std::string> expected = r.contained(container);
    CHECK(expected.size() == 1);
    expected.insert(here + r.made(container, r.body_for(container)));
    CHECK(r.contained(container) == expected);
    for (const char* wrong : {"no Turtle", "<> a <http://localhost/elsewhere> .", ""}) CHECK(r.bench.turtle("POST", container, wrong).status >= 400);
    CHECK(r.bench.turtle("POST", container, r.body_for(container), "If-Match: \"never\"\n").status == 412);
    CHECK(r.contained(container) == expected);
    // The condition is about the container, and holds with its present tag.
    expected.insert(here + r.made(container, r.body_for(container), "If-Match: " + r.bench.get(container).tag() + "\n"));
    CHECK(r.contained(container) == expected);
  }
}

void models_that_cannot_be_had() {
  for (const std::string& container : {waypoints, subscriptions}) {
    Robot r;
    const auto before = r.contained(container);
    for (const char* model : {"Container", "BasicContainer", "DirectContainer", "IndirectContainer", "NonRDFSource"}) {
      const Answer a =
          r.bench.turtle("POST", container, r.body_for(container), "Link: <http://www.w3.org/ns/ldp#" + std::string(model) + ">; rel=\"type\"\n");
      CHECK(a.status == 409);
    }
    CHECK(r.contained(container) == before);
    for (const char* model : {"Resource", "RDFSource"}) {
      const std::string made =
          r.made(container, r.body_for(container), "Link: <http://www.w3.org/ns/ldp#" + std::string(model) + ">; rel=\"type\"\n");
      CHECK(r.bench.turtle("POST", made, r.body_for(container)).status == 405);
    }
  }
}

void models_of_members() {
  for (const std::string& container : {waypoints, subscriptions}) {
    Robot r;
    const Answer member = r.bench.get(r.made(container, r.body_for(container), "Link: <http://www.w3.org/ns/ldp#RDFSource>; rel=\"type\"\n"));
    CHECK(member.links_to(vocab::ldp::RDFSource.text, type));
    CHECK_FALSE(member.links_to(vocab::ldp::Container.text, type));
    CHECK_FALSE(member.links_to(vocab::ldp::BasicContainer.text, type));
  }
}

void turtle_is_accepted() {
  for (const std::string& container : {waypoints, subscriptions}) {
    Robot r;
    for (const char* media_type :
         {"text/turtle", "text/turtle; charset=utf-8", "text/turtle; charset=ISO-8859-1", "text/turtle;charset=us-ascii", "TEXT/TURTLE"}) {
      std::string request = Bench::turtle_request("POST", container, r.body_for(container));
      const std::string plain = "text/turtle";
      if (r.contained(container).size() == 3) r.bench.ask("DELETE " + Robot::path_of(*r.contained(container).begin()));
      CHECK(r.bench.ask(request.replace(request.find(plain), plain.size(), media_type)).status == 201);
    }
  }
}

void null_uri() {
  Robot r;
  const std::string member = r.made(waypoints, pose("44"));
  CHECK(missing(r.bench.get(member), "<" + here + member + "> a maths:Vector3D ; maths:x [ vom:numericalValue \"44\"^^xsd:double ] .") == "");
  const std::string subscription = r.made(subscriptions, callback("; lrt:queueLength 7"));
  CHECK(missing(r.bench.get(subscription),
                "<" + here + subscription + "> a hybrit:WebCallback ; lrt:queueLength 7 ; hybrit:onResource <arm/angle> .") == "");
}

void base_of_a_post() {  // SPEC 3.3
  Robot r;
  const std::string by_request =
      r.made(subscriptions, "<> a hybrit:WebCallback ; hybrit:onResource <angle> ; hybrit:callbackURL \"http://127.0.0.1:9/r\"^^xsd:anyURI .");
  CHECK(missing(r.bench.get(by_request), "<" + here + by_request + "> hybrit:onResource <" + here + "/arm/angle> .") == "");
}

void accept_post() {
  Robot r;
  for (const std::string& path : r.kinds) {
    INFO(path);
    const Answer get = r.bench.get(path), options = r.bench.ask("OPTIONS " + path);
    const bool posts = options.members("Allow").count("POST") == 1;
    CHECK(posts == (path == waypoints || path == subscriptions || path == "/arm/actions/turn"));
    CHECK((options.members("Accept-Post").count("text/turtle") == 1) == posts);
    CHECK(get.field("Accept-Post") == options.field("Accept-Post"));
  }
}

void gone_after_delete() {
  for (const std::string& container : {waypoints, subscriptions}) {
    Robot r;
    const std::string before = r.bench.get(container).tag();
    const auto members = r.contained(container);
    const std::string made = r.made(container, r.body_for(container));
    CHECK(r.bench.get(container).tag() != before);
    CHECK(r.bench.ask("DELETE " + made).status == 204);
    CHECK(r.contained(container) == members);
    CHECK(r.bench.get(container).tag() == before);
    CHECK(r.bench.get(made).status == 404);
  }
}

void json_ld_body() {
  for (const std::string& container : {waypoints, subscriptions}) {
    Robot r;
    const std::string body = rdf::write(turtle(r.body_for(container), here + container), rdf::Syntax::json_ld).value();
    const Answer a = r.bench.ask("POST " + container + "\nContent-Type: application/ld+json\n\n" + body);
    CHECK(a.status == 201);
    CHECK(r.bench.get(a.field("Location").substr(here.size())).status == 200);
  }
}

void http_1_1() {
  Options options;
  options.listen.port = 0;
  options.threads.io = Io::in_poll;
  Server server = Server::create(std::move(options)).value();
  SampleRobot robot;
  server.add(robot.arm()).value();
  Socket socket(server.port());
  for (int i = 0; i < 2; ++i) {  // on one connection
    const Answer a = socket.ask("GET " + subscriptions + "\nHost: 127.0.0.1:" + std::to_string(server.port()), [&] { server.poll(); });
    CHECK(a.status == 200);
    CHECK(a.has("Date"));
    CHECK(a.field("Content-Length") == std::to_string(a.body.size()));
  }
}

void tags_of_get() {
  Robot r;
  for (const std::string& path : r.kinds) {
    INFO(path);
    const std::string tag = r.bench.get(path).tag();
    REQUIRE(tag.size() > 2);
    CHECK((tag.front() == '"' && tag.back() == '"'));
  }
}

void tags_of_head() {
  Robot r;
  for (const std::string& path : r.kinds) {
    INFO(path);
    std::set<std::string> tags;
    for (const char* media_type : {"text/turtle", "application/n-triples", "application/rdf+xml"}) {
      const Answer head = r.bench.ask("HEAD " + path + "\nAccept: " + media_type), get = r.bench.ask("GET " + path + "\nAccept: " + media_type);
      CHECK(get.field("Content-Type").substr(0, get.field("Content-Type").find(';')) == media_type);
      CHECK(head.tag() == get.tag());
      CHECK(get.members("Vary").count("Accept") == 1);
      tags.insert(get.tag());
    }
    CHECK(tags.size() == 3);
  }
}

void get_answers() {
  Robot r;
  for (const std::string& path : r.kinds) {
    INFO(path);
    CHECK(r.bench.get(path).status == 200);
  }
}

void head_answers() {
  Robot r;
  for (const std::string& path : r.kinds) {
    INFO(path);
    const Answer head = r.bench.ask("HEAD " + path), get = r.bench.get(path);
    CHECK(head.status == 200);
    CHECK(head.fields.block() == get.fields.block());
  }
}

void options_on_get() {
  Robot r;
  for (const std::string& path : r.kinds) {
    INFO(path);
    const Answer options = r.bench.ask("OPTIONS " + path);
    for (const char* method : {"GET ", "HEAD "}) {
      const Answer a = r.bench.ask(method + path);
      CHECK(a.field("Allow") == options.field("Allow"));
      CHECK(a.field("Accept-Post") == options.field("Accept-Post"));
    }
  }
}

void options_answers() {
  Robot r;
  for (const std::string& path : r.kinds) {
    INFO(path);
    CHECK(r.bench.ask("OPTIONS " + path).status == 204);
  }
}

void options_allow() {
  Robot r;
  for (const std::string& path : r.kinds) {
    const std::string allow = r.bench.ask("OPTIONS " + path).field("Allow");
    const auto allowed = r.bench.ask("OPTIONS " + path).members("Allow");
    INFO(path << ": " << allow);
    for (const char* method : {"GET", "HEAD", "OPTIONS"}) CHECK(allowed.count(method) == 1);
    for (const std::string method : {"PUT", "POST", "DELETE", "PATCH"}) {
      if (allowed.count(method) == 1) continue;
      const Answer refused = r.bench.ask(method + " " + path);
      CHECK(refused.status == 405);
      CHECK(refused.field("Allow") == allow);
    }
  }
}

void no_patch() {
  Robot r;
  for (const std::string& path : r.kinds) {
    INFO(path);
    const Answer options = r.bench.ask("OPTIONS " + path);
    CHECK(options.members("Allow").count("PATCH") == 0);
    CHECK_FALSE(options.has("Accept-Patch"));
    CHECK(r.bench.ask("PATCH " + path).status == 405);
  }
}

void put_with_an_old_tag() {
  for (const char* path : {"/arm/angle", "/arm/count"}) {  // pushed, pulled
    Robot r;
    const std::string unit = path == std::string("/arm/angle") ? "maths:Degree" : "";
    const std::string old = r.bench.get(path).tag();
    CHECK(r.bench.turtle("PUT", path, number_body("5", unit), "If-Match: " + old + "\n").status == 204);
    const std::string now = r.bench.get(path).tag();
    CHECK(now != old);
    CHECK(r.bench.turtle("PUT", path, number_body("6", unit), "If-Match: " + old + "\n").status == 412);
    CHECK(r.bench.get(path).tag() == now);
    CHECK(r.bench.turtle("PUT", path, number_body("6", unit), "If-Match: " + now + "\n").status == 204);
  }
}

void put_with_a_bad_tag() {
  for (const char* path : {"/arm/angle", "/arm/count"}) {
    Robot r;
    const std::string unit = path == std::string("/arm/angle") ? "maths:Degree" : "";
    const std::string tag = r.bench.get(path).tag();
    CHECK(r.bench.turtle("PUT", path, number_body("5", unit), "If-Match: \"bad\"\n").status == 412);
    CHECK(r.bench.turtle("PUT", path, number_body("5", unit), "If-Match: W/" + tag + "\n").status == 412);  // RFC 9110 13.1.1: the strong comparison
    CHECK(r.bench.turtle("PUT", path, number_body("5", unit), "If-Match: no tag\n").status == 400);
    CHECK(r.bench.turtle("PUT", path, number_body("5", unit), "If-Match: \"with spaces, as the suite\"\n").status == 412);
    CHECK(r.bench.get(path).tag() == tag);
  }
}

void put_without_a_tag() {
  Robot r;
  CHECK(r.bench.turtle("PUT", "/arm/angle", number_body("5", "maths:Degree")).status == 204);
  CHECK(r.robot.angle == 5);
}

void base_of_a_put() {
  Robot r;
  // <../ns/vocabulary#Pose/frame> is the server's term below /arm/pose; below anything else it is nobody's and the shape refuses it.
  const std::string relative =
      "<> a maths:Vector3D ; maths:x [ vom:numericalValue 3 ; qudt:hasUnit unit:M ] ; maths:y [ vom:numericalValue 2 ; qudt:hasUnit unit:M ] ;"
      " <../ns/vocabulary#Pose/frame> \"wrist\" .";
  const Answer a = r.bench.turtle("PUT", "/arm/pose", relative);
  INFO(a.body);
  CHECK(a.status == 204);
  CHECK(r.robot.pose.frame == "wrist");
}

void put_replaces() {
  Robot r;
  CHECK(r.bench.turtle("PUT", "/arm/pose", pose("1", "; <http://localhost/ns/vocabulary#Pose/tolerance> 0.5")).status == 204);
  CHECK(r.robot.pose.tolerance);
  CHECK(r.bench.turtle("PUT", "/arm/pose", pose("2")).status == 204);
  CHECK_FALSE(r.robot.pose.tolerance);
  CHECK_FALSE(r.bench.get("/arm/pose").says("tolerance"));
}

void put_what_get_gave() {
  Robot r;
  for (const auto& [path, before, after] : {std::tuple("/arm/angle", "10", "12"), std::tuple("/arm/count", "7", "9")}) {
    std::string body = r.bench.get(path).body;
    const std::string value = "vom:numericalValue ";
    const std::size_t at = body.find(value);
    REQUIRE(at != std::string::npos);
    const std::size_t number = body.find(before, at);
    REQUIRE(number != std::string::npos);
    body.replace(number, std::string(before).size(), after);
    CHECK(r.bench.ask(std::string("PUT ") + path + "\nContent-Type: text/turtle\n\n" + body).status == 204);
  }
  CHECK(r.robot.angle == 12);
  CHECK(r.robot.count == 9);
}

void is_rdf() {
  Robot r;
  for (const std::string& path : r.kinds) {
    for (const char* media_type : {"text/turtle", "application/n-triples", "application/rdf+xml"}) {
      INFO(path << " as " << media_type);
      const rdf::Graph graph = r.bench.ask("GET " + path + "\nAccept: " + media_type).graph();
      const auto self = graph.find(rdf::iri(here + path));
      const auto about = path == "/arm/tool/state" ? graph.find(rdf::iri(here + "/arm/tool")) : self;  // the state is the thing's
      REQUIRE((self && about));
      CHECK_FALSE(graph.match(*about, std::nullopt, std::nullopt).empty());
    }
  }
}

void all_is_said() {
  Robot r;
  CHECK(missing(r.bench.get("/"), "<> a ldp:BasicContainer, ldp:Container ; ldp:contains <arm> . <arm> a hybrit:RoboticThing .") == "");
  CHECK(missing(r.bench.get(subscriptions), "<arm/subscriptions> a ldp:BasicContainer, ldp:Container ; ldp:contains <" + here + r.subscription +
                                                "> . <" + here + r.subscription + "> a hybrit:Subscription .") == "");
  CHECK(missing(r.bench.get(waypoints), "<arm/waypoints> a ldp:BasicContainer, ldp:Container ; ldp:contains <" + here + r.member + "> . <" + here +
                                            r.member + "> a ldp:RDFSource .") == "");
  CHECK(missing(r.bench.get(r.subscription), "<" + here + r.subscription + "> a hybrit:Subscription, hybrit:WebCallback .") == "");
}

void turtle_is_had() {
  Robot r;
  for (const std::string& path : r.kinds) {
    INFO(path);
    const Answer asked = r.bench.ask("GET " + path + "\nAccept: text/turtle"), open = r.bench.get(path);
    CHECK(asked.field("Content-Type") == "text/turtle");
    CHECK(open.field("Content-Type") == "text/turtle");
    CHECK(asked.body == open.body);
    CHECK(missing(asked.graph(), open.graph()) == "");
  }
}

void json_ld() {
  Robot r;
  for (const std::string& path : r.kinds) {
    INFO(path);
    const Answer alone = r.bench.ask("GET " + path + "\nAccept: application/ld+json");
    CHECK(alone.field("Content-Type") == "application/ld+json");
    CHECK(rdf::isomorphic(alone.graph(), r.bench.get(path).graph()));
    CHECK(r.bench.ask("GET " + path + "\nAccept: application/ld+json, text/turtle;q=0.5").body == alone.body);
  }
}

void servers_own_triples_are_ignored() {  // SPEC 3.3
  Robot r;
  CHECK(r.bench.turtle("PUT", "/arm/angle", number_body("5", "maths:Degree") + " <> dcterms:modified \"1999-01-01T00:00:00Z\"^^xsd:dateTime .")
            .status == 204);
  CHECK_FALSE(r.bench.get("/arm/angle").says("1999"));
  CHECK(r.robot.angle == 5);
}

void other_triples_are_ignored() {  // SPEC 3.3
  Robot r;
  CHECK(r.bench.turtle("PUT", "/arm/angle", number_body("5", "maths:Degree") + " <> <http://localhost/unknown> 1 .").status == 204);
  CHECK_FALSE(r.bench.get("/arm/angle").says("unknown"));
}

void rdf_sources() { get_answers(), is_rdf(), turtle_is_had(), all_is_said(); }
void containers() { container_links(), created(), contained_after_post(), gone_after_delete(), null_uri(), accept_post(), models_of_members(); }
void resources() { resource_links(), tags_of_get(), head_answers(), options_on_get(), options_allow(), put_with_an_old_tag(); }

const std::map<std::string, std::function<void()>> checks = {
    {"BasicContainerTest testConformsBcLdpContainer", containers},
    {"BasicContainerTest testContainerSupportsHttpLinkHeader", container_links},
    {"CommonContainerTest testRelativeUriResolutionPost", base_of_a_post},
    {"CommonContainerTest testPostResponseStatusAndLocation", created},
    {"CommonContainerTest testPostContainer", contained_after_post},
    {"CommonContainerTest testRequestedInteractionModelCreateNotAllowed", models_that_cannot_be_had},
    {"CommonContainerTest testRequestedInteractionModelHeaders", models_of_members},
    {"CommonContainerTest testAcceptTurtle", turtle_is_accepted},
    {"CommonContainerTest testNullRelativeUriPost", null_uri},
    {"CommonContainerTest testAcceptPostResponseHeader", accept_post},
    {"CommonContainerTest testDeleteRemovesContainmentTriple", gone_after_delete},
    {"CommonContainerTest testPostJsonLd", json_ld_body},
    {"CommonContainerTest testConformsContainerRdfResource", rdf_sources},
    {"CommonResourceTest testIsHttp11Manual", http_1_1},
    {"CommonResourceTest testETagHeadersGet", tags_of_get},
    {"CommonResourceTest testETagHeadersHead", tags_of_head},
    {"CommonResourceTest testLdpLinkHeader", resource_links},
    {"CommonResourceTest testGetResource", get_answers},
    {"CommonResourceTest testGetResponseHeaders", options_on_get},
    {"CommonResourceTest testConditionFailedStatusCode", put_with_an_old_tag},
    {"CommonResourceTest testPreconditionRequiredStatusCode", put_without_a_tag},
    {"CommonResourceTest testPutBadETag", put_with_a_bad_tag},
    {"CommonResourceTest testHead", head_answers},
    {"CommonResourceTest testAcceptPatchHeader", no_patch},
    {"CommonResourceTest testOptions", options_answers},
    {"CommonResourceTest testOptionsAllowHeader", options_allow},
    {"RdfSourceTest testRelativeUriResolutionPut", base_of_a_put},
    {"RdfSourceTest testPutReplacesResource", put_replaces},
    {"RdfSourceTest testPutSimpleUpdate", put_what_get_gave},
    {"RdfSourceTest testGetResource", is_rdf},
    {"RdfSourceTest testRestrictClientInference", all_is_said},
    {"RdfSourceTest testGetResourceAcceptTurtle", turtle_is_had},
    {"RdfSourceTest testJsonLdRepresentation", json_ld},
    {"RdfSourceTest testPublishConstraintsReadOnlyProp", constraints_are_linked},
    {"RdfSourceTest testPublishConstraintsUnknownProp", unknown_is_constrained},
    {"RdfSourceTest testPutReadOnlyProperties4xxStatus", servers_own_triples_are_ignored},
    {"RdfSourceTest testPutPropertiesNotPersisted", other_triples_are_ignored},
    {"RdfSourceTest testConformsRdfSourceLdpResource", resources},
};

struct Row {
  std::string name;    ///< GROUP TEST
  std::string anchor;  ///< of the specification
  bool passed = false;
};

std::vector<Row> rows() {
  std::ifstream in(LRT_SOURCE_DIR "/tests/conformance/ldp_musts.txt");
  REQUIRE(in);
  std::vector<Row> all;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    INFO(line);
    std::istringstream words(line);
    std::string group, test, anchor, bar, rest;
    words >> group >> test >> anchor >> bar;
    std::getline(words, rest);
    const std::string passed = " passed by: ", not_ours = " does not apply: ";
    const bool is_passed = rest.compare(0, passed.size(), passed) == 0, is_not_ours = rest.compare(0, not_ours.size(), not_ours) == 0;
    REQUIRE(bar == "|");
    REQUIRE(is_passed != is_not_ours);
    REQUIRE(rest.size() > not_ours.size() + 5);
    all.push_back({group + " " + test, anchor, is_passed});
  }
  return all;
}

}  // namespace

TEST_CASE("what ldp_musts.txt says we pass, we pass", "[conformance][LDP][R0.4][SPEC 3.5]") {
  std::set<std::string> named;
  for (const Row& row : rows()) {
    named.insert(row.name);
    const auto check = checks.find(row.name);
    if (check == checks.end() && row.passed) FAIL("there is no check " << row.name);
    if (check == checks.end()) continue;
    DYNAMIC_SECTION(row.name) { check->second(); }
  }
  for (const auto& [name, check] : checks) {
    INFO(name << " is not in ldp_musts.txt");
    CHECK(named.count(name) == 1);
  }
}

TEST_CASE("ldp_musts.txt names every MUST of the W3C suite's list, and nothing else", "[conformance][LDP]") {
  const std::string path = LRT_SHARED_DIR "/suites/ldp-musts.tsv";
  std::ifstream in(path);
  if (!in) {
    print_skip("there is no " + path);
    return;
  }
  const std::set<std::string> groups = {"BasicContainerTest", "CommonContainerTest", "CommonResourceTest", "RdfSourceTest"};
  std::set<std::string> theirs, ours;
  for (std::string line; std::getline(in, line);) {
    std::istringstream columns(line);
    std::string group, level, kind, test, anchor;
    for (std::string* column : {&group, &level, &kind, &test, &anchor}) std::getline(columns, *column, '\t');
    if (level == "MUST" && groups.count(group) == 1) theirs.insert(group + " " + test + " " + anchor);
  }
  REQUIRE(theirs.size() > 30);
  for (const Row& row : rows()) CHECK(ours.insert(row.name + " " + row.anchor).second);
  for (const std::string& row : theirs) {
    INFO("missing in ldp_musts.txt: " << row);
    CHECK(ours.count(row) == 1);
  }
  for (const std::string& row : ours) {
    INFO("not in the suite: " << row);
    CHECK(theirs.count(row) == 1);
  }
}

// SPDX-License-Identifier: Apache-2.0
// What is hidden from a client against what is not there: two robots that differ in hidden resources only, and the responses of both, byte for byte.
#include <lrt/server.hpp>

#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include <lrt/served.hpp>
#include <lrt/transport/loopback.hpp>
#include <lrt/transport/named.hpp>
#include <lrt/world.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/message.hpp"
#include "tests/support/rights_matrix.hpp"
#include "tests/support/socket.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

constexpr const char* base = "http://robot.example";
constexpr Iri label = vocab::rdfs::label;

/// Ids that depend on the request, not on how many resources there are.
class NumberedIds final : public IdSource {
 public:
  std::string next() override { return last_ < 0 ? "set-up" : "id" + std::to_string(last_++); }
  void begin(int request) { last_ = request * 100; }

 private:
  std::atomic<int> last_{-1};
};

struct VeiledPose {
  double veiled_x = 1;
};

}  // namespace

template <>
struct lrt::rdf::traits<VeiledPose> : lrt::rdf::Record<VeiledPose> {
  static void describe(Record<VeiledPose>& r) { r.field("veiled_x", &VeiledPose::veiled_x); }
};

namespace {

/// A robot whose hidden parts have "veiled" in their names. bert may do everything with all the rest, rita may read it, and anna may do everything.
class Robot {
 public:
  enum class Veileds { none, all };
  /// @param transport  empty: requests by serve()
  explicit Robot(Veileds veileds, const std::string& transport = "") {
    Options options;
    options.listen.port = 0;
    options.listen.public_base = base;
    options.threads.dispatch = Dispatch::io_thread;
    options.callbacks.allow = {"127.0.0.1"};
    options.ids = ids;
    options.clock = &clock;
    if (transport.empty()) options.listen.transport = transport::no_network;
    else options.listen.transport = [transport](transport::TransportOptions t) { return transport::make_named(transport, std::move(t)); };
    options.security.authenticate = [](const http::Request& request) -> std::optional<security::Principal> {
      const auto who = request.find("Authorization");
      return who ? std::optional(security::Principal{std::string(who->substr(7)), {}}) : std::nullopt;
    };
    using security::Right;
    const auto may = [&](const std::string& path, const char* who, security::Rights rights) {
      options.security.rules.push_back({path, security::Scope::tree, {security::Who::Kind::principal, who}, rights});
    };
    may("/", "anna", security::Rights::all());
    may("/", "bert", Right::read | Right::write | Right::invoke | Right::subscribe);
    may("/", "rita", Right::read | Right::subscribe);
    for (const std::string& path : hidden()) may(path, "anna", security::Rights::all());
    may("/veiled_place/lamp", "bert", Right::read | Right::subscribe);
    may("/veiled_place/lamp", "rita", Right::read | Right::subscribe);
    server.emplace(Server::create(std::move(options)).value());
    const bool is_whole = veileds == Veileds::all;

    std::vector<Thing> things;
    const auto weight = [](const char* path) {
      Thing thing{path};
      thing.title("a weight").property("weight", [] { return 3.0; }).between(0, 10);
      return thing;
    };
    if (is_whole) {
      // Of the kind that visible Things have, and registered before them.
      things.push_back(weight("veiled_twin"));
      Thing place = weight("veiled_place");
      place.property("veiled_size", [] { return 1.0; });
      place.action("veiled_halt", [] {}).stop([] { return false; });
      things.push_back(std::move(place));
    }
    things.push_back(weight("twin"));
    things.push_back(weight("veiled_place/lamp"));
    Thing arm{"arm"};
    arm.title("An arm");
    arm.property("angle", [] { return 0.5; }).between(-1, 1).on_write([](double) {});
    if (is_whole) {
      arm.property("veiled_angle", [] { return 1.0; }).between(-2, 2).on_write([](double) {});
      arm.property("veiled_pose", [] { return VeiledPose(); });
      arm.action("veiled_turn", [](double) {});
      arm.collection<double>("veiled_list").on_create([](const double&) { return Result<void>(); });
      arm.add(Iri("p:near"), Object::resource("veiled_twin"));
      arm.shapes("@prefix sh: <http://www.w3.org/ns/shacl#> . <#veiled_angle> a sh:NodeShape ; sh:name \"veiled words\" .");
    }
    arm.add(Iri("p:near"), Object::resource("twin"));
    arm.add(Iri("p:beside"), Object::resource("veiled_twin"));  // hidden, and not there
    Action turn = arm.action("turn", [](double) {});
    if (is_whole) turn.effect("arm/veiled_pose").composed_of("arm/actions/veiled_turn");
    if (is_whole) {
      const auto pressure = arm.property("veiled_pressure", [] { return 1.0; });
      arm.action("press", [] {}).effect(pressure, 777888).effect("arm/angle");
    } else {
      arm.action("press", [] {}).effect("arm/angle");
    }
    arm.collection<double>("list").on_create([](const double&) { return Result<void>(); });
    things.push_back(std::move(arm));
    if (is_whole) things.push_back(weight("arm/veiled_tool"));
    server->add(std::move(things)).value();

    WorldOptions world_options;
    world_options.clients_may_create = true;
    World world("world", world_options);
    GraphOptions written;
    written.clients_may_write = true;
    WorldGraph map = world.graph("map", written);
    if (is_whole) {
      GraphOptions ruled = written;
      ruled.shapes =
          "@prefix sh: <http://www.w3.org/ns/shacl#> . <#VeiledShape> a sh:NodeShape ; sh:targetClass <p:Veiled> ; sh:property [ sh:path "
          "<p:veiled> ; sh:maxCount 777888 ] .";
      ruled.max_bytes = 3'333'333'333;
      world.graph("veiled", ruled);
      world.graph("veiled_fixed/plan");
    }
    server->add(std::move(world)).value();
    map.update([](GraphUpdate& u) { u.add("#cup", label, "a cup"); }).value();
    // Its only graph that clients may write is hidden.
    World shelf("shelf");
    shelf.graph("books");
    if (is_whole) shelf.graph("veiled_books", written);
    server->add(std::move(shelf)).value();
  }

  static std::vector<std::string> hidden() {
    return {"/veiled_twin",         "/veiled_place",    "/arm/veiled_angle", "/arm/veiled_pose",    "/arm/actions/veiled_turn", "/arm/veiled_list",
            "/arm/veiled_pressure", "/arm/veiled_tool", "/world/veiled",     "/world/veiled_fixed", "/shelf/veiled_books"};
  }

  /// Status, header section and body as one text.
  std::string ask(const std::string& text, const std::string& who, int number = 1) {
    ids->begin(number);
    const std::size_t body = std::min(text.find("\n\n"), text.size());
    const std::string whole = text.substr(0, body) + "\nHost: robot.example\nAuthorization: Bearer " + who + text.substr(body);
    if (server->port() != 0) {
      const Answer answer = Socket(server->port()).ask(whole);
      return text_of(answer.status, answer.fields, answer.body);
    }
    RequestText request(whole);
    request.get().can_stream = true;
    const http::Response response = server->serve(request.get()).response;
    return text_of(response.status, response.fields, std::string(response.content()));
  }

  const std::shared_ptr<NumberedIds> ids = std::make_shared<NumberedIds>();
  FakeClock clock;
  std::optional<Server> server;

 private:
  static std::string text_of(int status, const http::Fields& fields, const std::string& body) {
    std::string text = std::to_string(status) + "\n";
    std::string_view block = fields.block();
    while (!block.empty()) {
      const std::size_t end = std::min(block.find('\n'), block.size() - 1) + 1;
      const std::string_view line = block.substr(0, end);
      block.remove_prefix(end);
      const std::string_view name = line.substr(0, line.find(':'));
      if (!http::iequals(name, "Date") && !http::iequals(name, "Robot-Time")) text += line;  // which names the run
    }
    return text + "\n" + body;
  }
};

const std::vector<std::string> types = {"text/turtle",         "application/json",    "application/trig",
                                        "application/n-quads", "application/ld+json", "application/n-triples",
                                        "application/rdf+xml", "text/html",           "application/cbor"};

/// The paths that occur in a text.
std::set<std::string> paths_in(const std::string& text) {
  const std::string prefix = std::string(base) + "/";
  std::set<std::string> found;
  for (std::size_t at = text.find(prefix); at != std::string::npos; at = text.find(prefix, at + 1)) {
    const std::size_t begin = at + prefix.size() - 1;
    found.insert(text.substr(begin, text.find_first_of("<>\"? #\r\n\\", begin) - begin));
  }
  return found;
}

/// All that a caller gets by following every link, in every format.
std::map<std::string, std::string> crawl(Robot& robot, const std::string& who) {
  std::map<std::string, std::string> seen;
  std::vector<std::string> open = {"/", "/.well-known/void"};
  while (!open.empty()) {
    const std::string path = open.back();
    open.pop_back();
    if (!seen.emplace(path, "").second) continue;
    std::string all = robot.ask("OPTIONS " + path, who);
    for (const std::string& type : types) all += "---- " + type + "\n" + robot.ask("GET " + path + "\nAccept: " + type, who);
    for (const std::string& next : paths_in(all)) open.push_back(next);
    seen[path] = all;
  }
  return seen;
}

/// Where two texts begin to differ, with what is around; empty: they are equal.
std::string difference(const std::string& a, const std::string& b) {
  std::size_t at = 0;
  while (at < a.size() && at < b.size() && a[at] == b[at]) ++at;
  if (at == a.size() && at == b.size()) return {};
  const std::size_t begin = at < 300 ? 0 : at - 300;
  return "\n<<< with\n" + a.substr(begin, 600) + "\n>>> without\n" + b.substr(begin, 600);
}

/// Requests for a path, in all kinds.
std::vector<std::string> requests_for(const std::string& path, bool short_form = false) {
  const std::string graph = "\nContent-Type: text/turtle\n\n<#x> <p:q> 1 .", number = "\nContent-Type: application/json\n\n5",
                    update = "\nContent-Type: application/sparql-update\n\nINSERT DATA { <#x> <p:q> 2 }",
                    merge = "\nContent-Type: application/merge-patch+json\n\n5", quads = "\nContent-Type: application/trig\n\n";
  std::vector<std::string> all;
  const std::vector<std::string> methods = {"GET", "HEAD", "OPTIONS", "PUT", "POST", "PATCH", "DELETE", "BREW"};
  for (const std::string& method : methods) {
    all.push_back(method + " " + path);
    if (short_form) continue;
    for (const char* query : {"?links=1", "?links=x", "?page=2", "?q=x", "?accept=text/turtle", "?default", "?graph=x"})
      all.push_back(method + " " + path + query);
    for (const char* fields :
         {"If-Match: \"x\"", "If-Match: *", "If-None-Match: *", "If-None-Match: \"x\"", "Prefer: return=representation", "Prefer: respond-async",
          "Link: <http://www.w3.org/ns/ldp#DirectContainer>; rel=\"type\"", "Range: bytes=0-3", "Accept: text/event-stream", "Take-Over: ?1",
          "Accept: nothing/here", "Upgrade: callback\nConnection: Upgrade\nCallback: http://127.0.0.1:9/"})
      all.push_back(method + " " + path + "\n" + fields);
    for (const std::string& type : types) all.push_back(method + " " + path + "\nAccept: " + type);
  }
  for (const char* method : {"PUT", "POST", "PATCH", "DELETE"})
    for (const std::string& body : {graph, number, update, merge, quads, std::string("\nContent-Type: text/turtle\n\n<broken")})
      for (const char* condition : {"", "\nIf-None-Match: *", "\nIf-Match: *"})
        if (!short_form || *condition == '\0') all.push_back(std::string(method) + " " + path + condition + body);
  const auto named = [&](const std::string& store) { return store + "?graph=" + base + path; };
  for (const char* store : {"/world", "/shelf"}) {
    for (const std::string& method : methods) all.push_back(method + " " + named(store));
    for (const char* method : {"PUT", "POST", "PATCH"})
      for (const std::string& body : {graph, update}) all.push_back(std::string(method) + " " + named(store) + body);
    for (const char* method : {"PUT", "POST"})
      all.push_back(std::string(method) + " " + store + "\nContent-Type: application/trig\n\n<" + base + path + "> { <#x> <p:q> 1 }");
  }
  all.push_back(
      "POST /arm/subscriptions\nContent-Type: text/turtle\n\n@prefix h: <https://hybr-it-projekt.de/ns/hybr-it#> . [] a h:Subscription ; "
      "h:onResource <" +
      std::string(base) + path + "> ; h:callbackURL \"http://127.0.0.1:9/\" .");
  // What comes back of a graph, and of a value.
  all.push_back("PATCH /world/map\nContent-Type: application/sparql-update\n\nINSERT DATA { <#x> <p:q> <" + std::string(base) + path + "> . <" +
                std::string(base) + path + "> <p:q> [ <p:r> 1 ] }");
  for (const char* type : {"text/turtle", "application/n-triples", "application/trig"}) {
    all.push_back(std::string("GET /world/map\nAccept: ") + type);
    all.push_back(std::string("GET /world?default\nAccept: ") + type);
  }
  all.push_back("PUT /world/map\nContent-Type: text/turtle\n\n<#cup> <" + std::string(label.text) + "> \"a cup\" .");
  return all;
}

/// Paths of hidden resources, of lrt's resources below them, and of what a client might make there.
std::vector<std::string> probed_paths() {
  return {"/veiled_twin",
          "/veiled_twin/state",
          "/veiled_twin/weight",
          "/veiled_place",
          "/veiled_place/all",
          "/veiled_place/subscriptions",
          "/veiled_place/veiled_size",
          "/arm/veiled_angle",
          "/arm/veiled_pose",
          "/arm/actions/veiled_turn",
          "/arm/veiled_list",
          "/arm/veiled_tool",
          "/arm/veiled_tool/blueprint",
          "/world/veiled",
          "/world/veiled/below",
          "/world/veiled_fixed/plan",
          "/world/veiled_fixed/plan/below",
          "/shelf/veiled_books"};
}

}  // namespace

TEST_CASE("visible documents are those of a robot without what is hidden", "[server][security][R0.2]") {
  Robot with(Robot::Veileds::all), without(Robot::Veileds::none);
  const auto everything = crawl(with, "anna");
  for (const std::string& path : Robot::hidden()) {
    if (path == "/world/veiled_fixed") continue;  // a folder
    CAPTURE(path);
    CHECK(everything.count(path) == 1);
  }
  CHECK(everything.at("/arm/actions/press").find("777888") != std::string::npos);
  CHECK(everything.at("/world/blueprint").find("777888") != std::string::npos);
  for (const char* who : {"bert", "rita"}) {
    const auto a = crawl(with, who), b = crawl(without, who);
    for (const char* path :
         {"/arm", "/arm/angle", "/arm/state", "/arm/actions/press", "/twin", "/veiled_place/lamp", "/world", "/world/map", "/shelf", "/all"}) {
      CAPTURE(path);
      CHECK(a.count(path) == 1);
    }
    for (const auto& [path, text] : a) {
      CAPTURE(who, path);
      const auto other = b.find(path);
      CHECK(other != b.end());
      if (other != b.end()) CHECK(difference(text, other->second) == "");
      CHECK(text.find("777888") == std::string::npos);
      if (path.compare(0, 13, "/veiled_place") == 0) continue;
      for (std::size_t at = text.find("veiled"); at != std::string::npos; at = text.find("veiled", at + 1))
        CHECK(text.substr(at, 17) == "veiled_place/lamp");
    }
    CHECK(a.size() == b.size());
  }
}

TEST_CASE("what is hidden cannot be told from what is not there, not even by clients that may create", "[server][security][R0.2]") {
  for (const char* who : {"bert", "rita", "nobody"})
    for (const std::string& path : probed_paths()) {
      Robot with(Robot::Veileds::all), without(Robot::Veileds::none);
      int number = 1;
      for (const std::string& request : requests_for(path, who != std::string_view("bert"))) {
        CAPTURE(who, request);
        ++number;
        const std::string a = with.ask(request, who, number), b = without.ask(request, who, number);
        if (a != b) CHECK(difference(a, b) == "");
      }
    }
}

TEST_CASE("a path without a resource has one response, whether its name is hidden, free or nobody's", "[server][security][R0.2]") {
  Robot robot(Robot::Veileds::all);
  const auto without = [](std::string text, const std::string& path) {
    for (std::size_t at = text.find(path); at != std::string::npos; at = text.find(path)) text.replace(at, path.size(), "PATH");
    return text;
  };
  // Who may create has 201 where it may read and write, and what it may not read is not there.
  for (const auto& [who, hidden, absent] :
       {std::tuple("rita", "/world/veiled", "/world/other"), std::tuple("rita", "/arm/veiled_angle", "/arm/other"),
        std::tuple("bert", "/world/veiled", "/world/veiled_fixed/other"), std::tuple("bert", "/shelf/veiled_books", "/shelf/other"),
        std::tuple("bert", "/arm/veiled_angle", "/arm/other"), std::tuple("nobody", "/world/veiled", "/world/other")})
    for (const char* method : {"GET", "HEAD", "OPTIONS", "PUT", "POST", "PATCH", "DELETE"})
      for (const char* body :
           {"", "\nContent-Type: text/turtle\n\n<#x> <p:q> 1 .", "\nContent-Type: application/sparql-update\n\nINSERT DATA { <#x> <p:q> 2 }"}) {
        CAPTURE(who, method, hidden, absent, body);
        const std::string line = std::string(method) + " ";
        CHECK(without(robot.ask(line + hidden + body, who), hidden) == without(robot.ask(line + absent + body, who), absent));
      }
  CHECK(robot.ask("PUT /world/veiled_new\nContent-Type: text/turtle\n\n<#x> <p:q> 1 .", "bert").substr(0, 3) == "201");
  CHECK(robot.ask("PUT /world/veiled/new\nContent-Type: text/turtle\n\n<#x> <p:q> 1 .", "anna", 2).substr(0, 3) == "404");  // below a graph
}

TEST_CASE("who writes a graph gets all of it back, whatever its triples name", "[server][security][R0.2]") {
  Robot robot(Robot::Veileds::all);
  const std::string triples =
      "<http://robot.example/world/map#x> <p:q> <http://robot.example/arm/veiled_angle> .\n"
      "<http://robot.example/veiled_twin> <p:q> <http://robot.example/arm/nothing> .\n";
  REQUIRE(robot.ask("PUT /world/map\nContent-Type: application/n-triples\n\n" + triples, "bert").substr(0, 3) == "204");
  for (const char* who : {"bert", "rita", "anna"})
    for (const char* path : {"/world/map", "/world?default"}) {
      CAPTURE(who, path);
      const std::string seen = robot.ask(std::string("GET ") + path + "\nAccept: application/n-triples", who);
      for (const char* line :
           {"/world/map#x> <p:q> <http://robot.example/arm/veiled_angle>", "/veiled_twin> <p:q> <http://robot.example/arm/nothing>"})
        CHECK(seen.find(line) != std::string::npos);
    }
  CHECK(robot.ask("PUT /world/map\nContent-Type: application/n-triples\n\n" + triples, "bert", 2).substr(0, 3) == "204");
}

TEST_CASE("hidden and absent are the same on each transport", "[server][security][R0.2]") {
  for (const std::string_view transport : transport::names()) {
    CAPTURE(transport);
    Robot with(Robot::Veileds::all, std::string(transport)), without(Robot::Veileds::none, std::string(transport));
    int number = 1;
    for (const char* path : {"/arm/veiled_angle", "/arm/actions/veiled_turn", "/world/veiled", "/world/veiled/below"})
      for (const std::string& request : requests_for(path, true)) {
        CAPTURE(request);
        ++number;
        const std::string a = with.ask(request, "bert", number), b = without.ask(request, "bert", number);
        CHECK(difference(a, b) == "");
      }
  }
}

TEST_CASE("Blueprints get other names when rules are loaded that hide the Thing which they are named after", "[server][security][R0.2]") {
  const Rulebook book;
  FakeClock clock;
  const std::string all = R"(@prefix acl: <http://www.w3.org/ns/auth/acl#> .
<#all> a acl:Authorization ; acl:accessTo </> ; acl:default </> ; acl:agentClass acl:AuthenticatedAgent ; acl:mode acl:Read .
)";
  book.put_rules(all);
  Options options;
  book.apply(options);
  options.listen.transport = transport::no_network;
  options.clock = &clock;
  Server server = Server::create(std::move(options)).value();
  for (const char* path : {"veiled_first", "second", "third"}) {
    Thing thing{path};
    thing.title("a weight").property("weight", [] { return 3.0; }).between(0, 10);
    server.add(std::move(thing)).value();
  }
  const auto ask = [&](const std::string& path) {
    RequestText request("GET " + path + "\nHost: localhost:4711\nAccept: text/turtle\nAuthorization: Bearer anna-0123456789abcdef");
    request.get().local_port = 4711;
    return std::string(server.serve(request.get()).response.content());
  };
  CHECK(ask("/second").find("/blueprints/veiled_first-") != std::string::npos);  // where nothing is hidden, equal Things share it
  book.put_rules(all +
                 "<#some> a acl:Authorization ; acl:accessTo </veiled_first> ; acl:default </veiled_first> ; "
                 "acl:agentGroup <#administrator> ; acl:mode acl:Read .");
  clock.advance(std::chrono::seconds(2));
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (ask("/second").find("veiled") != std::string::npos && std::chrono::steady_clock::now() < end) std::this_thread::yield();
  for (const char* path : {"/second", "/third"}) {
    const std::string seen = ask(path);
    CHECK(seen.find("veiled") == std::string::npos);
    CHECK(seen.find("/blueprints/") != std::string::npos);
  }
  const std::string seen = ask("/second"), begin = "/blueprints/";
  const std::size_t at = seen.find(begin);
  REQUIRE(at != std::string::npos);
  const std::string blueprint = ask(seen.substr(at, seen.find_first_of("> ", at) - at));
  CHECK(blueprint.find("NodeShape") != std::string::npos);
  CHECK(blueprint.find("veiled") == std::string::npos);
}

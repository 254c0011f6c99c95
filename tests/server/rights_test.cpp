// SPDX-License-Identifier: Apache-2.0
#include <lrt/server.hpp>

#include <atomic>
#include <chrono>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <lrt/served.hpp>
#include <lrt/transport/loopback.hpp>
#include <lrt/transport/named.hpp>

#include "tests/support/catch.hpp"
#include "tests/support/fakes.hpp"
#include "tests/support/message.hpp"
#include "tests/support/rights_matrix.hpp"
#include "tests/support/socket.hpp"

using namespace lrt;
using namespace lrt::test;

namespace {

/// A type whose name and fields are seen only by those who see a resource of it.
struct VeiledPose {
  double veiled_x = 1;
};

}  // namespace

template <>
struct lrt::rdf::traits<VeiledPose> : lrt::rdf::Record<VeiledPose> {
  static void describe(Record<VeiledPose>& r) { r.field("veiled_x", &VeiledPose::veiled_x); }
};

namespace {

struct Ruled {
  /// @param transport  empty: none
  explicit Ruled(const std::string& transport = "") {
    Options options;
    book.apply(options);
    if (transport.empty()) {
      options.listen.transport = transport::no_network;
      options.clock = &clock;
    } else {
      options.listen.transport = [transport](transport::TransportOptions t) { return transport::make_named(transport, std::move(t)); };
    }
    options.log = [this](LogLevel, std::string_view text) {
      const std::lock_guard lock(mutex);
      log += std::string(text) + "\n";
    };
    server.emplace(Server::create(std::move(options)).value());
    Thing arm = ruled_arm([this](double v) { angle = v; });
    arm.property("veiled_pose", [] { return VeiledPose(); });
    Thing tool{"arm/veiled_tool"}, other{"veiled_arm"}, hand{"arm/hand"};
    tool.title("veiled tool").property<double>("weight").publish(3);
    other.title("veiled arm").property<double>("weight").publish(4);
    hand.title("A hand").property<double>("force").publish(5);
    std::vector<Thing> things;
    for (Thing* thing : {&arm, &tool, &other, &hand}) things.push_back(std::move(*thing));
    server->add(std::move(things)).value();
  }

  http::Response ask(const std::string& text, const std::string& who) {
    const std::size_t body = text.find("\n\n");
    const std::string token = who.empty() ? "" : "Authorization: Bearer " + who + "-0123456789abcdef\n";
    RequestText request(text.substr(0, body) + "\nHost: localhost:4711\n" + token + (body == std::string::npos ? "" : text.substr(body + 1)));
    request.get().local_port = 4711;
    request.get().can_stream = true;
    return server->serve(request.get()).response;
  }
  int status(const std::string& text, const std::string& who) { return ask(text, who).status; }
  /// Header section and body as one text.
  std::string whole(const std::string& text, const std::string& who) {
    const http::Response response = ask(text, who);
    return std::to_string(response.status) + "\n" + std::string(response.fields.block()) + "\n" + std::string(response.content());
  }

  /// Whether a request gets a status within a minute: what the server does by itself takes a moment.
  bool becomes(int wanted, const std::string& text, const std::string& who) {
    for (const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60); std::chrono::steady_clock::now() < end;
         std::this_thread::yield())
      if (status(text, who) == wanted) return true;
    return false;
  }

  Rulebook book;
  FakeClock clock;
  std::atomic<double> angle{0};
  std::mutex mutex;
  std::string log;  ///< guarded by mutex
  std::optional<Server> server;
};

const std::vector<std::string> types = {"text/turtle",         "application/json",    "application/trig",
                                        "application/n-quads", "application/ld+json", "application/n-triples",
                                        "application/rdf+xml", "text/html",           "application/cbor"};

/// The paths that occur in a text.
std::set<std::string> paths_in(const std::string& text) {
  const std::string base = "http://localhost:4711/";
  std::set<std::string> found;
  for (std::size_t at = text.find(base); at != std::string::npos; at = text.find(base, at + 1)) {
    const std::size_t begin = at + base.size() - 1;
    found.insert(text.substr(begin, text.find_first_of("<>\"? #\n\\", begin) - begin));
  }
  return found;
}

/// All that a caller gets by following every link, in every format.
std::map<std::string, std::string> crawl(Ruled& robot, const std::string& who) {
  std::map<std::string, std::string> seen;
  std::vector<std::string> open = {"/"};
  while (!open.empty()) {
    const std::string path = open.back();
    open.pop_back();
    if (!seen.emplace(path, "").second) continue;
    std::string all = robot.whole("OPTIONS " + path, who);
    for (const std::string& type : types) all += robot.whole("GET " + path + "\nAccept: " + type, who);
    for (const std::string& next : paths_in(all)) open.push_back(next);
    seen[path] = all;
  }
  return seen;
}

}  // namespace

TEST_CASE("what a caller may not see is in no response, header field or format", "[server][security][R0.2]") {
  Ruled robot;
  const auto everything = crawl(robot, "carl");
  for (const char* path : {"/arm/veiled_angle", "/arm/veiled_pose", "/arm/actions/veiled_turn", "/arm/veiled_list", "/veiled_arm/weight",
                           "/arm/veiled_tool/weight", "/arm/hand/force", "/ns/vocabulary"})
    CHECK(everything.count(path) == 1);
  for (const char* who : {"anna", "bert"}) {
    const auto seen = crawl(robot, who);
    for (const char* path : {"/arm", "/arm/angle", "/arm/state", "/arm/all", "/all", "/arm/actions/turn", "/arm/list", "/arm/subscriptions",
                             "/arm/hand/force", "/ns/vocabulary"}) {
      CAPTURE(path);
      CHECK(seen.count(path) == 1);
    }
    for (const auto& [path, text] : seen) {
      CAPTURE(who, path);
      const std::size_t at = text.find("veiled");
      CHECK((at == std::string::npos ? "" : text.substr(at < 200 ? 0 : at - 200, 400)) == "");
      CHECK(text.find("private") != std::string::npos);
    }
  }
}

TEST_CASE("what a caller may not see cannot be told from what does not exist", "[server][security][R0.2]") {
  Ruled robot;
  const auto without_path = [](std::string text, const std::string& path) {
    for (std::size_t at = text.find(path); at != std::string::npos; at = text.find(path)) text.replace(at, path.size(), "PATH");
    return text;
  };
  for (const char* who : {"anna", "bert"})
    for (const char* method : {"GET", "HEAD", "OPTIONS", "PUT", "POST", "DELETE", "PATCH", "BREW"})
      for (const std::string& fields :
           {std::string(), std::string("\nAccept: text/turtle"), std::string("\nAccept: text/html"), std::string("\nAccept: text/event-stream"),
            std::string("\nUpgrade: callback\nConnection: Upgrade\nCallback: http://127.0.0.1:9/"), std::string("\nIf-Match: \"x\""),
            std::string("\nContent-Type: application/json\n\n5")})
        for (const char* query : {"", "?links=3", "?page=7", "?accept=application/json"})
          for (const char* hidden : {"/arm/veiled_angle", "/arm/veiled_pose", "/arm/actions/veiled_turn", "/arm/veiled_list", "/veiled_arm",
                                     "/veiled_arm/state", "/arm/veiled_tool/all"}) {
            // A path that no rule names, and one that a rule names while there is no resource, get the same.
            const std::string absent = "/arm/nothing";
            const std::string line = std::string(method) + " ";
            CAPTURE(who, line, fields, query, hidden);
            CHECK(without_path(robot.whole(line + hidden + query + fields, who), hidden) ==
                  without_path(robot.whole(line + absent + query + fields, who), absent));
          }
  CHECK(robot.angle == 0);
}

TEST_CASE("each principal may do what the rules say to each kind of resource", "[server][security][R0.2]") {
  Ruled robot;
  check_rights([&](const std::string& request, const std::string& token) { return robot.status(request, token.substr(0, token.find('-'))); });
  CHECK(robot.ask("OPTIONS /arm/angle", "anna").fields.find("Allow") == "GET, HEAD, OPTIONS");
  CHECK(robot.ask("OPTIONS /arm/angle", "bert").fields.find("Allow") == "GET, HEAD, OPTIONS, PUT");
  CHECK(robot.ask("GET /arm/angle", "anna").fields.find("Vary") == "Accept, Authorization, Cookie");
  CHECK(robot.ask("GET /arm/angle", "anna").fields.find("Cache-Control") == "private, no-cache");
  // What a caller may not do is not offered in the representation either.
  CHECK(std::string(robot.ask("GET /arm/angle\nAccept: text/turtle", "anna").content()).find("binding") == std::string::npos);
  CHECK(std::string(robot.ask("GET /arm/angle\nAccept: text/turtle", "bert").content()).find("binding") != std::string::npos);
}

TEST_CASE("the rights are the same on each transport", "[server][security][R0.2]") {
  for (const std::string_view transport : transport::names()) {
    CAPTURE(transport);
    const Ruled robot{std::string(transport)};
    const std::string host = "\nHost: 127.0.0.1:" + std::to_string(robot.server->port());
    check_rights([&](const std::string& request, const std::string& token) {
      const std::size_t body = std::min(request.find("\n\n"), request.size());
      return Socket(robot.server->port())
          .ask(request.substr(0, body) + host + (token.empty() ? "" : "\nAuthorization: Bearer " + token) + request.substr(body))
          .status;
    });
    const std::string handshake =
        host + "\nConnection: Upgrade\nUpgrade: websocket\nSec-WebSocket-Version: 13\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==";
    const auto opens = [&](const std::string& path, const std::string& who) {
      return Socket(robot.server->port())
          .ask("GET " + path + handshake + (who.empty() ? "" : "\nAuthorization: Bearer " + who + "-0123456789abcdef"))
          .status;
    };
    CHECK(opens("/arm/angle", "") == 401);
    CHECK(opens("/arm/angle", "emil") == 401);
    CHECK(opens("/arm/angle", "anna") == 101);
    CHECK(opens("/arm/veiled_angle", "anna") == 404);
    CHECK(opens("/arm/veiled_angle", "carl") == 101);
  }
}

TEST_CASE("a subscription belongs to who made it", "[server][json_ld][security][R0.2]") {
  Ruled robot;
  const std::string made = "GET /arm/angle\nUpgrade: callback\nConnection: Upgrade\nCallback: http://127.0.0.1:9/of-anna";
  const http::Response response = robot.ask(made, "anna");
  REQUIRE(response.status == 201);
  const std::string location(*response.fields.find("Location")), path = location.substr(location.find('/', 8));
  CHECK(robot.status("GET " + path, "anna") == 200);
  CHECK(robot.status("GET " + path, "dora") == 404);  // the same role
  CHECK(robot.status("DELETE " + path, "dora") == 404);
  CHECK(robot.status("DELETE " + path, "bert") == 404);
  const auto lists = [&](const std::string& who, const std::string& type) {
    const std::string text = robot.whole("GET /arm/subscriptions\nAccept: " + type, who);
    const bool path_is_in = text.find(path) != std::string::npos, url_is_in = text.find("of-anna") != std::string::npos;
    CHECK(path_is_in == url_is_in);
    return path_is_in;
  };
  for (const char* type : {"text/turtle", "application/ld+json"}) {
    CHECK(lists("anna", type));
    CHECK_FALSE(lists("dora", type));
    CHECK_FALSE(lists("bert", type));
    CHECK(lists("carl", type));
  }
  CHECK(robot.whole("GET /arm/subscriptions\nAccept: application/json", "dora").find(path) == std::string::npos);
  CHECK(robot.whole("GET " + path + "\nAccept: text/turtle", "carl").find("lrt:owner \"anna\"") != std::string::npos);
  CHECK(robot.status("DELETE " + path, "carl") == 204);  // who may manage
  CHECK(robot.status("GET " + path, "anna") == 404);
}

TEST_CASE("a subscription ends when the right does", "[server][security][R0.2]") {
  Ruled robot;
  const std::string made = "GET /arm/angle\nUpgrade: callback\nConnection: Upgrade\nCallback: http://127.0.0.1:9/";
  const auto subscribe = [&](const std::string& who) {
    const std::string location(*robot.ask(made + who, who).fields.find("Location"));
    return location.substr(location.find('/', 8));
  };
  const std::string of_anna = subscribe("anna"), of_bert = subscribe("bert");
  CHECK(robot.status("GET " + of_anna, "carl") == 200);
  SECTION("by the file of tokens") {
    const std::string all = Rulebook::tokens;
    robot.book.put_tokens(all.substr(all.find('\n') + 1));
    robot.clock.advance(std::chrono::seconds(2));
    CHECK(robot.becomes(404, "GET " + of_anna, "carl"));
    CHECK(robot.status("GET " + of_bert, "carl") == 200);
  }
  SECTION("by the rules") {
    std::string fewer = Rulebook::rules;
    fewer.replace(fewer.find(", lrt:Subscribe"), 15, "");
    robot.book.put_rules(fewer);
    robot.clock.advance(std::chrono::seconds(2));
    CHECK(robot.becomes(404, "GET " + of_anna, "carl"));
    CHECK(robot.becomes(404, "GET " + of_bert, "carl"));
  }
  SECTION("not by a file that is broken") {
    robot.book.put_rules(std::string(Rulebook::rules) + "<#broken> a acl:Authorization .");
    robot.clock.advance(std::chrono::seconds(2));
    CHECK(robot.status("PUT /arm/angle\nContent-Type: application/json\n\n5", "anna") == 403);
    CHECK(robot.status("GET " + of_anna, "carl") == 200);
    robot.server->stop();
    CHECK(robot.log.find("the rules of before stay: ") != std::string::npos);
    CHECK(robot.log.find("<#broken>") != std::string::npos);
  }
}

TEST_CASE("nothing says how much there is that a caller may not see", "[server][security][R0.2]") {
  Ruled robot;
  robot.book.put_rules(
      std::string(Rulebook::rules) +
      "<#hand> a acl:Authorization ; acl:accessTo </arm/hand> ; acl:default </arm/hand> ; acl:agentGroup <#administrator> ; acl:mode acl:Read .");
  robot.clock.advance(std::chrono::seconds(2));
  CHECK(robot.status("GET /arm/all", "carl") == 200);
  CHECK(robot.status("GET /arm/all", "anna") == 404);  // there are Things below, none of which is hers to see
  for (const std::string& type : types) {
    CAPTURE(type);
    const std::string text = robot.whole("GET /arm\nAccept: " + type, "anna");
    CHECK(text.find("/arm/all") == std::string::npos);
    CHECK(text.find("/arm/hand") == std::string::npos);
  }
  CHECK(robot.whole("GET /\nAccept: application/json", "anna").find("\"count\":1,") != std::string::npos);
  CHECK(robot.whole("GET /\nAccept: application/json", "carl").find("\"count\":2,") != std::string::npos);
}

TEST_CASE("a change that a subscriber may not see is not sent", "[server][security][R0.2]") {
  Ruled robot;
  RequestText request(
      "GET /arm/state?accept=application/json\nHost: localhost:4711\nAccept: text/event-stream\nAuthorization: Bearer anna-0123456789abcdef\n");
  request.get().local_port = 4711;
  request.get().can_stream = true;
  Served served = robot.server->serve(request.get());
  REQUIRE(served.events);
  const EventSource::Event first = served.events->next(std::chrono::seconds(10));
  REQUIRE(first.bytes);
  CHECK(first.bytes->find("\"angle\":1") != std::string::npos);
  CHECK(first.bytes->find("veiled") == std::string::npos);
  CHECK(robot.status("PUT /arm/veiled_angle\nContent-Type: application/json\n\n7", "carl") == 204);
  CHECK(robot.status("PUT /arm/angle\nContent-Type: application/json\n\n8", "carl") == 204);
  robot.clock.advance(std::chrono::seconds(1));
  robot.server->wake();
  const EventSource::Event second = served.events->next(std::chrono::seconds(10));
  REQUIRE(second.bytes);
  CHECK(second.bytes->find("\"angle\":8") != std::string::npos);  // the change of the other property was no event
  CHECK(second.bytes->find("veiled") == std::string::npos);
}

TEST_CASE("rules in code, and rights without credentials", "[server][security][R0.2]") {
  using security::Right, security::Rule, security::Scope, security::Who;
  Options options;
  options.listen.port = 0;
  options.listen.transport = transport::no_network;
  options.security.rules = {{"/arm", Scope::tree, {}, Right::read}};
  Server server = Server::create(std::move(options)).value();
  for (const char* path : {"arm", "leg"}) {
    Thing thing{path};
    thing.title("a").property<double>("angle").publish(1);
    server.add(std::move(thing)).value();
  }
  const auto status = [&](const std::string& text) {
    RequestText request(text + "\nHost: localhost:4711");
    request.get().local_port = 4711;
    return server.serve(request.get()).response.status;
  };
  CHECK(status("GET /arm/angle") == 200);
  CHECK(status("GET /") == 200);  // the list shows what may be seen
  CHECK(status("GET /leg") == 404);
  CHECK(status("PUT /arm/angle") == 401);
  Options wrong;
  wrong.listen.port = 0;
  wrong.security.rules = {{"arm", Scope::tree, {}, Right::read}};
  CHECK(Server::create(std::move(wrong)).error().code == Errc::invalid_option);
}

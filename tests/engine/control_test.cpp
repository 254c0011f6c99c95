// SPDX-License-Identifier: Apache-2.0
// Thing::control(): one client at a time commands a Thing and what is below it.

#include "src/engine/control.hpp"

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <lrt/lrt.hpp>

#include "src/security/policy.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/blueprint.hpp"
#include "tests/support/catch.hpp"

namespace {

using namespace lrt;
using lrt::test::Answer;
using lrt::test::Bench;
using std::chrono::milliseconds;
using std::chrono::seconds;

const std::string another = "\"type\":\"https://w3id.org/lrt/ns#ControlledByAnother\"";
const std::string required = "\"type\":\"https://w3id.org/lrt/ns#ControlRequired\"";

struct Robot : Bench {
  explicit Robot(ControlOptions options = {}, engine::EngineOptions engine_options = {}) : Bench(std::move(engine_options)) {
    Thing base{"base"};
    base.control(options);
    base.property("speed", [this] { return speed; }).on_write([this](double value) { speed = value, ++commands; });
    base.action("drive", [this] { ++commands; });
    base.action("halt", [this] { ++stops; }).stop();
    base.action("long", [this](Responder done) { running.push_back(std::move(done)); }).policy(ActionPolicy::queue(10));
    auto points = base.collection<double>("points");
    points.on_create([this](const std::string&, double) { ++commands; });
    points.on_remove([this](const std::string&) { ++commands; });
    add(std::move(base));
    Thing arm{"base/arm"};
    arm.control(options);
    arm.property("angle", [this] { return speed; }).on_write([this](double value) { speed = value, ++commands; });
    arm.action("grip", [this] { ++commands; });
    add(std::move(arm));
    Thing hand{"base/arm/hand"};
    hand.property("open", [] { return true; }).on_write([this](bool) { ++commands; });
    add(std::move(hand));
    Thing other{"other"};
    other.property("speed", [] { return 0.0; }).on_write([](double) {});
    add(std::move(other));
    World world{"base/world"};
    world.graph("map", [] {
      GraphOptions graph;
      graph.clients_may_write = true;
      return graph;
    }());
    add(std::move(world));
  }

  static std::string fields(const std::string& id, const std::string& accept = "application/json") {
    return "\nAccept: " + accept + (id.empty() ? "" : "\nControl-Id: " + id);
  }
  Answer json(const std::string& line, const std::string& id = "", const std::string& body = "") {
    return ask(line + fields(id) + (body.empty() ? "" : "\nContent-Type: application/json\n\n" + body));
  }
  /// Takes control; the id.
  std::string take(const std::string& thing, const std::string& query = "", const std::string& id = "") {
    const Answer taken = json("POST /" + thing + "/control" + query, id);
    CHECK(taken.status == 200);
    return std::string(taken.fields.find("Control-Id").value_or(""));
  }
  void after(milliseconds time) {
    clock.advance(time);
    run();
  }

  double speed = 0;
  int commands = 0, stops = 0;
  std::vector<Responder> running;
};

TEST_CASE("control is taken, renewed and given back, and everybody sees who has it and until when", "[engine]") {
  Robot robot;
  CHECK(robot.json("GET /base/control").body == R"({"held":false,"required":false})");
  const Answer taken = robot.json("POST /base/control?name=anna%27s%20tablet");
  CHECK(taken.status == 200);
  const std::string id(taken.fields.find("Control-Id").value_or(""));
  CHECK(id.size() == 32);
  CHECK(taken.says("\"controlId\":\"" + id + "\""));
  CHECK(taken.says("\"until\":\"2026-11-21T10:38:49.000000Z\",\"life\":10"));
  CHECK(taken.fields.find("Cache-Control") == "private, no-store");
  const Answer shown = robot.json("GET /base/control");
  CHECK(shown.body == R"({"held":true,"heldBy":"anna's tablet","until":"2026-11-21T10:38:49Z","required":false})");
  const Answer turtle = robot.get("/base/control");
  CHECK(turtle.says("lrt:heldBy \"anna's tablet\""));
  CHECK(turtle.says("lrt:until \"2026-11-21T10:38:49.000000Z\"^^xsd:dateTime"));
  // The id is nobody else's business.
  for (const char* path : {"/base/control", "/base", "/base/state", "/", "/base/all"})
    for (const char* accept : {"text/turtle", "application/json", "text/html", "text/csv", "application/ld+json"})
      CHECK_FALSE(robot.ask("GET " + std::string(path) + "\nAccept: " + accept).says(id));
  robot.after(seconds(5));
  CHECK(robot.json("PUT /base/control", id).says("\"until\":\"2026-11-21T10:38:54.000000Z\""));
  CHECK_FALSE(robot.json("PUT /base/control", id).says(id));
  robot.after(milliseconds(9'999));
  CHECK(robot.json("GET /base/control").says("\"held\":true"));
  CHECK(robot.json("DELETE /base/control").status == 409);
  CHECK(robot.json("DELETE /base/control", id).status == 204);
  CHECK(robot.json("DELETE /base/control", id).status == 204);
  CHECK(robot.json("GET /base/control").says("\"held\":false"));
}

TEST_CASE("every kind of command of others is refused, and says who has control and until when", "[engine]") {
  Robot robot;
  const Answer created = robot.json("POST /base/points", "", "1");
  const std::string member = robot.engine.base().empty() ? "" : std::string(created.fields.find("Location").value_or("")).substr(16);
  REQUIRE(member.find("/base/points/") == 0);
  const std::string id = robot.take("base", "?name=anna");
  const int before = robot.commands;
  const auto refused = [&](const std::string& line, const std::string& body = "") {
    CAPTURE(line);
    for (const std::string& with : {std::string(), std::string(32, 'a'), id + "0", id.substr(1)}) {
      const Answer answer =
          robot.ask(line + Robot::fields(with, "application/problem+json") + (body.empty() ? "" : "\nContent-Type: application/json\n\n" + body));
      CHECK(answer.status == 409);
      CHECK(answer.says(another));
      CHECK(answer.says("\\\"anna\\\" has control of \\\"base\\\" until 2026-11-21T10:38:49"));
    }
  };
  refused("PUT /base/speed", "1");
  refused("POST /base/actions/drive");
  refused("POST /base/actions/long");
  refused("POST /base/points", "2");
  refused("DELETE " + member);
  refused("PUT /base/arm/angle", "1");
  refused("POST /base/arm/actions/grip");
  refused("PUT /base/arm/hand/open", "true");
  refused("POST /base/control");
  refused("PUT /base/control");
  refused("DELETE /base/control");
  refused("POST /base/arm/control");
  CHECK(robot.commands == before);
  // What needs no control.
  CHECK(robot.json("POST /base/actions/halt").status == 204);
  CHECK(robot.stops == 1);
  CHECK(robot.json("GET /base/speed").status == 200);
  CHECK(robot.json("OPTIONS /base/speed").status == 204);
  CHECK(robot.json("PUT /other/speed", "", "1").status == 204);
  CHECK(robot.turtle("PUT", "/base/world/map", "<#a> <#b> <#c> .").status == 204);
  const Answer begun = robot.ask("POST /base/actions/long\nPrefer: respond-async" + Robot::fields(id));
  CHECK(begun.status == 202);
  CHECK(robot.json("DELETE " + std::string(begun.fields.find("Location").value_or("")).substr(16)).status == 204);
  // Its holder commands all.
  CHECK(robot.json("PUT /base/speed", id, "1").status == 204);
  CHECK(robot.json("POST /base/actions/drive", id).status == 204);
  CHECK(robot.json("POST /base/points", id, "2").status == 201);
  CHECK(robot.json("DELETE " + member, id).status == 204);
  CHECK(robot.json("PUT /base/arm/angle", id, "1").status == 204);
  CHECK(robot.json("PUT /base/arm/hand/open", id, "true").status == 204);
  CHECK(robot.json("DELETE /base/control", id).status == 204);
  CHECK(robot.json("PUT /base/speed", "", "2").status == 204);
}

TEST_CASE("control ends by itself, and those who watch it are told", "[engine]") {
  Robot robot;
  const engine::Channel channel = robot.open("/base/control?accept=application/json");
  CHECK(robot.messages(channel).size() == 1);
  const std::string id = robot.take("base", "?life=2.5");
  CHECK(robot.messages(channel) == std::vector<std::string>{R"({"held":true,"until":"2026-11-21T10:38:41.5Z","required":false})"});
  CHECK(robot.engine.next_deadline().has_value());
  robot.after(milliseconds(2'499));
  CHECK(robot.json("PUT /base/speed", "", "1").status == 409);
  robot.after(milliseconds(1));
  CHECK(robot.messages(channel) == std::vector<std::string>{R"({"held":false,"required":false})"});
  CHECK(robot.json("PUT /base/speed", "", "1").status == 204);
  const Answer late = robot.ask("PUT /base/control" + Robot::fields(id, "application/problem+json"));
  CHECK(late.status == 409);
  CHECK(late.says(required));
  // Who had it takes it again with the same id, unless somebody else has had it.
  CHECK(robot.take("base", "", id) == id);
  robot.after(seconds(10));
  CHECK(robot.take("base") != id);
  robot.after(seconds(10));
  CHECK(robot.take("base", "", id) != id);
}

TEST_CASE("a life is 1 s to 60 s, a name has at most 64 bytes", "[engine]") {
  Robot robot;
  for (const char* query : {"life=0.9", "life=61", "life=x", "life=", "life=NaN", "life=-1", "name=", "name=%00", "name=a%0Ab"}) {
    CAPTURE(query);
    CHECK(robot.json("POST /base/control?" + std::string(query)).status == 400);
  }
  CHECK(robot.json("POST /base/control?name=" + std::string(65, 'a')).status == 400);
  CHECK(robot.json("POST /base/control", "", "{}").status == 415);
  CHECK(robot.json("GET /base/control").says("\"held\":false"));
  const std::string id = robot.take("base", "?life=60&name=" + std::string(64, 'a'));
  CHECK(robot.json("PUT /base/control?life=1", id).says("\"life\":1}"));
}

TEST_CASE("where control is required, a command without it is 428", "[engine]") {
  ControlOptions options;
  options.required = true;
  Robot robot(options);
  const auto problem = [&](const std::string& line, const std::string& id, const std::string& body) {
    return robot.ask(line + Robot::fields(id, "application/problem+json") + "\nContent-Type: application/json\n\n" + body);
  };
  const Answer without = problem("PUT /base/speed", "", "1");
  CHECK(without.status == 428);
  CHECK(without.says(required));
  CHECK(without.says("POST to http://localhost/base/control"));
  CHECK(problem("PUT /base/arm/hand/open", "", "true").says("POST to http://localhost/base/arm/control"));
  CHECK(robot.json("POST /base/actions/halt").status == 204);
  const std::string arm = robot.take("base/arm");
  CHECK(robot.json("PUT /base/arm/hand/open", arm, "true").status == 204);
  CHECK(problem("PUT /base/speed", arm, "1").status == 428);
  CHECK(robot.json("GET /base/control").says("\"required\":true"));
}

TEST_CASE("nobody has control of a Thing above or below one that another client has", "[engine]") {
  Robot robot;
  const std::string arm = robot.take("base/arm", "?name=anna");
  CHECK(robot.json("POST /base/control").status == 409);
  CHECK(robot.json("PUT /base/arm/hand/open", "", "true").status == 409);
  CHECK(robot.json("PUT /base/speed", "", "1").status == 204);  // it is above
  // Its holder may have both, with one id.
  CHECK(robot.take("base", "", arm) == arm);
  CHECK(robot.json("DELETE /base/arm/control", arm).status == 204);
  CHECK(robot.json("PUT /base/arm/angle", "", "1").status == 409);
  CHECK(robot.json("PUT /base/arm/angle", arm, "1").status == 204);
  CHECK(robot.json("POST /base/arm/control").status == 409);
  // Taking over ends each lease that is in the way.
  const Answer taken = robot.ask("POST /base/arm/control\nTake-Over: ?1" + Robot::fields(""));
  CHECK(taken.status == 200);
  CHECK(robot.json("GET /base/control").says("\"held\":false"));
  CHECK(robot.json("PUT /base/arm/angle", arm, "1").status == 409);
}

TEST_CASE("a command that waits for the host is not carried out after another client has taken control", "[engine]") {
  Robot robot;
  const std::string first = robot.take("base");
  const auto write = robot.send("PUT /base/speed" + Robot::fields(first, "application/problem+json") + "\nContent-Type: application/json\n\n5");
  const auto drive = robot.send("POST /base/actions/drive" + Robot::fields(first, "application/problem+json"));
  const auto halt = robot.send("POST /base/actions/halt" + Robot::fields(first));
  REQUIRE(write.ticket);
  auto taken = robot.send("POST /base/control\nTake-Over: ?1" + Robot::fields(""));
  CHECK(taken.answer.status == 200);
  robot.run();
  CHECK(robot.commands == 0);
  CHECK(robot.stops == 1);
  for (const auto* sent : {&write, &drive}) {
    const auto answer = robot.answer(*sent);
    REQUIRE(answer);
    CHECK(answer->status == 409);
    CHECK(answer->says(another));
  }
  CHECK(robot.answer(halt)->status == 204);
}

TEST_CASE("an invocation in a queue does not begin after another client has taken control", "[engine]") {
  Robot robot;
  const std::string first = robot.take("base");
  std::vector<std::string> invocations;
  for (int i = 0; i < 2; ++i)
    invocations.push_back(
        std::string(robot.ask("POST /base/actions/long\nPrefer: respond-async" + Robot::fields(first)).fields.find("Location").value_or("")));
  REQUIRE(robot.running.size() == 1);
  CHECK(robot.ask("POST /base/control\nTake-Over: ?1" + Robot::fields("")).status == 200);
  CHECK(robot.get(invocations[0].substr(16)).says("lrt:running"));  // who takes over may cancel it
  robot.running.front().succeed();
  robot.run();
  CHECK(robot.running.size() == 1);
  const Answer second = robot.get(invocations[1].substr(16));
  CHECK(second.says("lrt:failed"));
  CHECK(second.says("another client has taken control"));
}

TEST_CASE("of 1,000 clients that contend for control, exactly one has it at each moment", "[engine]") {
  Robot robot;
  std::mt19937 random(1);
  std::vector<std::string> ids(1'000);
  std::size_t holder = ids.size(), changes = 0;
  for (int round = 0; round < 20; ++round) {
    std::size_t successes = 0;
    std::vector<std::size_t> order(ids.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::shuffle(order.begin(), order.end(), random);
    for (const std::size_t i : order) {
      const Answer answer = robot.json("POST /base/control?life=1", ids[i]);
      REQUIRE((answer.status == 200 || answer.status == 409));
      if (answer.status != 200) continue;
      ++successes;
      holder = i;
      ids[i] = std::string(answer.fields.find("Control-Id").value_or(""));
    }
    CHECK(successes == 1);
    ++changes;
    std::size_t commanders = 0;
    for (std::size_t i = 0; i < ids.size(); i += i == holder ? 1 : 37)
      if (robot.json("PUT /base/speed", ids[i], "1").status == 204) {
        ++commanders;
        CHECK(i == holder);
      }
    if (robot.json("PUT /base/speed", ids[holder], "1").status != 204) FAIL("its holder may not command");
    CHECK(commanders <= 1);
    robot.after(seconds(1));
  }
  CHECK(changes == 20);
  CHECK(robot.json("GET /base/control").says("\"held\":false"));
}

TEST_CASE("no lease survives a restart: an id of another run is unknown", "[engine]") {
  std::string id;
  {
    Robot robot;
    id = robot.take("base");
  }
  Robot robot;
  CHECK(robot.json("GET /base/control").says("\"held\":false"));
  CHECK(robot.json("PUT /base/control", id).status == 409);
  CHECK(robot.json("PUT /base/speed", "", "1").status == 204);
  CHECK(robot.take("base") != id);
}

TEST_CASE("the documents of a Thing with control conform to its Blueprint, and link to it", "[engine][json_ld]") {
  Robot robot;
  const auto get = [&](const std::string& path) { return robot.get(path); };
  CHECK(test::violations(get, "/base") == "");
  const std::string id = robot.take("base", "?name=anna");
  CHECK(test::violations(get, "/base") == "");
  CHECK(lrt::test::missing(robot.get("/base"), "<base> lrt:control <base/control> . <base/control> a lrt:Control .") == "");
  CHECK(robot.json("GET /base").says("\"control\":{\"href\":\"http://localhost/base/control\",\"kind\":\"control\""));
  CHECK(robot.get(test::kind_of(get, "/base")).says("sh:path lrt:control"));
  CHECK_FALSE(robot.get(test::kind_of(get, "/other")).says("lrt:control"));
  CHECK(robot.ask("GET /base/control\nAccept: application/ld+json").says("heldBy"));
  CHECK(robot.ask("OPTIONS /base/control").fields.find("Allow") == "GET, HEAD, OPTIONS, PUT, POST, DELETE");
}

TEST_CASE("a resource of the user has the name control, and lrt's moves aside", "[engine][R0.3]") {
  Bench bench;
  Thing thing{"base"};
  thing.control();
  thing.property("control", [] { return 1; });
  bench.add(std::move(thing));
  CHECK(bench.ask("GET /base/control\nAccept: application/json").body == "1");
  CHECK(bench.ask("GET /base/control-lrt\nAccept: application/json").says("\"held\":false"));
  CHECK(lrt::test::missing(bench.get("/base"), "<base> lrt:control <base/control-lrt> .") == "");
  CHECK(bench.ask("POST /base/control-lrt").status == 200);
}

TEST_CASE("a Thing with control is removed while a client has it", "[engine]") {
  Robot robot;
  robot.take("base");
  robot.engine.remove("base").value();
  robot.after(seconds(20));
  CHECK(robot.get("/base/control").status == 404);
}

// ----------------------------------------------------------------------------------------------------------------- rights

/// Callers are known by the field Authorization, which has a name.
engine::EngineOptions with_principals() {
  using security::Right;
  using security::Scope;
  using security::Who;
  static const auto policy =
      security::Policy::create({
                                   {"/", Scope::tree, {Who::Kind::role, "operator"}, Right::read | Right::write | Right::invoke | Right::subscribe},
                                   {"/", Scope::tree, {Who::Kind::role, "chief"}, security::Rights::all()},
                                   {"/", Scope::tree, {Who::Kind::role, "reader"}, Right::read},
                                   {"/base/arm", Scope::tree, {Who::Kind::role, "gripper"}, Right::read | Right::write | Right::invoke},
                                   {"/base/arm", Scope::tree, {Who::Kind::role, "operator"}, security::Rights::all()},
                               })
          .value();
  engine::EngineOptions options;
  options.authorize = [](const http::Request& request) -> engine::Caller {
    const auto name = request.find("Authorization");
    if (!name) return engine::Access::unauthenticated;
    security::Principal principal{std::string(*name), {std::string(name->substr(0, name->find('-')))}};
    engine::Caller caller;
    caller.view = policy->view(&principal);
    caller.principal = std::make_shared<const security::Principal>(std::move(principal));
    return caller;
  };
  return options;
}

TEST_CASE("a principal has control by its name; another one takes it over only by right", "[engine][security]") {
  Robot robot({}, with_principals());
  const auto as = [&](const std::string& who, const std::string& line, const std::string& more = "", const std::string& body = "") {
    return robot.ask(line + "\nAuthorization: " + who + "\nAccept: application/problem+json, application/json" + more +
                     (body.empty() ? "" : "\nContent-Type: application/json\n\n" + body));
  };
  CHECK(as("reader-r", "POST /base/control").status == 403);
  const Answer taken = as("operator-anna", "POST /base/control?name=somebody");
  CHECK(taken.status == 200);
  CHECK_FALSE(taken.fields.find("Control-Id"));
  CHECK(taken.says("\"heldBy\":\"operator-anna\""));
  CHECK(as("reader-r", "GET /base/control").says("\"heldBy\":\"operator-anna\""));
  CHECK(as("operator-anna", "PUT /base/speed", "", "1").status == 204);
  CHECK(as("operator-bert", "PUT /base/speed", "", "1").status == 409);
  CHECK(as("operator-bert", "PUT /base/speed", "\nControl-Id: operator-anna", "1").status == 409);
  CHECK(as("operator-bert", "POST /base/control", "\nTake-Over: ?1").status == 403);
  CHECK(as("operator-bert", "POST /base/control", "\nTake-Over: ?0").status == 409);
  CHECK(as("chief-carl", "POST /base/control").status == 409);
  CHECK(as("chief-carl", "POST /base/control", "\nTake-Over: ?1").says("\"heldBy\":\"chief-carl\""));
  CHECK(as("operator-anna", "PUT /base/speed", "", "1").status == 409);
  CHECK(as("operator-anna", "PUT /base/control").status == 409);
  CHECK(as("operator-anna", "POST /base/actions/halt").status == 204);
}

TEST_CASE("who may not see control of a Thing learns only that somebody has it", "[engine][security]") {
  Robot robot({}, with_principals());
  const auto as = [&](const std::string& who, const std::string& line, const std::string& body = "") {
    return robot.ask(line + "\nAuthorization: " + who + "\nAccept: application/problem+json, application/json" +
                     (body.empty() ? "" : "\nContent-Type: application/json\n\n" + body));
  };
  CHECK(as("operator-anna", "POST /base/control").status == 200);
  CHECK(as("gripper-g", "GET /base/control").status == 404);
  CHECK(as("gripper-g", "POST /base/control").status == 404);
  const Answer refused = as("gripper-g", "PUT /base/arm/angle", "1");
  CHECK(refused.status == 409);
  CHECK(refused.says("another client has control"));
  CHECK_FALSE(refused.says("anna"));
  CHECK_FALSE(refused.says("until"));
  CHECK_FALSE(as("gripper-g", "GET /base/arm").says("/base/control"));
}

TEST_CASE("who may not see control of a Thing learns that it is required, not where it is", "[engine][security]") {
  ControlOptions options;
  options.required = true;
  const std::vector<security::Rule> rules = {{"/base/speed", security::Scope::here, {}, security::Right::read | security::Right::write}};
  engine::EngineOptions engine_options;
  engine_options.authorize = [policy = security::Policy::create(rules).value()](const http::Request&) {
    engine::Caller caller;
    caller.view = policy->view(nullptr);
    return caller;
  };
  Robot robot(options, std::move(engine_options));
  CHECK(robot.get("/base/control").status == 404);
  const Answer refused = robot.ask("PUT /base/speed" + Robot::fields("", "application/problem+json") + "\nContent-Type: application/json\n\n1");
  CHECK(refused.status == 428);
  CHECK(refused.says(required));
  CHECK(refused.says("a command needs control"));
  CHECK_FALSE(refused.says("/control"));
}

}  // namespace

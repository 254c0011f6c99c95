// SPDX-License-Identifier: Apache-2.0
// Commands that are late: Valid-Until, Start-Before, requires_expiry() (SPEC 3.20).
#include "src/engine/expiry.hpp"

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/lrt.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;
using std::chrono::milliseconds;

namespace {

constexpr const char* late_type = R"("type":"https://w3id.org/lrt/ns#LateCommand")";

struct Robot {
  explicit Robot(engine::EngineOptions options = {}) : bench(std::move(options)) {
    Thing thing{"arm"};
    thing.property("angle", [this] { return angle; }).on_write([this](double v) { angle = v, ++writes; });
    thing.action("turn", [this] { ++turns; });
    thing.action("slow", [this](Responder done) { open.push_back(std::move(done)); }).policy(ActionPolicy::queue(4));
    thing.action("stop", [this] { ++stops; }).stop();
    const auto take_long = [this] {
      bench.clock.advance(milliseconds(60));
      bench.collect();
      ++finished;
    };
    thing.action("busy", take_long);
    thing.property("load", [] { return 0.0; }).on_write([take_long](double) { take_long(); });
    auto points = thing.collection<double>("points");
    points.on_create([this](double) { ++created; });
    points.on_remove([this](const std::string&) { ++removed; });
    bench.add(std::move(thing));
    World world{"world"};
    GraphOptions writable;
    writable.clients_may_write = true;
    world.graph("map", std::move(writable));
    bench.add(std::move(world));
  }
  /// The field Valid-Until or Start-Before with a time that far from now.
  std::string in(milliseconds time, const std::string& name = "Valid-Until") {
    http::RobotTime stamp = *http::RobotTime::parse(bench.engine.robot_time(bench.clock.now()));
    stamp.milliseconds += static_cast<std::uint64_t>(time.count());
    return name + ": " + stamp.text() + "\n";
  }
  /// Sends a command, whose body is judged at once.
  Bench::Sent send(const std::string& text) {
    const Bench::Sent sent = bench.send(text);
    for (auto& job : bench.take_body_jobs()) job.run();
    bench.collect();
    return sent;
  }
  double angle = 0;
  int finished = 0, writes = 0, turns = 0, stops = 0, created = 0, removed = 0;
  std::vector<Responder> open;
  Bench bench;
};

/// Each kind of command, without its fields of time.
std::vector<std::string> commands() {
  return {"POST /arm/actions/turn\n",
          "PUT /arm/angle\nContent-Type: application/json\n",
          "POST /arm/points\nContent-Type: application/json\n",
          "PUT /world/map\nContent-Type: text/turtle\n",
          "PATCH /world/map\nContent-Type: application/sparql-update\n",
          "DELETE /world/map\n"};
}
std::string body_of(const std::string& command) {
  if (command.find("json") != std::string::npos) return "\n0.5";
  if (command.find("turtle") != std::string::npos) return "\n<a> <b> <c> .";
  return command.find("sparql") != std::string::npos ? "\nINSERT DATA { <a> <b> <c> }" : "";
}

}  // namespace

TEST_CASE("a stamp is the run of a server and its milliseconds, and nothing else", "[http]") {
  CHECK(http::RobotTime{0x123456789abcdef, 73521}.text() == "0123456789abcdef/73521");
  const auto read = http::RobotTime::parse("0123456789abcdef/73521");
  REQUIRE(read);
  CHECK(read->instance == 0x123456789abcdef);
  CHECK(read->milliseconds == 73521);
  CHECK(http::RobotTime::parse("0123456789ABCDEF/0"));
  CHECK(http::RobotTime::parse("0123456789abcdef/999999999999999"));
  for (const char* wrong : {"", "0123456789abcdef", "0123456789abcdef/", "0123456789abcde/1", "0123456789abcdefg/1", "0123456789abcdef/-1",
                            "0123456789abcdef/+1", "0123456789abcdef/1.5", "0123456789abcdef/ 1", "0123456789abcdef/1 ", "0x23456789abcdef/1",
                            "0123456789abcdef/1234567890123456", "0123456789abcdef/1, 0123456789abcdef/2"}) {
    CAPTURE(wrong);
    CHECK_FALSE(http::RobotTime::parse(wrong));
  }
}

TEST_CASE("each response has a stamp that is at most 50 ms older than it is, never newer", "[engine][expiry]") {
  Bench bench;
  const auto stamp = [&] { return std::string(bench.engine.common_fields(bench.clock.now())->find("Robot-Time").value_or("")); };
  CHECK(stamp() == bench.engine.robot_time(bench.clock.now()));
  const std::string first = stamp();
  bench.clock.advance(milliseconds(50));
  CHECK(stamp() == first);
  bench.clock.advance(milliseconds(1));
  CHECK(stamp() == bench.engine.robot_time(bench.clock.now()));
}

TEST_CASE("a command within its time is carried out, a late one is not", "[engine][expiry]") {
  Robot robot;
  robot.bench.clock.advance(milliseconds(500));
  std::string member;
  for (const std::string& command : commands()) {
    CAPTURE(command);
    const Answer answer = robot.bench.ask(command + robot.in(milliseconds(100)) + body_of(command));
    CHECK(answer.status / 100 == 2);
    if (command.find("points") != std::string::npos) member = answer.field("Location").substr(std::string("http://localhost").size());
  }
  CHECK(robot.writes == 1);
  CHECK(robot.turns == 1);
  CHECK(robot.created == 1);
  for (const std::string& command : commands()) {
    CAPTURE(command);
    const std::string field = robot.in(milliseconds(100));
    robot.bench.clock.advance(milliseconds(100));
    const Answer answer = robot.bench.ask(command + field + body_of(command));
    CHECK(answer.status == 412);
    CHECK(answer.says(late_type));
  }
  CHECK(robot.writes == 1);
  CHECK(robot.turns == 1);
  CHECK(robot.created == 1);
  const std::string field = robot.in(milliseconds(100));
  CHECK(robot.bench.ask("DELETE " + member + "\n" + robot.in(milliseconds(0))).status == 412);
  CHECK(robot.removed == 0);
  CHECK(robot.bench.ask("DELETE " + member + "\n" + field).status == 204);
}

TEST_CASE("another run of the server makes a command late, whatever the number is", "[engine][expiry]") {
  Robot before, after;
  before.bench.clock.advance(milliseconds(10));
  const Answer answer = after.bench.ask("POST /arm/actions/turn\n" + before.in(std::chrono::hours(1)));
  CHECK(answer.status == 412);
  CHECK(answer.says(late_type));
  CHECK(after.turns == 0);
  CHECK(before.bench.engine.robot_time({}) != after.bench.engine.robot_time({}));
}

TEST_CASE("a field of another form is refused with what was expected", "[engine][expiry]") {
  Robot robot;
  for (const char* name : {"Valid-Until", "Start-Before"})
    for (const char* value : {"soon", "2026-11-28T19:00:00Z", "5000", "0123456789abcdef/x"}) {
      CAPTURE(name, value);
      const Answer answer = robot.bench.ask("POST /arm/actions/turn\n" + std::string(name) + ": " + value);
      CHECK(answer.status == 400);
      CHECK(answer.says(std::string(name) + ": expected one value of Robot-Time"));
    }
  CHECK(robot.bench.ask("POST /arm/actions/turn\n" + robot.in(milliseconds(9)) + robot.in(milliseconds(10))).status == 400);
  CHECK(robot.turns == 0);
}

TEST_CASE("a command that waited in the host's mailbox is judged when its lambda would run", "[engine][expiry]") {
  Robot robot;
  for (const std::string& command : {commands()[0], commands()[1], commands()[2]}) {
    CAPTURE(command);
    const auto sent = robot.send(command + robot.in(milliseconds(50)) + body_of(command));
    REQUIRE(sent.ticket);
    robot.bench.clock.advance(milliseconds(49));
    auto jobs = robot.bench.take_jobs();  // the host has them now, and takes its time
    robot.bench.clock.advance(milliseconds(1));
    for (auto& job : jobs) job.run();
    const auto answer = robot.bench.answer(sent);
    REQUIRE(answer);
    CHECK(answer->status == 412);
    CHECK(answer->says(late_type));
  }
  CHECK(robot.writes + robot.turns + robot.created == 0);
}

TEST_CASE("the sender is told at the time, not when the host polls", "[engine][expiry]") {
  Robot robot;
  for (const std::string& command : {commands()[0], commands()[1], commands()[2]}) {
    CAPTURE(command);
    const auto sent = robot.send(command + robot.in(milliseconds(50)) + body_of(command));
    CHECK(robot.bench.engine.next_deadline() <= robot.bench.clock.now().steady + milliseconds(50));
    robot.bench.clock.advance(milliseconds(50));
    const auto answer = robot.bench.answer(sent);
    REQUIRE(answer);
    CHECK(answer->status == 412);
    robot.bench.run();
  }
  CHECK(robot.writes + robot.turns + robot.created == 0);
}

TEST_CASE("of two writes in one queue the late one is left out, and the next one follows", "[engine][expiry]") {
  Robot robot;
  const std::string put = "PUT /arm/angle\nContent-Type: application/json\n";
  const auto first = robot.send(put + "\n1");
  const auto second = robot.send(put + robot.in(milliseconds(50)) + "\n2");
  const auto third = robot.send(put + "\n3");
  robot.bench.clock.advance(milliseconds(60));
  robot.bench.run();
  CHECK(robot.bench.answer(first)->status == 204);
  CHECK(robot.bench.answer(second)->status == 412);
  CHECK(robot.bench.answer(third)->status == 204);
  CHECK(robot.writes == 2);
  CHECK(robot.angle == 3);
}

TEST_CASE("expiry ends with acceptance: an invocation that was answered 202 or queued goes on", "[engine][expiry]") {
  Robot robot;
  const auto at_once = robot.send("POST /arm/actions/turn\nPrefer: respond-async\n" + robot.in(milliseconds(50)));
  CHECK(at_once.answer.status == 202);
  robot.bench.clock.advance(milliseconds(60));
  robot.bench.run();
  CHECK(robot.turns == 1);

  const auto running = robot.send("POST /arm/actions/slow\n" + robot.in(milliseconds(50)));
  robot.bench.run();
  const auto queued = robot.send("POST /arm/actions/slow\n" + robot.in(milliseconds(50)));
  CHECK(robot.open.size() == 1);
  robot.bench.clock.advance(milliseconds(60));
  robot.bench.run();
  CHECK(robot.bench.answer(running)->status == 204);
  std::move(robot.open.front()).succeed();
  robot.bench.run();
  CHECK(robot.open.size() == 2);
  std::move(robot.open.back()).succeed();
  robot.bench.run();
  CHECK(robot.bench.answer(queued)->status / 100 == 2);
}

TEST_CASE("a command that has begun is answered at its time, and goes on", "[engine][expiry]") {
  Robot robot;
  for (const std::string& command : {std::string("POST /arm/actions/busy\n"), std::string("PUT /arm/load\nContent-Type: application/json\n")}) {
    CAPTURE(command);
    robot.finished = 0;
    const Answer answer = robot.bench.ask(command + robot.in(milliseconds(50)) + body_of(command));
    CHECK(answer.status == 202);
    CHECK(robot.finished == 1);
  }
}

TEST_CASE("Start-Before ends an accepted invocation that has not begun, with the reason", "[engine][expiry]") {
  Robot robot;
  const auto running = robot.send("POST /arm/actions/slow\nPrefer: respond-async");
  robot.bench.run();
  const auto queued = robot.send("POST /arm/actions/slow\nPrefer: respond-async\n" + robot.in(milliseconds(50), "Start-Before"));
  CHECK(queued.answer.status == 202);
  robot.bench.clock.advance(milliseconds(50));
  robot.bench.run();
  const std::string path = queued.answer.field("Location").substr(std::string("http://localhost").size());
  CHECK(robot.bench.get(path).says("lrt:failed"));
  CHECK(robot.bench.get(path).says("before a time that has passed"));
  std::move(robot.open.front()).succeed();
  robot.bench.run();
  CHECK(robot.open.size() == 1);

  const auto handed_over = robot.send("POST /arm/actions/turn\nPrefer: respond-async\n" + robot.in(milliseconds(50), "Start-Before"));
  auto jobs = robot.bench.take_jobs();
  robot.bench.clock.advance(milliseconds(50));
  for (auto& job : jobs) job.run();
  robot.bench.run();
  CHECK(robot.turns == 0);
  CHECK(robot.bench.get(handed_over.answer.field("Location").substr(std::string("http://localhost").size())).says("lrt:failed"));
  CHECK(robot.bench.ask("POST /arm/actions/turn\n" + robot.in(milliseconds(0), "Start-Before")).status == 412);
}

TEST_CASE("a stop and the cancelling of an invocation never expire, and their fields are ignored", "[engine][expiry]") {
  Robot robot;
  const std::string late = robot.in(milliseconds(0));
  robot.bench.clock.advance(milliseconds(10));
  CHECK(robot.bench.ask("POST /arm/actions/stop\n" + late).status == 204);
  CHECK(robot.bench.ask("POST /arm/actions/stop\nValid-Until: nonsense").status == 204);
  CHECK(robot.stops == 2);
  const auto running = robot.send("POST /arm/actions/slow\nPrefer: respond-async");
  robot.bench.run();
  const std::string path = running.answer.field("Location").substr(std::string("http://localhost").size());
  CHECK(robot.bench.ask("DELETE " + path + "\n" + late).status == 204);
  CHECK(robot.bench.get(path).says("lrt:cancelled"));
  CHECK(robot.bench.ask("GET /arm/angle\n" + late).status == 200);
}

TEST_CASE("an action or a Thing can require an expiry, also for the Things below it", "[engine][expiry]") {
  Bench bench;
  int turns = 0, stops = 0;
  double speed = 0;
  Thing base{"base"};
  base.requires_expiry();
  base.property("speed", [&] { return speed; }).on_write([&](double v) { speed = v; });
  base.action("stop", [&] { ++stops; }).stop();
  bench.add(std::move(base));
  Thing arm{"base/arm"};
  arm.action("turn", [&] { ++turns; });
  bench.add(std::move(arm));
  Thing other{"other"};
  other.action("careful", [&] { ++turns; }).requires_expiry();
  other.action("free", [&] { ++turns; });
  bench.add(std::move(other));
  const auto in = [&](int ms) {
    http::RobotTime stamp = *http::RobotTime::parse(bench.engine.robot_time(bench.clock.now()));
    stamp.milliseconds += static_cast<std::uint64_t>(ms);
    return "Valid-Until: " + stamp.text() + "\n";
  };
  for (const std::string command :
       {"POST /base/arm/actions/turn\n", "POST /other/actions/careful\n", "PUT /base/speed\nContent-Type: application/json\n"}) {
    CAPTURE(command);
    const std::string body = command[1] == 'U' ? "\n0.5" : "";
    const Answer answer = bench.ask(command + body);
    CHECK(answer.status == 428);
    CHECK(answer.says(R"("type":"https://w3id.org/lrt/ns#ExpiryRequired")"));
    CHECK(answer.says("curl -X " + command.substr(0, command.find(' '))));
    CHECK(bench.ask(command + in(10) + body).status == 204);
  }
  CHECK(turns == 2);
  CHECK(speed == 0.5);
  CHECK(bench.ask("POST /other/actions/free").status == 204);
  CHECK(bench.ask("POST /base/actions/stop").status == 204);
  CHECK(stops == 1);
}

TEST_CASE("subscribers that ask for it get heartbeats, and notifications stay as they are", "[engine][heartbeat]") {
  Robot robot;
  Bench& bench = robot.bench;
  const auto channel = bench.open_stream("/arm/angle?heartbeat=0.5");
  const auto stamp = [&] { return bench.engine.robot_time(bench.clock.now()); };
  std::vector<std::string> got = bench.messages(channel);
  REQUIRE(got.size() == 2);
  CHECK(got[0] == "event: heartbeat\ndata: " + stamp() + "\n\n");
  CHECK(bench.messages(channel).empty());
  int beats = 0;
  for (int i = 0; i < 20; ++i) {
    bench.clock.advance(milliseconds(100));
    for (const std::string& message : bench.messages(channel)) {
      CHECK(message == "event: heartbeat\ndata: " + stamp() + "\n\n");
      ++beats;
    }
  }
  CHECK(beats == 4);
  bench.engine.closed(channel);
  CHECK_FALSE(bench.engine.next_deadline());
}

TEST_CASE("a WebSocket has heartbeats with the subprotocol lrt.stamped only", "[engine][heartbeat]") {
  Robot robot;
  Bench& bench = robot.bench;
  const auto channel = bench.open("/arm/angle?heartbeat=3", "Sec-WebSocket-Protocol: lrt.stamped\n");
  const auto got = bench.messages(channel);
  REQUIRE(got.size() == 3);
  CHECK(got[0] == "{\"heartbeat\":\"" + bench.engine.robot_time(bench.clock.now()) + "\"}");
  CHECK(bench.engine.next_deadline() <= bench.clock.now().steady + milliseconds(1000));  // at most one second
  CHECK(bench.upgrade("/arm/angle?heartbeat=1").answer.status == 400);
  for (const char* wrong : {"0", "-1", "x", "", "nan"}) {
    CAPTURE(wrong);
    CHECK(bench.stream("/arm/angle?heartbeat=" + std::string(wrong)).answer.status == 400);
  }
}

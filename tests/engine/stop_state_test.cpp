// SPDX-License-Identifier: Apache-2.0
// Action::stop(state, release): a stop is a state.
#include "src/engine/stop_state.hpp"

#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
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
using lrt::test::missing;
using security::Right;
using security::Rights;
using std::chrono::milliseconds;
using std::chrono::seconds;

const std::string json = "\nContent-Type: application/json\n\n";

/// A base with an arm below it and a lamp beside it. Callers are named by the field `Who`.
struct Robot {
  explicit Robot(bool has_release = true, engine::EngineOptions options = {}) : bench(with_callers(std::move(options))) {
    Thing base{"base"}, arm{"base/arm"}, lamp{"lamp"};
    base.action("drive", [this](Responder done) {
      ++drives;
      done.on_cancel([this] { ++cancels; });
      open.push_back(std::move(done));
    });
    base.action("honk", [this] { ++honks; }).harmless();
    base.property<double>("speed").on_write([this](double v) { speed = v; }).publish(0);
    base.property<double>("label").on_write([this](double v) { label = v; }).harmless().publish(0);
    base.property<double>("height").publish(1);
    base.collection<double>("points").on_create([](const double&) { return Result<void>(); }).on_remove([](const std::string&) {
      return Result<void>();
    });
    Action release;
    if (has_release)
      release = base.action("release", [this] {
        ++releases;
        if (releases_flag) flag = false;
      });
    base.action("stop",
                [this] {
                  ++stops;
                  if (stops_flag) flag = true;
                })
        .stop(
            [this] {
              ++reads;
              if (throws) throw std::runtime_error("no contact");
              return flag;
            },
            release);
    arm.action("turn", [this] { ++turns; });
    arm.property<double>("angle").on_write([](double) {}).publish(0);
    lamp.action("on", [this] { ++lamps; });
    std::vector<Thing> things;
    for (Thing* t : {&base, &arm, &lamp}) things.push_back(std::move(*t));
    bench.engine.add(std::move(things)).value();
  }
  engine::EngineOptions with_callers(engine::EngineOptions options) {
    options.log = [this](LogLevel, std::string_view text) { log += std::string(text) + "\n"; };
    options.authorize = [this](const http::Request& request) {
      engine::Caller caller;
      if (const auto who = request.find("Who")) {
        caller.principal = std::make_shared<const security::Principal>(security::Principal{std::string(*who), {}});
        if (rights.count(std::string(*who)) != 0) caller.view = rights.at(std::string(*who));
      }
      return caller;
    };
    return options;
  }

  /// The field that says how long a release is valid.
  std::string valid() {
    TimePoint until = bench.clock.now();
    until.steady += seconds(2);
    return "\nValid-Until: " + bench.engine.robot_time(until);
  }
  Bench::Sent send_release(const std::string& fields = {}) { return bench.send("POST /base/actions/release" + valid() + fields); }
  /// Until it has its response, while the time passes.
  Answer release(const std::string& fields = {}) {
    const Bench::Sent sent = send_release(fields);
    for (int i = 0; i < 200; ++i) {
      bench.run();
      if (auto answer = bench.answer(sent)) return *answer;
      bench.clock.advance(milliseconds(20));
    }
    throw std::runtime_error("no answer to the release");
  }
  Answer stop(const std::string& fields = {}) { return bench.ask("POST /base/actions/stop" + fields); }
  int drive() { return bench.ask("POST /base/actions/drive").status; }
  /// The hardware changes, and the server has had the time to see it.
  void press(bool now) {
    flag = now;
    wait();
  }
  void wait() {
    bench.clock.advance(milliseconds(150));
    bench.run();
  }
  std::string state() { return bench.ask("GET /base/stopped\nAccept: application/json").body; }

  std::map<std::string, std::shared_ptr<const security::View>> rights;
  bool flag = false, throws = false, stops_flag = true, releases_flag = true;
  int drives = 0, cancels = 0, honks = 0, turns = 0, lamps = 0, stops = 0, releases = 0, reads = 0;
  double speed = 0, label = 0;
  std::vector<Responder> open;
  std::string log;
  Bench bench;
};

void check_stopped(const Answer& answer) {
  CHECK(answer.status == 409);
  CHECK(answer.says(R"("type":"https://w3id.org/lrt/ns#Stopped")"));
}

TEST_CASE("the state of a stop is read before the first command: what the host says counts from the start", "[engine][stop]") {
  Robot robot;
  SECTION("it moves") { CHECK(robot.drive() == 204); }
  SECTION("it is stopped, as before a restart") {
    robot.flag = true;
    check_stopped(robot.bench.ask("POST /base/actions/drive"));
    CHECK(robot.drives == 0);
    CHECK(robot.state().find(R"("by":"the robot itself")") != std::string::npos);
  }
  SECTION("it cannot be read") {
    robot.throws = true;
    check_stopped(robot.bench.ask("POST /base/actions/drive"));
    CHECK(robot.drives == 0);
    CHECK(robot.log.find("no contact") != std::string::npos);
    robot.throws = false;
    robot.wait();
    CHECK(robot.drive() == 204);
  }
  SECTION("a lambda that runs before the answer is not called") {
    Bench bench;
    int turns = 0;
    Thing arm{"arm"};
    arm.action("turn", [&] { ++turns; }).dispatch(Dispatch::io_thread);
    arm.action("stop", [] {}).stop([] { return false; });
    bench.add(std::move(arm));
    const auto reading = bench.take_jobs();
    REQUIRE(reading.size() == 1);
    check_stopped(bench.ask("POST /arm/actions/turn"));
    CHECK(turns == 0);
  }
}

TEST_CASE("a stop counts from its POST on, before its lambda has run", "[engine][stop]") {
  Robot robot;
  CHECK(robot.drive() == 204);
  const Bench::Sent stop = robot.bench.send("POST /base/actions/stop\nWho: anna");
  const Bench::Sent drive = robot.bench.send("POST /base/actions/drive");
  REQUIRE_FALSE(drive.ticket);
  check_stopped(drive.answer);
  CHECK(robot.stops == 0);
  robot.bench.run();
  CHECK(robot.bench.answer(stop)->status == 204);
  CHECK(robot.stops == 1);
  CHECK(robot.state().find(R"("stopped":true)") != std::string::npos);
  CHECK(robot.state().find(R"("by":"anna")") != std::string::npos);
  CHECK(robot.state().find(R"("since":"2026-11-21T10:38:39Z")") != std::string::npos);
}

TEST_CASE("what waits and what runs ends as failed, and its responder sees it", "[engine][stop]") {
  Robot robot;
  CHECK(robot.drive() == 204);
  CHECK(robot.bench.ask("POST /base/actions/drive").status == 202);  // it waits in the queue
  const Bench::Sent waiting = robot.bench.send("POST /base/actions/drive\nPrefer: wait=30");
  robot.bench.run();
  const Bench::Sent written = robot.bench.send("PUT /base/speed" + json + "3");
  SECTION("by a client") { robot.stop(); }
  SECTION("by the hardware") { robot.press(true); }
  robot.bench.run();
  CHECK(robot.drives == 1);
  CHECK(robot.cancels == 1);
  CHECK(robot.open.at(0).cancelled());
  for (const char* id : {"i1", "i2", "i3"}) {
    CAPTURE(id);
    const Answer one = robot.bench.get(std::string("/base/actions/drive/") + id);
    CHECK(one.says("lrt:failed"));
    CHECK(one.says("the robot was stopped"));
  }
  const auto answer = robot.bench.answer(waiting);
  REQUIRE(answer);
  check_stopped(*answer);
  REQUIRE(robot.bench.answer(written));
  CHECK((robot.speed == 0) == (robot.bench.answer(written)->status == 409));
  robot.open.at(0).succeed();
  robot.bench.run();
  CHECK(robot.bench.get("/base/actions/drive/i1").says("lrt:failed"));
}

TEST_CASE("while it is stopped, what moves is refused there and below; the rest goes on", "[engine][stop]") {
  Robot robot;
  World map("base/map");
  GraphOptions writable;
  writable.clients_may_write = true;
  map.graph("walls", std::move(writable));
  robot.bench.add(std::move(map));
  const Answer made = robot.bench.ask("POST /base/points" + json + "1");
  REQUIRE(made.status == 201);
  const std::string member = made.field("Location").substr(std::string("http://localhost").size());
  robot.stop("\nWho: anna");
  for (const std::string& text : {std::string("POST /base/actions/drive"), std::string("POST /base/arm/actions/turn"), "DELETE " + member}) {
    CAPTURE(text);
    check_stopped(robot.bench.ask(text));
  }
  for (const char* const text : {"PUT /base/speed", "POST /base/points", "PUT /base/arm/angle"}) {
    CAPTURE(text);
    check_stopped(robot.bench.ask(text + json + "1"));
  }
  const Answer refused = robot.bench.ask("POST /base/actions/drive");
  for (const char* const part : {"since 2026-11-21T10:38:39Z", "by anna", "http://localhost/base/stopped", "http://localhost/base/actions/release"})
    CHECK(refused.says(part));
  CHECK(robot.bench.ask("POST /base/actions/drive\nAccept: text/turtle").says("lrt:Stopped"));
  CHECK(robot.bench.ask("PUT /base/height" + json + "1").status == 405);
  CHECK(robot.bench.ask("POST /base/actions/honk").status == 204);
  CHECK(robot.bench.ask("PUT /base/label" + json + "7").status == 204);
  CHECK(robot.bench.ask("POST /lamp/actions/on").status == 204);
  CHECK(robot.bench.ask("GET /base/speed").status == 200);
  CHECK(robot.bench.turtle("PUT", "/base/map/walls", "<> rdfs:label \"x\" .").status == 204);
  CHECK(robot.bench.ask("POST /base/actions/stop").status == 204);
  CHECK(robot.drives + robot.turns == 0);
  CHECK(robot.speed == 0);
  CHECK(robot.label == 7);
}

TEST_CASE("what is unavailable says so, with the reason, until it is released", "[engine][stop][R1.10]") {
  Robot robot;
  robot.stop();
  CHECK(robot.bench.get("/base/actions/drive").says("lrt:unavailable"));
  CHECK_FALSE(robot.bench.get("/base").says("<http://localhost/base/actions/drive>"));
  CHECK(robot.bench.get("/base").says("<http://localhost/base/actions/honk>"));
  for (const char* const path : {"/base/speed", "/base/points", "/base/arm/angle", "/base/arm/actions/turn"}) {
    CAPTURE(path);
    CHECK(robot.bench.get(path).says("lrt:unavailable"));
  }
  for (const char* const path :
       {"/base/label", "/base/height", "/base/actions/honk", "/base/actions/stop", "/base/actions/release", "/lamp/actions/on"}) {
    CAPTURE(path);
    CHECK_FALSE(robot.bench.get(path).says("lrt:unavailable"));
  }
  CHECK(robot.bench.ask("GET /base/actions/drive\nAccept: application/json").says(R"("unavailable":"the robot is stopped")"));
  CHECK(robot.bench.ask("GET /base\nAccept: application/json").says(R"("unavailable":"the robot is stopped")"));
  CHECK(robot.release().status == 204);
  for (const char* const path : {"/base/speed", "/base/points", "/base/actions/drive", "/base/arm/actions/turn"})
    CHECK_FALSE(robot.bench.get(path).says("lrt:unavailable"));
  CHECK(robot.bench.get("/base").says("<http://localhost/base/actions/drive>"));
  CHECK(robot.drive() == 204);
}

TEST_CASE("the state is at the root, at the Thing and in each format", "[engine][stop][json_ld][R0.4]") {
  Robot robot;
  const std::string moving = R"({"stopped":false})";
  robot.bench.run();
  CHECK(robot.state() == moving);
  CHECK(robot.bench.ask("GET /\nAccept: application/json")
            .says(R"("stopStates":[{"thing":"http://localhost/base","state":"http://localhost/base/stopped","stopped":false,)"
                  R"("release":"http://localhost/base/actions/release"}])"));
  robot.stop("\nWho: anna");
  const std::string entry =
      R"("stopStates":[{"thing":"http://localhost/base","state":"http://localhost/base/stopped","stopped":true,"since":"2026-11-21T10:38:39Z","by":"anna",)"
      R"("release":"http://localhost/base/actions/release"}])";
  for (const char* const path : {"/", "/base", "/base/arm"}) {
    CAPTURE(path);
    CHECK(robot.bench.ask(std::string("GET ") + path + "\nAccept: application/json").says(entry));
  }
  CHECK_FALSE(robot.bench.ask("GET /lamp\nAccept: application/json").says("stopStates"));
  CHECK(missing(robot.bench.get("/"),
                "</> lrt:stopState <base/stopped> . <base/stopped> a lrt:StopState ; lrt:stopped true ; lrt:stoppedBy \"anna\" ;"
                " lrt:stoppedSince \"2026-11-21T10:38:39Z\"^^xsd:dateTime ; lrt:release <base/actions/release> .") == "");
  CHECK(missing(robot.bench.get("/base"), "<base> lrt:stopState <base/stopped> . <base/stopped> a lrt:StopState .") == "");
  CHECK(missing(robot.bench.get("/base/actions/release"), "<base/actions/release> a lrt:ReleaseAction .") == "");
  CHECK(robot.bench.ask("GET /base/actions/release\nAccept: application/json").says(R"("release":true)"));
  CHECK(
      robot.bench.ask("GET /base/state\nAccept: application/json").says(R"("stopped":{"stopped":true,"since":"2026-11-21T10:38:39Z","by":"anna"})"));
  CHECK(robot.bench.ask("GET /all\nAccept: application/json").says(R"("by":"anna")"));
  for (const char* const type : {"text/turtle", "application/n-triples", "application/ld+json", "application/json", "application/cbor"}) {
    CAPTURE(type);
    const Answer answer = robot.bench.ask(std::string("GET /base/stopped\nAccept: ") + type);
    CHECK(answer.status == 200);
    CHECK(answer.says("anna"));
  }
}

TEST_CASE("the documents of a Thing with a stop state conform to its Blueprint", "[engine][stop][R1.7]") {
  Robot robot;
  for (const bool stopped : {false, true}) {
    CAPTURE(stopped);
    robot.press(stopped);
    const auto get = [&](const std::string& path) { return robot.bench.get(path); };
    for (const char* const thing : {"/base", "/base/arm"}) {
      const shacl::Shapes shapes = shacl::Shapes::compile(lrt::test::blueprint_of(get, thing)).value();
      for (const std::string& path : {thing + std::string("/state"), std::string("/all"), std::string("/base/stopped"), std::string("/")}) {
        CAPTURE(thing, path);
        const auto report = shacl::validate(shapes, get(path).graph()).value();
        CHECK((report.conforms() ? "" : report.to_text()) == "");
      }
    }
  }
}

TEST_CASE("a press at the hardware shows without a principal, and so does its end", "[engine][stop]") {
  Robot robot;
  robot.wait();
  const auto channel = robot.bench.open("/base/stopped", "Accept: application/json\n");
  (void)robot.bench.messages(channel);
  robot.press(true);
  CHECK(robot.state().find(R"("by":"the robot itself")") != std::string::npos);
  const auto pressed = robot.bench.messages(channel);
  CHECK(robot.drive() == 409);
  robot.press(false);
  const auto released = robot.bench.messages(channel);
  CHECK(robot.drive() == 204);
  CHECK(released == std::vector<std::string>{R"({"stopped":false})"});
}

TEST_CASE("observers of the state, of the Thing and of its actions get the change", "[engine][stop][R0.12]") {
  Robot robot;
  robot.wait();
  const auto state = robot.bench.open("/base/stopped", "Accept: application/json\n"), thing = robot.bench.open("/base", "Accept: application/json\n"),
             action = robot.bench.open("/base/actions/drive", "Accept: application/json\n");
  (void)robot.bench.pushes();
  robot.stop("\nWho: anna");
  robot.bench.look();
  std::map<engine::Channel, std::string> last;
  for (const auto& [channel, push] : robot.bench.pushes())
    if (push.message) last[channel] = *push.message;
  CHECK(last[state].find(R"("by":"anna")") != std::string::npos);
  CHECK(last[thing].find(R"("by":"anna")") != std::string::npos);
  CHECK(last[action].find(R"("unavailable":)") != std::string::npos);
}

TEST_CASE("a release needs an expiry, ends the stop, and is refused while the robot says that it is stopped", "[engine][stop]") {
  Robot robot;
  robot.stop("\nWho: anna");
  const Answer without = robot.bench.ask("POST /base/actions/release");
  CHECK(without.status == 428);
  CHECK(without.says("ns#ExpiryRequired"));
  CHECK(without.says("curl"));
  CHECK(robot.releases == 0);
  SECTION("the hardware agrees") {
    CHECK(robot.release("\nWho: bert").status == 204);
    CHECK(robot.state() == R"({"stopped":false})");
    CHECK(robot.drive() == 204);
  }
  SECTION("the hardware is still pressed") {
    robot.releases_flag = false;
    const Answer refused = robot.release("\nWho: bert");
    check_stopped(refused);
    CHECK(refused.says("still stopped"));
    CHECK(robot.releases == 1);
    CHECK(robot.bench.get("/base/actions/release/i2").says("lrt:failed"));
    CHECK(robot.state().find(R"("by":"anna")") != std::string::npos);
    CHECK(robot.drive() == 409);
  }
  SECTION("the hardware needs a moment") {
    robot.releases_flag = false;
    const Bench::Sent sent = robot.send_release();
    robot.bench.run();
    CHECK_FALSE(robot.bench.answer(sent));
    CHECK(robot.drive() == 409);
    robot.flag = false;
    robot.bench.clock.advance(milliseconds(50));
    robot.bench.run();
    REQUIRE(robot.bench.answer(sent));
    CHECK(robot.bench.answer(sent)->status == 204);
    CHECK(robot.drive() == 204);
  }
}

TEST_CASE("a stop that the host never confirms holds until a release", "[engine][stop]") {
  Robot robot;
  robot.stops_flag = false;
  robot.stop("\nWho: anna");
  for (int i = 0; i < 5; ++i) robot.wait();
  CHECK(robot.drive() == 409);
  CHECK(robot.state().find(R"("by":"anna")") != std::string::npos);
  CHECK(robot.log.find("its state does not say so") != std::string::npos);
  CHECK(robot.release().status == 204);
  CHECK(robot.drive() == 204);
}

TEST_CASE("after the host has confirmed a stop, its word alone counts", "[engine][stop]") {
  Robot robot(false);
  robot.stop();
  robot.wait();
  CHECK(robot.drive() == 409);
  robot.press(false);
  CHECK(robot.drive() == 204);
}

TEST_CASE("a stop ends the releases that were sent before it", "[engine][stop]") {
  Robot robot;
  robot.stop();
  SECTION("one that waits never runs") {
    const Bench::Sent release = robot.send_release(), stop = robot.bench.send("POST /base/actions/stop\nWho: bert");
    robot.bench.run();
    check_stopped(*robot.bench.answer(release));
    CHECK(robot.releases == 0);
  }
  SECTION("one that has run before") {
    robot.releases_flag = false;  // the robot still says that it is stopped
    const Bench::Sent release = robot.send_release();
    robot.bench.run();
    CHECK_FALSE(robot.bench.answer(release));
    robot.stop();
    REQUIRE(robot.bench.answer(release));
    check_stopped(*robot.bench.answer(release));
  }
  SECTION("one that runs: what the host says afterwards confirms nothing") {
    robot.releases_flag = false;
    const Bench::Sent release = robot.send_release();
    auto jobs = robot.bench.take_jobs();
    REQUIRE(jobs.size() == 1);
    const Bench::Sent stop = robot.bench.send("POST /base/actions/stop");
    // The lambda of the release has begun on another thread, and ends after that of the stop.
    jobs[0].run();
    robot.bench.run();
    robot.press(false);
    CHECK(robot.release().status == 204);
  }
  robot.wait();
}

TEST_CASE("an overtaken release that is running leaves the newer stop in force", "[engine][stop]") {
  Bench bench;
  bool flag = false;
  std::vector<Responder> releases;
  Thing base{"base"};
  int drives = 0;
  base.action("drive", [&] { ++drives; });
  Action release = base.action("release", [&](Responder done) { releases.push_back(std::move(done)); });
  base.action("stop", [&] { flag = true; }).stop([&] { return flag; }, release);
  bench.add(std::move(base));
  const auto valid = [&] {
    TimePoint until = bench.clock.now();
    until.steady += seconds(2);
    return "\nValid-Until: " + bench.engine.robot_time(until);
  };
  CHECK(bench.ask("POST /base/actions/stop").status == 204);
  CHECK(bench.ask("POST /base/actions/release" + valid()).status == 204);  // it is accepted, and runs
  CHECK(bench.ask("POST /base/actions/stop").status == 204);
  REQUIRE(releases.size() == 1);
  CHECK(releases[0].cancelled());
  flag = false;  // what the older release does nevertheless
  releases[0].succeed();
  bench.clock.advance(milliseconds(500));
  bench.run();
  CHECK(bench.ask("POST /base/actions/drive").status == 409);
  const Bench::Sent again = bench.send("POST /base/actions/release" + valid());
  bench.run();
  releases.at(1).succeed();
  bench.run();
  CHECK(bench.answer(again)->status == 204);
  CHECK(bench.ask("POST /base/actions/drive").status == 204);
  CHECK(drives == 1);
}

TEST_CASE("a stop without principals is by somebody, and the first stop gives its name", "[engine][stop]") {
  Robot robot;
  robot.wait();
  robot.stop();
  CHECK(robot.state().find(R"("by":"somebody")") != std::string::npos);
  robot.bench.clock.advance(seconds(5));
  robot.stop("\nWho: anna");
  CHECK(robot.state().find(R"("since":"2026-11-21T10:38:39.15Z","by":"somebody")") != std::string::npos);
}

TEST_CASE("further stops of a robot that is stopped change nothing that is kept or seen", "[engine][stop]") {
  Robot robot;
  robot.wait();
  robot.stop();
  robot.wait();
  const auto before = robot.bench.engine.structure();
  for (int i = 0; i < 5; ++i) CHECK(robot.stop().status == 204);
  robot.wait();
  CHECK(robot.bench.engine.structure() == before);
  CHECK(robot.stops == 6);
}

TEST_CASE("a stop above stops what is below, and each is released by itself", "[engine][stop]") {
  Bench bench;
  bool base_flag = false, arm_flag = false;
  Thing base{"base"}, arm{"base/arm"};
  for (const auto& [thing, flag] : {std::pair(&base, &base_flag), std::pair(&arm, &arm_flag)}) {
    thing->action("go", [] {});
    bool* const its = flag;
    Action release = thing->action("release", [its] { *its = false; });
    thing->action("stop", [its] { *its = true; }).stop([its] { return *its; }, release);
  }
  bench.add(std::move(arm));  // in any order
  bench.add(std::move(base));
  const auto go = [&](const std::string& path) { return bench.ask("POST " + path + "/actions/go").status; };
  const auto release = [&](const std::string& path) {
    TimePoint until = bench.clock.now();
    until.steady += seconds(2);
    return bench.ask("POST " + path + "/actions/release\nValid-Until: " + bench.engine.robot_time(until)).status;
  };
  bench.run();
  bench.ask("POST /base/arm/actions/stop");
  CHECK(go("/base") == 204);
  CHECK(go("/base/arm") == 409);
  bench.ask("POST /base/actions/stop");
  CHECK(go("/base") == 409);
  CHECK(release("/base/arm") == 204);
  CHECK(bench.ask("GET /base/arm/stopped\nAccept: application/json").body == R"({"stopped":false})");
  CHECK(go("/base/arm") == 409);
  CHECK(release("/base") == 204);
  CHECK(go("/base/arm") == 204);
  const std::string root = bench.ask("GET /\nAccept: application/json").body;
  CHECK(root.find(R"("state":"http://localhost/base/stopped")") != std::string::npos);
  CHECK(root.find(R"("state":"http://localhost/base/arm/stopped")") != std::string::npos);
  bench.ask("POST /base/actions/stop");
  bench.engine.remove("base").value();  // and what is below
  CHECK(bench.get("/base/arm").status == 404);
}

TEST_CASE("a Thing that is added below a stopped one is stopped, and one that is left is not", "[engine][stop]") {
  Robot robot;
  robot.stop();
  Thing hand{"base/arm/hand"};
  hand.action("close", [] {});
  robot.bench.add(std::move(hand));
  check_stopped(robot.bench.ask("POST /base/arm/hand/actions/close"));
  CHECK(robot.bench.get("/base/arm/hand/actions/close").says("lrt:unavailable"));
  CHECK(robot.release().status == 204);
  CHECK(robot.bench.ask("POST /base/arm/hand/actions/close").status == 204);
}

TEST_CASE("a robot with 600 Things: one truth on each", "[engine][stop]") {
  Bench bench;
  bool flag = false;
  std::vector<Thing> things;
  things.emplace_back("robot");
  Action release = things[0].action("release", [&] { flag = false; });
  things[0].action("stop", [&] { flag = true; }).stop([&] { return flag; }, release);
  for (int i = 1; i < 600; ++i) {
    things.emplace_back("robot/j" + std::to_string(i));
    things.back().action("turn", [] {});
    things.back().property<double>("angle").on_write([](double) {}).publish(0);
  }
  bench.engine.add(std::move(things)).value();
  bench.run();
  const auto all_are = [&](bool stopped) {
    for (int i = 1; i < 600; ++i) {
      const std::string path = "/robot/j" + std::to_string(i);
      if (bench.get(path + "/actions/turn").says("lrt:unavailable") != stopped) return path;
      const bool says = bench.ask("GET " + path + "\nAccept: application/json").says(R"("stopped":true,"since":)");
      if (says != stopped) return path + " in JSON";
    }
    return std::string();
  };
  CHECK(all_are(false).empty());
  bench.ask("POST /robot/actions/stop");
  CHECK(all_are(true).empty());
  check_stopped(bench.ask("POST /robot/j599/actions/turn"));
  flag = false;
  TimePoint until = bench.clock.now();
  until.steady += seconds(2);
  CHECK(bench.ask("POST /robot/actions/release\nValid-Until: " + bench.engine.robot_time(until)).status == 204);
  CHECK(all_are(false).empty());
}

TEST_CASE("the state may be a Property, published or read", "[engine][stop]") {
  Bench bench;
  int drives = 0;
  SECTION("published") {
    Thing base{"base"};
    base.action("drive", [&] { ++drives; });
    auto pressed = base.property<bool>("pressed");
    base.action("stop", [] {}).stop(pressed);
    bench.add(std::move(base));
    check_stopped(bench.ask("POST /base/actions/drive"));  // it has not said anything yet
    pressed.publish(false);
    bench.look();
    (void)bench.pushes();
    CHECK(bench.ask("POST /base/actions/drive").status == 204);
    pressed.publish(true);
    bench.look();
    (void)bench.pushes();
    check_stopped(bench.ask("POST /base/actions/drive"));
    bench.ask("POST /base/actions/stop");  // it says true already: that confirms
    pressed.publish(false);
    bench.look();
    (void)bench.pushes();
    CHECK(bench.ask("POST /base/actions/drive").status == 204);
    CHECK(drives == 2);
  }
  SECTION("read") {
    bool flag = false, throws = false;
    Thing base{"base"};
    base.action("drive", [&] { ++drives; });
    auto pressed = base.property("pressed", [&] { return throws ? throw std::runtime_error("no contact") : flag; });
    base.action("stop", [&] { flag = true; }).stop(pressed);
    bench.add(std::move(base));
    CHECK(bench.ask("POST /base/actions/drive").status == 204);
    const auto wait = [&] {
      bench.clock.advance(milliseconds(150));
      (void)bench.pushes();
    };
    flag = true;
    wait();
    check_stopped(bench.ask("POST /base/actions/drive"));
    flag = false;
    wait();
    CHECK(bench.ask("POST /base/actions/drive").status == 204);
    throws = true;
    wait();
    check_stopped(bench.ask("POST /base/actions/drive"));
    throws = false;
    wait();
    CHECK(bench.ask("POST /base/actions/drive").status == 204);
    bench.ask("POST /base/actions/stop");
    check_stopped(bench.ask("POST /base/actions/drive"));
    flag = false;
    wait();
    CHECK(bench.ask("POST /base/actions/drive").status == 204);
  }
}

TEST_CASE("a release needs its right: the matrix", "[engine][stop][security]") {
  Robot robot;
  const auto give = [&](const char* name, Rights granted) { robot.rights[name] = std::make_shared<const security::View>(granted); };
  const Rights reads = Right::read;
  give("reader", reads);
  give("driver", reads | Right::write | Right::invoke);
  give("chief", reads | Right::release);
  struct Row {
    const char *who, *path;
    int status;
  };
  for (const Row& row : {Row{"reader", "stop", 403}, Row{"driver", "stop", 204}, Row{"chief", "stop", 403}, Row{"reader", "release", 403},
                         Row{"driver", "release", 403}, Row{"chief", "drive", 403}, Row{"driver", "drive", 409}, Row{"chief", "release", 204},
                         Row{"driver", "drive", 204}}) {
    CAPTURE(row.who, row.path);
    const std::string who = std::string("\nWho: ") + row.who;
    CHECK(robot.bench.ask(std::string("POST /base/actions/") + row.path + who + robot.valid()).status == row.status);
  }
  CHECK_FALSE(robot.bench.ask("GET /base/actions/release\nWho: driver").says("hybrit:binding"));
  CHECK(robot.bench.ask("GET /base/actions/release\nWho: chief").says("hybrit:binding"));
  CHECK(Rights::all().has(Right::release));
  CHECK(security::default_roles().at("operator").has(Right::release));
  CHECK_FALSE(security::default_roles().at("reader").has(Right::release));
}

TEST_CASE("a refusal names nothing that its sender may not see", "[engine][stop][security]") {
  Robot robot;
  auto targets = std::make_shared<security::View::Targets>();
  targets->all = {{"/", false, true}, {"/base/arm", true, true}};
  for (std::size_t i = 0; i < targets->all.size(); ++i) targets->by_path.emplace(targets->all[i].path, i);
  const Rights all = Right::read | Right::invoke;
  robot.rights["anna"] = std::make_shared<const security::View>(targets, std::vector<security::View::Granted>{{{}, {}}, {all, all}});
  robot.stop("\nWho: bert");
  for (const char* const text : {"POST /base/arm/actions/turn", "GET /base/arm/actions/turn", "GET /base/arm/angle", "GET /base/arm", "GET /"})
    for (const char* const type : {"application/json", "text/turtle"}) {
      CAPTURE(text, type);
      const Answer answer = robot.bench.ask(std::string(text) + "\nWho: anna\nAccept: " + type);
      CHECK_FALSE(answer.says("bert"));
      CHECK_FALSE(answer.says("base/stopped"));
      CHECK_FALSE(answer.says("/release"));
    }
  check_stopped(robot.bench.ask("POST /base/arm/actions/turn\nWho: anna"));
}

TEST_CASE("the name of the property gives way to the user's", "[engine][stop]") {
  Bench bench;
  bool flag = false;
  Thing base{"base"};
  base.property("stopped", [&] { return flag; });
  base.action("go", [] {});
  base.action("stop", [&] { flag = true; }).stop([&] { return flag; });
  bench.add(std::move(base));
  bench.run();
  CHECK(bench.ask("GET /base/stopped\nAccept: application/json").body == "false");
  CHECK(bench.ask("GET /base/stopped-lrt\nAccept: application/json").body == R"({"stopped":false})");
  CHECK(bench.ask("GET /\nAccept: application/json").says(R"("state":"http://localhost/base/stopped-lrt")"));
  Bench other;
  Thing arm{"arm"}, below{"arm/stopped"};
  arm.action("stop", [] {}).stop([] { return false; });
  other.add(std::move(arm));
  other.run();
  other.add(std::move(below));
  CHECK(other.ask("GET /arm/stopped\nAccept: application/json").says(R"("kind":"thing")"));
  CHECK(other.ask("GET /arm/stopped-lrt\nAccept: application/json").body == R"({"stopped":false})");
}

TEST_CASE("what cannot be a stop state is an error of add()", "[engine][stop]") {
  const auto error_of = [](auto set_up) {
    Thing thing{"arm"};
    set_up(thing);
    Bench bench;
    const auto added = bench.engine.add(std::move(thing));
    return added ? std::string() : added.error().message;
  };
  const auto state = [] { return false; };
  Thing other{"other"};
  Action foreign = other.action("release", [] {});
  auto foreign_property = other.property<bool>("pressed");
  CHECK(error_of([&](Thing& t) { t.action("stop", [] {}).stop(state); }).empty());
  CHECK(error_of([&](Thing& t) { t.action("stop", [] {}).stop(state, foreign); }).find("release of the same thing") != std::string::npos);
  CHECK(error_of([&](Thing& t) { t.action("stop", [] {}).stop(foreign_property); }).find("Property of the same thing") != std::string::npos);
  CHECK(error_of([&](Thing& t) {
          for (const char* const name : {"stop", "halt"}) t.action(name, [] {}).stop(state);
        }).find("twice") != std::string::npos);
  CHECK(error_of([&](Thing& t) {
          Action release = t.action("release", [] {}).stop();
          t.action("stop", [] {}).stop(state, release);
        }).find("the release is a stop") != std::string::npos);
  CHECK(error_of([&](Thing& t) { t.action("stop", [](double) {}).stop(state); }).find("takes no input") != std::string::npos);
}

TEST_CASE("set-up logs what would be unavailable, and a host without a stop state has today's behaviour", "[engine][stop]") {
  Robot robot;
  CHECK(robot.log.find("unavailable while the robot is stopped: /base/actions/drive, /base/arm/actions/turn, /base/arm/angle, /base/points, "
                       "/base/speed. Call harmless()") != std::string::npos);
  Bench bench;
  int goes = 0;
  Thing arm{"arm"};
  arm.action("go", [&] { ++goes; });
  arm.action("stop", [] {}).stop();
  bench.add(std::move(arm));
  CHECK(bench.take_jobs().empty());
  bench.ask("POST /arm/actions/stop");
  CHECK(bench.ask("POST /arm/actions/go").status == 204);
  CHECK(bench.get("/arm/stopped").status == 404);
  CHECK_FALSE(bench.ask("GET /\nAccept: application/json").says("stopStates"));
}

TEST_CASE("a second stop of the same Thing needs no state of its own", "[engine][stop]") {
  Bench bench;
  bool flag = false;
  Thing base{"base"};
  base.action("go", [] {});
  base.action("stop", [&] { flag = true; }).stop([&] { return flag; });
  base.action("halt", [&] { flag = true; }).stop();
  bench.add(std::move(base));
  bench.run();
  const Bench::Sent halt = bench.send("POST /base/actions/halt");
  check_stopped(bench.send("POST /base/actions/go").answer);
  bench.run();
}

}  // namespace

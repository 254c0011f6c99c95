// SPDX-License-Identifier: Apache-2.0
// What is hidden is not even counted: a robot with hidden things and its twin, a robot without them, are told apart by no message, tag, number or count.
#include <lrt/engine/engine.hpp>

#include <chrono>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <lrt/thing.hpp>
#include <lrt/world.hpp>

#include "src/security/policy.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/twins.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace lrt::test::twins;
using std::chrono::milliseconds;

namespace {

/// What anna reads: each aggregate in each format, a second time with its tag.
const std::vector<std::string>& aggregates() {
  static const std::vector<std::string> all = {"/",
                                               "/all",
                                               "/world",
                                               "/world?default",
                                               "/world/g0",
                                               "/world/g1",
                                               "/arm",
                                               "/arm/state",
                                               "/arm/all",
                                               "/arm/subscriptions",
                                               "/arm/list",
                                               "/arm/actions/turn",
                                               "/ns/structure",
                                               "/ns/structure?q=a",
                                               "/.well-known/void",
                                               "/?page=2",
                                               "/world?page=2",
                                               "/world?page=3",
                                               "/arm/list?page=2",
                                               "/arm/kept"};
  return all;
}

}  // namespace

TEST_CASE("a reader's messages, tags, numbers and counts are those of a robot without what is hidden", "[engine][security][world][twins]") {
  const unsigned seed = GENERATE(1U, 2U, 6U);
  CAPTURE(seed);
  std::mt19937 source(seed);
  const auto random = [&] { return static_cast<unsigned>(source()); };
  Robot robot(true), twin(false);
  for (Robot* r : {&robot, &twin}) r->subscribe();
  std::map<std::string, Plain> of_robot, of_twin;  // by channel and document
  // What hidden changes may change is the moment in which a value is found: twice, so that both robots have found it.
  const auto compare = [&](milliseconds pause) {
    auto got = robot.messages(), expected = twin.messages();
    for (const auto& [r, all] : {std::pair(&robot, &got), std::pair(&twin, &expected)}) {
      r->bench.clock.advance(pause);
      for (auto& [name, texts] : r->messages()) (*all)[name].insert((*all)[name].end(), texts.begin(), texts.end());
    }
    std::size_t count = 0;
    for (const auto& [name, channel] : robot.channels) {
      CAPTURE(name);
      std::string all_got, all_expected;
      for (const std::string& text : got[name]) all_got += of_robot[name](text);
      for (const std::string& text : expected[name]) all_expected += of_twin[name](text);
      CHECK(difference(all_got, all_expected) == "");
      count += expected[name].size();
    }
    return count;
  };
  compare(milliseconds(30));
  std::size_t messages = 0;
  for (int step = 0; step < 60; ++step) {
    CAPTURE(step);
    std::string done;
    for (unsigned n = random() % 4; n < 4; ++n) {
      const unsigned kind = random() % (Robot::changes + Robot::hidden_changes), number = random() % 1000;
      done += " " + std::to_string(kind) + ":" + std::to_string(number);
      if (kind < Robot::changes)
        for (Robot* r : {&robot, &twin}) r->change(kind, number);
      else
        for (Robot* r : {&robot, &twin}) r->change_hidden(kind - Robot::changes, number);
    }
    CAPTURE(done);
    const bool looks = random() % 3 != 0;
    const auto pause = milliseconds(30 + random() % 20);
    for (Robot* r : {&robot, &twin}) r->bench.clock.advance(pause);
    if (looks) messages += compare(pause);
    if (step % 6 != 0) continue;
    std::vector<std::string> paths = aggregates();
    for (const std::string& path : twin.subscriptions()) paths.push_back(path);
    CHECK(paths.size() > aggregates().size() + 20);
    for (const std::string& path : paths)
      for (const std::string type : {"application/json", "text/turtle", "application/n-triples", "application/trig"}) {
        CAPTURE(path, type);
        const std::string request = "GET " + path + "\n" + by("anna") + "Accept: " + type + "\n";
        const Answer got = robot.bench.ask(request), expected = twin.bench.ask(request);
        CHECK(difference(Plain()(got.body), Plain()(expected.body)) == "");
        CHECK(difference(of_robot[path + type](got), of_twin[path + type](expected)) == "");
        if (expected.tag().empty()) continue;
        const unsigned kind = random() % Robot::hidden_changes, number = random() % 1000;
        for (Robot* r : {&robot, &twin}) r->change_hidden(kind, number);
        CHECK(difference(of_robot[path + type](robot.bench.ask(request + "If-None-Match: " + got.tag() + "\n")),
                         of_twin[path + type](twin.bench.ask(request + "If-None-Match: " + expected.tag() + "\n"))) == "");
      }
  }
  CHECK(messages > 200);
  CHECK(robot.for_carl > 5);
}

TEST_CASE("for a reader of several values no lambda runs that returns a value which the reader may not see", "[engine][security][twins]") {
  int reads = 0, hidden_reads = 0;
  const auto ids = std::make_shared<TwinIds>();
  Bench bench(options_with(ids));
  Thing arm{"arm"};
  arm.property("pulled", [&] { return ++reads; });
  arm.property("veiled", [&] { return ++hidden_reads; });
  bench.add(std::move(arm));
  for (const char* path : {"/arm/state", "/all"}) {
    CAPTURE(path);
    reads = hidden_reads = 0;
    CHECK(bench.ask("GET " + std::string(path) + "\n" + by("anna") + "Accept: application/json\n").status == 200);
    CHECK(reads == 1);
    CHECK(hidden_reads == 0);
    CHECK(bench.ask("GET " + std::string(path) + "\n" + by("carl") + "Accept: application/json\n").status == 200);
    CHECK(hidden_reads == 1);
  }
  hidden_reads = 0;
  (void)bench.open_stream("/arm/state?accept=application/json", by("anna"));
  CHECK(hidden_reads == 0);
}

TEST_CASE("principals with equal rights have the same tags of a graph", "[engine][security][world][twins]") {
  Robot robot(GENERATE(false, true));
  for (const char* reader : {"anna", "carl"}) {
    robot.change(0, 0);
    const std::string tag = robot.bench.ask("GET /world/g0\n" + by(reader) + "Accept: text/turtle\n").tag();
    CHECK(
        robot.bench.turtle("PUT", "/world/g0", "<#x> rdfs:label 1 .", by(std::string(reader) == "carl" ? "carl" : "bert") + "If-Match: " + tag + "\n")
            .status == 204);
    CHECK(robot.bench.turtle("PUT", "/world/g0", "<#x> rdfs:label 2 .", by(reader) + "If-Match: " + tag + "\n").status == 412);
  }
}

TEST_CASE("the tag of a graph with values that a reader may and may not see is for writes that of its triples", "[engine][security][world][twins]") {
  Robot robot(true);
  const auto tag = [&] { return robot.bench.ask("GET /world/g0\n" + by("anna") + "Accept: text/turtle\n").tag(); };
  const std::string empty = tag();
  robot.veils[0]->publish(1);
  CHECK(tag() == empty);
  robot.values[0]->publish(1);
  const std::string one = tag();
  CHECK(one != empty);
  robot.veils[0]->publish(2);
  CHECK(tag() == one);
  robot.values[0]->publish(2);
  CHECK(tag() != one);
  CHECK(robot.bench.turtle("PUT", "/world/g0", "<#x> rdfs:label 1 .", by("anna") + "If-Match: " + one + "\n").status == 204);
  CHECK(robot.bench.turtle("PUT", "/world/g0", "<#x> rdfs:label 2 .", by("anna") + "If-Match: " + one + "\n").status == 412);
}

TEST_CASE("the series of numbers does not count resources", "[engine][security][twins]") {
  Robot robot(false);
  for (const char* path : {"/arm/angle", "/world/g0"}) {
    const std::string series = robot.bench.stream(path + std::string("?accept=text/turtle"), by("anna")).answer.field("Value-Series");
    CAPTURE(series);
    CHECK(series.size() - series.find('.') > 12);
    CHECK(robot.bench.stream(path + std::string("?accept=text/turtle"), by("bert")).answer.field("Value-Series") == series);
  }
}

TEST_CASE("who may observe a resource and not read it is sent nothing of it", "[engine][security][world][twins]") {
  const auto policy = security::Policy::create({{"/", security::Scope::tree, {security::Who::Kind::anyone, {}}, Right::subscribe}}).value();
  engine::EngineOptions options;
  options.authorize = [&](const http::Request&) {
    engine::Caller caller;
    caller.view = policy->view(nullptr);
    return caller;
  };
  Bench bench(std::move(options));
  World world("world");
  WorldGraph map = world.graph("map");
  int said = 1, opened = 0;
  const auto say = [&](int n) {
    map.update([&](GraphUpdate& u) { u.add("https://example.org/cup", label, "secret " + std::to_string(n)); }).value();
  };
  say(1);
  bench.add(std::move(world));
  Thing arm{"arm"};
  arm.title("secret arm");
  auto word = arm.property<std::string>("word");
  word.representation("application/x-word", [](const std::string& text) { return text; });
  bench.add(std::move(arm));
  word.publish("secret 1");
  for (const char* path : {"/arm/word?accept=application/json", "/arm/word?accept=text/plain", "/arm/word?accept=text/turtle",
                           "/arm/state?accept=application/json", "/arm?accept=application/json", "/arm/state?accept=text/turtle",
                           "/world/map?accept=text/turtle", "/world?accept=text/turtle", "/world?accept=application/json"}) {
    CAPTURE(path);
    const auto sent = bench.stream(path);
    if (!sent.channel) continue;
    ++opened;
    for (const std::string& message : bench.messages(*sent.channel)) {
      CHECK(message.find("secret") == std::string::npos);
      CHECK(message.find("\"triples\":1") == std::string::npos);
    }
    say(++said);
    word.publish("secret " + std::to_string(said));
    bench.look();
    for (const std::string& message : bench.messages(*sent.channel)) CHECK(message.find("secret") == std::string::npos);
  }
  CHECK(opened > 5);
}

TEST_CASE("a robot of which a reader sees no Thing looks like one without Things", "[engine][security][twins]") {
  Bench robot(options_with(std::make_shared<TwinIds>())), twin(options_with(std::make_shared<TwinIds>()));
  Thing arm{"veiled_arm"};
  arm.property<double>("angle").publish(1);
  robot.add(std::move(arm));
  for (const std::string& path : aggregates())
    for (const char* type : {"application/json", "text/turtle", "text/html"}) {
      CAPTURE(path, type);
      Plain of_robot, of_twin;
      for (const char* method : {"GET ", "OPTIONS "}) {
        const std::string request = method + path + "\n" + by("anna") + "Accept: " + type + "\n";
        CHECK(difference(of_robot(robot.ask(request)), of_twin(twin.ask(request))) == "");
      }
    }
}

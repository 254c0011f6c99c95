// SPDX-License-Identifier: Apache-2.0
// What subscribers get beside a representation: the time of the value, its number, and how many values were left out before it.
#include <lrt/engine/engine.hpp>

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/http/message.hpp>

#include "src/http/stamp.hpp"
#include "src/http/websocket.hpp"
#include "src/security/policy.hpp"
#include "src/subscription/backlog.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;
using engine::Channel;
using std::chrono::milliseconds;
using std::chrono::seconds;
using subscription::LeftOut;
using Utc = std::chrono::system_clock::time_point;

namespace {

const Utc some_time = Utc(seconds(1'800'000'000)) + std::chrono::microseconds(123'456);
const std::string json = "?accept=application/json";

/// The fields of an event, those of lrt's own included; its lines of data joined.
std::map<std::string, std::string> fields_of(const std::string& event) {
  std::map<std::string, std::string> fields;
  for (std::size_t at = 0; at < event.size();) {
    const std::size_t end = event.find('\n', at);
    const std::string line = event.substr(at, end - at);
    at = end + 1;
    if (line.empty()) continue;
    const std::size_t colon = line.find(": ");
    std::string& value = fields[line.substr(0, colon)];
    value += (value.empty() ? "" : "\n") + line.substr(colon + 2);
  }
  return fields;
}
std::uint64_t number_in(const std::map<std::string, std::string>& fields, std::string_view name) {
  const auto found = fields.find(std::string(name));
  return found == fields.end() ? 0 : std::stoull(found->second);
}

struct Arm {
  explicit Arm(engine::EngineOptions options = {}) : bench(std::move(options)) { bench.add(robot.arm()); }
  /// Published values, of which the engine sees none before it looks.
  void publish(double first, int count = 1) {
    for (int i = 0; i < count; ++i) robot.angle_handle->publish(first + i);
  }
  std::vector<std::map<std::string, std::string>> events(Channel channel) {
    bench.look();
    std::vector<std::map<std::string, std::string>> all;
    for (const std::string& event : bench.messages(channel)) all.push_back(fields_of(event));
    return all;
  }
  SampleRobot robot;
  Bench bench;
};

}  // namespace

TEST_CASE("changes that a subscriber is not sent are counted before its next message", "[subscription]") {
  LeftOut changes;
  changes.begin(5);
  CHECK(changes.sent(5) == 0);
  CHECK(changes.sent(6) == 0);
  CHECK(changes.sent(9) == 2);
  CHECK(changes.sent(9) == 0);  // repeated
  changes.unchanged(10);
  changes.unchanged(10);  // its description has changed
  CHECK(changes.sent(12) == 1);
  changes.begin(3);
  CHECK(changes.sent(8) == 5 - 1 + 1);  // the one that it began with was not sent either
  changes.begin(0);                     // no value yet
  CHECK(changes.sent(0) == 0);
  CHECK(changes.sent(1) == 0);
  changes.begin(7);
  changes.knows(7);  // Last-Event-ID
  CHECK(changes.sent(8) == 0);
}

TEST_CASE("an event has the time of its value and its number, and its data are what GET responds", "[engine][event stream][R0.12]") {
  Arm arm;
  const Bench::Sent opened = arm.bench.stream("/arm/angle");
  REQUIRE(opened.channel);
  CHECK_FALSE(opened.answer.field("Value-Series").empty());
  const Channel channel = *opened.channel;
  const auto first = arm.events(channel);
  REQUIRE(first.size() == 1);
  const std::uint64_t number = number_in(first[0], http::event_sequence);
  arm.robot.angle_handle->publish(20, some_time);
  const auto second = arm.events(channel);
  REQUIRE(second.size() == 1);
  CHECK(second[0].at("time") == "2027-01-15T08:00:00.123456Z");
  CHECK(number_in(second[0], http::event_sequence) == number + 1);
  CHECK(second[0].count("left-out") == 0);
  const Answer got = arm.bench.get("/arm/angle");
  CHECK(second[0].at("id") == got.tag());
  CHECK(got.body.find("2027-01-15T08:00:00.123456Z") != std::string::npos);  // SPEC 3.8
}

TEST_CASE("values that newer ones have overwritten, a full queue and a minimum interval leave out: received and left out are all",
          "[engine][R0.12]") {
  for (const char* policy : {"", "&queueLength=4", "&minimumInterval=1", "&queueLength=2&minimumInterval=1"}) {
    INFO(policy);
    Arm arm;
    const Channel channel = arm.bench.open_stream("/arm/angle" + json + policy);
    std::uint64_t received = 0, left_out = 0, sequence = 0, published = 0;
    const auto take = [&] {
      for (const auto& event : arm.events(channel)) {
        if (sequence != 0) CHECK(number_in(event, http::event_sequence) == sequence + number_in(event, http::event_left_out) + 1);
        sequence = number_in(event, http::event_sequence);
        left_out += number_in(event, http::event_left_out);
        ++received;
      }
    };
    take();
    REQUIRE(received == 1);
    CHECK(left_out == 0);
    for (int round = 0; round < 5; ++round) {
      arm.publish(10'000.5 + 100 * round, 20 + round);
      published += 20U + static_cast<unsigned>(round);
      take();
      arm.bench.clock.advance(seconds(round == 4 ? 5 : 0));
    }
    while (true) {
      const std::uint64_t before = received;
      arm.bench.clock.advance(seconds(2));
      take();
      if (before == received) break;
    }
    CHECK(received - 1 + left_out == published);
    CHECK(left_out > 0);
  }
}

TEST_CASE("a change without a message of its own is not a loss", "[engine][R0.12]") {
  Arm arm;
  const Channel channel = arm.bench.open_stream("/arm/angle" + json + "&queueLength=8");
  std::uint64_t left_out = 0;
  const auto take = [&] {
    for (const auto& event : arm.events(channel)) left_out += number_in(event, http::event_left_out);
  };
  take();
  // What a client writes, and the robot then publishes; a description that changes; the first value once more.
  REQUIRE(arm.bench.turtle("PUT", "/arm/angle", number_body("33", "maths:Degree")).status == 204);
  take();
  arm.publish(33);
  take();
  arm.bench.add(arm.robot.tool());
  take();
  arm.publish(34);
  take();
  CHECK(left_out == 0);
  // A client that reconnects has the value already.
  const std::string tag = arm.bench.ask("GET /arm/angle\nAccept: application/json").tag();
  const Channel again = arm.bench.open_stream("/arm/angle" + json, "Last-Event-ID: " + tag + "\n");
  CHECK(arm.events(again).empty());
  arm.publish(35);
  const auto next = arm.events(again);
  REQUIRE(next.size() == 1);
  CHECK(next[0].count("left-out") == 0);
}

TEST_CASE("a state counts the changes of its properties", "[engine][R0.12]") {
  Arm arm;
  Thing other{"other"};
  auto x = other.property<double>("x"), y = other.property<double>("y");
  x.publish(1);
  y.publish(2);
  arm.bench.add(std::move(other));
  const Channel channel = arm.bench.open_stream("/other/state" + json);
  const auto first = arm.events(channel);
  REQUIRE(first.size() == 1);
  x.publish(41, some_time + seconds(1));
  y.publish(42, some_time);
  const auto second = arm.events(channel);
  REQUIRE(second.size() == 1);
  CHECK(second[0].at("time") == "2027-01-15T08:00:01.123456Z");
  CHECK(number_in(second[0], "left-out") == 1);
  CHECK(number_in(second[0], "sequence") == number_in(first[0], "sequence") + 2);
}

TEST_CASE("neither the number nor the time shows what a reader may not see", "[engine][security][R0.12]") {
  using security::View;
  using Granted = View::Granted;
  const security::Rights reads = security::Right::read | security::Right::subscribe;
  const auto targets = [] {
    auto made = std::make_shared<View::Targets>();
    made->all = {{"/", false, true}, {"/other/hidden", true, false}};
    for (std::size_t i = 0; i < made->all.size(); ++i) made->by_path.emplace(made->all[i].path, i);
    return made;
  }();
  engine::EngineOptions options;
  options.authorize =
      [view = std::make_shared<const View>(targets, std::vector<Granted>{{reads, reads}, {security::Right::subscribe, {}}})](const http::Request&) {
        engine::Caller caller;
        caller.principal = std::make_shared<const security::Principal>(security::Principal{"anna", {}});
        caller.view = view;
        return caller;
      };
  Arm arm(std::move(options));
  Thing other{"other"};
  auto shown = other.property<double>("shown"), hidden = other.property<double>("hidden");
  shown.publish(1, some_time);
  hidden.publish(2, some_time + seconds(100));
  arm.bench.add(std::move(other));
  REQUIRE(arm.bench.ask("GET /other/shown").status == 200);
  REQUIRE(arm.bench.ask("GET /other/hidden").status != 200);
  const Channel channel = arm.bench.open_stream("/other/state" + json);
  auto all = arm.events(channel);
  for (int i = 0; i < 9; ++i) hidden.publish(3 + i, some_time + seconds(200));
  shown.publish(2, some_time + seconds(1));
  for (auto& event : arm.events(channel)) all.push_back(std::move(event));
  REQUIRE(all.size() == 2);
  CHECK(all[0].at("time") == "2027-01-15T08:00:00.123456Z");
  CHECK(all[1].at("time") == "2027-01-15T08:00:01.123456Z");
  CHECK(number_in(all[1], "sequence") == number_in(all[0], "sequence") + 1);
  CHECK(all[1].count("left-out") == 0);
}

TEST_CASE("a WebSocket that offers the subprotocol gets a stamp before each representation", "[engine][R0.14]") {
  Arm arm;
  const Bench::Sent plain = arm.bench.upgrade("/arm/angle", "Sec-WebSocket-Protocol: chat\nAccept: application/json\n");
  REQUIRE(plain.channel);
  CHECK(plain.answer.field("Sec-WebSocket-Protocol").empty());
  const Bench::Sent opened = arm.bench.upgrade("/arm/angle", "Sec-WebSocket-Protocol: chat, lrt.stamped\nAccept: application/json\n");
  REQUIRE(opened.channel);
  CHECK(opened.answer.field("Sec-WebSocket-Protocol") == http::stamped_protocol);
  (void)arm.bench.pushes();
  arm.robot.angle_handle->publish(1, some_time);
  arm.robot.angle_handle->publish(2, some_time);
  arm.bench.look();
  std::map<std::uint64_t, std::vector<std::string>> got;
  for (const auto& [channel, push] : arm.bench.pushes()) {
    CHECK(push.text);
    got[static_cast<std::uint64_t>(channel)].push_back(*push.message);
  }
  const std::string body = arm.bench.ask("GET /arm/angle\nAccept: application/json").body;
  CHECK(got[static_cast<std::uint64_t>(*plain.channel)] == std::vector<std::string>{body});
  const std::vector<std::string>& stamped = got[static_cast<std::uint64_t>(*opened.channel)];
  REQUIRE(stamped.size() == 2);
  CHECK(stamped[0] == R"({"time":"2027-01-15T08:00:00.123456Z","sequence":3,"leftOut":1})");
  CHECK(stamped[1] == body);
}

TEST_CASE("the last messages of a stamped WebSocket have their stamps, and one is never cut off from its representation", "[engine][R0.14]") {
  Arm arm;
  arm.bench.add(arm.robot.tool());
  Thing thing{"other"};
  auto value = thing.property<double>("value");
  value.publish(1);
  arm.bench.add(std::move(thing));
  const Channel channel = *arm.bench.upgrade("/other/value?queueLength=9", "Sec-WebSocket-Protocol: lrt.stamped\nAccept: application/json\n").channel;
  while (arm.bench.engine.next_ready(arm.bench.clock.now())) {}
  const auto stamp = arm.bench.engine.next_push(channel, arm.bench.clock.now());
  REQUIRE(stamp);
  CHECK(stamp->message->find("\"sequence\":1") != std::string::npos);
  CHECK(stamp->message->find("\"series\":\"") != std::string::npos);
  value.publish(2);
  arm.bench.look();
  (void)arm.bench.engine.next_ready(arm.bench.clock.now());
  REQUIRE(arm.bench.engine.remove("other").has_value());
  std::vector<std::string> rest;
  while (const auto push = arm.bench.engine.next_push(channel, arm.bench.clock.now())) {
    if (push->close != 0) break;
    rest.push_back(*push->message);
  }
  REQUIRE(rest.size() == 3);
  CHECK(rest[0] == "1");
  CHECK(rest[1].find("\"sequence\":2,\"leftOut\":0}") != std::string::npos);
  CHECK(rest[2] == "2");
}

TEST_CASE("a notification has its stamp in header fields, and keeps it when it is sent again", "[engine][R0.16]") {
  engine::EngineOptions options;
  options.callbacks.allow = {"127.0.0.0/8"};
  Arm arm(std::move(options));
  const auto due = [&] {
    arm.bench.look();
    (void)arm.bench.pushes();
    std::vector<Channel> channels;
    for (const subscription::ReadyCallback& ready : arm.bench.take_callbacks()) channels.push_back(ready.channel);
    REQUIRE(channels.size() == 1);
    auto notice = arm.bench.engine.next_notification(channels[0], arm.bench.clock.now());
    REQUIRE(notice);
    return std::pair{channels[0], *std::move(notice)};
  };
  const auto field = [](const subscription::Notification& n, std::string_view name) { return std::string(n.fields.find(name).value_or("")); };
  REQUIRE(arm.bench.ask("GET /arm/angle?queueLength=3\nUpgrade: callback\nAccept: application/json\nCallback: http://127.0.0.1:9/r").status == 201);
  (void)arm.bench.take_saved();
  auto [channel, first] = due();
  CHECK(field(first, http::sequence_field) == "1");
  CHECK(field(first, http::left_out_field).empty());
  CHECK_FALSE(field(first, http::series_field).empty());
  arm.bench.engine.delivered(channel, {204, {}, false, false}, arm.bench.clock.now());
  arm.robot.angle_handle->publish(1, some_time);
  for (int i = 2; i < 7; ++i) arm.robot.angle_handle->publish(i, some_time);
  auto second = due().second;
  CHECK(field(second, http::sequence_field) == "5");
  CHECK(field(second, http::left_out_field) == "3");
  CHECK(field(second, http::time_field) == "2027-01-15T08:00:00.123456Z");
  arm.bench.engine.delivered(channel, {500, {}, false, false}, arm.bench.clock.now());
  arm.bench.clock.advance(std::chrono::hours(1));
  auto again = due().second;
  CHECK(*again.body == *second.body);
  for (const std::string_view name : {http::sequence_field, http::left_out_field, http::time_field, http::series_field})
    CHECK(field(again, name) == field(second, name));
  // It fails once more, and the queue has no room for it: it is left out, too.
  for (int i = 10; i < 20; ++i) arm.robot.angle_handle->publish(i, some_time);
  arm.bench.look();
  (void)arm.bench.pushes();
  arm.bench.engine.delivered(channel, {500, {}, false, false}, arm.bench.clock.now());
  arm.bench.clock.advance(std::chrono::hours(2));
  auto later = due().second;
  CHECK(std::stoull(field(later, http::sequence_field)) - 1 - std::stoull(field(later, http::left_out_field)) == 1);
}

TEST_CASE("a feed gets the time and the number of each message", "[engine]") {
  Arm arm;
  engine::FeedSubscription wanted;
  wanted.path = "/arm/angle";
  wanted.media_type = "application/json";
  const auto subscribed = arm.bench.engine.subscribe(std::move(wanted), arm.bench.clock.now());
  REQUIRE(subscribed);
  const auto next = [&] {
    arm.bench.look();
    arm.bench.run();
    while (arm.bench.engine.next_ready(arm.bench.clock.now())) {}
    return arm.bench.engine.next_feed_message(subscribed->channel, arm.bench.clock.now());
  };
  const auto first = next();
  REQUIRE(first);
  CHECK(first->number == 1);
  CHECK_FALSE(next());
  arm.robot.angle_handle->publish(1, some_time);
  arm.robot.angle_handle->publish(2, some_time);
  const auto second = next();
  REQUIRE(second);
  CHECK(second->number == 3);
  CHECK(second->at == some_time);
}

// SPDX-License-Identifier: Apache-2.0
// Subscriptions whose owners lose rights, and what is reported about subscriptions.
#include <lrt/engine/engine.hpp>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "src/security/policy.hpp"
#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;
using engine::Channel;
using engine::SubscriptionEvent;
using security::Right;
using security::Rights;

namespace {

/// An arm whose callers are named by the field `Who`, with rights that the test changes.
struct Arm {
  explicit Arm(engine::EngineOptions options = {}, bool renews = true) : bench(with_rights(std::move(options), renews)) { bench.add(robot.arm()); }
  engine::Caller caller(const std::string& name) const {
    engine::Caller made;
    made.principal = std::make_shared<const security::Principal>(security::Principal{name, {}});
    made.view = rights.at(name);
    return made;
  }
  void give(const std::string& name, Rights granted) { rights[name] = std::make_shared<const security::View>(granted); }
  /// The codes with which channels have ended by now.
  std::map<Channel, int> closes() {
    std::map<Channel, int> codes;
    for (const auto& [channel, push] : bench.pushes())
      if (push.close != 0) codes[channel] = push.close;
    return codes;
  }
  /// Values that subscribers with a queue and an interval of 60 s, who have just got a message, do not get yet.
  void publish_in_interval(const std::vector<double>& values) {
    for (const double value : values) {
      robot.angle_handle->publish(value);
      bench.look();
      CHECK(bench.pushes().empty());
    }
  }
  /// What such a subscriber gets in so many intervals.
  std::vector<std::string> messages_of_minutes(Channel channel, int minutes) {
    std::vector<std::string> all;
    for (; minutes > 0; --minutes) {
      bench.clock.advance(std::chrono::seconds(61));
      for (std::string& message : bench.messages(channel)) all.push_back(std::move(message));
    }
    return all;
  }
  engine::EngineOptions with_rights(engine::EngineOptions options, bool renews) {
    for (const char* const name : {"anna", "bert"}) give(name, Right::read | Right::subscribe);
    options.authorize = [this](const http::Request& request) {
      const auto who = request.find("Who");
      return who ? caller(std::string(*who)) : engine::Caller();
    };
    if (renews)
      options.renew = [this](const security::Principal* owner) -> std::optional<engine::Caller> {
        asked.push_back(owner ? owner->name : "nobody");
        if (!owner) return anybody;
        if (rights.count(owner->name) == 0) return std::nullopt;
        return caller(owner->name);
      };
    return options;
  }

  std::map<std::string, std::shared_ptr<const security::View>> rights;
  engine::Caller anybody;
  std::vector<std::string> asked;
  SampleRobot robot;
  Bench bench;
};

}  // namespace

TEST_CASE("a subscription ends when its owner may no longer have it, and others stay", "[engine][security][R0.2]") {
  Arm arm;
  const Channel anna = arm.bench.open("/arm/angle", "Who: anna\n"), bert = arm.bench.open_stream("/arm/angle", "Who: bert\n"),
                nobody = arm.bench.open("/arm/angle");
  (void)arm.bench.pushes();
  arm.bench.engine.renew_rights();  // nothing has changed
  CHECK(arm.bench.pushes().empty());
  std::sort(arm.asked.begin(), arm.asked.end());
  CHECK(arm.asked == std::vector<std::string>{"anna", "bert", "nobody"});

  SECTION("the right was withdrawn") { arm.give("anna", Right::read | Right::write); }
  SECTION("the principal no longer exists") { arm.rights.erase("anna"); }
  CHECK(arm.closes().empty());  // not before it is called
  arm.bench.engine.renew_rights();
  CHECK(arm.closes() == std::map<Channel, int>{{anna, 1008}});
  CHECK(arm.bench.engine.counts().websockets == 1);
  arm.robot.angle_handle->publish(44);
  arm.bench.look();
  std::map<Channel, std::size_t> messages;
  for (const auto& [channel, push] : arm.bench.pushes()) messages[channel] += push.message ? 1 : 0;
  CHECK(messages[bert] == 1);
  CHECK(messages[nobody] == 1);
  CHECK(messages[anna] == 0);
}

TEST_CASE("an owner that may no longer read keeps its subscription and gets nothing of the value", "[engine][security][R0.2]") {
  Arm arm;
  const Channel anna = arm.bench.open("/arm/angle", "Who: anna\n"), bert = arm.bench.open("/arm/angle", "Who: bert\n");
  CHECK(arm.bench.messages(anna) == std::vector<std::string>{arm.bench.ask("GET /arm/angle\nWho: anna").body});
  arm.give("anna", Right::subscribe);
  arm.bench.engine.renew_rights();
  CHECK(arm.bench.messages(anna) == std::vector<std::string>{""});
  arm.robot.angle_handle->publish(44);
  arm.bench.look();
  std::map<Channel, std::size_t> messages;
  for (const auto& [channel, push] : arm.bench.pushes()) ++messages[channel];
  CHECK(messages == std::map<Channel, std::size_t>{{bert, 1}});
  CHECK(arm.bench.engine.counts().websockets == 2);
}

namespace {

engine::EngineOptions with_callbacks() {
  engine::EngineOptions options;
  options.callbacks.allow = {"127.0.0.0/8"};
  return options;
}

}  // namespace

TEST_CASE("a request that waits opens no subscription after the right to it has ended", "[engine][security][R0.2]") {
  Arm arm(with_callbacks());
  const std::vector<Bench::Sent> waiting = {arm.bench.stream("/arm/speed", "Who: anna\n"), arm.bench.upgrade("/arm/speed", "Who: anna\n"),
                                            arm.bench.send("GET /arm/speed\nWho: anna\nUpgrade: callback\nCallback: http://127.0.0.1:9/")};
  const Bench::Sent other = arm.bench.stream("/arm/speed", "Who: bert\n");
  REQUIRE(other.ticket);
  int status = 403;
  SECTION("its principal was signed out") {
    arm.bench.engine.sign_out("anna");
    status = 401;
  }
  SECTION("the right was withdrawn") {
    arm.give("anna", Right::read);
    arm.bench.engine.renew_rights();
  }
  SECTION("its principal no longer exists") {
    arm.rights.erase("anna");
    arm.bench.engine.renew_rights();
  }
  arm.bench.run();
  for (const Bench::Sent& sent : waiting) {
    REQUIRE(sent.ticket);
    const auto answer = arm.bench.answer(sent);
    REQUIRE(answer);
    CHECK(answer->status == status);
    CHECK(answer->field("WWW-Authenticate").empty() == (status == 403));
  }
  CHECK(arm.bench.answer(other).value().status == 200);
  const engine::EngineCounts counts = arm.bench.engine.counts();
  CHECK(counts.websockets + counts.callbacks == 0);
  CHECK(counts.event_streams == 1);
}

TEST_CASE("a request that waits subscribes with the rights that its principal has then", "[engine][security][R0.2]") {
  Arm arm;
  const Bench::Sent waiting = arm.bench.upgrade("/arm/speed", "Who: anna\n");
  REQUIRE(waiting.ticket);
  arm.give("anna", Right::subscribe);
  arm.bench.engine.renew_rights();
  std::vector<std::string> messages;
  for (const auto& [channel, push] : arm.bench.pushes())
    if (push.message) messages.push_back(*push.message);
  CHECK(arm.bench.answer(waiting).value().status == 101);
  CHECK(messages == std::vector<std::string>{""});
}

TEST_CASE("a description whose header section came before its sender lost the right makes no callback", "[engine][security][R0.13]") {
  Arm arm(with_callbacks());
  const std::string text =
      Bench::turtle_request("POST", "/arm/subscriptions",
                            "<> a hybrit:WebCallback ; hybrit:onResource </arm/angle> ; hybrit:callbackURL \"http://127.0.0.1:9/\" .", "Who: anna\n");
  RequestText request(text);
  const auto verdict = arm.bench.engine.judge_header(request.get(), request.get().body.size(), arm.bench.clock.now());
  REQUIRE_FALSE(verdict.response);
  request.get().judged = verdict.judged;
  int status = 403;
  SECTION("it was signed out") {
    arm.bench.engine.sign_out("anna");
    status = 401;
  }
  SECTION("the right was withdrawn") {
    arm.give("anna", Right::read);
    arm.bench.engine.renew_rights();
  }
  SECTION("nothing was") { status = 201; }
  SECTION("another was signed out") {
    arm.bench.engine.sign_out("bert");
    status = 201;
  }
  const Bench::Sent sent = arm.bench.sent(arm.bench.engine.handle(request.get(), arm.bench.clock.now()));
  arm.bench.run();
  CHECK(arm.bench.answer(sent).value().status == status);
  CHECK(arm.bench.engine.counts().callbacks == (status == 201 ? 1 : 0));
  if (status == 401) CHECK(arm.bench.ask(text).status == 201);  // it is let in again
}

TEST_CASE("what is queued is not sent after the right has ended", "[engine][security][R0.2]") {
  for (const bool signs_out : {false, true}) {
    CAPTURE(signs_out);
    Arm arm;
    const std::string path = "/arm/angle?queueLength=9&minimumInterval=60";
    const Channel anna = arm.bench.open(path, "Who: anna\n"), streamed = arm.bench.open_stream(path, "Who: anna\n"),
                  bert = arm.bench.open(path, "Who: bert\n");
    CHECK(arm.bench.pushes().size() == 3);
    arm.publish_in_interval({41, 42});
    if (signs_out) {
      arm.bench.engine.sign_out("anna");
    } else {
      arm.rights.erase("anna");
      arm.bench.engine.renew_rights();
    }
    std::map<Channel, int> codes;
    for (const auto& [channel, push] : arm.bench.pushes()) {
      CHECK_FALSE(push.message);
      codes[channel] = push.close;
    }
    CHECK(codes == std::map<Channel, int>{{anna, 1008}, {streamed, 1008}});
    CHECK(arm.messages_of_minutes(bert, 3).size() == 2);
  }
}

TEST_CASE("a queue loses what was encoded for a reader who saw more, and nothing else", "[engine][security][R0.2]") {
  Arm arm;
  const Channel anna = arm.bench.open("/arm/angle?queueLength=9&minimumInterval=60", "Who: anna\n");
  CHECK(arm.bench.messages(anna).size() == 1);
  arm.publish_in_interval({41, 42});
  SECTION("it may no longer read") {
    arm.give("anna", Right::subscribe);
    arm.bench.engine.renew_rights();
    CHECK(arm.messages_of_minutes(anna, 4) == std::vector<std::string>{""});
  }
  SECTION("it may write, too") {
    arm.give("anna", Right::read | Right::subscribe | Right::write);
    arm.bench.engine.renew_rights();
    CHECK(arm.messages_of_minutes(anna, 4).size() >= 2);
  }
  CHECK(arm.bench.engine.counts().websockets == 1);
}

TEST_CASE("a subscription without a principal ends when anybody may no longer subscribe", "[engine][security][R0.2]") {
  Arm arm;
  const Channel nobody = arm.bench.open("/arm/angle"), anna = arm.bench.open("/arm/angle", "Who: anna\n");
  (void)arm.bench.pushes();
  arm.anybody.view = std::make_shared<const security::View>(Rights(Right::read));
  arm.bench.engine.renew_rights();
  CHECK(arm.closes() == std::map<Channel, int>{{nobody, 1008}});
  CHECK(arm.bench.messages(anna).empty());
}

TEST_CASE("the feeds of the host itself keep their rights, those of a principal do not", "[engine][security][R0.2]") {
  Arm arm;
  const auto subscribe = [&](std::shared_ptr<const security::Principal> owner) {
    engine::FeedSubscription wanted;
    wanted.path = "/arm/angle";
    wanted.owner = std::move(owner);
    return arm.bench.engine.subscribe(std::move(wanted), arm.bench.clock.now()).value().channel;
  };
  const Channel of_host = subscribe(nullptr), of_anna = subscribe(arm.caller("anna").principal);
  for (const Channel channel : {of_host, of_anna}) CHECK(arm.bench.engine.next_feed_message(channel, arm.bench.clock.now()));
  arm.asked.clear();
  arm.rights.clear();
  arm.anybody.view = std::make_shared<const security::View>(Rights());
  arm.bench.engine.renew_rights();
  CHECK(arm.asked == std::vector<std::string>{"anna"});
  const auto last = arm.bench.engine.next_feed_message(of_anna, arm.bench.clock.now());
  REQUIRE(last);
  CHECK(last->end);
  CHECK(arm.bench.engine.counts().feeds == 1);
  CHECK_FALSE(arm.bench.engine.next_feed_message(of_host, arm.bench.clock.now()));
}

TEST_CASE("without a way to ask, renew_rights() changes nothing", "[engine][security]") {
  Arm arm({}, false);
  (void)arm.bench.open("/arm/angle", "Who: anna\n");
  (void)arm.bench.pushes();
  arm.rights.clear();
  arm.bench.engine.renew_rights();
  CHECK(arm.bench.pushes().empty());
  CHECK(arm.bench.engine.counts().websockets == 1);
}

TEST_CASE("the beginning and the end of each subscription are reported once, in order", "[engine]") {
  engine::EngineOptions options;
  options.reports_subscriptions = true;
  options.callbacks.allow = {"127.0.0.0/8"};
  Arm arm(std::move(options));
  const auto events = [&] {
    std::vector<std::string> all;
    for (const SubscriptionEvent& e : arm.bench.take_subscription_events())
      all.push_back((e.kind == SubscriptionEvent::Kind::made ? "+ " : "- ") + e.path + " " + e.resource + " " + std::string(e.protocol) +
                    (e.requested ? "" : " restored"));
    return all;
  };
  CHECK(events().empty());
  const Channel websocket = arm.bench.open("/arm/angle");
  CHECK(arm.bench.ask("GET /arm/angle\nUpgrade: callback\nCallback: http://127.0.0.1:9/").status == 201);
  (void)arm.bench.open_stream("/arm/count");
  engine::FeedSubscription feed;
  feed.path = "/arm/speed";
  (void)arm.bench.engine.subscribe(std::move(feed), arm.bench.clock.now()).value();
  CHECK(events() == std::vector<std::string>{"+ /arm/subscriptions/i1 /arm/angle websocket", "+ /arm/subscriptions/i2 /arm/angle callback",
                                             "+ /arm/subscriptions/i3 /arm/count event_stream", "+ /arm/subscriptions/i4 /arm/speed feed"});
  CHECK(events().empty());

  arm.bench.engine.closed(websocket);
  CHECK(arm.bench.ask("DELETE /arm/subscriptions/i3").status == 204);
  CHECK(arm.bench.ask("DELETE /arm/subscriptions/i3").status == 404);
  CHECK(events() == std::vector<std::string>{"- /arm/subscriptions/i1 /arm/angle websocket", "- /arm/subscriptions/i3 /arm/count event_stream"});
  const std::string saved = arm.bench.take_saved().value().text;
  arm.bench.engine.remove("arm").value();
  const std::vector<std::string> rest = events();
  CHECK(rest.size() == 2);
  CHECK(std::count(rest.begin(), rest.end(), "- /arm/subscriptions/i2 /arm/angle callback") == 1);
  CHECK(std::count(rest.begin(), rest.end(), "- /arm/subscriptions/i4 /arm/speed feed") == 1);

  engine::EngineOptions after;
  after.reports_subscriptions = true;
  after.callbacks.allow = {"127.0.0.0/8"};
  Bench next(std::move(after));
  CHECK(next.engine.restore(saved).value() == 1);
  CHECK(next.take_subscription_events().empty());  // its resource is not there yet
  SampleRobot robot;
  next.add(robot.arm());
  const std::vector<SubscriptionEvent> restored = next.take_subscription_events();
  REQUIRE(restored.size() == 1);
  CHECK(restored.front().kind == SubscriptionEvent::Kind::made);
  CHECK(restored.front().path == "/arm/subscriptions/i2");
  CHECK(restored.front().protocol == "callback");
  CHECK_FALSE(restored.front().requested);
}

TEST_CASE("a subscription that was refused is not reported, and none is unless the option is set", "[engine]") {
  for (const bool reports : {false, true}) {
    engine::EngineOptions options;
    options.reports_subscriptions = reports;
    options.subscriptions.max_subscriptions = 1;
    Arm arm(std::move(options));
    const Channel made = arm.bench.open("/arm/angle");
    CHECK(arm.bench.upgrade("/arm/angle").answer.status == 503);
    CHECK(arm.bench.upgrade("/arm/nothing").answer.status == 404);
    CHECK(arm.bench.take_subscription_events().size() == (reports ? 1 : 0));
    arm.bench.engine.closed(made);
    CHECK(arm.bench.take_subscription_events().size() == (reports ? 1 : 0));
  }
}

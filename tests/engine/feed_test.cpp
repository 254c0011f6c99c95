// SPDX-License-Identifier: Apache-2.0
// What the engine offers to a host that takes the messages of subscriptions itself.
#include <lrt/engine/feed.hpp>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lrt/engine/engine.hpp>

#include "tests/support/bench.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/sample_robot.hpp"

using namespace lrt;
using namespace lrt::test;
using engine::Channel;
using engine::FeedMessage;
using engine::FeedSubscription;
using engine::ObservableResource;

namespace {

struct Arm {
  explicit Arm(engine::EngineOptions options = {}) : bench(std::move(options)) { bench.add(robot.arm()); }
  void publish(double v) {
    robot.angle_handle->publish(v);
    bench.look();
  }
  Result<engine::Subscribed> subscribe(const std::string& path, std::optional<std::size_t> queue = 0,
                                       const std::string& media_type = "application/json") {
    FeedSubscription wanted;
    wanted.path = path;
    wanted.media_type = media_type;
    wanted.queue_length = queue;
    return bench.engine.subscribe(std::move(wanted), bench.clock.now());
  }
  /// The channels that have something, after the reads that they need.
  std::vector<Channel> ready() {
    bench.run();
    std::vector<Channel> all;
    while (const auto channel = bench.engine.next_ready(bench.clock.now())) all.push_back(*channel);
    return all;
  }
  std::optional<FeedMessage> next(Channel channel) { return bench.engine.next_feed_message(channel, bench.clock.now()); }
  std::string json(const std::string& path) { return bench.ask("GET " + path + "\nAccept: application/json").body; }

  SampleRobot robot;
  Bench bench;
};

std::vector<std::string> paths(const std::vector<ObservableResource>& resources) {
  std::vector<std::string> all;
  for (const ObservableResource& r : resources) all.push_back(r.path);
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace

TEST_CASE("all resources that can be observed are listed once, with their kinds", "[engine]") {
  Arm arm;
  arm.bench.ask("POST /arm/actions/home");
  (void)arm.bench.open("/arm/angle");
  const std::vector<ObservableResource> all = arm.bench.engine.observable_resources();
  std::map<std::string, std::string_view> kinds;
  std::set<std::uint64_t> ids;
  for (const ObservableResource& r : all) {
    CHECK(kinds.emplace(r.path, r.kind).second);
    CHECK(ids.insert(r.id).second);
    CHECK(r.wants_queue == (r.kind == "action" || r.kind == "invocation"));
    CHECK(arm.subscribe(r.path, 0, "").has_value());
  }
  CHECK(kinds.at("/arm") == "thing");
  CHECK(kinds.at("/arm/state") == "state");
  CHECK(kinds.at("/arm/angle") == "property");
  CHECK(kinds.at("/arm/actions/home") == "action");
  CHECK(kinds.count("/arm/blueprint") == 0);  // does not change
  CHECK(std::count_if(all.begin(), all.end(), [](const auto& r) { return r.kind == "invocation"; }) == 1);
  for (const auto& [path, kind] : kinds) CHECK(path.find("/subscriptions") == std::string::npos);
  Bench empty;
  CHECK(paths(empty.engine.observable_resources()) == paths(Bench().engine.observable_resources()));
  CHECK(empty.engine.observable_resources().size() < all.size());
}

TEST_CASE("resources that are added are reported once, while they are followed", "[engine]") {
  Arm arm;
  engine::Engine& engine = arm.bench.engine;
  CHECK(arm.bench.take_new_resources().empty());
  engine.follow_resources(true);
  CHECK(arm.bench.take_new_resources().empty());  // not those that are there already
  const std::vector<std::string> before = paths(engine.observable_resources());
  arm.bench.add(arm.robot.tool());
  const std::vector<ObservableResource> added = arm.bench.take_new_resources();
  std::vector<std::string> more;
  const std::vector<std::string> after = paths(engine.observable_resources());
  std::set_difference(after.begin(), after.end(), before.begin(), before.end(), std::back_inserter(more));
  CHECK(paths(added) == more);
  CHECK(std::find(more.begin(), more.end(), "/arm/tool/weight") != more.end());
  CHECK(arm.bench.take_new_resources().empty());
  for (const ObservableResource& r : added) {
    const auto all = engine.observable_resources();
    CHECK(std::count_if(all.begin(), all.end(), [&](const auto& o) { return o.id == r.id && o.path == r.path && o.kind == r.kind; }) == 1);
  }

  arm.bench.ask("POST /arm/actions/home");
  const std::vector<ObservableResource> invoked = arm.bench.take_new_resources();
  REQUIRE(invoked.size() == 1);
  CHECK(invoked.front().kind == "invocation");
  CHECK(invoked.front().wants_queue);

  (void)arm.bench.open("/arm/angle");  // a subscription cannot be observed
  CHECK(arm.bench.take_new_resources().empty());
}

TEST_CASE("a resource that has gone before it is taken is not reported", "[engine]") {
  Arm arm;
  engine::Engine& engine = arm.bench.engine;
  engine.follow_resources(true);
  arm.bench.add(arm.robot.tool());
  engine.remove("arm/tool").value();
  CHECK(arm.bench.take_new_resources().empty());
  arm.bench.add(arm.robot.tool());
  engine.follow_resources(false);  // forgets what was not taken
  CHECK(arm.bench.take_new_resources().empty());
  engine.remove("arm/tool").value();
  arm.bench.add(arm.robot.tool());
  engine.follow_resources(true);
  CHECK(arm.bench.take_new_resources().empty());
}

TEST_CASE("a resource that gets another path is reported again with the same number", "[engine]") {
  Bench bench;
  bench.engine.follow_resources(true);
  Thing outer{"arm"};
  outer.property<double>("angle").publish(1);
  bench.add(std::move(outer));
  const auto first = bench.take_new_resources();
  const auto number = [&](const std::vector<ObservableResource>& all, const std::string& path) {
    for (const ObservableResource& r : all)
      if (r.path == path) return r.id;
    return std::uint64_t{0};
  };
  const std::uint64_t state = number(first, "/arm/state");
  REQUIRE(state != 0);
  Thing taking{"arm/state"};  // a Thing with the path that lrt gave to the state
  bench.add(std::move(taking));
  const auto moved = bench.take_new_resources();
  CHECK(number(moved, "/arm/state") != 0);
  CHECK(number(moved, "/arm/state") != state);
  CHECK(std::count_if(moved.begin(), moved.end(), [&](const auto& r) { return r.id == state && r.path != "/arm/state"; }) == 1);
}

TEST_CASE("a feed gets the present representation, and then the newest one", "[engine][R0.14]") {
  Arm arm;
  const Channel channel = arm.subscribe("/arm/angle").value().channel;
  CHECK(arm.ready() == std::vector<Channel>{channel});
  const std::optional<FeedMessage> first = arm.next(channel);
  REQUIRE(first);
  CHECK(first->channel == channel);
  REQUIRE(first->body);
  CHECK(*first->body == arm.json("/arm/angle"));
  CHECK_FALSE(first->queued);
  CHECK_FALSE(first->end);
  CHECK(first->missed == 0);
  CHECK_FALSE(arm.next(channel));
  CHECK(arm.ready().empty());

  arm.publish(20);
  CHECK(arm.ready() == std::vector<Channel>{channel});
  arm.publish(30);  // before the message is taken
  CHECK(arm.ready().empty());
  const std::optional<FeedMessage> newest = arm.next(channel);
  REQUIRE(newest);
  CHECK(*newest->body == arm.json("/arm/angle"));
  CHECK(newest->missed == 1);
  CHECK_FALSE(arm.next(channel));
  CHECK(arm.bench.engine.counts().messages_sent == 2);
}

TEST_CASE("a feed with a queue gets each change, and the number of those that did not fit", "[engine][R0.14]") {
  Arm arm;
  const engine::Subscribed made = arm.subscribe("/arm/angle", 2).value();
  CHECK(made.queues);
  for (const double v : {1.0, 2.0, 3.0}) {
    arm.publish(v);
    (void)arm.ready();
  }
  std::vector<std::string> bodies;
  std::uint64_t missed = 0;
  while (const std::optional<FeedMessage> message = arm.next(made.channel)) {
    CHECK(message->queued);
    bodies.push_back(*message->body);
    missed += message->missed;
  }
  REQUIRE(bodies.size() == 2);
  CHECK(bodies.back() == arm.json("/arm/angle"));
  CHECK(missed == 2);  // the representation at the beginning, and the first change
  CHECK_FALSE(arm.bench.engine.repeat(made.channel));
  CHECK_FALSE(arm.next(made.channel));
}

TEST_CASE("a feed of a property that is read by a lambda begins when it was read", "[engine][R0.14]") {
  Bench bench;
  Thing arm{"arm"};
  arm.property("speed", [] { return 2.0; });
  bench.add(std::move(arm));
  const std::size_t queue = GENERATE(0, 4);
  const bool was_read = GENERATE(false, true);
  CAPTURE(queue, was_read);
  if (was_read) bench.ask("GET /arm/speed");
  const auto subscribe = [&] {
    FeedSubscription wanted;
    wanted.path = "/arm/speed";
    wanted.media_type = "application/json";
    wanted.queue_length = queue;
    wanted.statements = {{"https://example.org/ns#topic", "speed"}};
    return bench.engine.subscribe(std::move(wanted), bench.clock.now()).value().channel;
  };
  const Channel first = subscribe(), second = subscribe();  // the second one changes the description that the first observes
  // As a host takes them: from the channels that are named.
  const auto take = [&] {
    std::map<Channel, std::vector<std::string>> bodies;
    while (const auto channel = bench.engine.next_ready(bench.clock.now()))
      while (const auto message = bench.engine.next_feed_message(*channel, bench.clock.now())) bodies[*channel].push_back(*message->body);
    return bodies;
  };
  CHECK(take().empty());
  CHECK_FALSE(bench.engine.repeat(first));
  bench.run();
  CHECK(take() == std::map<Channel, std::vector<std::string>>{{first, {"2"}}, {second, {"2"}}});
}

TEST_CASE("the last message of a feed says that its resource no longer exists", "[engine]") {
  Arm arm;
  const Channel channel = arm.subscribe("/arm/angle").value().channel;
  (void)arm.ready();
  REQUIRE(arm.next(channel));
  CHECK_FALSE(arm.bench.engine.feed_has_ended(channel));
  arm.bench.engine.remove("arm").value();
  CHECK(arm.bench.engine.feed_has_ended(channel));
  CHECK(arm.ready() == std::vector<Channel>{channel});
  const std::optional<FeedMessage> last = arm.next(channel);
  REQUIRE(last);
  CHECK(last->end);
  CHECK_FALSE(last->body);
  CHECK_FALSE(last->queued);
  for (const Channel none : {channel, Channel{12'345}}) {  // the second was never there
    const std::optional<FeedMessage> again = arm.next(none);
    REQUIRE(again);
    CHECK(again->end);
    CHECK_FALSE(again->body);
  }
  CHECK(arm.ready().empty());
  CHECK_FALSE(arm.bench.engine.repeat(channel));
}

TEST_CASE("a feed that asks for something else than there is gets an error", "[engine]") {
  engine::EngineOptions options;
  options.subscriptions.max_feed_subscriptions = 1;
  Arm arm(std::move(options));
  CHECK(arm.subscribe("/arm/nothing").error().code == Errc::unknown_path);
  CHECK(arm.subscribe("arm/angle").error().code == Errc::unknown_path);
  CHECK(arm.subscribe("/arm/subscriptions").error().code == Errc::refused);
  CHECK(arm.subscribe("/arm/angle", 0, "image/png").error().code == Errc::unsupported_syntax);
  CHECK(arm.bench.engine.counts().feeds == 0);
  const Channel channel = arm.subscribe("/arm/angle").value().channel;
  CHECK(arm.subscribe("/arm/angle").error().code == Errc::limit_exceeded);
  arm.bench.engine.closed(channel);
  CHECK(arm.subscribe("/arm/angle").has_value());
  arm.bench.engine.stop();
  CHECK(arm.subscribe("/arm/angle").error().code == Errc::closed);
}

TEST_CASE("a feed is told what was left out before a message, whatever the reason", "[engine][newest]") {
  Arm arm;
  const auto subscribed = arm.subscribe("/arm/angle");
  REQUIRE(subscribed);
  (void)arm.ready();
  const auto first = arm.next(subscribed->channel);
  REQUIRE(first);
  CHECK(first->left_out == 0);
  for (int i = 1; i <= 4; ++i) arm.publish(i);  // each is seen, and replaced before it is taken
  for (int i = 5; i <= 7; ++i) arm.robot.angle_handle->publish(i);
  arm.publish(8);  // 5 to 7 were overwritten before the engine looked
  (void)arm.ready();
  const auto second = arm.next(subscribed->channel);
  REQUIRE(second);
  CHECK(*second->body == "8");
  CHECK(second->number - first->number == 8);
  CHECK(second->left_out == 7);
  CHECK_FALSE(arm.next(subscribed->channel));
  REQUIRE(arm.bench.engine.repeat(subscribed->channel));
  const auto again = arm.next(subscribed->channel);
  REQUIRE(again);
  CHECK(again->number == second->number);
  CHECK(again->left_out == 0);
}

TEST_CASE("a subscription of a feed knows unit, datatype and frame of a Property", "[engine][meaning]") {
  Arm arm;
  Thing base{"base"};
  base.property<double>("angle", unit::degree).frame(Object::resource("base"));
  base.property<std::vector<double>>("poses", unit::metre).frame(Iri("https://example.org/map"));
  base.property<std::string>("name");
  arm.bench.add(std::move(base));
  const auto meaning = [&](const std::string& path) {
    const auto made = arm.subscribe(path);
    REQUIRE(made);
    return made->meaning;
  };
  CHECK(meaning("/base/angle").unit == vocab::unit_::DEG.text);
  CHECK(meaning("/base/angle").datatype == vocab::xsd::double_.text);
  CHECK(meaning("/base/angle").frame.substr(0, 7) == "http://");
  CHECK(meaning("/base/angle").frame.find("/base") != std::string::npos);
  CHECK(meaning("/base/poses").unit == vocab::unit_::M.text);
  CHECK(meaning("/base/poses").frame == "https://example.org/map");
  CHECK(meaning("/base/name").unit.empty());
  CHECK(meaning("/base/name").frame.empty());
  CHECK(meaning("/base/state").datatype.empty());
}

TEST_CASE("the document of all Things says where each Property is published", "[engine][meaning]") {
  Arm arm;
  FeedSubscription wanted;
  wanted.path = "/arm/angle";
  wanted.statements.push_back({std::string(vocab::lrt_::mqttTopic.text), Object("r/arm/angle")});
  const std::string before = arm.bench.ask("GET /all\nAccept: application/n-triples").body;
  REQUIRE(arm.bench.engine.subscribe(std::move(wanted), arm.bench.clock.now()));
  const std::string after = arm.bench.ask("GET /all\nAccept: application/n-triples").body;
  CHECK(before.find("mqttTopic") == std::string::npos);
  CHECK(after.find("/arm/angle> <" + std::string(vocab::lrt_::mqttTopic.text) + "> \"r/arm/angle\"") != std::string::npos);
}

// SPDX-License-Identifier: Apache-2.0
#include "src/engine/receivers/feed.hpp"

#include <memory>
#include <optional>
#include <string>

#include "src/engine/receivers/protocols.hpp"
#include "tests/support/arm_parts.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace lrt::engine;

TEST_CASE("a message of a feed says what was missed since the one before", "[engine]") {
  ArmParts arm;
  SubscriptionResource& s = arm.subscribe(Protocol::feed);
  const auto next = [&] { return arm.parts->subscriptions.next_feed_message(s.channel, arm.clock.now()); };
  CHECK(next()->missed == 0);
  CHECK_FALSE(next());
  arm.publish(1);
  arm.publish(2);
  arm.publish(3);
  const std::optional<FeedMessage> message = next();
  REQUIRE(message);
  CHECK(message->missed == 2);
  CHECK_FALSE(message->queued);
  CHECK_FALSE(message->end);
  CHECK(s.delivered == 2);
  CHECK_FALSE(next());
  arm.publish(4);
  CHECK(next()->missed == 0);
}

TEST_CASE("a feed gets what was in its queue, and then its end", "[engine]") {
  ArmParts arm;
  SubscriptionResource& s = arm.subscribe(Protocol::feed, 5);
  const Channel channel = s.channel;
  arm.publish(1);
  arm.parts->subscriptions.end(s, 1001, "the resource was removed");
  CHECK_FALSE(arm.parts->subscriptions.has_ended(channel));
  const auto next = [&] { return arm.parts->subscriptions.next_feed_message(channel, arm.clock.now()); };
  CHECK(next()->body);
  CHECK(next()->queued);
  CHECK(arm.parts->subscriptions.has_ended(channel));
  CHECK(next()->end);
}

TEST_CASE("the observed resource has changed when a feed with statements comes or goes, to all but the feed", "[engine]") {
  ArmParts arm;
  const std::uint64_t before = arm.resource().revision;
  arm.parts->subscriptions.end(arm.subscribe(Protocol::feed), 0, {});
  CHECK(arm.resource().revision == before);  // it has no statements
  SubscriptionRequest wanted = arm.request(Protocol::feed);
  FeedProtocol protocol{"mqtt", {}, false};
  protocol.statements.push_back({"https://example.org/topic", std::string("arm/angle")});
  wanted.feed = std::make_shared<const FeedProtocol>(std::move(protocol));
  SubscriptionResource& s = arm.make(std::move(wanted));
  CHECK(arm.resource().revision == before + 1);
  CHECK(arm.next_push(s));
  CHECK_FALSE(arm.next_push(s));
  arm.parts->subscriptions.end(s, 0, {});
  CHECK(arm.resource().revision == before + 2);
}

TEST_CASE("each protocol has its name, its class and its receiver", "[engine][R1.8]") {
  ArmParts arm(ArmParts::allowing());
  CHECK(entry_of(Protocol::websocket).name == "websocket");
  CHECK(entry_of(Protocol::callback).name == "callback");
  CHECK(entry_of(Protocol::event_stream).name == "event_stream");
  CHECK(entry_of(Protocol::feed).name == "feed");
  CHECK(entry_of(Protocol::feed).opening == nullptr);
  CHECK(arm.subscribe(Protocol::feed).receiver->name() == "mqtt");
  CHECK(arm.subscribe(Protocol::feed).receiver->feed());
  CHECK(arm.subscribe(Protocol::callback).receiver->callback());
  CHECK_FALSE(arm.subscribe(Protocol::websocket).receiver->callback());
  CHECK_FALSE(arm.subscribe(Protocol::event_stream).receiver->feed());
}

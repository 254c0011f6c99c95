// SPDX-License-Identifier: Apache-2.0
#include "src/engine/subscribers.hpp"

#include <set>

#include "tests/support/arm_parts.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace lrt::engine;

TEST_CASE("subscribers are found by channel, and counted by protocol", "[engine][R1.8]") {
  ArmParts arm(ArmParts::allowing());
  const Subscribers& all = arm.parts->subscribers;
  CHECK(all.empty());
  SubscriptionResource& socket = arm.subscribe(Protocol::websocket);
  SubscriptionResource& callback = arm.subscribe(Protocol::callback);
  SubscriptionResource& feed = arm.subscribe(Protocol::feed);
  CHECK(all.find(socket.channel) == &socket);
  CHECK(all.find(feed.channel) == &feed);
  CHECK(all.find(Channel{0}) == nullptr);
  CHECK(all.count(Protocol::websocket) == 1);
  CHECK(all.count(Protocol::event_stream) == 0);
  CHECK(all.of_clients() == 2);
  std::set<const SubscriptionResource*> seen;
  all.for_each([&](const SubscriptionResource& s) { seen.insert(&s); });
  CHECK(seen == std::set<const SubscriptionResource*>{&socket, &callback, &feed});
  CHECK(all.channels_if([](const SubscriptionResource& s) { return s.protocol == Protocol::callback; }) == std::vector{callback.channel});

  const Channel former = callback.channel;
  arm.parts->subscriptions.end(callback, 0, {});
  CHECK(all.find(former) == nullptr);
  CHECK(all.count(Protocol::callback) == 0);
  CHECK(all.of_clients() == 1);
}

TEST_CASE("no channel is used twice", "[engine]") {
  Subscribers subscribers;
  const Channel first = subscribers.new_channel();
  CHECK(first != Channel{0});
  CHECK(subscribers.new_channel() != first);
}

TEST_CASE("what a subscriber lost is counted after its end", "[engine]") {
  ArmParts arm;
  SubscriptionResource& s = arm.subscribe(Protocol::websocket);
  s.backlog.count_dropped(3);
  CHECK(arm.parts->subscribers.dropped == 0);
  CHECK(arm.parts->subscriptions.counts().messages_dropped == 3);
  arm.parts->subscriptions.end(s, 0, {});
  CHECK(arm.parts->subscribers.dropped == 3);
  CHECK(arm.parts->subscriptions.counts().messages_dropped == 3);
}

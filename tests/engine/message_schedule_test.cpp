// SPDX-License-Identifier: Apache-2.0
#include "src/engine/message_schedule.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/arm_parts.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace lrt::engine;
using std::chrono::milliseconds;

TEST_CASE("a channel is reported once, until its sender has got nothing", "[engine][R0.14]") {
  ArmParts arm;
  MessageSchedule& schedule = arm.parts->schedule;
  SubscriptionResource& s = arm.subscribe(Protocol::websocket);
  CHECK(arm.next_ready() == s.channel);
  arm.publish(1);
  CHECK_FALSE(arm.next_ready());  // it was reported, and was not taken
  CHECK(schedule.next_item(s, arm.clock.now()));
  CHECK_FALSE(schedule.next_item(s, arm.clock.now()));
  arm.publish(2);
  CHECK(arm.next_ready() == s.channel);
  CHECK(s.backlog.dropped() == 1);  // the first value, which nobody has got
}

TEST_CASE("an equal representation is not sent again", "[engine][SPEC 3.8]") {
  ArmParts arm;
  SubscriptionResource& s = arm.subscribe(Protocol::websocket);
  CHECK(arm.next_push(s));
  CHECK_FALSE(arm.next_push(s));
  arm.publish(0);
  CHECK_FALSE(arm.next_push(s));
}

TEST_CASE("a queue has each change, in order", "[engine][R0.14]") {
  ArmParts arm;
  SubscriptionResource& s = arm.subscribe(Protocol::websocket, 3);
  for (const double value : {1., 2., 3.}) arm.publish(value);
  CHECK(s.backlog.dropped() == 1);  // the one at the beginning
  for (const char* value : {"Value \"1\"", "Value \"2\"", "Value \"3\""}) {
    const std::optional<Push> push = arm.next_push(s);
    REQUIRE(push);
    INFO(*push->message);
    CHECK(push->message->find(value) != std::string::npos);
  }
  CHECK_FALSE(arm.next_push(s));
}

TEST_CASE("a change of the structure is no change that a queue loses, whatever time there is", "[engine][R0.14]") {
  ArmParts arm;
  MessageSchedule& schedule = arm.parts->schedule;
  std::vector<SubscriptionResource*> all;
  for (int i = 0; i < 40; ++i) {  // a scan looks at the time after some of them
    SubscriptionRequest wanted = arm.request(Protocol::websocket, 3);
    wanted.observed = &arm.resource("/arm");
    wanted.variant = wanted.observed->variants().variants.front();
    all.push_back(&arm.make(std::move(wanted)));
  }
  const auto dropped = [&] {
    std::uint64_t sum = 0;
    for (const SubscriptionResource* s : all) sum += s->backlog.dropped();
    return sum;
  };
  const auto marked = [&] { return std::any_of(all.begin(), all.end(), [](const auto* s) { return s->marked != decltype(s->marked){}; }); };
  arm.clock.run_slowly(milliseconds(100));
  for (int i = 0; i < 3; ++i) {
    arm.parts->registry.structure_changed();
    schedule.scan(arm.clock.now());
    CHECK(marked());
    CHECK(dropped() == 0);
  }
  arm.resource("/arm").mark_changed();  // the first change that there is
  CHECK(dropped() == 0);
  arm.resource("/arm").mark_changed();
  CHECK(dropped() == all.size());
}

TEST_CASE("a message waits for the minimum interval", "[engine][R0.14]") {
  ArmParts arm;
  SubscriptionRequest wanted = arm.request(Protocol::websocket);
  wanted.policy.minimum_interval = milliseconds(100);
  SubscriptionResource& s = arm.make(std::move(wanted));
  CHECK(arm.next_ready() == s.channel);
  CHECK(arm.next_push(s));
  CHECK_FALSE(arm.next_push(s));
  arm.publish(1);
  CHECK(arm.next_ready() == s.channel);
  CHECK_FALSE(arm.next_push(s));  // too early
  CHECK_FALSE(arm.next_ready());
  const auto due = arm.parts->schedule.next_deadline();
  REQUIRE(due);
  CHECK(*due == s.backlog.due());
  arm.clock.advance(milliseconds(100));
  CHECK(arm.next_ready() == s.channel);
  CHECK(arm.next_push(s));
  arm.parts->subscriptions.end(s, 0, {});
  CHECK_FALSE(arm.parts->schedule.next_deadline());
}

TEST_CASE("a subscription that is held is not reported", "[engine][R0.13]") {
  ArmParts arm(ArmParts::allowing());
  SubscriptionRequest wanted = arm.request(Protocol::callback);
  wanted.provisional = true;
  SubscriptionResource& s = arm.make(std::move(wanted));
  CHECK(arm.parts->schedule.ready().callbacks.empty());
  s.held = false;
  arm.parts->schedule.announce(s);
  CHECK(arm.parts->schedule.ready().callbacks.size() == 1);
}

TEST_CASE("a resource that took long to represent rests", "[engine]") {
  ArmParts arm;
  SubscriptionResource& s = arm.subscribe(Protocol::websocket);
  arm.clock.run_slowly(milliseconds(3));
  CHECK(arm.next_push(s));  // its representation took longer than 2 ms
  arm.clock.run_slowly(milliseconds(0));
  arm.publish(1);
  CHECK(arm.next_ready());
  CHECK_FALSE(arm.next_push(s));
  CHECK_FALSE(arm.next_ready());
  arm.clock.advance(milliseconds(20));
  CHECK(arm.next_ready() == s.channel);
  CHECK(arm.next_push(s));
}

TEST_CASE("commands and closes precede values", "[engine][R0.14]") {
  ArmParts arm;
  SubscriptionResource& first = arm.subscribe(Protocol::websocket);
  SubscriptionResource& second = arm.subscribe(Protocol::websocket);
  const Channel ended = second.channel;
  arm.parts->subscriptions.end(second, 1001, "the resource was removed");
  CHECK(arm.next_ready() == ended);
  CHECK(arm.next_ready() == first.channel);
}

TEST_CASE("a representation is repeated on request, with a queue only where the receiver repeats", "[engine]") {
  ArmParts arm;
  MessageSchedule& schedule = arm.parts->schedule;
  SubscriptionResource& newest = arm.subscribe(Protocol::feed);
  CHECK(arm.next_push(newest));
  CHECK_FALSE(arm.next_push(newest));
  CHECK(schedule.repeat(newest));
  CHECK(arm.next_push(newest));
  SubscriptionResource& queued = arm.subscribe(Protocol::feed, 3);
  CHECK_FALSE(schedule.repeat(queued));  // what is in the queue follows
  CHECK(arm.next_push(queued));
  CHECK_FALSE(arm.next_push(queued));
  CHECK_FALSE(schedule.repeat(queued));  // its channel is reported instead
  CHECK(arm.next_push(queued));
  SubscriptionResource& socket = arm.subscribe(Protocol::websocket, 3);
  CHECK(arm.next_push(socket));
  CHECK_FALSE(schedule.repeat(socket));
  CHECK_FALSE(arm.next_push(socket));
}

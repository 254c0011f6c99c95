// SPDX-License-Identifier: Apache-2.0
// What one turn of the engine does for subscribers, however many there are. Work is counted, not timed.

#include "src/engine/message_schedule.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "src/engine/heartbeats.hpp"
#include "src/engine/stamps.hpp"
#include "tests/support/arm_parts.hpp"
#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::test;
using namespace lrt::engine;
using std::chrono::microseconds;
using std::chrono::milliseconds;

namespace {

constexpr std::size_t many = 2'000;

EngineOptions for_many() {
  EngineOptions options;
  options.subscriptions.max_subscriptions = many;
  return options;
}

bool is_at_once(const std::optional<std::chrono::steady_clock::time_point>& deadline, const FakeClock& clock) {
  return deadline && *deadline <= clock.now().steady;
}

}  // namespace

TEST_CASE("one turn reports some of the channels that are ready, and the next turns the others, each once", "[engine][delivery]") {
  ArmParts arm(for_many());
  for (std::size_t i = 0; i < many; ++i) arm.subscribe(Protocol::event_stream);
  arm.publish(1);
  std::map<Channel, int> reported;
  std::vector<ReadyChannel> channels;
  std::size_t turns = 0;
  for (; turns == 0 || arm.parts->schedule.ready().has_pushes(); ++turns) {
    channels.clear();
    arm.parts->subscriptions.take_ready(channels, arm.clock.now());
    CHECK(channels.size() <= MessageSchedule::max_at_once);
    for (const ReadyChannel& ready : channels) ++reported[ready.channel];
    const bool is_due = is_at_once(arm.parts->subscriptions.next_deadline(), arm.clock);
    CHECK((is_due || !arm.parts->schedule.ready().has_pushes()));
  }
  CHECK(turns >= many / MessageSchedule::max_at_once);
  CHECK(reported.size() == many);
  CHECK(std::all_of(reported.begin(), reported.end(), [](const auto& pair) { return pair.second == 1; }));
}

TEST_CASE("queues are filled as far as a turn has time, in order, and none misses a value", "[engine][delivery]") {
  EngineOptions options = for_many();
  options.subscriptions.max_catch_up_time = microseconds(500);
  ArmParts arm(std::move(options));
  constexpr std::size_t count = 600;
  std::vector<SubscriptionResource*> all;
  for (std::size_t i = 0; i < count; ++i) all.push_back(&arm.subscribe(Protocol::event_stream, 10));
  for (const double value : {0.25, 0.5}) arm.publish(value);
  for (SubscriptionResource* s : all) {
    while (arm.next_push(*s)) {}
    REQUIRE(s->backlog.empty());
  }
  const std::uint64_t dropped = all[0]->backlog.dropped();
  const auto newest = [&] {
    std::vector<std::uint64_t> numbers;
    for (const SubscriptionResource* s : all) numbers.push_back(s->backlog.newest() ? s->backlog.newest()->stamp.number : 0);
    return numbers;
  };
  const std::uint64_t last = change_number(all[0]->observed, all[0]->audience) + 3;
  arm.clock.run_slowly(microseconds(50));  // a look at the clock
  std::size_t turns = 0;
  std::vector<std::uint64_t> before = newest();
  for (int value = 1; value <= 3; ++value) arm.angle.publish(value);
  for (; turns < 10'000; ++turns) {
    arm.clock.advance(milliseconds(3));
    arm.parts->schedule.scan(arm.clock.now());
    const std::vector<std::uint64_t> after = newest();
    std::size_t changed = 0;
    for (std::size_t i = 0; i < count; ++i) changed += after[i] != before[i] ? 1 : 0;
    CHECK(changed <= 16 * 12);  // a look at the clock each 16, ten looks, and what is in progress
    before = after;
    if (std::all_of(after.begin(), after.end(), [&](std::uint64_t number) { return number == last; })) break;
  }
  CHECK(turns >= 3 * count / (16 * 12));
  CHECK(turns < 10'000);
  arm.clock.run_slowly({});
  for (SubscriptionResource* s : all) {
    CHECK(s->backlog.dropped() == dropped);
    std::vector<std::uint64_t> numbers;
    while (const subscription::Item item = s->backlog.take_item()) numbers.push_back(item->stamp.number);
    CAPTURE(numbers, last, turns);
    CHECK((numbers.size() == 3 && std::is_sorted(numbers.begin(), numbers.end())));
  }
}

TEST_CASE("one turn announces some of the heartbeats that are due, and the next turns the others", "[engine][delivery]") {
  Heartbeats heartbeats;
  const FakeClock clock;
  for (std::uint64_t i = 1; i <= many; ++i) heartbeats.begin(Channel{i}, milliseconds(1000), clock.now().steady);
  std::map<Channel, int> announced;
  std::size_t turns = 0;
  for (; is_at_once(heartbeats.next_deadline(), clock); ++turns) {
    std::size_t count = 0;
    heartbeats.take_due(clock.now().steady, 100, [&](Channel channel) { ++count, ++announced[channel]; });
    CHECK(count <= 100);
  }
  CHECK(turns == many / 100);
  CHECK(announced.size() == many);
}

TEST_CASE("rights of many subscriptions are checked again in several turns", "[engine][delivery]") {
  std::size_t asked = 0;
  EngineOptions options = for_many();
  options.renew = [&](const security::Principal*) -> std::optional<Caller> {
    ++asked;
    return std::nullopt;
  };
  ArmParts arm(std::move(options));
  for (std::size_t i = 0; i < many; ++i) arm.subscribe(Protocol::event_stream);
  arm.parts->subscriptions.renew_rights();
  CHECK(asked <= MessageSchedule::max_at_once);
  while (!arm.parts->subscribers.empty()) {
    CHECK(is_at_once(arm.parts->subscriptions.next_deadline(), arm.clock));
    const std::size_t before = asked;
    (void)arm.next_ready();
    REQUIRE(asked > before);
    CHECK(asked - before <= MessageSchedule::max_at_once);
  }
  CHECK(asked == many);
}

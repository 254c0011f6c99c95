// SPDX-License-Identifier: Apache-2.0
#include "src/subscription/backlog.hpp"

#include <chrono>
#include <cstddef>
#include <memory>
#include <string>

#include "tests/support/catch.hpp"

using namespace std::chrono_literals;
using lrt::subscription::Backlog;
using lrt::subscription::Item;
using lrt::subscription::Message;
using lrt::subscription::Policy;

namespace {
Item item(const std::string& tag, std::size_t bytes = 10) {
  return std::make_shared<const Message>(Message{std::make_shared<const std::string>(bytes, 'x'), tag});
}

/// The tags of all items, which are taken.
std::string taken(Backlog& backlog) {
  std::string tags;
  while (const auto i = backlog.take_item()) tags += i->tag;
  return tags;
}
}  // namespace

TEST_CASE("without a queue a backlog is one flag, and a change that was not sent counts as dropped", "[subscription][R0.13]") {
  std::size_t total = 0;
  Backlog backlog({}, 1000, 1000, total);
  CHECK(backlog.empty());
  using Pending = Backlog::Pending;
  CHECK(backlog.take_pending() == Pending::no);
  backlog.mark_changed();
  CHECK_FALSE(backlog.empty());
  CHECK(backlog.dropped() == 0);
  backlog.mark_changed();
  CHECK(backlog.dropped() == 1);
  backlog.mark_pending();
  CHECK(backlog.dropped() == 1);
  CHECK(backlog.take_pending() == Pending::changed);
  CHECK(backlog.empty());
  backlog.mark_pending();
  backlog.mark_changed();
  CHECK(backlog.dropped() == 1);  // that it may have changed is no change
  CHECK(backlog.take_pending() == Pending::changed);
  backlog.mark_changed();
  backlog.put_back(Pending::maybe);
  CHECK(backlog.take_pending() == Pending::changed);
}

TEST_CASE("a full queue drops its oldest items and keeps the newest", "[subscription][R0.13]") {
  std::size_t total = 0;
  SECTION("by number") {
    Backlog backlog({2, 0ms}, 1000, 1000, total);
    for (const char* tag : {"a", "b", "c"}) backlog.push(item(tag));
    CHECK(backlog.dropped() == 1);
    CHECK(backlog.newest()->tag == "c");
    CHECK(taken(backlog) == "bc");
  }
  SECTION("by its bytes") {
    Backlog backlog({10, 0ms}, 25, 1000, total);
    for (const char* tag : {"a", "b", "c"}) backlog.push(item(tag));
    CHECK(taken(backlog) == "bc");
    backlog.push(item("large", 100));
    CHECK(taken(backlog) == "large");
  }
  SECTION("by the bytes of all backlogs") {
    Backlog other({10, 0ms}, 1000, 25, total), backlog({10, 0ms}, 1000, 25, total);
    other.push(item("o", 20));
    backlog.push(item("a"));
    backlog.push(item("b"));
    CHECK(taken(backlog) == "b");
    CHECK(taken(other) == "o");
  }
}

TEST_CASE("an item that was not delivered goes to the front if the limits allow it", "[subscription][R0.13]") {
  std::size_t total = 0;
  Backlog backlog({2, 0ms}, 1000, 1000, total);
  backlog.push(item("a"));
  backlog.push(item("b"));
  Item first = backlog.take_item();
  SECTION("there is space") {
    backlog.put_back(std::move(first));
    CHECK(taken(backlog) == "ab");
    CHECK(backlog.dropped() == 0);
  }
  SECTION("a newer item has its place") {
    backlog.push(item("c"));
    backlog.put_back(std::move(first));
    CHECK(taken(backlog) == "bc");
    CHECK(backlog.dropped() == 1);
  }
}

TEST_CASE("the last item of a subscription has no limit", "[subscription][R0.13]") {
  std::size_t total = 0;
  Backlog backlog({1, 0ms}, 10, 10, total);
  backlog.push(item("a"));
  backlog.push_last(item("z", 100));
  CHECK(taken(backlog) == "az");
}

TEST_CASE("the bytes of a backlog leave the total when items are taken and when it is destroyed", "[subscription]") {
  std::size_t total = 0;
  {
    Backlog backlog({10, 0ms}, 1000, 1000, total);
    for (const char* tag : {"a", "b", "c"}) backlog.push(item(tag));
    CHECK(total == 30);
    (void)backlog.take_item();
    CHECK(total == 20);
  }
  CHECK(total == 0);
}

TEST_CASE("the next notification is due after the minimum interval", "[subscription][R0.13]") {
  std::size_t total = 0;
  Backlog backlog({0, 50ms}, 1000, 1000, total);
  const Backlog::Instant now = Backlog::Instant() + 1h;
  backlog.sent(now);
  CHECK(backlog.due() == now + 50ms);
  backlog.set_due(now + 2s);
  CHECK(backlog.due() == now + 2s);
}

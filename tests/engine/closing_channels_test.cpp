// SPDX-License-Identifier: Apache-2.0
#include "src/engine/closing_channels.hpp"

#include <memory>
#include <string>
#include <vector>

#include "tests/support/catch.hpp"

using namespace lrt;
using namespace lrt::engine;

namespace {

ClosingChannel closing(std::vector<std::string> items, std::uint16_t code = 1001) {
  ClosingChannel channel;
  for (std::string& item : items) channel.items.push_back({std::make_shared<const std::string>(std::move(item)), true, {}});
  channel.code = code;
  channel.reason = "the resource was removed";
  return channel;
}

struct Closing {
  ReadyChannels ready;
  std::uint64_t dropped = 0;
  ClosingChannels channels{ready, dropped};
};

}  // namespace

TEST_CASE("a channel that closes sends its last items, and then the close", "[engine][R0.14]") {
  Closing c;
  c.channels.add(Channel{7}, closing({"one", "two"}));
  CHECK(c.ready.urgent == std::deque<Channel>{Channel{7}});
  CHECK(c.channels.contains(Channel{7}));
  CHECK_FALSE(c.channels.has_no_items(Channel{7}));
  const Push first = c.channels.next(Channel{7});
  CHECK(*first.message == "one");
  CHECK(first.text);
  CHECK(first.close == 0);
  CHECK(*c.channels.next(Channel{7}).message == "two");
  CHECK(c.channels.has_no_items(Channel{7}));
  const Push last = c.channels.next(Channel{7});
  CHECK_FALSE(last.message);
  CHECK(last.close == 1001);
  CHECK(last.reason == "the resource was removed");
  CHECK(c.channels.empty());
  CHECK(c.channels.next(Channel{7}).close == 1001);  // unknown
}

TEST_CASE("a channel whose client has gone is forgotten", "[engine][R0.14]") {
  Closing c;
  c.channels.add(Channel{7}, closing({"one"}, 1000));
  c.channels.forget(Channel{7});
  c.channels.forget(Channel{7});
  CHECK(c.channels.empty());
  CHECK(c.channels.has_no_items(Channel{7}));
}

TEST_CASE("items of feeds that the host does not take are limited in number", "[engine]") {
  Closing c;
  for (std::uint64_t i = 1; i <= ClosingChannels::max_feeds; ++i) c.channels.add_feed(Channel{i}, closing({"one", "two"}));
  CHECK(c.dropped == 0);
  c.ready.urgent.clear();
  c.channels.add_feed(Channel{5000}, closing({"one"}));
  CHECK(c.dropped == 2);
  CHECK(c.ready.urgent == std::deque<Channel>{Channel{5000}, Channel{1}});  // its close is due now
  CHECK(c.channels.has_no_items(Channel{1}));
  CHECK(c.channels.next(Channel{1}).close == 1001);
}

TEST_CASE("items of feeds that the host does not take are limited in bytes, and what it takes does not count", "[engine]") {
  Closing c;
  const std::string half(ClosingChannels::max_feed_bytes / 2, 'x');
  c.channels.add_feed(Channel{1}, closing({half}));
  c.channels.add_feed(Channel{2}, closing({half, "x"}));
  CHECK(c.dropped == 1);  // of the first
  CHECK(c.channels.has_no_items(Channel{1}));
  CHECK(c.channels.next(Channel{2}).message->size() == half.size());
  c.channels.add_feed(Channel{3}, closing({half}));
  c.channels.forget(Channel{2});
  c.channels.add_feed(Channel{4}, closing({half}));
  CHECK(c.dropped == 1);
  c.channels.add_feed(Channel{5}, closing({}));
  CHECK(c.dropped == 1);
}

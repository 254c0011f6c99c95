// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>

#include <lrt/engine/handler.hpp>

#include "src/engine/ready_channels.hpp"
#include "src/subscription/backlog.hpp"

namespace lrt::engine {

/// A message of a subscription that has ended.
struct LastMessage {
  std::shared_ptr<const std::string> body;
  bool text = false;
  subscription::Stamp stamp{};
};

/// The end of a channel: its last items, then a close.
struct ClosingChannel {
  std::deque<LastMessage> items;  ///< to be sent before the close
  std::uint16_t code = 0;
  std::string reason;
};

/// Channels whose subscription has ended, until their transport or feed has closed them.
class ClosingChannels {
 public:
  /// Limits of the items of feeds that have ended, and which the host does not take.
  static constexpr std::size_t max_feeds = 1'000, max_feed_bytes = 4 * 1024 * 1024;

  /// @param ready    gets the channels
  /// @param dropped  counts items that are not sent
  ClosingChannels(ReadyChannels& ready, std::uint64_t& dropped) : ready_(ready), dropped_(dropped) {}

  void add(Channel channel, ClosingChannel closing);
  /// A host may never take the items of a feed. Beyond the limits, those of the feeds that have ended first are dropped.
  void add_feed(Channel channel, ClosingChannel closing);
  /// The next item of a channel, or its close, with which the channel is forgotten.
  /// @param stamp  receives that of the item
  Push next(Channel channel, subscription::Stamp* stamp = nullptr);
  void forget(Channel channel);

  bool empty() const noexcept { return closing_.empty(); }
  bool contains(Channel channel) const { return closing_.count(static_cast<std::uint64_t>(channel)) != 0; }
  /// The next push of the channel is a close.
  bool has_no_items(Channel channel) const;

 private:
  struct Closing : ClosingChannel {
    std::size_t feed_bytes = 0;  ///< of the items, if it is one of a feed
  };
  void limit_feeds();

  ReadyChannels& ready_;
  std::uint64_t& dropped_;
  std::unordered_map<std::uint64_t, Closing> closing_;
  std::set<std::uint64_t> feeds_;  ///< those in closing_ that belong to feeds and have items, the oldest first
  std::size_t feed_bytes_ = 0;     ///< of their items
};

}  // namespace lrt::engine

// SPDX-License-Identifier: Apache-2.0
#include "src/engine/closing_channels.hpp"

#include <utility>

namespace lrt::engine {

void ClosingChannels::add(Channel channel, ClosingChannel closing) {
  closing_[static_cast<std::uint64_t>(channel)] = Closing{std::move(closing), 0};
  ready_.urgent.push_back(channel);
}

void ClosingChannels::add_feed(Channel channel, ClosingChannel closing) {
  add(channel, std::move(closing));
  Closing& added = closing_.at(static_cast<std::uint64_t>(channel));
  if (added.items.empty()) return;
  for (const LastMessage& item : added.items) added.feed_bytes += item.body->size();
  feed_bytes_ += added.feed_bytes;
  feeds_.insert(static_cast<std::uint64_t>(channel));
  limit_feeds();
}

/// Channels without their items are reported again, because their close is due now.
void ClosingChannels::limit_feeds() {
  while (feeds_.size() > max_feeds || feed_bytes_ > max_feed_bytes) {
    const std::uint64_t oldest = *feeds_.begin();
    Closing& closing = closing_.at(oldest);
    dropped_ += closing.items.size();
    closing.items.clear();
    feed_bytes_ -= std::exchange(closing.feed_bytes, 0);
    feeds_.erase(feeds_.begin());
    ready_.urgent.push_back(Channel{oldest});
  }
}

Push ClosingChannels::next(Channel channel, subscription::Stamp* stamp) {
  Push push;
  const auto found = closing_.find(static_cast<std::uint64_t>(channel));
  if (found == closing_.end()) {
    push.close = 1001;
    return push;
  }
  Closing& closing = found->second;
  if (closing.items.empty()) {
    push.close = closing.code;
    push.reason = std::move(closing.reason);
    closing_.erase(found);
    return push;
  }
  push.message = std::move(closing.items.front().body);
  push.text = closing.items.front().text;
  if (stamp) *stamp = closing.items.front().stamp;
  closing.items.pop_front();
  if (closing.feed_bytes != 0) {
    feed_bytes_ -= push.message->size();
    closing.feed_bytes -= push.message->size();
  }
  if (closing.items.empty()) feeds_.erase(found->first);
  return push;
}

void ClosingChannels::forget(Channel channel) {
  const auto found = closing_.find(static_cast<std::uint64_t>(channel));
  if (found == closing_.end()) return;
  feed_bytes_ -= found->second.feed_bytes;
  feeds_.erase(found->first);
  closing_.erase(found);
}

bool ClosingChannels::has_no_items(Channel channel) const {
  const auto found = closing_.find(static_cast<std::uint64_t>(channel));
  return found == closing_.end() || found->second.items.empty();
}

}  // namespace lrt::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include <lrt/engine/handler.hpp>

#include "src/engine/client_counts.hpp"
#include "src/engine/resources/subscription.hpp"

namespace lrt::engine {

/// The present subscriptions by channel, and what is counted over all of them. They belong to their containers.
class Subscribers {
 public:
  /// A channel that no subscription has had.
  Channel new_channel() noexcept { return Channel{next_channel_++}; }
  void add(SubscriptionResource& s) {
    by_channel_.emplace(static_cast<std::uint64_t>(s.channel), &s);
    ++of(s.protocol);
    ++version_;
  }
  void remove(const SubscriptionResource& s) {
    --of(s.protocol);
    dropped += s.backlog.dropped();
    by_channel_.erase(static_cast<std::uint64_t>(s.channel));
    ++version_;
  }
  SubscriptionResource* find(Channel channel) const {
    const auto found = by_channel_.find(static_cast<std::uint64_t>(channel));
    return found == by_channel_.end() ? nullptr : found->second;
  }
  bool empty() const noexcept { return by_channel_.empty(); }
  std::size_t count(Protocol protocol) const noexcept { return counts_[static_cast<std::size_t>(protocol)]; }
  /// Those that clients have opened: without feeds.
  std::size_t of_clients() const noexcept { return by_channel_.size() - count(Protocol::feed); }
  /// Incremented when one begins or ends.
  std::uint64_t version() const noexcept { return version_; }
  /// Calls f(SubscriptionResource&) for each. It must not add or remove one.
  template <class F>
  void for_each(F f) const {
    for (const auto& [number, s] : by_channel_) f(*s);
  }
  /// The channels of those that fulfil a condition, for a loop that ends some.
  template <class F>
  std::vector<Channel> channels_if(F condition) const {
    std::vector<Channel> found;
    for (const auto& [number, s] : by_channel_)
      if (condition(*s)) found.push_back(s->channel);
    return found;
  }

  std::uint64_t sent = 0;        ///< messages of all subscribers, former ones included
  std::uint64_t dropped = 0;     ///< of former subscribers
  std::size_t queued_bytes = 0;  ///< of all subscribers
  ClientCounts clients;          ///< clients with subscriptions; restored subscriptions have no client

 private:
  std::size_t& of(Protocol protocol) noexcept { return counts_[static_cast<std::size_t>(protocol)]; }

  std::uint64_t next_channel_ = 1, version_ = 1;
  std::unordered_map<std::uint64_t, SubscriptionResource*> by_channel_;
  std::array<std::size_t, protocol_count> counts_{};
};

}  // namespace lrt::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <lrt/model/statement.hpp>
#include <lrt/security.hpp>
#include <lrt/subscription/channel.hpp>

namespace lrt::engine {
inline namespace v0 {

/// A resource that can be observed, as a feed finds it.
struct ObservableResource {
  std::uint64_t id = 0;      ///< never used for another resource; the same resource comes again if its path has changed
  std::string path;          ///< "/arm/angle", percent-encoded
  std::string_view kind;     ///< "thing", "state", "property", "action", "invocation", ...: as overviews say it
  bool wants_queue = false;  ///< each of its changes counts, not only the last
};

/// What a feed subscribes to: a subscription that no connection carries, because the host takes its messages itself.
struct FeedSubscription {
  std::string path;        ///< as in ObservableResource
  std::string media_type;  ///< one that the resource has; empty: its first, which is text/turtle
  /// 0: no queue, only the newest representation is sent. nullopt: SubscriptionOptions::default_queue_length for actions and invocations, 0 for others.
  /// More than SubscriptionOptions::max_queue_length counts as that.
  std::optional<std::size_t> queue_length{};
  std::chrono::milliseconds minimum_interval{0};  ///< between two messages, at most a day
  std::string protocol = "feed";                  ///< by which the host sends on, in one word: in overviews
  /// Where the host sends the messages, "lrt:mqttTopic". The subscription says it, and so does the resource in its own document (as it says
  /// hybrit:websocketUrl), to those who may subscribe to it.
  std::vector<Statement> statements{};
  /// Whose subscription it is: it shows what this principal may see. nullptr: everything. lrt::Feed sets it.
  std::shared_ptr<const security::Principal> owner{};
};

/// A subscription that a feed has made.
struct Subscribed {
  subscription::Channel channel;
  bool queues;  ///< it has a queue
};

/// What a subscription of a feed has next.
struct FeedMessage {
  subscription::Channel channel{};
  std::shared_ptr<const std::string> body{};  ///< the representation; nullptr with `end`
  bool end = false;                           ///< the resource is gone, or the right to it: nothing follows on this channel
  bool queued = false;                        ///< of a subscription with a queue
  std::uint64_t missed = 0;                   ///< changes between the message before and this one that had no place in the queue, or were superseded
};

}  // namespace v0
}  // namespace lrt::engine

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

/// A resource that can be observed, for a feed.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
struct ObservableResource {
  std::uint64_t id = 0;      ///< never used for another resource; a resource is reported again if its path has changed
  std::string path;          ///< "/arm/angle", percent-encoded
  std::string_view kind;     ///< "thing", "state", "property", "action", "invocation", ...: as in overviews
  bool wants_queue = false;  ///< each of its changes matters, not only the last one
  bool document = false;     ///< a Property with a text for other programs (as /server/metrics), not a value of its Thing
  bool counter = false;      ///< a Property that counts, or measures the server itself (as /server/requests)
};

/// What the values of a Property mean, as its RDF says it: IRIs, empty if it says nothing. Forms without RDF are sent with
/// it.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
struct Meaning {
  std::string unit{};      ///< object of qudt:hasUnit, or of vom:unit; of a list: of its elements
  std::string datatype{};  ///< of the value; of a list: of its elements. Empty also for records and maps
  std::string frame{};     ///< that the numbers refer to; a name if the program gave one instead of an IRI. Only if the owner may know it
};

/// Options of a subscription of a feed: no connection carries it, because the host takes its messages itself.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
struct FeedSubscription {
  std::string path;        ///< as in ObservableResource
  std::string media_type;  ///< one that the resource has; empty: its first, which is text/turtle
  /// 0: no queue, only the newest representation is sent. nullopt: SubscriptionOptions::default_queue_length for
  /// actions and invocations, 0 for others. More than SubscriptionOptions::max_queue_length is reduced to that.
  std::optional<std::size_t> queue_length{};
  std::chrono::milliseconds minimum_interval{0};  ///< between two messages, at most a day
  std::string protocol = "feed";                  ///< protocol with which the host forwards messages, one word, for overviews
  /// Where the host sends the messages, for example "lrt:mqttTopic". These statements are in the description of the
  /// subscription, and in the resource's own document (like hybrit:websocketUrl) for clients that may subscribe to it.
  std::vector<Statement> statements{};
  /// The principal that owns the subscription, which shows what this principal may read. nullptr: everything. lrt::Feed
  /// sets it.
  std::shared_ptr<const security::Principal> owner{};
  /// With a queue: lrt::Feed::repeat_all() adds the present representation to an empty queue.
  bool repeats = false;
};

/// A subscription that a feed has made.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
struct Subscribed {
  subscription::Channel channel;  ///< identifies the subscription
  bool queues;                    ///< it has a queue
  Meaning meaning{};              ///< of a Property
};

/// The next message of a subscription of a feed.
/// @par Threads  Distinct objects: any thread. One object: one thread at a time, or any number of reading threads.
///               `body` is immutable.
struct FeedMessage {
  subscription::Channel channel{};            ///< identifies the subscription
  std::shared_ptr<const std::string> body{};  ///< the representation; nullptr with `end`
  bool end = false;                           ///< the resource or the right to it no longer exists: nothing follows on this channel
  bool queued = false;                        ///< the subscription has a queue
  std::uint64_t missed = 0;                   ///< changes since the last message that did not fit into the queue, or were superseded
  /// When the value became what it is; nullopt: the resource has no such time, as an action has none.
  std::optional<std::chrono::system_clock::time_point> at{};
  std::uint64_t number = 0;  ///< changes of the resource so far, also those that no subscriber was sent. The same in a repeated message
  /// Changes before it that this subscription was not sent: superseded, dropped from its queue, or overwritten before the
  /// server saw them.
  std::uint64_t left_out = 0;
};

}  // namespace v0
}  // namespace lrt::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/model/statement.hpp>
#include <lrt/subscription/channel.hpp>

#include "src/engine/client_counts.hpp"
#include "src/engine/deadline_queue.hpp"
#include "src/engine/resource.hpp"
#include "src/subscription/backlog.hpp"

namespace lrt::engine {

class MessageSchedule;
class Receiver;
class Subscriptions;
struct ReceiverParts;

inline namespace v0 {

/// How a subscriber gets its messages. receivers/protocols.hpp has what they differ in.
enum class Protocol : std::uint8_t { websocket, callback, event_stream, feed };
inline constexpr std::size_t protocol_count = 4;

/// The description of a feed's subscription (FeedSubscription).
struct FeedProtocol {
  std::string name;
  std::vector<Statement> statements;
  bool repeats = false;
};

/// The parameters of a subscription that a client requests.
struct SubscriptionRequest {
  Resource* observed = nullptr;
  Protocol protocol = Protocol::websocket;
  std::string url, secret;  ///< of a callback
  Variant variant;
  subscription::Policy policy;
  std::chrono::milliseconds heartbeat{0};      ///< interval of heartbeats; 0: there are none
  bool provisional = false;                    ///< of a callback: held until it is saved
  bool stamped = false;                        ///< of a WebSocket: a stamp precedes each representation
  bool has_confirmed = false;                  ///< of a callback: its receiver has confirmed it before
  bool restored = false;                       ///< from a file, without a request
  bool begins_with_refresh = false;            ///< the first notification waits until the value has been read
  std::string client;                          ///< Caller::client
  std::string known_tag;                       ///< of the representation that the client of an event stream has
  Audience audience{};                         ///< the owner of the subscription
  std::shared_ptr<const FeedProtocol> feed{};  ///< of a feed
};

/// A subscription: its receiver, resource, protocol and counters (paper 5.3, Figure 4). It is also the observer of the resource.
/// What one protocol has and others have not is in its receiver.
class SubscriptionResource final : public Resource, public Observer {
 public:
  SubscriptionResource(std::string path, std::string id, Channel its_channel, SubscriptionRequest request, std::size_t its_base, Utc at,
                       Subscriptions& owner, const ReceiverParts& parts);
  ~SubscriptionResource() override;

  Methods methods() const noexcept override;
  /// DELETE cancels. With If-Match it is cancelled only if its counters are unchanged (R0.11).
  Outcome remove(Context& context, Parts& parts) override;
  void describe(const Description& d) const override;
  void describe_types(About& about, const Description& d) const override;
  /// Its constant triples: all of Figure 4. The entity tag of the container does not change with a notification.
  void describe_constants(About& about, const Description& d) const;
  const ResourceKind& kind() const noexcept override {
    static constexpr ResourceKind kind{"subscription", Trait::none, nullptr, security::Right::subscribe};
    return kind;
  }
  void summarize(Overview& o) const override;
  void overview(Overview& o) const override;
  std::uint64_t state(std::uint64_t) const noexcept override { return revision + delivered + backlog.dropped(); }
  std::string up() const override;
  /// Visible to its creator and to principals with Right::manage. Without a creator, visible to clients that know its path.
  bool is_shown_to(const Audience& asking) const override;

  // Observer
  Variant variant() const noexcept override { return its_variant; }
  void resource_changed(SeenBy seen) override;
  void resource_changes(SeenBy seen) override;
  void values_missed(std::uint64_t count, SeenBy seen) override;
  void resource_removed() override;
  /// Where a feed sends its messages.
  void describe_controls(About& about, const Description& d) const override;

  /// It gets each change, not only the current state.
  bool queues() const noexcept override { return backlog.policy().queues(); }

  const std::string subscription_id;
  const Channel channel;
  Resource& observed;
  const Protocol protocol;
  const std::size_t base;  ///< of its representations (SPEC 3.7)
  const std::shared_ptr<const void> base_hold;
  const Variant its_variant;
  const Utc created;
  Audience audience;          ///< its owner, whose rights apply to its notifications
  ClientCounts::Share share;  ///< of its client

  subscription::Backlog backlog;
  std::string last_tag;           ///< of the representation that was sent last
  subscription::LeftOut changes;  ///< those that it was not sent
  std::uint64_t left_out = 0;     ///< changes before the message that was handed out last
  std::uint64_t messages = 0;     ///< that were handed out
  std::uint64_t delivered = 0;
  subscription::Backlog::Pending marked = {};  ///< has a queue, and a change that is not in it yet
  bool listed = false;                         ///< its channel is in the list of those that are marked
  bool awaits_value = false;                   ///< its first notification waits until the value has been read
  bool failing = false;                        ///< its last representation could not be encoded
  bool ready_announced = false;                ///< its channel was reported to its sender, which has not received nullopt since
  bool held;                                   ///< its channel is not reported: it is not saved yet, or a message is under way
  bool suspended = false;                      ///< only the newest representation is sent, whatever the queue is
  DeadlineQueue<Channel>::Place next_message;  ///< when it waits for its minimum interval or for another attempt

  const std::unique_ptr<Receiver> receiver;

 private:
  Subscriptions& owner_;
  MessageSchedule& schedule_;
};

/// The container of the subscriptions to a Thing's resources (R1.8, LDP), or to those of a part of the server.
class SubscriptionsResource final : public Resource, public Container {
 public:
  using Resource::Resource;
  Methods methods() const noexcept override;
  /// POST of a description creates a callback subscription (SPEC 3.5). Only those of a Thing allow it.
  Outcome post(Context& context, Parts& parts) override;
  std::string input_shape() const override;
  std::string up() const override;
  void describe(const Description& d) const override;
  void describe_controls(About& about, const Description& d) const override;
  void describe_types(About& about, const Description& d) const override;
  const ResourceKind& kind() const noexcept override {
    static constexpr ResourceKind kind{"subscriptions", Trait::by_principal, nullptr, security::Right::subscribe};
    return kind;
  }
  void overview(Overview& o) const override;
  std::uint64_t state(std::uint64_t structure) const noexcept override { return structure + revision; }
  const Container* container() const noexcept override { return this; }
  using Container::members;
  std::vector<Resource*> members() const override;
  void describe_member(const Resource& member, About& about, const Description& d) const override;

  std::vector<std::unique_ptr<SubscriptionResource>> subscriptions;  ///< oldest first
};

/// The required content of a POST to the container (SPEC 3.5).
void describe_subscription_shape(rdf::Graph& graph, const std::string& shape, const subscription::SubscriptionOptions& options);

/// Limits of what a subscriber may request.
inline constexpr std::chrono::seconds max_interval{86'400};
inline constexpr std::size_t max_secret = 200;

}  // namespace v0
}  // namespace lrt::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

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
#include "src/subscription/retry_policy.hpp"

namespace lrt::engine {
inline namespace v0 {

class Subscriptions;

enum class Protocol : std::uint8_t { websocket, callback, event_stream, feed };

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
  bool provisional = false;                    ///< SubscriptionResource::provisional
  bool has_confirmed = false;                  ///< SubscriptionResource::has_confirmed
  bool restored = false;                       ///< from a file, without a request
  bool begins_with_refresh = false;            ///< the first notification waits until the value has been read
  std::string client;                          ///< Caller::client
  std::string known_tag;                       ///< of the representation that the client of an event stream has
  Audience audience{};                         ///< the owner of the subscription
  std::shared_ptr<const FeedProtocol> feed{};  ///< of a feed
};

/// A subscription: its receiver, resource, protocol and counters (paper 5.3, Figure 4). It is also the observer of the resource.
class SubscriptionResource final : public Resource, public Observer {
 public:
  SubscriptionResource(std::string path, std::string id, Channel its_channel, SubscriptionRequest request, std::size_t its_base, Utc at,
                       Subscriptions& owner, const EngineOptions& options, std::size_t& queued_bytes);

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
  void resource_changed() override;
  void resource_changes() override;
  void values_missed(std::uint64_t count) override;
  void resource_removed() override;
  /// Where a feed sends its messages.
  void describe_controls(About& about, const Description& d) const override;

  /// The protocol in one word, for overviews.
  std::string_view protocol_name() const noexcept;
  /// It gets each change, not only the current state.
  bool queues() const noexcept override { return backlog.policy().queues(); }

  const std::string subscription_id;
  const Channel channel;
  Resource& observed;
  const Protocol protocol;
  const std::size_t base;  ///< of its representations (SPEC 3.7)
  const Variant its_variant;
  const std::string url, receiver, secret;  ///< of a callback; receiver: as in subscription::ReadyCallback
  const Utc created;
  Audience audience;          ///< its owner, whose rights apply to its notifications
  ClientCounts::Share share;  ///< of its client

  subscription::Backlog backlog;
  std::string last_tag;  ///< of the representation that was sent last
  std::uint64_t delivered = 0;
  bool marked = false;                              ///< has a queue, and a change that is not in it yet
  bool awaits_value = false;                        ///< its first notification waits until the value has been read
  bool failing = false;                             ///< its last representation could not be encoded
  bool ready_announced = false;                     ///< its channel was reported to the transport, which has not received nullopt since
  DeadlineQueue<Channel>::Place next_notification;  ///< when it waits for its minimum interval or for another attempt

  // Callbacks only.
  subscription::RetryPolicy retry;
  subscription::Item under_way;
  bool must_confirm = false;   ///< nothing is sent before the receiver has confirmed
  bool has_confirmed;          ///< the receiver has confirmed, perhaps before a restart
  bool confirming = false;     ///< the receiver has been asked, and has not responded yet
  std::string last_error;      ///< the text for the subscriber
  std::string logged_error;    ///< the details for the operator
  bool provisional;            ///< not saved yet: nothing is delivered, and it is removed if it cannot be saved
  unsigned cancellations = 0;  ///< requests that wait until it is removed from the file
  bool awaits_confirmation() const noexcept { return must_confirm && !has_confirmed; }
  bool is_cancelling() const noexcept { return cancellations != 0; }
  std::string saved_text;  ///< its text in the file; empty: not created yet

  // Feeds only.
  const std::shared_ptr<const FeedProtocol> feed;
  std::uint64_t told_dropped = 0;  ///< the dropped changes that its messages have reported

 private:
  Subscriptions& owner_;
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

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

/// What a feed says of its subscription (FeedSubscription).
struct FeedProtocol {
  std::string name;
  std::vector<Statement> statements;
};

/// What a client requests when it subscribes.
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
  Audience audience{};                         ///< whose subscription it is
  std::shared_ptr<const FeedProtocol> feed{};  ///< of a feed
};

/// A subscription: its receiver, resource, protocol and counters (paper 5.3, Figure 4). It is also the observer of the resource.
class SubscriptionResource final : public Resource, public Observer {
 public:
  SubscriptionResource(std::string path, std::string id, Channel its_channel, SubscriptionRequest request, std::size_t its_base, Utc at,
                       Subscriptions& owner, const EngineOptions& options, std::size_t& queued_bytes);

  Methods methods() const noexcept override;
  security::Right right_to_change() const noexcept override { return security::Right::subscribe; }
  /// DELETE cancels. With If-Match it is cancelled only if its counters have not moved (R0.11).
  Outcome remove(Context& context, Parts& parts) override;
  void describe(const Description& d) const override;
  void describe_types(About& about, const Description& d) const override;
  /// What does not change while it lives: all of Figure 4. The entity tag of the container does not change with a notification.
  void describe_as_member(About& about, const Description& d) const override;
  std::string_view kind() const noexcept override { return "subscription"; }
  void summarize(Overview& o) const override;
  void overview(Overview& o) const override;
  std::uint64_t state(std::uint64_t) const noexcept override { return revision + delivered + backlog.dropped(); }
  std::string up() const override;
  /// Its creator, and those with Right::manage. One that nobody in particular made is for those who know its path.
  bool is_shown_to(const Audience& asking) const override;

  // Observer
  Variant variant() const noexcept override { return its_variant; }
  void resource_changed() override;
  void resource_changes() override;
  void values_missed(std::uint64_t count) override;
  void resource_removed() override;
  /// Where a feed sends its messages.
  void describe_controls(About& about, const Description& d) const override;

  /// In one word, for overviews.
  std::string_view protocol_name() const noexcept;
  /// It gets each change, not only the present state.
  bool queues() const noexcept override { return backlog.policy().queues(); }

  const std::string subscription_id;
  const Channel channel;
  Resource& observed;
  const Protocol protocol;
  const std::size_t base;  ///< of its representations (SPEC 3.7)
  const Variant its_variant;
  const std::string url, receiver, secret;  ///< of a callback; receiver: as in subscription::ReadyCallback
  const Utc created;
  Audience audience;          ///< whose it is; its notifications show what these may see
  ClientCounts::Share share;  ///< of its client

  subscription::Backlog backlog;
  std::string last_tag;  ///< of the representation that was sent last
  std::uint64_t delivered = 0;
  bool marked = false;                              ///< has a queue, and a change that is not in it yet
  bool failing = false;                             ///< its representation could not be made the last time
  bool ready_announced = false;                     ///< its channel was named to the transport, which has not got nullopt since
  DeadlineQueue<Channel>::Place next_notification;  ///< when it waits for its minimum interval or for another attempt

  // Of a callback.
  subscription::RetryPolicy retry;
  subscription::Item under_way;
  bool must_confirm = false;   ///< nothing is sent before the receiver has confirmed
  bool has_confirmed;          ///< the receiver has confirmed, perhaps before a restart
  bool confirming = false;     ///< the receiver has been asked, and has not responded yet
  std::string last_error;      ///< what the subscriber learns
  std::string logged_error;    ///< in detail, for the operator
  bool provisional;            ///< not saved yet: nothing is delivered, and it goes if it cannot be saved
  unsigned cancellations = 0;  ///< requests that wait until it is no longer in the file
  bool awaits_confirmation() const noexcept { return must_confirm && !has_confirmed; }
  bool is_cancelling() const noexcept { return cancellations != 0; }
  std::string saved_text;  ///< how it stands in the file; empty: not made yet

  // Of a feed.
  const std::shared_ptr<const FeedProtocol> feed;
  std::uint64_t told_dropped = 0;  ///< of its dropped changes, those that its messages have told

 private:
  Subscriptions& owner_;
};

/// The container of the subscriptions to a Thing's resources (R1.8, LDP), or to those of a part of the server.
class SubscriptionsResource final : public Resource {
 public:
  using Resource::Resource;
  Methods methods() const noexcept override;
  security::Right right_to_change() const noexcept override { return security::Right::subscribe; }
  /// POST of a description creates a callback subscription (SPEC 3.5). Only those of a Thing allow it.
  Outcome post(Context& context, Parts& parts) override;
  std::string input_shape() const override;
  std::string up() const override;
  void describe(const Description& d) const override;
  void describe_controls(About& about, const Description& d) const override;
  void describe_types(About& about, const Description& d) const override;
  std::string_view kind() const noexcept override { return "subscriptions"; }
  void overview(Overview& o) const override;
  std::uint64_t state(std::uint64_t structure) const noexcept override { return structure + revision; }
  bool is_container() const noexcept override { return true; }
  std::vector<Resource*> members() const override;
  bool differs_by_principal() const noexcept override { return true; }

  std::vector<std::unique_ptr<SubscriptionResource>> subscriptions;  ///< oldest first
};

/// What a POST to the container must say (SPEC 3.5).
void describe_subscription_shape(rdf::Graph& graph, const std::string& shape, const subscription::SubscriptionOptions& options);

/// Limits of what a subscriber may request.
inline constexpr std::chrono::seconds max_interval{86'400};
inline constexpr std::size_t max_secret = 200;

}  // namespace v0
}  // namespace lrt::engine

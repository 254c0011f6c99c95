// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/engine/handler.hpp>
#include <lrt/subscription/notification.hpp>

#include "src/engine/change_scanner.hpp"
#include "src/engine/closing_channels.hpp"
#include "src/engine/heartbeats.hpp"
#include "src/engine/property_values.hpp"
#include "src/engine/receivers/receiver.hpp"
#include "src/engine/registry.hpp"
#include "src/engine/representations.hpp"
#include "src/engine/resources/subscription.hpp"
#include "src/engine/subscription_requests.hpp"

namespace lrt::engine {

/// Subscriptions as they come and go: created by Upgrade, event stream, POST or feed, handed their messages, ended.
class Subscriptions {
 public:
  Subscriptions(const ReceiverParts& parts, const SubscriptionRequests& requests, Registry& registry, Representations& representations,
                PropertyValues& values, ChangeScanner& scanner)
      : parts_(parts),
        requests_(requests),
        registry_(registry),
        representations_(representations),
        values_(values),
        scanner_(scanner),
        closing_(parts.schedule.ready(), parts.subscribers.dropped) {}

  /// @par Errors  invalid_option: of the options of subscriptions and callbacks
  Result<void> check_options() const;
  bool empty() const noexcept { return parts_.subscribers.empty() && closing_.empty(); }
  EngineCounts counts() const;
  std::size_t callback_count() const noexcept { return parts_.subscribers.count(Protocol::callback); }
  std::vector<SubscriptionEvent> take_events() { return std::exchange(events_, {}); }

  // Begin.
  /// A GET that subscribes (R0.12-R0.17).
  Outcome subscribe(Context& context, Protocol protocol);
  /// POST of a description to the container of subscriptions.
  Outcome create(Context& context);
  Result<Subscribed> make_feed(FeedSubscription wanted, TimePoint now);
  /// Makes one that was judged already.
  SubscriptionResource& make(SubscriptionRequest request, std::size_t base, std::string id, Utc created);
  /// The same for a request of a client.
  SubscriptionResource& make(const Context& context, SubscriptionRequest request);

  // End.
  /// Ends one. A WebSocket or event stream that is open is closed; a code of 0: it is closed already.
  void end(SubscriptionResource& s, std::uint16_t code, std::string reason);
  /// Ends all that observe a resource.
  void end_all_of(const Resource& observed, std::uint16_t code, const std::string& reason);
  void resource_removed(SubscriptionResource& s);
  void renew_rights();
  void sign_out(std::string_view principal);

  // Transports.
  std::optional<Channel> next_ready(TimePoint now);
  void take_ready(std::vector<ReadyChannel>& channels, TimePoint now);
  std::optional<Push> next_push(Channel channel, TimePoint now);
  void closed(Channel channel);
  std::optional<std::chrono::steady_clock::time_point> next_deadline() const;

  // Feeds.
  std::optional<FeedMessage> next_feed_message(Channel channel, TimePoint now);
  /// Whether the next message of a channel is that its subscription has ended.
  bool has_ended(Channel channel) const { return !find(channel) && closing_.has_no_items(channel); }
  bool repeat(Channel channel);

  // Deliverers.
  std::vector<subscription::ReadyCallback> take_callbacks() { return std::exchange(parts_.schedule.ready().callbacks, {}); }
  std::optional<subscription::Notification> next_notification(Channel channel, TimePoint now);
  void delivered(Channel channel, const subscription::DeliveryResult& result, TimePoint now);

 private:
  SubscriptionResource* find(Channel channel) const { return parts_.subscribers.find(channel); }
  void read_first_value(SubscriptionResource& s);
  void scan(TimePoint now);
  void renew_some();
  Push heartbeat(const SubscriptionResource& s, TimePoint now) const;
  subscription::Item take_item(SubscriptionResource& s, TimePoint now);
  Meaning meaning_of(const SubscriptionResource& s) const;
  void keep_values(const SubscriptionResource& s, bool keep);
  void report(SubscriptionEvent::Kind kind, const SubscriptionResource& s, bool requested);

  const ReceiverParts& parts_;
  const SubscriptionRequests& requests_;
  Registry& registry_;
  Representations& representations_;
  PropertyValues& values_;
  ChangeScanner& scanner_;
  ClosingChannels closing_;
  Heartbeats heartbeats_;
  std::vector<Channel> renewing_;  ///< whose rights are to be checked again
  std::vector<SubscriptionEvent> events_;
};

}  // namespace lrt::engine

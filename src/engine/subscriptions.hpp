// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/engine/handler.hpp>
#include <lrt/subscription/allowed_hosts.hpp>
#include <lrt/subscription/notification.hpp>

#include "src/engine/bases.hpp"
#include "src/engine/bodies.hpp"
#include "src/engine/change_scanner.hpp"
#include "src/engine/deadline_queue.hpp"
#include "src/engine/pending_saves.hpp"
#include "src/engine/registry.hpp"
#include "src/engine/representations.hpp"
#include "src/engine/resources/subscription.hpp"
#include "src/subscription/callback_url.hpp"

namespace lrt::engine {
inline namespace v0 {

/// The name of a server in its notifications: `<id of the process>; base="<base IRI>"`. A server refuses notifications as commands: a robot
/// that executed them could be moved by any subscriber of another robot, and endlessly by its own notifications.
inline constexpr std::string_view notification_field = "Lrt-Notification-Of";

/// Subscriptions: created by Upgrade, event stream, or POST; notified of changes; ended. Messages are pulled: a channel is reported once, and
/// the transport or the deliverer takes its next message when the subscriber can take it.
class Subscriptions {
 public:
  using Instant = std::chrono::steady_clock::time_point;

  Subscriptions(const EngineOptions& options, Registry& registry, Bases& bases, const Responses& responses, Bodies& bodies,
                Representations& representations, PropertyValues& values, ChangeScanner& scanner, PendingSaves& saves, const Clock& clock);

  /// @par Errors  invalid_option: of the options of subscriptions and callbacks
  Result<void> check_options() const;
  bool empty() const noexcept { return by_channel_.empty() && closing_.empty(); }
  bool makes_callbacks() const { return allowed_ && !allowed_->empty(); }
  /// This server may post to the URL.
  bool may_call(const subscription::CallbackUrl& url) const;

  // Requests.
  /// The protocol by which a GET of an observable resource subscribes; nullopt: it does not. For a HEAD only an event stream counts.
  std::optional<Protocol> requested_protocol(const Context& context) const;
  /// GET with Upgrade: websocket or callback, or for an event stream (R0.12-R0.17).
  Outcome subscribe(Context& context, Protocol protocol);
  /// POST of a description to the container of subscriptions.
  Outcome create(Context& context);
  /// Whether a request is a notification from a sender that is not in the list of those whose notifications are executed.
  bool is_refused_notification(const http::Request& request) const;

  /// Makes one that was judged already.
  SubscriptionResource& make(SubscriptionRequest request, std::size_t base, std::string id, Utc created);
  /// DELETE of one, with the response if it succeeds.
  Outcome cancel(Context& context, SubscriptionResource& s, http::Response response);
  /// Ends one. A WebSocket or event stream that is open is closed; a code of 0: it is closed already.
  void end(SubscriptionResource& s, std::uint16_t code, std::string reason);
  /// Ends all that observe a resource.
  void end_all_of(const Resource& observed, std::uint16_t code, const std::string& reason);
  std::size_t callback_count() const noexcept { return callbacks_; }
  EngineCounts counts() const;

  std::vector<SubscriptionEvent> take_events() { return std::exchange(events_, {}); }
  /// The current rights of the owner of a subscription; nullopt: it may not subscribe to the resource.
  std::optional<Audience> renewed(const Audience& owner, const Resource& observed) const;
  void renew_rights();

  // Observers.
  void changed(SubscriptionResource& s);
  /// Adds the current representation to the queue, if a change is not in it yet.
  void fill(SubscriptionResource& s);
  void resource_removed(SubscriptionResource& s);

  // Feeds.
  Result<Subscribed> make_feed(FeedSubscription wanted, TimePoint now);
  std::optional<FeedMessage> next_feed_message(Channel channel, TimePoint now);
  /// Whether the next message of a channel is that its subscription has ended.
  bool has_ended(Channel channel) const;
  bool repeat(Channel channel);

  // Transports.
  std::optional<Channel> next_ready(TimePoint now);
  void take_ready(std::vector<ReadyChannel>& channels, TimePoint now);
  std::optional<Push> next_push(Channel channel, TimePoint now);
  void closed(Channel channel);
  std::optional<Instant> next_deadline() const;

  // Deliverers.
  std::vector<subscription::ReadyCallback> take_callbacks() { return std::exchange(callbacks_ready_, {}); }
  std::optional<subscription::Notification> next_notification(Channel channel, TimePoint now);
  void delivered(Channel channel, const subscription::DeliveryResult& result, TimePoint now);

 private:
  /// A WebSocket or event stream that has ended and stays open until its transport has closed it.
  struct ClosingChannel {
    std::deque<subscription::Item> items;  ///< to be sent before the close
    bool text;
    std::uint16_t code;
    std::string reason;
    std::size_t bytes = 0;  ///< of the items, if it is one of a feed
  };
  /// Limits of the items of feeds that have ended, and which the host does not take.
  static constexpr std::size_t max_closing_feeds = 1'000, max_closing_feed_bytes = 4 * 1024 * 1024;

  SubscriptionResource* find(Channel channel) const;
  void limit_closing_feeds();
  void forget_closing(Channel channel);
  subscription::Policy default_policy(const Resource& observed) const;
  std::optional<http::Response> refused_receiver(const Context& context, const std::string& url) const;
  std::optional<http::Response> too_many(const Context& context, Protocol protocol) const;
  std::optional<http::Response> read_query(const Context& context, SubscriptionRequest& request) const;
  void scan(TimePoint now);
  Representations::Attempt open(Context& context, SubscriptionRequest request, bool current);
  Outcome make_callback(Context& context, SubscriptionRequest request);
  http::Response stream_response(const Context& context) const;
  http::Response description_response(const Context& context, SubscriptionResource& made) const;

  void first_notification(SubscriptionResource& s);
  void enqueue(SubscriptionResource& s, bool is_change = true);
  Representation* represent(SubscriptionResource& s);
  void took(const Resource& observed, Instant before);
  std::optional<Instant> rest_of(const SubscriptionResource& s, TimePoint now) const;
  subscription::Item item_of(const SubscriptionResource& s, Representation& representation);
  void announce(SubscriptionResource& s);
  subscription::Item next_item(SubscriptionResource& s, TimePoint now);
  void report(SubscriptionEvent::Kind kind, const SubscriptionResource& s, bool requested);
  void notify_of_structure();
  bool must_confirm(const std::string& url) const;
  subscription::Notification confirmation_of(SubscriptionResource& s) const;

  const EngineOptions& options_;
  Registry& registry_;
  Bases& bases_;
  const Responses& responses_;
  Bodies& bodies_;
  Representations& representations_;
  PropertyValues& values_;
  ChangeScanner& scanner_;
  PendingSaves& saves_;
  const Clock& clock_;
  const Result<subscription::AllowedHosts> allowed_;
  const Result<subscription::AllowedHosts> loopback_ = subscription::AllowedHosts::parse({"127.0.0.0/8", "::1"});
  const std::string instance_;

  std::uint64_t next_channel_ = 1;
  std::unordered_map<std::uint64_t, SubscriptionResource*> by_channel_;
  std::unordered_map<std::uint64_t, ClosingChannel> closing_;
  std::set<std::uint64_t> closing_feeds_;  ///< those in closing_ that belong to feeds and have items, the oldest first
  std::size_t closing_feed_bytes_ = 0;     ///< of their items
  std::size_t callbacks_ = 0;
  std::size_t feeds_ = 0;
  std::uint64_t sent_ = 0;     ///< of all subscribers
  std::uint64_t dropped_ = 0;  ///< of former subscribers
  std::vector<SubscriptionEvent> events_;
  ClientCounts clients_;  ///< clients with subscriptions; restored subscriptions have no client

  std::deque<Channel> urgent_, ready_;  ///< to be named by next_ready()
  std::vector<subscription::ReadyCallback> callbacks_ready_;
  DeadlineQueue<Channel> next_notifications_;
  std::unordered_set<std::uint64_t> slow_;  ///< ResourceIds of those whose last representation took long
  Instant rest_end_{};                      ///< none of them is represented for subscribers before
  bool fills_queues_ = false;               ///< a scan, whose share of time is bounded, is under way
  std::vector<Channel> marked_;             ///< with a queue, and changed between two scans
  std::size_t queued_bytes_ = 0;            ///< of all subscribers
  std::uint64_t notified_structure_ = 1;
};

/// Accept names the media type of event streams, and the transport can send them. A wildcard does not count.
bool names_event_stream(const http::Request& request);

/// A number of seconds from 0 to max_interval; nullopt: it is something else.
std::optional<std::chrono::milliseconds> interval_of(std::string_view seconds);

}  // namespace v0
}  // namespace lrt::engine

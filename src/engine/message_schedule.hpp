// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <unordered_set>
#include <vector>

#include <lrt/engine/engine.hpp>
#include <lrt/engine/handler.hpp>

#include "src/engine/change_scanner.hpp"
#include "src/engine/deadline_queue.hpp"
#include "src/engine/property_values.hpp"
#include "src/engine/ready_channels.hpp"
#include "src/engine/registry.hpp"
#include "src/engine/representations.hpp"
#include "src/engine/resources/subscription.hpp"
#include "src/engine/responses.hpp"
#include "src/engine/subscribers.hpp"

namespace lrt::engine {

/// Which subscriptions have a message, and when it may be sent: queues, urgent ones first, minimum intervals, rests after representations that
/// took long. Messages are pulled: a channel is reported once, and its sender takes the next message when the subscriber can take it.
class MessageSchedule {
 public:
  using Instant = std::chrono::steady_clock::time_point;
  /// Subscribers that one turn reports, wakes or judges, however many there are: the next turn follows at once. Clients can make them many, and a turn
  /// may be a step of a control loop.
  static constexpr std::size_t max_at_once = 256;

  MessageSchedule(const Registry& registry, const Responses& responses, Representations& representations, PropertyValues& values,
                  ChangeScanner& scanner, Subscribers& subscribers, const Clock& clock)
      : registry_(registry),
        responses_(responses),
        representations_(representations),
        values_(values),
        scanner_(scanner),
        subscribers_(subscribers),
        clock_(clock) {}

  // Changes.
  /// The representation of the observed resource has changed.
  void changed(SubscriptionResource& s);
  /// Adds the current representation to the queue, if a change is not in it yet.
  void fill(SubscriptionResource& s);
  /// The current representation is the first message.
  void begin(SubscriptionResource& s);
  /// The current representation is to be sent again.
  /// @return  its sender takes it: the channel is not reported
  bool repeat(SubscriptionResource& s);
  /// Adds the last representation of a resource that is about to be removed, if a change of it was not sent.
  void add_last(SubscriptionResource& s);

  // Messages.
  /// Reports the channel, unless it was reported already.
  void announce(SubscriptionResource& s);
  /// The same for a heartbeat, also while no message may be sent.
  void announce_heartbeat(SubscriptionResource& s);
  /// nullptr: none may be sent now
  subscription::Item next_item(SubscriptionResource& s, TimePoint now);
  /// Reports the channel when its next message is due.
  void wait_until_due(SubscriptionResource& s);
  /// A subscription ends.
  void forget(SubscriptionResource& s) { next_messages_.clear(s.next_message); }

  /// Finds what has changed.
  void scan(TimePoint now);
  ReadyChannels& ready() noexcept { return ready_; }
  std::optional<Instant> next_deadline() const;

 private:
  void enqueue(SubscriptionResource& s, bool is_change = true);
  bool fills_now(const SubscriptionResource& s);
  void mark(SubscriptionResource& s, subscription::Backlog::Pending as);
  Representation* represent(SubscriptionResource& s);
  void took(const Resource& observed, Instant before);
  std::optional<Instant> rest_of(const SubscriptionResource& s, TimePoint now) const;
  void notify_of_structure();
  void fill_marked();
  void begin_filling();
  bool may_fill() noexcept { return ++fills_ % fills_per_look != 0 || has_time(); }
  bool has_time() noexcept;

  const Registry& registry_;
  const Responses& responses_;
  Representations& representations_;
  PropertyValues& values_;
  ChangeScanner& scanner_;
  Subscribers& subscribers_;
  const Clock& clock_;

  ReadyChannels ready_;
  DeadlineQueue<Channel> next_messages_;
  std::unordered_set<std::uint64_t> slow_;  ///< ResourceIds of those whose last representation took long
  Instant rest_end_{};                      ///< none of them is represented for subscribers before
  static constexpr unsigned fills_per_look = 16;
  bool fills_queues_ = false;                      ///< a scan, whose share of time is bounded, is under way
  bool is_over_ = false;                           ///< it has no time left: those that are not filled yet are marked
  unsigned fills_ = 0;                             ///< of this scan
  Instant fill_end_{};                             ///< until when it may fill queues
  const subscription::Message* filled_ = nullptr;  ///< the last message that came into a queue; only compared
  std::vector<Channel> marked_;                    ///< with a queue, and changed between two scans
  std::uint64_t notified_structure_ = 1;
};

}  // namespace lrt::engine

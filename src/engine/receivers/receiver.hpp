// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <lrt/base/result.hpp>
#include <lrt/engine/engine.hpp>

#include "src/engine/callback_rules.hpp"
#include "src/engine/closing_channels.hpp"
#include "src/engine/context.hpp"
#include "src/engine/description.hpp"
#include "src/engine/expiry.hpp"
#include "src/engine/message_schedule.hpp"
#include "src/engine/overview.hpp"
#include "src/engine/pending_saves.hpp"
#include "src/engine/representations.hpp"
#include "src/engine/resources/subscription.hpp"
#include "src/engine/rights_changes.hpp"
#include "src/engine/subscribers.hpp"

namespace lrt::engine {

class CallbackReceiver;
class FeedReceiver;
class Subscriptions;

/// The parts of an engine that receivers use.
struct ReceiverParts {
  const EngineOptions& options;
  const Bases& bases;
  const Responses& responses;
  const Representations& representations;
  const CallbackRules& rules;
  PendingSaves& saves;
  Subscribers& subscribers;
  MessageSchedule& schedule;
  const RunTime& time;       ///< of heartbeats
  RightsChanges& rights;     ///< since requests were judged
  const std::string series;  ///< of the change numbers of this engine: another one has other numbers
};

/// The receiving end of one subscription: what a message is, how it is handed over, how the subscription ends, what is described of it. Each
/// protocol has a class.
class Receiver {
 public:
  explicit Receiver(SubscriptionResource& s) noexcept : s_(s) {}
  virtual ~Receiver() = default;
  Receiver(const Receiver&) = delete;
  Receiver& operator=(const Receiver&) = delete;

  // Messages.
  /// The message for a representation, shared by all receivers that get the same.
  virtual const subscription::Item& message_of(Representation& representation, Representations& representations) const {
    return representations.message_of(representation, s_.audience);
  }
  /// The message as it is sent to this receiver, or its first part.
  virtual Push push_of(const subscription::Item& item) {
    Push push;
    push.message = item->body;
    push.text = s_.its_variant.is_text();
    return push;
  }
  /// The message of a heartbeat with that stamp.
  virtual std::string heartbeat(const std::string& stamp) const {
    (void)stamp;
    return {};
  }
  /// The rest of the message whose first part was taken; nullopt: there is none.
  virtual std::optional<Push> rest() { return std::nullopt; }
  /// Reports the channel to its sender.
  virtual void announce(ReadyChannels& ready) const { (s_.observed.observable()->is_urgent() ? ready.urgent : ready.others).push_back(s_.channel); }
  /// A client has chosen the media type, and expects that the value has it.
  virtual bool chose_media_type() const noexcept { return true; }
  /// If the first value cannot be read, the subscription waits for one that can. Otherwise it ends.
  virtual bool waits_for_value() const noexcept { return false; }
  /// With a queue: a message may be repeated while the queue is empty.
  virtual bool repeats() const noexcept { return false; }

  /// The numbers in its messages can be compared with those of the same series.
  std::string series(const ReceiverParts& parts) const;

  // Begin and end.
  /// The subscription was made.
  virtual void made() {}
  /// DELETE of the subscription, with the response if it succeeds.
  virtual Outcome cancel(Context& context, http::Response response, Subscriptions& owner);
  /// When the subscription ends, its last message is sent, and then a close.
  virtual bool gets_close() const noexcept { return true; }
  /// @pre gets_close()
  virtual void close(ClosingChannels& closing, std::uint16_t code, std::string reason) {
    closing.add(s_.channel, closing_channel(code, std::move(reason)));
  }
  /// The subscription ends now.
  virtual void ended() {}

  // Description.
  /// The protocol in one word.
  virtual std::string_view name() const noexcept;
  /// URL of the receiver; empty: it has none.
  virtual std::string_view url() const noexcept { return {}; }
  /// Triples about the receiver.
  virtual void describe(About& about, const std::string& base) const { (void)about, (void)base; }
  /// The same in the document of the observed resource.
  virtual void describe_controls(About& about, const std::string& base) const { (void)about, (void)base; }
  /// Triples about the delivery of messages.
  virtual void describe_delivery(About& about) const { (void)about; }
  virtual void overview_delivery(Overview& o) const { o.json("suspended", "false"); }

  // What only one protocol has; nullptr: this is another.
  virtual CallbackReceiver* callback() noexcept { return nullptr; }
  virtual FeedReceiver* feed() noexcept { return nullptr; }

 protected:
  /// How the channel ends. The items leave the queue.
  ClosingChannel closing_channel(std::uint16_t code, std::string reason);

  SubscriptionResource& s_;
};

/// Of a DELETE.
inline constexpr std::uint16_t cancelled_code = 1000;
/// The subscriber has lost the right to it.
inline constexpr std::uint16_t withdrawn_code = 1008;
inline constexpr const char* cancelled_reason = "the subscription was cancelled";

}  // namespace lrt::engine

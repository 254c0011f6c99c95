// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <lrt/subscription/notification.hpp>

#include "src/engine/receivers/protocols.hpp"
#include "src/engine/receivers/receiver.hpp"
#include "src/subscription/retry_policy.hpp"

namespace lrt::engine {

/// GET with Upgrade: callback, or POST to the container (R0.13, R0.16). The response waits until the file has the subscription.
class CallbackOpening final : public Opening {
 public:
  constexpr CallbackOpening() noexcept = default;
  std::optional<http::Response> check(const Context& context, SubscriptionRequest& wanted, const ReceiverParts& parts) const override;
  std::string_view reached_maximum(const Subscribers& subscribers, const EngineOptions& options) const override;
  Outcome open(Context& context, SubscriptionRequest wanted, const ReceiverParts& parts, Subscriptions& subscriptions) const override;
};

/// A web callback: a message is a POST of the representation, one at a time, which is retried.
class CallbackReceiver final : public Receiver {
 public:
  CallbackReceiver(SubscriptionResource& s, SubscriptionRequest& request, const ReceiverParts& parts);

  void announce(ReadyChannels& ready) const override { ready.callbacks.push_back({s_.channel, host_}); }
  void made() override;
  /// The subscription continues until it is removed from the file. If that fails, nothing has changed.
  Outcome cancel(Context& context, http::Response response, Subscriptions& owner) override;
  bool gets_close() const noexcept override { return false; }
  void ended() override;
  std::string_view url() const noexcept override { return url_; }
  void describe(About& about, const std::string& base) const override;
  void describe_delivery(About& about) const override;
  void overview_delivery(Overview& o) const override;
  CallbackReceiver* callback() noexcept override { return this; }

  /// What the deliverer sends next; nullopt: nothing now.
  std::optional<subscription::Notification> next(TimePoint now);
  /// @return  false: the subscription ends
  bool delivered(const subscription::DeliveryResult& result, TimePoint now);
  /// The notification under way is not sent again if it fails: its receiver may not read all of it now.
  void withdraw_item() noexcept { is_withdrawn_ = true; }

  // The file of subscriptions.
  const std::string& secret() const noexcept { return secret_; }
  bool has_confirmed() const noexcept { return has_confirmed_; }
  bool is_cancelling() const noexcept { return cancellations_ != 0; }
  std::string saved_text;  ///< its text in the file; empty: not created yet

 private:
  subscription::Notification confirmation();
  void add_stamp(http::Fields& fields, const subscription::Item& item);
  bool failed(const subscription::DeliveryResult& result, bool confirming, subscription::Item item, TimePoint now);
  void succeeded();

  const ReceiverParts& parts_;
  const std::string url_, secret_;
  const std::string host_;  ///< scheme, host and port of the URL
  subscription::RetryPolicy retry_;
  subscription::Item under_way_;
  bool is_withdrawn_ = false;  ///< withdraw_item() since it was taken
  /// A message that was sent without success.
  struct Failed {
    std::uint64_t number, left_out;
  };
  std::uint64_t left_out_ = 0;    ///< changes before the one under way
  std::optional<Failed> failed_;  ///< the last attempt
  bool must_confirm_ = false;     ///< nothing is sent before the receiver has confirmed
  bool has_confirmed_;            ///< the receiver has confirmed, perhaps before a restart
  bool confirming_ = false;       ///< the receiver has been asked, and has not responded yet
  std::string last_error_;        ///< the text for the subscriber
  std::string logged_error_;      ///< the details for the operator
  unsigned cancellations_ = 0;    ///< requests that wait until it is removed from the file
};

}  // namespace lrt::engine
